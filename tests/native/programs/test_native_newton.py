"""The search for the signals of algebraic loops: its steps by hand, and loops as they run."""

import os
import subprocess
import sys
from pathlib import Path

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core import config
from places import SUPPORT
from plain_plan import interpreted
from scipy.optimize import brentq
from scipy.special import erfcx

import nlctl
from nlctl.errors import CompileError
from nlctl.expressions.elimination import SINGULAR, linear_solution
from nlctl.native.codegen.newton import _MOST, STARTS, improved
from nlctl.native.codegen.solver import DONE, GUESS

needs_jit = pytest.mark.skipif(
    getattr(config, "DISABLE_JIT", False), reason="thousands of searches"
)


def static(name, function, inputs, outputs, **params):
    return ct.nlsys(None, function, inputs=inputs, outputs=outputs, name=name, params=params)


def solved(diagram):
    return nlctl.compile(diagram, algebraic_loops="solve")


@settings(max_examples=many(60))
@given(st.integers(1, 6), st.integers(0, 10**6))
def test_a_newton_step_is_the_solution_of_its_equations(n, seed):
    """Against LAPACK; rows that must be exchanged among them."""
    rng = np.random.default_rng(seed)
    matrix, b = rng.normal(size=(n, n)), rng.normal(size=n)
    matrix[0, 0] *= rng.integers(0, 2)
    if np.linalg.cond(matrix) < 1e5:
        x, is_regular = linear_solution(matrix.tolist(), b.tolist())
        assert is_regular
        np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1e-9)


@pytest.mark.parametrize(
    ("matrix", "expected"),
    [
        ([[1.0, 2.0], [2.0, 4.0]], False),
        ([[np.nan, 0.0], [0.0, 1.0]], False),
        ([[np.inf, 0.0], [0.0, 1.0]], False),
        ([[1.0, np.nan], [0.0, 1.0]], False),
        ([[0.5 * SINGULAR]], False),
        ([[2.0 * SINGULAR]], True),
        ([[0.0, 1.0], [1.0, 0.0]], True),
    ],
)
def test_singular_matrices_are_told(matrix, expected):
    """Also those that are not finite."""
    with np.errstate(all="ignore"):
        assert bool(linear_solution(matrix, [1.0] * len(matrix))[1]) == expected


def searched(f, slope):
    """The guesses of a search for one signal, from the function and its derivative."""
    state = [0.0, 0.0, 0.0, np.inf, STARTS[0], 0.0]
    guesses = []
    with np.errstate(all="ignore"):
        while state[0] != DONE:
            guesses.append(float(state[GUESS]))
            state = improved(1, state, [f(guesses[-1])], [[slope(guesses[-1])]])
    return guesses, float(state[GUESS])


def test_the_search_is_newtons():
    """z = cos(z): quadratic convergence from 0, and the root itself."""
    guesses, z = searched(np.cos, lambda z: -np.sin(z))
    newton = [0.0]
    for _ in range(3):
        newton.append(newton[-1] - (np.cos(newton[-1]) - newton[-1]) / (-np.sin(newton[-1]) - 1))
    np.testing.assert_allclose(guesses[:4], newton, rtol=1e-14)
    assert len(guesses) <= 7
    assert z == pytest.approx(brentq(lambda v: np.cos(v) - v, 0, 1, xtol=1e-15), rel=1e-15)


def test_steps_that_lead_away_are_halved_and_other_starts_are_tried():
    """arctan overshoots; log has no value at 0 and a solution only from 1."""
    guesses, z = searched(lambda v: v - np.arctan(v - 4.0), lambda v: 1 - 1 / (1 + (v - 4.0) ** 2))
    assert z == pytest.approx(4.0, rel=1e-14)
    apart = [abs(np.arctan(v - 4.0)) for v in guesses]
    assert max(apart[1:]) > apart[0]  # that one was not taken
    guesses, z = searched(lambda v: 0.5 * np.log(v) + 2.0, lambda v: 0.5 / np.float64(v))
    assert guesses[:2] == [0.0, 1.0]
    assert z == pytest.approx(0.5 * np.log(z) + 2.0, rel=1e-14)
    guesses, z = searched(lambda v: v * v + 1.0, lambda v: 2.0 * v)
    assert np.isnan(z)
    assert len(guesses) < 200


