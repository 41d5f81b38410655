"""What a diagram computes at points, in the one place where descriptions are compared."""

import contextlib

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.loop_record import loop_values
from nlctl.analysis.lyapunov import certify, read_parts
from nlctl.analysis.lyapunov.loop.checked import check_same, points_around
from nlctl.analysis.response_of_loop import check_response
from nlctl.blocks import Block
from nlctl.diagrams import leaves, overridden
from nlctl.diagrams.points import (
    SAME_FUNCTIONS,
    SHAKEN,
    agree,
    explained,
    rates_and_outputs,
    rounded_points,
)
from nlctl.diagrams.third_party import Named
from nlctl.upstream.control_internals import current_parameters

T = np.linspace(0.0, 0.2, 21)


def pendulum(gain=2.0):
    """A third-party block behind one of nlctl's, with parameters of both kinds."""
    plant = ct.nlsys(lambda t, x, u, p: [x[1], u[0] - p["k"] * np.sin(x[0])], lambda t, x, u, p: x,
                     inputs="v", outputs=["angle", "rate"], states=2, name="plant",
                     params={"k": 3.0})  # fmt: skip
    return nlctl.interconnect({"gain": nlctl.Gain(k=gain), "plant": plant}, inputs=["u"])


def parameters_now(system):
    """What the equations of all blocks read now."""
    return [(leaf.path, str(current_parameters(leaf.system))) for leaf in leaves(system)]


@given(st.lists(st.floats(-10, 10), min_size=3, max_size=3), st.floats(0.1, 5), st.floats(0.1, 5))
@settings(max_examples=many(20, part=4), deadline=None)
def test_the_values_are_the_closed_form(values, k, gain):
    x, u = np.array(values[:2]), np.array(values[2:])
    rates, outputs = rates_and_outputs(pendulum(), {"plant.k": k, "gain.k": gain})(0.3, x, u)
    np.testing.assert_allclose(rates, [x[1], gain * u[0] - k * np.sin(x[0])], rtol=1e-14)
    np.testing.assert_allclose(outputs, [gain * u[0], *x], rtol=1e-14)


@pytest.mark.parametrize("make", [
    lambda: ct.ss([[0, 1], [-2, -3]], [[0], [1]], [[1, 0]], 0.5, name="s"),
    lambda: ct.interconnect([ct.ss(-1, 1, 1, 0, name="a", inputs="u", outputs="y")], inputs="u",
                            outputs="y", name="d"),
    lambda: nlctl.compile(pendulum()),
    lambda: nlctl.block(nlctl.Saturation(), "limit"),
])  # fmt: skip
def test_they_are_python_controls(make):
    system = make()
    asked = getattr(system, "system", system)
    x, u = np.full(asked.nstates or 0, 0.3), np.full(asked.ninputs, 0.7)
    rates, outputs = rates_and_outputs(system)(0.0, x, u)
    if rates.size:
        np.testing.assert_array_equal(rates, asked.dynamics(0.0, x, u))
    np.testing.assert_array_equal(outputs, asked.output(0.0, x, u))


def test_rounding_is_no_difference_and_more_is():
    a = np.array([1.0, -3.0, np.inf, np.nan, 0.0])
    assert agree(a, a * (1 + SAME_FUNCTIONS / 2)).tolist() == [True, True, True, False, True]
    assert agree(a, a * (1 + 3 * SAME_FUNCTIONS)).tolist() == [False, False, True, False, True]
    assert agree(a, a + 1e-3, 2e-3).tolist() == [True, True, True, False, True]
    assert not agree(np.array([0.0]), np.array([np.finfo(float).tiny]))


@given(st.integers(1, 9), st.integers(0, 9), st.data())
@settings(max_examples=many(30, part=4), deadline=None)
def test_any_two_numbers_are_moved_apart_once_and_all_alike_once(n, m, data):
    x, u = np.ones(n), np.ones(m)
    moved = [np.r_[x, u] for _, x, u in rounded_points((0.0, x, u), 1e-9)]
    i, k = (data.draw(st.integers(0, n + m - 1)) for _ in range(2))
    assert any(np.ptp(row) == 0 for row in moved)
    assert i == k or any(row[i] != row[k] for row in moved)
    assert all(np.abs(row - 1).max() <= 2 * SHAKEN for row in moved)


