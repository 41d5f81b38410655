"""Functions that make arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Tracer, full, mapped, traced
from ..graph import Expr, Graph, Untraceable
from ..operators import NO_INTEGER, elementwise
from ..protocols import is_asked_for_copies, parts_of_object, without_objects
from .complex_numbers import ComplexPair, holds_complex, paired
from .python_objects import PythonNumbers
from .shapes import by_moving
from .table import ARRAY_METHODS, is_traced, of

__all__: list[str] = []


def only_floats(dtype: object) -> None:
    """Refuse arrays of anything but floats."""
    if dtype not in (None, float, np.float64, "float", "float64", "f8", "d"):
        raise Untraceable(f"arrays of {dtype}")


def holds_traced(value: object) -> bool:
    """Whether there are expressions in a value, or in a list or tuple."""
    if isinstance(value, list | tuple):
        return any(map(holds_traced, value))
    return is_traced(value)


@of(np.zeros, np.empty, makes=True)
def _zeros(graph: Graph, shape: object, dtype: object = float) -> Any:
    """Return an array of zeros."""
    if dtype in (complex, np.complex128):
        return ComplexPair(graph, full(graph, shape, 0.0), full(graph, shape, 0.0))
    if dtype in (int, bool):
        return np.zeros(shape, dtype)
    only_floats(dtype)
    return full(graph, shape, 0.0)


@of(np.ones, makes=True)
def ones(graph: Graph, shape: object, dtype: object = float) -> Any:
    """Return an array of ones."""
    if dtype in (int, bool):
        return np.ones(shape, dtype)
    only_floats(dtype)
    return full(graph, shape, 1.0)


@of(np.full, makes=True)
def _filled(graph: Graph, shape: Any, value: Any, dtype: Any = None) -> Any:
    """Return an array of equal elements."""
    if not is_traced(value):
        constants = np.full(shape, value, dtype)
        return traced(graph, constants) if constants.dtype == float else constants
    only_floats(dtype)
    return full(graph, shape, value)


@of(np.zeros_like, np.empty_like, makes=True)
def zeros_like(graph: Graph, array: Any, dtype: Any = None) -> Any:
    """Return zeros in an array's shape."""
    only_floats(dtype)
    if not holds_traced(array):
        zeros = np.zeros_like(array, dtype=dtype)
        return traced(graph, zeros) if zeros.dtype == float else zeros
    array = traced(graph, array)
    if dtype is None:
        _ = array.dtype  # which refuses all but floats
    return full(graph, array.shape, 0.0)


@of(np.array, makes=True)
def array(
    graph: Graph, values: Any, dtype: Any = None, copy: bool = True, ndmin: int = 0,
    order: str = "K",
) -> Any:  # fmt: skip
    """Return numbers, lists and arrays as an array of its own, in whatever order of memory."""
    if is_asked_for_copies(values):
        if not copy or ndmin:
            raise Untraceable("an array of an object in another way")
        return asarray(graph, parts_of_object(values, copy=True), dtype)
    values = without_objects(values)
    if isinstance(values, PythonNumbers):
        return values.astype(dtype)
    if not copy and isinstance(values, Tracer) and not ndmin:
        return asarray(graph, values, dtype)
    if not holds_traced(values):
        result = np.array(values, dtype, ndmin=ndmin)
        if result.dtype != float:
            return result  # an array of integers rounds what it is assigned
        return traced(graph, result)
    if holds_complex(values):
        return paired(graph, values)
    if dtype in (int, np.int64, "int") and not ndmin:
        return whole_numbers(graph, traced(graph, values)).copy()
    only_floats(dtype)
    result = _of_floats(graph, traced(graph, values)).copy()
    if dtype is None and len({e.kind for e in result.values.flat}) > 1:
        raise Untraceable("an array of integers and truth values")
    if dtype is None and graph.mixed and all(map(graph.may_be_whole, result.values.flat)):
        raise Untraceable("an array of integers or floats, as the state decides")
    if dtype is not None:
        result = elementwise(graph, "add", result, 0.0)
    return (
        result.reshape((1,) * (ndmin - result.ndim) + result.shape)
        if result.ndim < ndmin
        else result
    )


def _of_floats(graph: Graph, array: Tracer) -> Tracer:
    """Return an array with floats throughout where one element is a float."""
    kinds = {e.kind for e in array.values.flat}
    if "f" not in kinds or len(kinds) == 1:
        return array
    cells = mapped(graph.number, array.cells)
    return Tracer(graph, cells, array.axis, array.length)


@of(np.ascontiguousarray, makes=True)
def ascontiguousarray(graph: Graph, values: object, dtype: object = None) -> Any:
    """Return an array as it is where it is contiguous, otherwise a copy."""
    array = asarray(graph, values, dtype)
    is_part = isinstance(array, Tracer) and array is values and array.ndim > 0
    return array.ravel().reshape(array.shape) if is_part else array


@of(np.asarray, np.asanyarray, np.asarray_chkfinite, makes=True)
def asarray(graph: Graph, values: object, dtype: object = None) -> Any:
    """Return an array as it is, anything else as an array."""
    values = without_objects(values)
    if isinstance(values, ComplexPair):
        return values
    if not isinstance(values, Tracer):
        return array(graph, values, dtype)
    if dtype is not None:
        only_floats(dtype)
        if any(e.kind != "f" for e in values.values.flat):
            return elementwise(graph, "add", values, 0.0)
    return values


