r"""
Exact linearization of a pendulum on a cart
===========================================

Upright, the linearized pendulum has the poles :math:`0, 0, \pm\sqrt{(M + m) g / (M l)}`. nlctl differentiates the
equations themselves; python-control's ``linearize`` takes differences of 1e-6.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

M, m, length, g = 2.0, 0.5, 0.8, 9.81


def update(t, x, u, params):
    _, angle, velocity, rate = x
    s, c = np.sin(angle), np.cos(angle)
    d = M + m * s**2
    push = (u[0] + m * s * (g * c - length * rate**2)) / d
    turn = (u[0] * c - m * length * rate**2 * s * c + (M + m) * g * s) / (length * d)
    return velocity, rate, push, turn


cart = ct.nlsys(update, None, states=4, inputs=["force"], name="cart")
exact = nlctl.compile(cart).linearize(np.zeros(4))
by_differences = ct.linearize(cart, np.zeros(4), [0.0])
closed = np.sqrt((M + m) * g / (M * length))
poles = np.sort(exact.poles().real)
figure, axes = plt.subplots(figsize=(4.5, 3))
axes.plot(exact.poles().real, exact.poles().imag, "x")
axes.set(xlabel="Re (1/s)", ylabel="Im (1/s)", title="Poles")
print(poles, closed)
assert np.abs(poles[[0, -1]] - [-closed, closed]).max() < 1e-12
assert np.abs(by_differences.A - exact.A).max() < 1e-4
