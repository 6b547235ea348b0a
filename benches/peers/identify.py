"""Fits the same record of a first order with dead time in Vasos and in the peers that are installed: see `run` beside it.

    python identify.py FIT_PROGRAM

What a peer cannot find by itself it is given: scipy a start near the truth, SIPPY the rest of the PV, the whole rows of
the dead time and the orders. Vasos is given the three columns.
"""

import contextlib
import importlib.metadata
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import time

import numpy as np
from scipy.optimize import least_squares

RUNS = 3
SPENT_S = 2.0
VASOS_RUNS = 50


def run_vasos(program, folder):
    path = folder / "fit.json"
    subprocess.run([program, str(VASOS_RUNS), path], check=True, stdout=subprocess.DEVNULL)
    return json.loads(path.read_text())


def scipy_fit(record):
    """Closed form of the response, sum over the moves; bias, gain and free state by linear least squares, T and L by trf."""
    t, u, y = (np.array(record[key]) for key in ("time_s", "mv", "pv"))
    moves = np.flatnonzero(np.diff(u)) + 1

    def columns(time_constant, dead_time):
        x = np.full_like(t, u[0])
        for k in moves:
            elapsed = t - (t[k] + dead_time)
            x -= (u[k] - u[k - 1]) * np.expm1(-np.maximum(elapsed, 0.0) / time_constant)
        return np.column_stack([np.ones_like(t), np.exp(-(t - t[0]) / time_constant), x])

    def linear(p):
        a = columns(np.exp(p[0]), p[1])
        # Normal equations: three well separated columns, and a tenth of the time of `lstsq`.
        return a, np.linalg.solve(a.T @ a, a.T @ y)

    def residuals(p):
        a, c = linear(p)
        return y - a @ c

    end = least_squares(residuals, [np.log(100.0), 5.0], bounds=([0.0, 0.0], [9.0, 500.0]), x_scale=[1.0, 10.0])
    return {"K": linear(end.x)[1][2], "T": np.exp(end.x[0]), "L": end.x[1]}


def sippy_fit(record):
    """Output error with one pole; the dead time's part of a row from the ratio of two coefficients of the numerator."""
    from sippy_unipi import system_identification

    h, rest = record["sample_time_s"], record["rest_rows"]
    u, y = np.array(record["mv"]), np.array(record["pv"])
    u, y = u - u[0], y - y[:rest].mean()
    whole = int(record["truth"]["L"] // h)
    with contextlib.redirect_stdout(io.StringIO()):
        found = system_identification(y, u, "OE", OE_orders=[2, 1, whole], tsample=h)
    num, den = np.trim_zeros(found.G.num[0][0], "f"), np.trim_zeros(found.G.den[0][0], "f")
    lag = len(den) - len(num) - 1
    num, den = num / den[0], den / den[0]
    time_constant = -h / np.log(-den[1])
    gain = num.sum() / den.sum()
    after = -time_constant * np.log(1.0 - num[0] / gain)
    return {"K": gain, "T": time_constant, "L": (lag + 1) * h - after}


def best_of(work):
    wall, processor, spent_s, result = [], [], 0.0, None
    while len(wall) < RUNS or spent_s < SPENT_S:
        begun = time.perf_counter(), time.process_time()
        result = work()
        wall.append(time.perf_counter() - begun[0])
        processor.append(time.process_time() - begun[1])
        spent_s += wall[-1]
    return min(wall), min(processor), result


def main(program):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        record = run_vasos(program, folder)
        rows, skipped = [], []
        peers = [("scipy least_squares", "scipy", scipy_fit), ("SIPPY, output error", "sippy_unipi", sippy_fit)]
        for label, package, fit in peers:
            print(f"{label} …", file=sys.stderr, flush=True)
            try:
                wall_s, processor_s, found = best_of(lambda: fit(record))
                rows.append((label, importlib.metadata.version(package), wall_s, processor_s, found))
            except (ImportError, importlib.metadata.PackageNotFoundError) as reason:
                skipped.append(f"{label}: {reason}")
            except (RuntimeError, ArithmeticError, ValueError) as reason:
                skipped.append(f"{label} failed: {reason}")
        # Before and after the peers: the better of both, as for them.
        best_s = min(record["seconds"], run_vasos(program, folder)["seconds"])
    rows.insert(0, ("**Vasos**, intervals included", record["version"], best_s, best_s, record["fit"]))
    truth, error = record["truth"], record["standard_error"]
    print(f"\nFit of {len(record['mv'])} rows, K {truth['K']}, T {truth['T']} s, L {truth['L']} s; one standard error is "
          f"K {error['K']:.4f}, T {error['T']:.2f} s, L {error['L']:.2f} s.\n")  # fmt: skip
    print("| | version | time | processor time | ratio of that | error of K | of T | of L |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for label, version, wall_s, processor_s, found in rows:
        off = {key: found[key] - truth[key] for key in truth}
        ratio = processor_s / best_s
        print(f"| {label} | {version} | {1e3 * wall_s:.1f} ms | {1e3 * processor_s:.1f} ms | {ratio:.3g} "
              f"| {off['K']:+.4f} | {off['T']:+.2f} s | {off['L']:+.2f} s |")  # fmt: skip
    print("\nSIPPY is told that the record starts at rest and where; the others estimate both, at the price of some accuracy.")
    for line in skipped:
        print(f"skipped: {line}")
    # All minimise one cost: what they find differs by less than a tenth of what noise allows.
    ours, scipys = rows[0][4], next((row[4] for row in rows if row[1] and row[0].startswith("scipy")), None)
    return int(scipys is not None and any(abs(ours[key] - scipys[key]) > 0.1 * error[key] for key in truth))


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1]))