@of(np.eye, makes=True)
def eye(graph: Graph, n: int, m: Any = None, k: int = 0, dtype: Any = float) -> Any:
    """Return a matrix with ones on a diagonal."""
    matrix = np.eye(n, m, k, dtype)
    return traced(graph, matrix) if matrix.dtype == float else matrix


@of(np.linspace)
def linspace(
    graph: Graph, start: object, stop: object, num: int = 50, endpoint: bool = True
) -> Tracer:
    """Return numbers at equal distances."""
    parts = num - 1 if endpoint else num
    start, stop = traced(graph, start), traced(graph, stop)
    step = (stop - start) / float(parts)
    places = traced(graph, np.arange(float(num))) * step + start
    if endpoint and num > 1:
        places[-1] = stop
    return places


def as_type(graph: Graph, values: Tracer, dtype: object, copy: bool = True) -> Tracer:
    """Return an array's elements in another type."""
    if dtype in (bool, np.bool_):
        return elementwise(graph, "ne", values, 0.0)
    if dtype in (int, np.int64, "int"):
        return whole_numbers(graph, values)
    only_floats(dtype)
    if not copy and all(e.kind == "f" for e in values.values.flat):
        return values
    return elementwise(graph, "add", values, 0.0).copy()


def whole_numbers(graph: Graph, values: Tracer) -> Tracer:
    """Return the integers that NumPy casts numbers to."""

    def cast(e: Expr) -> Expr:
        if e.kind != "f":
            return graph.integer(e)
        limit = graph.const(2.0**63)
        fits = graph.op("lt", graph.op("absolute", e), limit)
        lowest = graph.const(NO_INTEGER)
        return graph.integer(graph.op("select", fits, graph.op("trunc", e), lowest))

    cells = np.frompyfunc(cast, 1, 1)(values.cells)
    box = np.empty(np.shape(values.cells), dtype=object)
    box[...] = cells
    return Tracer(graph, box, values.axis, values.length)


def writable(graph: Graph, value: Any) -> Any:
    """Return numbers in a new array of NumPy's as an array that takes expressions."""
    numbers = type(value) is np.ndarray and value.dtype in (float, int)
    return traced(graph, value) if numbers and value.base is None and value.ndim else value


def written_into(graph: Graph, value: Any, array: Any) -> Any:
    """Return a value as an array of integers takes it: without what is behind the point."""
    if not isinstance(array, Tracer) or not array.values.size:
        return value
    if any(e.kind != "i" for e in array.values.flat):  # as the first one of floats says
        return value
    value = traced(graph, value)
    kinds = {e.kind for e in value.values.flat}
    if kinds == {"i"}:
        return value
    if value.size == 1 and value.is_array:
        raise Untraceable("an array of one float assigned to an array of integers")
    if not value.shape and kinds == {"f"}:
        fits = elementwise(graph, "lt", elementwise(graph, "absolute", value), -NO_INTEGER)
        graph.guard(fits.only, OverflowError)  # of NaN, too
    return whole_numbers(graph, value)


@of(np.ndenumerate)
def ndenumerate(graph: Graph, values: Any) -> Any:
    """Return pairs of a place and the element there."""
    array = traced(graph, values)
    return ((place, array[place]) for place in np.ndindex(array.shape))


class Joined:
    """``np.r_`` and ``np.c_``: arrays and numbers in brackets, next to each other."""

    def __init__(self, graph: Graph, real: Any) -> None:
        self.graph, self.real = graph, real

    def __getitem__(self, key: object) -> Any:
        parts = key if isinstance(key, tuple) else (key,)
        parts = [self.real[p] if isinstance(p, slice) else p for p in parts]
        if not any(map(holds_traced, parts)):
            return self.real[key]
        if any(isinstance(p, str) for p in parts):
            raise Untraceable("an index with a text")
        arrays = [traced(self.graph, p) for p in parts]
        if self.real is np.c_:
            return by_moving(np.column_stack)(self.graph, [a.reshape(-1) if a.ndim < 2 else a
                                                           for a in arrays])  # fmt: skip
        if all(a.ndim < 2 for a in arrays):
            from .shapes import hstack

            return hstack(self.graph, arrays)
        return by_moving(np.concatenate)(self.graph, [a.short() for a in arrays])


ARRAY_METHODS.update(astype=as_type, to_numpy=lambda _, values: values)  # of a column of pandas

# what is one expression, of the graph
_OF_GRAPHS = (
    (np.ones_like, lambda graph, array, dtype=None:
     elementwise(graph, "add", zeros_like(graph, array, dtype), 1.0)),
    (np.full_like, lambda graph, array, value, dtype=None:
     elementwise(graph, "add", zeros_like(graph, array, dtype), value)),
    (np.fromiter, lambda graph, values, dtype, count=-1: array(graph, list(values), dtype)),
    (np.copy, lambda graph, values: traced(graph, values).copy()),
    (np.identity, lambda graph, n, dtype=float: eye(graph, n, dtype=dtype)),
)  # fmt: skip
for _function, _written in _OF_GRAPHS:
    of(_function, makes=True)(_written)
