"""Jumps in the reference engine, each kind against its closed form."""

from types import SimpleNamespace
from typing import Any

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

import nlctl
from nlctl.reference.interpreted import python_control_response
from nlctl.reference.known import Known

TIGHT = {"rtol": 1e-10, "atol": 1e-12}
G = 9.81


def run(system, times, inputs: Any = 0.0, start=None, **more):
    """A run in the reference engine, unless another is named."""
    how = TIGHT | {"engine": "python-control"} | more
    if how["engine"] == "taylor":
        how |= {"engine": "native", "method": "taylor"}
    return nlctl.input_output_response(system, times, inputs, start, squeeze=False, **how)


engines = pytest.mark.parametrize("engine", ["python-control", "native", "taylor"])


def made(**own):
    """A record of a block with these attributes, no inputs, and all states for outputs."""
    states = own.pop("states")
    common = {
        "inputs": (), "outputs": states, "states": states, "feedthrough": False, "vector": True,
        "output": staticmethod(lambda t, x, u, p: x),
    }  # fmt: skip
    own = {k: staticmethod(v) if callable(v) else v for k, v in own.items()}
    return SimpleNamespace(spec=nlctl.record(type("Made", (), common | own)))


@nlctl.record
class Ball:
    """A ball that loses speed at each bounce."""

    e: float = nlctl.param(0.8, unit="1", meaning="restitution", above=0)
    inputs, outputs, states, feedthrough = (), ("h", "v"), ("h", "v"), False
    initial = {"h": 1.0}
    update = staticmethod(lambda t, x, u, p: (x[1], -G))
    output = staticmethod(lambda t, x, u, p: (x[0], x[1]))
    guard = staticmethod(lambda t, x, u, p: (x[0],))
    reset = staticmethod(lambda t, x, u, p: (x[0], -p.e * x[1]))


@nlctl.record
class Landed:
    """The same, but the height behind a bounce is 0."""

    e: float = nlctl.param(0.8, unit="1", meaning="restitution", above=0)
    inputs, outputs, states, feedthrough = (), ("h", "v"), ("h", "v"), False
    initial = {"h": 1.0}
    update, output = staticmethod(Ball.update), staticmethod(Ball.output)
    guard = staticmethod(Ball.guard)
    reset = staticmethod(lambda t, x, u, p: (0.0, -p.e * x[1]))


def height(times, e, bounces):
    """Of the ball, as long as it has bounced no more than so often."""
    v0 = np.sqrt(2 * G)
    found = 1 - G * times**2 / 2
    start, v = v0 / G, e * v0
    for _ in range(bounces):
        s = times - start
        found = np.where(s >= 0, v * s - G * s**2 / 2, found)
        start, v = start + 2 * v / G, e * v
    return found, start


@pytest.mark.parted
@pytest.mark.parametrize(
    "method", ["LSODA", "DOP853", "Radau", "auto", "tsit5", "rodas5p", "taylor"]
)
def test_twelve_bounces(method):
    _, end = height(np.zeros(1), 0.8, 12)
    times = np.linspace(0, end - 1e-3, 201)
    engine = "native" if method.islower() else "python-control"
    found = run(nlctl.block(Ball(), "ball"), times, method=method, engine=engine)
    np.testing.assert_allclose(found.outputs[0], height(times, 0.8, 12)[0], rtol=0, atol=1e-7)


@pytest.mark.parted
@engines
@pytest.mark.slow
@given(
    kind=st.sampled_from((Ball, Landed)), e=st.floats(0.02, 0.85),
    rtol=st.sampled_from((1e-6, 1e-8, 1e-10)),
)  # fmt: skip
@example(kind=Landed, e=0.8, rtol=1e-8)
@settings(max_examples=many(10, part=3), deadline=None)
def test_bounces_accumulate_at_a_time(engine, kind, e, rtol):
    """The flights are a geometric sequence: no run goes beyond its sum, or through the floor."""
    v0 = np.sqrt(2 * G)
    limit = v0 / G * (1 + 2 * e / (1 - e))
    ball = nlctl.block(kind(e=e), "ball")
    with pytest.raises(
        nlctl.errors.ZenoError, match=r"block 'ball' jumps without end before"
    ) as raised:
        run(ball, [0.0, limit + 5.0], rtol=rtol, atol=0.01 * rtol, engine=engine)
    assert raised.value.time == pytest.approx(limit, rel=1e-3)
    kept = run(ball, np.linspace(0, limit + 5, 500), ignore_errors=True, engine=engine)
    assert not kept.success
    assert "Zeno" in kept.message
    assert kept.time[-1] <= limit + 1e-3
    assert np.all(kept.outputs[0] > -1e-9)


