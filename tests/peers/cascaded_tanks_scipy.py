"""Records of two cascaded tanks that spill, for the fit of rigs: scipy's integrator, written from the equations alone.

    dx1/dt = q - k1 √x1 - l1 x1          q = max(0, g u + o); at x1 = H the surplus runs over
    dx2/dt = k1 √x1 + l1 x1 + c·spill - k2 √x2 - l2 x2

Run: python3 tests/peers/cascaded_tanks_scipy.py assets/golden
"""

import sys
from pathlib import Path

import numpy as np
import scipy
from scipy.integrate import solve_ivp

TRUTH = {"k1": 0.048, "k2": 0.055, "l1": 0.004, "l2": 0.002, "g": 0.051, "o": -0.012, "H": 8.2, "c": 0.35}
ROWS, PERIOD_S, NOISE = 1024, 4.0, 0.02


def slopes(x1, x2, flow, t=TRUTH):
    out1 = t["k1"] * np.sqrt(max(x1, 0.0)) + t["l1"] * max(x1, 0.0)
    out2 = t["k2"] * np.sqrt(max(x2, 0.0)) + t["l2"] * max(x2, 0.0)
    net = flow - out1
    spill = net if x1 >= t["H"] and net > 0.0 else 0.0
    return net - spill, out1 + t["c"] * spill - out2


def hold(x, flow):
    """The levels a period later. The rim is an event; while the upper tank is full only the lower one moves."""
    left = PERIOD_S
    while left > 1e-12:
        full = x[0] >= TRUTH["H"] - 1e-12 and slopes(TRUTH["H"] - 1e-9, x[1], flow)[0] > 0.0
        x1 = TRUTH["H"] if full else x[0]
        if full:
            rhs = lambda _, y: [0.0, slopes(x1, y[1], flow)[1]]
            events = None
        else:
            rhs = lambda _, y: slopes(min(y[0], TRUTH["H"] - 1e-12), y[1], flow)
            events = lambda _, y: y[0] - TRUTH["H"]
            events.terminal, events.direction = True, 1.0
        run = solve_ivp(rhs, (0.0, left), [x1, x[1]], rtol=1e-10, atol=1e-12, events=events)
        x = run.y[:, -1].copy()
        left -= run.t[-1]
        if not full and run.status == 1:
            x[0] = TRUTH["H"]
    return x


def record(rng, x):
    """Multisine about a working point, as strong as to spill now and then."""
    t = np.arange(ROWS) * PERIOD_S
    phases = rng.uniform(0.0, 2.0 * np.pi, 20)
    sines = sum(np.cos(2.0 * np.pi * (i + 1) * t / (ROWS * PERIOD_S) + p) for i, p in enumerate(phases))
    u = np.round(np.clip(3.0 + 0.9 * sines / np.std(sines), 0.4, 8.0), 4)
    rows = []
    for k in range(ROWS):
        rows.append((t[k], u[k], x[0], x[1]))
        x = hold(np.array(x), max(0.0, TRUTH["g"] * u[k] + TRUTH["o"]))
    rows = np.array(rows)
    noisy = rows[:, 3] + rng.normal(0.0, NOISE, ROWS)
    print(f"spilling in {np.mean(rows[:, 2] >= TRUTH['H'] - 1e-9):.1%} of the rows, levels {rows[:, 2:].min(0)} to {rows[:, 2:].max(0)}")
    return rows[:, 0], rows[:, 1], rows[:, 3], noisy


def main(folder):
    rng = np.random.default_rng(20)
    for name, start in [("estimation", (6.1, 5.2)), ("validation", (3.0, 4.4))]:
        t, u, exact, noisy = record(rng, start)
        lines = ["time_s,u_v,h2_v,h2_exact_v"]
        lines += [f"{a:g},{b:.4f},{d:.4f},{c:.7f}" for a, b, c, d in zip(t, u, exact, noisy)]
        Path(folder, f"cascaded_tanks_{name}.csv").write_text("\n".join(lines) + "\n")
    print("scipy", scipy.__version__, "numpy", np.__version__, TRUTH)


if __name__ == "__main__":
    main(sys.argv[1])
