"""Opaque functions have differences for derivatives, and all around them stays exact."""

import control as ct
import numpy as np
import pytest
from scipy import special

import nlctl
from nlctl.native.along import derivatives
from nlctl.native.integrate.state import DIRECTIONS

POINT, INPUT, TIME = [0.7, -0.4], [0.3], 0.2
CLOSE = {"rtol": 1e-8, "atol": 1e-8}


def bessel(t, x, u, params):
    """Its derivative is J_0' = -J_1."""
    return [x[1], -params["k"] * special.ber(x[0] * x[1]) + u[0] ** 2]


def looped():
    """Return the opaque block behind a sine and before a lag."""
    opaque = ct.nlsys(
        bessel, lambda t, x, u, p: x[0], inputs="v", outputs="y", states=2, params={"k": 2.0},
        name="opaque",
    )  # fmt: skip
    sine = ct.nlsys(None, lambda t, x, u, p: np.sin(3 * u), inputs="e", outputs="v", name="sine")
    lag = ct.ss(-2.0, 1.0, 1.0, 0.0, inputs="y", outputs="w", name="lag")
    wires = [["sine.e", "lag.w"], ["opaque.v", "sine.v"], ["lag.y", "opaque.y"]]
    return ct.interconnect([opaque, sine, lag], connections=wires, inplist=["sine.e"],
                           outlist=["lag.w"], name="looped")  # fmt: skip


def expected(x, e):
    """Return the derivatives of the loop by the states and by e, which lag.w is added to."""
    first, second, w = x
    slope = -2.0 * special.berp(first * second)
    inner = 2 * np.sin(3 * (w + e)) * 3 * np.cos(3 * (w + e))
    rates = [[0, 1, 0], [slope * second, slope * first, inner], [1, 0, -2]]
    return np.array(rates), np.array([[0], [inner], [0]])


def test_a_loop_with_one_opaque_block_is_linearized():
    """-J_1 by differences, the lag's matrices to the last bit; a warning names the block."""
    x = [0.7, -0.4, 0.1]
    with pytest.warns(
        nlctl.errors.InexactWarning, match=r"update function of block 'opaque' .*ber.*exact"
    ):
        linear = nlctl.linearize(looped(), x, [0.3])
    A, B = expected(x, 0.3)
    np.testing.assert_allclose(linear.A, A, **CLOSE)
    np.testing.assert_array_equal(linear.A[2], A[2])
    np.testing.assert_allclose(linear.B, B, **CLOSE)


def test_the_stiff_method_has_the_same_derivatives():
    """Along directions in machine code; those that move nothing opaque are exact."""
    compiled = nlctl.compile(looped())
    p = compiled.parameter_vector()
    made = derivatives(compiled, p)
    x = np.repeat(np.array([[0.7], [-0.4], [0.1]]), DIRECTIONS, axis=1)
    t, u = np.zeros(DIRECTIONS), np.full((1, DIRECTIONS), 0.3)
    v = np.zeros((5, DIRECTIONS))
    v[:3, :3] = np.eye(3)
    dx = np.empty((3, DIRECTIONS))
    made.point(t, x, u, made.c)
    made.function(t, x, u, made.c, v, dx)
    np.testing.assert_allclose(dx[:, :3], expected([0.7, -0.4, 0.1], 0.3)[0], **CLOSE)
    np.testing.assert_array_equal(dx[:, 3:], 0.0)


def test_stiff_runs_agree_with_explicit_ones():
    times = np.linspace(0, 2, 21)
    runs = [
        nlctl.input_output_response(
            looped(), times, 0.1, [0.7, -0.4, 0.1], method=method, rtol=1e-8
        )
        for method in ("tsit5", "rodas5p")
    ]
    np.testing.assert_allclose(runs[0].states, runs[1].states, rtol=0, atol=1e-6)


def test_parameters_and_long_states_are_moved_as_well():
    """d/dk of -k J_0, and J_0 of eleven states at once."""
    many = ct.nlsys(lambda t, x, u, p: -p["k"] * special.ber(x), None, inputs=1, outputs=11,
                    states=11, params={"k": 2.0}, name="many")  # fmt: skip
    x = np.linspace(-30.0, 30.0, 11)
    with pytest.warns(nlctl.errors.InexactWarning):
        linear = nlctl.linearize(many, x)
    np.testing.assert_allclose(linear.A, np.diag(-2.0 * special.berp(x)), rtol=1e-7, atol=1e-7)
    with pytest.warns(nlctl.errors.InexactWarning):
        rates, _ = nlctl.compile(many).parameter_jacobian(["many.k"], x)
    np.testing.assert_allclose(rates[:, 0], -special.ber(x), **CLOSE)


def test_it_is_said_at_which_line_python_is_called_back(caplog):
    """In the printed form and, once, in a hint."""
    compiled = nlctl.compile(looped())
    for _ in range(2):
        nlctl.input_output_response(compiled, [0.0, 0.1], 0.0, [0.7, -0.4, 0.1])
    (hint,) = caplog.messages
    place = rf"test_differences.py, line {bessel.__code__.co_firstlineno + 2}"
    assert hint.startswith("hint: the update function of block 'opaque' is called back in Python")
    assert place in hint
    assert place in repr(compiled)
    assert "no faster than python-control" in repr(compiled)
