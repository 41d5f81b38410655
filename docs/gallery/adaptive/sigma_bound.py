r"""
A bound for all time of adaptive control
========================================

MRAC of an unstable plant :math:`\dot{x} = W x + u + d`, :math:`|d| \leq D`: :math:`u = -k x - \hat{W} x` with three
modifications of :math:`\dot{\hat{W}} = \Gamma r x`. ``certify`` reads the loop and proves bounds for all time of
:math:`V = P x^{2} + (\hat{W} - W)^{2} / \Gamma`, and so of x and :math:`\hat{W}`; without a modification it says why not.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl import controllers
from nlctl.analysis.lyapunov import Box, certify, prove_decrease

W, k, Gamma, sigma, D, P = 2.0, 1.0, 5.0, 0.2, 0.5, 0.5  # 2 k P = 1
f = nlctl.equation(lambda x, v: 2.0 * x[0] + v)
d = nlctl.equation(lambda x, t: 0.5 * np.sin(0.3 * t))
nothing = nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0)
remedies = {
    "gradient": controllers.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=0.0),
    "sigma-modification": controllers.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=sigma),
    "e-modification": controllers.EModifiedWeights(nodes=2, Gamma=Gamma, sigma=sigma),
    "projection": controllers.ProjectedWeights(nodes=2, Gamma=Gamma, W_max=2.5),
}
t, proved = np.linspace(0, 60, 6001), {}
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
for label, weights in remedies.items():
    controller = nlctl.mrac(controllers.ReferenceModel(a=(k,), b=0.0), weights=weights)
    parts = {"nothing": nothing, "plant": nlctl.PureFeedback(order=1, f=f, d=d)}
    blocks = {**parts, "controller": controller, "actuator": nlctl.Gain()}
    loop = nlctl.interconnect(blocks, outputs=["x1"], name=label)
    proved[label] = certify(loop)
    x = nlctl.input_output_response(loop, t).outputs[0]
    (line,) = axes.plot(t, np.abs(x), label=label, linewidth=1)
    if proved[label].holds:
        axes.axhline(proved[label].e, color=line.get_color(), linestyle="--")
        assert np.abs(x).max() < proved[label].e
axes.set(xlabel="t (s)", ylabel="|x|, and its bounds", ylim=(0, 3.2))
axes.legend(ncols=2, loc="center", bbox_to_anchor=(0.5, 0.75))

# %%
# With sigma-modification the bound is that of completed squares, :math:`V \leq c \max(1 / k, 1 / (\Gamma \sigma))`
# with :math:`c = P D^{2} / k + \sigma W^{2}`. With projection it is :math:`(W_{max} + W)^{2} / \Gamma + P D^{2} / k^{2}`.
print(proved["gradient"].reason, *proved.values(), sep="\n\n")
floor = (P * D**2 / k + sigma * W**2) * max(1 / k, 1 / (Gamma * sigma))
assert abs(proved["sigma-modification"].V_max - floor) < 1e-6
assert abs(proved["projection"].V_max - 4.5**2 / Gamma - P * D**2 / k**2) < 1e-6
assert not proved["gradient"].holds

# %%
# Another way to the same number, by hand: branch and bound with d as a coordinate of the box proves that V falls.
V = lambda z: P * z[0] * z[0] + (z[1] - W) * (z[1] - W) / Gamma  # noqa: E731 (of x, W_hat, d)
rates = lambda z: (W * z[0] - (k + z[1]) * z[0] + z[2], Gamma * (P * z[0] ** 2 - sigma * z[1]), 0.0)  # noqa: E731
box = Box.of(x=(-4.5, 4.5), W_hat=(-5.0, 9.0), d=(-D, D))
assert prove_decrease(V, rates, box, level=8.0, floor=1.001 * floor).holds
