"""Diagrams as python-control's users write them, from the equations, compiled unmodified."""

import math

import control as ct
import numpy as np
import pytest
from numpy.testing import assert_allclose
from plain_plan import compare

import nlctl
from nlctl.errors import ParameterError, UsageError
from nlctl.native.compiled import compile as compile_diagram

TOLERANCES = {"rtol": 1e-9, "atol": 1e-11}


def gear(number):
    """Ratio of a gear, taken from a table."""
    return [40, 25, 16, 12, 10][number - 1]


def engine_torque(omega, params={}):  # noqa: B006 (as users write it)
    """A parabola in the angular speed, never negative."""
    peak, at, beta = params.get("Tm", 190.0), params.get("omega_m", 420.0), params.get("beta", 0.4)
    return np.clip(peak * (1 - beta * (omega / at - 1) ** 2), 0, None)


def car_update(t, x, u, params={}):  # noqa: B006
    """Longitudinal motion of a car with throttle, gear and slope as inputs."""
    from math import copysign, sin

    m, g = params.get("m", 1600.0), params.get("g", 9.8)
    v, throttle, slope = x[0], np.clip(u[0], 0, 1), u[2]
    ratio = gear(int(u[1]))
    drive = ratio * engine_torque(ratio * v, params) * throttle
    rolling = m * g * params.get("Cr", 0.01) * copysign(1, v)
    drag = 0.5 * params.get("rho", 1.3) * params.get("Cd", 0.32) * params.get("A", 2.4)
    return (drive - m * g * sin(slope) - rolling - drag * abs(v) * v) / m


def pi_update(t, x, u, params={}):  # noqa: B006
    """A PI controller whose integrator is corrected when the throttle saturates."""
    ki, kaw = params.get("ki", 0.1), params.get("kaw", 2)
    wanted = pi_output(t, x, u, params)
    saturated = np.clip(wanted, 0, 1)
    return (u[0] - u[1]) + kaw * (saturated - wanted) if ki > 0 else 0.0


def pi_output(t, x, u, params={}):  # noqa: B006
    return params.get("kp", 0.5) * (u[0] - u[1]) + params.get("ki", 0.1) * x[0]


def cruise():
    car = ct.nlsys(
        car_update, lambda t, x, u, params: x[0], name="car", states=["v"],
        inputs=("throttle", "gear", "slope"), outputs=("v",),
    )  # fmt: skip
    pi = ct.nlsys(
        pi_update, pi_output, name="pi", states=["z"], inputs=["v", "vref"], outputs=["throttle"],
        params={"kp": 0.5, "ki": 0.1},
    )  # fmt: skip
    return ct.interconnect(
        [car, pi], name="cruise",
        connections=[["car.throttle", "pi.throttle"], ["pi.v", "car.v"]],
        inplist=["pi.vref", "car.gear", "car.slope"], inputs=["vref", "gear", "slope"],
        outlist=["car.v", "pi.throttle"], outputs=["v", "throttle"],
    )  # fmt: skip


def bicycle_update(t, x, u, params):
    """Kinematic bicycle; the slip angle counts from the centre of mass."""
    rear, wheelbase = params.get("refoffset", 1.5), params.get("wheelbase", 3)
    limit = params.get("maxsteer", 0.5)
    steering = np.clip(u[1], -limit, limit)
    alpha = np.arctan2(rear * np.tan(steering), wheelbase)
    return [
        u[0] * np.cos(x[2] + alpha),
        u[0] * np.sin(x[2] + alpha),
        (u[0] / wheelbase) * np.tan(steering),
    ]


def steering():
    """State feedback from python-control's own constructor around the bicycle."""
    car = ct.nlsys(
        bicycle_update, None, name="vehicle", states=["x", "y", "theta"], inputs=["v", "delta"],
        outputs=["x", "y", "theta"], params={"wheelbase": 3, "maxsteer": 0.5},
    )  # fmt: skip
    gain = np.array([[0.3, 0.1, 0.0], [0.02, 0.05, 0.4]])
    _, closed = ct.create_statefbk_iosystem(car, gain)
    return closed


