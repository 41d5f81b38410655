r"""
Direct model reference adaptive control
=======================================

An unstable plant :math:`\dot{x} = 2x + \lambda u` shall follow :math:`\dot{x}_{m} = -3 x_{m} + 3 y_{d}`, and of
:math:`\lambda = 0.5` only the sign is known (Narendra and Annaswamy, *Stable Adaptive Systems*, 1989, section 3.3).
The gains of :math:`u = -\hat{W}^{T} (x, y_{d})` that make both equal are :math:`(3 + 2) / \lambda = 10` and
:math:`-3 / \lambda = -6`. A command with two frequencies excites both, so that the estimates converge to them.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers


@nlctl.equation
def unstable(x, v):
    return 2.0 * x[0] + 0.5 * v


command = nlctl.SumOfSines(
    order=0, amplitudes=(1.0, 1.0), frequencies=(1.0, 3.0), phases=(0.0, 1.0)
)
controller = nlctl.mrac(
    controllers.ReferenceModel(a=(3.0,), b=3.0),
    error=controllers.ModelError(K=(3.0,), Q=(1.0,)),
    basis=controllers.LinearRegressor(order=1),
    weights=controllers.AdaptiveWeights(nodes=2, Gamma=20.0, sigma_1=0.0),
    law=controllers.DirectLaw(),
)
plant = nlctl.PureFeedback(order=1, f=unstable)
loop = nlctl.interconnect(
    {"command": command, "plant": plant, "controller": controller, "actuator": nlctl.Gain()},
    outputs=["x1", "xm1"],
)
t = np.linspace(0, 120, 2401)
response = nlctl.input_output_response(loop, t)
states = dict(zip(nlctl.state_names(loop), response.states, strict=True))
W_hat = np.array([states[f"controller.weights.W_hat[{i}]"] for i in (0, 1)])
figure, (above, below) = plt.subplots(2, figsize=(6, 4))
above.plot(t[t < 20], response.outputs.T[t < 20], label=["x", r"$x_{m}$"])
above.legend()
below.plot(t, W_hat.T)
below.axhline(10, color="k", linestyle="--", linewidth=0.8)
below.axhline(-6, color="k", linestyle="--", linewidth=0.8)
below.set(xlabel="t (s)", ylabel=r"$\hat{W}$")

# %%
# The plant follows, and the estimates are the gains that match.
print(f"estimates: {W_hat[:, -1].round(3)}")
assert np.abs(W_hat[:, -1] - [10, -6]).max() < 0.1
assert np.abs(np.subtract(*response.outputs)[t > 100]).max() < 0.01
