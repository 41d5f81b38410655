"""Parameters that are taken from the run before are those that would be resolved anew."""

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.diagrams import apart
from nlctl.native.reading import standing


def decay(t, x, u, params):
    return [-params["rate"] * x[0] + params.get("gains", (0.0,))[0]]


def diagram(gains=(0.0,)):
    outside = ct.nlsys(
        decay, None, inputs=1, outputs=1, states=1, name="lag", params={"rate": 1.0, "gains": gains}
    )
    zone = nlctl.block(nlctl.DeadZone(), "zone")
    return ct.interconnect(
        [outside, zone],
        connections=[["zone.u", "lag.y[0]"]],
        inplist=["lag.u[0]"],
        outlist=["zone.v"],
        name="loop",
    )


def other_rate(loop, value):
    loop.syslist[0].params["rate"] = value


def other_gains(loop, value):
    loop.syslist[0].params["gains"] = (value,)


def other_zone(loop, value):
    loop.syslist[1].params = {"zone.b_r": value}


def other_default(loop, value):
    loop.params["zone.b_r"] = value


def run_in_python_control(loop, value):
    ct.input_output_response(loop, [0, 0.1], 0, [0], params={"zone.b_r": value})


CHANGES = [other_rate, other_gains, other_zone, other_default, run_in_python_control, None]
STEPS = st.lists(
    st.tuples(st.sampled_from(CHANGES), st.sampled_from([0.25, 0.5, 0.75])), min_size=1, max_size=6
)


@given(STEPS)
@settings(max_examples=many(60, part=4), deadline=None)
def test_whatever_is_changed_the_vector_is_that_of_the_diagram_as_it_stands(steps):
    loop = diagram()
    compiled = nlctl.compile(loop)
    for change, value in steps:
        params = None if change else {"zone.b_r": value, "lag.rate": value}
        if change:
            change(loop, value)
        for _ in range(2):
            found = compiled.parameter_vector(params)
            anew = nlctl.compile(loop).parameter_vector(params)
            np.testing.assert_array_equal(found, anew)


def test_a_vector_that_is_written_into_is_not_that_of_the_next_run():
    compiled = nlctl.compile(diagram())
    first = compiled.parameter_vector()
    kept = first.copy()
    first[:] = np.nan
    np.testing.assert_array_equal(compiled.parameter_vector(), kept)


def test_two_runs_that_share_the_copied_diagram_have_their_own_values():
    """One with events is compiled anew around the same copy; audits look at that copy's values."""
    compiled = nlctl.compile(diagram())
    for b_r in (0.3, 0.6, 0.3):
        y = [
            nlctl.input_output_response(
                compiled, [0, 1.0], 0, [2.0], params=params, audit="every run", **more
            ).outputs[-1]
            for params, more in (
                (None, {}),
                ({"zone.b_r": b_r}, {"events": lambda t, x, u, p: x[0] - 1.5}),
                (None, {}),
            )
        ]
        assert y[0] == y[2] != y[1]


@pytest.mark.parametrize("value", [[0.0], np.zeros(1), {"a": 1}])
def test_values_that_can_change_in_place_are_resolved_each_time(value):
    assert standing(apart(diagram(value)), None) is None
    assert standing(apart(diagram()), {"lag.gains": value}) is None


def test_an_array_that_changes_in_place_is_seen():
    gains = np.zeros(1)
    compiled = nlctl.compile(diagram(gains))
    before = compiled.parameter_vector()
    gains[0] = 2.0
    assert np.sum(compiled.parameter_vector() != before) == 1
