"""The search with derivatives: linear programs, and loops whose worst inputs are known."""

from functools import partial

import control as ct
import numpy as np
import pandas as pd
import pytest
from arch_plants import inputs
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.robustness import (
    Experiment,
    Requirement,
    Space,
    Spec,
    Uncertain,
    always,
    evaluate,
    eventually,
    first_order,
    in_band,
    prepare,
    worst_case,
)
from nlctl.analysis.robustness.search.first_order import FirstOrder, lowest_nearby
from nlctl.analysis.robustness.search.worst_case import _next_radius, single_steps
from nlctl.analysis.robustness.search.worst_case import test_signals as signals_to_try

T = np.arange(12.0)
A, B = in_band("a", upper=1.0), in_band("b", lower=-1.0, upper=2.0, scale=1.5)
FORMULAS = [
    always(A),
    eventually(B, 2, 7),
    always(A) & eventually(B, 0, 4),
    always(A | eventually(B, 1, 3), 0, 8),
    ~always(A & B, 1, 9) | always(eventually(always(A, 0, 2), 0, 3), 0, 5),
]


def model(rng, formula, d=3):
    """Signals that are linear in d numbers."""
    requirement = Requirement(key="r", formula=formula, until=11.0)
    return FirstOrder(
        t=T, signals={name: rng.normal(size=T.size) for name in "ab"},
        derivatives={name: rng.normal(size=(T.size, d)) for name in "ab"},
        requirements=(requirement,),
    )  # fmt: skip


def margin_at(made, change):
    """The margin of the samples themselves: windows end at samples here."""
    (requirement,) = made.requirements
    moved = [made.signals[n] + made.derivatives[n] @ change for n in requirement.signals]
    return requirement.function(made.t, *moved, breaks=np.array([]))


@settings(deadline=None, max_examples=many(40))
@given(st.integers(0, 10_000), st.sampled_from(range(len(FORMULAS))))
def test_what_is_said_is_the_margin_there_and_no_random_place_of_the_box_is_far_lower(seed, number):
    rng = np.random.default_rng(seed)
    made, place = model(rng, FORMULAS[number]), np.full(3, 0.5)
    found, said = lowest_nearby(made, place, 0.5)
    assert np.all((found >= -1e-12) & (found <= 1 + 1e-12))
    assert said == pytest.approx(sampled(made, found - place), abs=1e-9)
    assert said <= sampled(made, np.zeros(3)) + 1e-9


def sampled(made, change):
    """The margin with windows over samples, by the definition."""
    (requirement,) = made.requirements
    y = {n: made.signals[n] + made.derivatives[n] @ change for n in made.signals}
    return trace(requirement.formula, y)[0]


def trace(formula, y):
    """rho at every sample: the recursion of signal temporal logic."""
    kind = type(formula).__name__
    if kind == "Band":
        v = y[formula.signal]
        return np.minimum(formula.upper - v, v - formula.lower) / formula.scale
    if kind == "Not":
        return -trace(formula.part, y)
    if kind == "And":
        return np.min([trace(part, y) for part in formula.parts], axis=0)
    inner, take = trace(formula.part, y), np.min if kind == "Always" else np.max
    windows = [(t + formula.start <= T) & (t + formula.end >= T) for t in T]
    return np.array([take(inner[w]) if w.any() else inner[-1] for w in windows])


@given(st.integers(0, 10_000))
def test_where_only_largest_values_count_it_is_the_lowest_of_all(seed):
    """Eventually of a half-line is convex in the signals: a linear program has its least."""
    rng = np.random.default_rng(seed)
    made = model(rng, eventually(in_band("a", lower=0.0, scale=1.0)))
    _, said = lowest_nearby(made, np.full(3, 0.5), 0.5)
    others = [sampled(made, rng.uniform(-0.5, 0.5, 3)) for _ in range(200)]
    assert said <= min(others) + 1e-9


def oscillator(count, end):
    """x'' = -x + u with u in pieces, and the x(end) that is largest: all pieces at one side."""
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], -x[0] + u[0]], lambda t, x, u, p: [x[0]], inputs=["u"],
        outputs=["x"], states=2, name="plant",
    )  # fmt: skip
    edges = np.linspace(0, end, count + 1)
    gains = np.cos(end - edges[1:]) - np.cos(end - edges[:-1])  # of each piece in x(end)
    build = lambda: nlctl.interconnect(  # noqa: E731
        [inputs.pieces("u", count, end / count), plant], outputs=["x"]
    )
    return build, gains


