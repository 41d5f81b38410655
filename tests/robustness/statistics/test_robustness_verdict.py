"""Three answers to a claim: when each is given, how often it is wrong, and what shows it."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import nlctl
from nlctl.analysis.robustness import (
    Space,
    Uncertain,
    bound_verdict,
    clopper_pearson,
    decide,
    independent,
    test_verdict,
    violation_probability,
)
from nlctl.analysis.robustness.statistics.sequential import better_verdict

test_verdict.__test__ = False  # the analysis' name, not a test
SPACE = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0), nominal=0.5),))


def statement(violations, runs, confidence=0.99, side="upper"):
    """Return the statement after so many runs, the first of which violate."""
    margins = np.where(np.arange(runs) < violations, -1.0, 1.0)
    return violation_probability(independent(SPACE, runs), margins, confidence, side)


def more(verdict):
    """Return the number of runs that a verdict asks for."""
    return int(re.search(r"at least (\d+) more", verdict.needs)[1])


def test_no_violations_in_too_few_runs_refute_nothing():
    """0 of 96 runs, where 228 would be needed for 2 % with confidence 99 %."""
    found = bound_verdict(statement(0, 96), 0.02)
    assert found.answer == "not shown yet"
    assert str(found) == "not shown yet (needs at least 132 more runs without a violation)"
    assert bound_verdict(statement(0, 228), 0.02).answer == "shown"


@pytest.mark.parametrize("side", ["upper", "both"])
@given(n=st.integers(1, 300), share=st.floats(0, 1), limit=st.floats(0.01, 0.9))
def test_what_is_needed_is_the_least_number_of_runs(side, n, share, limit):
    """So many more runs without a violation show it; one less does not."""
    k = round(n * share)
    found = bound_verdict(statement(k, n, 0.9, side), limit)
    if found.answer == "not shown yet":
        enough = n + more(found)
        assert bound_verdict(statement(k, enough, 0.9, side), limit).answer == "shown"
        assert bound_verdict(statement(k, enough - 1, 0.9, side), limit).answer != "shown"


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("p", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("limit", [0.02, 0.1, 0.4])
@pytest.mark.parametrize("side", ["upper", "both"])
def test_a_wrong_answer_has_at_most_the_probability_that_is_left(p, limit, side):
    """Summed over all outcomes of 60 runs with their binomial probabilities, not sampled."""
    wrong = "refuted" if p <= limit else "shown"
    answers = [bound_verdict(statement(k, 60, 0.9, side), limit).answer for k in range(61)]
    at = [k for k, answer in enumerate(answers) if answer == wrong]
    assert stats.binom.pmf(at, 60, p).sum() <= 0.1 + 1e-12
    assert {"refuted"} <= set(answers)


def test_violations_are_evidence_and_are_printed():
    """137 of 200: the lower bound is what is known, whichever side was asked for."""
    low, high = clopper_pearson(137, 200, 0.99, "lower")[0], clopper_pearson(137, 200, 0.99)[1]
    for side in ("upper", "lower"):
        text = str(statement(137, 200, 0.99, side))
        at_least = float(re.search(r"at least ([\d.]+)", text)[1])
        at_most = float(re.search(r"at most ([\d.]+)", text)[1])
        assert low * 0.999 < at_least <= low < high <= at_most < high * 1.001
    assert "at least" not in str(statement(0, 200))
    assert "at most" not in str(statement(200, 200))


def test_a_sequential_test_says_what_would_decide_it():
    """With so many more runs without a violation it decides, with one less it does not."""
    margins = np.where(np.arange(40) % 20 == 3, -1.0, 1.0)  # 2 of 40
    made = decide(independent(SPACE, 40), margins, 0.1, 0.95)
    verdict = test_verdict(made)
    assert (made.decision, verdict.answer) == ("undecided", "not shown yet")
    enough = 40 + more(verdict)
    for size, decision in ((enough, "below"), (enough - 1, "undecided")):
        longer = np.r_[margins, np.ones(size - 40)]
        assert decide(independent(SPACE, size), longer, 0.1, 0.95).decision == decision
    for limit, answer in ((0.5, "shown"), (0.001, "refuted")):
        assert test_verdict(decide(independent(SPACE, 40), margins, limit)).answer == answer


@given(st.integers(0, 60), st.integers(0, 60))
def test_a_comparison_is_shown_refuted_or_asks_for_samples(wins, losses):
    """By the exact sign test: with the samples that are asked for it is shown."""

    def judged(won, lost):
        p = float(stats.binomtest(won, won + lost).pvalue) if won + lost else 1.0
        return better_verdict(won, lost, p, 0.05)

    found = judged(wins, losses)
    if found.answer == "not shown yet":
        assert judged(wins + more(found), losses).answer == "shown"
        assert judged(wins + more(found) - 1, losses).answer != "shown"
    else:
        assert found.answer == ("shown" if wins > losses else "refuted")
        mirrored = judged(losses, wins)
        assert {found.answer, mirrored.answer} == {"shown", "refuted"}


@given(st.integers(1, 9), st.integers(0, 10**9), st.sampled_from([0.5, 0.99, 1 - 1e-9]))
def test_bounds_of_many_runs_are_numbers_in_order(digits, k, confidence):
    """Up to 10^9 runs; what is beyond is refused, where SciPy has NaN or worse."""
    n = 10**digits
    k %= n + 1
    low, high = clopper_pearson(k, n, confidence, "both")
    assert 0 <= low <= k / n <= high <= 1


def test_more_runs_than_the_quantiles_bear_are_refused():
    """The upper bound was NaN."""
    with pytest.raises(
        nlctl.errors.ParameterError, match=r"runs <= 1e\+09.* got 10000000000000000000"
    ):
        clopper_pearson(10**18, 10**19)
