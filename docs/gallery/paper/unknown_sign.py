r"""
Nussbaum gain with an unknown sign
==================================

:math:`\dot{x} = x + b v` with :math:`b` unknown, even in sign:
:math:`u = N(\zeta) x`, :math:`\dot{\zeta} = x^{2}` with :math:`N = e^{\zeta^{2}} \cos(\pi \zeta / 2)` regulates it
for either sign (Nussbaum 1983). Along every run
:math:`x^{2}/2 = x(0)^{2}/2 + \int_{\zeta(0)}^{\zeta} (1 + b N(s)) \mathrm{d}s`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import quad

import nlctl


def N(z):
    return np.exp(z**2) * np.cos(np.pi * z / 2)


def update(t, x, u, params):
    return x[0] + params["b"] * N(x[1]) * x[0], x[0] ** 2


t = np.linspace(0, 8, 2001)
figure, axes = plt.subplots(figsize=(5, 3))
for b in (1.0, -1.0):
    loop = ct.nlsys(update, None, states=2, inputs=0, params={"b": b}, name="loop")
    response = nlctl.input_output_response(loop, t, 0, [1.0, 0.0], rtol=1e-10, atol=1e-12)
    x, zeta = response.states
    axes.plot(t, x, label=f"b = {b:g}")
    integral = quad(lambda z, b=b: 1 + b * N(z), 0.0, zeta[-1])[0]
    print(f"b = {b:g}: zeta ends at {zeta[-1]:.4f}")
    assert abs(x[-1] ** 2 / 2 - (0.5 + integral)) < 1e-7
    assert abs(x[-1]) < 1e-3
axes.set(xlabel="t (s)", ylabel="x")
axes.legend()
