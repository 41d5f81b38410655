"""Conditions that are exactly 0: where a run begins, by rounding within it, and where it ends."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

METHODS = ("tsit5", "rodas5p", "taylor")
HOW = [
    *({"engine": "native", "method": m, "rtol": r, "atol": r} for m in METHODS
      for r in (1e-6, 1e-11)),
    {"engine": "python-control", "rtol": 1e-9, "atol": 1e-11},
]  # fmt: skip
how = pytest.mark.parametrize("how", HOW, ids=lambda how: "-".join(map(str, how.values())))


def swing():
    """A harmonic oscillator."""
    return ct.nlsys(lambda t, x, u, p: [x[1], -x[0]], None, inputs=0, outputs=2, states=2,
                    name="swing")  # fmt: skip


def position(t, x, u, params):
    return x[0]


@pytest.mark.parted
@how
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_what_begins_at_0_and_leaves_it_is_an_event(how, way):
    """x = +- sin t: it is 0 at the start, and leaves it."""
    made = nlctl.input_output_response(swing(), [0, 8], 0, [0, way], events={"x": position}, **how)
    np.testing.assert_allclose(made.events["time"], np.pi * np.arange(3), rtol=0, atol=1e-5)
    wanted = ["rising", "falling", "rising"] if way > 0 else ["falling", "rising", "falling"]
    assert made.events["direction"].tolist() == wanted


@how
def test_a_condition_of_the_equations_that_begins_at_0(how):
    """1 where x = sin t > 0, otherwise 2, up to t = 4: pi + 2 (4 - pi)."""
    loop = ct.nlsys(
        lambda t, x, u, p: [x[1], -x[0], np.where(x[0] > 0, 1.0, 2.0)], None, inputs=0, outputs=3,
        states=3, name="loop",
    )  # fmt: skip
    made = nlctl.input_output_response(loop, [0, 4], 0, [0, 1, 0], **how)
    assert made.states[2, -1] == pytest.approx(8 - np.pi, abs=1e-5 if how["rtol"] > 1e-7 else 1e-8)
    np.testing.assert_allclose(made.events["time"], [0, np.pi], rtol=0, atol=1e-5)


@how
def test_a_run_does_not_end_where_it_begins(how):
    made = nlctl.input_output_response(swing(), [0, 8], 0, [0, 1], stop_when=position, **how)
    assert made.time[-1] == pytest.approx(np.pi, abs=1e-5)
    assert made.events["which"].tolist() == ["stop_when"]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("rtol", [1e-9, 1e-10, 1e-11])
def test_a_level_that_steps_end_at_by_rounding_is_crossed(method, rtol):
    """1 - cos t = 1e-6: steps that end close enough are at 0 by rounding, and so is the next."""
    made = nlctl.input_output_response(
        swing(), [0, 1], 0, [1, 0], events={"high": lambda t, x, u, p: x[0] - (1 - 1e-6)},
        engine="native", method=method, rtol=rtol, atol=rtol / 100,
    )  # fmt: skip
    assert made.events["direction"].tolist() == ["falling"]
    assert made.events["time"][0] == pytest.approx(np.arccos(1 - 1e-6), abs=1e-9)


@nlctl.record
class Room:
    """A room that cools down to 16.5, and is at 17 at once."""

    inputs, outputs, states, feedthrough = (), ("h",), ("h",), False
    initial = {"h": 16.5}
    update = staticmethod(nlctl.equation(lambda t, x, u, p: (10.0 - x[0],)))
    output = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0],)))
    guard = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0] - 16.5,)))
    reset = staticmethod(nlctl.equation(lambda t, x, u, p: (17.0,)))


@how
@pytest.mark.parametrize("begin", [0.0, 100.0])
def test_a_guard_that_begins_at_0_falls_at_once(how, begin):
    """What the shortest steps add to a state of 16.5 is lost in rounding."""
    room = nlctl.block(Room(), "room")
    run = nlctl.input_output_response(room, [begin, begin + 0.2], **how)
    falls = begin + np.log(7 / 6.5) * np.arange(3)
    np.testing.assert_allclose(run.events["time"], falls, rtol=0, atol=1e-5)


@nlctl.record
class Bouncer:
    """A ball that leaves the ground, which is at 16.5, as fast as it has come."""

    inputs, outputs, states, feedthrough = (), ("h", "v"), ("h", "v"), False
    initial = {"h": 16.5, "v": 1.0}
    update = staticmethod(nlctl.equation(lambda t, x, u, p: (x[1], -1.0)))
    output = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0], x[1])))
    guard = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0] - 16.5,)))
    reset = staticmethod(nlctl.equation(lambda t, x, u, p: (16.5, -x[1])))


@how
def test_a_guard_that_begins_at_0_may_rise_and_fall_later(how):
    """The ball is back after 2 s each time."""
    run = nlctl.input_output_response(nlctl.block(Bouncer(), "ball"), [0, 7], **how)
    np.testing.assert_allclose(run.events["time"], [2, 4, 6], rtol=0, atol=1e-5)


@how
def test_a_condition_of_time_at_the_end_of_a_run_is_seen_from_before(how):
    """It is 1 in each first half of a second, also from t = 10 s on."""
    loop = ct.nlsys(lambda t, x, u, p: [1.0 if t % 1.0 < 0.5 else 0.0], None, inputs=0, outputs=1,
                    states=1, name="loop")  # fmt: skip
    made = nlctl.input_output_response(loop, [0, 10], 0, 0, **how)
    assert made.states[0, -1] == pytest.approx(5, abs=1e-12 if how["engine"] == "native" else 1e-6)
    np.testing.assert_allclose(made.events["time"], np.arange(0.5, 10.1, 0.5), rtol=0, atol=1e-12)


@nlctl.record
class Impulses:
    """x' = -x, and 1 is added at each half of a second."""

    inputs, outputs, states, feedthrough = (), ("x",), ("x",), False
    initial = {"x": 1.0}
    update = staticmethod(nlctl.equation(lambda t, x, u, p: (-x[0],)))
    output = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0],)))
    guard = staticmethod(nlctl.equation(lambda t, x, u, p: (0.5 - t % 1.0,)))
    reset = staticmethod(nlctl.equation(lambda t, x, u, p: (x[0] + 1.0,)))


