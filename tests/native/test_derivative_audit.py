"""Exact derivatives are compared with differences, which know more of single points."""

import warnings

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl import errors
from nlctl.native.derivative_audit import checked_derivatives


def block(rate, states=1, inputs=0):
    """A block with states that are its outputs."""
    return ct.nlsys(lambda t, x, u, p: rate(x, u), None, states=states, inputs=inputs,
                    outputs=states, name="s")  # fmt: skip


def bristles(x, u):
    """z' = v - 2 |v| z, as a case of its own where nothing moves."""
    v, z = x
    return [-v, v * (1 - 2.0 * np.sign(v) * z) if v != 0 else 0.0]


def found_at_once(x, u):
    """y + 0.3 sin y = x, sought from y = x: at x = 0 the search ends before its first step."""
    y = x[0]
    for _ in range(30):
        missed = y + 0.3 * np.sin(y) - x[0]
        if abs(missed) < 1e-13:
            break
        y = y - missed / (1 + 0.3 * np.cos(y))
    return [-y]


def sweeps(x, u):
    """4 y1 - y2 = x1, 4 y2 - y1 = x2 by Gauss and Seidel: one sweep at rest."""
    y = np.zeros(2)
    for _ in range(40):
        old = y.copy()
        y[0] = (x[0] + y[1]) / 4
        y[1] = (x[1] + y[0]) / 4
        if np.allclose(y, old, rtol=1e-12, atol=1e-14):
            break
    return [-y[0], -y[1]]


def cardinal_sine(x, u):
    """sin(x) / x with its limit at 0."""
    return [-x[0] * (np.sin(x[0]) / x[0] if x[0] != 0 else 1.0)]


ALONE = {  # the point, and the derivatives there
    "bristles": (bristles, [0.0, 0.0], [[-1, 0], [1, 0]]),
    "found at once": (found_at_once, [0.0], [[-1 / 1.3]]),
    "sweeps": (sweeps, [0.0, 0.0], [[-4 / 15, -1 / 15], [-1 / 15, -4 / 15]]),
}


@pytest.mark.parametrize("name", ALONE)
def test_derivatives_of_a_point_alone_are_differences_and_it_is_said(name):
    rate, point, matrix = ALONE[name]
    compiled = nlctl.compile(block(rate, states=len(point)))
    with pytest.warns(errors.InexactWarning, match="by its expressions and .* by differences"):
        linear = compiled.linearize(point)
    np.testing.assert_allclose(linear.A, matrix, atol=1e-6)
    np.testing.assert_array_equal(linear.C, np.eye(len(point)))


