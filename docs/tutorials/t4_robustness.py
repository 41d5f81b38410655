r"""
4. A robustness study
=====================

How sure is it that a loop tracks, when its actuator is not known exactly?
"""

from functools import partial

import numpy as np

import nlctl
from nlctl.analysis import robustness as rb

# sphinx_gallery_live = ["actuator.b_r=0.3:0.7", "actuator.b_l=-0.5:-0.1", "plant.x1(0)=0.2:0.8"]
# sphinx_gallery_live_run = "nlctl.input_output_response(nlctl.paper.example_1(), np.linspace(0, 20, 2001))"

space = rb.Space(
    quantities=(
        rb.Uncertain(name="actuator.b_r", bounds=(0.3, 0.7)),
        rb.Uncertain(name="actuator.b_l", bounds=(-0.5, -0.1)),
        rb.Uncertain(name="plant.x1(0)", bounds=(0.2, 0.8)),
    )
)

# %%
# What is asked is a formula over signals; its margin is positive where it holds.
small = rb.always(rb.in_band("e", lower=-0.15, upper=0.15), 10, 20)
loops = rb.prepare(
    rb.Experiment(
        space=space,
        build=nlctl.paper.example_1,
        timepts=np.linspace(0, 20, 2001),
        spec=rb.Spec(requirements=(rb.Requirement(key="tracks", formula=small, until=20),)),
    )
)

# %%
# Independent draws give an exact bound, with its assumptions in the sentence:
rows = rb.sweep(loops, rb.independent(loops.experiment.space, 500, entropy=1))
estimate = rb.violation_probability(rows.design, rows.table["spec"])
print(estimate)

# %%
# With no violation in n draws, the bound at 99 % is :math:`1 - 0.01^{1/n}`.
assert estimate.violations == 0
assert abs(estimate.upper - (1 - 0.01 ** (1 / 500))) < 1e-9

# %%
# A search says something else: the lowest margin that it found.
worst = rb.worst_case(partial(rb.evaluate, loops), loops.experiment.space, runs=100, entropy=1)
print(worst)
assert worst.margin <= rows.table["spec"].min()

# %%
# As a file, with a report at its end, this is a study: see :doc:`/studies`.
