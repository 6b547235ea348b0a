"""Finds the same optima in Vasos and with scipy's SLSQP on a python-control frequency grid: see `run` beside it.

    python optimum.py OPTIMUM_PROGRAM

SLSQP minimises ln Jv over ln Kp and ln Ki, the limits on Ms and Mt at every frequency of the grid as constraints, from
five starts; of what it finds, what a grid ten times as dense calls stable is taken, its limits checked there.
"""

import importlib.metadata
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import control
import numpy as np
from scipy.optimize import minimize

VASOS_RUNS = 200
POINTS = 300
STARTS = [(0.2, 0.2), (0.5, 0.5), (1.0, 1.0), (0.5, 2.0), (0.05, 0.5)]


def response(problem, omega):
    """G(jω) from python-control, the dead time exact."""
    g = control.frequency_response(control.tf(problem["num"], problem["den"]), omega)
    return np.asarray(g.frdata).ravel() * np.exp(-1j * omega * problem["L_s"])


def grid(problem, points):
    roots = np.abs(np.concatenate([np.roots(problem["num"]), np.roots(problem["den"])]))
    own = list(roots[roots > 0]) + ([1 / problem["L_s"], 6 / problem["L_s"]] if problem["L_s"] else [])
    return np.geomspace(min(own) / 100, max(own) * 20, points)


def measures(problem, kp, ki, omega, g):
    c = kp - 1j * ki / omega
    l = g * c
    s = 1 / np.abs(1 + l)
    return s.max(), (np.abs(l) * s).max(), max((np.abs(g) / omega * s).max(), 1 / ki), l


def stable(l):
    """One integrator in the loop and a stable process: 1 + L turns by a quarter from ω → 0 to ∞."""
    angle = np.unwrap(np.angle(1 + l))
    first = (angle[0] + np.pi / 2 + np.pi) % (2 * np.pi) - np.pi
    return abs(first + (angle[-1] - angle[0]) - np.angle(1 + l[-1]) - np.pi / 2) < 0.5


def slsqp(problem, limits):
    omega = grid(problem, POINTS)
    g = response(problem, omega)
    turn = np.unwrap(np.angle(g))
    critical = omega[np.argmin(np.abs(turn + 2.3))]
    unit = 1 / np.abs(np.interp(critical, omega, np.abs(g)))

    def objective(x):
        return np.log(measures(problem, np.exp(x[0]), np.exp(x[1]), omega, g)[2])

    def room(x):
        c = np.exp(x[0]) - 1j * np.exp(x[1]) / omega
        l = g * c
        s = 1 / np.abs(1 + l)
        return np.concatenate([limits["Ms"] - s, limits["Mt"] - np.abs(l) * s])

    best = None
    dense = grid(problem, 10 * POINTS)
    g_dense = response(problem, dense)
    for a, b in STARTS:
        x0 = [np.log(a * unit), np.log(b * unit * critical * 0.3)]
        found = minimize(objective, x0, method="SLSQP", constraints={"type": "ineq", "fun": room},
                         options={"maxiter": 200, "ftol": 1e-10})  # fmt: skip
        kp, ki = np.exp(found.x)
        ms, mt, jv, l = measures(problem, kp, ki, dense, g_dense)
        if found.success and stable(l) and (best is None or jv < best["Jv"]):
            best = {"Kp": kp, "Ki": ki, "Jv": jv, "Ms": ms, "Mt": mt}
    return best


def main(program):
    with tempfile.TemporaryDirectory() as name:
        path = pathlib.Path(name) / "optimum.json"
        subprocess.run([program, str(VASOS_RUNS), path], check=True, stdout=subprocess.DEVNULL)
        ours = json.loads(path.read_text())
    limits = ours["limits"]
    versions = ", ".join(f"{p} {importlib.metadata.version(p)}" for p in ("scipy", "control"))
    print(f"\nLeast Jv of a PI under Ms ≤ {limits['Ms']}, Mt ≤ {limits['Mt']}: Vasos {ours['version']}, certified, against "
          f"SLSQP on {POINTS} frequencies ({versions}).\n")  # fmt: skip
    print("| process | Vasos | SLSQP | ratio | Jv Vasos | Jv SLSQP | Ms, Mt of SLSQP | better and feasible |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    worse = 0
    for problem in ours["problems"]:
        begun = time.perf_counter()
        found = slsqp(problem, limits)
        seconds = time.perf_counter() - begun
        times = f"| {problem['name']} | {1e6 * problem['seconds']:.0f} µs | {1e3 * seconds:.0f} ms | {seconds / problem['seconds']:.0f}"
        if found is None:
            print(f"{times} | {problem['Jv']:.6g} | none | – | Vasos |")
            continue
        met = found["Ms"] <= limits["Ms"] * (1 + 1e-6) and found["Mt"] <= limits["Mt"] * (1 + 1e-6)
        ahead = met and found["Jv"] < problem["Jv"] * (1 - 1e-4)
        worse += ahead
        verdict = "SLSQP" if ahead else "Vasos (SLSQP passes a limit)" if not met else "Vasos" if found["Jv"] > problem["Jv"] * (1 + 1e-4) else "equal"
        print(f"{times} | {problem['Jv']:.6g} | {found['Jv']:.6g} | {found['Ms']:.5f}, {found['Mt']:.5f} | {verdict} |")
    return int(worse > 0)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
