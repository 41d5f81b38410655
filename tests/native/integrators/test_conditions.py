"""Conditions that stand in the equations: located by every method, against closed forms."""

import itertools

import control as ct
import numpy as np
import pytest
from scipy import signal

import nlctl
from nlctl.native.driver import Course, begin, finish, prepared
from nlctl.native.integrate.state import RUNNING
from nlctl.native.results import made as result
from nlctl.native.settings import Settings
from nlctl.native.windows import go_on

ROOT2 = np.sqrt(2.0)


def duty_cycle(t, x, u, p):
    return [1.0 if t % 0.1 < 0.03 else 0.0]


def window(t, x, u, p):
    return [1.0 + (10.0 if 0.5 < x[0] < 0.6 else 0.0)]


def far_away(t, x, u, p):
    return [np.where(abs(t - 5003.3) < 5, 0.1, 0)]


def square_wave(t, x, u, p):
    return [np.sign(np.sin(2 * np.pi * t)) + (1.0 if x[0] >= 0.25 else 2.0)]


def oscillator(t, x, u, p):
    return [x[1], -np.sign(x[0])]


def load(t, x, u, p):
    return [-x[0] + (1.0 if 50 <= t < 55 else 0.0)]


def stairs(t, x, u, p):
    return [1.0 + np.floor(x[0])]


def clipped(t, x, u, p):
    return [np.clip(2 - abs(x[0] - 1), 0.5, 1.5)]


def limited(t, x, u, p):
    return [0.0 if x[0] >= 1.0 and np.cos(t) > 0 else np.cos(t)]


def narrow(t, x, u, p):
    return [1.0 + (30.0 if 0.5 < x[0] < 0.5003 else 0.0)]


def pulses(t, x, u, p):
    y = 0.0
    for start in (3.0, 7.0, 7.5, 19.0):
        if start <= t < start + 0.02:
            y += 10.0
    return [y]


def circle(t, x, u, p):
    """A small circle on the way of an oscillator: its distance has a corner in the middle."""
    return [10.0 * (np.hypot(x[1] - 0.6, x[2] - 0.8) < 0.01), x[2], -x[1]]


def slits(t, x, u, p):
    """Corners of a diamond on the same way."""
    return [1.0 * (max(abs(x[1] - 0.6), abs(x[2] - 0.8)) < 0.01), x[2], -x[1]]


def fast_gaussian(t, x, u, p):
    return [np.exp(-(((t - 50.0) / 0.1) ** 2))]


def teeth(t, x, u, p):
    # its falling piece is a division by 0, which nothing chooses
    return [40.0 * max(signal.sawtooth(2 * np.pi * t / 10.0) - 0.98, 0.0)]


def sawtooth(t, x, u, p):
    return [1.0 + 0.5 * ((2.0 * x[0] + 0.3) % 1.0)]


def rounded(t, x, u, p):
    return [-1.0 - abs(np.rint(x[0]))]


def truncated(t, x, u, p):
    return [-1.0 - np.ceil(x[0]) + np.trunc(x[0])]


def oscillator_end(t):
    """x'' = -sign(x) from rest at 1: arcs of period 4 sqrt(2)."""
    s = t % (4 * ROOT2)
    if s < ROOT2:
        return 1 - s * s / 2
    return (s - 2 * ROOT2) ** 2 / 2 - 1 if s < 3 * ROOT2 else 1 - (s - 4 * ROOT2) ** 2 / 2


def stairs_end(t):
    """Each stair n takes 1 / (1 + n)."""
    n = 0
    while t > 1 / (1 + n):
        t, n = t - 1 / (1 + n), n + 1
    return n + t * (1 + n)


def sawtooth_end(t):
    """x' = 1 + (2 x + 0.3 - n) / 2 = x + 1.15 - n / 2, up to each z = 2 x + 0.3 = n + 1."""
    x, n = 0.0, 0
    while True:
        rate, end = x + 1.15 - n / 2, (n + 0.7) / 2
        needed = np.log((end + 1.15 - n / 2) / rate)
        if needed >= t:
            return rate * np.exp(t) - 1.15 + n / 2
        x, t, n = end, t - needed, n + 1


