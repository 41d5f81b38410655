"""Statements about the probability of a violation that are exact, and when they may be made."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, get_args

import numpy as np
import pandas as pd
from scipy import stats

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction, integer, of_type, one_of
from nlctl.attributes import described_record, with_parameters_of
from nlctl.errors import ParameterError, UsageError
from nlctl.wording import counted, some_of

from ..stl.spec import violates
from ..uncertainty.design import Design

Side = Literal["upper", "lower", "both"]
Margins = Sequence[float] | np.ndarray | pd.Series
# up to so many runs the beta quantiles are good to four digits; beyond, SciPy's are not always
MOST_RUNS = 10**9


class NoGuaranteeError(UsageError):
    """The runs do not support a statement about probabilities; the message says what would.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, grid, violation_probability
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> violation_probability(grid(space, 3), [1.0, 1.0, 1.0])
    Traceback (most recent call last):
        ...
    nlctl.analysis...NoGuaranteeError: no guarantee from a design of kind 'grid': its rows ...
    """


@described_record(made_by="violation_probability")
class Violation:
    """How likely a violation is; printed, it is a sentence with its assumptions."""

    violations: int
    runs: int
    confidence: float
    lower: float  # Bounds of the probability that hold together with this confidence.
    upper: float
    side: Side  # Which of the two is in use; the other is 0 or 1.
    # A lower and an upper bound that hold with this confidence each by itself; `lower` and `upper`
    # where both are in use.
    singly: tuple[float, float]
    method: str
    assumptions: tuple[str, ...]  # What the statement rests on.

    def __str__(self) -> str:
        return (
            f"{some_of(self.violations, self.runs, 'run', 'violates', 'violate')} the spec. "
            f"{self.bounds} ({self.method}). Assumed: {'; '.join(self.assumptions)}."
        )

    @property
    def bounds(self) -> str:
        """What is known of the probability, in words, without method and assumptions.

        Runs that violate are evidence of a lower bound, the others of an upper one; what there is
        evidence of is stated, also where only the other side was asked for.
        """
        low, high = rounded_down(self.singly[0]), rounded_up(self.singly[1])
        confidence = f"confidence {100 * self.confidence:.10g} %"
        text = f"With {confidence} the probability of a violation is"
        if self.lower > 0 and self.upper < 1:
            return f"{text} between {low} and {high}"
        sides = {f"at most {high}": self.singly[1] < 1, f"at least {low}": self.singly[0] > 0}
        first, *rest = [text for text, is_there in sides.items() if is_there] or ["at most 1"]
        if self.lower > 0 and rest:  # the side that was asked for comes first
            first, rest = rest[0], [first]
        both = f"(both together: {max(0.0, 200 * self.confidence - 100):.10g} %)"
        text = f"{text} {first}"
        return text + "".join(f"; with the same confidence, {other} {both}" for other in rest)

    def plain(self) -> dict[str, Any]:
        """Return it as numbers and texts, as JSON can hold them.

        Returns
        -------
        dict
            The fields by their names.
        """
        return vars(self) | {"assumptions": list(self.assumptions)}


def rounded_up(value: float) -> str:
    """Return an upper bound in four digits, rounded up so that it holds as printed."""
    return _rounded(value, np.ceil)


def rounded_down(value: float) -> str:
    """Return a lower bound in four digits, rounded down so that it holds as printed."""
    return _rounded(value, np.floor)


def _rounded(value: float, towards: Any) -> str:
    if not 0 < value < 1:
        return f"{value:g}"
    unit = 10.0 ** (np.floor(np.log10(value)) - 3)
    return f"{towards(value / unit) * unit:.4g}"


def checked_confidence(confidence: float) -> float:
    """Return a confidence."""
    return fraction("a statement", "confidence", confidence)


@as_annotated
def clopper_pearson(
    violations: int, runs: int, confidence: float = 0.99, side: Side = "upper"
) -> tuple[float, float]:
    """Return exact bounds of the probability of a violation after a fixed number of runs.

        upper: the p with P(at most k violations in n | p) = a, the 1 - a quantile of Beta(k+1, n-k)
        lower: the p with P(at least k violations in n | p) = a, the a quantile of Beta(k, n-k+1)

    where a = 1 - confidence for one side and half of it for both (Clopper, Pearson, Biometrika
    1934).  They hold with at least this confidence for every p.

    Parameters
    ----------
    violations, runs : int
        k and n, at most 10^9.
    confidence : float, optional
        That the bounds hold, between 0 and 1.
    side : {"upper", "lower", "both"}, optional
        The bound that is left out is 0 or 1.

    Returns
    -------
    lower, upper : float
        0 or 1 where the side is open.

    Raises
    ------
    ParameterError
        If not 0 <= violations <= runs with at least one run and at most 10^9, the confidence is
        none, or the side.

    Examples
    --------
    >>> round(clopper_pearson(0, 459)[1], 4)  # 1 - 0.01^(1/459)
    0.01
    """
    k, n = checked_counts(violations, runs)
    side = one_of("a bound", "side", side, get_args(Side))
    a = (1 - checked_confidence(confidence)) / (2 if side == "both" else 1)
    upper = float(stats.beta.isf(a, k + 1, n - k)) if side != "lower" and k < n else 1.0
    lower = float(stats.beta.ppf(a, k, n - k + 1)) if side != "upper" and k > 0 else 0.0
    return lower, upper


def checked_counts(violations: int, runs: int) -> tuple[int, int]:
    """Return numbers of violations and runs."""
    n = integer("a probability", "runs", runs, at_least=1)
    k = integer("a probability", "violations", violations, at_least=0)
    if n > MOST_RUNS:
        raise ParameterError(
            f"a probability needs runs <= {MOST_RUNS:.0e}, beyond which its bounds lose digits, "
            f"got {n}"
        )
    if k > n:
        raise ParameterError(f"a probability needs violations <= runs, got {k} of {n}")
    return k, n


@as_annotated
def runs_needed(probability: float, confidence: float = 0.99, violations: int = 0) -> int:
    """Return the least number of runs that proves a probability, if few enough of them violate.

    The least n with P(at most `violations` in n | probability) <= 1 - confidence: if no more runs
    than that violate, the upper bound of `clopper_pearson` is at most `probability`.  Without
    violations n = log(1 - confidence) / log(1 - probability), rounded up.

    Parameters
    ----------
    probability : float
        To be proved, between 0 and 1.
    confidence : float, optional
        Of the statement, between 0 and 1.
    violations : int, optional
        How many of the runs may violate.

    Returns
    -------
    int
        Number of runs.

    Raises
    ------
    ParameterError
        If the probability is not between 0 and 1, the confidence is none, `violations` is not
        an integer >= 0, or more than 10^9 runs would be needed.

    Examples
    --------
    >>> runs_needed(0.01, confidence=0.99)  # ln 0.01 / ln 0.99, rounded upwards
    459
    """
    k = integer("a plan", "violations", violations, at_least=0)
    a = 1 - checked_confidence(confidence)
    probability = fraction("a plan", "probability", probability)

    def enough_of(n: int) -> bool:
        return not stats.binom.cdf(k, n, probability) > a

    enough = least_count(enough_of, k, k + 1, MOST_RUNS)
    if enough is None:
        raise ParameterError(
            f"a plan for the probability {probability:g} needs more than {MOST_RUNS:.0e} runs, "
            "which cannot be counted: take a larger probability"
        )
    return enough


def least_count(
    holds: Callable[[int], bool], few: int, more: int, most: float = np.inf
) -> int | None:
    """Return the least count from which on something holds."""
    while not holds(more):
        few, more = more, 2 * more
        if few > most:
            return None
    while more - few > 1:
        middle = (few + more) // 2
        few, more = (few, middle) if holds(middle) else (middle, more)
    return more


@as_annotated
@with_parameters_of(clopper_pearson)
def violation_probability(
    design: Design, margins: Margins, confidence: float = 0.99, side: Side = "upper"
) -> Violation:
    """Bound the probability of a violation from all runs of a design.

    Parameters
    ----------
    design : Design
        Independent draws.
    margins : sequence of length ``design.size``
        Margin of every row in order; a run violates the spec unless its margin is > 0, so NaN is a
        violation.  A Series goes by its index.

    Raises
    ------
    NoGuaranteeError
        If the rows are no independent draws, or some are missing.
    ParameterError
        If the confidence is none, or the side.

    Examples
    --------
    No violation in 459 runs bounds its probability by 1 % with confidence 99 %:

    >>> from nlctl.analysis.robustness import Space, Uncertain, independent, violation_probability
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(0.0, 1.0)),))
    >>> found = violation_probability(independent(space, 459, entropy=1), [1.0] * 459)
    >>> print(found.violations, round(found.upper, 5), round(1 - 0.01 ** (1 / 459), 5))
    0 0.00998 0.00998
    """
    side = one_of("a bound", "side", side, get_args(Side))
    confidence = checked_confidence(confidence)
    violated = violations_of(design, margins)
    k, n = int(np.count_nonzero(violated)), violated.size
    if n != design.size:
        raise NoGuaranteeError(
            f"the bound holds for a number of runs that was fixed in advance, {design.size}, and "
            f"{n} are done: finish them, or use sequential.confidence_sequence, which may be "
            "inspected at any time"
        )
    lower, upper = clopper_pearson(k, n, confidence, side)
    single = (
        clopper_pearson(k, n, confidence, "lower")[0],
        clopper_pearson(k, n, confidence, "upper")[1],
    )
    fixed = "the number of runs was fixed in advance"
    return Violation(
        violations=k,
        runs=n,
        confidence=confidence,
        lower=lower,
        upper=upper,
        side=side,
        singly=(lower, upper) if side == "both" else single,
        method=f"Clopper-Pearson, {'two-sided' if side == 'both' else 'one-sided'}",
        assumptions=(*design_assumptions(design), fixed),
    )


def violations_of(design: Design, margins: Margins) -> np.ndarray:
    """Return for each of the first rows of a design whether it is a violation, in their order."""
    check_iid(design)
    series = series_of(margins, "margins").sort_index()
    if not np.array_equal(series.index, np.arange(series.size)):
        raise NoGuaranteeError(
            "a statement needs the first rows of the design without a gap, and rows are missing: "
            "which runs end first may depend on how they end. Finish them, or give the rows before "
            "the first gap"
        )
    if not 0 < series.size <= design.size:
        raise NoGuaranteeError(
            f"the design has {counted(design.size, 'row')}, got margins of "
            f"{counted(series.size, 'run')}"
        )
    return violates(series)


def series_of(values: object, name: str) -> pd.Series:
    """Return numbers by row."""
    try:
        kind = pd.Series(values).dtype.kind
        if kind in "mMc":  # times and complex numbers, which would be converted
            raise TypeError(kind)
        return pd.Series(values, dtype=float)
    except (TypeError, ValueError):
        shape = f" of shape {np.shape(values)}" if isinstance(values, np.ndarray) else ""
        raise ParameterError(
            f"a statement needs one number per row for {name}, got {type(values).__name__}{shape}"
        ) from None


def check_iid(design: Design) -> None:
    """Refuse a design whose rows are no independent draws."""
    of_type("a statement", "design", design, Design, "independent(space, size)")
    if design.is_iid:
        return
    if design.kind == "user's table":
        raise NoGuaranteeError(
            "rows of a user's table are no independent draws of the space's laws unless the user "
            "says so: from_table(..., drawn_independently=True)"
        )
    why = {
        "adaptive": "were chosen by looking at earlier results",
        "Sobol'": "avoid each other",
        "Latin hypercube": "avoid each other",
    }.get(design.kind, "were chosen systematically")
    raise NoGuaranteeError(
        f"no guarantee from a design of kind '{design.kind}': its rows {why}, and exact statements "
        "need independent draws. Run independent(space, size) instead; for a bound of a "
        "probability size = runs_needed(probability, confidence)"
    )


def design_assumptions(design: Design) -> tuple[str, ...]:
    """Return what every statement from this design rests on."""
    laws = ", ".join(f"{name} ~ {law}" for name, law in design.space.laws.items())
    drawn = "as the user says, " if design.kind == "user's table" else ""
    return (
        f"{drawn}rows are independent draws of {laws}, independent of each other",
        "the simulated loop is the real one, to the tolerance of the integrator",
        "a run that did not reach its end is a violation",
    )
