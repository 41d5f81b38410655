"""Where in the plane of two quantities a spec fails: margins, dense along the boundary."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from scipy.spatial import Delaunay

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import check_known

from ..uncertainty.design import affordable, with_row_numbers
from ..uncertainty.space import Space, ends, from_unit_cube, nominal
from .evaluation import Evaluate, evaluated, margins_of

_Cell = tuple[int, int, int]  # lower left corner and side, in steps of the finest grid
# a cell is near the boundary if its least |margin| is below this part of their range in it
CLOSE = 0.5
_FINEST = 30  # divisions beyond which the finest cells are no wider than rounding
_WORK = 40  # what a point of the first grid takes next to its row, in numbers
NEW = 5  # points that the refinement of a cell adds at most


@described_record(eq=False, made_by="failure_map")
class FailureMap:
    """Margins over the plane of two quantities."""

    x: str  # Names of the quantities.
    y: str
    # One row per point: the columns of the space, ``spec`` and the round in which it was added.
    # Points were chosen by looking at earlier ones, so their failing share is not a probability.
    table: pd.DataFrame
    # (k, 3): Rows of the table that form a triangulation of the box, for
    # `matplotlib.pyplot.tricontour` and the like.
    triangles: np.ndarray
    # Sides of the cells at the boundary: how sharp it is, where cells were fine enough to see it.
    cell: tuple[float, float]
    is_finished: bool  # False if `most` ended the refinement.


@as_annotated
def failure_map(
    evaluate: Evaluate,
    space: Space,
    x: str,
    y: str,
    *,
    at: Mapping[str, Any] | None = None,
    cells: int = 8,
    levels: int = 4,
    most: int = 4000,
) -> FailureMap:
    """Take margins on a grid over the box of two quantities, and refine it where the sign changes.

    A cell is divided into four if its corners differ in sign, or if its least |margin| is below
    half of the margins' range in it, where the boundary may pass between the corners.  Margins
    beyond +-1, such as those of runs that diverged, count as +-1 in that.  Rounds follow until no
    cell needs it; all new points of a round run together.

    Parameters
    ----------
    evaluate : callable
        See `evaluation.Evaluate`.
    space : Space
        Quantities with their boxes, and choices.
    x, y : str
        Names of two quantities.
    at : mapping, optional
        Values of the others; what it leaves out is nominal.
    cells : int, optional
        Number of cells along each axis of the first grid.
    levels : int, optional
        How often a cell is divided at most.
    most : int, optional
        Largest number of runs; the first grid always runs.

    Raises
    ------
    UnknownNameError
        If the space has no such quantity.
    ParameterError
        If the two are the same, or a number is out of range.
    SpaceError
        If a quantity that is not given has no nominal value.
    KeyboardInterrupt
        If Ctrl-C kept rows from finishing.

    Examples
    --------
    The margin 1 - a^2 - b^2 is 0 on a circle; cells end at 1.5 / (8 * 2^4):

    >>> from nlctl.analysis.robustness import Space, Uncertain, boundary, failure_map
    >>> box = (Uncertain(name="a", bounds=(0.0, 1.5)), Uncertain(name="b", bounds=(0.0, 1.5)))
    >>> def margin(table):
    ...     return table.assign(spec=1 - table["a"] ** 2 - table["b"] ** 2)
    >>> made = failure_map(margin, Space(quantities=box), "a", "b")
    >>> made.is_finished, [round(side, 6) for side in made.cell]
    (True, [0.011719, 0.011719])
    >>> points = boundary(made)
    >>> bool(((points["a"] ** 2 + points["b"] ** 2 - 1).abs() < 1e-2).all())
    True
    """
    who = "a failure map"
    of_type(who, "space", space, Space)
    given = _given(space, (x, y), {} if at is None else of_type(who, "at", at, Mapping))
    cells = integer(who, "cells", cells, at_least=1)
    levels = integer(who, "levels", levels, at_least=0, at_most=_FINEST)
    most = integer(who, "most", most, at_least=0)
    affordable("the first grid of a failure map", (cells + 1) ** 2, len(space.names) + _WORK)
    plane = _Plane(evaluate, space, (x, y), given, cells << levels)
    side = 1 << levels
    leaves = {(i * side, j * side, side) for i in range(cells) for j in range(cells)}
    plane.add(leaves)
    while chosen := plane.near_boundary(leaves)[: max(most - len(plane.margins), 0) // NEW]:
        quarters = {quarter for cell in chosen for quarter in _quarters(cell)}
        plane.add(quarters)
        leaves = leaves - set(chosen) | quarters
    low, high = ends(space)[[x, y]].to_numpy()
    x_side, y_side = ((high - low) / plane.steps).tolist()
    return FailureMap(
        x=x,
        y=y,
        table=plane.table,
        triangles=Delaunay(np.array(list(plane.margins), dtype=float)).simplices,
        cell=(x_side, y_side),
        is_finished=not plane.near_boundary(leaves),
    )


def _given(space: Space, axes: tuple[str, str], at: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of the row that the map goes through."""
    quantities = [quantity.name for quantity in space.quantities]
    for name in axes:
        check_known("quantity", name, quantities, "for an axis of a failure map")
    for name in at:
        check_known("quantity", name, space.names, "of the row that a failure map goes through")
    for name in (name for name in at if name in quantities):
        number("a failure map", f"'{name}'", at[name])
    if axes[0] == axes[1]:
        raise ParameterError(f"a failure map needs two quantities, got '{axes[0]}' twice")
    others = [name for name in space.names if name not in axes and name not in at]
    return dict(at) | ({name: nominal(space)[name] for name in others} if others else {})