def test_what_cancels_is_explained_by_its_terms():
    """(x + 1e6) - 1e6 - u moves as far as x and u do, not as its value of 0."""

    def function(t, x, u):
        return (x - u,)

    (far,) = explained(function, (0.0, np.array([7.0]), np.array([7.0])), (np.zeros(1),))
    assert 7e-11 < far[0] < 3e-10


def test_points_past_the_end_of_a_function_are_left_out():
    def root(t, x, u):
        if x[0] > 1:
            raise ValueError("math domain error")
        return (np.sqrt(1 - x),)

    (far,) = explained(root, (0.0, np.ones(1), np.zeros(1)), (np.zeros(1),))
    assert np.isfinite(far).all()
    assert far[0] > 0


@pytest.mark.parted
@pytest.mark.parametrize("enter", [
    lambda loop: overridden(loop, {"plant.k": 9.0, "gain.k": 9.0}),
    lambda loop: rates_and_outputs(loop, {"plant.k": 9.0})(0.0, np.zeros(2), np.zeros(1)),
    lambda loop: loop_values(loop, 1.0),
    lambda loop: check_response(loop, nlctl.input_output_response(
        loop, T, 1.0, params={"plant.k": 9.0}), {"plant.k": 9.0}),
])  # fmt: skip
def test_the_diagram_stays_as_it_is(enter):
    loop = pendulum()
    ct.input_output_response(loop, T, 1.0, params={"gain.k": 7.0})
    before = parameters_now(loop)
    enter(loop)
    assert parameters_now(loop) == before


@pytest.mark.parametrize("enter", [
    lambda loop: read_parts(loop, params={"law.beta": 9.0}),
    lambda loop: certify(loop, params={"law.beta": 9.0}, max_iterations=1),
    lambda loop: check_same(loop, nlctl.paper.example_1(), points_around(np.full(loop.nstates, .1)),
                            {"law.beta": 9.0}, {"law.beta": 9.0}),
])  # fmt: skip
def test_proofs_write_nothing_into_a_users_loop(enter):
    """Another thread may run it meanwhile, with parameters of its own."""
    loop = nlctl.paper.example_1()
    before = parameters_now(loop)
    with contextlib.suppress(nlctl.errors.UsageError):  # refused or not, nothing was written
        enter(loop)
    assert parameters_now(loop) == before


def test_parts_have_the_parameters_of_the_run():
    loop = nlctl.paper.example_1()
    assert read_parts(loop, params={"law.beta": 9.0}).gains.beta == 9.0
    assert read_parts(loop).gains.beta == read_parts(nlctl.paper.example_1()).gains.beta != 9.0


def ring(count, third_party):
    """Blocks in a ring, whose parameters go by their block's name."""

    def lag(i):
        made = ct.nlsys(lambda t, x, u, p: [np.tanh(u[0]) - p["k"] * x[0]], None, states=1,
                        inputs=[f"y{(i - 1) % count}"], outputs=[f"y{i}"], params={"k": 1.0 + i},
                        name=f"b{i}")  # fmt: skip
        if third_party:
            return made
        own = nlctl.block(nlctl.Lag(T=1.0 + i), f"b{i}")
        own.set_inputs(made.input_labels)
        own.set_outputs(made.output_labels)
        return own

    return nlctl.interconnect([lag(i) for i in range(count)])


@pytest.mark.parametrize(("third_party", "kind"), [(True, Named), (False, Block)])
def test_an_audit_resolves_parameters_once_and_not_at_each_evaluation(
    third_party, kind, monkeypatch
):
    """Each evaluation would cost the square of the number of blocks."""
    compiled = nlctl.compile(ring(12, third_party))
    counted, right = [], kind._taken
    monkeypatch.setattr(
        kind, "_taken", lambda self, params: counted.append(1) or right(self, params)
    )
    found = {}
    for wanted in (False, "every run"):
        counted.clear()
        nlctl.input_output_response(compiled, T, 0, np.full(12, 0.1), audit=wanted)
        found[wanted] = len(counted)
    assert found["every run"] - found[False] <= 2 * 12
