r"""
Describing function of a dead zone
==================================

A dead zone of half width :math:`d` and slope 1 passes the share
:math:`1 - \frac{2}{\pi}\left(\arcsin\frac{d}{A} + \frac{d}{A}\sqrt{1 - (d/A)^{2}}\right)`
of the first harmonic of a sine with the amplitude :math:`A > d` (any textbook, such as Khalil, section 7.2).
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl

d = 0.5
record = nlctl.DeadZone(slope_r=1.0, slope_l=1.0, ripple_r=0.0, ripple_l=0.0, b_r=d, b_l=-d)
actuator = nlctl.block(record, "actuator")
phase = 2 * np.pi * (np.arange(2000) + 0.5) / 2000


def share(A):
    """The first harmonic of the output over the amplitude of the input."""
    v = np.array([actuator.output(0, [], [A * s])[0] for s in np.sin(phase)])
    return 2 * np.mean(v * np.sin(phase)) / A


A = np.linspace(0.6, 5, 23)
computed = np.array([share(value) for value in A])
known = 1 - 2 / np.pi * (np.arcsin(d / A) + d / A * np.sqrt(1 - (d / A) ** 2))

figure, axes = plt.subplots(figsize=(4.5, 3))
axes.plot(A, known, label="closed form")
axes.plot(A, computed, "o", markersize=4, label="from the block")
axes.set(xlabel="A", ylabel="gain of the first harmonic")
axes.legend()
assert np.abs(computed - known).max() < 1e-5
