"""Functions that move elements, or that only add and multiply them: NumPy does it itself."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, concatenated, python_number, scalar, traced
from ..graph import Expr, Graph, Untraceable
from ..masked import Masked
from ..operators import elementwise, product
from .cells import by_numpy
from .complex_numbers import holds_complex, paired_product
from .table import ARRAY_METHODS, enter, of

__all__: list[str] = []

# functions that move elements
_MOVING = (
    np.hsplit, np.vsplit, np.dsplit, np.transpose, np.swapaxes,
    np.moveaxis, np.rollaxis, np.squeeze, np.expand_dims, np.atleast_2d, np.atleast_3d, np.flip,
    np.fliplr, np.flipud, np.rot90, np.diagonal, np.diag, np.diagflat, np.broadcast_to,
    np.broadcast_arrays, np.stack, np.vstack, np.column_stack, np.dstack, np.tile,
    np.repeat, np.insert, np.delete, np.tril, np.triu, np.resize,
    np.meshgrid, np.take_along_axis, np.compress, np.ix_, np.matrix_transpose,
    np.lib.stride_tricks.sliding_window_view,
)  # fmt: skip
# functions that add and multiply
_COMPUTING = (
    np.convolve, np.correlate, np.kron, np.cross, np.trace,
    np.inner, np.vdot, np.tensordot, np.linalg.multi_dot, np.linalg.matrix_power, np.cumsum,
    np.cumprod, np.trapezoid, np.polyval, np.vander, np.polyder, np.polyadd, np.polymul,
    np.polysub, np.ediff1d, np.linalg.cross, np.linalg.outer, np.linalg.trace,
    np.linalg.vecdot, np.linalg.tensordot, np.cumulative_sum, np.cumulative_prod,
)  # fmt: skip


def by_moving(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of NumPy that moves elements; a view where NumPy's is one."""

    def written(graph: Graph, *arguments: object, **options: object) -> Any:
        owners: list[Tracer] = []
        given = [_opened(v, owners) for v in arguments]
        named = {k: _opened(v, owners) for k, v in options.items()}
        long = next((a for a in owners if a.axis is not None or a.origin is not None), None)
        return _closed(graph, function(*given, **named), long)

    return written


def _opened(value: object, owners: list[Tracer]) -> Any:
    if isinstance(value, list | tuple):
        parts = [_opened(v, owners) for v in value]
        return parts if isinstance(value, list) else tuple(parts)
    if not isinstance(value, Tracer):
        return value
    if value.shape and all(e.op == "const" and e.kind != "f" for e in value.values.flat):
        return np.array([e.value if e.kind == "i" else e.data for e in value.values.flat]).reshape(
            value.shape
        )
    if not value.shape and value.only.kind == "i":
        return value.__index__()  # pyright: ignore[reportAttributeAccessIssue] (each is followed)
    owners.append(value)
    return value.elements() if value.shape else value.only


def _closed(graph: Graph, value: Any, long: Tracer | None) -> Any:
    if isinstance(value, list | tuple):
        return type(value)(_closed(graph, v, long) for v in value)
    if isinstance(value, Expr):
        return scalar(graph, value)
    if not isinstance(value, np.ndarray):
        return value
    if value.dtype != object:
        return traced(graph, value)
    if not all(isinstance(e, Expr) for e in value.flat):
        value = np.frompyfunc(lambda e: e if isinstance(e, Expr) else graph.const(float(e)), 1, 1)(
            value
        )
    return Tracer(graph, value) if long is None else long._part(value, None, 1)


@of(np.take)
def _take(graph: Graph, a: object, indices: object, axis: Any = None, **options: object) -> Any:
    """Return elements at places, which the state may decide."""
    array = traced(graph, a)
    places = indices if isinstance(indices, Tracer) else traced(graph, indices)
    if array.ndim == 1 and not options and any(e.op != "const" for e in places.values.flat):
        return array[places]
    return by_moving(np.take)(graph, a, indices, axis, **options)


for _function in _MOVING:
    enter([_function], by_moving(_function), makes=_function in (np.diag, np.tile, np.diagflat))
for _function in _COMPUTING:
    enter([_function], by_numpy(_function))


_POLYVAL, _EINSUM = by_numpy(np.polyval), by_numpy(np.einsum)


@of(np.einsum)
def _einsum(graph: Graph, subscripts: Any, *operands: Any, **options: Any) -> Any:
    """Return sums of products; of one array without sums a view, as NumPy's is one."""
    if len(operands) == 1 and isinstance(subscripts, str):
        sample = np.zeros(traced(graph, operands[0]).shape)
        if np.shares_memory(np.einsum(subscripts, sample), sample):
            return by_moving(np.einsum)(graph, subscripts, *operands)
    return _EINSUM(graph, subscripts, *operands, **options)


@of(np.polyval)
def _polyval(graph: Graph, p: Any, x: Any) -> Any:
    """Return a polynomial at numbers, which may be complex."""
    if not holds_complex(x) or isinstance(x, list | tuple):
        return _POLYVAL(graph, p, x)
    return functools.reduce(lambda y, c: y * x + c, list(traced(graph, p)), 0.0 * x)


