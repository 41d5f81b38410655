r"""
Dynamic surface control with a network
======================================

Backstepping differentiates its virtual controls; dynamic surface control (Swaroop, Hedrick, Yip, Gerdes, IEEE Transactions
on Automatic Control 45, 2000) lets them pass a filter. Its price is known: :math:`\tau \ddot{e} + \dot{e} + c_{1} e =
-\tau \ddot{y}_{d}` where the plant is known. Where it is not, a network learns the rest (Wang and Huang, IEEE Transactions
on Neural Networks 16, 2005): here the pendulum behind a dead zone.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers


@nlctl.equation
def integrator(x, v):
    return v


@nlctl.equation
def pendulum(x, v):
    return -9.81 * np.sin(x[0]) - 0.1 * x[1] + v


tau, omega = 0.02, 1.3
grid = controllers.GaussianBasis(centres=controllers.grid_centres([7, 7], -2, 2), widths=(0.8,))
learning = controllers.AdaptiveWeights(nodes=49, Gamma=50.0, sigma_1=0.001)
none = controllers.Zero(outputs=("W_psi", "W_norm"))
loops = {
    "known plant": (integrator, nlctl.Gain(), none),
    "pendulum, no network": (pendulum, nlctl.DeadZone(), none),
    "pendulum, network": (pendulum, nlctl.DeadZone(), learning),
}
t, late = np.linspace(0, 40, 8001), {}
_, axes = plt.subplots(figsize=(6, 3))
for label, (f, actuator, weights) in loops.items():
    surface = controllers.DynamicSurface(c=(2.0, 8.0), tau=(tau,))
    controller = nlctl.dynamic_surface_control(surface, basis=grid, weights=weights)
    blocks = {
        "reference": nlctl.SumOfSines(order=1, amplitudes=1.0, frequencies=omega, phases=0.0),
        "plant": nlctl.PureFeedback(order=2, f=f, initial={"x1": 0.3}),
        "controller": controller,
        "actuator": actuator,
    }
    e = nlctl.input_output_response(nlctl.interconnect(blocks, outputs=["e", "u"]), t).outputs[0]
    axes.plot(t, e, label=label)
    late[label] = float(np.abs(e[t > 30]).max())
axes.set(xlabel="t (s)", ylabel="e")
axes.legend()

# %%
# The closed form of the known plant, and what the network takes off the error of the unknown one.
price = tau * omega**2 / abs(2.0 - tau * omega**2 + 1j * omega)
print(f"closed form {price:.5f}; found {late}")
assert abs(late["known plant"] - price) < 1e-3 * price
assert late["pendulum, network"] < 0.3 * late["pendulum, no network"]
