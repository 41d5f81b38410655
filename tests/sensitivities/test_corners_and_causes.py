"""Memories that turn at corners, and relays and resets that something else makes switch."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import CORNERS, A, P, R, Tank, integral, source
from examples import crossed

import nlctl


@pytest.mark.parametrize(("method", "law"), crossed(["auto", "taylor", "rodas5p"], [*CORNERS]))
def test_play_that_turns_at_a_corner(law, method):
    """v = A - c from t = P on, wherever that is, until u has fallen by 2 c."""
    gap = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.3, c_l=-0.3)
    parts = {"source": source(CORNERS[law], {"A": A, "P": P}), "gap": gap, "integral": integral()}
    loop = nlctl.interconnect(parts, outputs=["v", "y"])
    by = ["source.A", "source.P", "gap.c_r", "gap.c_l"]
    made = nlctl.sensitivity_response(
        loop, [0, 0.9, 1.2, 1.5], initial_state={"gap.memory": -0.1}, with_respect_to=by,
        method=method,
    )  # fmt: skip
    assert not made.missing
    assert made.values[0] == pytest.approx([A - P - 0.3, A - 0.3, A - 0.3, A - 0.8 + 0.3])
    slopes = [[1, 1, 1], [0, 0, 1], [-1, -1, 0], [0, 0, -1]]
    for name, expected in zip(by, slopes, strict=True):
        assert made["v", name][1:] == pytest.approx(expected, abs=1e-7)
    # y' by P is -1 while v is driven, then 0
    assert made["y", "source.P"][2] - made["y", "source.P"][1] == pytest.approx(0, abs=1e-7)
    assert made["y", "source.A"][2] - made["y", "source.A"][1] == pytest.approx(0.3, abs=1e-7)


JUMPS = {
    "of t": (lambda t, x, u, p: [np.where(t > p["P"], p["h"], -p["h"])], None),
    "of a state": (lambda t, x, u, p: [np.where(x[0] > p["P"], p["h"], -p["h"])], "R"),
}


@pytest.mark.parted
@pytest.mark.parametrize("kind", JUMPS)
@pytest.mark.parametrize("actuator", ["relay", "Preisach"])
def test_what_switches_as_its_input_jumps(actuator, kind):
    """y' = -1 up to T and 1 behind it, however far the input jumps: y = t - 2 T."""
    law, rate = JUMPS[kind]
    relay = {"relay": nlctl.Relay(on=0.4, off=-0.5), "Preisach": nlctl.actuators.Preisach()}
    parts = {"source": source(law, {"P": P, "h": 2.0, "R": R}, rate), "act": relay[actuator]}
    loop = nlctl.interconnect(parts | {"integral": integral()}, outputs=["y"])
    by = ["source.P", "source.h", "source.R"]
    made = nlctl.sensitivity_response(loop, [0, 0.3, 1.0], with_respect_to=by)
    T, over = (P, 1.0) if rate is None else (P / R, R)
    assert not made.missing
    assert made.values[0, -1] == pytest.approx(1 - 2 * T)
    assert made["y", "source.P"] == pytest.approx([0, 0, -2 / over], abs=1e-8)
    assert made["y", "source.h"] == pytest.approx([0, 0, 0], abs=1e-8)
    by_rate = 0.0 if rate is None else 2 * P / R**2
    assert made["y", "source.R"] == pytest.approx([0, 0, by_rate], abs=1e-6)


def level(output, inputs, params):
    return ct.nlsys(
        None, output, inputs=inputs, outputs=["level"], params=params, name="rule"
    )  # fmt: skip


def by_time():
    """The level falls at T."""
    rule = level(lambda t, x, u, p: [np.where(t > p["T"], 0.2, 5.0)], [], {"T": 0.6})
    return [rule], {"rule.T": 1.0}, 0.6


def by_crossing():
    """The level falls where x = R t is P."""
    rule = level(lambda t, x, u, p: [np.where(u[0] > p["T"], 0.2, 5.0)], ["u"], {"T": P})
    moving = source(lambda t, x, u, p: [x[0]], {"R": R}, "R")
    return [rule, moving], {"rule.T": 1 / R, "source.R": -P / R**2}, P / R


