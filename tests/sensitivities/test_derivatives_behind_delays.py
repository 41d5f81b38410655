"""Memories and conditions behind delays: closed forms, and next to differences of runs."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import CORNERS, A, P, source
from examples import crossed

import nlctl
from nlctl.errors import CompileError

D, R = 0.4, 0.3  # a delay and half a gap


def wire(delay, sent=("q",), left=("y",), name="wire"):
    return nlctl.block(nlctl.TransportDelay(inputs=sent, outputs=left, delay=delay), name)


def gap(half=R, **labels):
    play = nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=half, c_l=-half)
    return nlctl.block(play, "gap", **{"inputs": ["y"], "outputs": ["v"]} | labels)


def connected(*blocks, outputs, inputs=()):
    return nlctl.interconnect(
        list(blocks), inputs=list(inputs), outputs=list(outputs), name="loop"
    )  # fmt: skip


def wave(output=lambda t, x, u, p: [x[0]]):
    """q = A sin(w t) as a state."""
    return ct.nlsys(
        lambda t, x, u, p: [x[1], -(p["w"] ** 2) * x[0]], output, inputs=0, outputs=["q"],
        states=["x", "s"], params={"w": 2.0}, name="plant",
    )  # fmt: skip


def of_time(t, x, u, p):
    return [p["A"] * np.sin(p["w"] * t)]


@pytest.mark.parted
@pytest.mark.parametrize("rtol", [1e-5, 1e-8, 1e-10])
def test_play_behind_a_delay_of_a_sine(rtol):
    """Behind the crest v = A - r; as it rises A sin(w (t - d)) - r."""
    amplitude, w = 1.5, 2.0
    sine = ct.nlsys(
        None, of_time, inputs=0, outputs=["q"], params={"A": amplitude, "w": w}, name="sine"
    )
    loop = connected(sine, wire(D), gap(), outputs=["v"])
    t = np.array([0, 0.3, 1.0, 1.3, 2.4])
    by = ["sine.A", "sine.w", "wire.delay", "gap.c_r", "gap.c_l", "gap.memory(0)"]
    made = nlctl.sensitivity_response(
        loop, t, 0, {"gap.memory": 0.1}, with_respect_to=by, rtol=rtol, atol=rtol / 100
    )
    phase, slope = w * (t - D), amplitude * np.cos(w * (t - D))
    rise = np.array([np.zeros(5), np.sin(phase), slope * (t - D), -slope * w])
    expected = np.zeros((6, 5))
    expected[5, :2] = 1  # where it still stands
    expected[:3, 2] = rise[1:, 2]
    expected[3, 2] = expected[3, 3] = -1
    expected[0, 3] = 1  # of the crest neither the rate nor the delay says anything
    expected[:3, 4], expected[4, 4] = rise[1:, 4], -1  # on the other side of the gap
    assert not made.missing
    assert made.values[0, 2:] == pytest.approx(
        [amplitude * np.sin(phase[2]) - R, amplitude - R, amplitude * np.sin(phase[4]) + R],
        abs=100 * rtol,
    )
    assert made.derivatives[0] == pytest.approx(expected, abs=100 * rtol)


def test_play_behind_a_delay_of_a_state():
    """x = x0 cos(w t) + s0 / w sin(w t): its crest is sqrt(x0^2 + s0^2 / w^2)."""
    loop = connected(wave(), wire(D), gap(), outputs=["v"])
    x0, s0, w, r = 0.2, 3.0, 2.0, np.hypot(0.2, 1.5)
    by = ["plant.x(0)", "plant.s(0)", "plant.w", "wire.delay", "gap.c_r"]
    made = nlctl.sensitivity_response(
        loop, [0, 1.3], 0, {"plant.x": x0, "plant.s": s0}, with_respect_to=by, rtol=1e-9
    )  # fmt: skip
    expected = [x0 / r, s0 / w**2 / r, -(s0**2) / w**3 / r, 0, -1]
    assert made.values[0, -1] == pytest.approx(r - R, abs=1e-7)
    assert made.derivatives[0, :, -1] == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("second", "law"), crossed([False, True], [*CORNERS]))
def test_play_that_turns_at_a_corner_behind_delays(law, second):
    """v = A - c from t = P + d on, wherever that is, until u has fallen by 2 c."""
    wires = [wire(D, ("u",)), wire(0.15, ("y",), ("far",), "other")][: 1 + second]
    blocks = source(CORNERS[law], {"A": A, "P": P}), gap(inputs=["far" if second else "y"])
    loop = connected(*blocks, *wires, outputs=["v"])
    late = D + 0.15 * second
    by = ["source.A", "source.P", "gap.c_r", "gap.c_l", "wire.delay"]
    by += ["other.delay"] if second else []
    made = nlctl.sensitivity_response(
        loop, np.array([0, 0.5 + late, 0.9 + late, 1.5 + late]), 0, {"gap.memory": -0.1},
        with_respect_to=by,
    )  # fmt: skip
    assert not made.missing
    slopes = np.zeros((len(by), 4))
    slopes[:, 1] = [1, -1, -1, 0, -1, -1][: len(by)]
    slopes[:, 2] = [1, 0, -1, 0, 0, 0][: len(by)]
    slopes[:, 3] = [1, 1, 0, -1, 1, 1][: len(by)]
    assert made.values[0, 1:] == pytest.approx([A - P + 0.2, A - 0.3, A - 0.8 + 0.3])
    assert made.derivatives[0][:, 1:] == pytest.approx(slopes[:, 1:], abs=1e-7)


def test_play_behind_a_delay_of_samples():
    """A tent of samples: the time of its tip is known, and moves behind the delay with that."""
    loop = connected(wire(D, ("r",)), gap(), outputs=["v"], inputs=["r"])
    t = np.array([0, 1, 2, 2.8, 3.2])
    made = nlctl.sensitivity_response(
        loop, t, [0, 1, 2, 1.2, 0.8], 0, with_respect_to=["wire.delay", "gap.c_r", "gap.c_l"]
    )
    assert not made.missing
    assert made.values[0, 2:] == pytest.approx([2 - D - R, 2 - R, 0.8 + D + R])
    assert made["v", "wire.delay"][2:] == pytest.approx([-1, 0, 1], abs=1e-8)
    assert made["v", "gap.c_r"][2:] == pytest.approx([-1, -1, 0], abs=1e-8)
    assert made["v", "gap.c_l"][2:] == pytest.approx([0, 0, -1], abs=1e-8)


@pytest.mark.parametrize(
    ("start", "by"), crossed([0.2, 0.9], ["source.R", "source.x(0)", "wire.delay", "gap.c_r"])
)
def test_play_behind_a_delay_of_what_jumps(by, start):
    """Driven up to the jump of x = x0 + R t at P, by -h: it keeps P - r, or falls behind it."""
    height, r, rate = (0.35, 0.3, 1.3) if start < 0.5 else (1.1, 0.3, 1.3)
    plant = ct.nlsys(
        lambda t, x, u, p: [p["R"]], lambda t, x, u, p: [x[0] - p["h"] * (x[0] > p["P"])],
        inputs=0, outputs=["q"], states=["x"], params={"R": rate, "P": P, "h": height},
        name="source",
    )  # fmt: skip
    loop = connected(plant, wire(D), gap(r), outputs=["v"])
    x0, t = 0.1, (P - 0.1) / rate + D + 0.02
    made = nlctl.sensitivity_response(
        loop, [0, t], 0, {"source.x": x0, "gap.memory": -0.15}, with_respect_to=[by, "source.P"]
    )
    behind = height > 2 * r + 0.1  # pushed to the other side of the gap, and left there
    assert made.values[0, -1] == pytest.approx(P - height + r if behind else P - r)
    assert made["v", by][-1] == pytest.approx(-1 if by == "gap.c_r" and not behind else 0, abs=1e-7)
    assert made["v", "source.P"][-1] == pytest.approx(1, abs=1e-7)


def test_condition_on_a_delayed_signal():
    """z' = (t + x(0) - d > p) from the arrival on: z = t - d - p + x(0)."""
    plant = ct.nlsys(
        lambda t, x, u, p: [1.0, np.where(u[0] > p["p"], 1.0, 0.0)],
        lambda t, x, u, p: [x[0], x[1]],
        inputs=["y"], outputs=["q", "z"], states=["x", "z"], params={"p": 0.5}, name="plant",
    )  # fmt: skip
    loop = connected(wire(0.3), plant, outputs=["z"])
    by = ["plant.p", "plant.x(0)", "wire.delay"]
    for some in (by, by[:2]):
        made = nlctl.sensitivity_response(loop, [0, 0.79, 0.81, 2], with_respect_to=some)
        assert not made.missing
        assert made.values[0] == pytest.approx([0, 0, 0.01, 1.2])
        for name, slope in zip(some, [-1, 1, -1], strict=False):
            assert made["z", name] == pytest.approx([0, 0, slope, slope], abs=1e-8)