class _Plane:
    """Margins at the points of a grid, by their whole-number coordinates."""

    def __init__(
        self,
        evaluate: Evaluate,
        space: Space,
        axes: tuple[str, str],
        given: Mapping[str, Any],
        steps: int,
    ) -> None:
        self.evaluate, self.space, self.axes, self.given = evaluate, space, axes, given
        self.steps = steps
        self.margins: dict[tuple[int, int], float] = {}
        self.tables: list[pd.DataFrame] = []

    @property
    def table(self) -> pd.DataFrame:
        """All points in the order in which they were added."""
        return pd.concat(self.tables, ignore_index=True)

    def add(self, cells: Iterable[_Cell]) -> None:
        """Run the corners of cells that were not run before."""
        new = sorted({point for cell in cells for point in _corners(cell)} - self.margins.keys())
        unit = np.full((len(new), len(self.space.names)), 0.5)
        for name, coordinates in zip(self.axes, np.transpose(new), strict=True):
            unit[:, self.space.names.index(name)] = coordinates / self.steps
        others = {k: v for k, v in self.given.items() if k not in self.axes}
        rows = with_row_numbers(
            from_unit_cube(self.space, unit).assign(**others), len(self.margins)
        )
        results = evaluated(self.evaluate, rows)
        self.margins |= zip(new, margins_of(results), strict=True)
        self.tables.append(rows.assign(spec=results["spec"].to_numpy(), round=len(self.tables)))

    def near_boundary(self, cells: Iterable[_Cell]) -> list[_Cell]:
        """Return the cells to be divided, those with the least |margin| first."""
        chosen = []
        for cell in cells:
            points = (*_corners(cell), *_edges(cell))
            computed = [self.margins[point] for point in points if point in self.margins]
            margins = np.clip(computed, -1.0, 1.0)
            low, high = float(np.min(margins)), float(np.max(margins))
            least = float(np.min(np.abs(margins)))
            if cell[2] > 1 and (low <= 0 < high or least < CLOSE * (high - low)):
                chosen.append((least, cell))
        return [cell for _, cell in sorted(chosen)]


def _corners(cell: _Cell) -> tuple[tuple[int, int], ...]:
    i, j, side = cell
    return (i, j), (i + side, j), (i, j + side), (i + side, j + side)


def _edges(cell: _Cell) -> tuple[tuple[int, int], ...]:
    """Middles of the edges: there are margins where a neighbour is finer."""
    i, j, side = cell
    half = side // 2
    return (i + half, j), (i, j + half), (i + side, j + half), (i + half, j + side)


def _quarters(cell: _Cell) -> tuple[_Cell, ...]:
    i, j, side = cell
    half = side // 2
    return tuple((i + k * half, j + m * half, half) for k in range(2) for m in range(2))


@as_annotated
def boundary(made: FailureMap) -> pd.DataFrame:
    """Return points on the boundary: where margins connected by lines along the triangles are 0.

    Margins beyond +-1 count as +-1.

    Parameters
    ----------
    made : FailureMap
        As `failure_map` returns it.

    Returns
    -------
    pandas.DataFrame
        Columns by the names of the two quantities.

    Raises
    ------
    ParameterError
        If it is not a `FailureMap`.

    Examples
    --------
    See `failure_map`.
    """
    of_type("a boundary", "made", made, FailureMap, "failure_map(...)")
    edges = np.sort(made.triangles[:, [[0, 1], [1, 2], [0, 2]]].reshape(-1, 2), axis=1)
    edges = np.unique(edges, axis=0)
    margins = np.clip(margins_of(made.table), -1.0, 1.0)[edges]
    crossed = (margins > 0).sum(axis=1) == 1
    start, end = margins[crossed].T
    part = (start / (start - end))[:, None]
    places = made.table[[made.x, made.y]].to_numpy(dtype=float)[edges[crossed]]
    return pd.DataFrame((1 - part) * places[:, 0] + part * places[:, 1], columns=[made.x, made.y])
