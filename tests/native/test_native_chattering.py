"""Runs that chatter end as that, soon, with the block named; runs that only look like it do not."""

import control as ct
import numpy as np
import pytest
from examples import crossed
from own_relay import Side

import nlctl
from nlctl.analysis.paper.rivals import rival_controller
from nlctl.native import Status
from nlctl.native.chattering.detection import asked, new_paces
from nlctl.native.integrate.state import METHOD, RUNNING, new_lanes

TIMES = np.linspace(0, 10, 101)
FULLER = np.sqrt((np.sqrt(33) - 1) / 24)  # of its optimal switching curve x = -C x' |x'|


def plain(function, start, name="loop"):
    """A system of one block and its start."""
    n = len(start)
    return ct.nlsys(function, lambda t, x, u, p: x, states=n, outputs=n, inputs=0, name=name), start


def sign_loop(c=0.5):
    """x' = c - sign x from 1: at 0 after 1 / (1 - c)."""
    return plain(lambda t, x, u, p: c - np.sign(x), [1.0])


def relay_loop():
    """x'' = -2 sign(x + x' / 2) from rest at 1/2: on its line when 1/2 - t^2 = t."""
    return plain(lambda t, x, u, p: np.array([x[1], -2 * np.sign(x[0] + 0.5 * x[1])]), [0.5, 0.0])


def fuller_loop():
    """Fuller's problem: switches accumulate."""
    return plain(
        lambda t, x, u, p: np.array([x[1], -np.sign(x[0] + FULLER * x[1] * abs(x[1]))]), [1.0, 0.0]
    )


def fuller_end():
    """From rest at 1: arcs x'' = -+1, each of which a^2 of the one before, in closed form."""
    start = np.sqrt(2 / (1 + 2 * FULLER))  # x' at the first switch, 1 - x'^2 / 2 = C x'^2
    ratio = np.sqrt((1 - 2 * FULLER) / (1 + 2 * FULLER))
    return start + start * (1 + ratio) / (1 - ratio)


def run(system, start, **given):
    """Run to where it chatters: conditions of plain functions would slide."""
    return nlctl.input_output_response(
        system, TIMES, 0, start, ignore_errors=True, slide=False, **given
    )


@pytest.mark.parted
@pytest.mark.parametrize(
    ("loop", "exact"),
    [(sign_loop(), 2.0), (relay_loop(), (np.sqrt(3) - 1) / 2), (fuller_loop(), fuller_end())],
    ids=["sign", "relay", "Fuller"],
)
@pytest.mark.parametrize(("rtol", "atol"), [(1e-8, 1e-10), (1e-6, 1e-8)])
def test_chattering_is_found_where_it_begins(loop, exact, rtol, atol):
    """Within some windows, of which each goes no further than steps of the tolerance."""
    made = run(*loop, rtol=rtol, atol=atol)
    found = made.statistics
    assert found.status is Status.CHATTERING
    assert found.accepted + found.rejected <= 6000
    assert found.time == pytest.approx(exact, abs=2e4 * rtol)
    assert not made.success


def test_the_message_names_signal_block_and_both_values():
    system, start = sign_loop()
    with pytest.raises(
        nlctl.errors.ChatteringError, match=r"'x\[0\]'' of block 'loop' jumps"
    ) as caught:
        nlctl.input_output_response(system, TIMES, 0, start, slide=False)
    assert "between -0.5 and 1.5" in str(caught.value)
    assert caught.value.time == pytest.approx(2.0, abs=1e-4)
    assert isinstance(
        caught.value, nlctl.errors.DivergedError
    )  # whoever handles one handles the other


