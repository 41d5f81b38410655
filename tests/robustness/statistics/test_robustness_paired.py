"""Comparisons on the same rows: exact tests, coverage of intervals, runs without a number."""

import itertools
from math import comb

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.statistics.guarantee import NoGuaranteeError
from nlctl.analysis.robustness.statistics.paired import (
    differences,
    holm,
    mcnemar,
    median_interval,
    wins,
)
from nlctl.analysis.robustness.uncertainty.design import independent, sobol
from nlctl.analysis.robustness.uncertainty.space import Space, Uncertain

SPACE = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))


def drawn(n, entropy=1):
    """Return a design of n independent rows."""
    return independent(SPACE, n, entropy)


def discordant(b, c, neither=5, both=3):
    """Return margins of two controllers of which b and c rows violate one only."""
    one = [-1.0] * b + [1.0] * c + [1.0] * neither + [np.nan] * both
    other = [1.0] * b + [-1.0] * c + [1.0] * neither + [np.nan] * both
    return drawn(b + c + neither + both), {"pid": one, "neural": other}


def test_mcnemar_is_the_published_example():
    """6 and 16 discordant pairs: the exact two-sided p-value is 0.0525."""
    row = mcnemar(*discordant(6, 16)).loc[("pid", "neural")]
    assert row.p == pytest.approx(0.0525, abs=5e-5)
    assert (row.only_a, row.only_b, row.both) == (6, 16, 3)
    assert row.difference == pytest.approx(-10 / 30)


@given(st.integers(0, 40), st.integers(0, 40))
def test_mcnemar_is_the_sum_of_binomial_terms(b, c):
    """2 sum over k <= min(b, c) of C(b + c, k) / 2^(b + c), at most 1, in integers."""
    n = b + c
    exact = min(1.0, 2 * sum(comb(n, k) for k in range(min(b, c) + 1)) / 2**n)
    assert mcnemar(*discordant(b, c)).p.iloc[0] == pytest.approx(exact, rel=1e-12)


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_holm_is_the_closed_test(p):
    """Hypothesis i is rejected if every set with it has a p-value of at most a / size."""
    p = np.array(p)
    closed = np.zeros(p.size)
    for size in range(1, p.size + 1):
        for chosen in itertools.combinations(range(p.size), size):
            joint = min(1.0, size * p[list(chosen)].min())
            closed[list(chosen)] = np.maximum(closed[list(chosen)], joint)
    np.testing.assert_allclose(holm(p), closed, rtol=1e-12)


def test_holm_leaves_nan_out():
    """It is no test, and does not make the others stricter."""
    np.testing.assert_array_equal(holm(np.array([np.nan, 0.02, 0.04])), [np.nan, 0.04, 0.04])


def test_differences_of_known_numbers():
    """a - b row by row: a shift by 2 is a median and mean of -2 with no width."""
    base = np.random.default_rng(1).normal(size=50)
    row = differences(drawn(50), {"a": base, "b": base + 2}).loc[("a", "b")]
    for name in ("median", "median_low", "median_high", "mean", "mean_low", "mean_high"):
        assert row[name] == pytest.approx(-2)
    assert row.p == pytest.approx(2 * 0.5**50)


def test_pairing_beats_the_spread_between_rows():
    """A difference of 0.1 shows although rows differ by 10."""
    rng = np.random.default_rng(2)
    base = rng.normal(size=200) * 10
    outcomes = {"a": base + 0.1 + 0.1 * rng.normal(size=200), "b": base}
    row = differences(drawn(200), outcomes).loc[("a", "b")]
    assert 0 < row.mean_low < 0.1 < row.mean_high < 0.2
    assert 0 < row.median_low < 0.1 < row.median_high < 0.2
    assert row.p < 1e-6


@pytest.mark.parametrize("n", [5, 6, 17, 60])
@pytest.mark.parametrize("confidence", [0.5, 0.9, 0.99])
def test_the_interval_of_the_median_is_exact(n, confidence):
    """Its coverage by order statistics is at least the confidence, one rank less is not enough."""
    low, high = median_interval(np.arange(1.0, n + 1), confidence)
    if np.isinf(low):
        assert 1 - 2 * 0.5**n < confidence
        return
    rank = int(low)
    assert high == n + 1 - rank

    def coverage(rank):
        return 1 - 2 * stats.binom.cdf(rank - 1, n, 0.5)

    assert coverage(rank) >= confidence > coverage(rank + 1)


