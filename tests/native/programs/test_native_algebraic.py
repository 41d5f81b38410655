"""Signals that depend on each other at the same instant: false loops, and true ones solved."""

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from plain_plan import interpreted
from scipy.linalg import block_diag
from scipy.special import lambertw

import nlctl
from nlctl.errors import AlgebraicLoopError, UsageError
from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.diagram.schedule import first_loop, schedule, tear


def called(compiled, t=0.0, x=(), u=(), *, native=False):
    """Derivatives and outputs of a compiled diagram."""
    rhs, out = compiled.native if native else interpreted(compiled)
    x, u, p = np.array(x, dtype=float), np.array(u, dtype=float), compiled.parameter_vector()
    dx, y = np.zeros(x.size), np.zeros(compiled.system.noutputs)
    with np.errstate(all="ignore"):
        rhs(t, x, u, p, dx, *(np.zeros(compiled.lowered.rows[name]) for name in "gm"))
        out(t, x, u, p, y)
    return dx, y


def solved(diagram):
    return compile_diagram(diagram, algebraic_loops="solve")


def ring(function, **kwargs):
    """y = function(y + u)."""
    block = ct.nlsys(None, function, inputs=["v"], outputs=["y"], name="f", **kwargs)
    return ct.interconnect(
        [block], [["f.v", "f.y"]], inplist=["f.v"], inputs=["u"], outlist=["f.y"], name="ring"
    )


def channels(kind):
    """Two channels in one block; what leaves the first one enters the second."""
    if kind == "linear":
        return ct.ss([], [], [], np.diag([2.0, 3.0]), inputs=2, outputs=2, name="two")
    return ct.nlsys(
        None, lambda t, x, u, params: [np.sin(u[0]), u[1] ** 2], inputs=2, outputs=2, name="two"
    )


@pytest.mark.parametrize("kind", ["linear", "third-party"])
@pytest.mark.parametrize("native", [False, True])
def test_channels_through_one_block_are_no_loop(kind, native):
    """A block that feeds itself through separate channels runs, as it does in python-control."""
    diagram = ct.interconnect(
        [channels(kind)], [["two.u[1]", "two.y[0]"]], inplist=["two.u[0]"],
        outlist=["two.y[0]", "two.y[1]"], name="diagram",
    )  # fmt: skip
    compiled = compile_diagram(diagram)
    assert not compiled.schedule.loops
    assert len(compiled.schedule.order) > len(compiled.schedule.nodes)
    np.testing.assert_array_equal(
        called(compiled, u=[0.7], native=native)[1], diagram.output(0, [], [0.7])
    )


def test_a_loop_that_only_a_rare_branch_closes_is_found():
    """Dependence is read from the expressions and not tried out at some points."""

    def rare(t, x, u, params):
        return [u[0] + (u[1] if 0.3 < u[0] < 0.3000001 else 0.0), u[1]]

    diagram = ct.interconnect(
        [ct.nlsys(None, rare, inputs=2, outputs=2, name="two")], [["two.u[1]", "two.y[0]"]],
        inplist=["two.u[0]"], outlist=["two.y[0]", "two.y[1]"], name="diagram",
    )  # fmt: skip
    with pytest.raises(AlgebraicLoopError, match=r"two\.y\[0\] -> two\.y\[0\] has no"):
        compile_diagram(diagram)
    compiled = compile_diagram(diagram, algebraic_loops="solve")
    np.testing.assert_array_equal(called(compiled, u=[0.5])[1], [0.5, 0.5])
    assert np.isnan(called(compiled, u=[0.30000005])[1]).all()  # y = u + y has no solution


def test_a_loop_is_an_error_unless_asked_for():
    """The message has the ring of signals and the way out."""
    diagram = ring(lambda t, x, u, params: 0.5 * u)
    with pytest.raises(AlgebraicLoopError, match=r"f\.y -> f\.y has no .*algebraic_loops='solve'"):
        compile_diagram(diagram)
    with pytest.raises(UsageError, match="unknown choice 'newton' for algebraic_loops"):
        compile_diagram(diagram, algebraic_loops="newton")


