"""What lies between two looks of the reference engine at a step: waves, dips, touches, noise."""

import control as ct
import numpy as np
import pytest
from scipy.optimize import brentq

import nlctl
from nlctl.reference.crossings import first_event
from nlctl.reference.looks import FEW_PLACES, STEP_PLACES, looks_at_step

REFERENCE = {"engine": "python-control"}
engines = pytest.mark.parametrize("engine", ["python-control", "native"])


def own(update, states):
    return ct.nlsys(update, None, states=states, inputs=0, outputs=states, name="own")


def open_time(signal, end, places=200_001):
    """For how long a function of time is above 0, and how often it changes its sign."""
    t = np.linspace(0, end, places)
    above = signal(t) > 0
    roots = [brentq(signal, t[k], t[k + 1]) for k in np.flatnonzero(above[1:] != above[:-1])]
    ends = np.array([0.0, *roots, end])
    middles = 0.5 * (ends[1:] + ends[:-1])
    return np.diff(ends)[signal(middles) > 0].sum(), len(roots)


LONG = ["faster"]  # each day "a product of states" has as many waves in a step
WAVES = {
    "a product of states": (lambda a, b: np.sin(300 * a * b) - 0.99, 1.5),
    "faster": (lambda a, b: np.sin(1000 * a * b) - 0.99, 2.0),
    "a product of waves": (lambda a, b: np.sin(60 * a) * np.sin(70 * b) - 0.9, 3.0),
    "beats": (lambda a, b: np.sin(60 * a) + np.sin(66 * a) - 1.99, 3.0),
    "ever faster": (lambda a, b: np.cos(400 * a**4) - 0.98, 1.5),
    "a hair": (lambda a, b: a - 0.9999999, 3.0),
    "a square": (lambda a, b: 1e-8 - (a - 0.5) ** 2, 3.0),
    "two hairs": (lambda a, b: np.maximum(5e-5 - abs(a - 0.1), 5e-5 - abs(a - 0.2)), 3.0),
    "none": (lambda a, b: np.sin(400 * a) - 1.01, 1.5),
}


@pytest.mark.parted
@pytest.mark.parametrize(
    "name", [pytest.param(k, marks=[pytest.mark.weekly] * (k in LONG)) for k in WAVES]
)
def test_every_window_is_met(name):
    """x0 = sin t, x1 = cos t, and x2 counts the time in which a function of these is above 0."""
    signal, end = WAVES[name]
    system = own(lambda t, x, u, p: [x[1], -x[0], 1.0 if signal(x[0], x[1]) > 0 else 0.0], 3)
    made = nlctl.input_output_response(
        system, [0, end], 0, [0.0, 1.0, 0.0], rtol=1e-9, atol=1e-11, **REFERENCE
    )
    wanted, crossings = open_time(lambda t: signal(np.sin(t), np.cos(t)), end)
    assert (made.events["which"] == "comparison").sum() == crossings
    assert made.states[2, -1] == pytest.approx(wanted, abs=1e-5)


@pytest.mark.parametrize("places", [FEW_PLACES, STEP_PLACES])
@pytest.mark.parametrize("turns", range(1, 60))
def test_a_wave_is_followed_however_many_turns_it_makes_in_a_step(places, turns):
    """sin has 2 zeros in each turn; at places as far apart as whole turns nothing is seen of it."""
    phase = 0.1
    crossings = (np.arange(1, 2 * turns + 1) * np.pi - phase) / (2 * np.pi * turns)
    seen = list(
        looks_at_step(
            lambda t, rounded=1.0: np.array([np.sin(2 * np.pi * turns * t + phase)]),
            (0.0, 1.0), np.array([np.sin(phase)]), places, 1,
        )
    )  # fmt: skip
    changes = sum((np.diff(np.sign(looks.values[:, 0])) != 0).sum() for looks in seen)
    assert changes == crossings.size


@pytest.mark.parametrize("places", [FEW_PLACES, STEP_PLACES])
@pytest.mark.parametrize("at", np.linspace(0.003, 0.997, 23))
@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-7])
def test_a_dip_between_two_looks_is_met_wherever_it_lies(places, at, width):
    """(t - at)^2 - width^2 is below 0 over 2 width, also where two looks at it are alike."""
    at = at * (1 - 2 * width) + width

    def look(t, rounded=1.0):
        return np.array([(t - at) ** 2 - width**2])

    event = first_event(look, (0.0, 1.0), look(0.0), (0, 1), lambda size: 0.0 * size, places)
    begins = at - width
    assert event is not None if begins > 0 else True
    if event is not None:
        assert event.time == pytest.approx(begins, abs=1e-9)


