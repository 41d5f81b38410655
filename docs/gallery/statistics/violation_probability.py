r"""
A violation probability with a known answer
===========================================

The system :math:`\dot{x} = -a x` with :math:`a` uniform on :math:`[0, 2]`, from :math:`x(0) = 1`:
:math:`x(1) > e^{-0.1}` just where :math:`a < 0.1`, that is with probability 0.05.
"""

import control as ct
import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis import robustness as rb


@nlctl.record
class Decay:
    a: float = nlctl.param(1.0, unit="1/s", meaning="rate", above=-1)
    inputs, outputs, states, feedthrough = (), ("y",), ("x",), False
    initial = {"x": 1.0}

    @nlctl.equation
    def update(t, x, u, p):
        return (-p.a * x[0],)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


def loop() -> ct.InterconnectedSystem:
    return nlctl.interconnect({"decay": Decay()})


space = rb.Space(quantities=(rb.Uncertain(name="decay.a", bounds=(0.0, 2.0)),))
small = rb.always(rb.in_band("y", upper=np.exp(-0.1)), 1, 1)
spec = rb.Spec(requirements=(rb.Requirement(key="decays", formula=small, until=1),))
times = np.linspace(0, 1, 11)
prepared = rb.prepare(rb.Experiment(space=space, build=loop, timepts=times, spec=spec))
runs = rb.sweep(prepared, rb.independent(prepared.experiment.space, 4000, entropy=1))
estimate = rb.violation_probability(runs.design, runs.table["spec"], side="both")
print(estimate)

figure, axes = plt.subplots(figsize=(5, 3))
axes.hist(runs.table["spec"], bins=40)
axes.axvline(0, color="black")
axes.set(xlabel="margin", ylabel="runs", title="Violations left of zero")
assert estimate.lower < 0.05 < estimate.upper