def by_clock():
    """The level is computed every 0.3 s, and is below h first at 0.6 s."""
    rule = level(lambda t, x, u, p: [p["L"] - 4 * u[0]], ["h"], {"L": 2.0})
    return [nlctl.sampled(rule, 0.3)], {"rule.L": 0.0}, 0.6


def by_relay():
    """The level falls where a relay switches, at the time that is its threshold."""
    relay = nlctl.block(nlctl.Relay(on=0.6, off=-0.4), "relay", inputs=["u"], outputs=["v"])
    rule = level(lambda t, x, u, p: [2.0 - p["g"] * u[0]], ["v"], {"g": 1.8})
    moving = source(lambda t, x, u, p: [x[0]], {"R": 1.0})
    return [rule, relay, moving], {"relay.on": 1.0, "rule.g": 0.0}, 0.6


@pytest.mark.parametrize(
    ("method", "cause"),
    crossed(["auto", "taylor", "rodas5p"], [by_time, by_crossing, by_clock, by_relay]),
)
def test_reset_by_what_makes_its_guard_jump(cause, method):
    """Behind the reset at T h = a + q (t - T), and T moves as the cause says."""
    blocks, moves, T = cause()
    loop = nlctl.interconnect(
        [nlctl.block(Tank(), "tank"), *blocks], inputs=[], outputs=["h"], name="loop"
    )
    t, by = np.array([0.0, 0.3, T + 0.1]), [*moves, "tank.a", "tank.q"]
    made = nlctl.sensitivity_response(loop, t, with_respect_to=by, method=method)
    assert not made.missing
    assert made.values[0] == pytest.approx([0, 0.3, 0.15])
    for name, move in moves.items():
        assert made["h", name] == pytest.approx([0, 0, -move], abs=1e-8)
    assert made["h", "tank.a"] == pytest.approx([0, 0, 1], abs=1e-8)
    assert made["h", "tank.q"] == pytest.approx([0, 0.3, 0.1], abs=1e-8)


@pytest.mark.parametrize("method", ["auto", "tsit5", "rodas5p"])
def test_narrow_functions_are_followed(method):
    """All of a narrow hill is passed at the rate R: the integral over t is sqrt(pi) / R."""
    hill = ct.nlsys(
        lambda t, x, u, p: [p["R"], np.exp(-(((x[0] - p["c"]) / p["d"]) ** 2)) / p["d"]],
        lambda t, x, u, p: [x[1]], inputs=0, outputs=["y"], states=["x", "y"],
        params={"R": R, "c": 1.3, "d": 1e-2}, name="hill",
    )  # fmt: skip
    by = ["hill.R", "hill.c", "hill.d"]
    made = nlctl.sensitivity_response(hill, [0, 3.0], with_respect_to=by, method=method)
    assert made.derivatives[0, :, -1] == pytest.approx([-np.sqrt(np.pi) / R**2, 0, 0], abs=1e-5)


TENTS = {
    "of t": lambda t, x, u, p: [p["A"] - np.abs(t - p["P"])],
    "of a state": lambda t, x, u, p: [p["A"] - np.abs(x[0] - p["P"])],
}


@pytest.mark.parametrize(
    ("above", "delay", "law"), crossed([0.0, 1e-4, -1e-4], [None, 0.2], [*TENTS])
)
def test_memory_that_is_touched_at_a_corner(law, delay, above):
    """The tip A of a tent comes to A - r, where the memory stands: v = max(m, A - r) from then."""
    gap = nlctl.block(
        nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.5, c_l=-0.5), "gap",
        inputs=["u" if delay is None else "s"], outputs=["v"],
    )  # fmt: skip
    parts = [source(TENTS[law], {"A": A, "P": P}), gap]
    if delay is not None:
        line = nlctl.TransportDelay(inputs=("u",), outputs=("s",), delay=delay, before=A - P)
        parts.append(nlctl.block(line, "wire"))
    loop = nlctl.interconnect(parts, inputs=[], outputs=["v"], name="loop")
    tip, by = P + (delay or 0.0), ["source.A", "gap.c_r", "gap.memory(0)"]
    made = nlctl.sensitivity_response(
        loop, [0, tip - 0.1, tip + 0.2], 0, {"gap.memory": 0.5 + above}, with_respect_to=by
    )
    assert made.values[0] == pytest.approx([0.5 + above, 0.5 + above, 0.5 + max(above, 0.0)])
    assert np.allclose(made.derivatives[0, :, 1], [0, 0, 1], rtol=0, atol=1e-9)
    if above:
        slopes = [0, 0, 1] if above > 0 else [1, -1, 0]
        assert made.derivatives[0, :, 2] == pytest.approx(slopes, abs=1e-7)
        return
    (lack,) = made.missing
    assert lack.time == pytest.approx(tip, abs=1e-6)
    assert lack.where == "memory of 'gap'"
    assert "touched at its end" in lack.why
    assert np.isnan(made.derivatives[0, :, 2]).all()