@how
def test_resets_at_given_times_are_rows_of_the_table(how):
    made = nlctl.input_output_response(nlctl.block(Impulses(), "impulses"), [0, 5.2], **how)
    resets = made.events[made.events["which"] == "guard"]
    at = np.arange(0.5, 5.0)
    np.testing.assert_allclose(resets["time"], at, rtol=0, atol=1e-8)
    assert set(resets["block"]) == {"impulses"}
    wanted = np.exp(-5.2) + np.exp(at - 5.2).sum()
    assert made.outputs.ravel()[-1] == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parted
@how
@pytest.mark.parametrize("width", [0.05, 0.005])
def test_a_pulse_of_a_ten_thousandth_of_the_run(how, width):
    """5 exp(-((t - 51.37) / width)^2), from rest: 5 width sqrt(pi)."""
    loop = ct.nlsys(
        lambda t, x, u, p: [5 * np.exp(-(((t - 51.37) / width) ** 2))], None, inputs=0, outputs=1,
        states=1, name="loop",
    )  # fmt: skip
    made = nlctl.input_output_response(loop, [0, 100], 0, 0, **how)
    assert made.states[0, -1] == pytest.approx(5 * width * np.sqrt(np.pi), rel=1e-4)


def with_dropout(law):
    """sin t through a law into a lag; the signal drops out from 1 s to 2.5 s."""
    blocks = {
        "source": ct.nlsys(None, lambda t, x, u, p: [np.sin(t)], inputs=0, outputs=["s"],
                           name="source"),
        "law": ct.nlsys(None, law, inputs=["s"], outputs=["u"], name="law"),
        "plant": ct.ss(-1.0, 1.0, 1.0, 0.0, inputs="u", outputs="y", name="plant"),
    }  # fmt: skip
    fault = nlctl.Fault("source.s", "dropout", at=1.0, until=2.5)
    return nlctl.with_faults(nlctl.interconnect(blocks, outputs=["y"]), fault)


def declared(made):
    """Times of the switching functions that the fault declares."""
    return made.events["time"][made.events["block"].str.startswith("fault")].to_numpy()


@pytest.mark.parted
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("step", [0.25, 0.1])
def test_steps_that_end_at_a_declared_break_point_note_it(method, step):
    loop = with_dropout(lambda t, x, u, p: [u[0]])
    made = nlctl.input_output_response(loop, [0, 4], 0, 0, method=method, step=step)
    np.testing.assert_allclose(declared(made), [1.0, 2.5], rtol=0, atol=1e-9)


@pytest.mark.parted
@how
def test_a_break_point_at_which_a_condition_jumps_is_noted_as_well(how):
    """The input of both conditions jumps where the signal is back: 0.6 instead of 0."""
    loop = with_dropout(lambda t, x, u, p: [np.where(u[0] * (u[0] + 0.3) > 0.2, 1.0, -0.1)])
    made = nlctl.input_output_response(loop, [0, 4], 0, 0, **how)
    np.testing.assert_allclose(declared(made), [1.0, 2.5], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("how", "off"),
    crossed([how for how in HOW if how.get("method") != "taylor"], [1e-300, 1.2e-308, 5e-324]),
)
def test_a_level_whose_product_with_a_value_is_rounded_to_zero(how, off):
    """A relay that goes on where its input has come from 0: signs are compared, no product."""
    loop = nlctl.interconnect(
        {"relay": nlctl.Relay(on=1.0, off=off, height=1.0, v0=-1.0)}, inputs="u", outputs="v"
    )
    run = nlctl.input_output_response(loop, [0.0, 1.0, 2.0], [-1.5, 0.0, 2.0], **how)
    np.testing.assert_array_equal(run.outputs, [-1.0, -1.0, 1.0])
    np.testing.assert_allclose(run.events["time"], [1.0, 1.5], atol=10 * how["rtol"])


@how
@pytest.mark.parametrize("level", [0.0, 1e-308, 5e-324, -1e-308])
def test_a_condition_around_a_level_that_small(how, level):
    """x' = 1 before and 3 behind it, from -1 on: it is there at t = 1."""
    system = ct.nlsys(
        lambda t, x, u, p: [np.where(x[0] > p["level"], 3.0, 1.0)], inputs=0, outputs=1, states=1,
        params={"level": level}, name="bent",
    )  # fmt: skip
    run = nlctl.input_output_response(system, [0.0, 2.0], 0, [-1.0], squeeze=False, **how)
    np.testing.assert_allclose(run.outputs[0], [-1.0, 3.0], atol=3 * how["rtol"])
