r"""
A delay that grows: the pantograph equation
===========================================

:math:`\dot x(t) = -x(q t)` is fed back through a wire whose delay :math:`(1 - q)\, t` grows with time. Its solution from
:math:`x(0) = 1` is the series

.. math:: x(t) = \sum_{k=0}^{\infty} \frac{(-t)^k\, q^{k (k - 1) / 2}}{k!},

which oscillates more and more slowly (Ockendon and Tayler 1971 met the equation at the pantograph of a locomotive;
their paper was not at hand, the series is checked by differentiating it). The run begins at t = 1: earlier the delay is
not positive.
"""

from math import factorial

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl


def series(t, q):
    """The solution by its power series."""
    return sum((-t) ** k * q ** (k * (k - 1) / 2) / factorial(k) for k in range(60))


t = np.linspace(1, 20, 381)
plt.figure(figsize=(6, 3))
for q in (0.4, 0.6, 0.8):
    wire = nlctl.TransportDelay(
        inputs=("x",), outputs=("late",), delay=1 - q,
        varying=lambda t, q=q: (1 - q) * (t - 1), history=lambda t, q=q: series(t, q),
    )  # fmt: skip
    plant = ct.ss(0, -1, 1, 0, inputs="late", outputs="x", name="plant")
    loop = nlctl.interconnect({"wire": wire, "plant": plant}, outputs=["x"])
    x = nlctl.input_output_response(
        loop, t, 0, {"plant.x[0]": series(1.0, q)}, rtol=1e-10, atol=1e-12
    ).outputs[0]
    plt.plot(t, x, label=f"q = {q}")
    apart = np.abs(x - series(t, q)).max()
    print(f"q = {q}: largest difference from the series {apart:.1e}")
    assert apart < 1e-8
plt.axhline(0, color="0.7", linewidth=0.8)
plt.xlabel("t (s)")
plt.ylabel("x")
plt.legend()
