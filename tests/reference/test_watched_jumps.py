"""Event functions of what does not flow: jumps through exactly 0, and memories within a step."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

WAYS = {
    "tsit5": {"method": "tsit5"},
    "rodas5p": {"method": "rodas5p"},
    "taylor": {"method": "taylor"},
    "python-control": {"engine": "python-control"},
}
ways = pytest.mark.parametrize("how", WAYS.values(), ids=WAYS)


@nlctl.record
class Counter:
    """n counts the half seconds."""

    inputs, outputs, states, feedthrough = (), ("n",), ("n",), False

    @nlctl.equation
    def update(t, x, u, p):
        return (0.0 * x[0],)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @nlctl.equation
    def guard(t, x, u, p):
        return (0.5 - t % 1.0,)

    @nlctl.equation
    def reset(t, x, u, p):
        return (x[0] + 1.0,)


def at_rest():
    return ct.nlsys(lambda t, x, u, p: [0.0 * x[0]], None, states=1, inputs=0, outputs=1, name="s")


def sampled_counter():
    """1 from 0 s on, 2 from 0.5 s on and so on; the second state is what is held."""
    count = ct.nlsys(lambda t, x, u, p: [x[0] + 1], lambda t, x, u, p: [x[0]], states=1, inputs=0,
                     outputs=["n"], dt=0.5, name="count")  # fmt: skip
    lag = ct.ss(-1, 1, 1, 0, inputs="n", outputs="y", name="lag")
    return nlctl.interconnect({"count": nlctl.sampled(count), "lag": lag}, outputs=["y"])


def lag():
    return ct.ss(-1, 1, 1, 0, name="lag")


HELD = np.array([-2.0, -1.0, 0.0, 0.0, 1.0, 1.0])
THROUGH_ZERO = {  # a loop, its inputs, a function that is -1, then 0, then 1, and when it is that
    "steps of t": (at_rest, 0, lambda t, x, u, p: np.where(t < 1, -1, np.where(t < 2, 0, 1)), 2.0),
    "floor": (at_rest, 0, lambda t, x, u, p: np.floor(t) - 3, 4.0),
    "sample": (sampled_counter, 0, lambda t, x, u, p: x[0] - 3, 1.5),
    "reset": (lambda: nlctl.block(Counter(), "counter"), 0, lambda t, x, u, p: x[0] - 2, 2.5),
    "input": (lag, HELD, lambda t, x, u, p: u[0], 4.0),
}
through_zero = pytest.mark.parametrize(
    ("loop", "inputs", "function", "time"), THROUGH_ZERO.values(), ids=THROUGH_ZERO
)


@pytest.mark.parted
@ways
@through_zero
def test_what_jumps_to_0_is_an_event_where_it_jumps_on(loop, inputs, function, time, how):
    made = nlctl.input_output_response(
        loop(), np.arange(6.0), inputs, 0, events={"e": function}, hold="zoh", **how
    )
    rows = made.events[made.events["which"] == "e"]
    np.testing.assert_allclose(rows["time"], [time], rtol=0, atol=1e-9)
    assert rows["direction"].tolist() == ["rising"]


@pytest.mark.parted
@ways
@through_zero
def test_a_run_ends_where_its_function_jumps_on_from_0(loop, inputs, function, time, how):
    made = nlctl.input_output_response(
        loop(), np.arange(6.0), inputs, 0, stop_when=function, hold="zoh", **how
    )
    assert made.time[-1] == pytest.approx(time, abs=1e-9)


@ways
def test_what_jumps_back_from_0_is_no_event_and_what_begins_there_ends_no_run(how):
    def dips(t, x, u, params):
        return np.where((t >= 1) & (t < 2), 0.0, -1.0)

    def begins(t, x, u, params):
        return np.where(t < 1, 0.0, 1.0)

    made = nlctl.input_output_response(at_rest(), [0, 3], 0, 0, events={"dips": dips}, **how)
    assert "dips" not in made.events["which"].tolist()
    made = nlctl.input_output_response(
        at_rest(), [0, 3], 0, 0, stop_when=begins, events={"begins": begins}, **how
    )
    assert made.time[-1] == 3.0
    assert made.events.set_index("which").loc["begins", "time"] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("how", "level"),
    crossed([WAYS[n] for n in ("tsit5", "rodas5p", "python-control")], [0.0, 0.3, -0.79]),
)
def test_a_memory_is_what_it_has_become_within_a_step(level, how):
    """A play of 0.2 behind cos t: cos t + 0.2 until pi, cos t - 0.2 until 2 pi."""
    source = ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], lambda t, x, u, p: x[0], states=2,
                      inputs=0, outputs=["u"], name="source")  # fmt: skip
    play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.2, c_l=-0.2)
    loop = nlctl.interconnect({"source": source, "play": play}, outputs=["v"])
    start = {"source.x[0]": 1.0, "source.x[1]": 0.0, "play.memory": 0.8}
    made = nlctl.input_output_response(
        loop, [0, 6], 0, start, rtol=1e-10, atol=1e-12,
        events={"e": lambda t, x, u, p: x[2] - level}, **how,
    )  # fmt: skip
    rows = made.events[made.events["which"] == "e"]
    exact = [np.arccos(level - 0.2), 2 * np.pi - np.arccos(level + 0.2)]
    np.testing.assert_allclose(rows["time"], exact, rtol=0, atol=1e-7)
    assert rows["direction"].tolist() == ["falling", "rising"]


@pytest.mark.parametrize("how", [WAYS[n] for n in ("tsit5", "rodas5p", "python-control")])
def test_memories_that_memories_move_jump_at_one_instant(how):
    """sin t is caught where it passes 1/2, at pi / 6; watching that changes nothing."""
    source = ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], lambda t, x, u, p: x[0], states=2,
                      inputs=0, outputs=["r"], name="source")  # fmt: skip
    lag = ct.ss(-1, 1, 1, 0, inputs="r", outputs="y", name="lag")
    loop = nlctl.interconnect({"source": source, "lag": lag}, outputs=["r"])
    stuck = nlctl.with_faults(loop, nlctl.Fault("source.r", "stuck", when="source.r > 0.5"))
    held, on, since = (
        next(i for i, name in enumerate(stuck.state_labels) if name.endswith(end))
        for end in ("_held", "_on", "_since")
    )
    watched = {
        "held": lambda t, x, u, p: x[held] - 0.25,
        "on": lambda t, x, u, p: x[on] - 0.5,
        "since": lambda t, x, u, p: x[since] - 0.1,
        "later": lambda t, x, u, p: np.where(x[on] > 0.5, t - x[since] - 1.0, -1.0),
    }
    start = {"source.x[0]": 0.0, "source.x[1]": 1.0}
    made = nlctl.input_output_response(
        stuck, [0, 2], 0, start, events=watched, rtol=1e-10, atol=1e-12, **how
    )
    times = made.events.set_index("which")["time"]
    for name in ("held", "on", "since"):
        assert times[name] == pytest.approx(np.pi / 6, abs=1e-8)
    assert times["later"] == pytest.approx(np.pi / 6 + 1, abs=1e-8)
    assert made.states[since, -1] == pytest.approx(np.pi / 6, abs=1e-8)
    assert made.states[held, -1] == pytest.approx(0.5, abs=1e-8)
