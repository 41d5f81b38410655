"""What a statistic claims it has: exact tests are exact, intervals that are not say so."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from nlctl.analysis.robustness import Choice, Space, Uncertain, differences, independent, regional
from nlctl.analysis.robustness.statistics import sensitivity as independence
from nlctl.analysis.robustness.statistics.paired import mean_is_trusted, median_interval
from nlctl.analysis.robustness.statistics.sensitivity import independence_test

LAWS = {  # of a difference: draws, mean, median
    "normal": (lambda r, n: r.normal(size=n), 0.0, 0.0),
    "uniform": (lambda r, n: r.random(n), 0.5, 0.5),
    "-1, 0, 1": (lambda r, n: r.choice([-1.0, 0.0, 1.0], p=[0.1, 0.6, 0.3], size=n), 0.2, 0.0),
    "Student, 2 degrees": (lambda r, n: r.standard_t(2, size=n), 0.0, 0.0),
    "lognormal": (lambda r, n: r.lognormal(0.0, 2.0, size=n), math.exp(2.0), 1.0),
    "exponential": (lambda r, n: r.exponential(size=n), 1.0, math.log(2.0)),
    "Pareto": (lambda r, n: r.pareto(2.5, size=n), 1 / 1.5, 2 ** (1 / 2.5) - 1),
    "2 % worse by 50": (lambda r, n: r.normal(size=n) + 50 * (r.random(n) < 0.02), 1.0, None),
    "5 % worse by 50": (lambda r, n: r.normal(size=n) + 50 * (r.random(n) < 0.05), 2.5, None),
    "1 % better by 900": (lambda r, n: r.normal(size=n) - 900 * (r.random(n) < 0.01), -9.0, None),
}  # fmt: skip


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("n", [10, 30, 100])
def test_of_few_rows_no_mean_is_trusted(law, n):
    """Whatever they look like: what one run in a hundred does need not be among them."""
    draw, *_ = LAWS[law]
    assert not any(mean_is_trusted(draw(np.random.default_rng(k), n)) for k in range(50))


def test_of_many_rows_those_that_are_skew_or_heavy_are_not():
    """And those that are neither are."""
    share = {
        law: np.mean([mean_is_trusted(draw(np.random.default_rng(k), 400)) for k in range(200)])
        for law, (draw, *_) in LAWS.items()
    }
    assert min(share[law] for law in ("normal", "uniform", "-1, 0, 1")) == 1
    assert max(share[law] for law in ("lognormal", "2 % worse by 50", "Pareto")) < 0.1
    assert not mean_is_trusted(np.array([np.nan, *range(400)]))
    assert not mean_is_trusted(np.array([np.inf, *range(400)]))
    assert mean_is_trusted(np.full(400, 0.3))
    assert mean_is_trusted(1e300 * np.random.default_rng(1).normal(size=400))


@pytest.mark.weekly
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("n", [30, 100, 300, 1000])
def test_what_is_trusted_covers(law, n):
    """Trusted, and yet beside the mean: hardly more often than its confidence allows."""
    draw, mean, middle = LAWS[law]
    space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    missed, exact = 0, 0
    for k in range(200):
        values = draw(np.random.default_rng(k), n)
        found = differences(
            independent(space, n, entropy=k), {"a": values, "b": np.zeros(n)}, better="larger"
        ).iloc[0]
        missed += found["mean_trusted"] and not found["mean_low"] <= mean <= found["mean_high"]
        low, high = median_interval(values)
        assert (found["median_low"], found["median_high"]) == (low, high)
        exact += middle is None or low <= middle <= high
    assert missed / 200 <= 0.05 + 2.5 * math.sqrt(0.05 * 0.95 / 200)
    assert exact / 200 >= 0.95 - 2.5 * math.sqrt(0.05 * 0.95 / 200)


def every_table(rows, failing):
    for table in itertools.product(*(range(size + 1) for size in rows)):
        if sum(table) == failing:
            yield np.array(table), math.prod(map(math.comb, rows, table))


margins = st.lists(st.integers(1, 7), min_size=2, max_size=4).flatmap(
    lambda rows: st.tuples(st.just(rows), st.integers(1, sum(rows) - 1))
)


def counts_of(table, rows):
    return np.column_stack([table, np.array(rows) - table])


@given(margins)
def test_the_test_of_choices_is_exact(case):
    """By going through all tables by hand: p is the share of those at least as far away."""
    rows, failing = case
    tables = list(every_table(rows, failing))
    whole = sum(ways for _, ways in tables)

    def distance(table):
        expected = np.array(rows) * failing / sum(rows)
        return float(np.sum((table - expected) ** 2 / np.array(rows)))

    for table, _ in tables[:: max(1, len(tables) // 5)]:
        _, p = independence_test(counts_of(table, rows), entropy=1)
        far = sum(w for other, w in tables if distance(other) >= distance(table) - 1e-9)
        assert p == pytest.approx(far / whole, rel=1e-9)


@given(margins, st.sampled_from([0.01, 0.05, 0.001, 0.2]))
def test_it_rejects_no_more_often_than_its_level(case, level):
    """Exactly: the probability, without an effect, of all tables that it rejects."""
    rows, failing = case
    rejected = sum(
        ways
        for table, ways in every_table(rows, failing)
        if independence_test(counts_of(table, rows), entropy=1)[1] <= level
    )
    assert rejected / math.comb(sum(rows), failing) <= level


def test_two_options_are_fishers_case():
    """SciPy's exact test of two by two orders tables by probability, and agrees for equal rows."""
    for a, b in ((3, 9), (0, 6), (5, 6), (2, 10)):
        counts = np.array([[a, 12 - a], [b, 12 - b]])
        strength, p = independence_test(counts, entropy=1)
        assert p == pytest.approx(stats.fisher_exact(counts).pvalue, rel=1e-9)
        chi = stats.chi2_contingency(counts, correction=False)
        assert strength == pytest.approx(math.sqrt(chi.statistic / 24))


