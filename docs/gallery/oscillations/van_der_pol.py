r"""
Van der Pol's limit cycle
=========================

:math:`\ddot{x} = \mu (1 - x^{2}) \dot{x} - x` has one limit cycle. For small :math:`\mu` its period is
:math:`2 \pi (1 + \mu^{2}/16 - 5 \mu^{4}/3072)` up to the sixth order (Lindstedt and Poincaré).
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def update(t, x, u, params):
    return x[1], params["mu"] * (1 - x[0] ** 2) * x[1] - x[0]


mu = 0.3
oscillator = ct.nlsys(update, None, states=2, inputs=0, params={"mu": mu}, name="oscillator")
t = np.linspace(0, 80, 80_001)
response = nlctl.input_output_response(oscillator, t, 0, [0.5, 0.0], rtol=1e-10, atol=1e-12)
x1, x2 = response.states

figure, axes = plt.subplots(figsize=(4, 4))
axes.plot(x1, x2, linewidth=1)
axes.set(xlabel="x", ylabel="dx/dt", title="Van der Pol")

# %%
# The time between the last upward crossings of zero, by linear interpolation:
up = np.nonzero((x1[:-1] < 0) & (x1[1:] >= 0))[0][-2:]
first, last = t[up] - x1[up] * (t[up + 1] - t[up]) / (x1[up + 1] - x1[up])
exact = 2 * np.pi * (1 + mu**2 / 16 - 5 * mu**4 / 3072)
print(f"period {last - first:.6f}, series {exact:.6f}")
assert abs((last - first) - exact) < 1e-4
