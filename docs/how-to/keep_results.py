"""
Keep results
============

Give ``sweep`` a folder: every finished chunk is kept there, as Parquet, and an interrupted sweep resumes.
That takes ``pip install "nlctl[studies]"``.
"""

import tempfile
from pathlib import Path

import numpy as np

import nlctl
from nlctl.analysis import robustness as rb

space = rb.Space(quantities=(rb.Uncertain(name="actuator.b_r", bounds=(0.3, 0.7)),))
small = rb.always(rb.in_band("e", lower=-0.15, upper=0.15), 10, 20)
loops = rb.prepare(
    rb.Experiment(
        space=space,
        build=nlctl.paper.example_1,
        timepts=np.linspace(0, 20, 2001),
        spec=rb.Spec(requirements=(rb.Requirement(key="tracks", formula=small, until=20),)),
    )
)
design = rb.independent(loops.experiment.space, 40, entropy=1)
with tempfile.TemporaryDirectory() as parent:
    folder = Path(parent) / "rows"
    rows = rb.sweep(loops, design, folder, chunk=10)
    again = rb.sweep(loops, design, folder, chunk=10, resume=True)  # nothing is left to do
    tables = [sweep.table for sweep in (rows, again, rb.load(folder, design))]

# %%
# The numbers are the same to the last bit:
for table in tables[1:]:
    assert (table["spec"] == tables[0]["spec"]).all()
