r"""
Plot a run, and many runs
=========================

A response is python-control's, and plots itself as python-control's do. Of many signals, those of one kind share a row.
"""

import control as ct
import numpy as np

import nlctl
from nlctl.analysis.robustness import Requirement, Spec, always, in_band

loop = nlctl.paper.example_1()
t = np.linspace(0, 20, 1001)
run = nlctl.input_output_response(loop, t)
drawn = run.plot()

# %%
# Signals share a row that are equal but for their sign, of which one is the sum or the difference of two others (the
# output, its reference, their difference), or which go into an actuator and come out of it. All others are in one row
# with those of the same block.
_, rows = run.rows()
print(rows)
assert [name for name in rows["y, yd, e, x1"] if name != "x1"] == ["y", "yd", "e"]
assert rows["u, v"] == ["u", "v"]

# %%
# Or say what is shown: a name has a row of its own, a list of names shares one.
drawn = run.plot(signals=[["yd", "y"], "u"])
assert drawn.axes.shape == (2, 1)
drawn.axes[0, 0].set_title("A title of your own")

# %%
# With arguments of ``ct.time_response_plot`` it is python-control's plot. States go by their names, also in a table.
drawn = run.plot(overlay_signals=True)
zeta = run.states["controller.law.zeta"]
assert np.array_equal(zeta, run.outputs["zeta"])
print(run.to_pandas().shape)

# %%
# Many runs: bands that hold all, 90 % and 50 % of the members, single members, and the limits of a spec.
rng = np.random.default_rng(1)
many = nlctl.ensemble_response(
    loop, T=t, X0={"plant.x1": rng.uniform(0, 1, 100)}, keep=["y", "e", "u"],
    params={"actuator.b_r": rng.uniform(0, 1, 100)},
)  # fmt: skip
small = always(in_band("e", lower=-0.15, upper=0.15), start=10.0)
spec = Spec(requirements=(Requirement(key="tracks", formula=small, until=20.0),))
drawn = many.plot(members=[0], spec=spec)
assert len(drawn.axes) == 3
table = many.to_pandas()
late = table[table["time"] >= 10]
print(f"largest |e| after 10 s: {late['e'].abs().max():.3f}")
assert late["e"].abs().max() < 0.15

# %%
# All of these are matplotlib figures: ``drawn.figure.savefig("run.svg")``, ``drawn.axes[0, 0].set_ylabel("m")``. Bode and
# Nyquist plots take a linearization, phase planes the diagram, describing functions a block:
plant = nlctl.compile(loop).linearize(nlctl.initial_state(loop))
assert isinstance(plant, ct.StateSpace)
