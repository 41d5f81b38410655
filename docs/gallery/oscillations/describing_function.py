r"""
Describing function of a dead zone
==================================

A dead zone of half width :math:`d` and slope 1 passes the share
:math:`1 - \frac{2}{\pi}\left(\arcsin\frac{d}{A} + \frac{d}{A}\sqrt{1 - (d/A)^{2}}\right)`
of the first harmonic of a sine with the amplitude :math:`A > d` (any textbook, such as Khalil, section 7.2).
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

d = 0.5
record = nlctl.DeadZone(slope_r=1.0, slope_l=1.0, ripple_r=0.0, ripple_l=0.0, b_r=d, b_l=-d)
actuator = nlctl.block(record, "actuator")
A = np.linspace(0.6, 5, 23)
computed = ct.describing_function(actuator, A).real  # by simulation, with break points located
exact = 1 - 2 / np.pi * (np.arcsin(d / A) + d / A * np.sqrt(1 - (d / A) ** 2))

figure, axes = plt.subplots(figsize=(4.5, 3))
axes.plot(A, exact, label="closed form")
axes.plot(A, computed, "o", markersize=4, label="of the block")
axes.set(xlabel="A", ylabel="gain of the first harmonic")
axes.legend()
assert np.abs(computed - exact).max() < 1e-8