@engines
@pytest.mark.parametrize("states", [2, 3])
def test_a_start_that_grazes_a_condition(states, engine):
    """x0 = t^n / n! leaves 0 with all its derivatives but the last at 0."""
    system = own(lambda t, x, u, p: [*x[1:states], 1.0, 1.0 if x[0] > 0 else 0.0], states + 1)
    made = nlctl.input_output_response(system, [0, 1, 2.0], 0, 0, engine=engine)
    orders = np.arange(states, 0, -1)
    wanted = 2.0**orders / np.cumprod(np.arange(1, states + 1))[::-1]
    np.testing.assert_allclose(made.states[:, -1], [*wanted, 2.0], rtol=0, atol=1e-6)


def test_steps_that_are_as_long_as_they_may_be_go_on():
    """At a late time the length of a step is known to no more than the rounding of the time."""
    ramp = own(lambda t, x, u, p: [1.0, 1.0 if x[0] > 5e-4 else 0.0], 2)
    times = 1e6 + np.array([0, 1e-3])
    made = nlctl.input_output_response(ramp, times, 0, [0, 0], max_step=1e-5, **REFERENCE)
    span = times[1] - times[0]
    np.testing.assert_allclose(
        made.states[:, -1], [span, span - 5e-4], rtol=0, atol=2e-14 * times[0]
    )


def test_a_window_cut_close_to_the_peak_of_a_wave_is_no_accumulation():
    """Windows come ever faster for a while, and what is compared is far from 0 between them."""
    system = own(
        lambda t, x, u, p: [x[1], -x[0], 1.0 if np.sin(1000 * x[0] * x[1]) > 0.9 else 0.0], 3
    )
    made = nlctl.input_output_response(
        system, [0.7, 1.2], 0, [np.sin(0.7), np.cos(0.7), 0.0], rtol=1e-6, atol=1e-9, **REFERENCE
    )
    a, b = (open_time(lambda t: np.sin(500 * np.sin(2 * t)) - 0.9, end) for end in (0.7, 1.2))
    assert len(made.events) == b[1] - a[1]
    assert made.states[2, -1] == pytest.approx(b[0] - a[0], abs=1e-3)


def test_a_rest_against_which_a_sign_switches_ends_with_the_reason():
    """x'' = -x - sign(x') / 5 from 1 comes to rest at 1 / 5: forces on either side lead back."""
    friction = own(lambda t, x, u, p: [x[1], -x[0] - 0.2 * np.sign(x[1])], 2)
    with pytest.raises(nlctl.errors.ChatteringError, match=r"block 'own' \(sign\)") as ended:
        nlctl.input_output_response(
            friction, [0, 10.0], 0, [1.0, 0.0], rtol=1e-9, atol=1e-11, **REFERENCE
        )
    assert ended.value.time == pytest.approx(2 * np.pi, abs=1e-2)


# -- rates that are noise --------------------------------------------------------------------------


def noisy(rate):
    """A block next to a quiet one."""
    quiet = ct.nlsys(lambda t, x, u, p: [-x[0]], None, inputs=0, outputs=["q"], states=1,
                     name="quiet")  # fmt: skip
    block = ct.nlsys(rate, None, inputs=0, outputs=["n"], states=1, name="noisy")
    return nlctl.interconnect({"quiet": quiet, "noisy": block}, outputs=["q", "n"])


@pytest.mark.parted
@engines
@pytest.mark.parametrize(
    "rate",
    [
        lambda t, x, u, p: [-x[0] + 1e-3 * (hash(float(x[0])) % 1000)],
        lambda t, x, u, p: [-x[0] + 0.1 * np.sin(1e17 * x[0])],
    ],
    ids=["hash", "rounding"],
)
def test_a_rate_that_changes_with_rounding_ends_a_run_by_name(rate, engine):
    words = r"'x\[0\]'' of block 'noisy' jumps .*its states change by rounding alone"
    with pytest.raises(nlctl.errors.ChatteringError, match=words):
        nlctl.input_output_response(noisy(rate), [0, 1, 2.0], 0, [1.0, 1.0], engine=engine)


@engines
def test_noise_below_the_tolerance_is_integrated(engine):
    """Whatever the hash of a state is: x is exp(-t), to the noise."""
    made = nlctl.input_output_response(
        noisy(lambda t, x, u, p: [-x[0] + 1e-10 * (hash(float(x[0])) % 1000)]),
        [0, 2.0], 0, [1.0, 1.0], engine=engine, rtol=1e-6, atol=1e-8,
    )  # fmt: skip
    np.testing.assert_allclose(made.outputs[:, -1], np.exp(-2), rtol=0, atol=1e-6)


def test_random_numbers_in_rates_end_a_run():
    rng = np.random.default_rng(1)
    with pytest.raises(nlctl.errors.ChatteringError, match="block 'noisy'"):
        nlctl.input_output_response(
            noisy(lambda t, x, u, p: [-x[0] + rng.normal()]), [0, 2.0], 0, [1, 1], **REFERENCE
        )
