"""Sets of solutions: closed forms, random trajectories, and what must not be called proved."""

import itertools
import time

import control as ct
import numpy as np
import pytest
from scipy.linalg import expm

from nlctl.analysis.lyapunov import Box, reachable_set
from nlctl.errors import ParameterError

TRAJECTORIES = 100_000
FAR = np.inf


def oscillator(x):
    """Rates of a harmonic oscillator."""
    return x[1], -x[0]


def van_der_pol(x):
    """Rates of Van der Pol's oscillator."""
    return x[1], (1 - x[0] ** 2) * x[1] - x[0]


def pendulum(x):
    """Rates of a damped pendulum that is pushed."""
    return x[1], -np.sin(x[0]) - 0.1 * x[1] + 0.3 * np.tanh(x[1])


def quotients(x):
    """Rates with a quotient, an exponential and a root."""
    return 1 / (1 + x[1] ** 2) - x[0], np.exp(-x[0]) - np.sqrt(1 + x[1] ** 2) * x[1]


def stiff_pair(x):
    """Linear rates, of 1/s and 20/s."""
    return -x[0] + 0.5 * x[1], -20.0 * x[1]


def rotation_that_is_fed(x):
    """A linear system of three states."""
    return -0.2 * x[0] + 2.0 * x[1], -2.0 * x[0] - 0.2 * x[1] + x[2], -0.5 * x[2]


LINEAR = {
    "stiff": (stiff_pair, [[-1.0, 0.5], [0.0, -20.0]]),
    "rotation": (rotation_that_is_fed, [[-0.2, 2.0, 0.0], [-2.0, -0.2, 1.0], [0.0, 0.0, -0.5]]),
}


def integrated(function, x, t, substeps):
    """Yield states at times by the classical method of order four."""
    yield x
    for begin, end in itertools.pairwise(t):
        h = (end - begin) / substeps
        for _ in range(substeps):
            k1 = np.stack(function(x))
            k2 = np.stack(function(x + 0.5 * h * k1))
            k3 = np.stack(function(x + 0.5 * h * k2))
            k4 = np.stack(function(x + h * k3))
            x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        yield x


