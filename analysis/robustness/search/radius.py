"""How far the uncertainty may grow before a violation is found."""

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import fraction, integer, number, of_type
from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.names import unknown

from ..runs.experiment import Prepared
from ..statistics.guarantee import Violation, violation_probability
from ..uncertainty.binding import refusals
from ..uncertainty.design import checked_entropy, independent
from ..uncertainty.space import Space, combinations, nominal, scaled
from .evaluation import (
    Evaluate,
    as_table,
    evaluated,
    margins_at,
    margins_of,
    nearest_violation,
    row_text,
)
from .worst_case import worst_case


@as_annotated
def largest_scale(
    prepared: Prepared, at_most: float = 4.0, names: Collection[str] | None = None
) -> tuple[float, str]:
    """Return how far the boxes may be scaled before the loop refuses a value, and why.

    A block refuses its own parameters only, but several of them together: a backlash needs
    c_l < c_r.  So the corners of each block's own box are tried.  Where these are admissible,
    everything between them is: the rules of nlctl's blocks are linear, or say that a polynomial is
    Hurwitz (Kharitonov's theorem).  Of a block with more than 10 quantities only each end by
    itself and the corners of each pair are tried, the others nominal: a rule about three may then
    refuse a row later.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    at_most : float, optional
        Larger factors are not tried.
    names : collection of str, optional
        Quantities that are scaled, the others nominal; all by default.

    Returns
    -------
    factor : float
        To 10 digits; nothing that is tried is refused at this factor.
    reason : str
        Of the refusal that ends the sizes; empty if `at_most` is admissible.

    Raises
    ------
    ParameterError
        If `at_most` is not a finite number > 0, or the nominal values themselves are refused.
    UnknownNameError
        If the space has no quantity of such a name.

    Examples
    --------
    A dead zone needs b_r >= 0, so that a box of 0.5 +- 0.2 may grow to 2.5 times its size:

    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, eventually, in_band, largest_scale,
    ...     prepare,
    ... )
    >>> space = Space(quantities=(Uncertain(name="zone.b_r", bounds=(0.3, 0.7)),))
    >>> moves = Requirement(key="moves", formula=eventually(in_band("v", lower=0.01)), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"zone": nlctl.DeadZone(b_r=0.5)}),
    ...     spec=Spec(requirements=(moves,)), timepts=np.linspace(0, 1, 5), inputs=1.0,
    ... )
    >>> factor, reason = largest_scale(prepare(experiment))
    >>> print(round(factor, 6))
    2.5
    """
    of_type("a largest scale", "prepared", prepared, Prepared, "prepare(experiment)")
    factor, why = number("a largest scale", "at_most", at_most, above=0), ""
    space = prepared.experiment.space
    for name in () if names is None else names:
        if name not in space.names:
            raise unknown("quantity", str(name), space.names, "of a largest scale")
    systems = [loop.system for _, loop in prepared.loops]
    tries = list(refusals(space, systems, space.names if names is None else names))
    while (refusal := next((one for one in tries if one(factor)), None)) is not None:
        why = f"since at {factor:.4g} {refusal(factor)}"
        factor = _largest(refusal, factor)
    return factor, why and f"Sizes end at {factor:.4g} {why}"


def _largest(refusal: Callable[[float], str], refused: float) -> float:
    """Return the largest factor below a refused one that is not, by bisection from 0."""
    low, high = 0.0, refused
    while high - low > 1e-10 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if refusal(middle) else (middle, high)
    return low


# smallest size that is searched first, as a part of the largest; then twice that, and so on
START = 1 / 16
_SMALLEST = 1e-3  # smaller sizes are not searched, as a part of the largest
RAY = 12  # bisections along the ray to a witness


