"""How the probability of a violation grows with the size of the uncertainty."""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import flag, integer, of_type, vector
from nlctl.attributes import described_record
from nlctl.errors import ParameterError

from ..statistics.guarantee import Violation, checked_confidence, violation_probability
from ..uncertainty.design import checked_entropy, independent
from ..uncertainty.space import Space, scaled
from .evaluation import Evaluate, evaluated


@described_record(made_by="degradation_curve")
class Degradation:
    """Statements about the probability of a violation at several sizes of the uncertainty."""

    factors: tuple[float, ...]  # All deviations from the nominal values are multiplied by these.
    statements: tuple[Violation, ...]  # One for each factor, with its interval and assumptions.
    margins: tuple[np.ndarray, ...]  # (runs,): Of the same points of the unit cube at each factor.
    confidence: float  # That an interval holds: of each by itself, or of all together.
    is_simultaneous: bool  # Which of the two.

    @property
    def table(self) -> pd.DataFrame:
        """One row per factor: violations, runs, rate, the interval's lower and upper end, and the
        least and the median margin."""
        rows = [
            {
                "violations": statement.violations,
                "runs": statement.runs,
                "rate": statement.violations / statement.runs,
                "lower": statement.lower,
                "upper": statement.upper,
                "least_margin": float(np.min(margins)),
                "median_margin": float(np.median(margins)),
            }
            for statement, margins in zip(self.statements, self.margins, strict=True)
        ]
        return pd.DataFrame(rows, index=pd.Index(self.factors, name="factor"))


@as_annotated
def degradation_curve(
    evaluate: Evaluate,
    space: Space,
    factors: Sequence[float],
    runs: int,
    *,
    entropy: int | None = None,
    confidence: float = 0.95,
    simultaneous: bool = False,
) -> Degradation:
    """Bound the probability of a violation with the laws scaled by several factors.

    At each factor rows are independent draws, and the interval is the exact two-sided one of
    Clopper and Pearson.  The same points of the unit cube serve all factors (common random
    numbers): differences along the curve are then not hidden by different draws, but the
    statements are not independent of each other.

    Parameters
    ----------
    evaluate : callable
        See `evaluation.Evaluate`.
    space : Space
        With nominal values, see `binding.resolved`.
    factors : sequence of float
        At least 0; at 0 all quantities are nominal and choices still vary.
    runs : int
        Number of rows at each factor.
    entropy : int, optional
        Of the draws; drawn itself if left out.
    confidence : float, optional
        Of the intervals, between 0 and 1.
    simultaneous : bool, optional
        By default each interval holds with this confidence by itself, and of many intervals some
        may miss.  True makes all of them hold together with at least this confidence, by widening
        each to 1 - (1 - confidence) / (number of factors) (Bonferroni).

    Raises
    ------
    ParameterError
        If there is no factor, or a number is out of range.
    SpaceError
        If a factor is negative, or a quantity has no nominal value.
    UsageError
        If a scaled value is refused by the loop, see `largest_scale.largest_scale`.
    KeyboardInterrupt
        If Ctrl-C kept rows from finishing.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Space, Uncertain, degradation_curve
    >>> space = Space(quantities=(Uncertain(name="a", bounds=(-1.0, 1.0), nominal=0.0),))
    >>> def margin(table):
    ...     return table.assign(spec=1.5 - table["a"].abs())
    >>> curve = degradation_curve(margin, space, [1.0, 2.0], runs=200, entropy=1)
    >>> [0.0 < statement.violations / 200 < 0.5 for statement in curve.statements]
    [False, True]
    """
    confidence = checked_confidence(confidence)
    simultaneous = flag("a degradation curve", "simultaneous", simultaneous)
    sizes = vector("a degradation curve", "factors", factors).tolist()
    if not sizes:
        raise ParameterError("a degradation curve needs at least one factor, got none")
    runs = integer("a degradation curve", "runs", runs, at_least=1)
    of_type("a degradation curve", "space", space, Space)
    entropy = checked_entropy(entropy)
    singly = 1 - (1 - confidence) / len(sizes) if simultaneous else confidence
    statements, margins = [], []
    for factor in sizes:
        design = independent(scaled(space, factor), runs, entropy)
        margins.append(evaluated(evaluate, design.table)["spec"].to_numpy(dtype=float))
        statements.append(violation_probability(design, margins[-1], singly, "both"))
    return Degradation(
        factors=tuple(sizes),
        statements=tuple(statements),
        margins=tuple(margins),
        confidence=confidence,
        is_simultaneous=simultaneous,
    )
