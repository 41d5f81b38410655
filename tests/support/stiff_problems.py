"""Stiff problems of the literature, as users write them; their ends and starts."""

import numpy as np


def van_der_pol(t, x, u, p):
    """mu = 1e3 in the scaled time of the test set: eps x2' = (1 - x1^2) x2 - x1."""
    return np.array([x[1], ((1 - x[0] * x[0]) * x[1] - x[0]) * 1e6])


def robertson(t, x, u, p):
    """Robertson's kinetics: rates of 0.04, 1e4 and 3e7."""
    first, second, third = 0.04 * x[0], 1e4 * x[1] * x[2], 3e7 * x[1] * x[1]
    return np.array([second - first, first - second - third, third])


def hires(t, y, u, p):
    """High irradiance response, eight states."""
    bond = 280 * y[5] * y[7]
    return np.array(
        [
            -1.71 * y[0] + 0.43 * y[1] + 8.32 * y[2] + 0.0007,
            1.71 * y[0] - 8.75 * y[1],
            -10.03 * y[2] + 0.43 * y[3] + 0.035 * y[4],
            8.32 * y[1] + 1.71 * y[2] - 1.12 * y[3],
            -1.745 * y[4] + 0.43 * y[5] + 0.43 * y[6],
            -bond + 0.69 * y[3] + 1.71 * y[4] - 0.43 * y[5] + 0.69 * y[6],
            bond - 1.81 * y[6],
            1.81 * y[6] - bond,
        ]
    )


PROBLEMS = {
    "van der Pol, mu = 1000": (van_der_pol, 2.0, (2.0, 0.0)),
    "Robertson": (robertson, 4e4, (1.0, 0.0, 0.0)),
    "HIRES": (hires, 321.8122, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0057)),
}
"""By name: the right-hand side, the end (s) and the initial state."""
