"""Arrays of numbers of Python's own, as `np.frompyfunc` returns them."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..arrays import Computed, Tracer, python_number, scalar, traced
from ..graph import Graph, Untraceable
from .table import of

_OPERATORS = {"add": operator.add, "sub": operator.sub, "mul": operator.mul, "neg": operator.neg}


class PythonNumbers(Computed):
    """An array of objects, each a number."""

    def __init__(self, graph: Graph, cells: np.ndarray) -> None:
        self.graph, self.cells, self.shape = graph, cells, cells.shape

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> PythonNumbers:
        """Return what Python's operator makes of each number."""
        if name not in _OPERATORS:
            raise Untraceable(f"{name} of an array of objects")
        arrays = [_objects(graph, v) for v in operands]
        return PythonNumbers(graph, _called(_OPERATORS[name], *arrays))

    def astype(self, dtype: object, copy: bool = True) -> Tracer:
        """Return the array as one of floats."""
        if dtype not in (float, np.float64, "float", "float64", "d"):
            raise Untraceable("an array of objects as something else than floats")
        numbers = [scalar(self.graph, self.graph.number(traced(self.graph, v).only))
                   for v in self.cells.flat]  # fmt: skip
        return traced(self.graph, numbers).reshape(self.shape)

    def __iter__(self) -> Iterator[Any]:
        return iter(self.cells)

    def __getitem__(self, key: Any) -> Any:
        part = self.cells[key]
        return PythonNumbers(self.graph, part) if isinstance(part, np.ndarray) else part

    def __len__(self) -> int:
        return len(self.cells)


def _objects(graph: Graph, value: object) -> np.ndarray:
    """Return numbers as an array of objects, as NumPy hands them to Python."""
    if isinstance(value, PythonNumbers):
        return value.cells
    array = traced(graph, value).short()
    return _called(lambda e: python_number(graph, e), array.cells)


def _called(function: Callable[..., Any], *arrays: np.ndarray) -> np.ndarray:
    """Return what a function returns for each element."""
    shape = np.broadcast_shapes(*(a.shape for a in arrays))
    cells, rows = np.empty(shape, dtype=object), [np.broadcast_to(a, shape) for a in arrays]
    for place in np.ndindex(shape):
        cells[place] = function(*(row[place] for row in rows))
    return cells


@of(np.frompyfunc, makes=True)
def frompyfunc(graph: Graph, function: Callable[..., Any], nin: int, nout: int) -> Any:
    """Return a function of numbers, called for each element; of arrays it makes objects."""

    def of_each(*arguments: Any) -> Any:
        if nout != 1 or len(arguments) != nin:
            raise Untraceable("np.frompyfunc with other arguments")
        cells = _called(function, *(_objects(graph, a) for a in arguments))
        return PythonNumbers(graph, cells) if cells.shape else cells[()]

    return of_each