def predator_prey():
    """Hares and lynxes; the first input is the hares' growth rate."""

    def update(t, x, u, params):
        r = params.get("r", 1.6)
        a, b, c = params.get("a", 3.2), params.get("b", 0.6), params.get("c", 50)
        d, k = params.get("d", 0.56), params.get("k", 125)
        H, L = x
        if np.less(L, 0):
            L = 0.0
        dH = (r + u[0]) * H * (1 - H / k) - (a * H * L) / (c + H)
        dL = b * (a * H * L) / (c + H) - d * L
        return np.array([dH, dL])

    return ct.nlsys(update, None, inputs=("u",), outputs=("H", "L"), states=("H", "L"), name="pp")


def vtol():
    """Planar vertical take-off, with a linear inner and outer loop of transfer functions."""

    def flying(t, x, u, params):
        m = params.get("m", 4.0)
        inertia = params.get("J", 0.0475)
        arm, g, c = params.get("r", 0.25), params.get("g", 9.8), params.get("c", 0.05)
        _, _, theta, xd, yd, thetad = x
        F1, F2 = u
        return np.array([
            xd,
            yd,
            thetad,
            (F1 * math.cos(theta) - F2 * math.sin(theta) - c * xd) / m,
            (F1 * math.sin(theta) + F2 * math.cos(theta) - m * g - c * yd) / m,
            (arm * F1) / inertia,
        ])  # fmt: skip

    plant = ct.nlsys(
        flying, lambda t, x, u, params: x, name="pvtol", inputs=["F1", "F2"],
        states=[f"x{i}" for i in range(6)], outputs=[f"x{i}" for i in range(6)],
    )  # fmt: skip
    tilt = ct.tf([20.0, 40.0], [1.0, 30.0], inputs="et", outputs="F1", name="tilt")
    lateral = ct.tf([-0.2, -0.05], [0.1, 1.0], inputs="ex", outputs="tref", name="lateral")
    lift = ct.nlsys(
        None, lambda t, x, u, params: 4.0 * 9.8 + params["kp"] * (u[0] - u[1]) - u[2],
        inputs=["yref", "x1", "x4"], outputs=["F2"], params={"kp": 2}, name="lift",
    )  # fmt: skip
    sums = [
        ct.summing_junction(["xref", "-x0"], "ex", name="position"),
        ct.summing_junction(["tref", "-x2"], "et", name="angle"),
    ]
    return ct.interconnect(
        [plant, tilt, lateral, lift, *sums], inputs=["xref", "yref"], outputs=["x0", "x1", "F2"],
        name="flight", check_unused=False,
    )  # fmt: skip


def mrac(rule):
    """Model reference adaptive control of a first-order plant, by the MIT rule or Lyapunov's."""
    am, bm, a, b = -4.0, 4.0, 1.5, 2.0

    def update(t, x, u, params):
        gam, gains = params["gam"], x[2:4]
        xm, r, y = u[0], u[1], u[2]
        error = y - xm
        signb = params["signb"]
        if rule == "lyapunov":
            return [0.0, 0.0, -gam * r * error * signb, -gam * y * error * signb]
        x1, x2 = x[0], x[1]
        d1, d2 = am * x1 - am * r, am * x2 - am * y
        return [d1, d2, -gam * x1 * error * signb, -gam * x2 * error * signb + 0 * gains[0]]

    def output(t, x, u, params):
        return x[2] * u[1] + x[3] * u[2], x[2], x[3]

    plant = ct.ss([[a]], [[b]], [[1]], [[0]], inputs="u", outputs="y", states="xp", name="plant")
    model = ct.ss(am, bm, 1, 0, inputs="r", outputs="ym", name="model")
    control = ct.nlsys(
        update, output, name="control", params={"gam": 1, "signb": np.sign(b)},
        inputs=["ym", "r", "y"], outputs=["u", "kr", "kx"], states=4,
    )  # fmt: skip
    return ct.interconnect(
        [plant, model, control], inputs="r", outputs=["y", "ym", "u", "kr", "kx"],
        name=f"mrac_{rule}",
    )  # fmt: skip


def cruise_inputs(t):
    slope = np.where(t < 5, 0.0, np.where(t < 6, 4 * (t - 5), 4.0)) * np.pi / 180
    return [20 + 0 * t, 4 + 0 * t, slope]


