"""Watching a study while it runs: bounds that hold at every moment, and what is decided."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from scipy import optimize, special, stats

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction
from nlctl.attributes import described_record, with_parameters_of
from nlctl.errors import ParameterError
from nlctl.wording import counted

from ..uncertainty.design import Design
from .guarantee import (
    MOST_RUNS,
    Margins,
    Violation,
    checked_confidence,
    checked_counts,
    design_assumptions,
    least_count,
    runs_needed,
    violations_of,
)

PRIOR = 0.5  # both parameters of the Beta distribution that alternatives are mixed with (Jeffreys')


def log_evidence(violations: Any, runs: Any, p: float) -> Any:
    """Return log M of the evidence against a probability p of a violation."""
    #     M_n(p) = int q^k (1-q)^(n-k) dBeta(q) / (p^k (1-p)^(n-k))
    #            = B(k + 1/2, n - k + 1/2) / B(1/2, 1/2) / (p^k (1-p)^(n-k))
    # the likelihood of k violations in n runs, mixed over all probabilities by Beta(1/2, 1/2), over
    # that of p. Under p it is a nonnegative martingale that starts from 1, so that it ever reaches
    # 1/a with probability at most a (Ville's inequality): the p with M_n(p) < 1/a at all times n
    # are a confidence sequence (Robbins, Ann. Math. Stat. 41, 1970; Howard, Ramdas, McAuliffe,
    # Sekhon, Ann. Statist. 49, 2021).
    k, n = violations, runs
    mixed = special.betaln(k + PRIOR, n - k + PRIOR) - special.betaln(PRIOR, PRIOR)
    return mixed - special.xlogy(k, p) - special.xlog1py(n - k, -p)


@as_annotated
def sequence_bounds(violations: int, runs: int, confidence: float = 0.99) -> tuple[float, float]:
    """Return bounds of the probability of a violation that may be inspected after every run.

    With this confidence they hold at all numbers of runs at once, so a study may stop whenever it
    likes, for any reason.  They are the p with ``log_evidence < -log(1 - confidence)``, an interval
    about violations / runs, since the evidence is convex in p on a logarithmic scale.

    Parameters
    ----------
    violations, runs : int
        Of the first runs in the order of the design.
    confidence : float, optional
        That the bounds hold at every moment, between 0 and 1.

    Returns
    -------
    lower, upper : float
        Between 0 and 1.

    Raises
    ------
    ParameterError
        If not 0 <= violations <= runs with at least one run, or the confidence is none.

    Examples
    --------
    After one run without a violation the evidence is B(1/2, 3/2) / B(1/2, 1/2) / (1 - p), 1/2 over
    1 - p, which is 100 at p = 0.995:

    >>> from nlctl.analysis.robustness import sequence_bounds
    >>> lower, upper = sequence_bounds(0, 1, confidence=0.99)
    >>> lower, round(upper, 6)
    (0.0, 0.995)
    """
    k, n = checked_counts(violations, runs)
    limit = -np.log(1 - checked_confidence(confidence))

    def excess(p: float) -> float:
        return log_evidence(k, n, p) - limit

    lower = _zero(excess, np.log(k / n), -700.0, np.exp) * (1 - 1e-9) if k else 0.0
    upper = _zero(excess, k / n, 1 - 2.0**-53, float) * (1 + 1e-9) if k < n else 1.0
    return lower, min(upper, 1.0)


def _zero(
    excess: Callable[[float], float], inside: float, outside: float, scale: Callable[[float], float]
) -> float:
    """Return where excess(p) changes sign between two places; p = scale(place)."""
    if excess(scale(outside)) <= 0:  # a confidence next to 1
        return scale(outside)
    root: Any = optimize.brentq(lambda place: excess(scale(place)), inside, outside, xtol=1e-15)
    return scale(root)


@described_record(made_by="decide")
class SequentialTest:
    """Whether a probability lies below or above a threshold; printed, it is a sentence."""

    threshold: float
    decision: Literal["below", "above", "undecided"]
    statement: Violation  # What is known when it was decided, or now.

    def __str__(self) -> str:
        runs = f"after {counted(self.statement.runs, 'run')}"
        if self.decision == "undecided":
            return f"Undecided {runs} whether it is below {self.threshold:g}. {self.statement}"
        return f"Decided {runs}: {self.decision} {self.threshold:g}. {self.statement}"


@as_annotated
def confidence_sequence(design: Design, margins: Margins, confidence: float = 0.99) -> Violation:
    """Bound the probability of a violation from the runs that are done, at any time.

    Parameters
    ----------
    design : Design
        Independent draws.
    margins : sequence of at most ``design.size`` numbers
        Margin of the first rows in order, see `guarantee.violation_probability`.
    confidence : float, optional
        That the bounds hold at every moment of the study.

    Returns
    -------
    Violation
        Bounds that hold at all numbers of runs together.

    Raises
    ------
    NoGuaranteeError
        If the rows are no independent draws, or not the first ones without a gap.

    Examples
    --------
    It is wider than the bounds for a number of runs that was fixed in advance:

    >>> from nlctl.analysis.robustness import (
    ...     Space, Uncertain, confidence_sequence, independent, violation_probability
    ... )
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> design = independent(space, 100, entropy=1)
    >>> fixed = violation_probability(design, [1.0] * 100, side="both")
    >>> confidence_sequence(design, [1.0] * 100).upper > fixed.upper
    True
    """
    violated = violations_of(design, margins)
    return _statement(design, int(np.count_nonzero(violated)), violated.size, confidence)


def _statement(design: Design, k: int, n: int, confidence: float) -> Violation:
    lower, upper = sequence_bounds(k, n, confidence)
    return Violation(
        violations=k,
        runs=n,
        confidence=confidence,
        lower=lower,
        upper=upper,
        side="both",
        singly=(lower, upper),
        method="beta-binomial confidence sequence, valid at every number of runs",
        assumptions=(*design_assumptions(design), "rows are counted in the order of the design"),
    )


@as_annotated
@with_parameters_of(confidence_sequence)
def decide(
    design: Design, margins: Margins, threshold: float, confidence: float = 0.99
) -> SequentialTest:
    """Test whether the probability of a violation is below or above a threshold.

    It goes through the rows in order and stops at the first at which the confidence sequence
    leaves the threshold out; the decision is wrong with probability at most 1 - confidence,
    however many rows there are.  Near the threshold it may take any number of runs.

    Arguments and errors as in `confidence_sequence`.

    Parameters
    ----------
    threshold : float
        Probability, between 0 and 1.

    Raises
    ------
    ParameterError
        If the threshold is not between 0 and 1.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, decide, independent
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> test = decide(independent(space, 1000, entropy=1), [1.0] * 1000, threshold=0.05)
    >>> print(test.decision, test.statement.violations, test.statement.runs < 1000)
    below 0 True
    """
    threshold = fraction("a test", "threshold", threshold)
    limit = -np.log(1 - checked_confidence(confidence))
    k = np.cumsum(violations_of(design, margins))
    n = np.arange(1, k.size + 1)
    decided = np.nonzero(log_evidence(k, n, threshold) >= limit)[0]
    i = int(decided[0]) if decided.size else k.size - 1
    return decision(design, int(k[i]), int(n[i]), threshold, confidence)


def decision(
    design: Design, violations: int, runs: int, threshold: float, confidence: float = 0.99
) -> SequentialTest:
    """Return what these counts of the first rows of a design decide, as in `decide`."""
    k, n = checked_counts(violations, runs)
    threshold = fraction("a test", "threshold", threshold)
    is_decided = log_evidence(k, n, threshold) >= -np.log(1 - checked_confidence(confidence))
    side: Literal["below", "above"] = "below" if k / n < threshold else "above"
    return SequentialTest(
        threshold=threshold,
        decision=side if is_decided else "undecided",
        statement=_statement(design, k, n, confidence),
    )


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
