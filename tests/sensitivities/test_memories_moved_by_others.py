"""Memories that others move where a run begins, and what jumps while a memory is driven."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Tank
from examples import crossed

import nlctl

Q, E, C, X = 1.0, 0.5, 0.3, 0.7  # rate, height of the relay's part, half a gap, x(0)


def ramp():
    """x' = q, so x = x(0) + q t."""
    return ct.nlsys(
        lambda t, x, u, p: [p["q"]], lambda t, x, u, p: x, inputs=0, outputs=["x"], states=["x"],
        params={"q": Q}, name="ramp",
    )  # fmt: skip


def gap(width):
    """A play between -width and width."""
    return nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=width, c_l=-width)


def behind_relay(e, width):
    """v is the play of x - e r, in which r switches at once from -1 to 1."""
    mixed = ct.nlsys(
        None, lambda t, x, u, p: [u[0] - p["e"] * u[1]], inputs=["x", "r"], outputs=["w"],
        params={"e": e}, name="mixed",
    )  # fmt: skip
    relay = nlctl.block(nlctl.Relay(on=0.4, off=-0.5), "relay", inputs=["x"], outputs=["r"])
    blocks = [ramp(), mixed, relay, nlctl.block(gap(width), "gap", inputs=["w"], outputs=["v"])]
    return ct.interconnect(blocks, inputs=[], outputs=["v"], name="loop")


BY = ("ramp.x(0)", "mixed.e", "gap.c_r", "gap.c_l")
# by the relay as it was v = x + e - c_r; behind that at most x - e - c_l, and x + q t - e - c_r
STARTS = {
    "both move it": (E, C, X - E + C, [1, -1, 0, -1]),
    "the first moves it": (C, E, X + C - E, [1, 1, -1, 0]),
}


@pytest.mark.parametrize(("method", "start"), crossed(["auto", "taylor", "rodas5p"], [*STARTS]))
def test_play_behind_a_relay_that_switches_at_the_start(start, method):
    """v stands where the relay has moved it to until x, with the relay on, moves it on."""
    e, width, v, slopes = STARTS[start]
    later = 2 * min(e, width) / Q  # from here on it is moved by x
    times = np.array([0.0, 0.5 * later, later + 0.5])
    made = nlctl.sensitivity_response(
        behind_relay(e, width), times, initial_state={"ramp.x": X}, with_respect_to=BY,
        method=method,
    )  # fmt: skip
    assert not made.missing
    assert made.values[0] == pytest.approx([v, v, X + Q * times[-1] - e - width])
    for name, first, last in zip(BY, slopes, [1, -1, -1, 0], strict=True):
        assert made["v", name] == pytest.approx([first, first, last], abs=1e-9)


def test_play_behind_a_relay_that_is_on_at_the_start():
    """Nothing switches: v = x - e - c_r at once."""
    made = nlctl.sensitivity_response(
        behind_relay(E, C), [0, 0.5], with_respect_to=BY,
        initial_state={"ramp.x": X, "relay.side": 1.0, "gap.memory": -2.0},
    )  # fmt: skip
    for name, slope in zip(BY, [1, -1, -1, 0], strict=True):
        assert made["v", name] == pytest.approx([slope, slope], abs=1e-9)


@pytest.mark.parted
@pytest.mark.parametrize(
    ("f", "v", "slopes"),
    [
        # the second pushes it further: x - e - f - c_l
        (0.2, X - E - 0.2 + C, [1, -1, -1, 0, -1]),
        # or back by less than the gap: it stays at x - e + f - c_l
        (-0.1, X - E - 0.1 + C, [1, -1, 1, 0, -1]),
    ],
)
def test_play_behind_two_relays_of_which_one_makes_the_other_switch(f, v, slopes):
    """x - e r - f s, and s switches as r has: the play is moved three times at the start."""
    mixed = ct.nlsys(
        None, lambda t, x, u, p: [u[0] - p["e"] * u[1] - p["f"] * u[2]], inputs=["x", "r", "s"],
        outputs=["w"], params={"e": E, "f": f}, name="mixed",
    )  # fmt: skip
    relays = [
        nlctl.block(nlctl.Relay(on=0.4, off=-0.5), name, inputs=[u], outputs=[y])
        for name, u, y in (("one", "x", "r"), ("two", "r", "s"))
    ]
    blocks = [ramp(), mixed, *relays, nlctl.block(gap(C), "gap", inputs=["w"], outputs=["v"])]
    loop = ct.interconnect(blocks, inputs=[], outputs=["v"], name="loop")
    by = ["ramp.x(0)", "mixed.e", "mixed.f", "gap.c_r", "gap.c_l"]
    made = nlctl.sensitivity_response(
        loop, [0, 0.1], initial_state={"ramp.x": X}, with_respect_to=by
    )
    assert not made.missing
    assert made.values[0] == pytest.approx([v, v])
    for name, slope in zip(by, slopes, strict=True):
        assert made["v", name] == pytest.approx([slope, slope], abs=1e-9)


