"""The smallest part of a violating row that still violates the spec."""

import itertools
import math
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.wording import counted, some_of

from ..uncertainty.space import Space, checked_row, nominal
from .evaluation import Evaluate, margins_at, nearest_violation, row_text

_Row = dict[str, Any]
_BITS = 60  # after as many bisections two numbers are neighbours


@described_record(made_by="shrink")
class Shrunk:
    """A violation by few deviating quantities; printed, it is a sentence."""

    row: Mapping[str, Any]  # Violates the spec; all but `names` are nominal.
    margin: float  # Of this row.
    # What deviates. Each is needed: with any single one of them back at nominal, the spec holds.
    names: tuple[str, ...]
    of: int  # How many deviated at first.
    # Whether every smaller set of the first row's deviations was tried and holds; otherwise fewer
    # may suffice.
    is_fewest: bool
    runs: int

    def __str__(self) -> str:
        if not self.names:
            return f"The nominal values violate the spec, margin {self.margin:.4g}."
        why = "no fewer do" if self.is_fewest else "each of them is needed"
        kept = row_text({name: self.row[name] for name in self.names})
        return (
            f"{some_of(len(self.names), self.of, 'deviation', 'suffices', 'suffice')} for a "
            f"violation, and {why}: {kept} (margin {self.margin:.4g}, {counted(self.runs, 'run')})."
        )


@as_annotated
def shrink(
    evaluate: Evaluate, space: Space, row: Mapping[str, Any], *, steps: int = 10, most: int = 2000
) -> Shrunk:
    """Set as much of a violating row back to nominal as the violation bears.

    1. Deviations are set back one after the other, each time the one without which the margin is
       lowest, until every further one would make the spec hold: what is left is 1-minimal in the
       sense of Zeller and Hildebrandt (IEEE Trans. Softw. Eng. 28, 2002).
    2. Where the row has at most `most` smaller sets of deviations, all are tried from the smallest
       on: the first violation has the fewest of this row's deviations.
    3. Each number that is left is moved towards nominal by bisection as far as the spec stays
       violated, in the order of the space.  What has become needless by that is set back.

    Parameters
    ----------
    evaluate : callable
        See `evaluation.Evaluate`.
    space : Space
        With nominal values, see `binding.resolved`.
    row : mapping
        ``{name: value}``, such as `WorstCase.witness`.
    steps : int, optional
        Number of bisections for each number: to 2^-steps of its deviation.
    most : int, optional
        Largest number of runs that 2 may take.

    Raises
    ------
    UnknownNameError
        If the row lacks a quantity.
    ParameterError
        If the row does not violate the spec, or a number is out of range or not finite.
    SpaceError
        If a quantity has no nominal value.

    Examples
    --------
    Of two deviations one suffices, and 1 - a > 0.5 is needed of it:

    >>> from nlctl.analysis.robustness import Space, Uncertain, shrink
    >>> a = Uncertain(name="a", bounds=(0.0, 2.0), nominal=1.0)
    >>> b = Uncertain(name="b", bounds=(0.0, 2.0), nominal=1.0)
    >>> def margin(table):
    ...     return table.assign(spec=table["a"] - 0.5)
    >>> least = shrink(margin, Space(quantities=(a, b)), {"a": 0.0, "b": 2.0})
    >>> print(least.names, round(least.row["a"], 2), least.row["b"], least.is_fewest)
    ('a',) 0.5 1.0 True
    """
    of_type("shrinking", "space", space, Space)
    steps = integer("shrinking", "steps", steps, at_least=0, at_most=_BITS)
    most = integer("shrinking", "most", most, at_least=0)
    first = checked_row(space, row)
    task = _Task(evaluate, space)
    margin = task.margins([first])[0]
    if margin > 0:
        raise ParameterError(f"only a violation can be shrunk, this row has margin {margin:.4g}")
    few = _deleted(task, first)
    fewest, is_fewest = _fewest(task, first, len(task.deviating(few)), most)
    small = _scaled(task, few if fewest is None else fewest, steps)
    while (smaller := _deleted(task, small)) != small:
        small = _scaled(task, smaller, steps)
    return Shrunk(
        row=small,
        margin=float(task.margins([small])[0]),
        names=tuple(task.deviating(small)),
        of=len(task.deviating(first)),
        is_fewest=is_fewest,
        runs=task.runs,
    )


class _Task:
    """Counts the runs."""

    def __init__(self, evaluate: Evaluate, space: Space) -> None:
        self.evaluate, self.space, self.middle = evaluate, space, nominal(space)
        self.runs = 0

    def margins(self, rows: Sequence[_Row]) -> np.ndarray:
        self.runs += len(rows)
        return margins_at(self.evaluate, self.space, rows)

    def deviating(self, row: _Row) -> list[str]:
        return [name for name in self.space.names if row[name] != self.middle[name]]

    def without(self, row: _Row, names: Collection[str]) -> _Row:
        return row | {name: self.middle[name] for name in names}


def _deleted(task: _Task, row: _Row) -> _Row:
    """Set back one deviation after the other while the spec stays violated."""
    while names := task.deviating(row):
        rows = [task.without(row, [name]) for name in names]
        margins = task.margins(rows)
        best = int(np.argmin(margins))
        if margins[best] > 0:
            break
        row = rows[best]
    return row


def _fewest(task: _Task, row: _Row, size: int, most: int) -> tuple[_Row | None, bool]:
    """Try all sets of less than `size` deviations; return a violation, and whether it tried."""
    names = task.deviating(row)
    if sum(math.comb(len(names), count) for count in range(size)) > most:
        return None, False
    for count in range(size):
        kept = itertools.combinations(names, count)
        rows = [task.without(row, set(names) - set(some)) for some in kept]
        margins = task.margins(rows)
        best = int(np.argmin(margins))
        if not margins[best] > 0:
            return rows[best], True
    return None, True


def _scaled(task: _Task, row: _Row, steps: int) -> _Row:
    """Move one number after the other towards nominal by bisection."""
    for name in [q.name for q in task.space.quantities if q.name in task.deviating(row)]:
        row, _ = nearest_violation(task.margins, task.space, (row, np.nan), steps, [name])
    return row