@pytest.mark.parted
@pytest.mark.parametrize(
    ("function", "box", "horizon"),
    [
        (van_der_pol, {"x1": (1.25, 1.55), "x2": (2.25, 2.35)}, 7.0),
        (pendulum, {"x1": (-0.5, 0.5), "x2": (0.8, 1.2)}, 6.0),
        (quotients, {"x1": (0.2, 0.6), "x2": (-0.3, 0.3)}, 4.0),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_no_random_trajectory_leaves_the_set(function, box, horizon):
    found = reachable_set(function, Box.of(**box), horizon)
    assert found.status == "proved", found
    low, high = np.array([*box.values()]).T
    rng = np.random.default_rng(0)
    starts = rng.uniform(low[:, None], high[:, None], (2, TRAJECTORIES))
    starts[:, :4] = np.array([[a, b] for a in (low[0], high[0]) for b in (low[1], high[1])]).T
    times = found.times[::4]
    low, high = found.low.reshape(-1, 4, 2).min(axis=1), found.high.reshape(-1, 4, 2).max(axis=1)
    far = 1e-7  # of the classical method
    for i, x in enumerate(integrated(function, starts, times, 12)):
        for cell in {max(i - 1, 0), min(i, len(low) - 1)}:
            assert np.all(x.min(axis=1) >= low[cell] - far)
            assert np.all(x.max(axis=1) <= high[cell] + far)
    assert np.all(x.min(axis=1) >= found.end_low - far)
    assert np.all(x.max(axis=1) <= found.end_high + far)


@pytest.mark.parametrize("name", LINEAR)
def test_the_set_of_a_linear_system_is_that_of_the_matrix_exponential(name):
    function, A = LINEAR[name]
    n, horizon = len(A), 3.0
    box = Box.of(**{f"x{i + 1}": (0.5 * i - 0.1, 0.5 * i + 0.3) for i in range(n)})
    found = reachable_set(function, box, horizon)
    E = expm(np.array(A) * horizon)
    middle, half = np.array([0.5 * i + 0.1 for i in range(n)]), np.full(n, 0.2)
    low, high = E @ middle - np.abs(E) @ half, E @ middle + np.abs(E) @ half
    assert np.all(found.end_low <= low + 1e-14)
    assert np.all(found.end_high >= high - 1e-14)
    np.testing.assert_allclose(found.end_low, low, atol=1e-7)
    np.testing.assert_allclose(found.end_high, high, atol=1e-7)


def test_a_rotation_does_not_wrap():
    turns = 20
    box = Box.of(x1=(0.9, 1.1), x2=(-0.1, 0.1))
    found = reachable_set(oscillator, box, 2 * np.pi * turns)
    assert found.status == "proved"
    np.testing.assert_allclose(found.end_high - found.end_low, 0.2, rtol=1e-5)
    assert found.bounds("x1")[1] < np.hypot(1.1, 0.1) + 0.01  # at most this at any time


def test_a_point_on_a_circle_reaches_its_radius_and_no_more():
    start = Box.of(x1=(1.0, 1.0), x2=(0.0, 0.0))
    free = reachable_set(oscillator, start, 4.0, within=Box.of(x1=(-1.001, FAR)))
    less = reachable_set(oscillator, start, 4.0, within=Box.of(x1=(-0.9, FAR)))
    assert (free.status, less.status) == ("proved", "refuted")
    assert less.refuted == {"x1": 1.0, "x2": 0.0}


@pytest.mark.parted
@pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 0.999])
def test_a_planted_violation_is_never_proved(share):
    """From radii up to 1.1, x1 > share + (1 - share) 1.1 is met by some solution, if by few."""
    limit = share * 1.1 + (1 - share) * 1.0
    start = Box.of(x1=(0.9, 1.1), x2=(0.0, 0.0))
    within = Box.of(x1=(-limit, FAR))
    found = reachable_set(oscillator, start, 4.0, within=within, max_pieces=60)
    assert found.status != "proved"
    if found.status == "refuted":
        assert found.refuted["x1"] > limit


def test_a_solution_that_escapes_is_undecided():
    found = reachable_set(
        lambda x: (x[0] ** 2,), Box.of(x1=(0.9, 1.1)), 1.2, max_pieces=20
    )  # 1 / (1 / x - t) ends at 0.91 s
    assert found.status == "undecided"
    assert np.all(np.isinf(found.high))


def test_no_piece_is_begun_after_max_seconds():
    """However many may be tried: what is not proved by then is said, and nothing is claimed."""
    escape = Box.of(x1=(0.9, 1.1))

    def search(**limits):  # it would be divided for ever
        return reachable_set(lambda x: (x[0] ** 2,), escape, 1.2, **limits)

    search(max_pieces=1)  # compiles, which a busy machine may take longer for than the time below
    begun = time.perf_counter()
    found = search(max_pieces=10**9, max_seconds=1.0)
    assert 1.0 <= time.perf_counter() - begun < 30.0
    assert found.status == "undecided"
    assert 0 < found.pieces < 10**9
    assert "max_seconds" in found.reason
    assert np.all(np.isinf(found.high))
    start = Box.of(x1=(0.0, 1.0), x2=(0.0, 0.0))
    none = reachable_set(oscillator, start, 1.0, max_seconds=1e-9)
    assert (none.status, none.pieces) == ("undecided", 0)


def test_time_that_suffices_changes_nothing():
    start = Box.of(x1=(0.9, 1.1), x2=(0.0, 0.1))
    free, timed = (reachable_set(oscillator, start, 1.0, max_seconds=s) for s in (None, 1e3))
    assert timed.status == free.status == "proved"
    np.testing.assert_array_equal(timed.high, free.high)
    np.testing.assert_array_equal(timed.low, free.low)


def test_what_has_no_value_is_undecided():
    found = reachable_set(
        lambda x: (-np.sqrt(x[0]) - 0.1,), Box.of(x1=(0.5, 0.6)), 3.0, max_pieces=9
    )
    assert found.status == "undecided"


