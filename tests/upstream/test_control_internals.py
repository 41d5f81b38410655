"""What is relied on of python-control although it does not document it: one test for each name."""

import control as ct
import numpy as np
import pytest

from nlctl.upstream import control_internals as internals


def lag(name, **more):
    """x' = -k x + u, y = k x."""
    return ct.nlsys(
        lambda t, x, u, p: [-p["k"] * x[0] + u[0]], lambda t, x, u, p: [p["k"] * x[0]],
        inputs=["u"], outputs=["y"], states=1, name=name, params={"k": 2.0}, **more,
    )  # fmt: skip


def both():
    """Two lags one after the other."""
    parts = [lag("first"), lag("second")]
    diagram = ct.interconnect(
        parts, [["second.u", "first.y"]], inplist=["first.u"], outlist=["second.y"], name="both"
    )
    return diagram, parts


def test_overrides_reach_every_part_and_go_with_the_next():
    """``_update_params`` and ``_current_params``, of a diagram and of its parts."""
    diagram, parts = both()
    for params, k in (({"k": 3.0}, 3.0), (None, 2.0)):
        internals.set_parameters(diagram, params)
        assert [internals.current_parameters(part)["k"] for part in parts] == [k, k]


def test_equations_have_the_parameters_of_now():
    """``_rhs`` and ``_out``: equal to ``dynamics`` and ``output`` with the same parameters."""
    diagram, parts = both()
    x, u = np.array([0.5, -1.0]), np.array([2.0])
    for params in ({"k": 3.0}, None):
        internals.set_parameters(diagram, params)
        rates = [internals.rates_now(p, 0.0, x[:1], u) for p in parts]
        outputs = [internals.outputs_now(p, 0.0, x[:1], u) for p in parts]
        for part, rate, output in zip(parts, rates, outputs, strict=True):
            np.testing.assert_array_equal(rate, part.dynamics(0.0, x[:1], u, params))
            np.testing.assert_array_equal(output, part.output(0.0, x[:1], u, params))


class SameAs(internals.StandIn):
    """Nothing but the system that it stands for."""

    def __init__(self, system):
        self.system = system


def test_a_system_that_stands_for_another_one_is_taken_for_it():
    """Names, sizes, timebase and equations, in a diagram."""
    for dt in (0, 0.1, True):
        first, second = lag("first", dt=dt), lag("second", dt=dt)
        stand_in = SameAs(first)
        assert internals.is_system(first)
        assert not internals.is_system(stand_in)
        for name in (
            "name",
            "dt",
            "ninputs",
            "noutputs",
            "nstates",
            "input_labels",
            "state_labels",
        ):
            assert getattr(stand_in, name) == getattr(first, name)
        loops = [
            ct.interconnect([part, second], connections=[["second.u", "-" + part.name + ".y"]],
                            inplist=["first.u"], outlist=["second.y"])
            for part in (first, stand_in)
        ]  # fmt: skip
        at = (0.3, [0.5, -1.0], [2.0], {"k": 3.0})
        np.testing.assert_array_equal(loops[1].dynamics(*at), loops[0].dynamics(*at))
        np.testing.assert_array_equal(loops[1].output(*at), loops[0].output(*at))


class Doubled(internals.OwnParameters):
    """Its equations get twice what python-control has."""

    def _taken(self, params):
        return {"k": 2.0 * params.get("k", 1.0)}


class Opposite(internals.Around):
    """Another system with its signs changed."""

    def __init__(self, inner):
        self.inner = inner
        super().__init__(inner.updfcn, inner.outfcn, inputs=1, outputs=1, states=1, name=inner.name)

    def rates(self, t, x, u):
        return -internals.rates_now(self.inner, t, x, u)

    def _answer(self, t, x, u):
        return -internals.outputs_now(self.inner, t, x, u)


@pytest.mark.parametrize("params", [None, {"k": 3.0}])
@pytest.mark.parametrize("nested", [False, True])
def test_python_control_asks_what_is_overridden(params, nested):
    """Both classes, alone and inside of a diagram, in each of its calls."""
    made = lag("p")
    doubled = Doubled(made.updfcn, made.outfcn, inputs=1, outputs=1, states=1, name="doubled")
    opposite = Opposite(lag("opposite"))
    k = 1.0 if params is None else params["k"]
    inner = 2.0 if params is None else params["k"]
    for system, rate, output in (
        (doubled, -2 * k * 0.5 + 1.0, 2 * k * 0.5),
        (opposite, inner * 0.5 - 1.0, -inner * 0.5),
    ):
        asked = ct.interconnect([system], inplist=[(0, 0)], outlist=[(0, 0)]) if nested else system
        assert asked.dynamics(0.0, [0.5], [1.0], params) == pytest.approx(rate)
        assert asked.output(0.0, [0.5], [1.0], params) == pytest.approx(output)
        run = ct.input_output_response(asked, [0.0, 1e-6], 1.0, 0.5, params=params)
        assert run.outputs[0] == pytest.approx(output)
        assert (run.states[0, 1] - 0.5) / 1e-6 == pytest.approx(rate, rel=1e-4)


def test_inputs_of_parts_are_those_of_the_connections():
    """``_compute_static_io``, of a nested diagram: each block with its states and inputs."""
    diagram, _ = both()
    outer = ct.interconnect([diagram, lag("third")], [["third.u", "both.y[0]"]],
                            inplist=["both.u[0]"], outlist=["third.y"], name="outer")  # fmt: skip
    x, u = np.array([0.5, -1.0, 4.0]), np.array([2.0])
    internals.set_parameters(outer, None)
    found = list(internals.parts_now(outer, 0.0, x, u))
    assert [part.name for part, _, _ in found] == ["first", "second", "third"]
    np.testing.assert_array_equal([own for _, own, _ in found], x[:, None])
    np.testing.assert_array_equal([given for _, _, given in found], [[2.0], [1.0], [-2.0]])


