"""``np.matrix``: arrays of two axes, whose product is that of matrices."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..arrays import Computed, Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise, product, total
from .table import WRITTEN, enter, written_out

__all__: list[str] = []

_TWO = ("add", "sub", "mul", "div")


class NumpyMatrix(Computed):
    """A matrix: what NumPy makes of one is a matrix, too, or it is refused."""

    def __init__(self, graph: Graph, array: Tracer) -> None:
        if array.ndim > 2:
            raise ValueError("matrix must be 2-dimensional")
        array = array.short()
        self.graph, self.A = graph, array if array.ndim == 2 else array.reshape(1, -1)

    shape = property(lambda self: self.A.shape)
    size = property(lambda self: self.A.size)
    ndim = 2
    T = property(lambda self: self._as(self.A.T))
    H = T
    A1 = property(lambda self: self.A.reshape(-1))
    I = property(lambda self: self._as(_inverse(self.graph, self.A)))  # noqa: E741 (NumPy's name)

    def _as(self, array: Any) -> NumpyMatrix:
        return NumpyMatrix(self.graph, array)

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> Any:
        """Return an operation by its name, element by element, as functions of NumPy have it."""
        if name not in _TWO and len(operands) > 1:
            raise Untraceable(f"{name} of matrices")
        return self._as(elementwise(graph, name, *map(_opened, operands)))

    def __mul__(self, other: Any) -> NumpyMatrix:
        if _is_number(other):
            return self._as(elementwise(self.graph, "mul", self.A, other))
        return self._as(product(self.A, _matrix(self.graph, other).A))

    def __rmul__(self, other: Any) -> NumpyMatrix:
        if _is_number(other):
            return self * other
        return self._as(product(traced(self.graph, _opened(other)), self.A))

    dot = __mul__

    def __matmul__(self, other: Any) -> NumpyMatrix:
        return self._as(product(self.A, traced(self.graph, _opened(other))))

    def __rmatmul__(self, other: Any) -> NumpyMatrix:
        return self._as(product(traced(self.graph, _opened(other)), self.A))

    def __pow__(self, exponent: int) -> NumpyMatrix:
        return self._as(written_out(self.graph, np.linalg.matrix_power, self.A, exponent))

    def __getitem__(self, key: Any) -> Any:
        part = self.A[key]
        if not isinstance(part, Tracer):
            raise Untraceable("places of a matrix that are only known when it runs")
        keys = list(key) if isinstance(key, tuple) else [key]
        if part.ndim == 1 and len(keys) > 1 and not isinstance(keys[1], slice | list | np.ndarray):
            part = part.reshape(-1, 1)
        return self._as(part) if part.ndim else part

    def __setitem__(self, key: Any, value: Any) -> None:
        value = traced(self.graph, _opened(value))
        self.A[key] = value.reshape(self.A[key].shape) if value.shape else value

    def __iter__(self) -> Iterator[NumpyMatrix]:
        return (self[i] for i in range(len(self.A)))

    def __len__(self) -> int:
        return len(self.A)

    def sum(self, axis: int | None = None) -> Any:
        """Return the sum, or sums along an axis as a matrix."""
        sums = total(self.A, axis)
        return sums if axis is None else self._as(sums.reshape((1, -1) if axis % 2 == 0 else
                                                               (-1, 1)))  # fmt: skip

    def item(self, *place: Any) -> Tracer:
        """Return one element."""
        return self.A.reshape(-1)[place[0] if place else 0] if len(place) < 2 else self.A[place]

    def copy(self) -> NumpyMatrix:
        """Return a copy."""
        return self._as(self.A.copy())

    def tolist(self) -> list[list[Tracer]]:
        """Return lists of the elements."""
        return [list(row) for row in self.A]

    def flatten(self) -> NumpyMatrix:
        """Return a copy in one row."""
        return self._as(self.A.flatten())

    def reshape(self, *shape: Any) -> NumpyMatrix:
        """Return it in another shape."""
        return self._as(self.A.reshape(*shape))

    def as_array(self) -> Tracer:
        """Return its elements, which make a matrix no more."""
        return self.A

    getA = as_array  # NumPy's name
    getA1 = lambda self: self.A1  # noqa: E731
    transpose = lambda self: self.T  # noqa: E731
    ravel = lambda self: self._as(self.A.reshape(-1))  # noqa: E731

    def _asked(self, *_: Any) -> Any:
        raise Untraceable("what is asked of a whole matrix")

    __bool__ = __float__ = __int__ = __str__ = __repr__ = __format__ = __eq__ = __ne__ = _asked
    __lt__ = __le__ = __gt__ = __ge__ = _asked


def _opened(value: Any) -> Any:
    """Return a matrix as the array that it has, anything else as it is."""
    return value.A if isinstance(value, NumpyMatrix) else value


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) or (
        isinstance(value, Tracer) and not value.shape
    )


def _inverse(graph: Graph, array: Tracer) -> Any:
    name = np.linalg.inv if array.shape[0] == array.shape[1] else np.linalg.pinv
    return WRITTEN[name](graph, array)


def _matrix(graph: Graph, data: Any, dtype: Any = None, copy: bool = True) -> NumpyMatrix:
    """Return ``np.matrix`` of numbers, lists, arrays, or a text."""
    if isinstance(data, str):
        data = np.array(np.matrix(data))
    data = np.array(data) if isinstance(data, np.matrix) else _opened(data)
    array: Any = WRITTEN[np.array if copy else np.asarray](graph, data, dtype)
    return NumpyMatrix(graph, traced(graph, array))


def _of_matrices(function: Any) -> Callable[..., Any]:
    """Return a function of NumPy that returns a matrix where it is given one."""
    written = WRITTEN[function]

    def of_arrays(graph: Graph, *given: Any, **named: Any) -> Any:
        parts = [v for value in given for v in (value if isinstance(value, list | tuple) else
                                                [value])]  # fmt: skip
        if not any(isinstance(v, NumpyMatrix) for v in parts):
            return written(graph, *given, **named)
        arrays = [
            type(v)(map(_opened, v)) if type(v) in (list, tuple) else _opened(v) for v in given
        ]
        return NumpyMatrix(graph, traced(graph, written(graph, *arrays, **named)))

    return of_arrays


def _solved(graph: Graph, a: Any, b: Any) -> Any:
    """Return the solution of equations: a matrix where the right-hand side is one."""
    solution = _SOLVE(graph, _opened(a), _opened(b))
    return NumpyMatrix(graph, solution) if isinstance(b, NumpyMatrix) else solution


_SOLVE = WRITTEN[np.linalg.solve]
enter([np.linalg.solve], _solved)
for _function in (np.linalg.inv, np.linalg.pinv, np.transpose, np.concatenate, np.vstack, np.hstack,
                  np.kron, np.dot, np.matmul):  # fmt: skip
    enter([_function], _of_matrices(_function))
for _function in (np.array, np.asarray, np.linalg.det, np.trace, np.ravel, np.linalg.norm):
    _plain = WRITTEN[_function]
    _of = lambda graph, a, *rest, _plain=_plain, **named: _plain(graph, _opened(a), *rest, **named)  # noqa: E731
    enter([_function], _of)
enter([np.matrix], _matrix, makes=True)
enter(
    [np.asmatrix],
    lambda graph, data, dtype=None: (
        data if isinstance(data, NumpyMatrix) else _matrix(graph, data, dtype, copy=False)
    ),
    makes=True,
)
