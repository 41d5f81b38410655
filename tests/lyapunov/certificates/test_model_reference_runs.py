"""What is proved holds along runs: with drawn disturbances, from drawn starts in the level set."""

import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from mrac_loops import SINE, e_modification, first_order, projection, sigma, wing_rock

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.lyapunov.loop.roles import read_roles
from nlctl.analysis.lyapunov.model_reference.matching import ADAPTIVE_PIECES

D, TIMES = 0.5, np.linspace(0, 60, 3001)
INPUTS = {"w": D}
ROUND = 1 + 1e-6  # of the integrator, relative


def moving(kind):
    """x' = 2 x + v with the disturbance w as an external input, and a model that moves."""
    command = nlctl.SumOfSines(order=0, amplitudes=(1.0,), frequencies=(0.7,), phases=(0.0,))
    weights = {"sigma": sigma, "e": e_modification, "projection": projection}[kind]()
    return first_order(weights, inputs=["w"], k=1.0, b=1.0, reference=command)


def rolling(kind):
    """Wing rock with the disturbance w beside the ailerons."""
    made = {"sigma": sigma(0.1, nodes=6), "e": e_modification(0.5, nodes=6),
            "projection": projection(2.0, nodes=6)}  # fmt: skip
    return wing_rock(made[kind], inputs=["w"])


LOOPS = {f"{plant.__name__} {kind}": (plant, kind) for plant in (moving, rolling)
         for kind in ("sigma", "e", "projection")}  # fmt: skip
PROVED = {}


def linear_plant(a, gain):
    """x_n' = a^T x + gain v."""
    a0, a1, a2 = (*map(float, a), 0.0, 0.0)[:3]
    if len(a) == 1:
        return nlctl.equation(lambda x, v: a0 * x[0] + gain * v)
    if len(a) == 2:
        return nlctl.equation(lambda x, v: a0 * x[0] + a1 * x[1] + gain * v)
    return nlctl.equation(lambda x, v: a0 * x[0] + a1 * x[1] + a2 * x[2] + gain * v)


def sine_of(size):
    return nlctl.equation(lambda x, t: size * np.sin(0.9 * t))


def proved(name):
    """Loop, machine code and certificate, made once."""
    if name not in PROVED:
        make, kind = LOOPS[name]
        loop = make(kind)
        PROVED[name] = loop, nlctl.compile(loop), certify(loop, inputs=INPUTS)
    return PROVED[name]


def drawn_start(loop, found, rng, share):
    """A state with V(0) = share V_max, E and W_hat in a drawn direction, the model at rest."""
    match, names = found.matching, list(nlctl.state_names(loop))
    P = np.array([[float(int(v.p) / int(v.q)) for v in row] for row in match.loop.form.P.tolist()])
    E, error = rng.standard_normal(len(P)), rng.standard_normal(len(found.W))
    scale = np.sqrt(share * found.V_max / (E @ P @ E + error @ error / float(match.Gamma)))
    W_hat = np.array(found.W) + scale * error
    if isinstance(
        match.loop.spec("weights"), nlctl.controllers.ProjectedWeights
    ):  # they start in the ball
        W_hat *= min(1.0, match.loop.spec("weights").W_max / np.linalg.norm(W_hat))
    start = nlctl.initial_state(loop)
    start[[names.index(f"plant.x{i + 1}") for i in range(len(E))]] = scale * E
    start[[names.index(f"weights.W_hat[{i}]") for i in range(error.size)]] = W_hat
    return start