def experiment(build, count, formula, end):
    return Experiment(
        space=Space(quantities=tuple(
            Uncertain(name=name, bounds=(-1.0, 1.0), nominal=0.0)
            for name in inputs.names("u", count)
        )),
        build=build, spec=Spec(requirements=(Requirement(key="low", formula=formula, until=end),)),
        timepts=np.linspace(0, end, 201),
    )  # fmt: skip


@pytest.mark.slow
def test_a_falsifying_input_that_is_known_is_found_at_once():
    """x(T) = sum of g_k u_k is largest, sum of |g_k|, with u_k = sign(g_k): one linear program."""
    count, end = 14, 8.0
    build, gains = oscillator(count, end)
    largest = np.abs(gains).sum()
    formula = always(in_band("x", upper=0.999 * largest, scale=1.0), end, end)
    ready = prepare(experiment(build, count, formula, end))
    found = worst_case(
        partial(evaluate, ready), ready.experiment.space, 300, entropy=1, target=0.0,
        derivatives=partial(first_order, ready),
    )  # fmt: skip
    assert found.is_violated
    assert found.found_by == "gradient"
    assert found.first_violation == 4  # three test signals, one run with derivatives
    np.testing.assert_allclose(list(found.witness.values()), np.sign(gains), atol=1e-6)
    assert found.margin == pytest.approx(-0.001 * largest, abs=1e-5)
    assert found.without_derivative == ()
    plain = worst_case(partial(evaluate, ready), ready.experiment.space, 300, entropy=1, target=0.0)
    assert plain.first_violation is None or plain.first_violation > found.first_violation


def test_where_there_is_no_derivative_the_others_search_and_it_says_so():
    """In discrete time a diagram has none; the corner x = 3 is found all the same."""
    sum_of = ct.nlsys(
        lambda t, x, u, p: [x[0] + p["a"] - p["b"]], lambda t, x, u, p: [x[0]], inputs=0,
        outputs=["x"], states=1, dt=1.0, params={"a": 0.0, "b": 0.0}, name="sum",
    )  # fmt: skip
    space = Space(quantities=(
        Uncertain(name="sum.a", bounds=(0.0, 1.0)), Uncertain(name="sum.b", bounds=(0.0, 1.0)),
    ))  # fmt: skip
    low = Requirement(key="low", formula=always(in_band("x", upper=2.9)), until=3.0)
    ready = prepare(Experiment(
        space=space, build=lambda: sum_of, spec=Spec(requirements=(low,)), timepts=np.arange(4.0)
    ))  # fmt: skip
    found = worst_case(
        partial(evaluate, ready), space, 40, entropy=1, derivatives=partial(first_order, ready)
    )
    assert found.witness == {"sum.a": 1.0, "sum.b": 0.0}
    assert found.margin == pytest.approx(1 - 3.0 / 2.9)
    assert found.runs.get("gradient", 0) == 0
    assert "discrete time" in found.without_derivative[0]
    assert "discrete time" in str(found)


def test_signals_to_try_are_square_waves_constants_and_steps():
    names = [*inputs.names("u", 4), *inputs.names("v", 2), "k"]
    space = Space(quantities=tuple(Uncertain(name=name, bounds=(0.0, 1.0)) for name in names))
    made = signals_to_try(space)
    np.testing.assert_array_equal(made[0], [1, 0, 1, 0, 1, 0, 0.5])
    np.testing.assert_array_equal(made[1], [0, 0, 1, 1, 0, 1, 0.5])
    constants = made[2:6]
    np.testing.assert_array_equal(constants[:, [0, 4]], [[1, 0], [0, 0], [0, 1], [1, 1]])
    np.testing.assert_array_equal(made[6], 0.5)
    np.testing.assert_array_equal(made[1] + made[7], 1.0)


def test_simple_signals_change_seldom():
    """Where only constants near 0.7 violate, draws of every piece never do."""
    names = inputs.names("u", 20)
    space = Space(quantities=tuple(Uncertain(name=name, bounds=(0.0, 1.0)) for name in names))

    def distance(table):
        return table.assign(spec=np.abs(table[names] - 0.7).max(axis=1) - 0.1)

    simple = worst_case(distance, space, 300, entropy=1, target=0.0, derivatives=no_derivatives)
    assert simple.found_by == "simple signals"
    rows = simple.design.table[simple.searchers == "simple signals"].to_numpy()
    changes = (np.diff(rows, axis=1) != 0).sum(axis=1)
    assert set(changes) == {0, 1, 2}
    assert worst_case(distance, space, 300, entropy=1, target=0.0).margin > 0


