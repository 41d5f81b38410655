r"""
Extremum seeking
================

A lag whose performance :math:`y = 5 - (\theta - 2)^{2}` the controller does not know: it moves :math:`\theta` by
:math:`a \sin \omega t` and climbs along what comes back (Krstić and Wang, *Automatica* 36(4), 2000). With a fast
perturbation the average of its estimate is a second-order system in closed form:
:math:`s^{2} + \omega_{l} s - k \omega_{l} a^{2} h / 2 = 0`, :math:`h = y'' = -2`.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl

k, a, omega, omega_l = 8.0, 0.2, 60.0, 1.5
performance = ct.nlsys(
    None, lambda t, x, u, params: 5 - (u[0] - 2) ** 2, inputs=["theta"], outputs=["y"], name="map"
)
seeking = nlctl.controllers.ExtremumSeeking(k=k, a=a, omega=omega, omega_l=omega_l)
loop = nlctl.interconnect({"map": performance, "seeking": seeking}, outputs=["theta", "y"])
start = nlctl.initial_state(loop, {"seeking.theta_hat": 1.0, "seeking.eta": 4.0})
t = np.linspace(0, 12, 6001)
response = nlctl.input_output_response(loop, t, 0, start, rtol=1e-8)
theta_hat = response.states[nlctl.state_names(loop).index("seeking.theta_hat")]

# %%
# The average, from theta_hat - 2 = -1 and xi = 0.
h = -2.0
average = ct.ss([[0, k], [omega_l * a**2 * h / 2, -omega_l]], np.zeros((2, 1)), np.eye(2), 0)
closed = 2 + ct.initial_response(average, t, [-1.0, 0.0]).outputs[0]
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(t, response.outputs[0], linewidth=0.5, label=r"$\theta$")
axes.plot(t, theta_hat, label=r"$\hat\theta$")
axes.plot(t, closed, "k--", linewidth=0.8, label="average")
axes.set(xlabel="t (s)", ylabel=r"$\theta$")
axes.legend()
print(f"largest distance to the average {np.abs(theta_hat - closed).max():.4f}")
assert np.abs(theta_hat - closed).max() < 0.005