@pytest.mark.parametrize("actuator", ["relay", "where"])
def test_a_jump_that_takes_a_delayed_signal_across(actuator):
    """x = R t jumps at P, and what it jumps across follows d later, whatever its level is."""
    plant = ct.nlsys(
        lambda t, x, u, p: [p["R"]], lambda t, x, u, p: [np.where(x[0] > p["P"], 2.0, -2.0)],
        inputs=0, outputs=["q"], states=["x"], params={"P": P, "R": 1.3}, name="source",
    )  # fmt: skip
    parts = {
        "relay": nlctl.block(nlctl.Relay(on=0.4, off=-0.5), "act", inputs=["y"], outputs=["v"]),
        "where": ct.nlsys(
            None, lambda t, x, u, p: [np.where(u[0] > p["on"], 1.0, -1.0)], inputs=["y"],
            outputs=["v"], params={"on": 0.4}, name="act",
        ),
    }  # fmt: skip
    total = ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: [x[0]], inputs=["v"], outputs=["z"],
        states=["z"], name="integral",
    )  # fmt: skip
    loop = connected(plant, wire(D), parts[actuator], total, outputs=["z"])
    by, end = ["source.P", "source.R", "wire.delay", "act.on"], 1.5
    made = nlctl.sensitivity_response(loop, [0, end], with_respect_to=by)
    assert not made.missing
    assert made.values[0, -1] == pytest.approx(end - 2 * (P / 1.3 + D))
    expected = [-2 / 1.3, 2 * P / 1.3**2, -2, 0]
    assert made.derivatives[0, :, -1] == pytest.approx(expected, abs=1e-7)