def coupled():
    """Three signals through two blocks, one of them with a saturation, behind another loop."""

    def pair(t, x, u, params):
        return [np.tanh(u[0] + params["k"] * u[1]) + u[2], np.clip(u[0] - 0.5 * u[1], -0.4, 0.4)]

    first = static("first", lambda t, x, u, params: np.cos(u[0]) - 0.5 * u[1], ["r", "v"], ["y"])
    two = static("two", pair, ["a", "b", "r"], ["p", "q"], k=0.3)
    third = static("third", lambda t, x, u, params: 0.5 * u[0] - u[1], ["p", "q"], ["w"])
    lag = ct.ss(-1, 1, 1, 0, inputs="w", outputs="x", name="lag")
    wires = [["first.v", "first.y"], ["two.a", "third.w"], ["two.b", "two.p"],
             ["two.r", "first.y"], ["third.p", "two.p"], ["third.q", "two.q"],
             ["lag.w", "third.w"], ["first.r", "lag.x"]]  # fmt: skip
    return ct.interconnect([first, two, third, lag], wires, outlist=["first.y", "third.w"],
                           name="coupled")  # fmt: skip


def residuals(k, x, y, w):
    """What the equations of `coupled` leave of a solution, with p and q found by iteration."""
    p = 0.0
    for _ in range(300):
        p = 0.5 * p + 0.5 * (np.tanh(w + k * p) + y)
    q = np.clip(w - 0.5 * p, -0.4, 0.4)
    return np.cos(x) - 0.5 * y - y, 0.5 * p - q - w


@pytest.mark.parted
@pytest.mark.parametrize("x", [-1.0, 0.2, 3.0])
@pytest.mark.parametrize("k", [0.3, -0.8])
def test_loops_behind_each_other(k, x):
    """The second is solved with what the first results in."""
    compiled = solved(coupled())
    assert len(compiled.schedule.loops) == 2
    y, w = compiled.output(0.0, [x], (), {"k": k})
    np.testing.assert_allclose(residuals(k, x, y, w), 0.0, atol=1e-12)
    np.testing.assert_allclose(compiled.dynamics(0.0, [x], (), {"k": k}), -x + w, rtol=1e-14)


@pytest.mark.weekly
@needs_jit
def test_members_with_loops_run_side_by_side():
    """Each as alone, bit for bit, and as in python-control with the loop solved by hand."""
    k = np.linspace(-0.4, 0.45, 11)  # at k = 0.5 the matrix is singular at each start
    compiled, times = solved(coupled()), np.linspace(0, 2, 9)
    given = {"keep": ["y[1]"], "rtol": 1e-9, "atol": 1e-11}
    every = nlctl.ensemble_response(compiled, times, params={"k": k}, **given)
    samples = next(iter(every.signals.values()))
    for member in (0, 7, 10):
        alone = nlctl.ensemble_response(compiled, times, params={"k": k[member]}, **given)
        np.testing.assert_array_equal(samples[member], next(iter(alone.signals.values()))[0])
        run = nlctl.input_output_response(compiled, times, params={"k": k[member]}, rtol=1e-9)
        np.testing.assert_allclose(run.outputs[1], samples[member], rtol=1e-7, atol=1e-9)
    assert np.ptp(samples[:, -1]) > 1e-3


@needs_jit
def test_a_member_without_a_solution_leaves_the_others_alone():
    """y = a + y^2 has one for a <= 1/4."""
    square = static("f", lambda t, x, u, params: params["a"] + u[0] ** 2, ["v"], ["y"], a=0.1)
    lag = ct.ss(-1, 1, 1, 0, inputs="u", outputs="x", name="lag")
    diagram = ct.interconnect([square, lag], [["f.v", "f.y"], ["lag.u", "f.y"]],
                              outlist=["lag.x"], outputs=["x"], name="d")  # fmt: skip
    a = np.array([0.1, 0.3, 0.2, 0.0])
    every = nlctl.ensemble_response(solved(diagram), [0.0, 1.0], params={"a": a}, keep=["x"])
    assert list(every.table["status"]) == ["OK", "DIVERGED", "OK", "OK"]
    fixed = (1 - np.sqrt(1 - 4 * a[[0, 2, 3]])) / 2
    np.testing.assert_allclose(every.signals["x"][[0, 2, 3], -1], fixed * (1 - np.exp(-1)),
                               rtol=1e-5, atol=1e-12)  # fmt: skip