@of(np.block)
def _block(graph: Graph, parts: object) -> Tracer:
    """Return arrays and numbers, next to each other and in rows."""

    def as_arrays(part: object) -> Any:
        if isinstance(part, list):
            return list(map(as_arrays, part))
        array = traced(graph, part)
        return array if array.shape else array.reshape(1)

    return by_moving(np.block)(graph, as_arrays(parts))


@of(np.concatenate)
def concatenate(graph: Graph, parts: Sequence[Any], axis: object = 0) -> Tracer:
    """Return arrays one after the other."""
    arrays = [traced(graph, p) for p in parts]
    if axis is None:
        return concatenated(graph, [a.reshape(-1) for a in arrays])
    if all(a.ndim == 1 for a in arrays) and axis in (0, -1):
        return concatenated(graph, arrays)
    return by_moving(np.concatenate)(graph, [a.short() for a in arrays], axis=axis)


@of(np.split, np.array_split)
def _split(graph: Graph, values: object, sections: int, axis: int = 0) -> Any:
    """Return parts of an array, which are views."""
    array = traced(graph, values)
    if array.axis is None or array.ndim > 1:
        return by_moving(np.array_split)(graph, array, sections, axis)
    places = np.array_split(np.arange(array.size), sections)
    return [array[int(p[0]) : int(p[-1]) + 1] if p.size else array[:0] for p in places]


@of(np.hstack)
def hstack(graph: Graph, parts: Sequence[Any]) -> Tracer:
    """Return arrays next to each other."""
    arrays = [traced(graph, p) for p in parts]
    return concatenate(
        graph, [a if a.shape else a.reshape(1) for a in arrays], 1 if arrays[0].ndim > 1 else 0
    )


@of(np.append)
def append(graph: Graph, array: object, values: object, axis: object = None) -> Tracer:
    """Return an array with values behind it."""
    arrays = [traced(graph, v) for v in (array, values)]
    if axis is not None:
        return concatenate(graph, arrays, axis)
    return concatenated(graph, [a.reshape(-1) for a in arrays])


@of(np.diff)
def diff(graph: Graph, a: object, n: int = 1, axis: int = -1, **ends: object) -> Tracer:
    """Return differences of neighbours."""
    array = traced(graph, a)
    if array.axis is None or array.ndim > 1:
        return by_numpy(np.diff)(graph, array, n, axis, **ends)
    before, after = (ends.get(k) for k in ("prepend", "append"))
    parts = [traced(graph, v) for v in (before, array, after) if v is not None]
    array = concatenated(graph, [p if p.shape else p.reshape(1) for p in parts])
    for _ in range(n):
        array = array[1:] - array[:-1]
    return array


@of(np.gradient)
def gradient(graph: Graph, f: object, *spacing: object) -> Tracer:
    """Return central differences, one-sided ones at the ends."""
    array = traced(graph, f)
    h = traced(graph, spacing[0] if spacing else 1.0)
    if array.ndim != 1 or len(spacing) > 1:
        raise Untraceable("a gradient along several axes")
    if h.shape:
        return _uneven_gradient(graph, array, h)
    inner = (array[2:] - array[:-2]) / (2.0 * h)
    first = (array[1:2] - array[:1]) / h
    last = (array[-1:] - array[-2:-1]) / h
    return concatenated(graph, [first, inner, last])


def _uneven_gradient(graph: Graph, array: Tracer, places: Tracer) -> Tracer:
    """Return the slopes of parabolas through three points, of lines at the ends."""
    h, rise = places[1:] - places[:-1], array[1:] - array[:-1]
    before, after = h[:-1], h[1:]
    inner = (
        -(after / (before * (before + after))) * array[:-2]
        + (after - before) / (before * after) * array[1:-1]
        + before / (after * (before + after)) * array[2:]
    )
    return concatenated(graph, [rise[:1] / h[:1], inner, rise[-1:] / h[-1:]])


@of(np.roll)
def roll(graph: Graph, a: object, shift: int, axis: object = None) -> Tracer:
    """Return an array whose elements have moved on."""
    array = traced(graph, a)
    if array.axis is None or array.ndim > 1 or isinstance(shift, tuple):
        return by_moving(np.roll)(graph, array, shift, axis)
    k = int(shift) % array.size
    return concatenated(graph, [array[array.size - k :], array[: array.size - k]])


@of(np.pad)
def pad(graph: Graph, a: object, width: Any, mode: str = "constant", **options: object) -> Tracer:
    """Return an array with more at its ends."""
    array = traced(graph, a)
    if array.axis is None or array.ndim > 1:
        return by_moving(np.pad)(graph, array, width, mode, **options)
    places = np.pad(np.arange(array.size), width, mode="constant", constant_values=-1)
    first, last = int(np.argmax(places >= 0)), places.size - int(np.argmax(places[::-1] >= 0))
    ends = {"edge": (array[0], array[-1]), "constant": (0.0, 0.0)}.get(mode)
    if ends is None or options:
        return by_moving(np.pad)(graph, array.short(), width, mode, **options)
    low, high = (np.repeat(0, first), np.repeat(0, places.size - last))
    before = elementwise(graph, "add", traced(graph, low.astype(float)), ends[0])
    after = elementwise(graph, "add", traced(graph, high.astype(float)), ends[1])
    return concatenated(graph, [before, array, after])


