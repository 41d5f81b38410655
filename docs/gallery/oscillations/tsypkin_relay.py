r"""
Tsypkin's relay oscillation
===========================

A relay of height :math:`h` and thresholds :math:`\pm a` in feedback with :math:`k / (1 + T s)` oscillates with the period
:math:`2 T \ln \frac{k h + a}{k h - a}`, exactly (Tsypkin 1984). The describing function, which keeps the first
harmonic only, finds no oscillation here: the plant's lag stays below 90 degrees, and so does that of the relay.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

k, T, h, a = 2.0, 1.0, 1.0, 0.5


@nlctl.record
class HeldRelay:
    """A relay whose output is its memory alone: within a step it does not switch."""

    inputs, outputs, states, feedthrough = ("u",), ("v",), ("side",), False
    memory, initial = ("side",), {"side": -1.0}

    @nlctl.equation
    def commit(t, x, u, p):
        return (np.where(u[0] >= 0.5, 1.0, np.where(u[0] <= -0.5, -1.0, x[0])),)

    @nlctl.equation
    def update(t, x, u, p):
        return (1e3 * (np.where(u[0] >= 0.5, 1.0, np.where(u[0] <= -0.5, -1.0, x[0])) - x[0]),)

    @nlctl.equation
    def output(t, x, u, p):
        return (1.0 * x[0],)

    @nlctl.equation
    def switching(t, x, u, p):
        return u[0] - 0.5, u[0] + 0.5


plant = ct.ss(-1 / T, k / T, -1, 0, inputs=["v"], outputs=["u"], name="plant")
loop = ct.interconnect(
    [plant, nlctl.block(HeldRelay(), "relay")], inputs=[], outputs=["u", "v"], name="loop"
)
t = np.linspace(0, 20, 20_001)
u, v = nlctl.input_output_response(nlctl.compile(loop), t, rtol=1e-9, atol=1e-11).outputs
plt.figure(figsize=(6, 3))
plt.plot(t, -u, t, v)
exact = 2 * T * np.log((k * h + a) / (k * h - a))
up = np.nonzero((u[:-1] < 0) & (u[1:] >= 0))[0]
period = np.diff(t[up] - u[up] * 1e-3 / (u[up + 1] - u[up]))[2:].mean()
print(f"period {period:.6f} s, Tsypkin {exact:.6f} s")
assert abs(period - exact) < 1e-4
