"""FOPDT fits of three heater logs and of the rig's two golden step tests by scipy, independent of the project.

Model: y(t) = bias + d e^(-(t - t0)/T) + K x(t), T x' = -x + u(t - L), u held from its stamp to the next, x at rest
with the first MV at t0. Unknown: K, T, L >= 0, bias, d. All rows of the log, whatever their stamps.

    python tests/peers/fopdt_scipy.py DATA/tclab assets/golden > fopdt_scipy.json

The response is worked out in closed form, a sum over the moves of the MV, and least_squares (trf) is started from a
grid of (T, L); the best of its ends is polished with Nelder-Mead on the profiled cost, because the cost has a kink
wherever L passes a row.
"""

import json
import pathlib
import sys

import numpy as np
import scipy
from scipy.optimize import least_squares, minimize

LOGS = {
    "pds_TCLab_data.csv": dict(skip=1, time=0, mv=1, pv=2),
    "step_noheader.csv": dict(skip=0, time=0, mv=1, pv=2),
    "step_volt_degF.csv": dict(skip=1, time=0, mv=1, pv=2),
    "rig_step_tq2_coupled.csv": dict(skip=1, time=0, mv=1, pv=3),
    "rig_step_tq3_decoupled.csv": dict(skip=1, time=0, mv=1, pv=4),
}


def response(t, u, time_constant, dead_time):
    x = np.full_like(t, u[0])
    for k in np.flatnonzero(np.diff(u)) + 1:
        elapsed = t - (t[k] + dead_time)
        risen = elapsed > 0
        x[risen] += (u[k] - u[k - 1]) * -np.expm1(-elapsed[risen] / time_constant)
    return x


def columns(t, u, time_constant, dead_time):
    return np.column_stack(
        [np.ones_like(t), np.exp(-(t - t[0]) / time_constant), response(t, u, time_constant, dead_time)]
    )


def profiled(t, u, y, time_constant, dead_time):
    a = columns(t, u, time_constant, dead_time)
    linear, *_ = np.linalg.lstsq(a, y, rcond=None)
    return linear, y - a @ linear


def fit(t, u, y):
    span = t[-1] - t[0]

    def residuals(p):
        return profiled(t, u, y, np.exp(p[0]), p[1])[1]

    best = None
    for time_constant in np.geomspace(span / 100, 2 * span, 8):
        for dead_time in [0.0, 2.0, 5.0, 10.0, 20.0, 40.0, 80.0]:
            end = least_squares(
                residuals,
                [np.log(time_constant), dead_time],
                bounds=([np.log(1e-2), 0.0], [np.log(100 * span), 0.75 * span]),
                x_scale=[1.0, 10.0],
                xtol=1e-12,
                ftol=1e-14,
                gtol=1e-14,
            )
            if best is None or end.cost < best.cost:
                best = end
    cost = lambda p: float(np.sum(residuals([p[0], abs(p[1])]) ** 2))
    polished = minimize(cost, best.x, method="Nelder-Mead", options=dict(xatol=1e-11, fatol=1e-15, maxiter=4000))
    log_t, dead_time = polished.x[0], abs(polished.x[1])
    linear, r = profiled(t, u, y, np.exp(log_t), dead_time)
    return np.exp(log_t), dead_time, linear, r


def standard_errors(t, u, y, time_constant, dead_time, linear, r):
    def model(p):
        return columns(t, u, p[3], p[4]) @ p[:3]

    p = np.array([*linear, time_constant, dead_time])
    jacobian = np.empty((len(t), 5))
    for i in range(5):
        step = 1e-6 * max(abs(p[i]), 1e-3)
        up, down = p.copy(), p.copy()
        up[i] += step
        down[i] -= step
        jacobian[:, i] = (model(up) - model(down)) / (2 * step)
    covariance = np.linalg.inv(jacobian.T @ jacobian) * (r @ r) / (len(t) - 5)
    error = np.sqrt(np.diag(covariance))
    return error[2], error[3], error[4]


def main(*folders):
    fits = {}
    for name, at in LOGS.items():
        path = next(p for p in (pathlib.Path(f) / name for f in folders) if p.exists())
        data = np.loadtxt(path, delimiter=",", skiprows=at["skip"])
        t, u, y = data[:, at["time"]], data[:, at["mv"]], data[:, at["pv"]]
        time_constant, dead_time, linear, r = fit(t, u, y)
        errors = standard_errors(t, u, y, time_constant, dead_time, linear, r)
        fits[name] = {
            "rows": len(t),
            "K": float(linear[2]),
            "T_s": float(time_constant),
            "L_s": float(dead_time),
            "bias": float(linear[0]),
            "standard_error": dict(zip(["K", "T_s", "L_s"], map(float, errors))),
            "mse": float(r @ r / len(t)),
            "fit_percent": float(100 * (1 - np.linalg.norm(r) / np.linalg.norm(y - y.mean()))),
        }
    origin = f"tests/peers/fopdt_scipy.py, scipy {scipy.__version__}, numpy {np.__version__}"
    print(json.dumps({"origin": origin, "fits": fits}, indent=1))


if __name__ == "__main__":
    main(*sys.argv[1:])
