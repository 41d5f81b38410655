"""What a run watches and that comes to 0 and stays there: it has changed its sign."""

import control as ct
import numpy as np
import pytest

import nlctl

METHODS = [{"method": "auto"}, {"method": "rodas5p"}, {"method": "tsit5"}]
TOLERANCES = [1e-6, 1e-8, 1e-10]


def single(function, **params):
    return ct.nlsys(function, None, states=1, inputs=0, outputs=1, name="s", params=params)


def tank(t, x, u, p):
    return [-np.sqrt(max(x[0], 0.0))]


def friction(t, x, u, p):
    return [-2.0 * np.sign(x[0]) + 0.5 * np.sin(3.0 * t)]


def ramp(t, x, u, p):
    return [-1.0 if t < 1.0 else 0.0]


def speed(t, x, u, p):
    return x[0]


def cubed(t, x, u, p):
    return -3.0 * x[0] ** 3


def left(t, x, u, p):
    return max(1.0 - t, 0.0)


def above(t, x, u, p):
    return max(x[0] - 0.5, 0.0)


# 1 - 2 t + (1 - cos 3 t) / 6 = 0, and (1 - t / 2)^2 = 0
FRICTION_RESTS = 0.602995311
CASES = {
    "tank": (tank, speed, "falling", 2.0),
    "friction": (friction, speed, "falling", FRICTION_RESTS),
    "friction, the other way round": (friction, cubed, "rising", FRICTION_RESTS),
    "time that is left": (ramp, left, "falling", 1.0),
    "what is above a level": (ramp, above, "falling", 0.5),
}
cases = pytest.mark.parametrize(
    ("flow", "function", "direction", "time"), CASES.values(), ids=CASES
)


@pytest.mark.parametrize("how", METHODS, ids=lambda how: how["method"])
@pytest.mark.parametrize("rtol", TOLERANCES)
@cases
def test_it_is_an_event_once_and_may_end_the_run(flow, function, direction, time, how, rtol):
    times = np.linspace(0, 4, 7)
    run = nlctl.input_output_response(
        single(flow), times, 0, 1.0, events={"e": function}, rtol=rtol, **how
    )
    rows = run.events[run.events["which"] == "e"]
    assert rows["direction"].tolist() == [direction]
    assert rows["time"].tolist() == pytest.approx([time], abs=1e-4)
    ended = nlctl.input_output_response(
        single(flow), times, 0, 1.0, stop_when=function, rtol=rtol, **how
    )
    assert ended.time[-1] == pytest.approx(time, abs=1e-4)
    assert ended.success


@pytest.mark.parametrize("how", METHODS, ids=lambda how: how["method"])
@pytest.mark.parametrize("rtol", TOLERANCES)
def test_leaving_rest_counts_for_the_side_that_it_has_come_from(how, rtol):
    """v' = -2 sign(v) + a(t): it rests from 1/2 s on, and is pushed to either side at 2 s."""

    def pushed(t, x, u, p):
        return [-2.0 * np.sign(x[0]) + (p["push"] if t > 2.0 else 0.0)]

    for push, directions, times in ((3.0, ["falling", "rising"], [0.5, 2.0]),
                                    (-3.0, ["falling"], [0.5])):  # fmt: skip
        run = nlctl.input_output_response(
            single(pushed, push=push), [0, 4], 0, 1.0, events={"e": speed}, rtol=rtol, **how
        )
        rows = run.events[run.events["which"] == "e"]
        assert rows["direction"].tolist() == directions
        assert rows["time"].to_numpy() == pytest.approx(times, abs=1e-4)
        assert run.states[0, -1] == pytest.approx(np.sign(push) * 2.0, abs=1e-4)


@pytest.mark.parametrize("how", METHODS, ids=lambda how: how["method"])
@pytest.mark.parametrize("belt", [1e-2, 1e-5])
def test_what_slides_next_to_0_is_not_there(belt, how):
    """A mass on a belt comes to rest on it, and so never stops."""

    def carried(t, x, u, p):
        return [-2.0 * np.sign(x[0] - p["belt"]) + 0.5 * np.sin(3.0 * t)]

    run = nlctl.input_output_response(
        single(carried, belt=belt), [0, 4], 0, 1.0, stop_when=speed, **how
    )
    assert run.time[-1] == 4.0
    assert run.states[0, -1] == pytest.approx(belt, rel=1e-3)


@pytest.mark.parametrize("how", METHODS, ids=lambda how: how["method"])
def test_what_jumps_over_0_by_a_comparison_is_seen_both_ways(how):
    def either(t, x, u, p):
        return 1.0 if x[0] - 0.5 * np.sin(4.0 * t) > -0.2 else -1.0

    run = nlctl.input_output_response(
        single(lambda t, x, u, p: [-x[0]]), [0, 8], 0, 1.0, events={"e": either}, **how
    )
    t = np.linspace(0, 8, 800_001)
    signs = np.sign(np.exp(-t) - 0.5 * np.sin(4.0 * t) + 0.2)
    changes = t[1:][np.diff(signs) != 0]
    rows = run.events[run.events["which"] == "e"]
    assert rows["time"].to_numpy() == pytest.approx(changes, abs=1e-4)


@pytest.mark.parametrize("how", METHODS, ids=lambda how: how["method"])
def test_exponentials_do_not_come_to_rest(how):
    run = nlctl.input_output_response(
        single(lambda t, x, u, p: [-x[0]]), [0, 20], 0, 1.0, events={"e": speed}, **how
    )
    assert "e" not in run.events["which"].tolist()


@pytest.mark.parametrize("rtol", [1e-6, 1e-8])
def test_what_is_watched_hides_no_end_of_sliding(rtol):
    """The stiff method took a step of 1 s from rest, over 0.2 s without sliding."""

    def pulled(t, x, u, p):
        return [-2.0 * np.sign(x[0]) + 0.5 * np.sin(3.0 * t) - 0.9 * t]

    times = np.linspace(0, 2.5, 501)
    plain, watched = (
        nlctl.input_output_response(
            single(pulled), times, 0, 1.0, method="rodas5p", rtol=rtol, atol=1e-2 * rtol, events=e
        ) for e in (None, {"e": speed})
    )  # fmt: skip
    assert plain.states.min() == pytest.approx(-5.538e-4, abs=1e-6)
    assert watched.states == pytest.approx(plain.states, abs=10 * rtol)
    few = nlctl.input_output_response(
        single(pulled), [0, 6], 0, 1.0, method="rodas5p", rtol=rtol, atol=1e-2 * rtol,
        events={"e": speed},
    )  # fmt: skip
    rows = few.events[few.events["which"] == "e"]
    assert rows["direction"].tolist() == ["falling", "rising", "falling"]
    assert rows["time"].to_numpy() == pytest.approx([0.52162, 1.91224, 2.74062], abs=1e-4)
