"""Staircases of fast states: switches come ever faster, and each is at another place."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl
from nlctl.native import Status

METHODS = pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor", "auto"])


def levels(last):
    """Return the times at which exp(t) has come to integers, and `last`."""
    return np.append(np.log(np.arange(1, int(np.exp(last)) + 1)), last)


def signs(last):
    """Return the integral of sign(sin(exp t)): of the sign over x, along x."""
    ends = np.exp(last)
    edges = np.array([1.0, *(np.pi * np.arange(1, int(ends / np.pi) + 1)), ends])
    return float(np.diff(np.log(edges)) @ (-1.0) ** np.arange(edges.size - 1))


def counted(last):
    """Return the integral of floor(exp t)."""
    return float(np.diff(levels(last)) @ np.arange(1, int(np.exp(last)) + 1))


STAIRS = {
    "floor": (lambda t, x, u, p: [x[0], np.floor(x[0])], counted),
    "remainder": (
        lambda t, x, u, p: [x[0], x[0] % 1.0], lambda last: np.exp(last) - 1 - counted(last)
    ),
    "sign": (lambda t, x, u, p: [x[0], np.sign(np.sin(x[0]))], signs),
}  # fmt: skip


def run(function, last, start=(1.0, 0.0), **given):
    block = ct.nlsys(
        function, lambda t, x, u, p: x, states=len(start), outputs=len(start), inputs=0, name="own"
    )
    return nlctl.input_output_response(block, [0.0, last], 0, start, **given)


@METHODS
@pytest.mark.parametrize(("stairs", "rtol"), crossed([*STAIRS], [1e-3, 1e-6]))
def test_each_step_of_a_staircase_is_another_place(stairs, rtol, method):
    """x' = x: a step of x by 1 is less than tolerances of x, and each is passed once."""
    function, integral = STAIRS[stairs]
    made = run(function, 7.0, rtol=rtol, atol=0.01 * rtol, method=method)
    assert made.states[0, -1] == pytest.approx(np.exp(7.0), rel=100 * rtol)
    # where x is wrong by a part of itself, so are the times of all switches, by as much
    bound = 100 * rtol * (np.exp(7.0) if stairs == "floor" else 1.0)
    assert made.states[1, -1] == pytest.approx(integral(7.0), abs=bound)


@METHODS
def test_a_quantiser_of_many_levels_in_a_loop(method):
    """x' = q round(c x / q) stays within q / 2 of x' = c x: by (q / 2) (exp(c t) - 1) / c."""
    q, c, last = 1e-3, 0.5, 3.0
    made = run(lambda t, x, u, p: [q * np.round(c * x[0] / q)], last, (1.0,), method=method)
    away = abs(made.states[0, -1] - np.exp(c * last))
    assert 0 < away <= 0.5 * q * np.expm1(c * last) / c
    assert made.statistics.events >= int((np.exp(c * last) - 1) * c / q) - 1


@pytest.mark.parted
@METHODS
def test_what_comes_back_to_one_place_still_chatters(method):
    """A staircase of one state next to a sign that slides at another, from t = 1 on."""
    made = run(
        lambda t, x, u, p: [x[0], np.floor(x[0]), 0.2 - np.sign(x[2])], 9.0, (1.0, 0.0, 0.8),
        method=method, ignore_errors=True, slide=False,
    )  # fmt: skip
    assert made.statistics.status is Status.CHATTERING
    assert made.statistics.time == pytest.approx(1.0, abs=0.1)
    assert "'x[2]'' of block 'own' jumps between" in made.message


@pytest.mark.parametrize(("method", "rtol"), crossed(["tsit5", "auto"], [1e-6, 1e-9]))
def test_levels_that_are_passed_ever_faster_end_a_run_before_their_end(rtol, method):
    """z' = z^2 is infinite at t = 1: no run counts its levels to there, or stays where it is."""
    with pytest.raises(nlctl.errors.ChatteringError, match="moves ever faster") as caught:
        run(
            lambda t, x, u, p: [x[0] ** 2, np.floor(x[0])], 2.0, method=method, rtol=rtol,
            atol=0.01 * rtol,
        )  # fmt: skip
    assert caught.value.time == pytest.approx(1.0, abs=1e-4)
