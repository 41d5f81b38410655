"""Three answers to a claim: it is shown, it is refuted, or the runs show neither."""

from __future__ import annotations

from typing import Literal

import numpy as np
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.wording import counted

from .guarantee import MOST_RUNS, Violation, least_count, runs_needed
from .sequential import SequentialTest, log_evidence

Answer = Literal["shown", "refuted", "not shown yet"]


@described_record(made_by="bound_verdict")
class Verdict:
    """What runs say of a claim; printed, ``not shown yet (needs at least 132 more runs ...)``."""

    # Shown and refuted with the confidence of the statement that the claim is about.
    answer: Answer
    needs: str = ""  # What it takes to show it; empty where that is not a question.

    def __str__(self) -> str:
        return f"{self.answer} (needs {self.needs})" if self.needs else self.answer


@as_annotated
def bound_verdict(statement: Violation, limit: float) -> Verdict:
    """Judge the claim that the probability of a violation is at most a limit.

    It is shown if the upper bound is at most the limit, and refuted if the lower bound lies above
    it.  Of the two only the wrong one is an error, whatever the probability is, so that each
    bound may use up the confidence by itself: the verdict is wrong with probability at most
    1 - confidence.

    Parameters
    ----------
    statement : Violation
        From `guarantee.violation_probability`.
    limit : float
        Between 0 and 1.

    Raises
    ------
    ParameterError
        If the limit is not between 0 and 1.

    Examples
    --------
    >>> from nlctl.analysis.robustness import (
    ...     Space, Uncertain, bound_verdict, independent, violation_probability
    ... )
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> found = violation_probability(independent(space, 459, entropy=1), [1.0] * 459)
    >>> bound_verdict(found, 0.01).answer, bound_verdict(found, 0.005).answer
    ('shown', 'not shown yet')
    """
    limit = fraction("a verdict", "limit", limit)
    low, high = statement.singly
    if high <= limit:
        return Verdict(answer="shown")
    if low > limit:
        return Verdict(answer="refuted")
    confidence = (1 + statement.confidence) / 2 if statement.side == "both" else None
    try:
        planned = runs_needed(limit, confidence or statement.confidence, statement.violations)
    except ParameterError:
        return Verdict(answer="not shown yet", needs=f"more than {MOST_RUNS:.0e} runs")
    return Verdict(answer="not shown yet", needs=_more(planned - statement.runs))


@as_annotated
def test_verdict(test: SequentialTest) -> Verdict:
    """Judge the claim that the probability of a violation is below the threshold of a test.

    Parameters
    ----------
    test : SequentialTest
        As `decide` returns it.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, decide, independent, test_verdict
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> test = decide(independent(space, 1000, entropy=1), [1.0] * 1000, threshold=0.05)
    >>> test_verdict(test).answer
    'shown'
    """
    if test.decision != "undecided":
        return Verdict(answer="shown" if test.decision == "below" else "refuted")
    k, n = test.statement.violations, test.statement.runs
    evidence = -np.log(1 - test.statement.confidence)

    def decides(runs: int) -> bool:
        below = k / runs < test.threshold
        return bool(below and log_evidence(k, runs, test.threshold) >= evidence)

    enough = least_count(decides, n, 2 * n, MOST_RUNS)
    needs = f"more than {MOST_RUNS:.0e} runs" if enough is None else _more(enough - n)
    return Verdict(answer="not shown yet", needs=needs)


def _more(runs: int) -> str:
    return f"at least {counted(runs, 'more run')} without a violation"


def better_verdict(wins: int, losses: int, p: float, level: float, tests: float = 1.0) -> Verdict:
    """Judge the claim that one option is better than another, by the sign test."""
    if p <= level:
        return Verdict(answer="shown" if wins > losses else "refuted")

    def decides(more: int) -> bool:
        one, all_ = wins + more, wins + losses + more
        return 2 * one > all_ and bool(stats.binomtest(one, all_).pvalue * tests <= level)

    enough = least_count(decides, 0, 1)
    assert enough is not None  # no count is too large
    needs = f"at least {counted(enough, 'more sample')}, won in every one"
    return Verdict(answer="not shown yet", needs=needs)