def slits_end():
    """Four times through the square, which the unit circle enters and leaves at y = 0.8 +- 0.01."""
    enters, leaves = (max(np.arcsin(0.59), np.arccos(0.81)), min(np.arcsin(0.61), np.arccos(0.79)))
    return 4 * (leaves - enters)


CASES = {  # equations, initial state, last time, the first state there
    "duty cycle": (duty_cycle, [0.0], 10.0, 3.0),
    "window": (window, [0.0], 3.0, 0.6 + 2.5 - 0.1 / 11),
    "far away": (far_away, [0.0], 10_000.0, 1.0),
    "square wave": (square_wave, [0.0], 10.0, 0.25 + 2 * (0.5 - 1 / 12) + 9),
    "oscillator": (oscillator, [1.0, 0.0], 30.0, oscillator_end(30.0)),
    "load": (load, [0.0], 100.0, (1 - np.exp(-5)) * np.exp(-45)),
    "narrow": (narrow, [0.0], 20.0, 0.5003 + 19.5 - 0.0003 / 31),
    "pulses": (pulses, [0.0], 20.0, 0.8),
    "circle": (circle, [0.0, 0.0, 1.0], 20.0, 4 * 10 * 4 * np.arcsin(0.005)),
    "slits": (slits, [0.0, 0.0, 1.0], 20.0, slits_end()),
    "stairs": (stairs, [0.0], 3.5, stairs_end(3.5)),
    "teeth": (teeth, [0.0], 18.0, 40 * 0.02 * 0.1 / 2),
    "sawtooth": (sawtooth, [0.0], 3.5, sawtooth_end(3.5)),
    "rounded": (rounded, [2.2], 2.0, -0.5 - 2.0 * (2.0 - 0.7 / 3 - 0.5 - 1.0)),
    "truncated": (truncated, [1.5], 2.0, -(2.0 - 1.5 / 2)),
    "clipped": (clipped, [0.0], 5.5, 2.5 + (5.5 - np.log(4.5) - 1 / 1.5) / 2),
    "limited": (limited, [0.0], 4.0, 1 + np.sin(4.0) - 1),
    "gaussian": (fast_gaussian, [0.0], 100.0, 0.1 * np.sqrt(np.pi)),
}
METHODS = ("tsit5", "rodas5p", "taylor")
HOW = [(method, rtol) for method in METHODS for rtol in (1e-6, 1e-9)]
every_case = pytest.mark.parametrize("case", CASES)


def plain(equations, start):
    n = len(start)
    return ct.nlsys(equations, None, inputs=0, states=n, outputs=n, name="loop")


def end(case, **how):
    equations, start, last, _ = CASES[case]
    made = nlctl.input_output_response(
        plain(equations, start), np.linspace(0, last, 21), 0, start, squeeze=False, **how
    )
    return float(made.outputs[0, -1]), made


@pytest.mark.parted
@every_case
@pytest.mark.parametrize(("method", "rtol"), HOW)
def test_every_method_meets_them(case, method, rtol):
    found, made = end(case, method=method, rtol=rtol, atol=rtol / 100, engine="native")
    amplified = 5000 if case == "stairs" else 50  # exp(sum of slopes) of the local errors
    assert found == pytest.approx(CASES[case][3], abs=amplified * rtol)
    assert made.statistics.status is nlctl.native.Status.OK


@pytest.mark.parted
@every_case
def test_the_reference_meets_them(case):
    found, _ = end(case, engine="python-control")
    assert found == pytest.approx(CASES[case][3], abs=1e-4 if case == "stairs" else 1e-6)