@of(np.dot, np.matmul, np.linalg.matmul)
def dot(graph: Graph, a: object, b: object) -> Any:
    """Return a product of matrices."""
    if holds_complex(a) or holds_complex(b):
        return paired_product(graph, a, b)
    a, b = traced(graph, a), traced(graph, b)
    if not (a.shape and b.shape):
        return a * b
    return product(a, b)


@of(np.atleast_1d)
def atleast_1d(graph: Graph, *values: object) -> Any:
    """Return numbers as arrays."""
    arrays = [traced(graph, v) for v in values]
    arrays_of_one = [a if a.shape else a.reshape(1) for a in arrays]
    return arrays_of_one[0] if len(arrays_of_one) == 1 else tuple(arrays_of_one)


@of(np.copyto)
def copyto(graph: Graph, target: Tracer, source: object, where: object = True) -> None:
    """Assign to an array where a condition holds."""
    target[...] = source if where is True else elementwise(graph, "select", where, source, target)


@of(np.put)
def _put(graph: Graph, target: Tracer, places: object, values: object) -> None:
    """Assign to places of an array in one dimension."""
    if target.ndim != 1:
        raise Untraceable("put into a matrix")
    target[np.asarray(places)] = values


@of(np.extract)
def extract(graph: Graph, condition: object, values: object) -> Masked:
    """Return the elements where a condition holds."""
    mask, array = traced(graph, condition), traced(graph, values)
    return Masked(array, elementwise(graph, "ne", mask, 0.0))


@of(np.place, np.putmask)
def _place(graph: Graph, target: Tracer, mask: object, values: object) -> None:
    """Assign where a condition holds: one value, or the elements of the same condition."""
    mask = elementwise(graph, "ne", traced(graph, mask), 0.0)
    if isinstance(values, Masked):
        values = values.whole_for(mask)
    elif traced(graph, values).size != 1:
        raise Untraceable("several values in the places of a mask")
    target[...] = elementwise(graph, "select", mask, values, target)


@of(np.fill_diagonal)
def fill_diagonal(graph: Graph, target: Tracer, value: Any) -> None:
    """Assign to the diagonal of a matrix."""
    if target.ndim != 2:
        raise Untraceable("the diagonal of something else than a matrix")
    for k in range(min(target.shape)):
        target[k, k] = value if not getattr(value, "shape", ()) else value[k]


@of(np.size)
def size(graph: Graph, values: object, axis: Any = None) -> int:
    """Return the number of elements."""
    array = traced(graph, values)
    return array.size if axis is None else array.shape[axis]


def permuted(graph: Graph, values: object, *axes: object) -> Tracer:
    """Return an array with its axes in another order."""
    order = axes[0] if len(axes) == 1 and isinstance(axes[0], tuple | list | None) else axes
    return by_moving(np.transpose)(graph, values, order or None)


def _filled(graph: Graph, values: Tracer, value: object) -> None:
    """Assign one value to all elements."""
    values[...] = value


def _listed(graph: Graph, values: Tracer) -> Any:
    """Return an array as lists of numbers."""
    if values.shape:
        return [_listed(graph, v) for v in values]
    return python_number(graph, values.only)


def item(graph: Graph, values: Tracer, *_place: object) -> Any:
    """Return one element as a number."""
    if not _place and values.size != 1:
        raise Untraceable("the only element of an array that has more")
    flat = values.reshape(-1) if values.shape else values.reshape(1)
    place = flat[0] if not _place else flat[_place[0]] if len(_place) == 1 else values[_place]
    return python_number(graph, place.only)


ARRAY_METHODS.update(transpose=permuted, fill=_filled, tolist=_listed, item=item)
for _name in ("squeeze", "swapaxes", "repeat", "take", "diagonal", "trace", "cumsum", "cumprod",
              "dot", "compress"):  # fmt: skip
    ARRAY_METHODS[_name] = getattr(np, _name)

# what is one expression, of the graph
_OF_GRAPHS = (
    ((np.ravel,), lambda graph, values, order='C': traced(graph, values).ravel(order)),
    ((np.reshape,),
     lambda graph, values, shape, order='C': traced(graph, values).reshape(shape, order=order)),
    ((np.outer,), lambda graph, a, b:
     traced(graph, a).reshape(-1)[:, None] * traced(graph, b).reshape(-1)),
    ((np.shape,), lambda graph, values: traced(graph, values).shape),
    ((np.ndim,), lambda graph, values: traced(graph, values).ndim),
    ((np.isscalar,), lambda graph, v: not traced(graph, v).is_array),
)  # fmt: skip
for _functions, _written in _OF_GRAPHS:
    of(*_functions)(_written)
