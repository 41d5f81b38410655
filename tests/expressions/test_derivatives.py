"""Exact derivatives: each row of the table, users' functions, both examples; Richardson's rule
and closed forms are the other way to the same numbers."""

import math
from functools import partial
from itertools import pairwise

import control as ct
import numpy as np
import pytest
import user_functions
from examples import many, some
from hypothesis import assume, given
from hypothesis import strategies as st
from user_function_checks import quiet

import nlctl
from nlctl.errors import UsageError
from nlctl.expressions.functions import FUNCTIONS, MATH
from nlctl.expressions.graph import numpy_function
from nlctl.native.along import derivatives
from nlctl.native.integrate.state import DIRECTIONS

ROWS = sorted(FUNCTIONS)
DOMAIN = {"arccosh": (1.1, 4.0), "arcsin": (-0.9, 0.9), "arccos": (-0.9, 0.9)}
DOMAIN |= {"arctanh": (-0.9, 0.9), "log1p": (-0.9, 4.0)}
DOMAIN |= dict.fromkeys(("log", "log2", "log10", "sqrt", "power"), (0.1, 4.0))


def extrapolated(function, h):
    """Return f'(0) of Richardson's rule over central differences with h, h/2, h/4 and h/8."""
    table = [(function(s) - function(-s)) / (2 * s) for s in h / 2.0 ** np.arange(4)]
    for order in (4, 16, 64):
        table = [(order * b - a) / (order - 1) for a, b in pairwise(table)]
    return table[0]


def differences(function, x, h=0.05):
    """Return the Jacobian of a function by `extrapolated`, column by column."""
    columns = [
        extrapolated(lambda s, e=e: function(x + s * e), h * max(1.0, abs(x[i])))
        for i, e in enumerate(np.eye(x.size))
    ]
    return np.stack(columns, axis=-1) if columns else np.zeros((function(x).size, 0))


def points_of(name):
    low, high = DOMAIN.get(name, (-4.0, 4.0))
    number = st.floats(low, high).filter(lambda v: abs(2 * v - np.rint(2 * v)) > 0.1)
    return st.lists(number, min_size=2, max_size=2, unique_by=lambda v: round(abs(v), 1))


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", ROWS)
@given(data=st.data())
def test_each_partial_derivative_of_the_table(name, data):
    """They agree with Richardson's rule away from kinks and jumps."""
    row, function = FUNCTIONS[name], numpy_function(name)
    x = np.array(data.draw(points_of(name))[: row.count])
    if name in ("remainder", "fmod", "floor_divide"):
        assume(abs(x[1]) > 0.5 and abs(x[0] / x[1] - np.rint(x[0] / x[1])) > 0.1)
    if name == "tan":
        assume(abs(np.cos(x[0])) > 0.1)  # Richardson's steps would reach across the pole
    for i, derivative in enumerate(row.derivative):
        along = np.eye(row.count)[i]
        wanted = extrapolated(lambda s, a=along: function(*(x + s * a)), 0.01)
        assert derivative(*x) == pytest.approx(wanted, rel=1e-8, abs=1e-8)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in ROWS if FUNCTIONS[name].enclosure])
@given(data=st.data())
def test_each_enclosure_of_the_table(name, data):
    """python-flint's ball of a number holds what NumPy computes, up to its rounding."""
    flint = pytest.importorskip("flint")
    x = data.draw(points_of(name))[0]
    ball = FUNCTIONS[name].enclosure(flint.arb(x))
    value = float(numpy_function(name)(x))
    assert (ball + flint.arb(0, 4e-15 * max(1.0, abs(value)))).contains(flint.arb(value))


def test_names_of_math_are_the_same_functions():
    for short, name in MATH.items():
        x = [1.5 if name == "arccosh" else 0.4, 0.7][: FUNCTIONS[name].count]
        assert getattr(math, short)(*x) == pytest.approx(float(numpy_function(name)(*x)), rel=1e-14)


def corpus():
    """Yield compiled entries of nine states that have expressions, with their systems."""
    for entry in some(user_functions.ENTRIES):
        try:
            with quiet():
                made = user_functions.system(entry.make(9), entry.name)
                compiled = nlctl.compile(made)
                _ = compiled.tangent
        except UsageError:
            continue
        if compiled.equations.calls:
            continue
        yield entry.name, made, compiled


