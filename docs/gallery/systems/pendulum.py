r"""
A pendulum as one's own plant
=============================

:math:`\ddot{\theta} = -\frac{g}{l} \sin\theta + v`, let go at 90 degrees: the period is
:math:`4 \sqrt{l/g} K(\sin^{2}(\theta_{0}/2))` with the complete elliptic integral of the first kind.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np
from scipy.special import ellipk

import nlctl

g, length, start = 9.81, 1.0, np.pi / 2


@nlctl.equation
def swing(x, v):
    return -9.81 * np.sin(x[0]) + v


plant = nlctl.block(nlctl.PureFeedback(order=2, f=swing, initial={"x1": start}), "plant")
exact = 4 * np.sqrt(length / g) * ellipk(np.sin(start / 2) ** 2)
t = np.linspace(0, 3 * exact, 3001)
response = nlctl.input_output_response(plant, t, 0, rtol=1e-10, atol=1e-12)
angle = response.states[0]

figure, axes = plt.subplots(figsize=(5, 3))
axes.plot(t, angle)
axes.set(xlabel="t (s)", ylabel="angle (rad)")

print(f"period {exact:.6f} s")
assert isinstance(plant, ct.NonlinearIOSystem)
assert np.abs(angle[[1000, 2000, 3000]] - start).max() < 1e-6
