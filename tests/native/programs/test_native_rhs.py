"""A program against python-control: the same right-hand side from any diagram."""

import control as ct
import numpy as np
import pytest
import scipy.special
from examples import many
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba.core import config
from plain_plan import compare, evaluated, interpreted

import nlctl
from nlctl.diagrams.addresses import may_read
from nlctl.diagrams.places import leaves
from nlctl.errors import AlgebraicLoopError
from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.diagram.schedule import schedule


def lag(name, k):
    """A third-party first-order block without feedthrough."""
    return ct.nlsys(
        lambda t, x, u, params: [-params["k"] * x[0] + np.sin(u[0]) + 0.1 * t],
        lambda t, x, u, params: x,
        inputs=["u"], outputs=["y"], states=["x"], name=name, params={"k": k},
    )  # fmt: skip


def curve(name, k):
    """A third-party static block, which reads a parameter that it does not declare."""
    return ct.nlsys(
        None,
        lambda t, x, u, params: np.array([np.tanh(u[0]) * params.get("gain", k)]),
        inputs=["u"], outputs=["y"], name=name,
    )  # fmt: skip


def linear(name, k):
    """A state-space block with feedthrough."""
    return ct.ss([[-k, 1.0], [0.0, -2.0]], [[0.0], [1.0]], [[1.0, k]], [[0.3]],
                 inputs=["u"], outputs=["y"], name=name)  # fmt: skip


@nlctl.record
class Squash:
    """An nlctl block."""

    amplitude: float = nlctl.param(1.0, unit="1", meaning="amplitude")
    inputs = ("u",)
    outputs = ("y",)
    states = ()
    feedthrough = True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.amplitude * np.sin(u[0]),)


def wrapped(name, k):
    """A nested diagram that also passes its input through, with gains."""
    inner = [lag(f"{name}_lag", k), nlctl.block(Squash(amplitude=k), f"{name}_squash")]
    return ct.interconnect(
        inner,
        connections=[[f"{name}_squash.u", (f"{name}_lag", "y", -0.7)]],
        inplist=[[f"{name}_lag.u"]],
        outlist=[[f"{name}_squash.y", (f"{name}_lag", "u", 0.5)]],
        inputs=["u"], outputs=["y"], name=name,
    )  # fmt: skip


KINDS = {
    "lag": (lag, False),
    "curve": (curve, True),
    "linear": (linear, True),
    "squash": (lambda name, k: nlctl.block(Squash(amplitude=k), name), True),
    "wrapped": (wrapped, True),
}


@st.composite
def diagrams(draw):
    """A random diagram without algebraic loops: feedthrough reads earlier blocks, or lags."""
    count = draw(st.integers(2, 7))
    kinds = [draw(st.sampled_from(sorted(KINDS))) for _ in range(count)]
    gains = st.sampled_from([1.0, -1.0, 0.5, -2.25])
    systems = [KINDS[kind][0](f"b{i}", draw(st.floats(0.2, 3))) for i, kind in enumerate(kinds)]
    connections = []
    for i, kind in enumerate(kinds):
        direct = KINDS[kind][1]
        allowed = [j for j in range(count) if not direct or j < i or not KINDS[kinds[j]][1]]
        sources = (
            draw(st.lists(st.sampled_from(allowed), max_size=3, unique=True)) if allowed else []
        )
        if sources:
            connections.append([f"b{i}.u", *((f"b{j}", "y", draw(gains)) for j in sources)])
    outside = draw(st.lists(st.integers(0, count - 1), max_size=2, unique=True))
    order = draw(st.permutations(range(count)))
    return ct.interconnect(
        [systems[i] for i in order],
        connections=connections or False,
        inplist=[f"b{i}.u" for i in outside],
        outlist=[f"b{i}.y" for i in range(count)] + ["b0.u"],
        name="random",
        check_unused=False,
    )


@pytest.mark.slow
@settings(max_examples=many(500, part=10))
@given(diagrams(), st.integers(0, 1000))
def test_random_diagrams_agree_with_python_control(diagram, seed):
    """Random blocks, wiring, gains, nesting, linear parts: the emitted source agrees."""
    compare(diagram, points=1, seed=seed)


def has_a_function(diagram):
    """Whether a part is a third-party function, which may read what no block declares."""
    return any(type(leaf.system) is ct.NonlinearIOSystem for leaf in leaves(diagram))


