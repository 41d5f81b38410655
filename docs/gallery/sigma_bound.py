r"""
A bound for all time of adaptive control
========================================

MRAC with sigma-modification of an unstable plant :math:`\dot{x} = W x + u + d`, :math:`|d| \leq D`:
:math:`u = -k x - \hat{W} x` and :math:`\dot{\hat{W}} = \Gamma (P x^{2} - \sigma \hat{W})`. With :math:`V = P x^{2} + (\hat{W} - W)^{2} / \Gamma`,
completing squares gives :math:`\dot{V} < 0` beyond :math:`V = c \max(1 / k, 1 / (\Gamma \sigma))`, :math:`c = P D^{2} / k + \sigma W^{2}`.
Interval arithmetic proves it with d as a coordinate of the box: whatever d does, V comes below.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from analysis.lyapunov import Box, prove_decrease

W, k, Gamma, sigma, D, P = 2.0, 1.0, 5.0, 0.2, 0.5, 0.5  # 2 k P = 1
floor = (P * D**2 / k + sigma * W**2) * max(1 / k, 1 / (Gamma * sigma))
V = lambda z: P * z[0] * z[0] + (z[1] - W) * (z[1] - W) / Gamma  # noqa: E731 (of x, W_hat, d)
gradient = lambda z: (2 * P * z[0], 2 * (z[1] - W) / Gamma, 0.0)  # noqa: E731


def rhs(z):
    x, W_hat, d = z
    return W * x - (k + W_hat) * x + d, Gamma * (P * x * x - sigma * W_hat), 0.0


box = Box.of(x=(-4.5, 4.5), W_hat=(-5.0, 9.0), d=(-D, D))
assert prove_decrease(V, gradient, rhs, box, level=8.0, floor=1.001 * floor).holds

# %%
# The equations of the proof are those of the loop: its right-hand side, at points of the box.
f = nlctl.equation(lambda x, v: 2.0 * x[0] + v)
d = nlctl.equation(lambda x, t: 0.5 * np.sin(t))
nothing = nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0)
weights = nlctl.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=sigma)
model, law = nlctl.ReferenceModel(a=(k,), b=0.0), nlctl.ModelReferenceLaw(gain=1.0)
controller = nlctl.mrac(model, weights=weights, law=law)
parts = {"nothing": nothing, "plant": nlctl.PureFeedback(order=1, f=f, d=d)}
loop = nlctl.interconnect(
    {**parts, "controller": controller, "actuator": nlctl.Gain()}, outputs=["x1"]
)
names = list(nlctl.state_names(loop))
places = [names.index("plant.x1"), names.index("controller.weights.W_hat[0]")]
for x, W_hat, t in np.random.default_rng(0).uniform([-4, -4, 0], [4, 8, 6], (100, 3)):
    start = nlctl.initial_state(loop, {"plant.x1": x, "controller.weights.W_hat[0]": W_hat})
    at_point = loop.dynamics(t, start, [])[places]
    assert np.allclose(at_point, rhs((x, W_hat, 0.5 * np.sin(t)))[:2], rtol=1e-12, atol=1e-12)

# %%
# So :math:`|x| \leq \sqrt{V / P}` in the end, for all time and every such d. A run with one of them is far below.
t = np.linspace(0, 40, 4001)
x = nlctl.input_output_response(loop, t, 0, {"plant.x1": 2.0}).outputs[0]
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(t, x)
axes.axhspan(-np.sqrt(floor / P), np.sqrt(floor / P), alpha=0.15)
axes.set(xlabel="t (s)", ylabel="x", title="a run, and the bound that is proved (shaded)")
assert np.abs(x[t > 20]).max() < np.sqrt(floor / P)