def drawn_disturbance(rng, kind):
    """A bounded signal: constant, a square wave, a chirp, or random steps."""
    if kind == "constant":
        return np.full(TIMES.size, D * rng.choice([-1, 1]))
    if kind == "square":
        return D * np.sign(np.sin(rng.uniform(0.1, 3) * TIMES + rng.uniform(0, 6)))
    if kind == "chirp":
        return D * np.sin(rng.uniform(0.01, 0.1) * TIMES**2)
    return np.repeat(D * rng.uniform(-1, 1, TIMES.size // 20 + 1), 20)[: TIMES.size]


def signals(loop, run, found):
    """Errors, distance of the weights and V along a run."""
    states = dict(zip(nlctl.state_names(loop), run.states, strict=True))
    n = found.matching.loop.order
    E = np.array([states[f"plant.x{i}"] - states[f"model.xm{i}"] for i in range(1, n + 1)])
    W_hat = np.array([states[f"weights.W_hat[{i}]"] for i in range(len(found.W))])
    return E, W_hat, np.linalg.norm(W_hat - np.array(found.W)[:, None], axis=0)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("name", LOOPS)
@settings(max_examples=many(12, part=2), deadline=None)
@given(seed=st.integers(0, 10**6), kind=st.sampled_from(["constant", "square", "chirp", "steps"]),
       share=st.floats(0.0, 1.0))  # fmt: skip
def test_runs_keep_what_is_proved(name, seed, kind, share):
    """For all time, in the end, and in the mean, whatever |w| <= D does."""
    loop, compiled, found = proved(name)
    assert found.holds
    rng = np.random.default_rng(seed)
    start, w = drawn_start(loop, found, rng, share), drawn_disturbance(rng, kind)
    run = nlctl.input_output_response(compiled, TIMES, w, start, rtol=1e-8, atol=1e-10)
    E, W_hat, distance = signals(loop, run, found)
    u = run.outputs[run.output_labels.index("u")]
    for error, bound in zip(E, found.errors, strict=True):
        assert np.abs(error).max() <= bound * ROUND
    assert distance.max() <= found.W_error * ROUND
    assert np.linalg.norm(W_hat, axis=0).max() <= found.region.W_hat * ROUND
    assert np.abs(u).max() <= found.u_max * ROUND
    # the integral of s^2 - 2 a s - b is at most V(0): the mean of e^2 is what is proved, and V/t
    end = TIMES >= 20
    rest = (
        found.V_max
        * float(found.matching.loop.form.Q.inv()[0, 0].p)
        / float(found.matching.loop.form.Q.inv()[0, 0].q)
    )
    mean = np.trapezoid(E[0] ** 2, TIMES) / TIMES[-1]
    assert np.sqrt(mean) <= found.rms + np.sqrt(rest / TIMES[-1])
    if name.endswith("sigma"):  # V falls to its last bound at the rate alpha_1
        V_left = found.V_max * np.exp(-found.alpha_1 * 20) + found.alpha_0 / found.alpha_1
        reach = np.sqrt(V_left * found.errors[0] ** 2 / found.V_max)
        assert np.abs(E[0][end]).max() <= reach * ROUND


@pytest.mark.weekly
@settings(max_examples=8, deadline=None)
@given(order=st.integers(1, 3), seed=st.integers(0, 10**6))
def test_plants_of_order_one_to_three(order, seed):
    """Drawn linear plants, models, gains and modifications, with a command and a disturbance."""
    rng = np.random.default_rng(seed)
    a, gain, size = rng.uniform(-2, 2, order), rng.uniform(0.5, 3), rng.uniform(0, 0.5)
    K = np.poly(-rng.uniform(0.5, 3, order))[:0:-1]
    model = np.poly(-rng.uniform(0.5, 3, order))[:0:-1]
    nodes, Gamma = order + 1, float(rng.uniform(1, 50))
    weights = [
        sigma(float(rng.uniform(0.05, 1)), Gamma, nodes),
        e_modification(float(rng.uniform(0.05, 1)), Gamma, nodes),
        projection(10.0, Gamma, nodes),
    ][rng.integers(3)]
    f = linear_plant(a, gain)
    loop = first_order(
        weights,
        plant=nlctl.PureFeedback(order=order, f=f, d=sine_of(size), initial={"x1": 0.5}),
        reference=SINE,
        model=nlctl.controllers.ReferenceModel(a=tuple(map(float, model)), b=float(model[0])),
        error=nlctl.controllers.ModelError(
            K=tuple(map(float, K)), Q=tuple(rng.uniform(0.5, 5, order))
        ),
        basis=nlctl.controllers.LinearRegressor(order=order),
        law=nlctl.controllers.ModelReferenceLaw(gain=gain),
    )
    found = certify(loop)
    run = nlctl.input_output_response(loop, np.linspace(0, 40, 2001), rtol=1e-7, atol=1e-9)
    E, _, distance = signals(loop, run, found)
    assert found.holds
    assert pytest.approx(size, rel=1e-3, abs=1e-12) == found.region.D
    for error, bound in zip(E, found.errors, strict=True):
        assert np.abs(error).max() <= bound * ROUND
    assert distance.max() <= found.W_error * ROUND


def drawn_plant(rng):
    """x' = c_0 x + c_1 sin x + L v + nl (sin v + cos 3x) + d, d pushing outwards or a sine."""
    c0, c1, gain = (float(c) for c in rng.uniform([-1.5, -1.5, 0.5], [1.5, 1.5, 3.0]))
    nl, size = float(rng.choice([0.0, 0.1, 0.3])), float(rng.choice([0.0, 0.1, 0.5]))
    f = nlctl.equation(
        lambda x, v: c0 * x[0] + c1 * np.sin(x[0]) + gain * v + nl * (np.sin(v) + np.cos(3 * x[0]))
    )
    outwards = nlctl.equation(lambda x, t: size * np.tanh(20 * x[0]))
    d = outwards if rng.integers(2) else sine_of(size)
    start = {"x1": float(rng.uniform(-1, 1))}
    return nlctl.PureFeedback(order=1, f=f, d=d, initial=start), gain


def drawn_actuator(rng):
    slope = float(rng.choice([1.0, 0.97]))
    return [
        nlctl.Gain(k=float(rng.uniform(0.5, 2))),
        nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.2, c_l=-0.2),
        nlctl.DeadZone(ripple_r=0.0, ripple_l=0.0, slope_l=slope, b_r=0.1, b_l=-0.2),
    ][rng.integers(3)]


@pytest.mark.weekly
@settings(max_examples=many(25, part=4), deadline=None)
@given(seed=st.integers(0, 10**6))
def test_whatever_is_certified_holds(seed):
    """Drawn plants that no regressor spans, gains that laws do not know, actuators: never beyond.

    Many are not certified; of those that are every bound holds along a run.
    """
    rng = np.random.default_rng(seed)
    plant, gain = drawn_plant(rng)
    k, Gamma, own = rng.uniform(0.5, 8), 10 ** rng.uniform(0, 2.5), 10 ** rng.uniform(-2, 0.5)
    weights = [
        sigma(float(own), float(Gamma)),
        e_modification(float(own), float(Gamma)),
        projection(float(rng.uniform(1, 8)), float(Gamma)),
    ][rng.integers(3)]
    told = float(gain * rng.choice([1.0, 0.5, 1.5]))
    law = (
        nlctl.controllers.DirectLaw()
        if rng.integers(3) == 0
        else nlctl.controllers.ModelReferenceLaw(gain=told)
    )
    loop = first_order(weights, plant=plant, actuator=drawn_actuator(rng), law=law, k=float(k),
                       reference=SINE, b=float(rng.uniform(-2, 2)))  # fmt: skip
    found = certify(loop, tol=0.05)
    if not found.holds:
        return
    run = nlctl.input_output_response(loop, np.linspace(0, 40, 2001), rtol=1e-7, atol=1e-9)
    E, W_hat, distance = signals(loop, run, found)
    u = run.outputs[run.output_labels.index("u")]
    assert np.abs(E[0]).max() <= found.e * ROUND
    assert distance.max() <= found.W_error * ROUND
    assert np.linalg.norm(W_hat, axis=0).max() <= found.region.W_hat * ROUND
    assert np.abs(u).max() <= found.u_max * ROUND


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sigma", "e", "projection"])
def test_the_disturbance_that_pushes_outwards_is_no_exception(kind):
    """d = D tanh(50 x) pushes e away whenever it can; e comes near its bound and not beyond."""
    outwards = nlctl.equation(lambda x, t: 0.5 * np.tanh(50 * x[0]))
    weights = {"sigma": sigma, "e": e_modification, "projection": projection}[kind]()
    loop = first_order(weights, d=outwards)
    found = certify(loop)
    start = nlctl.initial_state(loop, {"plant.x1": 1e-3, "weights.W_hat[0]": 0.0})
    run = nlctl.input_output_response(loop, np.linspace(0, 100, 10001), 0, start)
    x = np.abs(run.outputs[0])
    assert found.holds
    assert x.max() <= found.e
    assert x[5000:].max() <= found.ultimate
    assert x[5000:].max() >= 0.1 * found.ultimate


@pytest.mark.slow
@pytest.mark.parametrize("actuator", [
    nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.4, c_l=-0.4),
    nlctl.DeadZone(ripple_r=0.0, ripple_l=0.0, slope_l=1.0, b_r=0.3, b_l=-0.2),
    nlctl.DeadZone(ripple_r=0.0, ripple_l=0.0, slope_l=0.98, b_r=0.1, b_l=-0.1),
])  # fmt: skip
def test_a_run_behind_an_actuator_keeps_the_bound(actuator):
    half = nlctl.equation(lambda x, t: 0.5 * np.sin(t))
    loop = first_order(sigma(), d=half, actuator=actuator, k=1.0, b=1.0,
                       reference=nlctl.SumOfSines(order=0))  # fmt: skip
    found = certify(loop)
    run = nlctl.input_output_response(loop, np.linspace(0, 60, 6001))
    e, u = (run.outputs[run.output_labels.index(label)] for label in ("e", "u"))
    assert found.holds
    assert 0.05 * found.e <= np.abs(e).max() <= found.e
    assert np.abs(u).max() <= found.u_max


def test_the_roles_are_those_that_the_loop_has():
    """Read from the wiring, whatever a block is called in the diagram."""
    loop = moving("sigma")
    assert read_roles(loop, ADAPTIVE_PIECES).paths == {part: part for part in ADAPTIVE_PIECES}
