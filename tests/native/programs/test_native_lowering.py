"""Lowered programs against python-control: the same numbers for every member, from any diagram."""

import dataclasses
import importlib
import math
import pkgutil
import random

import control as ct
import numpy as np
import pytest
import test_native_rhs as diagrams_of
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core import config
from plain_plan import by_blocks
from scipy.special import ber

import nlctl
from nlctl.errors import CompileError
from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.lower import lower
from nlctl.native.machine.routine import lowered_code, plain_functions

WITH_JIT = not getattr(config, "DISABLE_JIT", False)


def evaluated(system, lanes, t, x, u, params=None, *, native=False, given=None):
    """Return the lowered program, and dx, g and y for members with parameters `params`."""
    compiled = compile_diagram(system, params=given)
    lowered = lower(compiled.schedule, compiled.program, lanes)
    p = np.array([compiled.parameter_vector(own) for own in params or [given] * lanes]).T.copy()
    prepare, rhs, out, *_ = lowered_code(lowered) if native else plain_functions(lowered)
    c = np.full((lowered.size, lanes), np.nan)
    rows = {**lowered.rows, "y": system.noutputs or 0}
    dx, g, m, y = (np.full((rows[name], lanes), np.nan) for name in ("dx", "g", "m", "y"))
    with np.errstate(all="ignore"):
        prepare(p, c)
        rhs(t, x, u, c, dx, g, m)
        out(t, x, u, c, y)
    return lowered, [dx, np.vstack([g, m]), y]


def points(system, lanes, seed=0):
    """Random times, states and inputs of as many members."""
    rng = np.random.default_rng(seed)
    shapes = (system.nstates or 0, lanes), (system.ninputs or 0, lanes)
    return rng.uniform(0, 5, lanes), *(rng.normal(size=shape) for shape in shapes)


def check(system, lanes=2, *, native=False, params=None, given=None, seed=0):
    """Every member agrees with python-control; return the lowered program."""
    t, x, u = points(system, lanes, seed)
    params = params or [given] * lanes
    lowered, (dx, _, y) = evaluated(system, lanes, t, x, u, params, native=native, given=given)
    for lane in range(lanes):
        own = None if isinstance(system, ct.StateSpace) else params[lane]
        at = (t[lane], x[:, lane], u[:, lane], own)
        np.testing.assert_allclose(dx[:, lane], system.dynamics(*at), rtol=1e-12, atol=1e-13)
        np.testing.assert_allclose(y[:, lane], system.output(*at), rtol=1e-12, atol=1e-13)
    return lowered


def static(function, inputs=1, outputs=1, **params):
    """A third-party block without states."""
    return ct.nlsys(None, function, inputs=inputs, outputs=outputs, name="b", params=params)


@pytest.mark.slow
@settings(max_examples=many(150, part=15))
@given(diagrams_of.diagrams(), st.integers(0, 1000), st.sampled_from([1, 2]))
def test_random_diagrams_agree_with_python_control(diagram, seed, lanes):
    """Random blocks, wiring, gains, nesting, linear parts."""
    lowered = check(diagram, lanes, seed=seed)
    assert not lowered.opaque