def apart(found, function, point):
    """Return how far a Jacobian is from Richardson's, relatively, where that is sure of itself."""
    near, wide = (differences(function, point, h) for h in (0.01, 0.02))
    smooth = np.abs(near - wide) <= 1e-8 * np.maximum(1.0, np.abs(near))
    return np.where(smooth, np.abs(found - near) / np.maximum(1.0, np.abs(near)), 0.0), smooth


@pytest.mark.slow
def test_users_functions_against_richardson():
    """Wherever python-control's own function is smooth, its Jacobian is found to 1e-7."""
    rng, judged = np.random.default_rng(5), 0
    for name, system, compiled in corpus():
        x, u = rng.uniform(0.3, 0.9, system.nstates), rng.uniform(0.3, 0.9, system.ninputs)
        with quiet():
            if None in np.ravel(system.dynamics(0.31, x, u)):  # in no case of the function
                continue
            found = compiled.linearize(x, u, t=0.31)
            by_x = partial(lambda system, u, v: system.dynamics(0.31, v, u), system, u)
            by_u = partial(lambda system, x, v: system.dynamics(0.31, x, v), system, x)
            for matrix, function, point in ((found.A, by_x, x), (found.B, by_u, u)):
                error, smooth = apart(matrix, function, point)
                assert error.max(initial=0.0) < 1e-7, (name, matrix)
                judged += bool(smooth.size and smooth.all())
    assert judged > many(250, part=3)


