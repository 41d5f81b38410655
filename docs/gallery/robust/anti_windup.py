r"""
Windup of a PID controller
==========================

A saturated integrator continues to integrate. ``PID`` tracks its own limit with the time :math:`T_{t}`; with a very long
one it winds up and overshoots. While saturated at :math:`u_{max}`, a double integrator moves by
:math:`u_{max} t^{2} / 2`.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.equation
def mass(x, v):
    return v


t = np.linspace(0, 30, 6001)
figure, axes = plt.subplots(figsize=(6, 3))
overshoot = {}
for T_t in (0.5, 1e6):
    law = nlctl.PID(k_p=2.0, k_i=1.0, k_d=3.0, T_t=T_t, u_max=0.5)
    loop = nlctl.interconnect(
        {
            "reference": nlctl.FunctionReference(
                order=2, function=lambda t: (10.0 + 0 * t, 0 * t, 0 * t)
            ),
            "plant": nlctl.PureFeedback(order=2, f=mass),
            "controller": law,
            "actuator": nlctl.Gain(),
        }
    )
    y = nlctl.input_output_response(loop, t).outputs["y"]
    axes.plot(t, y, label=f"T_t = {T_t:g} s")
    overshoot[T_t] = float(np.max(y)) / 10 - 1
axes.set(xlabel="t (s)", ylabel="y")
axes.legend()

print(overshoot)
assert np.abs(y - 0.25 * t**2)[t < 2].max() < 1e-6
assert overshoot[0.5] < 0.5 * overshoot[1e6]
