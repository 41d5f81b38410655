"""Conditions of time alone that switch ever faster: all of them are found before the run."""

import control as ct
import numpy as np
import pytest

import nlctl

methods = pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])


def integral(rate, end, method):
    """The integral of a function of time from 0 on."""
    system = ct.nlsys(lambda t, x, u, p: [rate(t)], None, inputs=0, outputs=1, states=1,
                      name="system")  # fmt: skip
    run = nlctl.input_output_response(
        system, [0, end], 0, 0, engine="native", method=method, rtol=1e-9, atol=1e-11
    )
    return float(run.states[0, -1])


@methods
def test_integers_before_a_pole(method):
    """1 / (1 - t) is between k and k + 1 for 1 / k - 1 / (k + 1): the sum of 1 / (k + 1)."""
    right = np.sum(1 / np.arange(2, 1001))
    assert integral(lambda t: np.floor(1 / (1 - t)), 0.999, method) == pytest.approx(
        right, abs=1e-9
    )


@methods
def test_a_square_wave_that_goes_up_and_up(method):
    """sin(t^2) is 0 at the roots of k pi: 3183 of them until t = 100."""
    at = np.append(np.sqrt(np.pi * np.arange(3184)), 100.0)
    right = np.sum((-1.0) ** np.arange(3184) * np.diff(at))
    found = integral(lambda t: np.sign(np.sin(t * t)), 100.0, method)
    assert found == pytest.approx(right, abs=1e-7)


@methods
def test_a_saw_of_ever_shorter_teeth(method):
    """The integral of t^2, without what it is rounded down to between roots of integers."""
    k = np.arange(3600)
    right = 60.0**3 / 3 - np.sum(k * (np.sqrt(k + 1) - np.sqrt(k)))
    assert integral(lambda t: (t * t) % 1.0, 60.0, method) == pytest.approx(right, abs=1e-8)


@methods
def test_a_crest_that_is_hardly_above_an_integer(method):
    """5 (1 + 1e-7) sin t is at least 5 for 2 acos(1 / (1 + 1e-7))."""
    top, quarter = 5 * (1 + 1e-7), np.pi / 2
    right = 2 * sum(quarter - np.arcsin(k / top) for k in range(1, 6))
    found = integral(lambda t: np.floor(top * np.sin(t)), np.pi, method)
    assert found == pytest.approx(right, abs=1e-8)


def test_what_is_too_fast_to_be_located_is_refused():
    with pytest.raises(nlctl.errors.ChatteringError, match="time alone switches too fast"):
        integral(lambda t: np.sign(np.sin(1e9 * t)), 10.0, "tsit5")
