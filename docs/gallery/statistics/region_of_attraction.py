r"""
A region of attraction, proved
==============================

Van der Pol's equation in reverse time with :math:`V = 1.5 x_{1}^{2} - x_{1} x_{2} + x_{2}^{2}`. Khalil
(*Nonlinear Systems*, 3rd ed., Example 8.9) reads the level 2.25 from contour plots; here it is proved in
interval arithmetic that :math:`\dot{V} < 0` for :math:`0.05 \leq V \leq 2.25`. The largest level that is
proved is 2.3043, with a point where :math:`\dot{V} = 0` next to it.
"""

import matplotlib.pyplot as plt
import numpy as np

from nlctl.analysis.lyapunov import Box, prove_decrease, region_of_attraction


def V(x):
    x1, x2 = x
    return 1.5 * x1 * x1 - x1 * x2 + x2 * x2


def gradient(x):
    x1, x2 = x
    return 3 * x1 - x2, 2 * x2 - x1


def rhs(x):
    x1, x2 = x
    return -x2, x1 + (x1 * x1 - 1) * x2


box = Box.of(x1=(-3, 3), x2=(-3, 3))
proof = prove_decrease(V, rhs, box, level=2.25, floor=0.05)
largest = region_of_attraction(rhs, box, P=[[1.5, -0.5], [-0.5, 1.0]])

x1, x2 = np.meshgrid(np.linspace(-3, 3, 301), np.linspace(-3, 3, 301))
rate = sum(a * b for a, b in zip(gradient((x1, x2)), rhs((x1, x2)), strict=True))
figure, axes = plt.subplots(figsize=(4.5, 4))
axes.contourf(x1, x2, rate < 0, levels=[0.5, 1.5], alpha=0.2)
axes.contour(x1, x2, V((x1, x2)), levels=[2.25, largest.level])
axes.plot(largest.refuted["x1"], largest.refuted["x2"], "x")
axes.set(xlabel="x1", ylabel="x2", title="V = 2.25 and 2.3043 within V' < 0 (shaded)")

assert proof.holds
assert abs(largest.level - 2.30448) < 1e-3
assert not prove_decrease(V, rhs, box, level=2.4, floor=0.05).holds  # too large