def test_many_tables_are_drawn_or_follow_chi_square(monkeypatch):
    """The three ways agree where they overlap; a permutation test's p is never 0."""
    rng = np.random.default_rng(3)
    rows = np.array([30, 30, 30])
    counts = counts_of(np.array([6, 12, 15]), rows)
    exact = independence_test(counts, entropy=1)[1]
    monkeypatch.setattr(independence, "MOST_TABLES", 0)
    monkeypatch.setattr(independence, "LARGE", 1e9)
    drawn = independence_test(counts, entropy=1)[1]
    monkeypatch.setattr(independence, "LARGE", 0.0)
    law = independence_test(counts, entropy=1)[1]
    assert drawn == pytest.approx(exact, abs=4 * math.sqrt(exact / independence.PERMUTATIONS))
    assert law == pytest.approx(exact, rel=0.3)
    monkeypatch.setattr(independence, "LARGE", 1e9)
    far = counts_of(np.array([0, 15, 30]), rows)
    assert independence_test(far, entropy=1)[1] == 1 / (1 + independence.PERMUTATIONS)
    several = counts_of(rng.multivariate_hypergeometric([40] * 8, 100), [40] * 8)
    assert independence_test(several, entropy=5) == independence_test(several, entropy=5)


@pytest.mark.weekly
def test_regional_takes_it_for_choices_and_an_exact_one_for_numbers():
    """Small tables without an effect: p below 0.01 in at most one of a hundred, or so."""
    choice = Choice(name="kind", options={"a": 0, "b": 1, "c": 2})
    space = Space(quantities=(Uncertain(name="x", bounds=(0.0, 1.0)),), choices=(choice,))
    found = {"kind": 0, "x": 0}
    for entropy in range(300):
        design = independent(space, 20, entropy=entropy)
        margins = np.random.default_rng(entropy).permutation([-1.0] * 4 + [1.0] * 16)
        table = regional(design, margins)
        for name in found:
            found[name] += table.loc[name, "p"] <= 0.01
    assert max(found.values()) <= 3 + 3 * math.sqrt(3)
