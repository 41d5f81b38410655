"""Loops that hypothesis draws: two rates, delays, memories, nested programs, faults."""

import pickle

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl

T = np.linspace(0, 1.5, 31)
APART = 1e-7  # of the largest output
ACTUATORS = {
    "play": nlctl.Backlash(m_r=1.0, m_l=1.3, c_r=0.2, c_l=-0.2),
    "stop": nlctl.actuators.Stop(r=0.3),
    "Prandtl-Ishlinskii": nlctl.actuators.PrandtlIshlinskii(),
    "its inverse": nlctl.actuators.PrandtlIshlinskiiInverse(),
    "generalised": nlctl.actuators.GeneralisedPrandtlIshlinskii(),
    "relay": nlctl.Relay(on=0.2, off=-0.2, height=0.5),
    "Preisach": nlctl.actuators.Preisach(),
    "dead zone": nlctl.DeadZone(),
    "rate limiter": nlctl.RateLimiter(),
    "lag": nlctl.Lag(),
}
SIGNALS = ("plant.y", "plant.v", "actuator.v", "program.u", "program.seen", "slow.s", "w")
KINDS = {
    "bias": 0.4, "gain": 0.3, "drift": 0.5, "stuck": -0.2, "noise": 0.3, "dropout": None,
    "delay": 0.13,
}  # fmt: skip
gains = st.integers(-10, 10).map(lambda k: k / 10)
poles = st.integers(-8, 8).map(lambda k: k / 10)


@st.composite
def clocks(draw, dt):
    """An offset, and what becomes of the samples of that sampling time."""
    offset = {"offset": draw(st.sampled_from((0.0, 0.037, dt, 0.211)))}
    late = (
        {}, {"delay": 0.013}, {"delay": dt}, {"delay": 3 * dt}, {"delay": 2.5 * dt},
        {"jitter": 0.6 * dt, "seed": draw(st.integers(0, 9))},
        {"jitter": 0.3 * dt, "delay": 0.4 * dt},
    )  # fmt: skip
    return offset | draw(st.sampled_from(late))


@st.composite
def programs(draw, dt):
    """Two blocks in a row, sampled one by one or as a diagram."""
    one = ct.ss(
        draw(poles), [[draw(gains), draw(gains)]], draw(gains), [[draw(gains), draw(gains)]], dt,
        inputs=["seen", "s"], outputs=["m"], name="one",
    )  # fmt: skip
    two = ct.nlsys(
        lambda t, x, u, p: [p["a"] * x[0] + np.tanh(u[0])],
        lambda t, x, u, p: [np.sin(x[0]) + 0.3 * u[0]],
        states=["z"], inputs=["m"], outputs=["u"], dt=dt, name="two", params={"a": draw(poles)},
    )  # fmt: skip
    around = {"inputs": ["seen", "s"], "outputs": ["u"], "name": "program"}
    if draw(st.booleans()):
        return nlctl.sampled(nlctl.interconnect([one, two], **around), **draw(clocks(dt)))
    each = [nlctl.sampled(block, **draw(clocks(dt))) for block in (one, two)]
    return nlctl.interconnect(each, **around)


@st.composite
def lines(draw):
    """What the program sees of y: the present, or the past that may sway."""
    delay = draw(st.sampled_from((0.0, 0.031, 0.1, 0.27)))
    if not delay:
        return ct.ss([], [], [], 1.0, inputs=["y"], outputs=["seen"], name="line")
    sway = draw(st.sampled_from((0.0, 0.4 * delay)))
    varying = (lambda t: sway * np.sin(1.3 * t)) if sway else None
    line = nlctl.TransportDelay(inputs=("y",), outputs=("seen",), delay=delay, varying=varying)
    return nlctl.block(line, "line")


@st.composite
def loops(draw):
    """A loop, its start, and its input."""
    rng = np.random.default_rng(draw(st.integers(0, 999)))
    A, B, C = rng.normal(size=(2, 2)) - 1.2 * np.eye(2), *rng.normal(size=(2, 2, 2))
    plant = ct.ss(A, B, C[:1], 0, inputs=["v", "w"], outputs=["y"], name="plant")
    rates = st.permutations((0.05, 0.07, 0.1, 3 * 0.1, 0.13, 0.2))
    dt, dt_slow = draw(rates)[:2]
    slow = ct.ss(
        draw(poles), draw(gains), draw(gains), draw(gains), dt_slow, inputs=["y"], outputs=["s"],
        name="slow",
    )  # fmt: skip
    actuator = ACTUATORS[draw(st.sampled_from(list(ACTUATORS)))]
    line = draw(lines())
    blocks = [
        plant, draw(programs(dt)), nlctl.sampled(slow, **draw(clocks(dt_slow))), line,
        nlctl.block(actuator, "actuator"),
    ]  # fmt: skip
    loop = nlctl.interconnect(blocks, inputs=["w"], outputs=["y", "u", "v", "s"], name="loop")
    faults = draw(st.lists(st.sampled_from([k for k in KINDS if k != "delay"]), max_size=2))
    if not isinstance(line, nlctl.Block) and draw(st.booleans()):
        faults.append("delay")  # python-control's steps between breaks of several are many
    made = [
        nlctl.Fault(
            draw(st.sampled_from(SIGNALS)), kind, KINDS[kind], at=0.3 + 0.3 * i,
            until=1.0 + 0.3 * i if kind == "dropout" else None,
        )
        for i, kind in enumerate(faults)
    ]  # fmt: skip
    w = draw(st.sampled_from((np.sin(2 * T), np.where(T > 0.63, 1.0, 0.0), np.cos(T))))
    x0 = {"plant.x[0]": draw(gains), "plant.x[1]": draw(gains)}
    return (nlctl.with_faults(loop, *made) if made else loop), x0, w


@pytest.mark.weekly
@given(drawn=loops())
@settings(max_examples=6)
def test_machine_code_is_python_control(drawn):
    """All outputs, at samples and between them."""
    loop, x0, w = drawn
    ours, theirs = (
        nlctl.input_output_response(loop, T, w, x0, engine=engine, rtol=1e-10, atol=1e-12)
        for engine in ("native", "python-control")
    )
    size = max(1.0, np.abs(theirs.outputs).max())
    np.testing.assert_allclose(ours.outputs, theirs.outputs, rtol=0, atol=APART * size)


@pytest.mark.weekly
@pytest.mark.ci
@given(drawn=loops())
@settings(max_examples=8)
def test_threads_company_and_pickle_change_no_bit(drawn):
    """Members with starts of their own, in lanes or alone, as compiled or read again."""
    loop, x0, w = drawn
    compiled = nlctl.compile(loop)
    again = pickle.loads(pickle.dumps(compiled))
    starts = {name: value + np.linspace(0, 1, 11) for name, value in x0.items()}
    made = [
        nlctl.ensemble_response(one, T, w, starts, keep=["y", "v"], threads=threads)
        for one, threads in ((compiled, 1), (compiled, 2), (again, 2))
    ]
    few = {name: values[3:5] for name, values in starts.items()}
    alone = nlctl.ensemble_response(compiled, T, w, few, keep=["y", "v"])
    for signal in ("y", "v"):
        for other in made[1:]:
            np.testing.assert_array_equal(other.signals[signal], made[0].signals[signal])
        np.testing.assert_array_equal(alone.signals[signal], made[0].signals[signal][3:5])
