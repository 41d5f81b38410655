"""Sliding mode with one planted thing at a time, as for a known sign: none of them is certified."""

import control as ct
import numpy as np
import pytest
from planted_loops import SLIDING, UPDATE, actuator, exchanged, plant, system, wired
from test_planted_differences import TIME

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.errors import UsageError


def changed(wires=None, **how):
    return lambda: wired(wires, of=SLIDING, **how)


def of_block(part, **functions):
    """A block of the loop with sliding mode, whose functions were replaced."""
    block = system(SLIDING[0][part](), part)
    for name, function in functions.items():
        setattr(block, name, function)
    return {part: block}


def of_plant(update=None, output=None, **more):
    return changed(plant=plant(update, output, **more))


class Harder(nlctl.controllers.SlidingModeLaw):
    """Another law under a name of its own."""


DIFFERENCES = {
    "minus at the plant": changed({"plant.v": "-actuator.v"}),
    "a gain at the plant": changed({"plant.v": ("actuator", "v", 0.3)}),
    "minus at the actuator": changed({"actuator.u": "-law.u"}),
    "a gain at the actuator": changed({"actuator.u": ("law", "u", 0.4)}),
    "no actuator": changed({"plant.v": "law.u"}),
    "a sum at the plant": changed({"plant.v": ["actuator.v", "law.u"]}),
    "no input of the actuator": changed({"actuator.u": None}),
    "x1 and x2 exchanged": changed(
        {"filtered_error.x1": "plant.x2", "filtered_error.x2": "plant.x1"}
    ),
    "y for x2": changed({"filtered_error.x2": "plant.y"}),
    "minus x2": changed({"filtered_error.x2": "-plant.x2"}),
    "minus r": changed({"law.r": "-filtered_error.r"}),
    "a tenth of r": changed({"law.r": ("filtered_error", "r", 0.1)}),
    "e for r": changed({"law.r": "filtered_error.e"}),
    "yd for yd1": changed({"filtered_error.yd1": "reference.yd"}),
    "twice yd": changed({"filtered_error.yd": ("reference", "yd", 2.0)}),
    "no yd1": changed({"filtered_error.yd1": None}),
    "e as output r": changed(outputs={"r": "filtered_error.e"}),
    "a tenth of r as output r": changed(outputs={"r": ("filtered_error", "r", 0.1)}),
    "an input at the plant": changed(inputs={"w": ["plant.v"]}),
    "an input at the actuator": changed(inputs={"w": ["actuator.u"]}),
    "an input at the sensor": changed(inputs={"w": ["filtered_error.x1"]}),
    "an input at r": changed(inputs={"w": ["law.r"]}),
    "a filter before the plant": changed(
        {"plant.v": ("lag", "slow"), "lag.v": "actuator.v"},
        more=[ct.tf([1], [0.05, 1], inputs=["v"], outputs=["slow"], name="lag")],
    ),
    "a spare block": changed(more=[system(nlctl.Gain(), "spare")]),
    "x1' = x2 + 0.05": of_plant(lambda t, x, u, p: (x[1] + 0.05, UPDATE(t, x, u, p)[1])),
    "x1' = 1.1 x2": of_plant(lambda t, x, u, p: (1.1 * x[1], UPDATE(t, x, u, p)[1])),
    "x1' = x2 + v": of_plant(lambda t, x, u, p: (x[1] + u[0], UPDATE(t, x, u, p)[1])),
    "x2' without an end": of_plant(lambda t, x, u, p: (x[1], UPDATE(t, x, u, p)[1] + 0.1 * t)),
    "x2' pushed by 40": of_plant(lambda t, x, u, p: (x[1], UPDATE(t, x, u, p)[1] + 40.0)),
    "x2' with the other sign of v": of_plant(
        lambda t, x, u, p: (x[1], UPDATE(t, x, (-u[0],), p)[1])
    ),
    "output x1 is 0.9 x1": of_plant(output=lambda t, x, u, p: (x[0], 0.9 * x[0], x[1])),
    "outputs exchanged": of_plant(output=lambda t, x, u, p: (x[0], x[1], x[0])),
    "a law of another kind": changed(law=Harder(K=25.0, phi=0.1)),
    "a weaker law": changed(law=nlctl.controllers.SlidingModeLaw(K=2.0, phi=0.1)),
    "the law's function replaced in the block": changed(
        **of_block("law", outfcn=lambda t, x, u, p: (-u[0],))
    ),
    "the law's function replaced in the record": changed(
        law=exchanged(nlctl.controllers.SlidingModeLaw(K=25.0), output=lambda t, x, u, p: (-u[0],))
    ),
    "the filter's function replaced in the block": changed(
        **of_block("filtered_error", outfcn=lambda t, x, u, p: np.array([u[0], u[0], u[1]]))
    ),
    "a sampled law": changed(
        law=nlctl.sampled(nlctl.block(nlctl.controllers.SlidingModeLaw(K=25.0), "law"), 0.1)
    ),
    "other parameters of the diagram": changed(params={"law.K": 2.0}),
    "a dead actuator": changed(actuator=actuator(lambda t, u: 0.0 * u)),
    **{f"the actuator: {what}": changed(actuator=actuator(TIME[what][0])) for what in TIME},
}  # fmt: skip


def test_the_loop_without_a_difference_is_certified():
    """A check that always refuses proves nothing of the differences."""
    assert certify(wired(of=SLIDING)).status == "proved"


@pytest.mark.parted
@pytest.mark.parametrize("what", DIFFERENCES)
def test_a_difference_is_refused_or_undecided(what):
    """What is undecided says what is missing."""
    loop, found, refusal = DIFFERENCES[what](), None, ""
    try:
        found = certify(loop)
    except UsageError as error:
        refusal = str(error)
    if found is None:
        assert len(refusal) > 30
    else:
        assert found.status == "undecided"
        assert found.missing == found.reason != ""
        assert np.inf == found.C_0 == found.u_max
