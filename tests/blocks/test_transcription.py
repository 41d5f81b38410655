"""Both diagrams against a second transcription of the paper that shares no code with nlctl."""

import numpy as np
import pytest
import transcription as paper
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl

ACTUATORS = {"dead_zone": nlctl.DeadZone(), "backlash": nlctl.Backlash()}
# where each parameter of the transcription lives in the diagram, and where it may lie
CONTROLLER = {
    "beta": ("law.beta", 0.5, 8),
    "sigma_1": ("weights.sigma_1", 0, 1),
    "sigma_2": ("robust.sigma_2", 0, 1),
    "Gamma": ("weights.Gamma", 0.1, 2),
    "gamma": ("robust.gamma", 0.1, 3),
    "tau": ("robust.tau", 0.05, 1),
}
PLANT = {
    1: ("p1", "p_mean", "p_ripple", "q_mean", "q_ripple", "w_mean", "w_ripple")
    + ("gain_x", "gain_v", "d_amplitude"),
    2: ("a", "b", "c", "gain_mean", "gain_x", "gain_v", "d_amplitude", "d_frequency"),
}
PUBLISHED = {1: paper.EXAMPLE_1, 2: paper.EXAMPLE_2}
RHS = {1: paper.example_1_rhs, 2: paper.example_2_rhs}


def make_diagram(example, actuator, **choices):
    make = {1: nlctl.paper.example_1, 2: nlctl.paper.example_2}[example]
    return make(actuator=ACTUATORS[actuator], **choices)


@st.composite
def states(draw, order, nodes):
    """A state of the loop, far beyond what the examples visit."""
    number = st.floats(-2, 2)
    seed = draw(st.integers(0, 2**32 - 1))
    return {
        "x": np.array([draw(number) for _ in range(order)]),
        "W_hat": np.random.default_rng(seed).uniform(-1, 1, nodes),
        "delta_hat": draw(st.floats(-1, 3)),
        "zeta": draw(st.floats(-2, 2)),
        "memory": draw(number),
    }


def state_vector(diagram, state):
    """The vector of the diagram for a state of the transcription."""
    values = {f"plant.x{i + 1}": x for i, x in enumerate(state["x"])}
    values |= {f"weights.W_hat[{i}]": w for i, w in enumerate(state["W_hat"])}
    values |= {"robust.delta_hat": state["delta_hat"], "law.zeta": state["zeta"]}
    if "actuator.memory" in nlctl.state_names(diagram):
        values["actuator.memory"] = state["memory"]
    return nlctl.initial_state(diagram, values)


@st.composite
def parameters(draw, example):
    """Random parameters: for the transcription, and by qualified name for the diagram."""
    transcribed, qualified = dict(PUBLISHED[example]), {}
    for key, (name, low, high) in CONTROLLER.items():
        qualified[name] = transcribed[key] = draw(st.floats(low, high))
    for key in PLANT[example]:
        scale = draw(st.floats(0.5, 1.5))
        qualified[f"plant.{key}"] = transcribed[key] = scale * PUBLISHED[example][key]
    lambdas = tuple(draw(st.floats(0.2, 3)) for _ in range(example))
    qualified["filtered_error.lambdas"] = transcribed["lambdas"] = lambdas
    return transcribed, qualified


def check_rhs(example, actuator, diagram, centres, t, state, parameters, **options):
    transcribed, qualified = parameters
    expected, signals = RHS[example](t, state, centres, transcribed, actuator=actuator, **options)
    x = state_vector(diagram, state)
    found = diagram.dynamics(t, x, [], qualified)
    outputs = diagram.output(t, x, [], qualified)
    flat = {f"plant.x{i + 1}": d for i, d in enumerate(expected["x"])}
    flat |= {f"controller.weights.W_hat[{i}]": d for i, d in enumerate(expected["W_hat"])}
    flat |= {
        "controller.robust.delta_hat": expected["delta_hat"],
        "controller.law.zeta": expected["zeta"],
    }
    if actuator == "backlash":
        flat["actuator.memory"] = expected["memory"]
    wanted = np.array([flat[name] for name in nlctl.state_names(diagram)])
    # h contains v cos v: a rounding of v by one unit moves it by |v| units, and v likewise by |u|
    size = max(1.0, abs(signals["u"])) * max(1.0, abs(signals["v"]))
    scale = np.where(np.char.endswith(nlctl.state_names(diagram), "memory"), 1e3, 1.0)
    np.testing.assert_allclose(found / scale, wanted / scale, rtol=1e-12, atol=1e-12 * size)
    for name, i in diagram.output_index.items():
        if name in signals:
            np.testing.assert_allclose(outputs[i], signals[name], rtol=1e-12, atol=1e-12 * size)


@pytest.mark.slow
@pytest.mark.parametrize("actuator", ["dead_zone", "backlash"])
@pytest.mark.parametrize("example", [1, 2])
def test_right_hand_side_agrees_with_the_independent_transcription(example, actuator):
    """Derivatives and signals agree to 1e-12 at random times, states and parameters."""
    diagram = make_diagram(example, actuator)
    order = example + 1
    centres = paper.diagonal_centres(27, 2) if example == 1 else paper.grid_centres((3, 3, 3))

    @settings(max_examples=many(150), deadline=None, derandomize=True)
    @given(st.floats(0, 200), states(order, 27), parameters(example))
    def check(t, state, both):
        check_rhs(example, actuator, diagram, centres, t, state, both)

    check()


@pytest.mark.parametrize("layout", ["3x9", "9x3"])
def test_grid_layouts_are_the_transcriptions_grids(layout):
    """'AxB' puts A centres along x1 and B along x2."""
    centres = paper.grid_centres([int(c) for c in layout.split("x")])
    diagram = make_diagram(1, "dead_zone", centres=layout)

    @settings(max_examples=many(20, part=4), deadline=None, derandomize=True)
    @given(states(2, 27), parameters(1))
    def check(state, both):
        check_rhs(1, "dead_zone", diagram, centres, 1.5, state, both)

    check()


def test_integral_phase_is_the_transcriptions():
    """phase='integral' reads cos(w t) as the cosine of the integral of w."""
    diagram = make_diagram(1, "dead_zone", phase="integral")
    centres = paper.diagonal_centres(27, 2)

    @settings(max_examples=many(30, part=4), deadline=None, derandomize=True)
    @given(st.floats(0, 200), states(2, 27), parameters(1))
    def check(t, state, both):
        check_rhs(1, "dead_zone", diagram, centres, t, state, both, phase="integral")

    check()


def test_published_parameters_are_the_transcriptions():
    """The defaults of the blocks are the published values, parameter by parameter."""
    for example, published in PUBLISHED.items():
        table = nlctl.parameters(make_diagram(example, "dead_zone"))["value"]
        for key, (name, _, _) in CONTROLLER.items():
            assert table[f"controller.{name}"] == published[key]
        for key in PLANT[example]:
            assert table[f"plant.{key}"] == published[key]
        assert table["controller.filtered_error.lambdas"] == tuple(published["lambdas"])
        widths = np.broadcast_to(table["controller.basis.widths"], 27)
        np.testing.assert_array_equal(widths, published["widths"])
