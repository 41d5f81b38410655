"""Machine code that encloses functions of a box, and what is asked of such functions."""

import ctypes
import functools
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
from ..purity.check import check_pure
from ..purity.values import FRESH, Impure
from .scalars import UnroundedGraph, scalar_expressions
from .writer import LANES, JudgedRows, enclosure_text, judged_rows


@dataclass(frozen=True, kw_only=True)
class BoxCode:
    """Machine code for functions of a box."""

    sides: int  # of the box
    expressions: tuple[Expr, ...]  # numbers, each a function of the sides
    rows: JudgedRows  # of what `judge` writes
    loaded: Loaded
    fixed: int = 0  # so many of the last sides are numbers, and have no width

    @property
    def judge(self) -> int:
        """Address of the function that a search calls, see `enclosures.writer`."""
        return self.loaded.addresses["judge"]

    @cached_property
    def _values(self) -> Any:
        kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_void_p)
        return kind(self.loaded.addresses["values"])

    def values(self, low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return bounds of the functions on boxes, by their natural extension."""
        # Shapes: `low, high` (boxes, sides); returns (boxes, results).
        count = len(low)
        ends = np.stack([low, high], axis=2).astype(float)  # (boxes, sides, 2)
        missing = -count % LANES
        if missing:
            ends = np.concatenate([ends, np.repeat(ends[:1], missing, axis=0)])
        batches = ends.reshape(-1, LANES, self.sides, 2).transpose(0, 2, 3, 1)
        batches = np.ascontiguousarray(batches)
        results = np.empty((len(batches), len(self.expressions), 2, LANES))
        for given, result in zip(batches, results, strict=True):
            self._values(given.ctypes.data, result.ctypes.data)
        flat = results.transpose(0, 3, 1, 2).reshape(-1, len(self.expressions), 2)[:count]
        return flat[..., 0], flat[..., 1]


def side_leaves(graph: Graph, sides: int) -> tuple[Tracer, ...]:
    """Return the sides of a box as numbers that a traced function may take."""
    return tuple(scalar(graph, graph.leaf("x", i, None)) for i in range(sides))


def expressions_of(function: Callable[..., Any], sides: int) -> tuple[Graph, list[Expr]]:
    """Return what a function of a tuple of numbers computes, as expressions of its numbers."""
    graph = UnroundedGraph({"x": sides})
    return graph, numbers_at(graph, function, side_leaves(graph, sides))


def numbers_at(graph: Graph, function: Callable[..., Any], sides: tuple[Tracer, ...]) -> list[Expr]:
    """Return what anybody's function of one tuple computes; see `expressions_of`."""
    try:
        check_pure(function, [FRESH])
    except Impure as error:
        raise Untraceable(f"it {error.reason}") from None
    return traced_numbers(graph, function, lambda: (sides,))


def traced_numbers(
    graph: Graph, function: Callable[..., Any], arguments: Callable[[], tuple[Any, ...]]
) -> list[Expr]:
    """Return the numbers that a pure function computes."""
    try:
        with np.errstate(all="ignore"):
            numbers = trace(graph, function, arguments)
    except Ambiguous as error:
        raise Untraceable(str(error)) from None
    return [numbers[i].only for i in range(numbers.size)]


def enclosed(
    results: Sequence[Expr], sides: int, fixed: int = 0, *, all_exist: bool = False
) -> BoxCode:
    """Make the machine code that encloses functions of a box."""
    # If all exist, nothing is bounded where one has no value: the least of numbers has none there.
    # Of conditions that are not to hold at once it is enough that one surely does not.
    with np.errstate(all="ignore"):  # of constants
        graph, numbers = scalar_expressions(results)
        gradients = [_gradient(graph, expr, sides, fixed) for expr in numbers]
    return BoxCode(
        sides=sides,
        expressions=tuple(numbers),
        rows=judged_rows(sides, len(numbers)),
        loaded=_loaded(enclosure_text(numbers, gradients, sides, all_exist)),
        fixed=fixed,
    )


@functools.lru_cache(maxsize=64)
def _loaded(text: str) -> Loaded:
    return finished(text, ("values", "judge"))


def _gradient(graph: Graph, expr: Expr, sides: int, fixed: int) -> list[Expr]:
    """Return the derivatives along each side; 0 for those without width, which nobody asks for."""
    zero, one = graph.const(0.0), graph.const(1.0)

    def along(i: int) -> Expr:
        (derivative,) = tangents(graph, [expr], lambda leaf: one if leaf.data[1] == i else None)
        return zero if derivative is None else derivative

    return [along(i) if i < sides - fixed else zero for i in range(sides)]