def test_long_vectors_inside_of_a_loop():
    """Twenty basis functions of the signal that is solved for."""
    centres = np.linspace(-2, 2, 20)

    def basis(t, x, u, params):
        return 0.1 * np.sum(np.exp(-((u[0] - params["centres"]) ** 2))) - u[1]

    block = static("f", basis, ["v", "u"], ["y"], centres=centres)
    diagram = ct.interconnect([block], [["f.v", "f.y"]], inplist=["f.u"], outlist=["f.y"],
                              name="rbf")  # fmt: skip
    for u in (-0.7, 0.1, 1.4):
        (y,) = solved(diagram).output(0.0, [], [u])
        assert y == pytest.approx(0.1 * np.sum(np.exp(-((y - centres) ** 2))) - u, rel=1e-13)


def test_a_loop_is_audited():
    """Each block's outputs are compared with its own function at the inputs that it has."""
    times = np.linspace(0, 1, 5)
    run = nlctl.input_output_response(solved(coupled()), times, audit="every run")
    assert run.statistics.status.name == "OK"


@pytest.mark.slow
@pytest.mark.parametrize("n", [pytest.param(_MOST, marks=pytest.mark.weekly), _MOST + 1])
def test_many_signals_in_a_loop(n):
    """Each is the cosine of its right neighbour and of itself: all are equal."""

    def output(t, x, u, params):
        return [np.cos(0.5 * u[i] + 0.5 * u[(i + 1) % n]) for i in range(n)]

    block = static("f", output, n, n)
    wires = [[f"f.u[{i}]", f"f.y[{i}]"] for i in range(n)]
    diagram = ct.interconnect([block], wires, outlist=["f.y[0]"], name="ring")
    if n > _MOST:
        with pytest.raises(CompileError, match=f"{n} signals have to be found together"):
            solved(diagram)
        return
    compiled = solved(diagram)
    assert len(compiled.schedule.loops[0].torn) == _MOST
    y = np.empty(1)
    interpreted(compiled)[1](0.0, [], [], compiled.parameter_vector(), y)
    assert y == pytest.approx(brentq(lambda v: np.cos(v) - v, 0, 1, xtol=1e-15), rel=1e-14)


@pytest.mark.weekly
def test_a_program_is_the_same_in_every_process():
    """What a search is given goes by the order of the expressions, not by addresses."""
    script = (
        "import hashlib, test_native_newton as t\n"
        "compiled = t.solved(t.coupled())\n"
        "print(hashlib.sha256(compiled.lowered.text.encode()).hexdigest())\n"
    )
    path = os.pathsep.join([str(SUPPORT), os.environ.get("PYTHONPATH", "")])
    texts = {
        subprocess.run(
            [sys.executable, "-c", script], cwd=Path(__file__).parent, check=True, text=True,
            env=os.environ | {"PYTHONHASHSEED": seed, "PYTHONPATH": path}, capture_output=True,
        ).stdout
        for seed in ("1", "2")
    }  # fmt: skip
    assert len(texts) == 1


def test_an_opaque_function_in_a_loop_is_refused_by_name():
    """It has no derivative; beside a loop it is called as everywhere."""
    opaque = static("table", lambda t, x, u, params: erfcx(u[0]), ["v"], ["y"])
    ring = ct.interconnect([opaque], [["table.v", "-table.y"]], outlist=["table.y"], name="ring")
    said = (
        r"loop through table\.y cannot be solved: the output function of block 'table' is called "
    )
    with pytest.raises(CompileError, match=said):
        solved(ring)
    traced = static("f", lambda t, x, u, params: np.cos(u[0]) + u[1], ["v", "u"], ["y"])
    beside = ct.interconnect([opaque, traced], [["f.v", "f.y"], ["f.u", "table.y"]],
                             inplist=["table.v"], outlist=["f.y"], name="beside")  # fmt: skip
    (y,) = solved(beside).output(0.0, [], [0.7])
    assert y == pytest.approx(np.cos(y) + erfcx(0.7), rel=1e-14)
