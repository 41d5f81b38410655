r"""
A barrier, proved
=================

A polynomial :math:`B \leq 0` at all starts and :math:`B > 0` in all that is unsafe, whose rate is negative where
:math:`B = 0`: no trajectory from a start ever meets what is unsafe. Prajna and Jadbabaie's example (2004) has starts
on both sides of a saddle; the polynomial is found as sums of squares in all of the plane and proved by rational
numbers.
"""

import matplotlib.pyplot as plt
import numpy as np

from nlctl.analysis.lyapunov import Box, barrier


def rhs(x):
    x1, x2 = x
    return x2, -x1 + x1**3 / 3 - x2


def start(x):
    return 0.25 - (x[0] - 1.5) ** 2 - x[1] ** 2


def unsafe(x):
    return 0.16 - (x[0] + 1) ** 2 - (x[1] + 1) ** 2


plane = Box.of(x1=(-np.inf, np.inf), x2=(-np.inf, np.inf))
safe = barrier(rhs, plane, start=start, unsafe=unsafe, degree=4)

x1, x2 = np.meshgrid(np.linspace(-3, 3, 121), np.linspace(-3, 3, 121))
B = np.vectorize(lambda a, b: safe.value((a, b)))(x1, x2)
figure, axes = plt.subplots(figsize=(4.5, 4))
axes.streamplot(x1, x2, *rhs((x1, x2)), density=0.8, linewidth=0.4, arrowsize=0.6)
axes.contour(x1, x2, B, levels=[0.0])
axes.contourf(x1, x2, start((x1, x2)), levels=[0.0, 1.0], alpha=0.4)
axes.contourf(x1, x2, unsafe((x1, x2)), levels=[0.0, 1.0], alpha=0.8)
axes.set(xlabel="x1", ylabel="x2", title="B = 0 between the starts (pale) and what is unsafe")

assert safe.holds
assert B[start((x1, x2)) >= 0].max() <= 0
assert B[unsafe((x1, x2)) >= 0].min() > 0
