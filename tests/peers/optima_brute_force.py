"""    python optima_brute_force.py OUT.json

Brute-force optima of PI controllers on dense frequency grids, exact dead time: numpy only, independent of Vasos.

Every (Kp, Ki) of a grid is checked: stability by unwrapping the argument of 1 + L over a dense grid, limits by the largest
value on that grid; then the grid is drawn closer about the best, fourteen times.
"""
import json, sys
import numpy as np

def G(case, w):
    s = 1j * w
    return np.polyval(case["num"], s) / np.polyval(case["den"], s) * np.exp(-s * case["L_s"])

def grid(case):
    roots = np.concatenate([np.roots(case["num"]), np.roots(case["den"])])
    mods = [abs(r) for r in roots if abs(r) > 1e-12]
    if case["L_s"] > 0: mods += [1 / case["L_s"], 3 / case["L_s"]]
    lo, hi = min(mods) / 300, max(mods) * 60
    w = np.geomspace(lo, hi, 1500)
    for r in roots:
        if abs(r.imag) > 0 and abs(r.real) < 0.3 * abs(r):
            w = np.concatenate([w, abs(r.imag) * (1 + np.linspace(-0.3, 0.3, 300))])
    if case["L_s"] > 0:
        w = np.concatenate([w, np.linspace(lo, 40 / case["L_s"], 1200)])
    return np.unique(w)

def solve(case):
    w = grid(case); g = G(case, w)
    n_origin = sum(1 for c in reversed(case["den"]) if c == 0)
    sign = np.sign(case["num"][-1] / [c for c in case["den"] if c != 0][-1])
    g = g * sign
    unstable_open = any(r.real > 1e-12 for r in np.roots(case["den"]))
    assert not unstable_open
    ms, mt, ju = (case["limits"][k] or np.inf for k in ("Ms", "Mt", "Ju"))
    jv_low = lambda ki: 1 / ki
    g0 = None if n_origin else abs(np.polyval(case["num"], 0) / np.polyval(case["den"], 0))
    def evaluate(kp, ki):
        # arrays of pairs x frequencies, in chunks
        out = np.full(kp.shape, np.inf)
        for i in range(0, len(kp), 400):
            p, q = kp[i:i+400, None], ki[i:i+400, None]
            c = p - 1j * q / w
            l = g * c
            d = np.abs(1 + l)
            S = (1 / d).max(1); T = (np.abs(l) / d).max(1); U = (np.abs(c) / d).max(1)
            V = (np.abs(g) / w / d).max(1)
            # The limits for ω → ∞ and ω → 0.
            U = np.maximum(U, p[:, 0])
            if g0: U = np.maximum(U, 1 / g0)
            V = np.maximum(V, 1 / q[:, 0])
            ang = np.unwrap(np.angle(1 + l), axis=1)
            # 1 + L ends near 1; from -n*90 deg at w -> 0 it has to turn by exactly +n*90 deg
            turn = ang[:, -1] - ang[:, 0]
            end = np.angle(1 + l[:, -1])
            start_expected = -(n_origin + 1) * np.pi / 2
            # winding: total from w->0 (argument start_expected, up to what the first point has turned already)
            first = np.angle(1 + l[:, 0])
            delta = (first - start_expected + np.pi) % (2 * np.pi) - np.pi
            total = delta + turn - end
            stable = np.abs(total - (n_origin + 1) * np.pi / 2) < 0.5
            feas = stable & (S <= ms) & (T <= mt * (1 + 1e-7)) & (U <= ju)
            val = V if case["objective"] == "jv" else -q[:, 0]
            out[i:i+400] = np.where(feas, val, np.inf)
        return out
    scale = 1 / np.abs(g[np.argmin(np.abs(np.unwrap(np.angle(g)) + 2.0))])
    w0 = w[np.argmin(np.abs(np.unwrap(np.angle(g)) + 2.0))]
    kps = np.concatenate([[0], np.geomspace(1e-3, 10, 60)]) * scale
    if n_origin: kps = kps[1:]
    kis = np.geomspace(1e-5, 10, 90) * scale * w0
    best = None
    for it in range(16):
        kp, ki = (a.ravel() for a in np.meshgrid(kps, kis))
        v = evaluate(kp, ki)
        k = int(np.argmin(v))
        if best is None or v[k] < best[0]: best = (v[k], kp[k], ki[k])
        if not np.isfinite(best[0]): return None
        if it == 0:
            hp, hi = 0.25 * max(best[1], 0.02 * scale), 0.25 * best[2]
        else:
            hp, hi = 0.55 * hp, 0.55 * hi
        kps = np.unique(np.maximum(best[1] + hp * np.linspace(-1, 1, 41), 0))
        if n_origin: kps = kps[kps > 0]
        kis = best[2] + hi * np.linspace(-1, 1, 41); kis = kis[kis > 0]
    v, kp, ki = best
    return {"Kp": sign * kp, "Ki": sign * ki, "value": v if case["objective"] == "jv" else ki}

