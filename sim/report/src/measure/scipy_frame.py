"""Eq. 1 with NumPy and the search of its μ with SciPy: seconds and resultant of each frame, as JSON.

python scipy_frame.py MU_MAX EPSILON < input

The input is JSON: {"C": n × 3n, columns x, y and z, MPa for 1 N; "frames": stress of n taxels each, MPa}.
Π is that of dermis, -Σ log2(ε + |p|/Σp); w is (μ1 p, μ2 p, p) with (Gz + μ1 Gx + μ2 Gy) p = b.
"""

import json
import sys
import time

import numpy as np
from scipy.optimize import minimize

# Cost of a μ outside of the disc, or of forces that do not press.
REFUSED = 1e9


def solve(C, b, mu_max, epsilon):
    """Forces x, 3n, in N."""
    Gx, Gy, Gz = np.split(C, 3, axis=1)

    def pressure(mu):
        return np.linalg.solve(Gz + mu[0] * Gx + mu[1] * Gy, b)

    def cost(mu):
        if np.hypot(*mu) > mu_max:
            return REFUSED
        p = pressure(mu)
        total = p.sum()
        return np.log2(epsilon + np.abs(p) / total).sum() if total > 0 else REFUSED

    corners = np.array([[0, 0], [mu_max / 3, 0], [0, mu_max / 3]])
    found = minimize(cost, corners[0], method="Nelder-Mead", options={"initial_simplex": corners, "xatol": 1e-4, "fatol": 1e-6})
    p = pressure(found.x)
    w = np.concatenate([found.x[0] * p, found.x[1] * p, p])
    # C†b + (I - C†C) w
    return w + np.linalg.lstsq(C, b - C @ w)[0]


def main():
    mu_max, epsilon = map(float, sys.argv[1:])
    given = json.load(sys.stdin)
    C = np.array(given["C"])
    results = []
    for b in np.array(given["frames"]):
        begin = time.perf_counter()
        x = solve(C, b, mu_max, epsilon)
        results.append({"seconds": time.perf_counter() - begin, "resultant_N": x.reshape(3, -1).sum(axis=1).tolist()})
    json.dump(results, sys.stdout)


main()
