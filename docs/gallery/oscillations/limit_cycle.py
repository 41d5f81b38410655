r"""
Predicted and simulated limit cycle
===================================

A describing function predicts a limit cycle where :math:`G(j\omega) N(A) = -1`. ``ct.describing_function`` takes every
block of nlctl, those with memory as well, and what the loop really does is simulated. Of a relay in feedback with
:math:`G = 1 / (s (s + 1))` the true period is known in closed form (Tsypkin): the relay switches where
:math:`y = \delta`, and by symmetry :math:`y` is :math:`-\delta` half a period earlier.
"""

import control as ct
import numpy as np
from scipy.optimize import brentq

import nlctl

delta = 0.1
relay = nlctl.block(nlctl.Relay(on=delta, off=-delta), "relay")
G = ct.tf([1], [1, 1, 0])
A = np.linspace(0.12, 1.5, 40)

N = ct.describing_function(relay, A)
exact = 4 / (np.pi * A) * (np.sqrt(1 - (delta / A) ** 2) - 1j * delta / A)
assert np.abs(N - exact).max() < 1e-6


def switching(h):
    """How far y is above delta when the relay has been at -1 for half a period h."""
    return np.tanh(h / 2) - h / 2 + delta


h = brentq(switching, 1e-3, 20)
(cycle,) = nlctl.limit_cycles(G, relay, A, np.logspace(-1, 1, 300))
print(
    f"predicted {cycle.predicted_omega:.4f} rad/s, simulated {cycle.omega:.4f}, true {np.pi / h:.4f}"
)
assert abs(cycle.omega - np.pi / h) < 1e-4 * cycle.omega
drawn = nlctl.describing_function_plot(G, relay, A, np.logspace(-0.3, 1, 300))
