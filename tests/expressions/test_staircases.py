"""Searches of many passes: Python is called where expressions have not the slope of differences."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl import errors


def misses(y, x):
    """What a search makes 0: y + y^3 / 2 = x, which has the slope 1 / (1 + 1.5 y^2)."""
    return y + 0.5 * y**3 - x[0]


def halved_steps(t, x, u, params):
    """Steps from a start that follows the state: with all answers alike its slope is 0.3."""
    y, step = 0.3 * x[0], 2.0
    for _ in range(45):
        y = y - step if misses(y, x) > 0 else y + step
        step = step / 2
    return [-y]


def signed_steps(t, x, u, params):
    y, step = 0.3 * x[0], 2.0
    for _ in range(45):
        y -= step * np.sign(misses(y, x))
        step /= 2
    return [-y]


def copied_signs(t, x, u, params):
    y, step = 0.1 * x[0], 2.0
    for _ in range(45):
        y -= np.copysign(step, misses(y, x))
        step *= 0.5
    return [-y]


def bits(t, x, u, params):
    """The most significant bits first, as an analogue-to-digital converter finds them."""
    y = 0.0
    for k in range(30):
        more = y + 4.0 * 0.5**k
        y = more if misses(more, x) <= 0 else y
    return [-y]


def arrays_of_brackets(t, x, u, params):
    low, high = np.array([-4.0, -2.0]), np.array([4.0, 3.0])
    middle = low
    for _ in range(40):
        middle = (low + high) / 2
        above = misses(middle, x) > 0
        low, high = np.where(above, low, middle), np.where(above, middle, high)
    return [-0.5 * middle[0] - 0.5 * middle[1]]


def scattered_units(t, x, u, params):
    """A temperature of an enthalpy of about 1e6 J/kg: at most arguments the bracket has no root."""
    low, high, joules, middle = 0.0, 2000.0, 1e6 * (x[0] / 2), 0.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if misses(middle / 500, [joules / 5e5]) > 0:
            high = middle
        else:
            low = middle
    return [-middle / 500]


def patterns(t, x, u, params):
    """The least of the integral of what is missed, by steps that are halved where none helps."""
    cost, y, step = lambda y: y**2 / 2 + y**4 / 8 - x[0] * y, 0.0, 1.0
    for _ in range(60):
        if cost(y + step) < cost(y):
            y = y + step
        elif cost(y - step) < cost(y):
            y = y - step
        else:
            step = step / 2
    return [-y]


def parameter_sought(t, x, u, params):
    """The root depends on a parameter, whose value now says where it is."""
    low, high, middle = 0.0, 5e-3, 0.0
    for _ in range(40):
        middle = (low + high) / 2
        if misses(middle * params["scale"], x) > 0:
            high = middle
        else:
            low = middle
    return [-middle * params["scale"]]


def secants(t, x, u, params):
    a, b = 0.0, 2.0
    for _ in range(20):
        at_a, at_b = misses(a, x), misses(b, x)
        if abs(at_b - at_a) < 1e-14:
            break
        a, b = b, b - at_b * (b - a) / (at_b - at_a)
    return [-b]


def newton(t, x, u, params):
    y = x[0]
    for _ in range(30):
        change = misses(y, x) / (1 + 1.5 * y**2)
        y = y - change
        if abs(change) < 1e-12:
            break
    return [-y]


def damped(t, x, u, params):
    """Newton's method, each step halved until it helps."""
    y = 0.0
    for _ in range(12):
        change, part = misses(y, x) / (1 + 1.5 * y**2), 1.0
        for _ in range(3):
            if abs(misses(y - part * change, x)) > abs(misses(y, x)):
                part = part / 2
        y = y - part * change
    return [-y]


def clipped_fixed_point(t, x, u, params):
    y = 0.0
    for _ in range(80):
        y = 0.5 * (x[0] - 0.5 * np.clip(y, -1, 1) ** 3) + 0.5 * y
        if y > 2:
            y = 2.0
    return [-y]


def block(update):
    """A block of one state."""
    return ct.nlsys(update, None, inputs=0, outputs=["x"], states=["x"], name="s",
                    params={"scale": 1e3})  # fmt: skip


def slope(state):
    """-1 / (1 + 1.5 y^2) at the real root."""
    roots = np.roots([0.5, 0.0, 1.0, -state])
    return -1 / (1 + 1.5 * roots[abs(roots.imag) < 1e-9].real[0] ** 2)


SEARCHES = [halved_steps, signed_steps, copied_signs, bits, arrays_of_brackets, scattered_units,
            patterns, parameter_sought]  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("update", SEARCHES)
def test_a_staircase_is_called_and_has_the_slope_of_differences(update):
    compiled = nlctl.compile(block(update))
    (call,) = compiled.equations.calls.values()
    assert "a search by halves" in call.reason
    with pytest.warns(errors.InexactWarning):
        matrix = compiled.linearize([0.9], []).A
    np.testing.assert_allclose(matrix, slope(0.9), rtol=1e-2)


@pytest.mark.parted
@pytest.mark.parametrize("update", [secants, newton, damped, clipped_fixed_point])
def test_chains_of_answers_that_hardly_matter_are_expressions(update):
    compiled = nlctl.compile(block(update))
    assert not compiled.equations.calls
    for state in (0.9, -0.4):
        np.testing.assert_allclose(compiled.linearize([state], []).A, slope(state), rtol=1e-6)


def nearest_of_a_path(t, x, u, params):
    """The least of 40 distances, by a chain of comparisons: few answers, each of its own slope."""
    points = np.linspace(-2.0, 2.0, 40)
    nearest = points[np.argmin(abs(points - x[0]))]
    return [-(nearest**2) * x[0]]


def test_a_chain_of_few_answers_is_no_staircase():
    compiled = nlctl.compile(block(nearest_of_a_path))
    assert not compiled.equations.calls
    nearest = round((0.9 + 2) / (4 / 39)) * 4 / 39 - 2
    np.testing.assert_allclose(compiled.linearize([0.9], []).A, -(nearest**2), rtol=1e-12)