def lag(n, t=1.0):
    p = [1.0]
    for _ in range(n): p = list(np.convolve(p, [t, 1.0]))
    return p
models = [
    ("four equal lags", [1.0], lag(4), 0.0), ("eight equal lags", [1.0], lag(8), 0.0),
    ("lags 1, 0.5, 0.25, 0.125", [1.0], list(np.convolve(np.convolve([1, 1], [.5, 1]), np.convolve([.25, 1], [.125, 1]))), 0.0),
    ("right half-plane zero 0.5", [-0.5, 1.0], lag(3), 0.0), ("right half-plane zero 2", [-2.0, 1.0], lag(3), 0.0),
    ("resonance zeta 0.1", [1.0], list(np.convolve([1, 1], [0.04, 0.04, 1])), 0.0),
    ("resonance zeta 0.3 with dead time", [2.0], [4.0, 1.2, 1.0], 0.5),
    ("long dead time", [1.0], [1.0, 1.0], 10.0), ("nearly pure dead time", [1.0], [0.05, 1.0], 1.0),
    ("lag dominated", [5.0], [100.0, 1.0], 1.0), ("negative gain", [-2.5], [30.0, 1.0], 4.0),
    ("integrator with dead time", [0.2], [1.0, 0.0], 3.0), ("integrator with lag", [1.0], [1.0, 1.0, 0.0], 0.2),
    ("zero in the left half-plane", [3.0, 1.0], [10.0, 7.0, 1.0], 1.0),
    ("second order with dead time", [1.7], [60.0, 17.0, 1.0], 2.0),
]
limits = [{"Ms": 1.4, "Mt": None, "Ju": None}, {"Ms": 2.0, "Mt": 1.4, "Ju": None}, {"Ms": 1.7, "Mt": 1.5, "Ju": "x"}]
cases = []
for i, (name, num, den, l) in enumerate(models):
    for k, lim in enumerate(limits):
        for objective in (("jv", "max-ki") if k == 0 else ("jv",)):
            lim2 = dict(lim)
            c = {"case": name, "num": num, "den": den, "L_s": l, "limits": lim2, "objective": objective}
            if lim2["Ju"] == "x":
                if den[-1] == 0: lim2["Ju"] = 1.0 / abs(num[-1]) * (0.5 if l else 0.8) / (max(l, 1))
                else: lim2["Ju"] = 2.0 / abs(num[-1] / den[-1])
            r = solve(c)
            if r is None: print("none", name, lim2, file=sys.stderr); continue
            c["optimum"] = r; cases.append(c)
            print(name, lim2, objective, r, file=sys.stderr, flush=True)
json.dump({"note": "brute force on dense frequency grids, numpy, exact dead time; value to about 1e-3", "cases": cases}, open(sys.argv[1], "w"), indent=1)
