"""The row with the lowest margin that a search finds; what it does not find proves nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number, of_type
from nlctl.attributes import described_record
from nlctl.wording import counted

from ..stl.spec import FAILED
from ..uncertainty.design import Design, checked_entropy, listed
from ..uncertainty.space import Space
from .candidates import Search, corner_count, search_worst
from .descent import search_with_derivatives
from .evaluation import Evaluate, margins_of, row_text
from .first_order import FirstOrderOf


@described_record(eq=False, made_by="worst_case")
class WorstCase:
    """The rows that a search ran, and the worst of them; printed, it is a sentence."""

    # All rows in the order in which they ran. They were chosen by looking at earlier results, so
    # statements about probabilities refuse them.
    design: Design
    results: pd.DataFrame  # What was evaluated, by row.
    # (design.size,): What chose each row: ``"corners"``, ``"uniform"`` or ``"CMA-ES"``; with
    # derivatives also ``"test signals"``, ``"simple signals"``, ``"steps"`` and ``"gradient"``, and
    # ``"derivatives"`` for a row that was run once more, for its derivatives.
    searchers: np.ndarray
    is_finished: bool  # False if Ctrl-C ended the search.
    # Whether every corner of the box is among the rows; otherwise they are a random subset.
    all_corners: bool
    # Why there was none at some rows, or from some time on: there the other searchers did the work.
    without_derivative: tuple[str, ...] = ()

    @property
    def number(self) -> int:
        """Number of the worst row, the first of equals."""
        return int(np.argmin(margins_of(self.results)))

    @property
    def witness(self) -> dict[str, Any]:
        """The worst row."""
        return self.design.table.iloc[self.number].to_dict()

    @property
    def margin(self) -> float:
        """Its margin; NaN where that is what it got."""
        return float(self.results["spec"].iloc[self.number])

    @property
    def is_violated(self) -> bool:
        """Whether the worst row violates the spec."""
        return not self.margin > 0

    @property
    def found_by(self) -> str:
        """What chose the worst row."""
        return str(self.searchers[self.number])

    @property
    def runs(self) -> dict[str, int]:
        """Number of rows by what chose them."""
        names, counts = np.unique(self.searchers, return_counts=True)
        return dict(zip(map(str, names), map(int, counts), strict=True))

    @property
    def first_violation(self) -> int | None:
        """Number of the first row that violates the spec, None if none does."""
        low = np.flatnonzero(~(margins_of(self.results) > 0))
        return int(low[0]) if low.size else None

    @property
    def best_so_far(self) -> np.ndarray:
        """Lowest margin after each run."""
        return np.minimum.accumulate(margins_of(self.results))

    def __str__(self) -> str:
        some = "" if self.all_corners else "random "
        names = {"corners": f"{some}corners", "uniform": "uniform draws"}
        rows = ", ".join(f"{count} {names.get(name, name)}" for name, count in self.runs.items())
        ended = self.margin <= -FAILED
        size = "that of a run that did not reach its end" if ended else f"{self.margin:.4g}"
        lowest = (
            f"the lowest margin is {size} (row {self.number}, {self.found_by}): "
            f"{row_text(self.witness)}"
        )
        verdict = "A violation" if self.is_violated else "No violation, which proves nothing"
        said = f"{verdict}: of {counted(self.design.size, 'run')} ({rows}) {lowest}."
        if self.without_derivative:
            said += f" Not everywhere was there a derivative: {self.without_derivative[0]}."
        return said


@as_annotated
def worst_case(
    evaluate: Evaluate,
    space: Space,
    runs: int = 1000,
    *,
    entropy: int | None = None,
    target: float | None = None,
    derivatives: FirstOrderOf | None = None,
) -> WorstCase:
    """Search the box for the row with the lowest margin.

    Three searches, one after the other: the corners of the box with every combination of choices,
    where these are at most a quarter of the runs, otherwise that many random ones; uniform draws
    in the box, with choices by their weights, a quarter; and with the rest CMA-ES (Hansen,
    arXiv:1604.00772) on the margin.  CMA-ES starts from the worst row so far, and whenever it has
    come to an end from a random point with twice the population (Auger, Hansen, CEC 2005);
    choices stand still within one such search.  What is left of the runs is uniform draws.

    With `derivatives` the order is another one, for few runs: a test signal of each kind
    (quantities ``name[0]``, ``name[1]``, ... are the pieces of a signal: all alternate between
    their ends, all step halfway, all are constant at an end), a descent from the worst of them
    that ends where the first order fails, and then in turn signals drawn with few changes, five
    times with a descent from the worst of these, signals of which one steps from end to end and
    the others stay at one (each once, after a number of pieces in a geometric sequence), uniform
    draws and at first the other test signals, a descent from the worst of those, and CMA-ES; a
    space without signals has corners instead.  A descent moves all signals of a
    row along their derivatives, and goes where their margin would be lowest, by linear programs in
    a box that shrinks (`first_order.lowest_nearby`); the next descent begins with the box that
    could be trusted.  A run with derivatives counts as one run.

    Parameters
    ----------
    evaluate : callable
        See `evaluation.Evaluate`.
    space : Space
        Its boxes are searched; what a law may draw beyond its box is not.
    runs : int, optional
        Number of rows.
    entropy : int, optional
        Of all random numbers; the same entropy takes the same steps, and in a scaled space draws
        the same points of the unit cube.
    target : float, optional
        The search ends with the first batch that has a margin <= target; 0 ends it with the first
        violation.
    derivatives : callable, optional
        ``functools.partial(first_order, prepared)``: takes a row, returns its `FirstOrder`.

    Raises
    ------
    ParameterError
        If `runs` is not an integer >= 1, or an option of a choice has weight 0.
    KeyboardInterrupt
        If Ctrl-C comes before the first batch is done; later it ends the search.

    Examples
    --------
    The margin a + b - 1.5 is lowest in the corner (0.5, 0.5):

    >>> from nlctl.analysis.robustness import Space, Uncertain, worst_case
    >>> a = Uncertain(name="a", bounds=(0.5, 1.0), nominal=1.0)
    >>> b = Uncertain(name="b", bounds=(0.5, 1.0), nominal=1.0)
    >>> def margin(table):
    ...     return table.assign(spec=table["a"] + table["b"] - 1.5)
    >>> found = worst_case(margin, Space(quantities=(a, b)), runs=16, entropy=1)
    >>> print(found.margin, found.witness)
    -0.5 {'a': 0.5, 'b': 0.5}
    """
    of_type("a worst case", "space", space, Space)
    runs = integer("a worst case", "runs", runs, at_least=1)
    if target is not None and not (isinstance(target, float) and np.isinf(target)):
        number("a worst case", "target", target)
    entropy = checked_entropy(entropy)
    search = Search(evaluate, space, runs, target)
    is_finished, reasons = True, []
    try:
        if derivatives is None:
            search_worst(search, np.random.default_rng(entropy))
        else:
            reasons = search_with_derivatives(search, np.random.default_rng(entropy), derivatives)
    except KeyboardInterrupt:
        if not search.tables:
            raise
        is_finished = False
    searchers = np.array(search.searchers)
    return WorstCase(
        design=listed(space, "adaptive", search.points, entropy),
        results=pd.concat(search.results),
        searchers=searchers,
        is_finished=is_finished,
        all_corners=int(np.sum(searchers == "corners")) == corner_count(space),
        without_derivative=tuple(reasons),
    )
