r"""
The worst case of a small loop
==============================

An oscillator :math:`\ddot{x} + 2 D \dot{x} + x = 1` with :math:`D` between 0.2 and 0.8 overshoots by
:math:`e^{-\pi D / \sqrt{1 - D^{2}}}`, most at the least damping. The search must end there.
"""

from functools import partial

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis import robustness as rb


@nlctl.record
class Oscillator:
    D: float = nlctl.param(0.5, unit="1", meaning="damping", above=0)
    inputs, outputs, states, feedthrough = (), ("y",), ("x1", "x2"), False

    @nlctl.equation
    def update(t, x, u, p):
        return x[1], 1 - x[0] - 2 * p.D * x[1]

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop(D=0.5) -> ct.InterconnectedSystem:
    return nlctl.interconnect({"plant": Oscillator(D=D)})


limit, t = 1.4, np.linspace(0, 10, 2001)
space = rb.Space(quantities=(rb.Uncertain(name="plant.D", bounds=(0.2, 0.8)),))
spec = rb.Spec(
    requirements=(
        rb.Requirement(key="low", formula=rb.always(rb.in_band("y", upper=limit)), until=10),
    )
)
prepared = rb.prepare(rb.Experiment(space=space, build=loop, timepts=t, spec=spec))
worst = rb.worst_case(partial(rb.evaluate, prepared), prepared.experiment.space, 60, entropy=1)
print(worst)

figure, axes = plt.subplots(figsize=(5, 3))
for D in (0.2, 0.5, 0.8):
    axes.plot(t, nlctl.input_output_response(loop(D), t).outputs.ravel(), label=f"D = {D}")
axes.axhline(limit, linestyle="--", color="black")
axes.set(xlabel="t (s)", ylabel="y")
axes.legend()
peak = 1 + np.exp(-np.pi * 0.2 / np.sqrt(1 - 0.2**2))
assert abs(worst.margin * limit - (limit - peak)) < 1e-4