def no_derivatives(row):
    """A loop that has none."""
    return FirstOrder(t=np.empty(0), signals={}, derivatives={}, requirements=(), reason="none")


def test_every_test_signal_is_run_and_those_of_each_kind_are_first():
    names = inputs.names("u", 6)
    space = Space(quantities=tuple(Uncertain(name=name, bounds=(0.0, 1.0)) for name in names))
    found = worst_case(
        lambda table: table.assign(spec=1.0), space, 60, entropy=1, derivatives=no_derivatives
    )
    tests, rows = signals_to_try(space), found.design.table.to_numpy()
    np.testing.assert_array_equal(rows[:3], [[1, 0, 1, 0, 1, 0], [0, 0, 0, 1, 1, 1], [1] * 6])
    np.testing.assert_array_equal(rows[found.searchers == "test signals"], tests)
    drawn = found.searchers[found.searchers != "derivatives"]
    assert set(drawn[3:23]) == {"simple signals"}
    assert set(drawn[23:31]) == {"steps"}  # behind 1, 2, 3, 4 pieces, upwards and downwards
    assert set(drawn[31 : 28 + len(tests)]) == {"test signals"}


def test_steps_are_of_one_signal_between_its_ends_behind_times_in_a_geometric_sequence():
    """Two signals of 9 pieces: 2 x 2 directions x 2 ends of the other, behind 1 2 3 4 6 8."""
    names = [*inputs.names("u", 9), *inputs.names("v", 9), "k"]
    space = Space(quantities=tuple(Uncertain(name=name, bounds=(0.0, 1.0)) for name in names))
    steps = single_steps(space, np.random.default_rng(1))
    assert len(np.unique(steps, axis=0)) == len(steps) == 2 * 2 * 2 * 6
    assert np.all(steps[:, 18] == 0.5)
    assert set(np.unique(steps[:, :18])) == {0.0, 1.0}
    jumps = np.abs(np.diff(steps[:, :18].reshape(-1, 2, 9), axis=2))
    np.testing.assert_array_equal(jumps.sum(axis=(1, 2)), 1)
    assert set(np.nonzero(jumps)[2] + 1) == {1, 2, 3, 4, 6, 8}
    without = Space(quantities=(Uncertain(name="k", bounds=(0.0, 1.0)),))
    assert single_steps(without, np.random.default_rng(1)).shape == (0, 1)


def bent(weight, count=6):
    """y(t_k) = u_k + weight sin(40 u_k) with its derivatives: weight 0 is linear."""
    names = inputs.names("u", count)
    space = Space(quantities=tuple(Uncertain(name=name, bounds=(0.0, 1.0)) for name in names))
    low = Requirement(key="low", formula=always(in_band("y", lower=-9.0, scale=1.0)), until=5.0)

    def value(table):
        u = np.asarray(table[names], dtype=float)
        return u + weight * np.sin(40 * u)

    def derivatives(row):
        u = np.array([row[name] for name in names])
        return FirstOrder(
            t=np.arange(count), signals={"y": value(pd.DataFrame([row]))[0]},
            derivatives={"y": np.diag(1 + 40 * weight * np.cos(40 * u))}, requirements=(low,),
        )  # fmt: skip

    return space, lambda table: table.assign(spec=value(table).min(axis=1) + 9.0), derivatives


@pytest.mark.parametrize("weight", [0.0, 0.2])
def test_the_first_descent_ends_where_the_first_order_fails(weight):
    """Of a linear margin nothing is left to gain; of a bent one a single step of it is run."""
    space, margin, derivatives = bent(weight)
    found = worst_case(margin, space, 100, entropy=1, derivatives=derivatives)
    start = int(np.argmax(found.searchers == "simple signals"))
    assert list(found.searchers[3:start]).count("gradient") <= 1
    u = np.linspace(0.0, 1.0, 100_001)
    assert found.margin == pytest.approx(9.0 + np.min(u + weight * np.sin(40 * u)), abs=0.02)


@given(st.floats(1 / 16, 1.0), st.floats(0.0, 2.0))
def test_steps_become_longer_where_the_first_order_is_right(radius, part):
    """By the part that is gained of what is predicted; never longer than the box, nor tiny."""
    following = _next_radius(radius, part * 0.3, 0.3)
    assert 1 / 16 <= following <= 1.0
    if part > 0.51:
        assert following == min(1.0, 2 * radius)
    if part < 0.24:
        assert following == max(radius / 4, 1 / 16)
