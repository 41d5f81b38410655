"""Where the reference stands at a threshold: at the start of a run, and right before its end."""

import control as ct
import numpy as np
import pytest

import nlctl

TOLERANCES = (1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9)


@pytest.mark.parametrize("rtol", TOLERANCES)
def test_what_starts_at_a_threshold_leaves_it_by_the_rates_there(rtol):
    """Rates lead away on both sides, and LSODA subtracts again what it has added."""

    def flow(t, x, u, params):
        x2 = np.where(x[2] < 1, 0.0, np.where(x[2] <= 1, 5.0, 2.0))
        return [np.where(x[0] >= 1, 2.0, -1.0), np.where(x[1] > 1, 2.0, -1.0), x2]

    away = ct.nlsys(flow, lambda t, x, u, p: x, inputs=0, outputs=3, states=3, name="away")
    run = nlctl.input_output_response(
        away, [0, 1], 0, [1.0, 1.0, 1.0], engine="python-control", rtol=rtol, atol=1e-2 * rtol
    )
    np.testing.assert_allclose(run.states[:, -1], [3.0, 0.0, 3.0], atol=1e-9)
    assert set(run.events["time"]) == {0.0}


@pytest.mark.parted
@pytest.mark.parametrize("rtol", TOLERANCES)
def test_rates_that_jump_by_more_than_a_step_can_be_short_for(rtol):
    """1e-10 s before the end rates become 1e6."""
    clock = ct.nlsys(
        lambda t, x, u, p: [1.0, np.where(x[0] > 2 - 1e-10, 1e6, 0.0)],
        lambda t, x, u, p: x[1], inputs=0, outputs=1, states=2, name="clock",
    )  # fmt: skip
    run = nlctl.input_output_response(
        clock, [0, 2], 0, [0.0, 0.0], engine="python-control", rtol=rtol, atol=1e-2 * rtol
    )
    assert run.states[1, -1] == pytest.approx(1e-4, abs=1e-7 + rtol)


def test_an_algebraic_loop_that_a_saturation_closes_on_the_way_is_no_divergence():
    """v = clip(2 cos t - v / 2, -1, 1): saturated up to cos t = 3/4, behind that no fixed order."""
    swing = ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], lambda t, x, u, p: [x[0]], inputs=0,
                     outputs=["x"], states=2, name="swing")  # fmt: skip
    clip = ct.nlsys(None, lambda t, x, u, p: [np.clip(2 * u[0] - u[1] / 2, -1, 1)],
                    inputs=["x", "w"], outputs=["v"], name="clip")  # fmt: skip
    loop = ct.interconnect([swing, clip], [["clip.x", "swing.x"], ["clip.w", "clip.v"]], [],
                           ["clip.v"], name="loop")  # fmt: skip
    with pytest.raises(RuntimeError, match="lgebraic loop"):
        nlctl.input_output_response(loop, [0, 2], 0, [1, 0], engine="python-control")