@pytest.mark.parted
@pytest.mark.parametrize("case", ["window", "oscillator", "clipped", "stairs"])
def test_members_of_an_ensemble_are_what_they_are_alone(case):
    equations, start, last, _ = CASES[case]
    times, starts = np.linspace(0, last, 21), np.linspace(0, 0.3, 11) + start[0]
    compiled = nlctl.compile(plain(equations, start))
    names = compiled.system.state_labels
    first = {names[0]: starts, **dict(zip(names[1:], start[1:], strict=True))}
    kept = nlctl.ensemble_response(compiled, times, 0, first, keep=("y[0]",)).signals["y[0]"]
    for row, x in zip(kept, starts, strict=True):
        alone = nlctl.input_output_response(compiled, times, 0, [x, *start[1:]], squeeze=False)
        np.testing.assert_allclose(row, alone.outputs[0], rtol=0, atol=1e-6)


def test_the_pulse_of_the_table_is_seen():
    """A kick of 10 for 2 s at 20 on an oscillator at rest, twenty samples in it."""
    kicked = plain(lambda t, x, u, p: [x[1], -x[0] + (10.0 if 20 <= t < 22 else 0.0)], [0.0, 0.0])
    times = np.linspace(0, 30, 301)
    wanted = 10 * (
        np.where(times >= 20, 1 - np.cos(times - 20), 0)
        - np.where(times >= 22, 1 - np.cos(times - 22), 0)
    )
    for engine in ("native", "python-control"):
        made = nlctl.input_output_response(kicked, times, 0, 0, engine=engine)
        np.testing.assert_allclose(made.states[0], wanted, rtol=0, atol=1e-5)


def test_events_are_a_table_of_both_engines():
    """x'' = -sign(x): it goes through 0 at sqrt(2), 3 sqrt(2), ..., down and up in turn."""
    tables = [
        end("oscillator", engine=e, rtol=1e-10)[1].events for e in ("native", "python-control")
    ]
    wanted = ROOT2 * np.arange(1, 22, 2)
    for table in tables:
        assert list(table.columns) == ["time", "block", "which", "direction"]
        np.testing.assert_allclose(table["time"], wanted[wanted < 30], rtol=0, atol=1e-6)
        assert set(table["block"]) == {"loop"}
        for direction, way in zip(table["direction"], itertools.cycle(["falling", "rising"])):
            assert direction == way


def test_functions_that_a_run_watches_end_it_by_every_method():
    """cos t: x = 1/2 at pi/3, and the run ends where x' = -1/2 next, at 5 pi / 6 from below."""

    def half(t, x, u, params):
        return x[0] - 0.5

    def slope(t, x, u, params):
        return x[1] + 0.5

    slope.direction = 1
    swing = plain(lambda t, x, u, p: [x[1], -x[0]], [1.0, 0.0])
    for method in METHODS:
        made = nlctl.input_output_response(
            swing, [0, 10], 0, [1.0, 0.0], engine="native", method=method, events={"half": half},
            stop_when=slope,
        )  # fmt: skip
        assert made.time[-1] == pytest.approx(5 * np.pi / 6, abs=1e-7)
        assert list(made.events["which"]) == ["half", "stop_when"]
        np.testing.assert_allclose(made.events["time"], np.pi * np.array([1 / 3, 5 / 6]), atol=1e-7)


@pytest.mark.parted
@pytest.mark.parametrize("method", [*METHODS, None])
def test_a_function_that_is_0_where_a_step_ends_anyway_is_an_event(method):
    """At t = 5 the input has a break point, and x = 1 - t rounds to 0 at t = 1."""
    ramp = ct.nlsys(
        lambda t, x, u, p: [u[0] - 1.0], None, inputs=1, outputs=1, states=1, name="ramp"
    )
    times, how = np.arange(11.0), {"engine": "native" if method else "python-control"}
    how |= {"method": method}
    for five in (lambda t, x, u, p: t - 5.0, lambda t, x, u, p: 5.0 - t):
        ended = nlctl.input_output_response(ramp, times, 0 * times, 1.0, stop_when=five, **how)
        assert ended.time[-1] == pytest.approx(5.0, abs=1e-9)
    made = nlctl.input_output_response(
        ramp, times, 0 * times, 1.0, events={"half": lambda t, x, u, p: x[0]}, **how
    )
    np.testing.assert_allclose(made.events["time"], [1.0], atol=1e-9)