def test_what_is_refused():
    """Delays that vary, and memories one behind the other with a delay in between."""
    varying = nlctl.TransportDelay(
        inputs=("q",), outputs=("y",), delay=D, varying=lambda t: 0.1 * np.sin(t)
    )
    loop = connected(wave(), nlctl.block(varying, "wire"), gap(), outputs=["v"])
    with pytest.raises(CompileError, match="a signal whose delay varies"):
        nlctl.sensitivity_response(loop, [0, 1], with_respect_to="plant.w")
    first = nlctl.block(nlctl.Backlash(), "first", inputs=["q"], outputs=["m"])
    loop = connected(wave(), first, wire(D, ("m",)), gap(), outputs=["v"])
    with pytest.raises(CompileError, match="by what another one moves, through a delay"):
        nlctl.sensitivity_response(loop, [0, 1], with_respect_to="plant.w")


def test_samples_through_delays_are_refused():
    """When samples leave a delay is not known: refused where they say when something jumps."""
    plant = wave(lambda t, x, u, p: [x[0]])
    law = ct.nlsys(
        None, lambda t, x, u, p: [2 * u[0]], inputs=["q"], outputs=["m"], name="law"
    )  # fmt: skip
    blocks = plant, nlctl.sampled(law, 0.1), wire(D, ("m",))
    relay = nlctl.block(nlctl.Relay(on=0.2, off=-0.2), "relay", inputs=["y"], outputs=["v"])
    with pytest.raises(CompileError, match="samples that come through a delay"):
        nlctl.sensitivity_response(
            connected(*blocks, relay, outputs=["v"]), [0, 1], with_respect_to="plant.w"
        )
    both = ct.nlsys(
        None, lambda t, x, u, p: [u[0] + u[1]], inputs=["y", "q"], outputs=["u"], name="both"
    )  # fmt: skip
    loop = connected(*blocks, both, gap(inputs=["u"]), outputs=["v"])
    with pytest.raises(CompileError, match="by samples that come through a delay"):
        nlctl.sensitivity_response(loop, [0, 1], with_respect_to="plant.w")
