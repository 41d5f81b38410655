r"""
A tuned loop
============

A PID controller for the plant and the dead zone of Example 1, whose gains leave error and input the largest distance to their
bounds: of :math:`|e| \leq 0.15` from 10 s on and :math:`|u| \leq 30` the least margin counts. ``nlctl.tune`` takes the
derivatives of runs (through the dead zone), so that a few runs are enough, and says what each gain contributes: the loop
before with it alone, and the loop after without it. What is found is the best of what was tried; ``nlctl tune study.toml``
also runs it on fresh samples.
"""

import matplotlib.pyplot as plt
import numpy as np

import nlctl
from nlctl.analysis.robustness import Requirement, always, in_band

controller = nlctl.PID(k_p=5, k_i=5, k_d=5, T_f=0.05, u_max=100)
loop = nlctl.compile(nlctl.paper.example_1(controller=controller))
tracks = always(in_band("e", lower=-0.15, upper=0.15), start=10)
moderate = always(in_band("u", lower=-30, upper=30))
spec = [
    Requirement(key="tracks", formula=tracks, until=20),
    Requirement(key="moderate", formula=moderate, until=20),
]
space = {f"controller.{k}": (0.1, 100) for k in ("k_p", "k_i", "k_d")}
tuned = nlctl.tune(loop, space, spec, budget=60, starts=1)
print(tuned)

t = np.linspace(0, 20, 1001)
before = nlctl.input_output_response(loop, t)
after = nlctl.input_output_response(loop, t, params=tuned.params)
names = list(loop.system.output_labels)

figure, (error, control, gains) = plt.subplots(3, figsize=(6, 7), layout="constrained")
for ax, name, bound in ((error, "e", 0.15), (control, "u", 30)):
    ax.plot(t, before.outputs[names.index(name)], "--", color="C1", label="before")
    ax.plot(t, after.outputs[names.index(name)], color="C0", label="after")
    for side in (-bound, bound):
        ax.hlines(side, 10 if name == "e" else 0, 20, color="0.6")
    ax.set(xlabel="t (s)", ylabel=name, xlim=(0, 20))
error.legend()
table, at = tuned.to_pandas(), np.arange(len(space))
before, after = tuned.margin_before, tuned.margin
gains.barh(at - 0.2, table["alone"] - before, 0.36, left=before, label="it alone")
gains.barh(at + 0.2, table["put_back"] - after, 0.36, left=after, label="all but it")
gains.axvline(before, color="0.6", ls="--")
gains.axvline(after, color="0.6")
gains.set_xlim(2 * before, 1.2)
gains.set_yticks(at, [name.removeprefix("controller.") for name in table.index])
gains.set_xlabel("least margin: before (dashed), after, and with one gain changed")
gains.legend(loc="lower left")

assert before < 0 < 0.4 < after
assert tuned.counted_runs < 100