@engines
def test_jumps_without_progress_of_time_end_a_run(engine):
    """x' = -1 and back to 0 where it falls below: it falls again at once."""
    stuck = made(
        states=("x",), initial={"x": 1.0}, update=lambda t, x, u, p: -np.ones(1),
        guard=lambda t, x, u, p: x, reset=lambda t, x, u, p: 0 * x,
    ).spec  # fmt: skip
    with pytest.raises(nlctl.errors.ZenoError, match="before t = 1 s") as raised:
        run(nlctl.block(stuck(), "stuck"), [0.0, 2.0], engine=engine)
    assert raised.value.time == pytest.approx(1.0, abs=1e-9)
    assert isinstance(raised.value, nlctl.errors.DivergedError)


@nlctl.record
class Clegg:
    """Integrator that is reset where its input changes its sign, in either direction."""

    inputs, outputs, states, feedthrough = ("u",), ("y",), ("y",), False
    update = staticmethod(lambda t, x, u, p: (u[0],))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (u[0], -u[0]))
    reset = staticmethod(lambda t, x, u, p: (0.0,))


def source(function, name="source", signal="u"):
    return ct.nlsys(None, lambda t, x, u, p: [function(t)], inputs=0, outputs=[signal], name=name)


@engines
def test_a_clegg_integrator(engine):
    """Of sin(t + 0.3): cos of the last sign change minus cos now."""
    times = np.linspace(0, 10, 101)
    loop = nlctl.interconnect({"source": source(lambda t: np.sin(t + 0.3)), "clegg": Clegg()},
                              outputs=["y"])  # fmt: skip
    phase = times + 0.3
    began = np.where(phase < np.pi, 0.3, np.floor(phase / np.pi) * np.pi)
    found = run(loop, times, engine=engine).outputs[0]
    np.testing.assert_allclose(found, np.cos(began) - np.cos(phase), rtol=0, atol=1e-8)


@engines
def test_a_clegg_integrator_in_a_loop(engine):
    """Against SciPy's own events."""
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], -0.2 * x[1] + u[0]], lambda t, x, u, p: [1 - x[0]],
        inputs=["y"], outputs=["u"], states=2, name="plant",
    )  # fmt: skip
    times = np.linspace(0, 20, 201)
    found = run(
        nlctl.interconnect({"clegg": Clegg(), "plant": plant}, outputs=["u"]), times, engine=engine
    )

    def rates(t, s):
        return [s[1], -0.2 * s[1] + s[2], 1 - s[0]]

    def crossing(t, s):
        return 1 - s[0]

    crossing.terminal = True
    t, s, u = 0.0, np.zeros(3), np.full(times.size, np.nan)
    while t < times[-1]:
        part = solve_ivp(rates, (t, times[-1]), s, events=crossing, rtol=1e-12, atol=1e-14,
                         method="DOP853", dense_output=True)  # fmt: skip
        inside = (times >= t) & (times <= part.t[-1])
        u[inside] = 1 - part.sol(times[inside])[0]
        step = 1e-8  # away from the crossing, with the reset integrator
        s = part.y[:, -1] * [1, 1, 0]
        s, t = s + step * np.array(rates(t, s)), part.t[-1] + step
    np.testing.assert_allclose(found.outputs[0], u, rtol=0, atol=1e-7)


