"""Outputs of sampled PIDs by python-control, independent of the project.

C(s) = Kc(1 + 1/(Ti s) + Td s/(1 + s Td/N)) is turned into C(z) by Tustin's rule (control.sample_system) and driven
with a given error from rest (control.forced_response).

    python tests/peers/pid_python_control.py > assets/golden/pid_python_control.csv
"""

import sys

import control
import numpy as np
import scipy

CASES = [(1.8, 152.0, 0.0, 10.0, 0.2), (7.0, 15.0, 1.0, 10.0, 0.2), (-2.5, 4.0, 3.0, 3.0, 0.5), (4.0, np.inf, 2.0, 5.0, 0.1)]

s = control.tf("s")
print("case,kc,ti_s,td_s,n,h_s,e,u")
for case, (kc, ti, td, n, h) in enumerate(CASES):
    law = kc * (1 + (0 if np.isinf(ti) else 1 / (ti * s)) + td * s / (1 + s * td / n))
    sampled = control.sample_system(control.ss(law), h, method="bilinear")
    k = np.arange(300)
    e = np.where(k < 5, 0.0, 1.0 - 0.6 * (k > 120)) + 0.5 * np.sin(0.37 * k) * (k > 60)
    e = np.round(e * 1024) / 1024
    u = control.forced_response(sampled, T=k * h, U=e).outputs
    for x, y in zip(e, u):
        print(f"{case},{kc:g},{ti:g},{td:g},{n:g},{h:g},{x:.17g},{y:.17g}")
print(f"python-control {control.__version__}, numpy {np.__version__}, scipy {scipy.__version__}", file=sys.stderr)