def test_an_end_that_the_relay_moves_to_a_play_has_two_derivatives():
    """With e = c the play stands right at x - e - c_l as it has been moved to x + e - c_r."""
    loop = behind_relay(0.25, 0.25)
    made = nlctl.sensitivity_response(
        loop, [0, 0.1], initial_state={"ramp.x": 0.75}, with_respect_to=["mixed.e", "ramp.x(0)"]
    )
    (lack,) = made.missing
    assert (lack.time, lack.with_respect_to) == (0.0, ("mixed.e",))
    assert made["v", "ramp.x(0)"] == pytest.approx([1, 1])


# -- a play behind samples at events ---------------------------------------------------------------


D, B, OMEGA, WIDTH = 0.5, 1.0, 2.0, 0.2


def held_loop():
    """x' = q, sampled whenever it has gone by d: v is the play of w + b sin(2 t), y' = v."""
    rule = ct.nlsys(
        None, lambda t, x, u, p: [p["d"] - u[0] + u[1], u[1] + p["b"] * np.sin(OMEGA * t)],
        inputs=["x", "w"], outputs=["trigger", "z"], params={"d": D, "b": B}, name="rule",
    )  # fmt: skip
    hold = nlctl.block(
        nlctl.TriggeredHold(n=1), "hold", inputs=["x", "trigger"], outputs=["w", "interval"]
    )
    integral = ct.nlsys(
        lambda t, x, u, p: u, lambda t, x, u, p: x, inputs=["v"], outputs=["y"], states=["y"],
        name="integral",
    )  # fmt: skip
    play = nlctl.block(gap(WIDTH), "gap", inputs=["z"], outputs=["v"])
    return ct.interconnect(
        [ramp(), rule, hold, play, integral], inputs=[], outputs=["v", "y", "interval"],
        name="loop",
    )  # fmt: skip


def held_run(d, b, q, c, t):
    """Return v and y behind the second sample, while v stands where that has moved it to."""
    # v rises from b sin = c on, jumps by d at d / q, rises on to the crest, and stands there until
    # the next sample moves it, behind which b sin falls
    one, two, touch, crest = d / q, 2 * d / q, np.arcsin(c / b) / OMEGA, np.pi / 2 / OMEGA
    last = 2 * d + b * np.sin(OMEGA * two) - c
    arc = b * np.cos(OMEGA * touch) / OMEGA - c * (crest - touch) + d * (crest - one)
    return last, arc + (d + b - c) * (two - crest) + last * (t - two)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["auto", "taylor", "rodas5p"])
def test_play_that_turns_between_samples_at_events(method):
    """A play that is driven before and behind a sample turns, and is moved by the next."""
    given = {"rule.d": D, "rule.b": B, "ramp.q": Q, "gap.c_r": WIDTH}
    times, h = np.array([0.0, 0.7, 0.9, 1.2]), 1e-5
    made = nlctl.sensitivity_response(
        held_loop(), times, of=["v", "y"], with_respect_to=list(given), method=method,
        rtol=1e-9, atol=1e-11,
    )  # fmt: skip
    assert not made.missing
    assert made.values[:, -1] == pytest.approx(held_run(*given.values(), times[-1]), rel=1e-7)
    for k, name in enumerate(given):
        ends = [
            np.array(held_run(*(a + way * (i == k) for i, a in enumerate(given.values())), 1.2))
            for way in (h, -h)
        ]
        slopes = (ends[0] - ends[1]) / (2 * h)
        assert [made["v", name][-1], made["y", name][-1]] == pytest.approx(slopes, abs=1e-6)


# -- a relay that a reset switches back ------------------------------------------------------------


@nlctl.record
class TriggeredTank(Tank):
    """It is emptied where its trigger falls, whatever stands in it."""

    a: float = nlctl.param(-1.0, unit="1", meaning="level behind")

    inputs = ("trigger",)

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        return (u[0],)


@pytest.mark.parametrize("method", ["auto", "taylor", "rodas5p"])
def test_relay_whose_switching_empties_the_tank_that_switches_it_back(method):
    """h rises to on and falls to a < off at once, every (on - a) / q: h = a + q t - k (on - a)."""
    relay = nlctl.block(nlctl.Relay(on=0.6, off=-0.4), "relay", inputs=["h"], outputs=["r"])
    rule = ct.nlsys(
        None, lambda t, x, u, p: [-u[0]], inputs=["r"], outputs=["trigger"], name="rule"
    )
    loop = ct.interconnect(
        [nlctl.block(TriggeredTank(), "tank"), relay, rule], inputs=[], outputs=["h"], name="loop"
    )
    times, start = np.array([0.0, 0.3, 1.5, 3.0, 4.5, 6.0]), 0.1
    by = ["tank.a", "tank.q", "relay.on", "relay.off", "tank.h(0)"]
    made = nlctl.sensitivity_response(
        loop, times, initial_state={"tank.h": start}, with_respect_to=by, method=method
    )
    k = np.floor((start + times + 1.0) / 1.6)  # how often it has been emptied
    assert not made.missing
    assert made.values[0] == pytest.approx(start + times - 1.6 * k, abs=1e-6)
    slopes = [k, times, -k, 0 * k, 1 + 0 * k]
    for name, slope in zip(by, slopes, strict=True):
        assert made["h", name] == pytest.approx(slope, abs=1e-6)
