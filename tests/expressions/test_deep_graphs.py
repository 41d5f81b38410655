"""Graphs whose parts are used again and again, and long chains: work grows as the graph does."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl import errors
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph
from nlctl.expressions.signs import ANY_SIGN, NEVER_NEGATIVE, POSITIVE

DEEP = 60  # doublings: whoever visits each use of a part visits 2^60
BINARY = ("add", "sub", "mul", "div", "maximum", "minimum", "hypot")
UNARY = ("neg", "sqrt", "absolute", "exp", "cosh", "sin", "log")
steps = st.lists(st.tuples(st.sampled_from(BINARY + UNARY), st.integers(0), st.integers(0)))


def loop(update):
    """A diagram of one state."""
    return ct.nlsys(update, None, inputs=0, outputs=["x"], states=["x"], name="s")


def run(update, **settings):
    """A short run, by machine code and by SciPy with python-control's own right-hand side."""
    timepts, system = np.linspace(0.0, 0.5, 6), loop(update)
    response = nlctl.input_output_response(system, timepts, initial_state=0.4, **settings)
    reference = ct.input_output_response(
        system, timepts, 0.0, 0.4, solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12, "max_step": 1e-3}
    )
    return response.states, reference.states


@given(steps, st.integers(0, 2**32 - 1))
def test_signs_hold_wherever_an_expression_is_a_number(steps, seed):
    """At random points."""
    graph, rng = Graph(), np.random.default_rng(seed)
    nodes = [graph.leaf("x", i, None) for i in range(3)] + [graph.const(c) for c in (-1.0, 0, 0.5)]
    for op, i, j in steps:
        args = [nodes[i % len(nodes)], nodes[j % len(nodes)]][: 2 if op in BINARY else 1]
        nodes.append(graph.op(op, *args))
    with np.errstate(all="ignore"):
        values = evaluate_expressions(nodes, {"x": 3 * rng.standard_normal((3, 50))})
    for node, value in zip(nodes, values, strict=True):
        number = np.asarray(value)[~np.isnan(value)]
        assert node.sign == ANY_SIGN or np.all(number >= 0)


def test_signs_of_usual_divisors():
    """Above 0, at least 0, or neither."""
    graph = Graph()
    one, y = graph.const(1.0), graph.leaf("x", 0, None)
    square = graph.op("mul", y, y)
    above = graph.op("add", one, square)
    assert [
        graph.op(op, *args).sign
        for op, *args in (("exp", y), ("sqrt", above), ("maximum", y, one), ("div", one, above))
    ] == [POSITIVE] * 4
    assert [node.sign for node in (square, graph.op("absolute", y), graph.op("sqrt", y))] == [
        NEVER_NEGATIVE
    ] * 3
    assert [node.sign for node in (y, graph.op("sub", above, one), graph.op("mul", y, one))] == [
        ANY_SIGN
    ] * 3


def test_signs_of_what_is_used_twice_each_time():
    """1 + y^2 > 0 of a continued fraction, whose parts are used twice each."""

    def update(t, x, u, params):
        y = x[0]
        for _ in range(DEEP):
            y = y / (1 + y * y)
        return [-x[0] + (1.0 if y > 0.05 else 0.0)]

    native, reference = run(update)
    assert native == pytest.approx(reference, abs=1e-7)


def test_newtons_method_for_a_square_root():
    """Compiled by numba or not, it is what python-control computes."""

    def update(t, x, u, params):
        a, v = 1.0 + x[0] ** 2, 1.0
        for _ in range(20):
            new = 0.5 * (v + a / v)
            if abs(new - v) < 1e-12:
                break
            v = new
        return [v - 2 * x[0]]

    native, reference = run(update)
    assert native == pytest.approx(reference, abs=1e-7)


def test_powers_of_waves_have_no_frequencies_beyond_all_bounds():
    """(sin t cos 3t)^(2^60) is 0."""

    def update(t, x, u, params):
        y = np.sin(t) * np.cos(3 * t)
        for _ in range(DEEP):
            y = y * y
        return [-x[0] + y]

    native, _ = run(update)
    assert native[0] == pytest.approx(0.4 * np.exp(-np.linspace(0.0, 0.5, 6)), abs=1e-6)


def chains():
    """Right-hand sides of 400 steps, one inside the other."""

    def divided(t, x, u, params):
        y = 0.0
        for _ in range(400):
            y = (y + x[0]) / (2.0 + x[0] * x[0])
        return [-x[0] + (1.0 if y > 0.3 else 0.0)]

    def added(t, x, u, params):
        y = 0.0
        for k in range(400):
            y = y + x[0] * (1.0 + k)
        return [-x[0] + (0.1 if y > 3e4 else 0.0)]

    def multiplied(t, x, u, params):
        y = 1.0
        for k in range(400):
            y = y * (x[0] + 3.0 + k * 1e-3)
        return [-x[0] + (0.1 if y < 0.0 else 0.0)]

    return divided, added, multiplied


@pytest.mark.parted
@pytest.mark.parametrize("update", chains())
def test_a_long_chain_is_run(update):
    """Whatever follows its parts does not call itself for each."""
    native, reference = run(update)
    assert native == pytest.approx(reference, abs=1e-6)


def alternating(t, x, u, params):
    """700 differences, one inside the other."""
    y = x[0]
    for _ in range(700):
        y = -(0.99 * y - 0.1)
    return [-x[0] + 1e-6 * y]


@pytest.mark.weekly
def test_taylors_method_follows_a_long_chain():
    """Its coefficients are made parts first."""
    native, reference = run(alternating, method="taylor")
    assert native == pytest.approx(reference, abs=1e-7)


def test_what_is_too_deep_for_a_formula_has_none():
    """And says so."""
    with pytest.raises(errors.CompileError, match="'s' has no formula: its expressions are nested"):
        nlctl.typeset(loop(alternating))
