"""Linear models of rigs and the simulation of a transfer function, for assets/golden/linear.json.

The rigs' equations are written out anew; Jacobians by complex steps, zeros by the generalised eigenvalue problem and
again by python-control, the simulation by residues and again by a fine grid on which the dead time is whole.

    pip install numpy scipy control
    python linear_control.py linear.json
"""
import json
import platform
import sys

import control
import numpy as np
import scipy
from scipy.optimize import brentq
from scipy import signal, linalg

CURVE = [(1.1, 0), (1.2, 0), (1.3, 0), (1.4, 35.97859799), (1.5, 42.78600471),
  (1.6, 47.35049783), (1.7, 50.88142123), (1.8, 53.80055265), (1.9, 56.30954892), (2.0, 58.52194421),
  (2.1, 60.50854814), (2.2, 62.3167597), (2.3, 63.98), (2.4, 65.52279383), (2.5, 66.96371622),
  (2.6, 68.31720243), (2.7, 69.59471243), (2.8, 70.80550922), (2.9, 71.95719597), (3.0, 73.05609694),
  (3.1, 74.10753401), (3.2, 75.1160316), (3.3, 76.08547122), (3.4, 77.01920996), (3.5, 77.92017261)]
X, Q = map(np.array, zip(*CURVE))

def root(x, d): return x / (x * x + d * d) ** 0.25

def jac(f, x):
    x = np.asarray(x, float); n = len(x); cols = []
    for j in range(n):
        z = x.astype(complex); z[j] += 1e-30j
        cols.append(np.imag(f(z)) / 1e-30)
    return np.array(cols).T

def pack(A, B, C, delays, states, point):
    A, B, C = map(np.atleast_2d, (A, B, C))
    sys_ = control.ss(A, B, C, np.zeros((C.shape[0], B.shape[1])))
    poles = np.linalg.eigvals(A)
    g0 = -C @ np.linalg.solve(A, B) if abs(np.linalg.det(A)) > 1e-14 else None
    w = [0.001, 0.01, 0.1]
    resp = [[[ [float(v.real), float(v.imag)] for v in row] for row in (C @ np.linalg.solve(1j*x*np.eye(len(A)) - A, B) @ np.diag(np.exp(-1j*x*np.array(delays))))] for x in w]
    out = {"states": states, "point": point, "A": A.tolist(), "B": B.tolist(), "C": C.tolist(), "delays_s": delays,
           "poles": sorted([[float(np.real(p)), float(np.imag(p))] for p in poles], reverse=True),
           "omega_rad_s": w, "response": resp}
    if g0 is not None: out["dc_gain"] = g0.tolist()
    return out

def stad(angles, wanted, level, delay):
    k1 = 137.6*np.sin(np.radians(angles[0]))**3; k2 = 60*np.sin(np.radians(angles[1]))**2 if angles[1] else 0.0; k3 = 63.6*np.sin(np.radians(angles[2]))**2
    d = 0.05
    def rhs(h, q):
        q1 = k1*root(h[0], d); q12 = k2*root(h[0]-h[1], d); q3 = k3*root(h[2], d)
        return np.array([q - q1 - q12, q12, q1 - q3]) / 150
    if wanted == 1: h1 = level; q = k1*root(h1, d); h2 = level
    h3_of = lambda q: brentq(lambda x: k3*root(x, d) - q, 0, 1e3, xtol=1e-15, rtol=1e-15)
    if wanted == 1: h3 = h3_of(q)
    else:
        h3 = level; q = k3*root(h3, d); h1 = brentq(lambda x: k1*root(x, d) - q, 0, 1e3, xtol=1e-15, rtol=1e-15); h2 = 0.0
    u = float(np.interp(q, Q[2:], X[2:])); i = int(np.searchsorted(X, u)); slope = (Q[i]-Q[i-1])/(X[i]-X[i-1])
    h = np.array([h1, h2, h3])
    A = jac(lambda z: rhs(z, q), h)
    B = jac(lambda z: rhs(h.astype(complex), z[0]), [q]) * slope
    C = [[0, 1, 0], [0, 0, 1]]
    out = pack(A, B, C, [delay], ["h1", "h2", "h3"], {"levels_cm": h.tolist(), "u": u, "slope": float(slope)})
    chans = []
    for row in range(2):
        # characteristic polynomials: N = det-based, independent of any zero finder
        c = np.array(C[row], float)
        num = np.poly(A - B @ c[None, :]) - np.poly(A)
        chans.append(num.tolist())
    out["numerators_full"] = chans; out["denominator_full"] = np.poly(A).tolist()
    return out