@settings(max_examples=many(60))
@given(diagrams().filter(has_a_function), st.floats(-3, 3), st.floats(0.1, 5))
def test_flat_parameters_of_third_party_blocks_resolve_as_in_python_control(diagram, gain, k):
    """'k' and the undeclared 'gain' reach the same blocks, nested ones too."""
    parts = [place.system for place in nlctl.diagrams.leaves(diagram)]
    functions = [part for part in parts if type(part) is ct.NonlinearIOSystem]
    assume(functions)  # others read none of them
    params = {"gain": gain, "k": k}  # what nobody reads is refused
    params = {name: v for name, v in params.items() if any(may_read(p, name) for p in functions)}
    compare(diagram, params=params, points=1)


@pytest.mark.ci
@pytest.mark.parametrize("make", [nlctl.paper.example_1, nlctl.paper.example_2])
def test_examples_in_machine_code(make):
    """Compiled right-hand sides of the paper's loops equal the interpreted ones."""
    loop = make()
    compare(loop, points=2)
    compare(loop, native=True, params={"law.beta": 3.5, "plant.d_amplitude": 0.3}, points=3)


def test_third_party_blocks_in_machine_code():
    """Arrays, lists, tuples and dict parameters of third-party functions compile as they stand."""
    parts = [lag("b0", 1.3), curve("b1", 0.7), linear("b2", 0.4)]
    parts.append(
        ct.nlsys(
            None,
            lambda t, x, u, params: (u[0] + params["a"], 2.0 * u[0]),
            inputs=["u"],
            outputs=["y", "z"],
            name="b3",
            params={"a": 3},
        )
    )
    wires = [["b1.u", "b0.y"], ["b2.u", ("b1", "y", -2.0)], ["b3.u", "b2.y"], ["b0.u", "b3.z"]]
    loop = ct.interconnect(parts, wires, inplist=["b1.u"], outlist=["b3.y", "b2.y"], name="loop")
    compare(loop, points=2)
    compare(loop, native=True, params={"gain": 1.7, "k": 0.2, "a": 1.0}, points=2)


def predator_prey():
    """Lotka and Volterra with a refuge for the prey, states taken apart."""

    def update(t, x, u, params):
        r, k, a, b = params.get("r", 1.6), params.get("k", 125.0), params["a"], params.get("b", 0.6)
        prey, predators = x
        caught = a * prey * predators / (50.0 + prey)
        du = u[0] if "forced" in params else 0.0
        return np.array([(r + du) * prey * (1 - prey / k) - caught, b * caught - 0.56 * predators])

    return ct.nlsys(update, None, inputs="du", outputs=2, states=2, name="hares", params={"a": 3.2})


def planar_vtol():
    """A planar aircraft: inputs and states taken apart, a list of derivatives."""

    def update(t, x, u, params):
        m, inertia, arm = params["m"], params["J"], params["r"]
        _, _, theta, vx, vy, omega = x
        f1, f2 = u
        ax = (f1 * np.cos(theta) - f2 * np.sin(theta) - params["c"] * vx) / m
        ay = (f1 * np.sin(theta) + f2 * np.cos(theta) - m * params["g"] - params["c"] * vy) / m
        return [vx, vy, omega, ax, ay, arm * f1 / inertia]

    physics = {"m": 4, "J": 0.0475, "r": 0.25, "g": 9.8, "c": 0.05}
    return ct.nlsys(
        update, lambda t, x, u, params: x[0:3], inputs=2, outputs=3, states=6, name="vtol",
        params=physics,
    )  # fmt: skip


def cruise_control():
    """A car with a PI controller: a nested function, a condition, a scalar result."""

    def torque(omega, params):
        return params["T"] * (1 - 0.4 * (omega / 420.0 - 1) ** 2)

    def car(t, x, u, params):
        v, throttle = x[0], min(max(u[0], 0.0), 1.0)
        ratio = params["ratio"]
        drag = 0.65 * v * abs(v) + 1600 * 9.8 * (np.sin(u[1]) + 0.01 * np.sign(v))
        return (ratio * torque(ratio * v, params) * throttle - drag) / 1600.0

    vehicle = ct.nlsys(
        car, lambda t, x, u, params: x[0], inputs=["throttle", "slope"], outputs=["v"],
        states=["v"], name="car", params={"T": 190.0, "ratio": 12},
    )  # fmt: skip
    control = ct.tf([0.5, 0.1], [1, 0], name="control", inputs="e", outputs="throttle")
    error = ct.summing_junction(inputs=["vref", "-v"], output="e", name="sum")
    return ct.interconnect(
        [vehicle, control, error],
        inputs=["vref", "slope"],
        outputs=["v", "throttle"],
        name="cruise",
    )