@pytest.mark.parted
@pytest.mark.parametrize("lanes", [1, 8])
@pytest.mark.parametrize("make", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_examples_in_machine_code(make, lanes):
    """Every member of the paper's loops with parameters of its own; nothing is called."""
    loop = make()
    rng = np.random.default_rng(1)
    params = [{"law.beta": b, "plant.d_phase": b} for b in rng.uniform(1, 4, lanes)]
    lowered = check(loop, lanes, native=WITH_JIT, params=params)
    assert not lowered.opaque
    order = loop.ninputs or len([s for s in loop.state_labels if "plant" in s])
    assert list(lowered.assumed.values()) == [order]


@pytest.mark.parametrize("make", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_corners_and_commitments_agree_with_the_program(make):
    """g holds what the blocks' own functions return."""
    loop = make()
    t, x, u = points(loop, 2)
    _, (_, g, _) = evaluated(loop, 2, t, x, u)
    compiled = compile_diagram(loop)
    assert compiled.program.events
    for lane in range(2):
        _, expected, _ = by_blocks(compiled, t[lane], x[:, lane], u[:, lane])
        np.testing.assert_allclose(g[:, lane], expected, rtol=1e-13)


@pytest.mark.parametrize(
    "make", [diagrams_of.predator_prey, diagrams_of.planar_vtol, diagrams_of.cruise_control]
)
def test_textbook_systems(make):
    """Foreign functions with dict parameters, nested functions and conditions."""
    assert not check(make(), 1).opaque
    assert not check(make(), 2, native=WITH_JIT).opaque


def test_an_announced_parameter_is_found():
    """get and in see it as they see it in the dict."""
    given = {"r": 2.0, "forced": 1}
    check(diagrams_of.predator_prey(), given=given)
    check(ct.rss(4, 2, 3))


def test_a_member_does_not_depend_on_the_others():
    """Permuting the members permutes the results, bit for bit, also beside NaN and huge angles."""
    loop = nlctl.paper.example_1()
    t, x, u = points(loop, 8)
    x[0, 3], x[30, 5], t[2] = np.nan, 40.0, 3e7
    _, found = evaluated(loop, 8, t, x, u, native=WITH_JIT)
    order = np.random.default_rng(0).permutation(8)
    x, u = x[:, order].copy(), u[:, order].copy()
    _, permuted = evaluated(loop, 8, t[order], x, u, native=WITH_JIT)
    for one, other in zip(found, permuted, strict=True):
        np.testing.assert_array_equal(one[:, order], other)
        assert np.isfinite(one[:, [0, 1, 2, 4, 6, 7]]).all()


@pytest.mark.parametrize("lanes", [1, 8])
def test_dead_zone_at_and_around_its_break_points(lanes):
    """The branches are Python's at every float, and NaN comes out as NaN."""
    block = nlctl.block(nlctl.DeadZone(), "dz")
    edges = [f(e, s) for e in (0.5, -0.3) for f, s in ((np.nextafter, 9), (np.nextafter, -9))]
    for value in [*edges, 0.5, -0.3, 0.0, -0.0, 2.0, -2.0, np.nan, np.inf]:
        u = np.full((1, lanes), value)
        _, (_, _, y) = evaluated(block, lanes, np.zeros(lanes), np.zeros((0, lanes)), u)
        with np.errstate(all="ignore"):
            expected = block.output(0.0, [], [value])
        np.testing.assert_allclose(y, np.broadcast_to(expected[:, None], (1, lanes)), rtol=1e-14)


@pytest.mark.parametrize("make", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_nan_goes_where_it_goes_in_the_program(make):
    """Each state in turn is NaN, one per member: the same derivatives and outputs are."""
    loop = make()
    chosen = [*range(5), *range(loop.nstates - 4, loop.nstates)]
    lanes = len(chosen)
    t, x, u = points(loop, lanes)
    x[chosen, range(lanes)] = np.nan
    _, found = evaluated(loop, lanes, t, x, u)
    compiled = compile_diagram(loop)
    for lane in range(lanes):
        with np.errstate(all="ignore"):
            expected = by_blocks(compiled, t[lane], x[:, lane], u[:, lane])
        for one, other in zip(found, expected, strict=True):
            np.testing.assert_array_equal(np.isnan(one[:, lane]), np.isnan(other))


def by_cases(t, x, u, params):
    """Nested conditions with an early return, min, max, abs and a loop."""
    value = u[0]
    if value > params["high"]:
        return [params["high"], 1.0]
    total = 0.0
    for k in range(3):
        if abs(value) < 0.3 * (k + 1) or value < -1:
            total += max(value, 0.1 * k)
        else:
            total -= min(value**2, 2)
    return [total, -1.0 if not value >= 0 else 0.5]


def test_conditions_take_the_branch_that_python_takes():
    """Over a range of values and for NaN."""
    block = static(by_cases, outputs=2, high=1.4)
    values = np.array([[-2.0, -1.0, -0.5, -0.2, 0.0, 0.25, 0.3, 0.59, 1.0, 1.4, 1.5, np.nan]])
    lanes = values.size
    lowered, (_, _, y) = evaluated(block, lanes, np.zeros(lanes), np.zeros((0, lanes)), values)
    assert not lowered.opaque
    for lane in range(lanes):
        np.testing.assert_array_equal(y[:, lane], block.output(0.0, [], values[:, lane]))


def while_loop(t, x, u, params):
    """A loop with a continue is not written out."""
    value, k = u[0], 0
    while abs(value) > 1.0:
        k += 1
        if k % 2:
            value = value / 3.0
            continue
        value = value / 2.0
    return [value * params["k"]]


def by_eigenvalues(t, x, u, params):
    matrix = np.array([[u[0], 1.0, 0.0], [params["k"], 2.0, 0.0], [0.0, 0.0, -99.0]])
    return [np.linalg.eigvals(matrix).real.max()]


@pytest.mark.slow
@pytest.mark.parametrize("function", [while_loop, by_eigenvalues])
@pytest.mark.parametrize("lanes", [2, pytest.param(1, marks=pytest.mark.weekly)])
def test_what_cannot_be_traced_is_called_for_each_member(function, lanes):
    """The result is the same, and the reason is known."""
    block = static(function, k=1.5)
    native = WITH_JIT and function is while_loop
    params = [{"k": 0.5 + lane} for lane in range(lanes)]
    lowered = check(block, lanes, native=native, params=params)
    assert list(lowered.opaque) == ["b_output_of_one"]


@pytest.mark.slow
def test_an_opaque_block_within_a_diagram():
    """States, inputs and parameters reach it, its results reach others, also long ones."""

    def update(t, x, u, params):
        slow = -params["k"] * x + t
        while slow[0] > 10.0:
            slow = slow - 1.0
        return slow * u[0]

    block = ct.nlsys(update, lambda t, x, u, params: 2 * x, inputs=["u"], outputs=12, states=12,
                     name="many", params={"k": 2.0})  # fmt: skip
    lag = diagrams_of.lag("lag", 1.5)
    loop = ct.interconnect([lag, block], [["many.u", "lag.y"], ["lag.u", ("many", "y[3]", -1.0)]],
                           inplist=["lag.u"], outlist=["many.y[2]", "many.y[11]"], name="loop",
                           check_unused=False)  # fmt: skip
    for lanes in (1, 2):
        native = WITH_JIT and lanes == 2
        lowered = check(loop, lanes, native=native, params=[{"k": 1.0 + i} for i in range(lanes)])
        assert list(lowered.opaque) == ["many_update_of_one"]


def mean_free(t, x, u, params):
    """The derivative of long states: each minus the mean of all, and clipped."""
    mean = np.sum(x) / x.size
    return np.clip(x - mean, -0.5, 0.5) * u[0] + params["bias"]


def long_outputs(t, x, u, params):
    """Sums of sums, parts, reversed parts, a joined vector and single elements."""
    centres = params["centres"]
    psi = np.exp(-((centres[:, 0] - u[0]) ** 2 + (centres[:, 1] - u[1]) ** 2) / params["w"] ** 2)
    psi = psi / np.sum(psi)
    moved = np.append(psi[1:], psi[0] * x[3])
    positive = np.where(x > 0, x, 0.0)
    return np.array([np.sum(moved * x[::-1]), psi[19], np.sum(moved[5:17]), positive[7], moved[19]])


@pytest.mark.parametrize("native", [False, pytest.param(True, marks=pytest.mark.skipif(
    not WITH_JIT, reason="nothing is compiled without JIT"))])  # fmt: skip
@pytest.mark.parametrize("lanes", [1, 2])
def test_long_vectors_in_loops(lanes, native):
    """20 elements, which no number of lanes divides: what is summed, cut and joined agrees."""
    rng = np.random.default_rng(2)
    params = {"centres": rng.normal(size=(20, 2)), "w": 1.5, "bias": rng.normal(size=20)}
    block = ct.nlsys(mean_free, long_outputs, inputs=2, outputs=5, states=20, name="long",
                     params=params)  # fmt: skip
    lowered = check(block, lanes, native=native)
    assert not lowered.opaque
    assert all(20 in {size for _, size in f.plan.loops} for f in lowered.functions.values())


def test_algebraic_loops_are_solved_for_each_member():
    """v = sin(u - v / 2): the lowered program solves it as the program does."""
    sine = static(lambda t, x, u, params: np.sin(u), k=1.0)
    loop = ct.interconnect([sine], [["b.u[0]", ("b", "y[0]", -0.5)]], inplist=["b.u[0]"],
                           outlist=["b.y[0]"], name="ring")  # fmt: skip
    u = np.array([[0.3, -1.2]])
    compiled = compile_diagram(loop, algebraic_loops="solve")
    lowered = lower(compiled.schedule, compiled.program, 2)
    prepare, _, out, *_ = plain_functions(lowered)
    c, y = np.empty((lowered.size, 2)), np.empty((1, 2))
    prepare(np.repeat(compiled.parameter_vector()[:, None], 2, axis=1), c)
    out(np.zeros(2), np.empty((0, 2)), u, c, y)
    np.testing.assert_allclose(np.sin(u - y / 2), y, atol=1e-12)


def test_a_block_that_feeds_itself_is_evaluated_as_often_as_it_takes():
    """Two channels in a row through one block: no loop, and no NaN of the first evaluation."""
    pair = static(lambda t, x, u, params: [np.sin(u[0]), np.cos(u[1]) * params["k"]], 2, 2, k=2.0)
    loop = ct.interconnect([pair], [["b.u[1]", "b.y[0]"]], inplist=["b.u[0]"],
                           outlist=["b.y[0]", "b.y[1]"], name="row")  # fmt: skip
    compiled = compile_diagram(loop)
    assert len(compiled.schedule.order) > len(compiled.schedule.nodes)
    for lanes in (1, 2):
        assert not check(loop, lanes).opaque


def test_a_thousand_nodes_stay_a_loop():
    """The program does not grow with the number of nodes, but for an element that is left over."""

    def lines(nodes):
        centres = nlctl.controllers.diagonal_centres(nodes, 2)
        loop = nlctl.paper.example_1(centres=centres)
        compiled = compile_diagram(loop)
        return len(lower(compiled.schedule, compiled.program).text.splitlines())

    assert lines(999) == lines(27)
    assert lines(1000) < lines(27) + 60


def blocks():
    """Every record of nlctl that is a block as it stands."""
    rooms = (nlctl.actuators, nlctl.controllers, nlctl.faults)
    inside = [m.name for r in rooms for m in pkgutil.walk_packages(r.__path__, f"{r.__name__}.")]
    for name in ("nlctl.plants", "nlctl.references", *inside):
        for thing in vars(importlib.import_module(name)).values():
            if dataclasses.is_dataclass(thing) and getattr(thing, "__module__", "") == name:
                missing = dataclasses.MISSING
                defaults = [(f.default, f.default_factory) for f in dataclasses.fields(thing)]
                has_states = getattr(thing, "states", ())
                parts = ("inputs", "output", "states", *(("update",) if has_states else ()))
                if (missing, missing) not in defaults and all(hasattr(thing, p) for p in parts):
                    yield thing


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("record", list(blocks()), ids=lambda record: record.__name__)
def test_nlctls_blocks_are_traced(record):
    """Each of them, unmodified, with nothing left to be called."""
    dt = 0.1 if getattr(record, "discrete", False) else None
    for lanes in (1, 2):
        assert not check(nlctl.block(record(), "block", dt=dt), lanes).opaque


def integer_arrays(t, x, u, params):
    counts = np.array([1, 2])
    counts[0] = u[0]
    return [counts[0] * 1.0, math.log(abs(u[0]), 2.0) + math.remainder(u[0], 0.4)]


def test_what_numpy_and_math_do_otherwise_is_done_so():
    """Assignment to integers cuts; logarithms to a base and IEEE remainders are others."""
    block = static(integer_arrays, outputs=2)
    u = np.array([[1.7, -2.9]])
    lowered, (_, _, y) = evaluated(block, 2, np.zeros(2), np.zeros((0, 2)), u)
    assert not lowered.opaque
    for lane in range(2):
        np.testing.assert_array_equal(y[:, lane], block.output(0.0, [], u[:, lane]))


def constant_results(t, x, u, params):
    """Twenty numbers that are no function of the state, or comparisons of it."""
    return x > 0 if params["k"] > 1 else np.linspace(0, 1, 20) + np.zeros(20)


@pytest.mark.parametrize("lanes", [1, 2])
def test_results_that_are_constants_or_truth_values(lanes):
    """They are written as the floats that NumPy makes of them."""
    block = ct.nlsys(constant_results, None, inputs=0, outputs=20, states=20, name="c",
                     params={"k": 1.0})  # fmt: skip
    assert not check(block, lanes, params=[{"k": 0.5 + lane} for lane in range(lanes)]).opaque


def impure():
    """A function with a memory of its own, and one that draws random numbers."""
    draw = np.random.default_rng(0).normal
    return (
        lambda t, x, u, params: [u[0] + draw()],
        lambda t, x, u, params: [u[0] + np.random.normal()],  # noqa: NPY002
        lambda t, x, u, params: [u[0] + random.random()],
    )


@pytest.mark.parametrize("function", impure())
def test_what_changes_between_calls_is_refused(function):
    """A number drawn while tracing would be the same for ever, and numba draws others."""
    with pytest.raises(CompileError, match="block 'b' cannot be compiled: its output function"):
        compile_diagram(static(function))


def test_assumed_integers_are_found_out():
    """An integer that steers a loop is assumed; one that is a number like others is not."""

    def output(t, x, u, params):
        return [params["m"] * sum(u[0] ** k for k in range(params["n"]))]

    block = static(output, n=3, m=4)
    compiled = compile_diagram(block)
    lowered = lower(compiled.schedule, compiled.program, 2)
    n, m = (compiled.program.layout[0][name].offset for name in "nm")
    assert lowered.assumed == {n: 3}
    p = np.repeat(compiled.parameter_vector()[:, None], 2, axis=1)
    assert lowered.holds_for(p)
    p[m] = 7
    assert lowered.holds_for(p)
    p[n, 1] = 2
    assert not lowered.holds_for(p)


def test_truth_values_are_parameters_like_others():
    """Members may differ in a Boolean: each gets its own branch."""
    params = [{"plant.integrate_w": flag} for flag in (True, False)]
    lowered = check(nlctl.block(nlctl.plants.ForcedDuffing(), "plant"), 2, params=params)
    assert not lowered.opaque


def test_arguments_stay_as_they_are_and_parts_are_views():
    """A function that changes arrays in place does what it does in NumPy."""

    def output(t, x, u, params):
        y = np.zeros(4)
        part = y[1:3]
        part += u[0]
        y[0] = y[2] * 2
        return y + u[0]

    block = static(output, outputs=4)
    u = np.array([[0.5, -1.0]])
    lowered, (_, _, y) = evaluated(block, 2, np.zeros(2), np.zeros((0, 2)), u)
    assert not lowered.opaque
    np.testing.assert_array_equal(y, [[1.5, -3.0], [1.0, -2.0], [1.0, -2.0], [0.5, -1.0]])


@pytest.mark.parted
@pytest.mark.parametrize("n", [6, 20])
@pytest.mark.parametrize(
    "places", [[0, 2, 1, 1, -1], [5, 3, 1], [], list(range(1, 13)), list(range(18, 1, -2))]
)
def test_elements_at_fixed_places_are_copies(places, n):
    """An array of indices: short ones as they come, long ones at equal distances."""
    picked = np.array([i for i in places if i < n], dtype=np.int64)

    def output(t, x, u, params):
        taken = (x * params["k"])[picked]
        taken += u[0]
        return np.append(x[picked] * u[0], np.append(taken, x[picked]))

    block = ct.nlsys(lambda t, x, u, params: -x, output, inputs=1, outputs=3 * picked.size,
                     states=n, name="picks", params={"k": 2.0})  # fmt: skip
    for lanes in (1, 2):
        assert not check(block, lanes).opaque


@pytest.mark.parametrize(
    "picked", [np.array([1, 2, 4, 8, 9, 11, 12, 13, 15, 18]), np.arange(20) > 9]
)
def test_many_elements_at_irregular_places_are_numbers_of_their_own(picked):
    block = ct.nlsys(lambda t, x, u, params: -x, lambda t, x, u, params: x[picked] * u[0],
                     inputs=1, outputs=10, states=20, name="picks")  # fmt: skip
    assert not check(block, native=False).opaque


def test_every_expression_is_computed_once():
    """sin(x1) of two blocks is one sine, and what depends on parameters alone is none."""

    def one(t, x, u, params):
        return [np.sin(u[0]) + np.sin(params["k"]), np.cos(u[0])]

    first = ct.nlsys(None, one, inputs=["u"], outputs=2, name="first", params={"k": 1.0})
    second = ct.nlsys(None, one, inputs=["u"], outputs=2, name="second", params={"k": 1.0})
    loop = ct.interconnect([first, second], inplist=[["first.u", "second.u"]],
                           outlist=["first.y", "second.y"], name="two")  # fmt: skip
    lowered = check(loop)
    plans = [lowered.functions[name].plan for name in ("rhs", "out")]
    computed = [n.op for plan in plans for n in plan.nodes if n not in plan.known]
    assert computed.count("sin") == computed.count("cos") == 1


def array_program(steps, n, opaque):
    """Functions that make vectors and numbers of each other in the given steps."""

    def update(t, x, u, params):
        vectors, numbers = [x, params["w"], x * u[0]], [u[0], u[1], t, params["k"]]
        for kind, i, j, k in steps:
            a, b = vectors[i % len(vectors)], vectors[j % len(vectors)]
            s = numbers[k % len(numbers)]
            if kind < 6:
                vectors.append(
                    [
                        lambda a, b, s: np.tanh(a + s * b),
                        lambda a, b, s: np.append(a[1:], s),
                        lambda a, b, s: a[::-1] * 0.5,
                        lambda a, b, s: np.where(a > s, a, b),
                        lambda a, b, s: np.append(b[: n // 2], a[n // 2 :]),
                        lambda a, b, s: a / (1.0 + np.sum(b * b)),
                    ][kind](a, b, s)
                )
            else:
                numbers.append(
                    [
                        lambda a, b, s: np.sum(a * b) / n,
                        lambda a, b, s, k=k: a[k % n],
                        lambda a, b, s: np.sin(s) + np.sum(a[2 : n - 1]),
                        lambda a, b, s: s if s > 0.1 else -s,
                    ][kind - 6](a, b, s)
                )
        while opaque and numbers[-1] > 1e3:
            numbers[-1] = numbers[-1] / 2
        return vectors[-1] + numbers[-1]

    def output(t, x, u, params):
        found = update(t, x, u, params)
        return np.append(found[:2], np.sum(found))

    return update, output


STEPS = st.tuples(st.integers(0, 9), *[st.integers(0, 20)] * 3)


@pytest.mark.slow
@settings(max_examples=many(100, part=25))
@given(st.lists(STEPS, max_size=7), st.sampled_from([9, 16, 20]), st.sampled_from([1, 2]),
       st.booleans())  # fmt: skip
def test_random_programs_of_vectors_agree_with_numpy(steps, n, lanes, opaque):
    """Whatever is computed of what: in loops, in memory, in advance, or called."""
    update, output = array_program(steps, n, opaque)
    params = {"w": np.linspace(-1, 1, n) ** 3, "k": 0.3}
    block = ct.nlsys(update, output, inputs=2, outputs=3, states=n, name="b", params=params)
    check(block, lanes)


@pytest.mark.slow
def test_a_joined_parameter_reaches_an_opaque_function():
    """Inputs that are made of parameters alone, some of them constants, are joined in advance."""

    def source(t, x, u, params):
        return np.append(params["gains"], [1.0, params["k"]])

    def sink(t, x, u, params):
        return [np.sum(u) + ber(u[0])]

    parts = [
        ct.nlsys(None, source, inputs=0, outputs=12, name="source",
                 params={"gains": np.arange(10.0), "k": 0.25}),
        ct.nlsys(None, sink, inputs=12, outputs=1, name="sink"),
    ]  # fmt: skip
    wires = [[f"sink.u[{i}]", f"source.y[{i}]"] for i in range(12)]
    loop = ct.interconnect(parts, wires, outlist=["sink.y[0]"], name="loop")
    for lanes in (1, 2):
        assert list(check(loop, lanes).opaque) == ["sink_output_of_one"]
