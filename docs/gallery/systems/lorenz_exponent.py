r"""
The Lyapunov exponent of Lorenz's system
========================================

The largest exponent is 0.9056 (Sprott, *Chaos and Time-Series Analysis*, 2003). Here the variational equation runs
next to the system, in machine code; its logarithm is rescaled by a state of its own.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def update(t, x, u, params):
    a, b, c, p, q, r, _ = x
    n = p * p + q * q + r * r
    dp, dq, dr = 10 * (q - p), (28 - c) * p - q - a * r, b * p + a * q - 8 / 3 * r
    rate = (p * dp + q * dq + r * dr) / n  # of the length's logarithm
    flow = 10 * (b - a), a * (28 - c) - b, a * b - 8 / 3 * c
    return *flow, dp - rate * p, dq - rate * q, dr - rate * r, rate


lorenz = ct.nlsys(update, None, states=7, inputs=0, name="lorenz")
t = np.linspace(0, 2000, 20_001)
start = [1.0, 1.0, 20.0, 1.0, 0.0, 0.0, 0.0]
x = nlctl.input_output_response(lorenz, t, 0, start, rtol=1e-8, atol=1e-8).states

figure, axes = plt.subplots(figsize=(6, 3))
axes.plot(t[10:], x[6, 10:] / t[10:])
axes.axhline(0.9056, color="black", linewidth=0.8)
axes.set(xlabel="t (s)", ylabel="exponent so far (1/s)", ylim=(0.7, 1.1))
exponent = (x[6, -1] - x[6, 200]) / (t[-1] - t[200])
print(f"{exponent:.3f}")
assert abs(exponent - 0.9056) < 0.02
assert np.allclose((x[3:6] ** 2).sum(axis=0), 1, atol=1e-3)  # the length stays 1
