"""The row with the lowest margin that a search finds; what it does not find proves nothing."""

import itertools
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number, of_type
from nlctl.attributes import described_record
from nlctl.wording import counted

from ..stl.spec import FAILED
from ..uncertainty.design import Design, checked_entropy, listed
from ..uncertainty.space import Space, from_unit_cube
from .candidates import (
    GENERATION,
    Search,
    corner_count,
    evolve,
    in_batches,
    search_worst,
    some_corners,
    uniform,
    unit_places,
)
from .evaluation import Evaluate, margins_of, row_text
from .first_order import FirstOrder, FirstOrderOf, lowest_nearby

_DRAWS = 4  # corners, and uniform draws, of each round
_CHANGES = (0, 1, 0, 2)  # of the simple signals of each round: they are constant apart
_GENERATIONS = 2  # of CMA-ES in each round
_STEPS = 4  # descents have at most so many steps
_SHORTEST = 1 / 256  # shortest step of a descent, in units of the boxes
_SHORTER = 4  # by what a step is shortened that did not go down
# The next step, also that of the next descent, is twice as long where one gains this part of what
# the first order says, and shorter where it gains less than the second one.
_TRUSTED, _DOUBTED = 0.5, 0.25
_SHORTEST_FIRST = 1 / 16  # descents begin with no shorter step
_RESTARTS = 5  # times that simple signals are drawn in each round
_KINDS = 3  # test signals before anything else, one of each kind: alternating, a step, constant
_MOST_CONSTANT = 16  # test signals that are constant
_STEPS_OF_ROUND = 40  # steps of one signal in each round
_MOST_STEPS = 128  # of these altogether
_APART = np.sqrt(2)  # times of steps differ by this factor, from one piece on
_PIECE = re.compile(r"(.*)\[(\d+)\]")


def search_with_derivatives(
    search: Search, rng: np.random.Generator, derivatives: FirstOrderOf
) -> list[str]:
    """Run rows until the budget is spent or the target met; return why derivatives ended."""
    reasons: dict[str, None] = {}
    tests = from_unit_cube(search.space, test_signals(search.space))
    pieces = _pieces(search.space)
    kinds = _KINDS if pieces else len(tests)
    _one_by_one(search, tests.iloc[:kinds])
    # of a loop that is nearly linear the first order is right in the whole box: few runs show it
    shortest = 1.0 if pieces else _SHORTEST
    radius = _descend(search, derivatives, reasons, 0, 1.0, shortest)
    steps = from_unit_cube(search.space, single_steps(search.space, rng))
    while search.left:
        for _ in range(_RESTARTS if pieces else 0):
            first = search.margins.size
            in_batches(search, "simple signals", _simple_signals(search.space, pieces, rng))
            radius = _descend(search, derivatives, reasons, first, radius)
        first = search.margins.size
        for k in range(0, min(len(steps), _STEPS_OF_ROUND), _DRAWS):
            in_batches(search, "steps", steps.iloc[k : k + _DRAWS])
        steps = steps.iloc[_STEPS_OF_ROUND:]
        _one_by_one(search, tests.iloc[kinds:])
        kinds = len(tests)
        draws = (("corners", some_corners), ("uniform", uniform))
        for searcher, draw in draws[len(pieces) > 0 :]:  # of pieces, steps are the simple corners
            in_batches(search, searcher, draw(search.space, min(_DRAWS, search.left), rng))
        radius = _descend(search, derivatives, reasons, first, radius)
        if search.left >= GENERATION:
            evolve(search, rng, GENERATION, is_first=True, most=_GENERATIONS)
    return list(reasons)


def _one_by_one(search: Search, tests: pd.DataFrame) -> None:
    """Run test signals in turn: few are needed, often."""
    for k in range(len(tests)):
        in_batches(search, "test signals", tests.iloc[[k]])