@pytest.mark.slow
@pytest.mark.parametrize(
    ("actuator", "jump"),
    [
        (nlctl.Quantiser(q=0.5), 0.5),
        (nlctl.Quantiser(), 0.1),
        (nlctl.actuators.DeadZoneInverse(), 0.8),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_block_inside_of_a_loop_is_named(actuator, jump):
    """The paper's controller through a jump: the two values differ by the jump."""
    loop = nlctl.paper.example_1(actuator=actuator)
    made = nlctl.input_output_response(loop, TIMES, ignore_errors=True, slide=False)
    assert made.statistics.status is Status.CHATTERING
    words = made.message.partition("'v' of block 'actuator' jumps between ")[2]
    one, _, other = words.partition(";")[0].partition(" and ")
    assert abs(float(one) - float(other)) == pytest.approx(jump, rel=1e-4)


@pytest.mark.parametrize("width", [1e-9, 1e-12, 1e-14])
def test_a_memory_that_switches_is_named(width):
    """A relay whose thresholds coincide to below the tolerance."""
    made = run(*oscillation(nlctl.Relay(on=width, off=-width)))
    assert made.statistics.status is Status.CHATTERING
    assert "of block 'relay' jumps between" in made.message


WELL = {
    "a steep function that does not jump": plain(lambda t, x, u, p: 0.5 - np.tanh(1e7 * x), [1.0]),
    "stiff": plain(lambda t, x, u, p: 1e6 * (np.cos(t) - x), [0.0]),
    "a fast square wave": plain(lambda t, x, u, p: np.sign(np.sin(300 * t)) + 0 * x, [0.0]),
    "a jump that is passed": plain(lambda t, x, u, p: -2 - np.sign(x), [1.0]),
    "a fast oscillation": plain(
        lambda t, x, u, p: np.array([1000 * x[1], -1000 * x[0]]), [1.0, 0.0]
    ),
}


@pytest.mark.parted
@pytest.mark.parametrize("name", WELL)
def test_what_only_looks_like_it_ends_well(name):
    assert run(*WELL[name]).statistics.status is Status.OK


DENSE = np.linspace(0, 20, 20_001)
GIVEN = {
    "constant": np.ones_like(DENSE),
    "ramp": 0.02 * DENSE,
    "staircase": np.floor(DENSE) / 20,
    "fine staircase": np.floor(7 * DENSE) / 140,
}


@pytest.mark.parametrize(
    ("given", "method"), crossed([*GIVEN], ["auto", "tsit5", "rodas5p", "taylor"])
)
def test_samples_of_an_input_are_no_chattering(given, method):
    """A lag at rest goes from sample to sample, and its rate is rounding; it follows its input."""
    lag = nlctl.block(nlctl.Lag(T=0.5), "lag")
    made = nlctl.input_output_response(lag, DENSE, GIVEN[given], method=method)
    assert made.statistics.status is Status.OK
    if given == "constant":
        np.testing.assert_allclose(made.outputs, 1 - np.exp(-2 * DENSE), atol=1e-7)


@pytest.mark.parametrize(
    ("given", "part"),
    crossed(
        [*GIVEN], [nlctl.DeadZone, nlctl.Saturation, nlctl.Backlash, nlctl.Relay, nlctl.Quantiser]
    ),
)
def test_nor_are_they_behind_a_nonlinearity(part, given):
    loop = nlctl.actuators.cascade({"part": part(), "lag": nlctl.Lag()})
    made = nlctl.input_output_response(loop, DENSE, GIVEN[given])
    assert made.statistics.status is Status.OK


@pytest.mark.parametrize("end", [50.0, 1000.0])
def test_nor_is_a_long_rest(end):
    times = np.linspace(0, end, 100_001)
    made = nlctl.input_output_response(
        nlctl.block(nlctl.Lag(T=0.5), "lag"), times, np.ones_like(times)
    )
    assert made.states[0, -1] == pytest.approx(1, abs=1e-12)


def test_windows_that_a_turn_cuts_short_count_together():
    """Paces compare windows of as many steps: a run that changes its method has not become slow."""
    lanes = new_lanes(TIMES, 1)
    paces = new_paces(lanes)
    due = []
    for k in range(18 * 20):  # each of 100 steps
        lanes["t"] += 1.0
        lanes["accepted"] += 100
        lanes["status"] = METHOD if k % 2 else RUNNING
        due += [k + 1] if asked(lanes, paces)[0] else []
    assert due == [18 * 8, 18 * 16]  # the 8th and 16th window
    lanes["t"] += 0.09 * 18
    lanes["accepted"] += 1800
    assert asked(lanes, paces)[0]  # slow


@pytest.mark.parametrize("e", [0.0, 1.0])
def test_clocks_and_breaks_of_delays_are_no_chattering(e):
    """A sampled controller at 1 kHz, and a delay, with 20,001 samples of a constant input."""
    law = nlctl.sampled(
        ct.ss(1.0, 1e-3, 1.0, 0.5, 1e-3, inputs=["e"], outputs=["u"], name="law"), 1e-3
    )
    sampled = nlctl.interconnect({"law": law, "lag": nlctl.Lag()}, inputs=["e"], outputs=["v"])
    delayed = nlctl.interconnect(
        {"delay": nlctl.TransportDelay(), "lag": nlctl.Lag()}, inputs=["u"], outputs=["v"]
    )
    for loop in (sampled, delayed):
        made = nlctl.input_output_response(loop, DENSE, np.full(DENSE.size, e))
        assert made.statistics.status is Status.OK


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
def test_what_jumps_with_time_alone_is_no_chattering(rtol):
    """x' = sign(sin 2000 pi t) - x: a run does not come back to where time has been."""
    made = run(
        *plain(lambda t, x, u, p: np.sign(np.sin(2000 * np.pi * t)) - x, [1.0]),
        rtol=rtol, atol=0.01 * rtol,
    )  # fmt: skip
    assert made.statistics.status is Status.OK


def hand_relay(t, x, u, p):
    """x'' = u - 2 where s = x + x' / 2 > 0, otherwise u + 2."""
    return np.array([x[1], u[0] - 2 * (1.0 if x[0] + 0.5 * x[1] > 0 else -1.0)])


def hand_friction(t, x, u, p):
    return u[0] - np.sign(x)


@pytest.mark.parted
@pytest.mark.parametrize("drive", ["constant", "ramp", "sine"])
@pytest.mark.parametrize(("rtol", "atol"), [(1e-8, 1e-10), (1e-6, 1e-8)])
def test_chattering_is_found_between_dense_samples(drive, rtol, atol):
    """x' = c - sign x and a relay by hand, with an input every millisecond: at the right place.

    Without a drive they are at their jump at t = 1 and (sqrt 3 - 1) / 2; drives of 0.01 move that
    by less than 0.02.
    """
    small = {"constant": 0.01, "ramp": 0.0005 * DENSE, "sine": 0.01 * np.sin(DENSE)}[drive]
    given = small * np.ones_like(DENSE)
    for rate, start, exact, jump in (
        (hand_friction, [1.0], 1.0, 2.0),
        (hand_relay, [0.5, 0.0], (np.sqrt(3) - 1) / 2, 4.0),
    ):
        block = ct.nlsys(
            rate, lambda t, x, u, p: x[0], states=len(start), inputs=1, outputs=1, name="hand"
        )
        made = nlctl.input_output_response(
            block, DENSE, given, start, rtol=rtol, atol=atol, ignore_errors=True, slide=False
        )
        assert made.statistics.status is Status.CHATTERING
        assert made.statistics.time == pytest.approx(exact, abs=0.02 + 2e4 * rtol)
        words = made.message.partition(f"'x[{len(start) - 1}]'' of block 'hand' jumps between ")[2]
        one, _, other = words.partition(";")[0].partition(" and ")
        assert abs(float(one) - float(other)) == pytest.approx(jump, rel=1e-4)


@pytest.mark.parametrize("c", [0.3, 3.0])
def test_a_moving_jump_is_found(c):
    """x' = -5 sign(x - sin c t) is at its jump where 1 - 5 t = sin c t."""
    from scipy.optimize import brentq

    made = run(*plain(lambda t, x, u, p: -5 * np.sign(x - np.sin(c * t)), [1.0]))
    assert made.statistics.status is Status.CHATTERING
    exact = brentq(lambda t: 1 - 5 * t - np.sin(c * t), 0, 1)
    assert made.statistics.time == pytest.approx(exact, abs=1e-3)


@pytest.mark.parametrize("width", [1e-3, 1e-5])
def test_a_hysteresis_that_the_tolerance_resolves_is_integrated(width):
    """x' = 0.5 - v stays within the thresholds; v is in the mean what holds x: 1/2."""
    plant = ct.nlsys(
        lambda t, x, u, p: np.array([0.5 - u[0], u[0]]), lambda t, x, u, p: x[0], states=2,
        inputs=["v"], outputs=["u"], name="plant",
    )  # fmt: skip
    loop = nlctl.interconnect({"relay": Side(width=width), "plant": plant})
    end = 100 * width
    made = nlctl.input_output_response(loop, [0, end], 0)
    assert made.statistics.status is Status.OK
    assert np.max(np.abs(made.states[1])) <= 1.001 * width
    assert made.states[2, -1] == pytest.approx(end / 2, abs=5 * width)


def oscillation(actuator):
    """x' = 1/2 - v from 1 with a relay for v: it goes on where x falls to its threshold."""
    plant = ct.nlsys(
        lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0], states=1, inputs=["v"],
        outputs=["u"], name="plant",
    )  # fmt: skip
    return nlctl.interconnect({"relay": actuator, "plant": plant}), {"plant.x[0]": 1.0}


@pytest.mark.parted
@pytest.mark.parametrize("width", [1e-1, 1e-2, 1e-3])
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
@pytest.mark.parametrize(
    "actuator",
    [
        lambda h: nlctl.Relay(on=h, off=-h),
        lambda h: nlctl.actuators.Preisach(alpha=(h,), beta=(-h,), w=(1.0,)),
    ],
    ids=["Relay", "Preisach"],
)
def test_a_relay_with_hysteresis_oscillates_with_the_period_of_its_width(actuator, width, rtol):
    """A sawtooth: x rises at 3/2 and falls at 1/2 between the thresholds, 16 h / 3 a period.

    A switch is located to 10 rtol of a step.  Of 4 h / 3 and 4 h that comes to 320 rtol h / 3 of
    time in a period, with the ways back: after 50 periods, 8000 rtol h of x at most.
    """
    loop, start = oscillation(actuator(width))
    first, rise, period = 2 * (1 + width), 4 * width / 3, 16 * width / 3
    times = first + period * np.arange(0.1, 50, 0.37)
    made = nlctl.input_output_response(
        loop, np.append(0.0, times), 0, start, rtol=rtol, atol=rtol * width
    )
    phase = (times - first) % period
    exact = np.where(phase < rise, -width + 1.5 * phase, width - 0.5 * (phase - rise))
    found = made.states[[name.startswith("plant") for name in made.state_labels], 1:][0]
    np.testing.assert_allclose(found, exact, rtol=0, atol=8e3 * rtol * width)


@pytest.mark.parametrize("method", ["tsit5", "taylor"])
def test_a_value_of_one_state_alone_is_no_run_without_end(method):
    """4 = 0.4 // 0.1, and 0.4 > 0.4 is not: -0.4 at x = 0.4, 0.6 on both sides of it."""

    def update(t, x, u, params):
        n = x[0] // 0.1
        return [(n + 1 if x[0] > 0.4 else n) % 2 - x[0]]

    system = ct.nlsys(update, None, inputs=0, outputs=1, states=1, name="floor")
    times = np.linspace(0, 0.1, 11)
    passed = nlctl.input_output_response(system, times, 0, 0.4, method=method, ignore_errors=True)
    assert passed.statistics.status in (Status.OK, Status.CHATTERING)
    if passed.success:
        assert passed.states[0] == pytest.approx(1 - 0.6 * np.exp(-times), abs=1e-7)


@pytest.mark.slow
def test_members_of_an_ensemble_chatter_whatever_is_beside_them():
    """Statuses, times and steps of nine members, together and three of them alone."""
    block = ct.nlsys(
        lambda t, x, u, p: p["c"] - np.sign(x), lambda t, x, u, p: x, states=1, outputs=["x"],
        inputs=0, name="block", params={"c": 0.5},
    )  # fmt: skip
    loop = nlctl.compile(block)
    c, start = np.linspace(-1.5, 1.5, 9), {"x[0]": 1.0}

    def table(values):
        made = nlctl.ensemble_response(loop, TIMES, 0, start, params={"c": values}, slide=False)
        return made.table[["status", "time", "steps"]]

    together = table(c)
    assert list(together["status"]) == np.where(abs(c) < 1, "CHATTERING", "OK").tolist()
    for k in (0, 3, 8):
        assert table(c[k : k + 1]).iloc[0].tolist() == together.iloc[k].tolist()


@pytest.mark.parametrize("method", [None, "rodas5p", "taylor"])
def test_a_staircase_is_climbed(method):
    """Steps of 2^-10 that a ramp meets one after the other are no chattering: 2048 of them."""
    q = 2.0**-10
    stairs = ct.nlsys(
        lambda t, x, u, p: [1.0, p["q"] * np.floor(x[0] / p["q"])], lambda t, x, u, p: x,
        inputs=0, outputs=2, states=2, params={"q": q}, name="stairs",
    )  # fmt: skip
    made = nlctl.input_output_response(stairs, [0, 2], 0, [q / 4, 0.0], method=method)
    assert np.allclose(made.events["time"], q * (np.arange(1, 2049) - 0.25), rtol=0, atol=1e-8)
    assert abs(made.states[1, -1] - q**2 * (2047 * 2048 / 2 + 2048 / 4)) < 1e-8


def test_a_quantised_sine_runs_to_its_end():
    """It goes up and down over the same steps, by 2^-12."""
    q = 2.0**-12
    loop = ct.nlsys(
        lambda t, x, u, p: [np.cos(t), p["q"] * np.round(x[0] / p["q"])], lambda t, x, u, p: x,
        inputs=0, outputs=2, states=2, params={"q": q}, name="loop",
    )  # fmt: skip
    made = nlctl.input_output_response(loop, [0, 2 * np.pi], 0, 0)
    assert len(made.events) == 4 * (2**12)
    assert abs(made.states[1, -1]) < 1e-7


def test_ever_faster_levels_are_not_called_noise():
    """Steps end within rounding of a level, where rates jump with the last digit of a state.

    The noise of `reference.rough` is another thing: the quantiser is named with what it jumps
    between, and not the rounding of states.
    """
    loop = nlctl.paper.EXAMPLES["example_1"](
        actuator=nlctl.actuators.Quantiser(), controller=rival_controller("example_1", "PID")
    )
    words = r"'v' of block 'actuator' jumps between -?\d+\.\d and -?\d+\.\d; the run comes back"
    with pytest.raises(nlctl.errors.ChatteringError, match=words):
        nlctl.input_output_response(loop, np.linspace(0, 2, 201))