@pytest.mark.slow
@settings(max_examples=many(25, part=3))
@given(st.integers(1, 4), st.integers(1, 3), st.integers(0, 10**6))
def test_rings_of_direct_feedthrough_are_exact_to_rounding(count, size, seed):
    """Linear blocks in a ring, states included, agree with the closed loop of matrix algebra."""
    rng = np.random.default_rng(seed)
    blocks = [
        ct.ss(*(rng.normal(size=(size, size)) for _ in range(4)), name=f"b{i}")
        for i in range(count)
    ]
    wires = [[f"b{(i + 1) % count}.u[{k}]", f"b{i}.y[{k}]"] for i in range(count)
             for k in range(size)]  # fmt: skip
    # a diagram of linear blocks alone would be linearised by python-control, which fails
    idle = ct.nlsys(None, lambda t, x, u, params: [0.0], inputs=0, outputs=1, name="idle")
    diagram = ct.interconnect(
        [*blocks, idle], wires, inplist=[f"b0.u[{k}]" for k in range(size)],
        outlist=[f"b{count - 1}.y[{k}]" for k in range(size)],
        check_unused=False,
    )  # fmt: skip
    A, B, C, D = (block_diag(*(getattr(b, m) for b in blocks)) for m in "ABCD")
    W = np.roll(np.eye(count * size), size, axis=0)  # each block's output feeds the next one
    if np.linalg.cond(np.eye(count * size) - D @ W) > 1e4:
        return
    x, u = rng.normal(size=count * size), np.zeros(count * size)
    u[:size] = rng.normal(size=size)
    y = np.linalg.solve(np.eye(count * size) - D @ W, C @ x + D @ u)
    dx, found = called(solved(diagram), x=x, u=u[:size])
    np.testing.assert_allclose(found, y[-size:], rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(dx, A @ x + B @ (W @ y + u), rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize("native", [False, True])
@pytest.mark.parametrize("u", [0.0, 1.0, 5.0, 30.0])
def test_a_transcendental_loop_is_solved(native, u):
    """y = u - exp(y) is u - W(exp(u)), with Lambert's function W."""
    block = ct.nlsys(
        None, lambda t, x, u, params: [u[0] - np.exp(u[1])], inputs=["u", "v"], outputs=["y"],
        name="f",
    )  # fmt: skip
    diagram = ct.interconnect([block], [["f.v", "f.y"]], inplist=["f.u"], outlist=["f.y"])
    y = called(solved(diagram), u=[u], native=native)[1]
    assert y == pytest.approx(u - lambertw(np.exp(u)).real, rel=1e-14, abs=1e-14)


def test_a_loop_with_a_corner_is_solved():
    """A saturated amplifier fed back with gain -100: y = sat(100 (u - y))."""
    diagram = ring(lambda t, x, u, params: np.clip(100 * (-u), -1.0, 1.0))
    compiled = solved(diagram)
    for u in (-2.0, -0.3, 0.0, 1e-9, 0.9, 1.01, 5.0):
        expected = np.clip(-100 * u / 101, -1, 1)
        assert called(compiled, u=[u])[1] == pytest.approx(expected, rel=1e-13, abs=1e-15)


@pytest.mark.parametrize("native", [False, True])
@pytest.mark.parametrize(
    ("function", "u"),
    [
        (lambda t, x, u, params: u, 1.0),  # y = y + u
        (lambda t, x, u, params: u, 0.0),  # y = y: any number
        (lambda t, x, u, params: u**2 + 1, 0.0),  # no real solution
        (lambda t, x, u, params: np.minimum(u, 1e9) + 1.0, np.nan),
    ],
)
def test_a_loop_without_a_solution_is_nan_everywhere(function, u, native):
    """Also behind a block that turns NaN into a number."""
    deaf = ct.nlsys(
        lambda t, x, u, params: [1.0 if u[0] > 0 else 0.0], None, inputs=["y"], states=["x"],
        name="deaf",
    )  # fmt: skip
    diagram = ring(function)
    wires = [["f.v", "f.y"], ["deaf.y", "f.y"]]
    diagram = ct.interconnect(
        [diagram.syslist[0], deaf], wires, inplist=["f.v"], outlist=["deaf.x"], name="ring"
    )
    dx, y = called(solved(diagram), x=[0.0], u=[u], native=native)
    assert np.isnan([*dx, *y]).all()


def test_a_diagram_with_a_loop_is_simulated():
    """x' = -y with y = x - 0.5 y: x = exp(-t / 1.5); the IR shows the search."""
    plant = ct.ss(0, 1, 1, 0, inputs="v", outputs="w", states="x", name="plant")
    gain = ct.nlsys(
        None, lambda t, x, u, params: u[0] - 0.5 * u[1], inputs=["w", "z"], outputs=["y"],
        name="gain",
    )  # fmt: skip
    wires = [["gain.w", "plant.w"], ["gain.z", "gain.y"], ["plant.v", "-gain.y"]]
    compiled = solved(ct.interconnect([plant, gain], wires, outlist=["plant.w"], name="loop"))
    assert "solved for   gain.y" in repr(compiled)
    assert "define internal void @loop0(" in compiled.source
    t = np.linspace(0, 3, 7)
    response = nlctl.input_output_response(compiled, t, 0, [1.0])
    np.testing.assert_allclose(response.outputs[0], np.exp(-t / 1.5), rtol=1e-7)


@given(st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), min_size=1, max_size=24))
def test_torn_loops_have_no_loop_left(edges):
    """Any graph: components are mutually dependent, and without what is torn they can be sorted."""
    edges = [*edges, (0, 1), (1, 0)]
    items = {i for edge in edges for i in edge}
    before = {i: {j for k, j in edges if k == i} for i in items}
    while known := {i for i in before if not before[i]}:  # what depends on no loop is known
        before = {i: others - known for i, others in before.items() if i not in known}
    loop = first_loop(before)
    inside = {i: before[i] & loop for i in loop}

    def reached(start, blocked=frozenset()):
        seen, todo = set(), {start}
        while todo:
            todo = set().union(*(inside[i] for i in todo)) - seen - blocked
            seen |= todo
        return seen

    assert all(reached(i) == loop for i in loop)
    torn = frozenset(tear(inside))
    assert all(i not in reached(i, torn) for i in loop - torn)
    for i in loop:  # whatever it depends on outside is part of no other loop
        for outside in before[i] - loop:
            assert outside not in before[outside]


def test_ordering_a_false_loop_evaluates_what_is_needed_first():
    """Only the block with two channels is evaluated twice."""
    lead = ct.ss([], [], [], [[4.0]], inputs=1, outputs=1, name="lead")
    wires = [["lead.u[0]", "two.y[0]"], ["two.u[1]", "lead.y[0]"]]
    diagram = ct.interconnect(
        [lead, channels("linear")], wires, inplist=["two.u[0]"], outlist=["two.y[1]"], name="d"
    )
    found = schedule(diagram)
    assert [found.nodes[i].path for i in found.order] == ["two", "lead", "two"]
    assert [sorted(u) for u in found.unknown] == [[1], [], []]
