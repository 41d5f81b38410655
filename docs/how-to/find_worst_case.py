"""
Find the worst case
===================

``worst_case`` searches the box for the lowest margin. It can find a violation; finding none proves nothing.
"""

from functools import partial

import numpy as np

import nlctl
from nlctl.analysis import robustness as rb

space = rb.Space(quantities=(rb.Uncertain(name="actuator.b_r", bounds=(0.3, 2.0)),))
moderate = rb.always(rb.in_band("u", lower=-12.0, upper=12.0))
loops = rb.prepare(
    rb.Experiment(
        space=space,
        build=nlctl.paper.example_1,
        timepts=np.linspace(0, 20, 2001),
        spec=rb.Spec(requirements=(rb.Requirement(key="moderate", formula=moderate, until=20),)),
    )
)
worst = rb.worst_case(partial(rb.evaluate, loops), loops.experiment.space, runs=60, entropy=1)
print(worst)

# %%
# It is at least as bad as both ends of the interval:
ends = rb.sweep(loops, rb.corners(loops.experiment.space)).table["spec"]
assert worst.margin <= ends.min()