@pytest.mark.parametrize("make", [predator_prey, planar_vtol, cruise_control])
def test_textbook_systems_in_machine_code(make):
    """Diagrams as the textbooks of python-control write them compile unmodified."""
    compare(make())
    compare(make(), native=True)


def test_params_get_and_in_follow_the_dict_in_machine_code():
    """An announced parameter is found by get and by in, one that is absent is not."""
    compare(predator_prey(), native=True, params={"r": 2.0, "forced": 1})


def test_what_numba_cannot_compile_is_called_back():
    """A function of SciPy: the compiled diagram says that it is called in Python."""

    def output(t, x, u, params):
        return [scipy.special.erfcx(u[0])]

    block = ct.nlsys(None, output, inputs=1, outputs=1, name="words")
    compiled = compile_diagram(block)
    assert "output of block 'words': " in repr(compiled)
    assert compiled.output(0.0, [], [1.0]) == scipy.special.erfcx(1.0)
    if not getattr(config, "DISABLE_JIT", False):
        assert (
            "output of block 'words', called back in Python, no faster than python-control"
            in repr(compiled)
        )
        assert "; output of block 'words', called back in Python, no" in compiled.source
    compare(block)
    compare(block, native=True)


def test_a_single_block_and_linear_systems():
    """No diagram at all: an nlctl block, a state-space system, a transfer function."""
    compare(nlctl.block(nlctl.plants.Genesio(), "plant"))
    compare(ct.rss(4, 2, 3))
    compare(ct.interconnect([ct.tf([1, 2], [1, 3, 2], name="G", inputs="u", outputs="y")],
                            inputs="u", outputs="y"))  # fmt: skip


def test_an_algebraic_loop_prints_its_ring():
    """The message names every signal of the ring, in order."""
    names = ["first", "second", "third"]
    blocks = [nlctl.block(Squash(), name) for name in names]
    wires = [["second.u", "first.y"], ["third.u", "second.y"], ["first.u", "third.y"]]
    ring = ct.interconnect(blocks, wires, outlist=["first.y"], name="ring")
    with pytest.raises(AlgebraicLoopError) as caught:
        schedule(ring)
    said = str(caught.value)
    assert "has no state in it" in said
    ring_text = said.removeprefix("algebraic loop: ").partition(" has no state in it")[0]
    around = ring_text.split(" -> ")
    assert around[0] == around[-1]
    turns = [around[:-1][i:] + around[:-1][:i] for i in range(3)]
    assert ["first.y", "second.y", "third.y"] in turns


def test_a_function_that_ignores_its_inputs_closes_no_loop():
    """Feedthrough of a third-party function is found: one that mentions u but does not use it."""
    state = ct.nlsys(
        lambda t, x, u, params: u,
        lambda t, x, u, params: x + 0 * len(u),
        inputs=["u"], outputs=["y"], states=["x"], name="state",
    )  # fmt: skip
    squash = nlctl.block(Squash(), "squash")
    wires = [["squash.u", "state.y"], ["state.u", "squash.y"]]
    loop = ct.interconnect([squash, state], wires, outlist=["state.y"], name="loop")
    assert [schedule(loop).nodes[i].path for i in schedule(loop).order] == ["state", "squash"]
    compare(loop)


def test_nan_reaches_every_output_that_depends_on_it():
    """NaN in a state is NaN in the derivatives and outputs that python-control has NaN in."""
    loop = nlctl.paper.example_1()
    compiled = compile_diagram(loop)
    (rhs, out), p = interpreted(compiled), compiled.parameter_vector()
    x = nlctl.initial_state(loop)
    x[0] = np.nan
    assert np.isnan(evaluated(out, 11, 0.0, x, np.zeros(0), p)[:6:2]).all()
    g, m = (np.empty(compiled.lowered.rows[name]) for name in "gm")
    assert np.isnan(evaluated(rhs, 31, 0.0, x, np.zeros(0), p, g, m)[1])


def test_a_parameter_that_changes_shape_is_refused():
    """The layout is fixed when the diagram is compiled."""
    loop = nlctl.paper.example_1()
    with pytest.raises(ValueError, match=r"'controller.basis.widths' had shape \(1,\)"):
        compile_diagram(loop).parameter_vector({"basis.widths": (2.0,) * 27})


def test_an_undeclared_parameter_must_be_announced():
    """A name that only params.get knows has no place in the compiled program."""
    with pytest.raises(ValueError, match=r"'gain' of block 'b' was not known when .* compile with"):
        compile_diagram(curve("b", 2.0)).parameter_vector({"gain": 3.0})
    compare(curve("b", 2.0), params={"gain": 3.0})