@engines
def test_integrate_and_fire_at_a_guard_of_the_state(engine):
    """x' = 1 until 1: a saw, of which the value at a jump is that after it."""
    saw = made(
        states=("x",), update=lambda t, x, u, p: np.ones(1), guard=lambda t, x, u, p: 1 - x,
        reset=lambda t, x, u, p: x - 1,
    ).spec  # fmt: skip
    times = np.linspace(0, 4.9, 50) + 0.03
    found = run(nlctl.block(saw(), "saw"), np.r_[0, times], engine=engine)
    np.testing.assert_allclose(found.outputs[0, 1:], times % 1, rtol=0, atol=1e-9)


@engines
@pytest.mark.parametrize("depth", [1e-2, 1e-4, 1e-6])
def test_a_guard_that_falls_and_rises_within_a_step(engine, depth):
    """(t - 1)^2 - depth, as a state: it counts once, however short it is below 0."""
    counter = made(
        states=("s", "count"), initial={"s": 1.0 - depth},
        update=lambda t, x, u, p: np.array([2 * (t - 1), 0.0]),
        guard=lambda t, x, u, p: x[:1], reset=lambda t, x, u, p: np.array([x[0], x[1] + 1]),
    ).spec  # fmt: skip
    found = run(nlctl.block(counter(), "counter"), [0.0, 2.0], engine=engine)
    assert found.outputs[1, -1] == 1


def test_a_guard_that_rises_where_another_block_jumps_may_fall_again():
    """The first jumps at t = 1; the guard of the second, below 0, rises for another 0.1 ms."""
    first = made(
        states=("a",), initial={"a": 1.0}, update=lambda t, x, u, p: -np.ones(1),
        guard=lambda t, x, u, p: x, reset=lambda t, x, u, p: x + 10.0,
    ).spec  # fmt: skip
    second = made(
        states=("b",), update=lambda t, x, u, p: 0 * x,
        guard=lambda t, x, u, p: np.array([-0.5 - (t - 1.0001) ** 2]),
        reset=lambda t, x, u, p: x + 1.0,
    ).spec  # fmt: skip
    loop = nlctl.interconnect({"first": first(), "second": second()}, outputs=["a", "b"])
    found = run(loop, [0.0, 0.9, 1.7, 2.4])
    np.testing.assert_allclose(found.outputs, [[1, 0.1, 9.3, 8.6], [0, 0, 0, 0]], atol=1e-9)


@nlctl.record
class Swap:
    """Takes over its input at t = 1."""

    start: float = 0.0
    inputs, outputs, states, feedthrough = ("other",), ("x",), ("x",), False

    @property
    def initial(self):
        return {"x": self.start}

    update = staticmethod(lambda t, x, u, p: (0.0,))
    output = staticmethod(lambda t, x, u, p: (x[0],))
    guard = staticmethod(lambda t, x, u, p: (1.0 - t,))
    reset = staticmethod(lambda t, x, u, p: (u[0],))


@engines
def test_blocks_that_jump_at_one_instant_jump_from_the_values_before(engine):
    one, two = nlctl.block(Swap(start=1.0), "one"), nlctl.block(Swap(start=2.0), "two")
    loop = ct.interconnect(
        [one, two], [["one.other", "two.x"], ["two.other", "one.x"]], inplist=[],
        outlist=["one.x", "two.x"], outputs=["a", "b"],
    )  # fmt: skip
    found = run(loop, [0.0, 0.5, 1.5], engine=engine)
    np.testing.assert_array_equal(found.outputs, [[1, 1, 2], [2, 2, 1]])


@engines
def test_a_guard_that_falls_by_a_jump_jumps_next_at_the_same_instant(engine):
    """The first goes from 1 to -1 at t = 1; the second counts where it is negative."""
    first = made(
        states=("a",), initial={"a": 1.0}, update=lambda t, x, u, p: 0 * x,
        guard=lambda t, x, u, p: np.array([1.0 - t]), reset=lambda t, x, u, p: -x,
    ).spec  # fmt: skip
    second = made(
        states=("b",), inputs=("a",), update=lambda t, x, u, p: 0 * x,
        guard=lambda t, x, u, p: u, reset=lambda t, x, u, p: x + t,
    ).spec  # fmt: skip
    loop = nlctl.interconnect({"second": second(), "first": first()}, outputs=["a", "b"])
    found = run(loop, [0.0, 0.9, 1.1, 2.0], engine=engine)
    np.testing.assert_allclose(found.outputs, [[1, 1, -1, -1], [0, 0, 1, 1]], atol=1e-12)


