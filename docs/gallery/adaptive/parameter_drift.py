r"""
Parameter drift, and three remedies
===================================

Model reference adaptive control, :math:`\dot{x} = W x + u + d` with :math:`u = -k x - \hat{W} x` and
:math:`\dot{\hat{W}} = \Gamma r x`. A disturbance that vanishes can drive :math:`\hat{W}` to infinity: after Ioannou and
Kokotovic (Automatica 20, 1984), :math:`d = x_{0} (1 + t)^{-1/5} + x_{0} (k - W)(1 + t)^{-2/5} - \frac{2}{5} x_{0}
(1 + t)^{-7/5}` makes :math:`\hat{W} = (1 + t)^{1/5}` and :math:`x = x_{0} (1 + t)^{-2/5}`, by the choice of
:math:`x_{0} = (5 \Gamma P)^{-1/2}`. Sigma-modification, e-modification and projection keep it bounded.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers

W, k, Gamma = 2.0, 1.0, 10.0
P = 1 / (2 * k)  # 2 k P = Q = 1
x_0 = (5 * Gamma * P) ** -0.5


@nlctl.equation
def f(x, v):
    return 2.0 * x[0] + v


@nlctl.equation
def d(x, t):
    s = 1 + t
    return 0.2 * (s**-0.2 - 1.0 * s**-0.4 - 0.4 * s**-1.4)  # x_0 = 0.2, k - W = -1


nothing = nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0)
plant = nlctl.PureFeedback(order=1, f=f, d=d)
remedies = {
    "gradient": controllers.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=0.0),
    "sigma-modification": controllers.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=0.02),
    "e-modification": controllers.EModifiedWeights(nodes=2, Gamma=Gamma, sigma=0.05),
    "projection": controllers.ProjectedWeights(nodes=2, Gamma=Gamma, W_max=2.5, width=0.1),
}
t, norms = np.linspace(0, 2000, 4001), {}
figure, axes = plt.subplots(figsize=(6, 3))
model, law = controllers.ReferenceModel(a=(k,), b=0.0), controllers.ModelReferenceLaw(gain=1.0)
for label, weights in remedies.items():
    controller = nlctl.mrac(model, weights=weights, law=law)
    blocks = {"nothing": nothing, "plant": plant, "controller": controller, "a": nlctl.Gain()}
    loop = nlctl.interconnect(blocks, outputs=["x1", "W_norm"])
    start = nlctl.initial_state(loop, {"plant.x1": x_0, "controller.weights.W_hat[0]": 1.0})
    x, norms[label] = nlctl.input_output_response(loop, t, 0, start).outputs
    axes.plot(t, norms[label], label=label)
axes.set(xlabel="t (s)", ylabel=r"$|\hat{W}|$", ylim=(None, 6))
axes.legend(ncols=2, loc="upper left")

# %%
# The closed form of the drift to infinity, and the bounds of those that do not drift.
print({label: round(float(norm[-1]), 3) for label, norm in norms.items()})
assert np.abs(norms["gradient"] - (1 + t) ** 0.2).max() < 1e-3 * norms["gradient"].max()
assert norms["projection"].max() <= 2.5
