"""Clocks: instants that are exact, whatever the decimals; what meets; what is refused."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

from nlctl import Clock
from nlctl.errors import ParameterError
from nlctl.sampling.clock import Moment, instants, meetings, moments

PERIODS = st.sampled_from([0.1, 0.2, 0.25, 0.3, 0.7, 1 / 3, 0.0123456789])
OFFSETS = st.sampled_from([0.0, 0.05, 0.1, 0.3])
CLOCKS = st.builds(Clock, dt=PERIODS, offset=OFFSETS, delay=st.sampled_from([0.0, 0.05, 0.4]))


def owned(clocks):
    """Clocks by whose they are: here their places in a list."""
    return dict(enumerate(clocks))


def test_decimals_meet_where_their_fractions_do():
    """0.1 k in floats is not 0.3 at k = 3."""
    due = instants(owned([Clock(dt=0.1), Clock(dt=0.3)]), 0.0, 1000.0)
    both = frozenset(moments(owned([Clock(dt=0.1), Clock(dt=0.3)])))
    assert np.sum(due.which == due.patterns.index(both)) == 3334
    assert due.times.size == 10_000
    np.testing.assert_array_equal(due.times, np.arange(10_000) / 10)


@given(st.lists(CLOCKS, min_size=1, max_size=3), st.floats(0.01, 6))
def test_two_runs_have_the_instants_of_one(clocks, middle):
    """The second begins with what the first one left to it."""
    whole = instants(owned(clocks), 0.0, 7.0)
    first = instants(owned(clocks), 0.0, middle, whole.patterns)
    second = instants(owned(clocks), middle, 7.0, whole.patterns)
    for name in ("times", "which"):
        joined = np.concatenate([getattr(first, name), getattr(second, name)])
        np.testing.assert_array_equal(joined, getattr(whole, name))


@given(st.lists(CLOCKS, min_size=1, max_size=3), st.data())
def test_a_run_that_resumes_at_an_instant_has_it(clocks, data):
    """Once, in the second run, also where the decimals of the clock round to it from below."""
    whole = instants(owned(clocks), 0.0, 7.0)
    middle = float(data.draw(st.sampled_from(whole.times.tolist())))
    first, second = instants(owned(clocks), 0.0, middle), instants(owned(clocks), middle, 7.0)
    assert second.times[0] == middle
    np.testing.assert_array_equal(np.concatenate([first.times, second.times]), whole.times)


@given(st.lists(CLOCKS, min_size=1, max_size=3))
def test_whatever_happens_at_once_is_foreseen(clocks):
    assert set(instants(owned(clocks), 0.0, 30.0).patterns) <= set(meetings(owned(clocks)))


@given(CLOCKS)
def test_outputs_wait_as_long_as_the_delay(clock):
    """`pending` samples are on their way at most: as many as a delay overlaps."""
    due = instants(owned([clock]), 0.0, 20.0)
    happens = [due.patterns[k] for k in due.which]
    taken = [t for t, what in zip(due.times, happens, strict=True) if Moment(0, 1) in what]
    released = [t for t, what in zip(due.times, happens, strict=True) if Moment(0, 0) in what]
    np.testing.assert_allclose(released, np.array(taken[: len(released)]) + clock.delay, atol=1e-12)
    if clock.delay:
        taken, slack = np.array(taken[:50]), 1e-9
        waits = (taken[:, None] <= taken + slack) & (taken + slack < taken[:, None] + clock.delay)
        assert np.max(np.sum(waits, axis=0)) == clock.pending


def test_jitter_is_late_by_at_most_its_size_and_the_same_in_any_run():
    clock = Clock(dt=0.1, jitter=0.04, seed=7)
    times = instants(owned([clock]), 0.0, 50.0).times
    late = times - np.arange(times.size) / 10
    assert late.min() >= 0
    assert late.max() <= 0.04
    assert abs(late.mean() - 0.02) < 0.003  # 5.8 standard errors of 500 draws
    later = instants(owned([clock]), 20.0, 50.0).times
    np.testing.assert_array_equal(times[times >= 20.0], later)


@each_row(
    "given",
    [
        ({"dt": 0}, "dt"), ({"dt": -0.1}, "dt"), ({"dt": np.nan}, "dt"), ({"dt": np.inf}, "dt"),
        ({"dt": 0.1, "delay": -1e-3}, "delay"), ({"dt": 0.1, "offset": -1.0}, "offset"),
        ({"dt": 0.1, "jitter": 0.1}, "jitter < dt"), ({"dt": 0.1, "seed": -1}, "seed"),
        ({"dt": 0.1, "jitter": 0.05, "delay": 0.05}, r"jitter \+ delay < dt"),
    ],
)  # fmt: skip
def test_impossible_clocks_are_refused(given):
    arguments, words = given
    with pytest.raises(ParameterError, match=words):
        Clock(**arguments)


def test_too_many_samples_end_in_a_sentence():
    with pytest.raises(ParameterError, match="simulate a shorter time"):
        instants(owned([Clock(dt=1e-9)]), 0.0, 1e6)
