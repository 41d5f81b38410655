r"""
Pulse-width modulation
======================

A lag behind pulses of 50 Hz whose width follows a slow sine: the input is 1 while the phase of the carrier is less than
:math:`d(t) = 0.5 + 0.4 \sin 2 \pi t`, otherwise 0. The comparison and the remainder stand in an equation as anyone writes
them; they are conditions of time alone, which are solved before the run, and steps end there. Between two switches the
lag is an exponential, so that it is known at the end of each period.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import nlctl

T, RATE = 0.02, 5.0


def duty(t):
    """Return the width of a pulse, as a part of its period."""
    return 0.5 + 0.4 * np.sin(2 * np.pi * t)


def lag(t, x, u, params):
    """The lag behind the pulses."""
    on = t % T < T * duty(t)
    return [RATE * (np.where(on, 1.0, 0.0) - x[0])]


system = ct.nlsys(lag, lambda t, x, u, p: x, inputs=0, outputs=["y"], states=1, name="lag")
compiled = nlctl.compile(system)
t = np.linspace(0, 1.5, 1501)
run = nlctl.input_output_response(compiled, t)
y, events = run.outputs.ravel(), run.events["time"].to_numpy()

figure, (whole, part) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
whole.plot(t, duty(t), "C1", label="d, the width")
whole.plot(t, y, "C0", label="y")
whole.set(xlabel="t (s)", ylabel="output (1)", ylim=(0, 1.2))
part.plot(t, y, "C0.-", markersize=3)
part.plot(events, np.interp(events, t, y), "k|", markersize=10, label="events")
part.set(xlabel="t (s)", ylabel="y (1)", xlim=(0.3, 0.4), ylim=(0.63, 0.75))
whole.legend(loc="upper right", ncols=2)
part.legend(loc="upper left")

value, exact = 0.0, [0.0]
for start in T * np.arange(75):  # up while the pulse lasts, down for the rest of its period
    width = brentq(lambda s, start=start: s - T * duty(start + s), 0, T, xtol=1e-15)
    value = (1 + (value - 1) * np.exp(-RATE * width)) * np.exp(-RATE * (T - width))
    exact.append(value)
print(compiled)
print(f"{events.size} events, y off by {abs(y[::20] - exact).max():.0e}")
assert abs(y[::20] - exact).max() < 1e-7
assert events.size == 149
