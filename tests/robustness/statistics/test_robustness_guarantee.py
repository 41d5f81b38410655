"""Statements about probabilities: published tables, exact coverage, and refusals."""

import re

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.statistics.guarantee import (
    NoGuaranteeError,
    clopper_pearson,
    runs_needed,
    violation_probability,
)
from nlctl.analysis.robustness.statistics.sequential import (
    confidence_sequence,
    decide,
    log_evidence,
    sequence_bounds,
)
from nlctl.analysis.robustness.uncertainty.design import (
    from_table,
    independent,
    latin_hypercube,
    listed,
    sobol,
)
from nlctl.analysis.robustness.uncertainty.lattice import corners, grid, one_at_a_time
from nlctl.analysis.robustness.uncertainty.space import Space, Uncertain

SPACE = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0), nominal=0.5),))


@given(st.integers(1, 300), st.floats(0, 1), st.sampled_from([0.9, 0.95, 0.999]))
def test_bounds_are_scipys_exact_interval(n, share, confidence):
    """Beta quantiles here, a search on the binomial law there."""
    k = round(share * n)
    for side, alternative in [("both", "two-sided"), ("upper", "less"), ("lower", "greater")]:
        test = stats.binomtest(k, n, alternative=alternative)
        wanted = test.proportion_ci(confidence, method="exact")
        assert clopper_pearson(k, n, confidence, side) == pytest.approx(tuple(wanted), abs=1e-9)


@pytest.mark.parametrize(
    ("violations", "runs", "confidence", "wanted"),
    [
        (0, 10, 0.95, (0.0, 0.3085)),  # tables of exact 95 % limits for a binomial share
        (1, 10, 0.95, (0.0025, 0.4450)),
        (5, 10, 0.95, (0.1871, 0.8129)),
        (10, 20, 0.95, (0.2720, 0.7280)),
        (0, 100, 0.95, (0.0, 0.0362)),
    ],
)
def test_bounds_are_those_of_published_tables(violations, runs, confidence, wanted):
    """To the four digits that are printed."""
    assert clopper_pearson(violations, runs, confidence, "both") == pytest.approx(wanted, abs=6e-5)


@pytest.mark.parametrize("p", [1e-3, 0.01, 0.1, 0.3, 0.5, 0.77, 0.99])
@pytest.mark.parametrize("side", ["upper", "lower", "both"])
@pytest.mark.parametrize("n", [1, 10, 60])
def test_coverage_is_at_least_the_confidence(n, p, side):
    """Summed over all outcomes with their binomial probabilities, not sampled."""
    k = np.arange(n + 1)
    bounds = np.array([clopper_pearson(int(i), n, 0.9, side) for i in k])
    covered = (bounds[:, 0] <= p) & (p <= bounds[:, 1])
    assert stats.binom.pmf(k, n, p)[covered].sum() >= 0.9 - 1e-12


NUMBER = r"(\d[\d.]*(?:e-\d+)?)"


def holds_for(words, p):
    """Whether each bound that a sentence prints holds for a probability, in their order."""
    found = re.findall(rf"(at most|at least|between|and) {NUMBER}", words)
    return [p <= float(x) if word in ("at most", "and") else p >= float(x) for word, x in found]


@pytest.mark.parametrize("side", ["upper", "lower", "both"])
@pytest.mark.parametrize("confidence", [0.7, 0.9, 0.99])
def test_what_a_sentence_says_has_the_confidence_that_it_says(side, confidence):
    """Read from its words: the first bound, and all of them, summed over all outcomes."""
    n = 24
    design = independent(SPACE, n, entropy=1)
    said = [
        violation_probability(design, [-1.0] * k + [1.0] * (n - k), confidence, side).bounds
        for k in range(n + 1)
    ]
    for p in (0.001, 0.02, 0.2, 0.5, 0.8, 0.98):
        weights = stats.binom.pmf(np.arange(n + 1), n, p)
        holds = [holds_for(words, p) for words in said]
        is_range = ["between" in words for words in said]
        first = [all(h) if r else h[0] for h, r in zip(holds, is_range, strict=True)]
        every = [all(h) for h in holds]
        assert weights[first].sum() >= confidence - 1e-12
        assert weights[every].sum() >= 2 * confidence - 1 - 1e-12
    two = [words for words in said if "with the same confidence" in words]
    assert all(f"(both together: {200 * confidence - 100:.10g} %)" in words for words in two)
    assert bool(two) == (side != "both")


@pytest.mark.parametrize(("violations", "wanted"), list(enumerate([59, 93, 124, 153, 181])))
def test_plans_are_wilks_numbers(violations, wanted):
    """95 % / 95 %, one-sided: the sample sizes of Wilks' formula."""
    assert runs_needed(0.05, 0.95, violations) == wanted


