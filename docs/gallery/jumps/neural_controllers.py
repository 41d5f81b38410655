r"""
Neural controllers that sample
==============================

Four benchmarks of the ARCH competition (category AINNCS): a continuous plant, and a network of ReLUs that samples it. The
networks are the published ones, with where they are from in ``docs/data``. The models of JuliaReach's
NeuralNetworkAnalysis.jl (2021; the reports of the competition were not read) are set up to verify cruise control, TORA
and unicycle (there with a disturbance of 1e-4) and to falsify the pendulum from the start (1.2, 0.2). One run shows the
last: the angle is above 1 between 0.5 s and 1 s. 200 runs of each of the others, and of the pendulum from the
smaller box of a later year, show no violation; by Clopper and Pearson that bounds the part of the box that violates by
1.5 % with 95 % confidence, and proves nothing.
"""

import sys

import matplotlib.pyplot as plt
import numpy as np

from nlctl.analysis.robustness import clopper_pearson

sys.path.append("../../data")
from ainncs import CASES

RUNS = 200
figure, axes = plt.subplots(2, 2, figsize=(7.5, 5), layout="constrained")
for ax, (name, case) in zip(axes.flat, CASES.items(), strict=True):
    starts = np.random.default_rng(1).uniform(*case.box, (RUNS, len(case.box[0])))
    t, margin = case.runs(starts)
    asked = t >= case.begin
    ax.plot(t, margin[:40].T, color="C0", linewidth=0.5)
    if name == "unicycle":  # which is asked at the end alone
        ax.set_ylim(-10, 1.5)
    if name == "pendulum":
        t, falsified = case.runs(np.array([[1.2, 0.2]]))
        ax.plot(t, falsified[0], color="C1", label="from (1.2, 0.2)")
        ax.legend()
        assert falsified[0, asked].min() < 0
    ax.axhline(0, color="0.6", linewidth=0.8)
    ax.axvspan(case.begin if case.begin < case.end else 0.99 * case.end, case.end, alpha=0.1)
    ax.set(title=name, xlabel="t (s)", ylabel=case.says)
    least = margin[:, asked].min()
    share = clopper_pearson(0, RUNS, 0.95)[1]
    print(f"{name}: least margin {least:.3g}, share that violates at most {share:.1%}")
    assert least > 0