def test_a_relay_and_its_integral():
    """u = 2 sin t with thresholds of +-1: it switches at pi / 6 + k pi."""
    loop = nlctl.interconnect(
        {
            "source": source(lambda t: 2 * np.sin(t)),
            "relay": nlctl.Relay(),
            "plant": ct.ss(0, 1, 1, 0, inputs="v", outputs="z", name="plant"),
        },
        outputs=["v", "z"],
    )
    times = np.linspace(0, 12, 61)
    switches = np.pi / 6 + np.pi * np.arange(5)
    side = -1 + 2 * (np.searchsorted(switches, times) % 2)
    ends = np.r_[0, switches]
    z = [
        sum((-1.0) ** (k + 1) * (min(t, b) - a) for k, (a, b) in enumerate(
            zip(ends, np.r_[switches, np.inf], strict=True)) if a < t)
        for t in times
    ]  # fmt: skip
    found = run(loop, times)
    np.testing.assert_array_equal(found.outputs[0], side)
    np.testing.assert_allclose(found.outputs[1], z, rtol=0, atol=1e-9)


waves = st.tuples(st.floats(0.5, 2), st.floats(0.3, 3), st.floats(0, 1), st.floats(3, 9))


@pytest.mark.slow
@given(wave=waves)
@settings(max_examples=many(10, part=3), deadline=None)
def test_a_play_is_exact(wave):
    """Against clipping at all turning points of u, and behind a corner of an input."""
    a, w, b, f = wave

    def u(t):
        return a * np.sin(w * t) + b * np.sin(f * t)

    fine = np.linspace(0, 6, 60_001)
    memory, wanted = 0.0, []
    for k, value in enumerate(u(fine)):
        memory = min(max(memory, value - 0.4), value + 0.3)
        if k % 1000 == 0:
            wanted.append(memory)
    play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.4, c_l=-0.3)
    loop = nlctl.interconnect({"source": source(u), "play": play}, outputs=["v"])
    found = run(loop, fine[::1000])
    reach = (a * w**2 + b * f**2) * 1e-4**2 / 8  # what the fine samples miss at a turning point
    np.testing.assert_allclose(found.outputs[0], wanted, rtol=0, atol=2 * reach + 1e-12)


@engines
def test_the_last_sample_of_a_clock_is_the_new_value(engine):
    """A counter: the outputs at the last instant are those after it; a run that resumes from its
    state takes that sample."""
    count = ct.nlsys(
        lambda t, x, u, p: [x[0] + 1], lambda t, x, u, p: [x[0] + 1], states=1, inputs=0,
        outputs=["y"], dt=1.0, name="count",
    )  # fmt: skip
    times = np.arange(8.0)
    found = run(
        nlctl.interconnect({"c": nlctl.sampled(count, 1.0)}, outputs=["y"]), times, engine=engine
    )
    plain = ct.input_output_response(count, times, 0, 0)
    np.testing.assert_array_equal(found.outputs[0], np.ravel(plain.outputs))
    np.testing.assert_array_equal(found.states, np.minimum(times + 1, 7) * np.ones((2, 1)))


def traced(system, times, start, stops=(), crossings=None):
    """A run with what is known of the conditions in the equations."""
    arguments = nlctl.responses.arguments.RunArguments(
        system=system, times=np.asarray(times, dtype=float), inputs=0.0, initial_state=start,
        evaluation_times="T", params=None, progress=None, ignore_errors=False, audit=False, form={},
        solver=TIGHT | {"method": None, "solve_ivp_method": None, "solve_ivp_kwargs": {},
                        "max_step": None},
    )  # fmt: skip
    labels = () if crossings is None else (("loop", "gt"),)
    changed = np.array(stops, dtype=float)
    known = Known(
        stops=np.array([np.nextafter(changed, -np.inf), changed]),
        crossings=crossings,
        labels=labels,
    )
    return python_control_response(arguments, lambda *_: known)