@given(st.floats(1e-4, 0.9), st.floats(0.5, 0.999), st.integers(0, 5))
def test_a_plan_is_enough_and_one_run_less_is_not(p, confidence, k):
    """By the bound that is printed in the end."""
    n = runs_needed(p, confidence, k)
    assert clopper_pearson(k, n, confidence)[1] <= p * (1 + 1e-9)
    if n > k + 1:
        assert clopper_pearson(k, n - 1, confidence)[1] > p * (1 - 1e-9)
    if k == 0:
        closed = np.log1p(-confidence) / np.log1p(-p)
        assert n in (max(1, np.ceil(closed - 1e-9)), np.ceil(closed + 1e-9))


def test_the_statement_carries_its_assumptions():
    """A sentence with numbers, method, laws; the printed bound is rounded outwards."""
    design = independent(SPACE, 459, entropy=1)
    made = violation_probability(design, np.ones(459), 0.99)
    text = str(made)
    assert "0 of 459 runs violate" in text
    assert "With confidence 99 %" in text
    assert "a ~ uniform on [0, 1]" in text
    assert "fixed in advance" in text
    printed = float(re.search(r"at most ([\d.]+)", text)[1])
    assert made.upper <= printed < made.upper * 1.001
    half = str(violation_probability(design, np.r_[np.ones(400), -np.ones(59)], 0.9, "both"))
    low, high = map(float, re.search(r"between ([\d.]+) and ([\d.]+)", half).groups())
    exact = clopper_pearson(59, 459, 0.9, "both")
    assert low <= exact[0] < exact[1] <= high
    assert "at least" in str(violation_probability(design, -np.ones(459), 0.9, "lower"))


@pytest.mark.parametrize("margin", [0.0, -1.0, np.nan, -np.inf])
def test_whatever_is_not_above_zero_is_a_violation(margin):
    """NaN above all."""
    made = violation_probability(independent(SPACE, 3), [1.0, margin, 2.0])
    assert made.violations == 1


TABLE = pd.DataFrame({"a": [0.1, 0.2, 0.4, 0.8]})


@each_row(
    ("design", "message"),
    [
        (sobol(SPACE, 4), "kind 'Sobol'': its rows avoid each other.*Run independent"),
        (latin_hypercube(SPACE, 4), "avoid each other"),
        (grid(SPACE, 4), "kind 'grid': its rows were chosen systematically"),
        (corners(SPACE), "systematically"),
        (one_at_a_time(SPACE, 3), "systematically"),
        (listed(SPACE, "adaptive", TABLE, 0), "looking at earlier results"),
        (from_table(SPACE, TABLE), "unless the user says so: from_table"),
    ],
)
@each_row("statement", [violation_probability, confidence_sequence])
def test_no_guarantee_without_independent_draws(statement, design, message):
    """The error says why and what to do instead."""
    with pytest.raises(NoGuaranteeError, match=message):
        statement(design, np.ones(design.size))
    with pytest.raises(NoGuaranteeError):
        decide(design, np.ones(design.size), 0.1)


def test_a_users_word_is_quoted():
    """The assumption is the user's, not ours."""
    design = from_table(SPACE, TABLE, drawn_independently=True)
    assert "as the user says, rows are" in str(violation_probability(design, np.ones(4)))


def test_unfinished_studies_have_no_fixed_number_of_runs():
    """Early looks go to the confidence sequence; gaps go nowhere."""
    design = independent(SPACE, 10)
    with pytest.raises(NoGuaranteeError, match=r"10, and 4 are done.*confidence_sequence"):
        violation_probability(design, np.ones(4))
    with pytest.raises(NoGuaranteeError, match="without a gap"):
        confidence_sequence(design, pd.Series(1.0, index=[0, 1, 3]))
    with pytest.raises(NoGuaranteeError, match="has 10 rows, got margins of 11"):
        confidence_sequence(design, np.ones(11))
    shuffled = pd.Series([1.0, -1.0, 1.0], index=[2, 0, 1])
    assert confidence_sequence(design, shuffled).violations == 1
    assert decide(design, shuffled, 0.5).decision == "undecided"


@pytest.mark.parametrize("p", [0.02, 0.1, 0.4])
def test_evidence_is_a_martingale(p):
    """E[M_{n+1} | M_n] = M_n under p, exactly; and M_0 = 1."""
    for n, k in [(0, 0), (1, 0), (1, 1), (7, 2), (50, 50), (80, 0)]:
        now = np.exp(log_evidence(k, n, p))
        after = p * np.exp(log_evidence(k + 1, n + 1, p))
        after += (1 - p) * np.exp(log_evidence(k, n + 1, p))
        assert after == pytest.approx(now, rel=1e-11)
    assert log_evidence(0, 0, p) == 0


