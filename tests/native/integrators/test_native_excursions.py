"""Switching functions that cross and come back, where error control would step over it."""

import functools

import control as ct
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import nlctl


def of_time(t, x, u, params):
    """u = A sin(w t)."""
    return [params["A"] * np.sin(params["w"] * t)]


def of_state(t, x, u, params):
    """The same of a clock, whose error is 0 in every step."""
    return [params["A"] * np.sin(params["w"] * x[0])]


@functools.cache
def compiled(driven):
    """Return a dead zone behind a sine of time or of a clock, and an integrator behind it."""
    given = {"params": {"A": 1.0, "w": 1.0}, "inputs": 0, "outputs": ["u"], "name": "source"}
    if driven == "by time":
        source = ct.nlsys(None, of_time, **given)
    else:
        source = ct.nlsys(lambda t, x, u, p: [1.0], of_state, states=1, **given)
    zone = nlctl.DeadZone(slope_r=1.0, slope_l=1.0, ripple_r=0.0, ripple_l=0.0, b_l=-100.0)
    sink = ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: x, inputs=["v"], outputs=["area"],
        states=1, name="sink",
    )  # fmt: skip
    blocks = [source, nlctl.block(zone, "zone"), sink]
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["area"], name="rig"))


def area(A, w, h, periods):
    """Return the integral of max(A sin(w t) - h A, 0) over whole periods."""
    half = np.arccos(h) if h < 1 else 0.0
    return periods * 2 * A / w * (np.sqrt(max(1 - h**2, 0.0)) - h * half)


@pytest.mark.parametrize("driven", ["by time", "by a clock"])
@given(
    A=st.floats(0.1, 10), w=st.floats(0.05, 100), h=st.floats(0.05, 0.8), periods=st.integers(1, 5)
)
@example(A=1.5, w=1.0, h=0.859, periods=2)
@settings(max_examples=15)
def test_no_deep_excursion_is_stepped_over(driven, A, w, h, periods):
    """Within the zone nothing limits a step: the integral has every excursion out of it."""
    end = periods * 2 * np.pi / w
    run = nlctl.input_output_response(
        compiled(driven), [0, end], params={"A": A, "w": w, "zone.b_r": h * A}
    )
    assert run.outputs[0, -1] == pytest.approx(area(A, w, h, periods), abs=1e-4 * A / w)


def test_no_deep_excursion_is_stepped_over_side_by_side():
    """In an ensemble as in single runs, for those of a tenth of the amplitude and more."""
    h, times = np.linspace(0.1, 0.9, 12), [0.0, 4 * np.pi]
    made = nlctl.ensemble_response(
        compiled("by time"), times, params={"zone.b_r": 1.5 * h, "A": 1.5}, keep=["area"]
    )
    wanted = [area(1.5, 1.0, share, 2) for share in h]
    np.testing.assert_allclose(made.signals["area"][:, -1], wanted, atol=1e-5)