def test_stops_at_conditions_of_time():
    """A duty cycle of 0.3 over 10 s: its integral is 3, and its slope jumps nowhere else."""
    pulses = ct.nlsys(lambda t, x, u, p: [1.0 if t % 0.1 < 0.03 else 0.0], None, states=1,
                      inputs=0, outputs=1, name="pulses")  # fmt: skip
    known = np.sort(np.r_[np.arange(1, 100) / 10, np.arange(100) / 10 + 0.03])
    found = traced(pulses, [0, 10.0], [0.0], stops=known)
    assert float(found.states[0, -1]) == pytest.approx(3.0, abs=1e-9)


def test_crossings_of_conditions_of_the_state():
    """|x| < 0.001 of an oscillator: four times in two turns, 2 asin(0.001) long."""
    window = ct.nlsys(
        lambda t, x, u, p: [x[1], -x[0], np.where(abs(x[0]) < 1e-3, 1.0, 0.0)], None, states=3,
        inputs=0, outputs=3, name="window",
    )  # fmt: skip
    found = traced(window, [0, 4 * np.pi], [1.0, 0.0, 0.0],
                   crossings=lambda t, x, u: [abs(x[0]) - 1e-3])  # fmt: skip
    assert float(found.states[2, -1]) == pytest.approx(8 * np.arcsin(1e-3), abs=1e-9)


def test_a_pulse_from_rest_is_seen():
    """Of a 500th of the run, known to nobody, between two output samples."""
    lag = ct.nlsys(lambda t, x, u, p: [-x[0], 1.0 * (31.0 < t < 31.2)], None, states=2, inputs=0,
                   outputs=2, name="lag")  # fmt: skip
    found = run(lag, [0, 100.0], 0, [0.0, 0.0])
    assert found.states[1, -1] == pytest.approx(0.2, abs=1e-7)


def test_max_step_bounds_the_steps():
    seen = []
    lag = ct.ss(-1, 1, 1, 0, name="lag")
    run(lag, [0.0, 1.0], 1.0, max_step=0.01, progress=seen.append)
    assert max(np.diff([0.0, *seen])) <= 0.01 * (1 + 1e-9)
    with pytest.raises(nlctl.errors.ParameterError, match="finite max_step > 0, got -1"):
        run(lag, [0.0, 1.0], max_step=-1)
    with pytest.raises(nlctl.errors.ParameterError, match="'max_step' is given twice"):
        run(lag, [0.0, 1.0], max_step=0.1, solve_ivp_kwargs={"max_step": 0.1})


def test_wrong_resets_and_guards_are_refused_by_name():
    common = {"states": ("x",), "update": lambda t, x, u, p: -np.ones(1)}
    short = made(**common, guard=lambda t, x, u, p: x + 0.5,
                 reset=lambda t, x, u, p: np.zeros(2)).spec  # fmt: skip
    with pytest.raises(
        nlctl.errors.BlockError, match=r"block 'one'\) returns 2 values from reset, needs 1"
    ):
        run(nlctl.block(short(), "one"), [0.0, 1.0])
    nan = made(**common, guard=lambda t, x, u, p: x * np.nan, reset=lambda t, x, u, p: x).spec
    with pytest.raises(
        nlctl.errors.DivergedError, match="block 'one' has a guard that is NaN at t = 0 s"
    ):
        run(nlctl.block(nan(), "one"), [0.0, 1.0])
    clocked = made(**common, guard=lambda t, x, u, p: x, reset=lambda t, x, u, p: x).spec
    with pytest.raises(nlctl.errors.UsageError, match="block 'one' has a guard, which falls in"):
        nlctl.sampled(nlctl.block(clocked(), "one"), 0.1, method="euler")


@pytest.mark.parametrize("how", [{"engine": "python-control"}, {"method": "tsit5"}])
def test_a_ball_that_lies_on_the_ground_has_no_end_of_bounces(how):
    """It hops as far as rounding lets it, and no time passes."""
    ball = nlctl.block(Landed(), "ball")
    with pytest.raises(nlctl.errors.ZenoError) as caught:
        nlctl.input_output_response(ball, [0, 10], 0, [0.0, 0.0], **how)
    assert abs(caught.value.time) < 1e-9
