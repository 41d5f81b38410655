"""NumPy's own functions on arrays of expressions.

NumPy's arrays of objects take whatever has operators.  So what NumPy computes by moving elements,
adding and multiplying, it computes here as well, in its own order: `by_numpy` hands it the
expressions individually and collects what comes out.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Special, Tracer, as_array, scalar
from ..graph import Expr, Graph, Untraceable
from ..operators import elementwise


class _Cell:
    """One expression, as an element of an array of objects."""

    __slots__ = ("expr", "graph")

    def __init__(self, graph: Graph, expr: Expr) -> None:
        self.graph, self.expr = graph, expr

    def conjugate(self) -> _Cell:
        """Return itself: numbers are real."""
        return self

    def __bool__(self) -> bool:
        return bool(scalar(self.graph, self.expr))


def _operator(name: str, reflected: bool = False) -> Callable[..., Any]:
    function = getattr(operator, name)

    def method(self: _Cell, *other: object) -> Any:
        if other and isinstance(other[0], np.ndarray):
            if other[0].ndim:
                return NotImplemented
            other = (other[0][()],)
        mine = scalar(self.graph, self.expr)
        theirs = [scalar(self.graph, v.expr) if isinstance(v, _Cell) else v for v in other]
        result = function(*theirs, mine) if reflected else function(mine, *theirs)
        return _Cell(self.graph, result.only)

    return method


def _function(name: str) -> Callable[[_Cell], _Cell]:
    def method(self: _Cell) -> _Cell:
        return _Cell(self.graph, elementwise(self.graph, name, scalar(self.graph, self.expr)).only)

    return method


for _name in ("add", "sub", "mul", "truediv", "pow", "mod"):
    setattr(_Cell, f"__{_name}__", _operator(f"__{_name}__"))
    setattr(_Cell, f"__r{_name}__", _operator(f"__{_name}__", reflected=True))
for _name in ("lt", "le", "gt", "ge", "eq", "ne", "neg", "abs", "and", "or", "xor", "invert"):
    setattr(_Cell, f"__{_name}__", _operator(f"__{_name}__"))
for _name in ("sqrt", "exp", "log", "sin", "cos", "tan", "arctan", "floor", "ceil", "rint"):
    setattr(_Cell, _name, _function(_name))
_Cell.__hash__ = None  # type: ignore[assignment]


def unrolled(value: object) -> Any:
    """Return a value with arrays of objects for arrays of expressions."""
    if isinstance(value, Special):
        raise Untraceable(f"{type(value).__name__} instead of an array")
    if isinstance(value, Tracer):
        cells = np.frompyfunc(lambda e: _Cell(value.graph, e), 1, 1)(value.elements())
        return cells if value.shape else as_array(cells)[()]
    if isinstance(value, list | tuple):
        parts = [unrolled(v) for v in value]
        return parts if isinstance(value, list) else tuple(parts)
    return value


def rolled(graph: Graph, value: object) -> Any:
    """Return what a function of NumPy has made of `unrolled` values as arrays of expressions."""
    if isinstance(value, _Cell):
        return scalar(graph, value.expr)
    if isinstance(value, list | tuple):
        parts = [rolled(graph, v) for v in value]
        fields = hasattr(value, "_fields")
        return type(value)(*parts) if fields else type(value)(parts)
    if not isinstance(value, np.ndarray) or value.dtype != object:
        return value
    cells = np.frompyfunc(lambda v: _expression(graph, v), 1, 1)(value)
    return Tracer(graph, as_array(_of_one_kind(graph, as_array(cells))))


def _expression(graph: Graph, value: object) -> Expr:
    if isinstance(value, _Cell):
        return value.expr
    if not isinstance(value, bool | int | float | np.bool_ | np.integer | np.floating):
        raise Untraceable(f"an array that holds {type(value).__name__}")
    return graph.const(value)


def _of_one_kind(graph: Graph, cells: np.ndarray) -> np.ndarray:
    """Return elements of one kind: an array that holds a float holds floats."""
    kinds = {e.kind for e in cells.flat}
    if len(kinds) < 2 or "f" not in kinds:
        return cells
    return as_array(np.frompyfunc(graph.number, 1, 1)(cells))


def by_numpy(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of NumPy for arrays of expressions."""

    def written(graph: Graph, *arguments: object, **options: object) -> Any:
        named = {name: unrolled(v) for name, v in options.items()}
        return rolled(graph, function(*map(unrolled, arguments), **named))

    return written
