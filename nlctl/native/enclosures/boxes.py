"""Machine code that encloses functions of a box, and what is asked of such functions."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...expressions.arrays import Tracer, scalar
from ...expressions.derivatives import tangents
from ...expressions.graph import Ambiguous, Expr, Graph, Untraceable
from ...expressions.trace import trace
from ..machine.finish import Loaded, finished
from ..thirdparty.purity import check_pure
from ..thirdparty.values import FRESH, Impure
from .scalars import scalar_expressions
from .writer import LANES, Rows, enclosure_text


@dataclass(frozen=True, kw_only=True)
class Enclosed:
    """Machine code for functions of a box.

    Attributes
    ----------
    sides : int
        Of the box.
    expressions : tuple of Expr
        Numbers, each a function of the sides.
    rows : Rows
        Of what `judge` writes.
    loaded : Loaded
    lanes : int
        Boxes at a time.
    """

    sides: int
    expressions: tuple[Expr, ...]
    rows: Rows
    loaded: Loaded
    lanes: int = LANES

    @property
    def judge(self) -> int:
        """Address of the function that a search calls, see `enclosures.writer`."""
        return self.loaded.addresses["judge"]

    @cached_property
    def _values(self) -> Any:
        kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
        return kind(self.loaded.addresses["values"])

    def values(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return bounds of the functions on boxes, by their natural extension.

        Parameters
        ----------
        low, high : ndarray of shape (boxes, sides)

        Returns
        -------
        low, high : ndarray of shape (boxes, results)
            Both not a number where a function may have no value.
        """
        count, lanes = len(low), self.lanes
        ends = np.stack([low, high], axis=2).astype(float)  # (boxes, sides, 2)
        missing = -count % lanes
        if missing:
            ends = np.concatenate([ends, np.repeat(ends[:1], missing, axis=0)])
        batches = ends.reshape(-1, lanes, self.sides, 2).transpose(0, 2, 3, 1)
        batches = np.ascontiguousarray(batches)
        found = np.empty((len(batches), self.rows.results, 2, lanes))
        for given, result in zip(batches, found, strict=True):
            self._values(given.ctypes.data, result.ctypes.data)
        flat = found.transpose(0, 3, 1, 2).reshape(-1, self.rows.results, 2)[:count]
        return flat[..., 0], flat[..., 1]


def expressions_of(function: Callable[..., Any], sides: int) -> list[Expr]:
    """Return what a function of a tuple of numbers computes, as expressions of its numbers.

    Raises
    ------
    Untraceable
        If it is not a function of its arguments alone, or does what expressions cannot say.
    """
    graph = Graph({"x": sides})
    try:
        check_pure(function, [FRESH])
    except Impure as error:
        raise Untraceable(f"it {error.reason}") from None
    given = lambda: (tuple(scalar(graph, graph.leaf("x", i, None)) for i in range(sides)),)  # noqa: E731
    try:
        with np.errstate(all="ignore"):
            found = trace(graph, function, given)
    except Ambiguous as error:
        raise Untraceable(str(error)) from None
    return numbers_of(found)


def numbers_of(found: Tracer) -> list[Expr]:
    """Return the elements of an array of one dimension."""
    return [found[i].only for i in range(found.size)]


def enclosed(results: Sequence[Expr], sides: int) -> Enclosed:
    """Make the machine code that encloses functions of a box.

    Parameters
    ----------
    results : sequence of Expr
        Numbers, made of the leaves ``x[0], ..., x[sides - 1]``.
    sides : int
        Of the box, at least one.

    Raises
    ------
    Untraceable
        If there is no enclosure of what they are made of.
    """
    graph, numbers = scalar_expressions(results)
    gradients = [_gradient(graph, expr, sides) for expr in numbers]
    text = enclosure_text(numbers, gradients, sides)
    return Enclosed(
        sides=sides,
        expressions=tuple(numbers),
        rows=Rows(sides=sides, results=len(numbers)),
        loaded=finished(text, ("values", "judge")),
    )


def _gradient(graph: Graph, expr: Expr, sides: int) -> list[Expr]:
    """Return the derivatives along each side."""
    zero, one = graph.const(0.0), graph.const(1.0)

    def along(i: int) -> Expr:
        (found,) = tangents(graph, [expr], lambda leaf: one if leaf.data[1] == i else None)
        return zero if found is None else found

    return [along(i) for i in range(sides)]