EXAMPLES = {
    "steering": steering,
    "predator-prey": predator_prey,
    "planar vtol": vtol,
    "mrac mit": lambda: mrac("mit"),
    "mrac lyapunov": lambda: mrac("lyapunov"),
}
RUNS = {
    "cruise": (cruise, 20.0, cruise_inputs, [20.0, 2.0]),
    "steering": (steering, 5.0, lambda t: [2 * t, 0.1 * t, 0 * t, 2 + 0 * t, 0 * t], 0.0),
    "predator-prey": (predator_prey, 30.0, lambda t: [0 * t], [20.0, 30.0]),
    "planar vtol": (vtol, 1.0, lambda t: [0.1 + 0 * t, 0 * t], 0.0),
    "mrac mit": (lambda: mrac("mit"), 10.0, lambda t: [np.sin(0.6 * t)], 0.0),
    "mrac lyapunov": (lambda: mrac("lyapunov"), 10.0, lambda t: [np.sin(0.6 * t)], 0.0),
}


@pytest.mark.parametrize("native", [False, True])
@pytest.mark.parametrize("name", EXAMPLES)
def test_the_examples_of_the_textbook_agree_at_random_points(name, native):
    """Right-hand side and outputs, to the last bits."""
    compare(EXAMPLES[name](), native=native)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_responses_agree_with_python_control(name):
    """The same response, both at tight tolerances."""
    make, until, inputs, x0 = RUNS[name]
    system, t = make(), np.linspace(0, until, 41)
    u = inputs(t)
    found = nlctl.input_output_response(nlctl.compile(system), t, u, x0, **TOLERANCES)
    expected = nlctl.input_output_response(system, t, u, x0, engine="python-control", **TOLERANCES)
    np.testing.assert_allclose(found.states, expected.states, rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(found.y, expected.y.reshape(found.y.shape), rtol=1e-5, atol=1e-6)


# Parameters that are no numbers, names that are no identifiers, systems without this or that.


def tuned(name, **params):
    """A static block with parameters of every kind."""

    def output(t, x, u, params):
        y = params["gain"] * u[0]
        if params["mode"] == "double":
            y = 2 * y
        if params["offset"] is not None:
            y = y + 1.0
        return [params["shape"](y) + params["table"][1][0]]

    values = {"gain": 2, "mode": "double", "offset": None, "shape": np.tanh,
              "table": [[1, 2], [3, 4]]}  # fmt: skip
    return ct.nlsys(None, output, inputs=["u"], outputs=["y"], name=name, params=values | params)


def bend(y):
    """A function that is handed over as a parameter."""
    return y - y**3 / 3


@pytest.mark.parametrize("native", [False, True])
@pytest.mark.parametrize(
    "params", [{}, {"shape": bend}, {"mode": "plain", "table": ((0, 1), (5, 6))}]
)
def test_parameters_that_are_no_numbers_are_constants(params, native):
    """Text, None, functions, nested lists and tuples."""
    compare(tuned("tuned", **params), native=native)


@pytest.mark.parametrize(
    ("override", "words"),
    [
        (
            {"mode": "plain"},
            r"'tuned\.mode' is not a number and was 'double' .* 'plain' now: compile",
        ),
        ({"offset": 1.0}, r"'tuned\.offset' is not a number and was None .* cannot be 1\.0 now"),
        ({"shape": bend}, r"'tuned\.shape' is not a number .* compile again"),
        ({"gain": "high"}, r"block 'tuned' needs a number for gain, as it declares, got 'high'"),
        ({"gain": 2.5}, r"'tuned\.gain' was an integer .* cannot be 2\.5 .* as a float, with"),
        ({"table": [[1, 2]]}, r"'tuned\.table' had shape \(2, 2\) .* have shape \(1, 2\)"),
    ],
)
def test_what_is_compiled_in_cannot_change_per_run(override, words):
    """The error says what it was, what it should be, and to compile again."""
    compiled = compile_diagram(tuned("tuned"))
    with pytest.raises(UsageError, match=words):
        compiled.parameter_vector(override)
    compiled.parameter_vector({"gain": 3.0, "mode": "double"})
    compiled.parameter_vector({"gain": True})


def test_a_rate_that_is_written_as_2_may_be_two_and_a_half():
    """x' = -a x with a = 2: of runs of what was compiled, and of members; not with passes."""
    t = np.linspace(0.0, 1.0, 11)
    decay = ct.nlsys(lambda t, x, u, p: [-p["a"] * x[0]], None, inputs=0, states=["x"],
                     outputs=["x"], params={"a": 2}, name="decay")  # fmt: skip
    compiled = compile_diagram(decay)
    for a in (2, 2.5, 3):
        run = nlctl.input_output_response(compiled, t, 0, [1.0], params={"decay.a": a})
        assert_allclose(run.outputs[0], np.exp(-a * t), atol=1e-8)
    rates = np.array([1.0, 2.0, 2.5])
    for diagram, name in ((decay, "decay.a"), (compiled, "a")):
        many = nlctl.ensemble_response(diagram, t, 0, [1.0], params={name: rates}, keep=["x"])
        assert_allclose(many.signals["x"], np.exp(-rates[:, None] * t), atol=1e-8)
    passes = ct.nlsys(lambda t, x, u, p: [-sum(x[0] for _ in range(p["a"]))], None, inputs=0,
                      states=["x"], outputs=["x"], params={"a": 2}, name="passes")  # fmt: skip
    with pytest.raises(ParameterError, match=r"'passes\.a' .* cannot lie between two integers"):
        nlctl.ensemble_response(passes, t, 0, [1.0], params={"passes.a": rates})


@pytest.mark.parametrize("native", [False, True])
def test_equal_names_and_names_that_are_no_identifiers(native):
    """Blocks of nested diagrams may share a name; names may begin with digits or hold brackets."""
    inner = [
        ct.interconnect(
            [tuned("1st [gain]", gain=k)], inplist=["1st [gain].u"], outlist=["1st [gain].y"],
            inputs=["u"], outputs=["y"], name=name,
        )
        for name, k in (("a_b", 0.5), ("a b", -0.3), ("a-b", 1.5))
    ]  # fmt: skip
    chain = ct.interconnect(
        inner, [[(1, 0), (0, 0)], [(2, 0), (1, 0)]], inplist=[(0, 0)], outlist=[(2, 0)],
        name="chain",
    )  # fmt: skip
    compare(chain, native=native)


@pytest.mark.parametrize("native", [False, True])
def test_systems_without_inputs_states_or_outputs(native):
    """A clock, a sink, a static gain, a diagram without outputs, a linear diagram."""
    clock = ct.nlsys(lambda t, x, u, params: [1.0], None, inputs=0, states=1, name="clock")
    sink = ct.nlsys(
        lambda t, x, u, params: [u[0]], lambda t, x, u, params: np.zeros(0), inputs=["x[0]"],
        outputs=0, states=1, name="sink",
    )  # fmt: skip
    gain = ct.tf([3.0], [1.0], inputs="x[0]", outputs="z", name="gain")
    compare(clock, native=native)
    compare(sink, native=native)
    for diagram in (
        ct.interconnect([clock, sink], [["sink.x[0]", "clock.x[0]"]], name="none"),
        ct.interconnect([clock, gain], [["gain.x[0]", "clock.x[0]"]], outlist=["-gain.z"]),
        ct.interconnect([ct.rss(2, 1, 1, name="p"), ct.rss(1, 1, 1, name="q")],
                        [["p.u[0]", "q.y[0]"]], inplist=["q.u[0]"], outlist=["p.y[0]", "q.u[0]"]),
    ):  # fmt: skip
        compare(diagram, native=native)


def test_a_block_without_sizes_is_refused_by_name():
    """python-control finds them out when it runs; a program needs them before."""
    vague = ct.NonlinearIOSystem(lambda t, x, u, params: -x, None, name="vague")
    with pytest.raises(UsageError, match="'vague' does not say how many inputs it has"):
        compile_diagram(vague)


def test_print_shows_what_was_compiled():
    """Timebase, sizes, order, feedthrough, states, parameters with values, corners and memory."""
    shown = str(nlctl.compile(nlctl.paper.example_2()))
    assert "continuous time: 8 blocks, 0 inputs, 33 states, 12 outputs" in shown
    order = shown.splitlines()[1].split("order")[1].split("->")
    assert order[0].strip() == "reference"
    assert len(order) == 8
    block = shown.split("  actuator: ")[1]
    assert block.startswith("Backlash, feedthrough")
    assert "memory       memory" in block
    assert "m_r = 1.2" in block
    assert "mode = 'double' (fixed)" in str(nlctl.compile(tuned("tuned")))
    step = ct.nlsys(lambda t, x, u, params: x, None, inputs=0, states=1, dt=0.1, name="step")
    assert "discrete time, dt = 0.1 s: 1 block" in str(nlctl.compile(step))