@given(st.integers(1, 10**6), st.floats(0, 1), st.sampled_from([0.9, 0.99, 1 - 1e-9]))
def test_bounds_of_the_sequence_are_where_the_evidence_reaches_its_limit(n, share, confidence):
    """Outside of the bounds it is larger, inside smaller; they contain the share."""
    k = round(share * n)
    low, high = sequence_bounds(k, n, confidence)
    assert 0 <= low <= k / n <= high <= 1
    limit = -np.log(1 - confidence)
    for edge, outwards in ((low, 1 - 1e-6), (high, 1 + 1e-6)):
        if 0 < edge < 1 / outwards and edge < 1:
            assert log_evidence(k, n, edge) >= limit - 1e-9 * n
            assert log_evidence(k, n, edge * outwards) > limit
            assert log_evidence(k, n, edge / outwards) < limit + 1e-6 * n


def ever_lost(p, horizon, leaves_out):
    """Return the probability that p is left out at any n up to the horizon: all paths summed."""
    alive, lost = np.array([1.0]), 0.0
    for n in range(1, horizon + 1):
        alive = np.append(alive * (1 - p), 0) + np.append(0, alive * p)
        out = np.array([leaves_out(k, n) for k in range(n + 1)])
        lost += alive[out].sum()
        alive[out] = 0
    return lost


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("p", [0.01, 0.1, 0.5])
def test_the_sequence_fails_rarely_over_all_times(p):
    """At confidence 90 % it ever leaves p out with probability at most 0.1."""
    lost = ever_lost(p, 400, lambda k, n: log_evidence(k, n, p) >= -np.log(0.1))
    assert 0 < lost <= 0.1


@pytest.mark.weekly
def test_bounds_for_a_fixed_number_of_runs_must_not_be_watched():
    """Exact bounds, looked at after every run until 150, leave p out far more often."""

    def outside(k, n):
        low, high = clopper_pearson(k, n, 0.9, "both")
        return not low <= 0.3 <= high

    assert ever_lost(0.3, 150, outside) > 0.25


def test_a_test_stops_at_the_first_run_that_decides():
    """Without violations: the n with M_n(threshold) >= 1/a; later runs do not matter."""
    design = independent(SPACE, 2000)
    margins = np.ones(2000)
    made = decide(design, margins, 0.01, 0.99)
    n = made.statement.runs
    assert made.decision == "below"
    assert sequence_bounds(0, n, 0.99)[1] < 0.01 <= sequence_bounds(0, n - 1, 0.99)[1] * (1 + 1e-8)
    margins[n:] = -1
    assert decide(design, margins, 0.01, 0.99) == made
    assert f"Decided after {n} runs: below 0.01." in str(made)
    assert n > runs_needed(0.01, 0.99)  # the price of looking all the time


def test_a_test_decides_against_the_loop_too_or_not_at_all():
    """Every second run violates: above 0.1 soon, undecided about 0.5 for ever."""
    design = independent(SPACE, 500)
    margins = np.where(np.arange(500) % 2, 1.0, np.nan)
    above = decide(design, margins, 0.1)
    assert above.decision == "above"
    assert above.statement.runs < 30
    undecided = decide(design, margins, 0.5)
    assert undecided.decision == "undecided"
    assert "Undecided after 500 runs whether" in str(undecided)


def test_wrong_decisions_are_rare():
    """At the threshold itself either decision is wrong: at most 1 - confidence of 300 studies."""
    design, rng = independent(SPACE, 300), np.random.default_rng(5)
    wrong = [
        decide(design, rng.random(300) - 0.2, 0.2, 0.9).decision != "undecided" for _ in range(300)
    ]
    assert stats.binom.sf(sum(wrong) - 1, 300, 0.1) > 1e-6


def test_known_failure_probabilities_are_covered():
    """Linear limit states, P(g < 0) = Phi(-beta), with rows drawn by the design."""
    space = Space(quantities=tuple(Uncertain(name=n, law=stats.norm()) for n in ("a", "b")))
    missed = 0
    for beta, entropy in [(0.5, 1), (1.0, 2), (1.5, 3), (2.0, 4)]:
        design = independent(space, 1500, entropy)
        margins = beta - (0.6 * design.table.a + 0.8 * design.table.b)
        bound = violation_probability(design, margins, 0.999, "both")
        watched = confidence_sequence(design, margins[:700], 0.999)
        for made in (bound, watched):
            missed += not made.lower <= stats.norm.cdf(-beta) <= made.upper
    assert missed == 0


@each_row(
    ("call", "message"),
    [
        (lambda: clopper_pearson(3, 2), "violations <= runs, got 3 of 2"),
        (lambda: clopper_pearson(0, 0), "runs >= 1"),
        (lambda: clopper_pearson(0, 5, 1.0), "0 < confidence < 1, got 1.0"),
        (lambda: runs_needed(0.0), "0 < probability < 1"),
        (lambda: runs_needed(0.1, violations=-1), "violations >= 0"),
        (lambda: decide(independent(SPACE, 3), [1.0], 1.5), "0 < threshold < 1"),
    ],
)
def test_numbers_that_are_no_probabilities_are_refused(call, message):
    """By name and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=message):
        call()
