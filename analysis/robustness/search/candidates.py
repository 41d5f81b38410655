"""Which rows a search for the worst case runs next: corners, uniform draws, CMA-ES."""

import itertools
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pandas as pd

from ..uncertainty.design import with_row_numbers
from ..uncertainty.lattice import corners
from ..uncertainty.space import Space, ends, from_unit_cube
from .evaluation import Evaluate, evaluated, margins_of

_SHARE = 4  # corners, and uniform draws, take one part in this many of the runs each
BATCH = 64  # rows that run together
# CMA-ES has at least so many rows in a generation: they fill the lanes of two cores
GENERATION = 16
SPREAD = 0.25  # first standard deviation of CMA-ES, in units of the boxes
RESOLUTION = 1e-6  # a search ends where margins, or places in the unit cube, differ by less
EXTREME = 1e9  # CMA-ES, which needs finite numbers, sees margins up to this size


class Search:
    """The rows that were run so far."""

    def __init__(self, evaluate: Evaluate, space: Space, runs: int, target: float | None) -> None:
        self.evaluate, self.space, self.runs, self.target = evaluate, space, runs, target
        self.tables: list[pd.DataFrame] = []
        self.results: list[pd.DataFrame] = []
        self.searchers: list[str] = []
        self.margins = np.empty(0)

    @property
    def left(self) -> int:
        """How many rows may still be run; none once the target is met."""
        met = self.target is not None and np.any(self.margins <= self.target)
        return 0 if met else self.runs - self.margins.size

    @property
    def points(self) -> pd.DataFrame:
        """All rows."""
        return pd.concat(self.tables)

    def run(self, searcher: str, table: pd.DataFrame) -> np.ndarray:
        """Run rows, return their margins."""
        table = with_row_numbers(table, self.margins.size)
        return self._kept(searcher, table, evaluated(self.evaluate, table))

    def run_again(self, searcher: str, number: int) -> dict[str, Any]:
        """Count a row that is run once more, for what that yields besides; return it."""
        new = [self.margins.size]
        table, results = self.points.iloc[[number]], pd.concat(self.results).iloc[[number]]
        self._kept(searcher, table.set_axis(new), results.set_axis(new))
        return table.iloc[0].to_dict()

    def _kept(self, searcher: str, table: pd.DataFrame, results: pd.DataFrame) -> np.ndarray:
        margins = margins_of(results)
        self.tables.append(table)
        self.results.append(results)
        self.searchers += [searcher] * len(table)
        self.margins = np.concatenate([self.margins, margins])
        return margins


def search_worst(search: Search, rng: np.random.Generator) -> None:
    """Run rows until the budget is spent or the target met; see `worst_case.worst_case`."""
    space = search.space
    is_finite = not space.quantities or space.scale == 0  # the corners are everything
    share = search.runs if is_finite else max(search.runs // _SHARE, 1)
    has_all = corner_count(space) <= share
    some = corners(space).table if has_all else some_corners(space, share, rng)
    in_batches(search, "corners", some)
    if is_finite:
        return
    in_batches(search, "uniform", uniform(space, min(share, search.left), rng))
    for restart in itertools.count():
        size = int(max(GENERATION, 4 + 3 * np.log(len(space.quantities)))) << restart
        if size > search.left:
            break
        evolve(search, rng, size, is_first=restart == 0)
    in_batches(search, "uniform", uniform(space, search.left, rng))


def corner_count(space: Space) -> int:
    """Return the number of corners of the box, times that of combinations of choices."""
    return 2 ** len(space.quantities) * math.prod(len(c.options) for c in space.choices)


def some_corners(space: Space, count: int, rng: np.random.Generator) -> pd.DataFrame:
    """Return random corners of the box."""
    unit = rng.random((count, len(space.names)))
    d = len(space.quantities)
    unit[:, :d] = np.rint(unit[:, :d])
    return from_unit_cube(space, unit).drop_duplicates(ignore_index=True)


def uniform(space: Space, count: int, rng: np.random.Generator) -> pd.DataFrame:
    """Return uniform draws in the box."""
    return from_unit_cube(space, rng.random((count, len(space.names))))


def in_batches(search: Search, searcher: str, table: pd.DataFrame) -> None:
    """Run rows of a table until the target is met."""
    for first in range(0, len(table), BATCH):
        if search.left:
            search.run(searcher, table.iloc[first : first + min(BATCH, search.left)])


def evolve(
    search: Search, rng: np.random.Generator, size: int, *, is_first: bool, most: int | None = None
) -> None:
    """One search by CMA-ES with `size` rows in a generation, and `most` generations."""
    space, d = search.space, len(search.space.quantities)
    start = search.points.iloc[[np.argmin(search.margins)]] if is_first else uniform(space, 1, rng)
    labels = start[[choice.name for choice in space.choices]].iloc[0].to_dict()
    strategy = _strategy(unit_places(space, start)[0], size, rng)
    for generation in itertools.count():
        if strategy.stop() or search.left < size or generation == most:
            break
        proposed = strategy.ask()
        unit = np.full((size, len(space.names)), 0.5)
        unit[:, :d] = np.clip(proposed, 0.0, 1.0)[:, :d]
        margins = search.run("CMA-ES", from_unit_cube(space, unit).assign(**labels))
        with _quiet():
            strategy.tell(proposed, list(np.clip(margins, -EXTREME, EXTREME)))


def unit_places(space: Space, table: pd.DataFrame) -> np.ndarray:
    """Return the places of rows in their boxes, the opposite of `from_unit_cube`."""
    box = ends(space)
    low, high = box.to_numpy()
    inside = table[box.columns].to_numpy(dtype=float) - low
    wide = np.where(high > low, high - low, np.inf)  # an integer may have a single value
    return np.where(high > low, np.clip(inside / wide, 0.0, 1.0), 0.5)


def _strategy(start: np.ndarray, size: int, rng: np.random.Generator) -> Any:
    """Return CMA-ES in the unit cube, with random numbers of its own."""
    with _quiet():
        import cma  # late: it takes a second

        start = np.append(start, 0.5) if start.size == 1 else start  # needs two coordinates
        options = {
            "bounds": [0, 1],
            "popsize": size,
            "tolfun": RESOLUTION,
            "tolx": RESOLUTION,
            "verbose": -9,
            "seed": np.nan,  # leaves NumPy's global generator alone
            "randn": lambda *shape: rng.standard_normal(shape),
        }
        return cma.CMAEvolutionStrategy(start, SPREAD, options)


@contextmanager
def _quiet() -> Iterator[None]:
    """What CMA-ES warns of, such as flat margins, ends a search and is no news."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=r"cma\b")
        yield