@pytest.mark.filterwarnings("ignore:.*:RuntimeWarning")
def test_a_quotient_of_inputs_is_no_loop():
    """python-control's first pass has inputs of 0, and 0/0 times a zero is NaN for good."""
    quotient = ct.nlsys(
        None, lambda t, x, u, p: [u[0] / u[1]], inputs=["n", "d"], outputs=["r"], name="quotient"
    )
    rest = ct.nlsys(
        lambda t, x, u, p: [u[0] - x[0], 0.0], lambda t, x, u, p: [x[0], 2.0 + x[1]],
        inputs=["r"], outputs=["n", "d"], states=2, name="rest",
    )  # fmt: skip
    loop = ct.interconnect([quotient, rest], inputs=[], inplist=[], outputs=["r", "n"])
    x, none = np.array([3.0, 1.0]), np.zeros(0)
    internals.set_parameters(loop, None)
    with pytest.raises(RuntimeError, match="algebraic loop"):
        loop._compute_static_io(0.0, x, none)
    np.testing.assert_allclose(internals.rates_now(loop, 0.0, x, none), [-2.0, 0.0])
    np.testing.assert_allclose(internals.outputs_now(loop, 0.0, x, none), [1.0, 3.0])
    rates, outputs = internals.rates_and_outputs_now(loop, 0.0, x, none)
    np.testing.assert_allclose(np.append(rates, outputs), [-2.0, 0.0, 1.0, 3.0])
    given = [u.tolist() for _, _, u in internals.parts_now(loop, 0.0, x, none)]
    assert given == [[3.0, 3.0], [1.0]]


def test_a_true_loop_is_still_one():
    double = ct.nlsys(
        None, lambda t, x, u, p: [2 * u[0] + 1], inputs=["y"], outputs=["y"], name="d"
    )
    loop = ct.interconnect([double], inputs=[], inplist=[], outputs=["y"])
    internals.set_parameters(loop, None)
    with pytest.raises(RuntimeError, match="algebraic loop"):
        internals.outputs_now(loop, 0.0, np.zeros(0), np.zeros(0))


def parts_of_a_diagram(rng, count, feeds):
    """Static gains, lags, and what has both; each with one input and one output."""

    def part(i):
        a, b = rng.normal(size=2)
        return ct.nlsys(
            lambda t, x, u, p: [-x[0] + u[0]],
            lambda t, x, u, p: [a * x[0] + (b * np.sin(u[0]) if feeds[i] else 0.0) + t],
            inputs=["u"], outputs=["y"], states=1, name=f"p{i}",
        )  # fmt: skip

    return [part(i) for i in range(count)]


def connected(rng, count, density, inner=()):
    """A diagram with random maps, whose parts may be diagrams."""
    parts = [*parts_of_a_diagram(rng, count, rng.random(count) < 0.6), *inner]
    diagram = ct.InterconnectedSystem(
        parts, inputs=1, outputs=2, connections=None, inplist=[(0, 0)], outlist=[(0, 0), (1, 0)],
        name=f"d{rng.integers(1 << 30)}",
    )  # fmt: skip
    size = diagram.connect_map.shape
    diagram.connect_map = np.where(rng.random(size) < density, rng.normal(size=size), 0.0)
    return diagram


def signals_or_none(function, *arguments):
    """What is computed, or None where python-control calls it a loop."""
    try:
        return function(*arguments)
    except RuntimeError:
        return None


@pytest.mark.parametrize("seed", range(40))
def test_signals_are_python_controls_bit_for_bit(seed):
    """``_compute_static_io``: no part is asked twice for the same, loops are loops, NaN is NaN."""
    rng = np.random.default_rng(seed)
    inner = [connected(rng, 2, 0.3)] if seed % 2 else []
    diagram = connected(rng, 4, 0.1 + 0.2 * rng.random(), inner)
    x, u = rng.normal(size=diagram.nstates), rng.normal(size=1)
    if seed % 8 == 7:
        x[0] = np.nan
    internals.set_parameters(diagram, None)
    with np.errstate(all="ignore"):
        wanted = signals_or_none(diagram._compute_static_io, 0.3, x, u)
        found = internals._settled_signals(diagram, 0.3, x, u)
    assert (found is None) == (wanted is None)
    if wanted is not None:
        for one, other in zip(found, wanted, strict=True):
            np.testing.assert_array_equal(one, other)


def test_no_part_is_asked_twice_for_the_same():
    """A chain of five from its end to its start: 15 calls in place of 30."""
    calls = []

    def part(i):
        return ct.nlsys(
            None, lambda t, x, u, p: calls.append(i) or [u[0] + 1.0], inputs=["u"], outputs=["y"],
            name=f"p{i}",
        )  # fmt: skip

    parts = [part(i) for i in range(5)]
    chain = ct.interconnect(
        parts, [[f"p{i}.u", f"p{i + 1}.y"] for i in range(4)], inplist=["p4.u"], outlist=["p0.y"]
    )
    internals.set_parameters(chain, None)
    calls.clear()
    assert internals.outputs_now(chain, 0.0, np.zeros(0), np.array([2.0])) == [7.0]
    assert len(calls) == 15
