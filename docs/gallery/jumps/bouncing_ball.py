r"""
A ball that bounces
===================

A state that jumps where a condition is met: :math:`\dot h = v`, :math:`\dot v = -g`, and where the height falls through 0
the ball continues with :math:`v^+ = -e v`. The block says where (``guard``) and what its states are behind the jump
(``reset``). The bounces are at :math:`t_0 + 2 t_0 (e + e^2 + \dots)` with :math:`t_0 = \sqrt{2 h_0 / g}`; they accumulate
at :math:`t_0 (1 + e) / (1 - e)`, where a run ends with an error that says so (Zeno).
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl


@nlctl.record
class Ball:
    """A ball above a floor."""

    g: float = nlctl.param(9.81, unit="m/s^2", meaning="acceleration of gravity", above=0)
    e: float = nlctl.param(0.8, unit="1", meaning="speed behind a bounce, before it 1", at_least=0)

    inputs, outputs, states, feedthrough = (), ("h",), ("h", "v"), False
    initial = {"h": 1.0}
    update = nlctl.equation(lambda t, x, u, p: (x[1], -p.g))
    output = nlctl.equation(lambda t, x, u, p: (x[0],))
    guard = nlctl.equation(lambda t, x, u, p: (x[0],))
    reset = nlctl.equation(lambda t, x, u, p: (0.0, -p.e * x[1]))


ball, t = nlctl.block(Ball(), "ball"), np.linspace(0, 3.5, 701)
run = nlctl.input_output_response(ball, t)
bounces = run.events["time"].to_numpy()

figure, axes = plt.subplots(figsize=(6, 3), layout="constrained")
axes.plot(t, run.outputs[0])
axes.plot(bounces, 0 * bounces, "k^", markersize=5, clip_on=False, label="events")
axes.set(xlabel="t (s)", ylabel="height (m)", ylim=(0, 1.02), xlim=(0, 3.5))
axes.legend()

t0, e = np.sqrt(2 / 9.81), 0.8
exact = t0 + 2 * t0 * np.r_[0, np.cumsum(e ** np.arange(1, bounces.size))]
print(
    f"{bounces.size} bounces, furthest from the closed form by {abs(bounces - exact).max():.0e} s"
)
assert bounces.size > 5
assert abs(bounces - exact).max() < 1e-8

zeno = None
try:
    nlctl.input_output_response(ball, [0, 5])
except nlctl.errors.ZenoError as error:
    zeno = error.time
    print(error)
assert zeno is not None
assert abs(zeno - t0 * (1 + e) / (1 - e)) < 1e-6