@described_record(eq=False, made_by="robustness_radius")
class Radius:
    """The smallest size of the uncertainty at which a violation was found; prints a sentence.

    Sizes are factors by which the box is scaled about the nominal values.
    """

    # A violation exists in the box of this size: the radius is at most that. Infinite if none was
    # found, 0 if the nominal values violate the spec.
    upper: float
    witness: Mapping[str, Any] | None  # The violating row, at the edge of that box.
    margin: float  # Of this row; NaN without one.
    # Largest size at which the search found nothing. That is not a bound: draws may have found a
    # violation there.
    searched: float
    # How likely a violation is at the size `searched`, from independent draws of the laws of that
    # size, which took no part in the search.
    statement: Violation | None
    largest: float  # Largest size that may be tried.
    notes: tuple[str, ...]  # Why it is the largest, and why there is no statement.
    # What was run: step ("nominal", "search", "ray"), size, lowest margin, runs.
    steps: pd.DataFrame

    @property
    def violates_at_nominal(self) -> bool:
        """Whether the nominal values violate the spec, with some option of every choice."""
        return self.upper == 0

    @property
    def runs(self) -> int:
        """Number of runs of the search, without the independent draws."""
        return sum(self.steps["runs"].tolist())

    def __str__(self) -> str:
        searched = f"the size {self.searched:.4g}"
        if self.violates_at_nominal:
            text = [
                f"The nominal values violate the spec (margin {self.margin:.4g}): "
                f"{row_text(self.witness or {})}. There is no robustness radius."
            ]
        elif self.witness is None:
            text = [f"No violation was found up to {searched}, which proves nothing."]
        else:
            text = [
                f"The robustness radius is at most {self.upper:.4g}: {row_text(self.witness)} "
                f"violates the spec (margin {self.margin:.4g})."
            ]
            if self.searched:
                text += [f"A search at {searched} found none, which proves nothing."]
        if self.statement:
            text += [f"Draws of that size: {self.statement}"]
        return " ".join([*text, *(f"{note}." for note in self.notes)])


def size_of(space: Space, row: Mapping[str, Any]) -> float:
    """Return the smallest factor by which the box must be scaled to hold a row."""
    # The largest deviation from nominal, each as a multiple of its side of the box.
    middle, sizes = nominal(space), [0.0]
    for quantity in space.quantities:
        low, high = quantity.box
        deviation = (row[quantity.name] - middle[quantity.name]) / space.scale
        side = (high if deviation > 0 else low) - middle[quantity.name]
        sizes.append(np.inf if deviation and not side else abs(deviation / (side or 1.0)))
    return float(np.max(sizes))


@as_annotated
def robustness_radius(
    evaluate: Evaluate,
    space: Space,
    largest: float = 4.0,
    *,
    limit: str = "",
    runs: int = 500,
    tolerance: float = 0.02,
    draws: int = 459,
    confidence: float = 0.99,
    entropy: int | None = None,
) -> Radius:
    """Search for the smallest box about the nominal values that holds a violation.

    The box of size rho has all sides multiplied by rho; these boxes are nested.  `worst_case` looks
    at growing sizes until it finds a violation, and then between the last size without one and the
    violation.  Each violation is first moved towards nominal along its ray by bisection, so that
    the result is a violating row at the edge of its box.  All searches use the same points of the
    unit cube (common random numbers).

    Parameters
    ----------
    evaluate : callable
        See `evaluation.Evaluate`.
    space : Space
        With nominal values, see `binding.resolved`.  Choices are not scaled: every option is
        searched at every size.
    largest : float, optional
        Largest size; for a loop from `largest_scale.largest_scale`.
    limit : str, optional
        Why no larger one, for the text.
    runs : int, optional
        Of the search at each size.
    tolerance : float, optional
        It ends when the largest size without a violation found is that close, relatively, or at a
        thousandth of `largest`.
    draws : int, optional
        Independent draws for the statement; 459, without a violation, bound its probability by
        1 % with confidence 99 %, see `runs_needed`.  0 leaves it out.
    confidence : float, optional
        Of the statement from `draws`, between 0 and 1.
    entropy : int, optional
        Of searches and draws; drawn itself if left out.

    Raises
    ------
    ParameterError
        If a number is out of range.
    SpaceError
        If a quantity has no nominal value.
    KeyboardInterrupt
        If Ctrl-C kept rows from finishing.

    Examples
    --------
    The margin a + b - 1 is 0 where both are 0.5, half way from 1 to the ends of a box of size 1:

    >>> from nlctl.analysis.robustness import Space, Uncertain, robustness_radius
    >>> a = Uncertain(name="a", bounds=(0.0, 2.0), nominal=1.0)
    >>> b = Uncertain(name="b", bounds=(0.0, 2.0), nominal=1.0)
    >>> def margin(table):
    ...     return table.assign(spec=table["a"] + table["b"] - 1.0)
    >>> found = robustness_radius(margin, Space(quantities=(a, b)), runs=40, draws=0, entropy=1)
    >>> 0.5 <= found.upper <= 0.52
    True
    """
    who = "a robustness radius"
    of_type(who, "space", space, Space)
    runs = integer(who, "runs", runs, at_least=1)
    draws = integer(who, "draws", draws, at_least=0)
    fraction(who, "tolerance", tolerance)
    fraction(who, "confidence", confidence)
    number(who, "largest", largest, above=0)
    number(who, "scale", space.scale, above=0)
    search = _Search(evaluate, space, runs, checked_entropy(entropy))
    search.at_nominal()
    size = largest * START
    while search.upper == np.inf and search.searched < largest:
        search.at(min(size, largest))
        size *= 2
    while max(_SMALLEST * largest, search.low / (1 - tolerance)) < search.upper < np.inf:
        search.at((search.low + search.upper) / 2)
    statement, missing = _drawn(search, draws, confidence)
    return Radius(
        upper=search.upper,
        witness=search.witness,
        margin=search.margin,
        searched=search.searched,
        statement=statement,
        largest=float(largest),
        notes=tuple(note for note in (limit, missing) if note),
        steps=pd.DataFrame(search.steps, columns=["step", "size", "margin", "runs"]),
    )


