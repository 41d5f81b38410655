"""Transport delays beside sampled blocks are delays of sampled blocks, which are states."""

import control as ct
import numpy as np
import pytest

import nlctl

PLANT = ct.ss(
    [[0, 1], [-2, -3]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y", name="plant"
)  # fmt: skip
LAW = ct.ss(0.5, 1.0, 0.3, -1.0, 0.1, inputs="seen", outputs="m", name="law")
T = np.linspace(0, 3, 31)


def line(before, after, delay):
    return nlctl.block(
        nlctl.TransportDelay(inputs=(before,), outputs=(after,), delay=delay), f"{after}_line"
    )


def program(before, after, delay, offset=0.0):
    gain = ct.ss([], [], [], 1.0, 0.1, inputs=before, outputs=after, name=f"{after}_line")
    return nlctl.sampled(gain, delay=delay, offset=offset)


def loop(*lines):
    return ct.interconnect(
        [PLANT, nlctl.sampled(LAW), *lines], inputs=[], outputs=["y", "u"], inplist=[]
    )


@pytest.mark.parted
@pytest.mark.parametrize("delay", [0.1, 0.3, 0.07, 0.25])
def test_behind_a_sampled_block(delay):
    """What it holds arrives later: commensurate or not."""
    direct = ct.ss([], [], [], 1.0, inputs="y", outputs="seen", name="direct")
    check(loop(direct, line("m", "u", delay)), loop(direct, program("m", "u", delay)))


@pytest.mark.parted
@pytest.mark.parametrize("delay", [0.1, 0.3, 0.07, 0.25])
def test_before_a_sampled_block(delay):
    """What it samples was sampled earlier."""
    direct = ct.ss([], [], [], 1.0, inputs="m", outputs="u", name="direct")
    offset = round(-delay % 0.1, 9)
    check(
        loop(direct, line("y", "seen", delay)),
        loop(direct, program("y", "seen", delay, offset)),
    )


def check(delayed, with_states):
    """The same run; and from a state of it the map over a period gives the rest."""
    start, settings = {"plant.x[0]": 1.0}, {"rtol": 1e-11, "atol": 1e-13}
    theirs = nlctl.input_output_response(delayed, T, 0, start, **settings).outputs
    ours = nlctl.input_output_response(with_states, T, 0, start, **settings).outputs
    np.testing.assert_allclose(ours[:, :-1], theirs[:, :-1], rtol=0, atol=1e-8)
    made = nlctl.linearize(with_states, 0)
    assert made.dt == pytest.approx(0.1)
    x = nlctl.input_output_response(with_states, T[:11], 0, start, **settings).states[:, -1]
    for k in range(10, 30):
        np.testing.assert_allclose(made.C @ x, theirs[:, k], rtol=0, atol=1e-8)
        x = made.A @ x