def test_print_and_statistics_say_what_is_located():
    compiled = nlctl.compile(plain(oscillator, [1.0, 0.0]))
    assert "conditions   1 located" in str(compiled)
    _, made = end("oscillator", engine="native")
    assert (made.statistics.conditions, made.statistics.opaque) == (1, False)


@pytest.mark.parted
@pytest.mark.parametrize("case", ["duty cycle", "oscillator", "square wave", "clipped"])
def test_statistics_count_the_rows_of_the_table(case):
    """Of a single run; members of an ensemble count the same."""
    equations, start, last, _ = CASES[case]
    times, compiled = np.linspace(0, last, 21), nlctl.compile(plain(equations, start))
    made = nlctl.input_output_response(compiled, times, 0, start, rtol=1e-6, atol=1e-8)
    assert made.statistics.events == len(made.events) > 0
    assert f", {len(made.events)} events" in repr(made)
    x0, p = np.tile(np.array(start)[:, None], 8), compiled.parameter_vector()[:, None]
    settings, none = Settings(rtol=1e-6, atol=1e-8), np.zeros((0, times.size))
    course = Course(compiled=compiled, times=times, inputs=none, settings=settings)
    run = prepared(course, x0, np.tile(p, 8))
    begin(run)
    while np.any(run.lanes["status"] == RUNNING):
        run = go_on(run)
    assert {result(run, finish(run), j).statistics.events for j in range(8)} == {len(made.events)}


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_steps_of_an_ensemble_are_bounded(method):
    """x' = -x over 1 s with steps of 1 / 64 s at most, and no bound: the least number of steps."""
    compiled = nlctl.compile(plain(lambda t, x, u, p: [-x[0]], [1.0]))
    members = {compiled.system.state_labels[0]: [1.0, 2.0, 3.0]}

    def steps(**bound):
        made = nlctl.ensemble_response(compiled, [0, 1], 0, members, method=method, **bound)
        assert (made.table["status"] == "OK").all()
        return made.table["steps"]

    assert (steps(max_step=1 / 64) >= 64).all()
    assert (steps() < 32).all()
    with pytest.raises(nlctl.errors.ParameterError, match=r"ensemble_response.*max_step"):
        steps(max_step=0.0)


def test_a_condition_that_is_always_0_is_no_event():
    """3 x and y + 2 y with x = y: a difference that is only rounding."""
    loop = plain(
        lambda t, x, u, p: [1.0, 1.0, np.maximum(x[0] * 3.0, x[1] + 2 * x[1])], [0.0, 0.0, 0.0]
    )
    made = nlctl.input_output_response(loop, np.linspace(0, 10, 11), 0, 0, engine="native")
    np.testing.assert_allclose(made.states[2], 1.5 * np.linspace(0, 10, 11) ** 2, rtol=1e-8)
    assert made.statistics.accepted + made.statistics.rejected < 500


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
@pytest.mark.parametrize(
    "bounded",
    [
        lambda jump: np.clip(jump, -np.inf, np.inf),
        lambda jump: np.minimum(jump, np.inf),
        lambda jump: np.maximum(-np.inf, jump),
    ],
    ids=["clip", "minimum", "maximum"],
)
def test_what_jumps_within_infinite_bounds_is_located(bounded, method):
    """x' = 1 until x = 1/4, then 3; the bounds themselves are no conditions."""
    loop = plain(lambda t, x, u, p: [bounded(np.where(x[0] > 0.25, 3.0, 1.0))], [0.0])
    compiled = nlctl.compile(loop)
    made = nlctl.input_output_response(compiled, [0, 1], 0, 0, method=method)
    assert made.statistics.conditions == len(made.events) == 1
    assert abs(made.states[0, -1] - (0.25 + 3 * 0.75)) < 1e-9
