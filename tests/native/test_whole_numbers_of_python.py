"""Integers of Python's own, `math.floor` and its kind: as wide as they are, each jump one event."""

import math

import control as ct
import numpy as np
import pytest

import nlctl


def floor_of_math(t, x, u, params):
    return [1.0, math.floor(x[0])]


def ceil_of_math(t, x, u, params):
    return [1.0, math.ceil(x[0])]


def trunc_of_math(t, x, u, params):
    return [1.0, math.trunc(x[0])]


def int_of_python(t, x, u, params):
    return [1.0, int(x[0])]


@pytest.mark.parametrize(
    ("update", "name", "jumps"),
    [
        (floor_of_math, "floor", [0.5, 1.5, 2.5, 3.5]),
        (ceil_of_math, "ceil", [0.5, 1.5, 2.5, 3.5]),
        (trunc_of_math, "trunc", [0.5, 2.5, 3.5]),
        (int_of_python, "trunc", [0.5, 2.5, 3.5]),
    ],
)
def test_each_jump_is_one_event(update, name, jumps):
    """x = t - 3/2; truncated, it does not jump at 0."""
    plant = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="plant")
    run = nlctl.input_output_response(plant, [0, 3.75], 0, [-1.5, 0.0])
    events = run.events
    rises = events[events.which == name]
    assert len(rises) == len(events)
    assert set(events.direction) == {"rising"}
    found = np.array(events.time)
    assert all(np.abs(found - t).min() < 1e-7 for t in jumps)
    assert len(found) - len(jumps) in (0, 1)  # at 0 the angle of `trunc` passes 1.5 s


@pytest.mark.parametrize("update", [floor_of_math, ceil_of_math, trunc_of_math, int_of_python])
@pytest.mark.parametrize("x", [-3e25, -(2.0**63) - 4096, -2.5, 0.0, 2.0**53 + 2, 1e19, 1e300])
def test_they_have_no_largest_one(update, x):
    plant = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="plant")
    compiled = nlctl.compile(plant)
    state = np.array([x, 0.0])
    assert compiled.dynamics(0.0, state, np.zeros(0))[1] == plant.dynamics(0, state, [])[1]
