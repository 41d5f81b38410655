r"""
A bound for all time of adaptive control
========================================

Model reference adaptive control with sigma-modification of an unstable plant :math:`\dot{x} = W x + u + d`, of which
:math:`|d| \leq D` is all that is known of the disturbance: :math:`u = -k x - \hat{W} x` and
:math:`\dot{\hat{W}} = \Gamma (P x^{2} - \sigma \hat{W})`. With :math:`V = P x^{2} + \tilde{W}^{2} / \Gamma` and
:math:`\tilde{W} = \hat{W} - W`, completing squares gives :math:`\dot{V} < 0` beyond :math:`V = c \max(1 / k, 1 / (\Gamma \sigma))` where :math:`c = P D^{2} / k + \sigma W^{2}`.
Here that is proved in interval arithmetic, with d as a coordinate of the box: whatever d does, V comes below.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from analysis.lyapunov import Box, prove_decrease

W, k, Gamma, sigma, D = 2.0, 1.0, 5.0, 0.2, 0.5
P = 1 / (2 * k)  # 2 k P = 1
floor = (P * D**2 / k + sigma * W**2) * max(1 / k, 1 / (Gamma * sigma))


def V(z):
    x, W_hat, _ = z
    return P * x * x + (W_hat - W) * (W_hat - W) / Gamma


def gradient(z):
    x, W_hat, _ = z
    return 2 * P * x, 2 * (W_hat - W) / Gamma, 0.0


def rhs(z, sigma=sigma, sign=1.0):
    x, W_hat, d = z
    return W * x - sign * (k + W_hat) * x + d, Gamma * (P * x * x - sigma * W_hat), 0.0


@nlctl.equation
def f(x, v):
    return 2.0 * x[0] + v


@nlctl.equation
def d(x, t):
    return 0.5 * np.sin(t)


# %%
# The equations of the proof are those of the loop: its right-hand side, at points of the box.
nothing = nlctl.SumOfSines(order=0, amplitudes=0.0, frequencies=1.0, phases=0.0)
controller = nlctl.mrac(
    nlctl.ReferenceModel(a=(k,), b=0.0),
    weights=nlctl.AdaptiveWeights(nodes=2, Gamma=Gamma, sigma_1=sigma),
    law=nlctl.ModelReferenceLaw(gain=1.0),
)
plant = nlctl.PureFeedback(order=1, f=f, d=d)
loop = nlctl.interconnect(
    {"nothing": nothing, "plant": plant, "controller": controller, "a": nlctl.Gain()},
    outputs=["x1"],
)
names = list(nlctl.state_names(loop))
places = [names.index("plant.x1"), names.index("controller.weights.W_hat[0]")]
for x, W_hat, t in np.random.default_rng(0).uniform([-4, -4, 0], [4, 8, 6], (100, 3)):
    start = nlctl.initial_state(loop, {"plant.x1": x, "controller.weights.W_hat[0]": W_hat})
    at_point = loop.dynamics(t, start, [])[places]
    assert np.allclose(at_point, rhs((x, W_hat, 0.5 * np.sin(t)))[:2], rtol=1e-12, atol=1e-12)

# %%
# The box holds all of V up to 8. Without sigma-modification, with the other sign of the input, and for a floor that is too
# low nothing is proved.
box = Box.of(x=(-4.5, 4.5), W_hat=(-5.0, 9.0), d=(-D, D))
level = 8.0
assert prove_decrease(V, gradient, rhs, box, level=level, floor=1.001 * floor).holds
wrong = {
    "no sigma": (lambda z: rhs(z, sigma=0.0), 1.001 * floor),
    "wrong sign": (lambda z: rhs(z, sign=-1.0), 1.001 * floor),
    "floor too low": (rhs, 0.3 * floor),
}
for equations, low in wrong.values():
    proof = prove_decrease(V, gradient, equations, box, level=level, floor=low, max_boxes=3000)
    assert not proof.holds

# %%
# So :math:`|x| \leq \sqrt{V / P}` in the end, for all time and every such d. A run with one of them is far below.
t = np.linspace(0, 40, 4001)
start = nlctl.initial_state(loop, {"plant.x1": 2.0})
x = nlctl.input_output_response(loop, t, 0, start).outputs[0]
figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(t, x)
axes.axhspan(-np.sqrt(floor / P), np.sqrt(floor / P), alpha=0.15)
axes.set(xlabel="t (s)", ylabel="x", title="a run, and the bound that is proved (shaded)")
assert V((2.0, 0.0, 0.0)) < level
assert np.abs(x[t > 20]).max() < np.sqrt(floor / P)