@pytest.mark.slow
@pytest.mark.parametrize("example", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_both_examples_against_richardson(example):
    """The Jacobian of 31 and 33 states by forward mode, and along each parameter."""
    loop = example()
    compiled, rng = nlctl.compile(loop), np.random.default_rng(2)
    x = 0.3 * rng.normal(size=loop.nstates)
    found = compiled.linearize(x, t=1.3)
    wanted = differences(lambda v: loop.dynamics(1.3, v, []), x, 0.02)
    np.testing.assert_allclose(found.A, wanted, rtol=1e-9, atol=1e-9)
    outputs = differences(lambda v: loop.output(1.3, v, []), x, 0.02)
    np.testing.assert_allclose(found.C, outputs, rtol=1e-9, atol=1e-9)
    assert found.state_labels == loop.state_labels


def test_along_parameters():
    """Columns for qualified names, entries of arrays included."""
    loop = nlctl.paper.example_1()
    compiled = nlctl.compile(loop)
    x = 0.3 * np.random.default_rng(2).normal(size=loop.nstates)
    names = ["plant.p1", "controller.weights.Gamma", "plant.gain_x"]
    found, outputs = compiled.parameter_jacobian(names, x, t=0.7)
    values = nlctl.parameters(loop)["value"]
    for k, name in enumerate(names):
        at = lambda s, n=name: loop.dynamics(0.7, x, [], {n: values[n] + s})  # noqa: E731
        wanted = extrapolated(at, 0.05)
        np.testing.assert_allclose(found[:, k], wanted, rtol=1e-9, atol=1e-9)
    assert outputs.shape == (loop.noutputs, 3)
    with pytest.raises(nlctl.errors.UnknownNameError, match=r"plant\.p1"):
        compiled.parameter_jacobian(["plant.p11"], x)


def test_what_follows_from_a_parameter_outside_of_the_equations_is_refused():
    """The inverse's weights follow from those of the operator."""
    compiled = nlctl.compile(nlctl.block(nlctl.actuators.PrandtlIshlinskiiInverse(), "inverse"))
    x = np.zeros(compiled.system.nstates)
    for name in ("inverse.w_0", "inverse.w[0]", "inverse.r[1]"):
        with pytest.raises(
            nlctl.errors.CompileError, match=r"'[WR]_?0?' of block 'inverse' follows"
        ):
            compiled.parameter_jacobian([name], x, [3.0])
    sines = nlctl.compile(nlctl.block(nlctl.SumOfSines(order=2), "reference"))
    _, outputs = sines.parameter_jacobian(["reference.amplitudes[1]"], [], t=0.3)
    np.testing.assert_allclose(outputs[0], np.sin(0.5 * 0.3))  # its order follows from nothing


def test_linear_systems_are_their_own_linearization():
    """A chain of linear blocks gives the product's matrices, to rounding."""
    rng = np.random.default_rng(1)
    one = ct.rss(3, 2, 2, name="one")
    two = ct.ss(rng.normal(size=(2, 2)), np.eye(2), np.ones((1, 2)), 0, name="two")
    diagram = ct.interconnect(
        [one, two],
        connections=[["two.u[0]", "one.y[0]"], ["two.u[1]", "-one.y[1]"]],
        inplist=["one.u[0]", "one.u[1]"], outlist=["two.y[0]"],
    )  # fmt: skip
    found = nlctl.compile(diagram).linearize(np.zeros(5), 0.0)
    both = two * ct.ss([], [], [], np.diag([1.0, -1.0])) * one
    w = 1j * np.logspace(-1, 1, 5)
    np.testing.assert_allclose(found(w), both(w), rtol=1e-9)
    assert found.input_labels == diagram.input_labels


def test_what_python_control_takes_instead_of_a_compiled_diagram():
    """It linearizes it itself, exactly; differences agree, and what else it takes is printed."""
    loop = nlctl.paper.example_1()
    compiled, x = nlctl.compile(loop), 0.3 * np.random.default_rng(4).normal(size=loop.nstates)
    assert ".linearize(x0, u0); python-control's other functions take .system" in str(compiled)
    near = ct.linearize(compiled.system, x, t=0.7)
    exact = compiled.linearize(x, t=0.7)
    for name in "AC":
        np.testing.assert_allclose(getattr(near, name), getattr(exact, name), rtol=1e-4, atol=1e-4)
        np.testing.assert_array_equal(
            getattr(ct.linearize(compiled, x, t=0.7), name), getattr(exact, name)
        )
    assert exact.state_labels == loop.state_labels
    renamed = ct.linearize(compiled, x, copy_names=False, name="near", outputs=loop.output_labels)
    assert (renamed.name, renamed.state_labels[1]) == ("near", "x[1]")
    assert renamed.output_labels == loop.output_labels


COMPILED_ALREADY = {
    "compile": nlctl.compile,
    "interconnect, a list": lambda made: nlctl.interconnect([made]),
    "interconnect, by name": lambda made: nlctl.interconnect({"lag": made}),
    "compile, in a diagram of python-control": lambda made: nlctl.compile(
        ct.interconnect([made], inplist=["lag.u"], outlist=["lag.y"])
    ),
    "linearize, with a step width": lambda made: ct.linearize(made, [0.0], eps=1e-3),
}


@pytest.mark.parametrize("what", COMPILED_ALREADY)
def test_what_is_compiled_is_compiled_once(what):
    """Where a diagram is needed, or differences are asked for, one sentence says what to give."""
    lag = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag")
    with pytest.raises(UsageError, match=r"compiled already: .*\.system|argument 'eps'"):
        COMPILED_ALREADY[what](nlctl.compile(lag))


def test_an_operating_point_is_taken():
    """Its states and inputs are; inputs of another length are refused."""
    pendulum = ct.nlsys(
        lambda t, x, u, p: [x[1], u[0] - np.sin(x[0])], states=2, inputs=1, name="pendulum"
    )
    point = ct.OperatingPoint(np.array([np.pi / 6, 0.0]), np.array([0.5]))
    np.testing.assert_allclose(
        nlctl.compile(pendulum).linearize(point).A, [[0, 1], [-np.cos(np.pi / 6), 0]], rtol=1e-15
    )
    with pytest.raises(nlctl.errors.ParameterError, match="u0 needs 1 finite"):
        nlctl.compile(pendulum).linearize([0.0, 0.0], [1.0, 2.0])


def rings(n, gain):
    """Return n rings, each driven by the one before: v = gain sin(r - y), y = x + tanh(v) / 3."""
    plants = [
        ct.nlsys(
            lambda t, x, u, p: [u[0] - x[0] ** 3], lambda t, x, u, p: [x[0] + np.tanh(u[0]) / 3],
            states=1, inputs="v", outputs="y", name=f"plant{i}",
        ) for i in range(n)
    ]  # fmt: skip
    controllers = [
        ct.nlsys(
            None, lambda t, x, u, p: [p["gain"] * np.sin(u[0] - u[1])],
            inputs=["r", "y"], outputs="v", name=f"controller{i}", params={"gain": gain},
        ) for i in range(n)
    ]  # fmt: skip
    wires = [[f"plant{i}.v", f"controller{i}.v"] for i in range(n)]
    wires += [[f"controller{i}.y", f"plant{i}.y"] for i in range(n)]
    wires += [[f"controller{i}.r", f"plant{i - 1}.y"] for i in range(1, n)]
    return ct.interconnect(
        [*plants, *controllers], connections=wires, inplist="controller0.r", inputs="r",
        outlist=[f"plant{n - 1}.y"], outputs="y",
    )  # fmt: skip


@pytest.mark.parametrize("n", [1, 3])
def test_a_solved_loop_has_the_derivative_of_its_implicit_function(n):
    """With v' = a (r' - y'), y' = x' + b v' of every ring by hand: v' = a (r' - x') / (1 + a b)."""
    compiled = nlctl.compile(rings(n, 0.8), algebraic_loops="solve")
    x, r = 0.3 * np.random.default_rng(n).normal(size=n), np.array([0.7])
    found = compiled.linearize(x, r)
    rates, y = compiled.dynamics(0.0, x, r), float(r[0])
    dy, total = np.eye(n + 1)[n], []
    for i in range(n):
        v = rates[i] + x[i] ** 3
        a, b = 0.8 * np.cos(y - (x[i] + np.tanh(v) / 3)), (1 - np.tanh(v) ** 2) / 3
        dv = a * (dy - np.eye(n + 1)[i]) / (1 + a * b)
        total.append(dv - 3 * x[i] ** 2 * np.eye(n + 1)[i])
        dy, y = np.eye(n + 1)[i] + b * dv, x[i] + np.tanh(v) / 3
    np.testing.assert_allclose(np.hstack([found.A, found.B]), total, rtol=1e-13, atol=1e-14)
    np.testing.assert_allclose(np.hstack([found.C, found.D])[0], dy, rtol=1e-13, atol=1e-14)
    made = derivatives(compiled, compiled.parameter_vector())
    directions = np.zeros((n + 2, DIRECTIONS))
    directions[: n + 1, : n + 1] = np.eye(n + 1)
    dx = np.empty((n, DIRECTIONS))
    wide = [np.repeat(np.atleast_1d(v)[:, None], DIRECTIONS, 1) for v in (x, r)]
    made.point(np.zeros(DIRECTIONS), *wide, made.c)
    made.function(np.zeros(DIRECTIONS), *wide, made.c, directions, dx)
    np.testing.assert_allclose(dx[:, : n + 1], total, rtol=1e-13, atol=1e-14)


def test_a_loop_without_a_solution_or_with_many_has_no_derivative():
    """NaN, not 0: v = exp(v) + u has a solution for u < -1 only, v = v + 0 u has all."""
    none = ct.nlsys(
        None, lambda t, x, u, p: [np.exp(u[0]) + u[1]], inputs=["v", "u"], outputs="y", name="f"
    )
    ring = ct.interconnect(
        [none], connections=[["f.v", "f.y"]], inplist="f.u", inputs="u", outlist="f.y", outputs="y"
    )
    compiled = nlctl.compile(ring, algebraic_loops="solve")
    v = float(compiled.output(0.0, [], [-2.0])[0])
    slope = compiled.linearize([], [-2.0]).D[0, 0]
    np.testing.assert_allclose(slope, 1 / (1 - np.exp(v)), rtol=1e-14)
    assert np.isnan(compiled.linearize([], [2.0]).D[0, 0])


def test_the_derivative_of_nan_is_nan():
    """A branch that is NaN has no slope of 0."""
    half = ct.nlsys(
        lambda t, x, u, p: [np.where(x[0] > 0, u[0] - x[0], np.nan)], states=1, inputs=1
    )
    compiled = nlctl.compile(half)
    assert compiled.linearize([1.0]).A == -1.0
    assert np.isnan(compiled.linearize([-1.0]).A)