def angle_of_a_circle(x):
    """Rates of a rotation, and of the integral of its angle."""
    return -x[1], x[0], np.arctan2(x[1], x[0])


def test_the_angle_jumps_at_its_cut():
    """It is t until pi, so that its integral is t^2/2; then -pi, which no series sees."""
    start = Box.of(x1=(1, 1), x2=(0, 0), x3=(0, 0))
    before = reachable_set(angle_of_a_circle, start, 3.0)
    assert before.status == "proved"
    assert before.end_low[2] <= 4.5 <= before.end_high[2]
    beyond = reachable_set(angle_of_a_circle, start, 4.0)
    assert beyond.status == "undecided"
    assert "no step is found beyond 3.14159 s" in beyond.reason


@pytest.mark.weekly
def test_bounds_in_words_are_not_tighter_than_what_is_proved():
    """1/e has more digits than six: the limit is said as it is, and no share is rounded to all."""
    low = float(np.exp(-1)) * (1 - 1e-4)
    found = reachable_set(lambda x: (-x[0],), Box.of(x=(1, 1)), 1.0, within=Box.of(x=(low, 2)))
    assert found.status == "proved"
    assert f"[{low!r}, 2]" in str(found)
    touching = reachable_set(lambda x: (-x[0],), Box.of(x=(1, 1)), 1.0, within=Box.of(x=(0.1, 1)))
    assert touching.status == "undecided"
    assert "leave some room" in touching.reason
    most = reachable_set(lambda x: (x[0] ** 2,), Box.of(x=(0, 1)), 1.0, max_pieces=24)
    assert most.status == "undecided"
    assert "99.9" in most.reason


@pytest.mark.parametrize("function", [np.abs, np.floor, np.sign, lambda v: np.maximum(v, 0.1)])
def test_rates_with_cases_are_refused(function):
    with pytest.raises(ParameterError, match="smooth"):
        reachable_set(lambda x: (-function(x[0]),), Box.of(x1=(0.5, 0.6)), 1.0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"horizon": -1.0}, "horizon"),
        ({"within": Box.of(x9=(0.0, 1.0))}, "x9"),
        ({"start": (0.0, 1.0)}, "start"),
        ({"max_pieces": 0}, "max_pieces"),
        ({"max_seconds": 0.0}, "max_seconds"),
        ({"max_seconds": -1.0}, "max_seconds"),
        ({"max_seconds": np.nan}, "max_seconds"),
    ],
)
def test_wrong_arguments_are_named(change, message):
    given = {"start": Box.of(x1=(0.0, 1.0), x2=(0.0, 1.0)), "horizon": 1.0} | change
    with pytest.raises((ParameterError, TypeError), match=message):
        reachable_set(oscillator, **given)


def test_a_diagram_has_the_set_of_its_equations():
    plant = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], -np.sin(x[0]) - 0.5 * x[1] + u[0]]),
        lambda t, x, u, p: x,
        states=["angle", "rate"], inputs=["torque"], outputs=["angle", "rate"], name="plant",
    )  # fmt: skip
    law = ct.nlsys(
        None, lambda t, x, u, p: np.array([-u[0] - 0.5 * u[1]]), inputs=["angle", "rate"],
        outputs=["torque"], name="law",
    )  # fmt: skip
    loop = ct.interconnect([plant, law], inputs=[], outputs=["angle"], name="loop")
    start = Box.of(plant_angle=(0.4, 0.6), plant_rate=(-0.1, 0.1))
    found = reachable_set(loop, start, 3.0)
    plain = reachable_set(
        lambda x: (x[1], -np.sin(x[0]) - 0.5 * x[1] - x[0] - 0.5 * x[1]),
        Box.of(x1=(0.4, 0.6), x2=(-0.1, 0.1)),
        3.0,
    )
    assert found.status == "proved"
    np.testing.assert_allclose(found.end_high, plain.end_high, atol=1e-9)