def test_signals(space: Space) -> np.ndarray:
    """Return points of the unit cube: signals that an engineer tries first."""
    # What has no pieces is in the middle. All signals alternate between their ends; all step up
    # halfway; all are constant at an end, at first at different ones, and from one to the next only
    # one of them changes; all are in the middle; all step down halfway.
    pieces = _pieces(space)
    groups = pieces or [[k] for k in range(len(space.quantities))]
    signals_found = []

    def add(values: Any) -> None:
        row = np.full(len(space.names), 0.5)
        for group, value in zip(groups, values, strict=True):
            row[group] = value
        signals_found.append(row)

    halves = [np.arange(len(group)) >= len(group) // 2 for group in groups]
    if pieces:
        add([1.0 - np.arange(len(group)) % 2 for group in groups])
        add([1.0 * half for half in halves])
    for code in itertools.islice(range(1 << min(len(groups), 30)), _MOST_CONSTANT):
        gray = code ^ (code >> 1)
        add([1.0 - ((gray >> i & 1) + i) % 2 for i in range(len(groups))])
    add([0.5] * len(groups))
    if pieces:
        add([1.0 - half for half in halves])
    return np.array(signals_found)


def single_steps(space: Space, rng: np.random.Generator) -> np.ndarray:
    """Return points of the unit cube, in random order: one signal steps from end to end."""
    # The others stay at an end. Times of steps are in a geometric sequence: what matters of a pulse
    # is its length, of any size.
    pieces = _pieces(space)
    many = 1 << min(max(len(pieces) - 1, 0), 7)  # combinations of the ends of the others
    rows = []
    for stepping, group in enumerate(pieces):
        count = int(np.log(len(group) - 1) / np.log(_APART) + 1e-9) + 1
        times = np.unique(np.rint(_APART ** np.arange(count)).astype(int))
        for at, rises, ends_of_others in itertools.product(times, (0.0, 1.0), range(many)):
            row, others = np.full(len(space.names), 0.5), pieces[:stepping] + pieces[stepping + 1 :]
            row[group] = np.where(np.arange(len(group)) < at, 1.0 - rises, rises)
            for i, other in enumerate(others):
                row[other] = ends_of_others >> i & 1
            rows.append(row)
    order = rng.permutation(len(rows))[:_MOST_STEPS]
    return np.array(rows).reshape(-1, len(space.names))[order]


def _pieces(space: Space) -> list[list[int]]:
    """Return the places of the pieces ``name[0]``, ``name[1]``, ... of each signal."""
    signals: dict[str, list[int]] = {}
    for place, quantity in enumerate(space.quantities):
        if (piece := _PIECE.fullmatch(quantity.name)) is not None:
            signals.setdefault(piece[1], []).append(place)
    return [places for places in signals.values() if len(places) > 1]


def _simple_signals(
    space: Space, pieces: list[list[int]], rng: np.random.Generator
) -> pd.DataFrame:
    """Draw rows whose signals change seldom: means of uniform draws of all pieces are alike."""
    unit = rng.random((len(_CHANGES), len(space.names)))
    for row, changes in zip(unit, _CHANGES, strict=True):
        for places in pieces:
            at = rng.choice(np.arange(1, len(places)), min(changes, len(places) - 1), replace=False)
            begun = (np.arange(len(places))[:, None] >= at).sum(axis=1)
            row[places] = rng.random(changes + 1)[begun]
    return from_unit_cube(space, unit)


def _descend(
    search: Search,
    derivatives: FirstOrderOf,
    reasons: dict[str, None],
    first: int,
    radius: float,
    shortest: float = _SHORTEST,
) -> float:
    """Go down from the worst row since the first one; return the radius that was last trusted."""
    if not search.left or not np.isfinite(search.margins[first:]).any():
        return radius
    number = first + int(np.argmin(search.margins[first:]))
    for _ in range(_STEPS):
        if search.left < 2 or radius < shortest:
            break
        row = search.run_again("derivatives", number)
        model = derivatives(row)
        if model.reason:
            reasons[model.reason] = None
        better = _step(search, model, row, search.margins[number], radius, shortest)
        if better is None:
            break
        number, radius = better
    return radius


def _step(
    search: Search,
    model: FirstOrder,
    row: Mapping[str, Any],
    margin: float,
    radius: float,
    shortest: float,
) -> tuple[int, float] | None:
    """Run rows that the first order calls lower until one is; return it and the next radius."""
    space = search.space
    place = unit_places(space, pd.DataFrame([row]))[0]
    while radius >= shortest and search.left:
        lower, predicted = lowest_nearby(model, place, radius)
        if not predicted < margin:
            return None
        unit = np.full(len(space.names), 0.5)
        unit[: lower.size] = np.clip(lower, 0.0, 1.0)
        labels = {choice.name: row[choice.name] for choice in space.choices}
        (new,) = search.run("gradient", from_unit_cube(space, unit[None, :]).assign(**labels))
        if new < margin:
            return search.margins.size - 1, _next_radius(radius, margin - new, margin - predicted)
        radius /= _SHORTER
    return None


def _next_radius(radius: float, gained: float, predicted: float) -> float:
    """Return how far the first order is followed next, by what it has gained and predicted."""
    if gained >= _TRUSTED * predicted:
        return min(1.0, 2 * radius)
    return radius if gained >= _DOUBTED * predicted else max(radius / _SHORTER, _SHORTEST_FIRST)


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