def test_tips_that_touch_what_the_first_has_left():
    """All tips of a wave reach as far, also if that is changed: v = A - r from the first on."""
    loop = nlctl.interconnect(
        [source(lambda t, x, u, p: [p["A"] * (1 - np.abs(np.sin(t)))], {"A": A}),
         nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.6, c_l=-0.6), "gap",
                     inputs=["u"], outputs=["v"])],
        inputs=[], outputs=["v"], name="loop",
    )  # fmt: skip
    made = nlctl.sensitivity_response(
        loop, np.arange(0, 12, 2.0), with_respect_to=["source.A", "gap.c_r"]
    )
    assert not made.missing
    assert np.allclose(made["v", "source.A"], 1, rtol=0, atol=1e-7)
    assert np.allclose(made["v", "gap.c_r"], -1, rtol=0, atol=1e-7)


@pytest.mark.parametrize("apart", [0.0, 0.05])
def test_two_corners_at_once(apart):
    """v = A - |Q - P| - r from the top of A - |t - P| - |x - Q| on, which has a corner at Q = P."""
    loop = nlctl.interconnect(
        [source(lambda t, x, u, p: [p["A"] - np.abs(t - p["P"]) - np.abs(x[0] - p["Q"])],
                {"A": A, "P": P, "Q": P + apart}),
         nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.3, c_l=-0.3), "gap",
                     inputs=["u"], outputs=["v"])],
        inputs=[], outputs=["v"], name="loop",
    )  # fmt: skip
    by = ["source.A", "source.P", "source.Q"]
    made = nlctl.sensitivity_response(loop, [0, P + 0.2], with_respect_to=by)
    assert made.values[0, -1] == pytest.approx(A - apart - 0.3)
    if apart:
        assert made.derivatives[0, :, -1] == pytest.approx([1, 1, -1], abs=1e-7)
        return
    (lack,) = made.missing
    assert lack.time == pytest.approx(P, abs=1e-6)
    assert "two corners" in lack.why


@pytest.mark.parametrize("g", [0.3, 0.8])
def test_memory_that_turns_at_a_sample(g):
    """u = x - g x(1) from t = 1 on, x = R t: v keeps R - r, or is pushed to R - g R + r."""
    law = ct.nlsys(
        None, lambda t, x, u, p: [-p["g"] * u[0]], inputs=["x"], outputs=["held"],
        params={"g": g}, name="law",
    )  # fmt: skip
    moving = ct.nlsys(
        lambda t, x, u, p: [p["R"]], lambda t, x, u, p: [x[0], x[0] + u[0]], inputs=["held"],
        outputs=["x", "u"], states=["x"], params={"R": R}, name="moving",
    )  # fmt: skip
    gap = nlctl.block(
        nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.3, c_l=-0.3), "gap", inputs=["u"], outputs=["v"]
    )
    loop = nlctl.interconnect(
        {"law": nlctl.sampled(law, 1.0), "moving": moving, "gap": gap}, outputs=["v"]
    )
    by = ["moving.R", "law.g", "gap.c_r", "gap.c_l"]
    made = nlctl.sensitivity_response(loop, [0, 0.9, 1.1, 1.2], with_respect_to=by)
    pushed = g > 0.6 / R
    assert not made.missing
    assert made.values[0, 2:] == pytest.approx(R - g * R + 0.3 if pushed else R - 0.3)
    expected = [1 - g, -R, 0, -1] if pushed else [1, 0, -1, 0]
    for k in (2, 3):
        assert made.derivatives[0, :, k] == pytest.approx(expected, abs=1e-7)