@pytest.mark.slow
def test_intervals_cover_the_true_difference():
    """Of 200 comparisons with skewed differences at 90 %, median 0 and mean 1 - ln 2."""
    rng = np.random.default_rng(3)
    median = mean = 0
    for entropy in range(200):
        delta = rng.exponential(size=40) - np.log(2)
        row = differences(drawn(40, entropy), {"a": delta, "b": np.zeros(40)}, 0.9).iloc[0]
        median += row.median_low <= 0 <= row.median_high
        mean += row.mean_low <= 1 - np.log(2) <= row.mean_high
    assert stats.binom.cdf(median, 200, 0.9) > 1e-3
    assert mean >= 165  # BCa is right to second order only


def test_many_rows_have_the_interval_of_the_normal_law():
    """6,000 rows: mean -+ 1.96 s / sqrt(n), to a few per cent of its width."""
    delta = np.random.default_rng(6).exponential(size=6000)
    row = differences(drawn(6000), {"a": delta, "b": 0 * delta}).iloc[0]
    half = 1.96 * delta.std() / np.sqrt(6000)
    wanted = (delta.mean() - half, delta.mean() + half)
    assert (row.mean_low, row.mean_high) == pytest.approx(wanted, abs=0.1 * half)


def test_a_run_without_a_number_loses():
    """Against any number, whichever is better; two of them are alike."""
    design = drawn(4)
    outcomes = {"a": [np.nan, np.nan, 1.0, 2.0], "b": [np.nan, 5.0, 1.0, 3.0]}
    for better, a_wins in (("smaller", 1), ("larger", 0)):
        table = wins(design, outcomes, better)
        assert table.loc["a", "b"] == a_wins
        assert table.loc["b", "a"] == (1 if better == "smaller" else 2)
        row = differences(design, outcomes, better=better).iloc[0]
        assert row[["mean", "mean_low", "mean_high"]].isna().all()
    assert differences(drawn(1), {"a": [np.nan], "b": [7.0]}).iloc[0]["median"] == np.inf
    assert differences(drawn(1), {"a": [np.nan], "b": [np.nan]}).iloc[0]["median"] == 0


@given(st.integers(0, 1000), st.integers(2, 4))
def test_wins_and_ties_make_up_all_rows(seed, controllers):
    """(a, b) + (b, a) + ties = rows; the diagonal is 0; order does not matter."""
    rng = np.random.default_rng(seed)
    outcomes = {f"c{i}": rng.integers(0, 4, 30).astype(float) for i in range(controllers)}
    table = wins(drawn(30), outcomes)
    for a, b in itertools.combinations(outcomes, 2):
        ties = np.sum(outcomes[a] == outcomes[b])
        assert table.loc[a, b] + table.loc[b, a] + ties == 30
    assert np.all(np.diag(table) == 0)
    reverse = wins(drawn(30), dict(reversed(outcomes.items())))
    assert reverse.loc[table.index, table.columns].equals(table)


def test_rows_go_by_their_numbers():
    """A table in another order gives the same comparison."""
    rng = np.random.default_rng(4)
    a, b = pd.Series(rng.normal(size=20)), pd.Series(rng.normal(size=20))
    design = drawn(20)
    wanted = differences(design, {"a": a, "b": b})
    pd.testing.assert_frame_equal(differences(design, {"a": a[::-1], "b": b}), wanted)


def test_p_values_are_adjusted_for_the_number_of_pairs():
    """Three controllers, three pairs."""
    rng = np.random.default_rng(5)
    table = mcnemar(drawn(100), {f"c{shift}": rng.normal(size=100) + shift for shift in range(3)})
    np.testing.assert_array_equal(table.p_holm, holm(table.p.to_numpy()))
    assert len(table) == 3


TWO = {"a": np.zeros(4), "b": np.ones(4)}


@each_row(
    ("call", "error", "message"),
    [
        (lambda: differences(sobol(SPACE, 4), TWO), NoGuaranteeError, "kind 'Sobol''"),
        (lambda: mcnemar(sobol(SPACE, 4), TWO), NoGuaranteeError, "Run independent"),
        (lambda: wins(drawn(4), {"a": [1.0] * 4}), nlctl.errors.ParameterError, "two controllers"),
        (lambda: wins(drawn(5), TWO), nlctl.errors.ParameterError, "'a' for each of 5 rows, got 4"),
        (lambda: wins(drawn(4), TWO, "more"), nlctl.errors.ParameterError, "'smaller' or 'larger'"),
        (lambda: differences(drawn(4), TWO, 2), nlctl.errors.ParameterError, "0 < confidence < 1"),
    ],
)
def test_comparisons_that_mean_nothing_are_refused(call, error, message):
    """Wins may be counted on any design; tests and intervals may not."""
    assert wins(sobol(SPACE, 4), TWO).loc["a", "b"] == 4
    with pytest.raises(error, match=message):
        call()