class _Search:
    """The best violation so far, the sizes that were searched, and where bisection resumes."""

    def __init__(self, evaluate: Evaluate, space: Space, runs: int, entropy: int) -> None:
        self.evaluate, self.space, self.runs, self.entropy = evaluate, space, runs, entropy
        self.upper, self.low, self.searched, self.margin = np.inf, 0.0, 0.0, np.nan
        self.witness: dict[str, Any] | None = None
        self.steps: list[tuple[str, float, float, int]] = []

    def at_nominal(self) -> None:
        """Look at the nominal values with every combination of choices."""
        middle = nominal(self.space)
        rows = as_table(self.space, [middle | labels for labels in combinations(self.space)])
        margins = margins_of(evaluated(self.evaluate, rows))
        worst = int(np.argmin(margins))
        self.steps.append(("nominal", 0.0, margins[worst], len(rows)))
        if not margins[worst] > 0:
            self._keep(rows.iloc[worst].to_dict(), margins[worst])

    def at(self, size: float) -> None:
        """Search the box of a size; a violation becomes the upper bound."""
        box = scaled(self.space, size)
        worst = worst_case(self.evaluate, box, self.runs, entropy=self.entropy, target=0.0)
        if not worst.is_finished:
            raise KeyboardInterrupt
        self.steps.append(("search", size, worst.margin, worst.design.size))
        before = self.upper
        if worst.is_violated:
            self.along_ray(worst.witness, worst.margin)
        else:
            self.searched = size
        if self.upper == before:  # nothing, or an integer that was rounded out of the box
            self.low = size

    def along_ray(self, row: dict[str, Any], margin: float) -> None:
        """Move a violation towards nominal as far as bisection keeps it one."""
        margins = partial(margins_at, self.evaluate, self.space)
        row, margin = nearest_violation(margins, self.space, (row, margin), RAY)
        self.steps.append(("ray", size_of(self.space, row), margin, RAY))
        self._keep(row, margin)

    def _keep(self, row: dict[str, Any], margin: float) -> None:
        size = size_of(self.space, row)
        if size < self.upper:
            self.upper, self.witness, self.margin = size, row, float(margin)


def _drawn(search: _Search, draws: int, confidence: float) -> tuple[Violation | None, str]:
    """Return a statement from draws at the size that was searched, or why there is none."""
    if not draws or search.upper == 0:
        return None, ""
    if not search.searched:
        return None, "There is no statement: no size was searched without a violation"
    design = independent(scaled(search.space, search.searched), draws, search.entropy)
    try:
        margins = margins_of(evaluated(search.evaluate, design.table))
    except UsageError as error:
        return None, f"There is no statement: a draw was refused, {error}"
    worst = int(np.argmin(margins))
    if not margins[worst] > 0:
        search.along_ray(design.table.iloc[worst].to_dict(), margins[worst])
    return violation_probability(design, margins, confidence), ""