def quad(g1, g2, k1, k2, v0):
    A_ = np.array([28, 32, 28, 32.]); a = np.array([0.071, 0.057, 0.071, 0.057]); g = 981.0
    q = a*np.sqrt(2*g)
    def rhs(h, v, d=0.0):
        r = [root(x, d) for x in h]
        return np.array([-q[0]*r[0] + q[2]*r[2] + g1*k1*v[0], -q[1]*r[1] + q[3]*r[3] + g2*k2*v[1],
                         -q[2]*r[2] + (1-g2)*k2*v[1], -q[3]*r[3] + (1-g1)*k1*v[0]]) / A_
    v = np.array(v0)
    f3 = (1-g2)*k2*v[1]; f4 = (1-g1)*k1*v[0]
    h = np.array([((g1*k1*v[0]+f3)/q[0])**2, ((g2*k2*v[1]+f4)/q[1])**2, (f3/q[2])**2, (f4/q[3])**2])
    A = jac(lambda z: rhs(z, v), h); B = jac(lambda z: rhs(h.astype(complex), z), v)
    C = np.array([[1, 0, 0, 0], [0, 1, 0, 0.]])
    out = pack(A, B, C, [0.0, 0.0], ["h1", "h2", "h3", "h4"], {"levels_cm": h.tolist(), "v": v.tolist()})
    M = np.block([[A, B], [C, np.zeros((2, 2))]]); E = np.block([[np.eye(4), np.zeros((4, 2))], [np.zeros((2, 6))]])
    z = linalg.eigvals(M, E); z = sorted(float(x.real) for x in z if np.isfinite(x) and abs(x) < 1e3)
    out["zeros"] = z
    G = np.array(out["dc_gain"]); out["rga"] = (G*np.linalg.inv(G).T).tolist()
    return out

def lsim5():
    # G = 3 (s+0.2)(1-2s)/((s+0.1)(s+0.5)(s^2+0.4s+1)(s+2)) e^{-1.37 s}; zero-order hold at 0.25 s, 1.37 = 5.48 samples
    num = np.polymul([3, 0.6], [-2, 1]); den = np.polymul(np.polymul([1, 0.1], [1, 0.5]), np.polymul([1, 0.4, 1], [1, 2]))
    rng = np.random.default_rng(5); h = 0.25; N = 240; u = rng.integers(-2, 3, N).astype(float)
    L = 1.37
    # Superposed exact step responses by residues: y(t) = sum du_i s(t - t_i - L)
    r, p, k = signal.residue(num, np.polymul(den, [1, 0]))
    def s(t):
        t = np.asarray(t, float); out = np.zeros_like(t)
        m = t >= 0
        out[m] = np.real(np.sum(r[:, None]*np.exp(p[:, None]*t[m][None, :]), axis=0))
        return out
    t = np.arange(N)*h; y = np.zeros(N); last = 0.0
    for i in range(N):
        y += (u[i]-last)*s(t - i*h - L); last = u[i]
    # second way: forced_response of python-control on a grid of 0.01 s, where 1.37 s is 137 samples
    fine = 0.01; n = int(round(N*h/fine)); uf = np.repeat(u, int(round(h/fine)))
    ud = np.concatenate([np.zeros(137), uf])[:n]
    ss = control.ss(*[np.array(x) for x in signal.tf2ss(num, den)])
    _, yf, _ = signal.dlsim(signal.cont2discrete((ss.A, ss.B, ss.C, ss.D), fine), ud)
    y2 = yf[::int(round(h/fine)), 0]
    return {"num": num.tolist(), "den": den.tolist(), "L_s": L, "sample_time_s": h, "u": u.tolist(), "y": y.tolist(), "second_way_differs_by": float(np.max(np.abs(y-y2)))}

origin = {"tools": f"Python {platform.python_version()}, numpy {np.__version__}, scipy {scipy.__version__}, control {control.__version__}"}
out = {"origin": origin,
 "stad_coupled_15": stad([30, 45, 90], 1, 15.0, 1.7), "stad_coupled_19": stad([30, 45, 90], 1, 19.0, 1.7),
 "stad_decoupled_15": stad([90, 0, 30], 2, 15.0, 1.3),
 "quadruple_minimum": quad(0.70, 0.60, 3.33, 3.35, (3.0, 3.0)), "quadruple_nonminimum": quad(0.43, 0.34, 3.14, 3.29, (3.15, 3.15)),
 "lsim_order_5": lsim5()}
# control's own zeros and dcgain as the second way
for key in ("quadruple_minimum", "quadruple_nonminimum"):
    c = out[key]; s = control.ss(np.array(c["A"]), np.array(c["B"]), np.array(c["C"]), np.zeros((2,2)))
    c["zeros_by_control"] = sorted(float(np.real(z)) for z in s.zeros())
    assert np.allclose(s.dcgain(), c["dc_gain"], rtol=1e-12)
print(out["quadruple_minimum"]["zeros"], out["quadruple_minimum"]["zeros_by_control"], out["quadruple_minimum"]["rga"], out["quadruple_minimum"]["point"])
print(out["quadruple_nonminimum"]["zeros"], out["quadruple_nonminimum"]["rga"], out["quadruple_nonminimum"]["point"])
print(out["stad_coupled_19"]["point"], out["stad_coupled_19"]["poles"], out["stad_coupled_19"]["dc_gain"], out["lsim_order_5"]["second_way_differs_by"])
if len(sys.argv) > 1: json.dump(out, open(sys.argv[1], "w"), indent=1)
