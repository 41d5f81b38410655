"""Transport delays: against the method of steps by hand, closed forms, and python-control."""

import pickle
from math import factorial, pi

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.native.integrate.delays import POINTS, POWERS

ENGINES = ("native", "python-control")


def delayed_integrator(a=1.0, *, x0=1.0, **fields):
    """x' = -a x(t - tau)."""
    return nlctl.interconnect(
        {
            "wire": nlctl.TransportDelay(inputs=("x",), outputs=("late",), **fields),
            "plant": ct.ss(0, -a, 1, 0, inputs="late", outputs="x", name="plant"),
        },
        outputs=["x", "late"],
    ), {"plant.x[0]": x0}


def method_of_steps(t, a, tau):
    """The solution from x(0) = 1 with x = 0 before: a polynomial on each interval of length tau."""
    terms = range(int(t / tau + 1e-12) + 1)
    return sum((-a * (t - k * tau)) ** k / factorial(k) for k in terms)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_delayed_integrator_is_its_piecewise_polynomial(engine):
    a, tau = 1.3, 0.7
    loop, x0 = delayed_integrator(a, delay=tau)
    times = np.linspace(0, 4, 41)
    run = nlctl.input_output_response(loop, times, 0, x0, engine=engine, rtol=1e-10, atol=1e-12)
    exact = [method_of_steps(t, a, tau) for t in times]
    np.testing.assert_allclose(run.outputs[0], exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_the_history_is_a_function_of_time(engine):
    """x' = -x(t - pi/2) goes on as the sine that it was."""
    loop, x0 = delayed_integrator(x0=0.0, delay=pi / 2, history=np.sin)
    times = np.linspace(0, 6, 31)
    run = nlctl.input_output_response(loop, times, 0, x0, engine=engine, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(run.outputs[0], np.sin(times), rtol=0, atol=2e-9)
    np.testing.assert_allclose(run.outputs[1], np.sin(times - pi / 2), rtol=0, atol=2e-9)


def test_errors_fall_with_an_order_of_at_least_4():
    loop, x0 = delayed_integrator(x0=0.0, delay=pi / 2, history=np.sin)
    compiled, times = nlctl.compile(loop), np.array([0.0, 3 * pi])
    errors = []
    for parts in (4, 8, 16, 32):
        run = nlctl.input_output_response(compiled, times, 0, x0, step=pi / 2 / parts)
        errors.append(abs(run.states[0, -1] - np.sin(times[-1])))
    assert np.all(np.log2(np.divide(errors[:-1], errors[1:])) > 4)


def test_a_jump_in_the_history_arrives_when_it_is_due():
    """History 1 up to t = -0.4 and 0 after it: x' = -1 up to t = 0.6, then 0 up to t = 1."""
    loop, x0 = delayed_integrator(delay=1.0, history=lambda t: 1.0 if t < -0.4 else 0.0)
    run = nlctl.input_output_response(loop, [0, 0.3, 0.6, 0.8, 1.0], 0, x0, engine="native")
    np.testing.assert_allclose(run.outputs[0], [1, 0.7, 0.4, 0.4, 0.4], rtol=0, atol=1e-10)


def test_a_jump_that_nothing_tells_of_arrives_too():
    """The sign of a sine of period 2, late by 0.3: its integral is a triangle."""
    source = ct.nlsys(None, lambda t, x, u, p: [np.sign(np.sin(np.pi * t))], inputs=0, outputs="u")
    wire = nlctl.block(nlctl.TransportDelay(delay=0.3), "wire")
    plant = ct.ss(0, 1, 1, 0, inputs="y", outputs="x", name="plant")
    loop = ct.interconnect([source, wire, plant], inputs=[], outputs=["x"], inplist=[])
    times = np.linspace(0, 4, 41)
    run = nlctl.input_output_response(loop, times, engine="native")
    exact = np.where(times < 0.3, 0, 1 - np.abs(1 - (times - 0.3) % 2))
    np.testing.assert_allclose(run.outputs[0], exact, rtol=0, atol=1e-8)


@nlctl.record
class Step:
    """0 before t = 1, then 1."""

    inputs, outputs, states, feedthrough = (), ("w",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (1.0 if t >= 1.0 else 0.0,)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return (t - 1.0,)


def chain(first=0.3, second=0.45):
    """A step through two delays into an integrator."""
    return nlctl.interconnect(
        {
            "source": Step(),
            "first": nlctl.TransportDelay(inputs=("w",), outputs=("w1",), delay=first),
            "second": nlctl.TransportDelay(inputs=("w1",), outputs=("w2",), delay=second),
            "plant": ct.ss(0, 1, 1, 0, inputs="w2", outputs="x", name="plant"),
        },
        outputs=["x"],
    )


@pytest.mark.slow
@pytest.mark.parametrize("engine", ENGINES)
def test_a_step_through_two_delays_ends_a_step_twice(engine):
    times = np.linspace(0, 3, 13)
    run = nlctl.input_output_response(chain(), times, engine=engine)
    tolerance = 1e-8 if engine == "native" else 1e-4  # whose source jumps within a step
    exact = np.maximum(times - 1.75, 0)
    np.testing.assert_allclose(run.outputs[0], exact, rtol=0, atol=tolerance)


@pytest.mark.parametrize("engine", ENGINES)
def test_corners_of_inputs_arrive_late(engine):
    system = ct.interconnect(
        [
            nlctl.block(nlctl.TransportDelay(delay=0.37), "wire"),
            ct.ss(0, 1, 1, 0, inputs="y", outputs="x", name="plant"),
        ],
        inputs=["u"], outputs=["x"],
    )  # fmt: skip
    times, u = np.array([0, 1, 2, 3]), np.array([0, 0, 1, 1])
    wanted = np.linspace(0, 3, 31)
    run = nlctl.input_output_response(
        system, times, u, evaluation_times=wanted, engine=engine, rtol=1e-9, atol=1e-11
    )
    s = np.maximum(wanted - 1.37, 0)
    exact = np.where(s < 1, s**2 / 2, s - 0.5)
    np.testing.assert_allclose(np.squeeze(run.outputs), exact, rtol=0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_delay_breaks_a_ring_of_feedthrough(engine):
    """y = 1 + y(t - 1) / 2 is not an algebraic loop: it goes up in steps."""
    loop = nlctl.interconnect(
        {
            "half": ct.ss([], [], [], [[0.5, 1.0]], inputs=["late", "one"], outputs="y"),
            "wire": nlctl.TransportDelay(inputs=("y",), outputs=("late",), delay=1.0),
            "counted": ct.ss(0, 1, 1, 0, inputs="y", outputs="x", name="counted"),
        },
        inputs=["one"], outputs=["x", "y"],
    )  # fmt: skip
    times = np.linspace(0, 5, 21)
    run = nlctl.input_output_response(loop, times, 1.0, engine=engine)
    y = 2 * (1 - 0.5 ** (np.floor(times) + 1))
    at_a_jump = times == np.floor(times)
    np.testing.assert_allclose(run.outputs[1, ~at_a_jump], y[~at_a_jump], rtol=0, atol=1e-9)
    x = np.interp(times, np.arange(7), np.r_[0, np.cumsum(2 * (1 - 0.5 ** np.arange(1.0, 7)))])
    np.testing.assert_allclose(run.outputs[0], x, rtol=0, atol=1e-8)


def test_members_differ_in_their_delay_and_have_the_same_bits_on_any_number_of_threads():
    loop, x0 = delayed_integrator(delay=0.5)
    compiled, times = nlctl.compile(loop), np.linspace(0, 3, 7)
    taus = np.linspace(0.2, 4.0, 19)
    given = {"params": {"wire.delay": taus}, "keep": ["x"], "rtol": 1e-10, "atol": 1e-12}
    many = [nlctl.ensemble_response(compiled, times, 0, x0, threads=n, **given) for n in (1, 2)]
    np.testing.assert_array_equal(many[0].signals["x"], many[1].signals["x"])
    exact = [[method_of_steps(t, 1.0, tau) for t in times] for tau in taus]
    np.testing.assert_allclose(many[0].signals["x"], exact, rtol=0, atol=1e-8)
    few = nlctl.ensemble_response(
        compiled, times, 0, x0, **given | {"params": {"wire.delay": taus[5:7]}}
    )
    np.testing.assert_array_equal(few.signals["x"], many[0].signals["x"][5:7])


def test_a_long_run_forgets_what_no_delay_reaches():
    """x' = -x(t - pi/2) stays the sine over 2,000 delays; of its past only the end is kept."""
    loop, x0 = delayed_integrator(x0=0.0, delay=pi / 2, history=np.sin)
    times = np.linspace(0, 1000 * pi, 5)
    run = nlctl.input_output_response(nlctl.compile(loop), times, 0, x0, rtol=1e-9, atol=1e-11)
    assert run.statistics.accepted > 4000
    np.testing.assert_allclose(run.outputs[0], np.sin(times), rtol=0, atol=1e-5)


@pytest.mark.slow
def test_a_delayed_program_is_a_program_with_a_delay():
    """A controller whose outputs are late by tau is `sampled(..., delay=tau)`."""
    plant = ct.ss([[0, 1], [-1, -0.2]], [[0], [1]], [[1, 0]], 0, inputs="v", outputs="y")
    law = ct.ss([], [], [], -0.8, 0.1, inputs="y", outputs="u")
    one = nlctl.interconnect(
        {
            "law": nlctl.sampled(law),
            "wire": nlctl.TransportDelay(inputs=("u",), outputs=("v",), delay=0.04),
            "plant": plant,
        },
        outputs=["y", "v"],
    )
    other = nlctl.interconnect(
        {
            "law": nlctl.sampled(ct.ss([], [], [], -0.8, 0.1, inputs="y", outputs="v"), delay=0.04),
            "plant": plant,
        },
        outputs=["y", "v"],
    )
    times, x0 = np.linspace(0, 3.02, 152), {"plant.x[0]": 1.0}
    exact = nlctl.input_output_response(other, times, 0, x0, engine="native").outputs
    for engine, tolerance in (("native", 1e-9), ("python-control", 1e-6)):
        run = nlctl.input_output_response(one, times, 0, x0, engine=engine)
        np.testing.assert_allclose(run.outputs[0], exact[0], rtol=0, atol=tolerance)


@pytest.mark.ci
def test_engines_agree_on_a_nonlinear_loop_with_two_delays():
    @nlctl.equation
    def pendulum(x, v):
        return -np.sin(x[0]) - 0.3 * x[1] + v

    loop = nlctl.interconnect(
        {
            "plant": nlctl.PureFeedback(order=2, f=pendulum, initial={"x1": 1.0}),
            "sensor": nlctl.TransportDelay(
                inputs=("x1", "x2"), outputs=("m1", "m2"), delay=0.11, before=1.0
            ),
            "law": ct.nlsys(
                None, lambda t, x, u, p: [-2 * u[0] - np.tanh(u[1])],
                inputs=["m1", "m2"], outputs=["u"],
            ),
            "network": nlctl.TransportDelay(inputs=("u",), outputs=("v",), delay=0.07),
        },
        outputs=["x1", "v"],
    )  # fmt: skip
    times = np.linspace(0, 3, 31)
    ours, theirs = (
        nlctl.input_output_response(loop, times, engine=engine, rtol=1e-9, atol=1e-11)
        for engine in ENGINES
    )
    np.testing.assert_allclose(ours.outputs, theirs.outputs, rtol=0, atol=1e-7)


def test_a_compiled_loop_with_delays_pickles():
    loop, x0 = delayed_integrator(delay=0.5)
    compiled, times = nlctl.compile(loop), np.linspace(0, 2, 5)
    copy = pickle.loads(pickle.dumps(compiled))
    runs = [nlctl.input_output_response(c, times, 0, x0).states for c in (compiled, copy)]
    np.testing.assert_array_equal(*runs)


def test_a_delay_longer_than_the_run_shows_the_history_alone():
    loop, x0 = delayed_integrator(delay=100.0, before=0.25)
    run = nlctl.input_output_response(loop, [0, 1, 2], 0, x0, engine="native")
    np.testing.assert_allclose(run.outputs, [[1, 0.75, 0.5], [0.25] * 3], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"delay": 0.0}, "TransportDelay needs delay > 0, got 0"),
        ({"delay": -0.1}, "TransportDelay needs delay > 0, got -0.1"),
        ({"delay": np.nan}, "TransportDelay needs a finite delay, got nan"),
        ({"delay": np.inf}, "TransportDelay needs a finite delay, got inf"),
        ({"delay": np.sin}, "TransportDelay needs numbers for delay"),
        ({"history": 1.0}, "a constant is called before"),
        ({"inputs": ("a", "b")}, "as many inputs as outputs"),
    ],
)
def test_bad_fields_are_refused_in_one_sentence(fields, message):
    with pytest.raises(nlctl.errors.ParameterError, match=message):
        nlctl.TransportDelay(**fields)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("history", [lambda t: np.nan, lambda t: [0.0, 1.0], lambda t: 1 / 0])
def test_a_bad_history_is_refused_by_the_block(engine, history):
    loop, x0 = delayed_integrator(delay=0.5, history=history)
    with pytest.raises(nlctl.errors.ParameterError, match="needs a history"):
        nlctl.input_output_response(loop, [0, 1], 0, x0, engine=engine)


def test_bad_delays_of_a_run_are_refused():
    loop, x0 = delayed_integrator(delay=0.5)
    with pytest.raises(nlctl.errors.ParameterError, match=r"delay > 0, got 0 \(block 'wire'\)"):
        nlctl.input_output_response(loop, [0, 1], 0, x0, params={"wire.delay": 0.0})
    with pytest.raises(nlctl.errors.ParameterError, match=r"member 1"):
        nlctl.ensemble_response(loop, [0, 1], params={"wire.delay": np.array([0.1, -1.0])})


def test_python_control_itself_is_refused():
    loop, _ = delayed_integrator(delay=0.5)
    for function in (
        lambda: ct.input_output_response(loop, [0, 1], 0, [1.0]),
        lambda: ct.linearize(loop, [1.0]),
        lambda: nlctl.compile(loop).dynamics(0.0, [1.0]),
    ):
        with pytest.raises(nlctl.errors.UsageError, match="the past"):
            function()


def test_linearization_is_refused_and_names_the_delay():
    wire = nlctl.block(nlctl.TransportDelay(delay=0.5), "wire")
    plant = ct.ss(0, 1, 1, 0, inputs="y", outputs="x", name="plant")
    system = ct.interconnect([wire, plant], inputs=["u"], outputs=["x"])
    with pytest.raises(nlctl.errors.CompileError, match=r"transport delays 'wire'.*ct\.pade"):
        nlctl.compile(system).linearize([0.0], [0.0])


def test_the_stiff_method_is_refused():
    loop, x0 = delayed_integrator(delay=0.5)
    with pytest.raises(nlctl.errors.ParameterError, match="tsit5"):
        nlctl.input_output_response(loop, [0, 1], 0, x0, method="rodas5p")


def test_discrete_time_is_refused():
    with pytest.raises(nlctl.errors.ParameterError, match="continuous time"):
        nlctl.block(nlctl.TransportDelay(delay=0.5), "wire", dt=0.1)
    wire = nlctl.block(nlctl.TransportDelay(delay=0.5), "wire")
    for engine in ENGINES:
        with pytest.raises(nlctl.errors.DiagramError, match="continuous time"):
            nlctl.input_output_response(nlctl.sampled(wire, 0.1), [0, 1], 0, engine=engine)


def test_a_polynomial_of_degree_five_is_kept_as_it_is_on_every_machine():
    """Nodes have 12 decimals, and all follows exactly: last bits of cosine or BLAS do not count."""
    z = 2 * POINTS - 1
    np.testing.assert_allclose(POWERS @ z[:, None] ** np.arange(6), np.eye(6), atol=1e-14)
    np.testing.assert_allclose(z, -np.cos(pi * (np.arange(6) + 0.5) / 6), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(np.round(z, 12), np.round(z, 15))