@pytest.mark.parametrize("name", ["bristles", "found at once", "sweeps"])
def test_next_to_that_point_they_are_exact(name):
    rate, point, matrix = ALONE[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        linear = nlctl.compile(block(rate, states=len(point))).linearize([1e-4] * len(point))
    np.testing.assert_allclose(linear.A, matrix, atol=1e-3)


KINKS = {
    "|x|": (lambda x, u: [-abs(x[0])], 0.0, (-1, 0, 1)),
    "max(x, 0)": (lambda x, u: [-max(x[0], 0.0)], 0.0, (-1, 0)),
    "at a limit": (lambda x, u: [-np.clip(x[0], -1, 1)], 1.0, (-1, 0)),
    "a narrow dead zone": (lambda x, u: [x[0] - np.clip(x[0], -1e-9, 1e-9)], 0.0, (0,)),
    "a relay": (lambda x, u: [-np.sign(x[0]) - x[0]], 0.0, (-1,)),
    "a root": (lambda x, u: [-np.sqrt(abs(x[0])) - 3.0], 4.0, (-0.25,)),
    "a huge sum": (lambda x, u: [1e9 - x[0]], 0.0, (-1,)),
    "a sum that hides it": (lambda x, u: [1e12 - 1e-9 * x[0]], 1.0, (-1e-9,)),
    "nothing below": (lambda x, u: [-np.log(x[0])], 1e-300, (-1e300,)),
    "an even pole": (lambda x, u: [-1 / (x[0] ** 2 + 1e-20)], 0.0, (0,)),
    "a limit in words": (cardinal_sine, 0.0, (-1,)),
}


@pytest.mark.parametrize("name", KINKS)
def test_kinks_and_steep_functions_keep_what_the_expressions_say(name):
    """Where differences do not agree with each other, or cannot see it, they count for nothing."""
    rate, point, slopes = KINKS[name]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slope = float(np.asarray(nlctl.compile(block(rate)).linearize([point]).A)[0, 0])
    assert any(slope == pytest.approx(one, rel=1e-12) for one in slopes)


def test_where_a_function_raises_an_error_there_are_no_differences():
    def guarded(x, u):
        if x[0] >= 1.0:
            raise ValueError("out of range")
        return [-(x[0] ** 2)]

    compiled = nlctl.compile(block(guarded))
    assert pytest.approx(-1.0) == compiled.linearize([0.5]).A
    assert pytest.approx(-2.0) == compiled.linearize([1.0 - 1e-12]).A


@pytest.mark.parametrize("part", [0.97, 1.03, 0.0, -1.0])
def test_derivatives_that_are_wrong_everywhere_are_refused(part):
    """By the name of what changes, and of what it changes with."""
    exact = np.array([[-1.0, 2.0], [0.0, -3.0], [1.0, 0.0], [0.0, 1.0]])
    wrong = exact.copy()
    wrong[0, 1] *= part
    words = [[f"{row} by {column}" for column in "ab"] for row in "rsyz"]
    for point in (np.array([1.0, -0.5]), np.zeros(2)):
        right, said = checked_derivatives(
            words, exact, (lambda x: exact @ x, lambda x: exact), point
        )
        np.testing.assert_array_equal(right, exact)
        assert not said
        with pytest.raises(errors.AuditError, match=r"r by b is .* by its expressions and 2 "):
            checked_derivatives(words, wrong, (lambda x: exact @ x, lambda x: wrong), point)


def test_parameters_at_a_value_with_an_expression_of_its_own():
    """(exp(k x) - 1) / k is x at k = 0, where its derivative by k is x^2 / 2."""
    system = ct.nlsys(
        lambda t, x, u, p: [-np.expm1(p["k"] * x[0]) / p["k"] if p["k"] != 0 else -x[0]],
        None, inputs=0, outputs=1, states=1, params={"k": 0.0}, name="s",
    )  # fmt: skip
    compiled = nlctl.compile(system)
    with pytest.warns(errors.InexactWarning, match="by 's.k' is 0 by its expressions"):
        rates, _ = compiled.parameter_jacobian(["s.k"], [2.0])
    np.testing.assert_allclose(rates, -2.0, rtol=1e-4)
    rates, _ = compiled.parameter_jacobian(["s.k"], [2.0], params={"s.k": 1.0})
    np.testing.assert_allclose(rates, -(np.exp(2.0) + 1), rtol=1e-12)


def test_operating_points_and_frequency_responses_know_it():
    """v' = u - v - z, z' = v at rest: isolated, and v / u = s / (s^2 + s + 1) is 1 at s = j."""
    system = ct.nlsys(
        lambda t, x, u, p: [u[0] + bristles(x, u)[0] - x[1], bristles(x, u)[1]],
        lambda t, x, u, p: x[0], inputs=1, outputs=1, states=2, name="s",
    )  # fmt: skip
    point = nlctl.find_operating_point(system, [0.1, 0.1], [0.0])
    np.testing.assert_allclose(point.states, 0.0, atol=1e-9)
    assert point.isolated
    with pytest.warns(errors.InexactWarning, match="by differences, which are taken"):
        response = nlctl.frequency_response(system, [1.0], at=[0.0, 0.0])
    np.testing.assert_allclose(response.frdata[0, 0, 0], 1.0, atol=1e-5)


def test_what_leaves_a_delay_is_named():
    """y = x + z with x' = w - x, z' = w at rest, and w = r - y(t - 1/2)."""
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - x[0], u[0] * (1 - 2 * np.sign(u[0]) * x[1]) if u[0] else 0.0],
        lambda t, x, u, p: x[0] + x[1], inputs=["w"], outputs=["y"], states=2, name="plant",
    )  # fmt: skip
    late = nlctl.block(nlctl.TransportDelay(delay=0.5), "late")
    loop = ct.interconnect(
        [plant, late], [["late.u", "plant.y"], ["plant.w", "-late.y"]], ["plant.w"], ["plant.y"],
        inputs=["r"], outputs=["y"], name="loop",
    )  # fmt: skip
    with pytest.warns(errors.InexactWarning) as caught:
        response = nlctl.frequency_response(loop, [1.0], at=[0.0, 0.0])
    G = 1 / (1 + 1j) + 1 / 1j
    np.testing.assert_allclose(response.frdata[0, 0, 0], G / (1 + G * np.exp(-0.5j)), atol=1e-5)
    rate = "the derivative of the rate of 'plant_x[1]' of 'loop' by"
    of_r, of_delayed = sorted(str(warning.message) for warning in caught)[::-1]
    assert of_r.startswith(f"{rate} 'r' is 0")
    assert of_delayed.startswith(f"{rate} 'late.y' is 0")


def test_warnings_name_the_line_that_asks():
    """Of every way to linearize, python-control's too: a line of this file."""
    made, x0 = nlctl.compile(block(bristles, 2)), [0.0, 0.0]
    asking = (
        lambda: nlctl.linearize(made, x0), lambda: made.linearize(x0),
        lambda: ct.linearize(made, x0), lambda: nlctl.frequency_response(made, [1.0], at=x0),
    )  # fmt: skip
    for ask in asking:
        with pytest.warns(errors.InexactWarning) as caught:
            ask()
        assert {warning.filename for warning in caught} == {__file__}
