"""Sums, means, extremes, orders: what makes one number of many."""

from __future__ import annotations

import functools
import itertools
import math
import operator
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, as_array, traced
from ..constants import constant_value
from ..graph import Expr, Graph, Untraceable
from ..masked import Masked, MaskedPlaces
from ..operators import elementwise, total, with_counts
from .complex_numbers import ComplexPair
from .table import ARRAY_METHODS, WRITTEN, Facade, formula, of

__all__: list[str] = []

Axis = Any
_MIDDLE = 64  # elements beyond which no extremes are written out
_WIDE = 8  # elements of which all ties are tried, before these are repeated


def folded(
    graph: Graph,
    values: object,
    axis: Axis,
    keepdims: bool,
    function: Callable[[Sequence[Expr]], Any],
) -> Tracer:
    """Return what a function makes of the elements along an axis, or of all."""
    array = traced(graph, values)
    cells = array.elements()
    if axis is None:
        lined, shape = cells.reshape(1, -1), (1,) * cells.ndim if keepdims else ()
    else:
        axes = axis if isinstance(axis, tuple) else (axis,)
        places = [operator.index(a) % cells.ndim for a in axes]
        moved = np.moveaxis(cells, places, range(len(places)))
        kept = moved.shape[len(places) :]
        lined = moved.reshape(-1, math.prod(kept)).T
        shape = tuple(1 if i in places else n for i, n in enumerate(cells.shape)) if keepdims else (
            kept
        )  # fmt: skip
    results = np.empty(len(lined), dtype=object)
    for i, row in enumerate(lined):
        results[i] = function(list(row))
    return Tracer(graph, as_array(results.reshape(shape)))


def _numbers(graph: Graph, row: Sequence[Expr]) -> list[Expr]:
    return [e if e.kind == "i" else graph.number(e) for e in row]


def _extreme(name: str, ignores_nan: bool = False) -> Callable[..., Any]:
    def written(
        graph: Graph,
        values: object,
        axis: Axis = None,
        *,
        keepdims: bool = False,
        initial: object = None,
        where: object = True,
    ) -> Any:
        if where is not True:
            if initial is None:
                raise ValueError("an extreme of chosen elements without initial")
            values = elementwise(graph, "select", where, values, initial)
        if isinstance(values, Masked | MaskedPlaces) and axis is initial is None:
            return values.max() if name == "maximum" else values.min()

        def of_row(row: Sequence[Expr]) -> Expr:
            row = _numbers(graph, row)
            if initial is not None:
                row.append(graph.number(traced(graph, initial).only))
            if not row:
                raise Untraceable("an extreme of nothing")
            return functools.reduce(of_two, row)

        def of_two(a: Expr, b: Expr) -> Expr:
            if not ignores_nan:
                return graph.op(name, a, b)
            return ignoring_nan(graph, name, a, b)

        return folded(graph, values, axis, keepdims, of_row)

    return written


def ignoring_nan(graph: Graph, name: str, a: Expr, b: Expr) -> Expr:
    """Return the larger or smaller of two, the other one where one is NaN."""
    both = graph.op(name, a, b)
    without_nan_in_a = graph.op("select", graph.op("ne", a, a), b, both)
    return graph.op("select", graph.op("ne", b, b), a, without_nan_in_a)


of(np.max, np.amax)(_extreme("maximum"))
of(np.min, np.amin)(_extreme("minimum"))
of(np.nanmax)(_extreme("maximum", ignores_nan=True))
of(np.nanmin)(_extreme("minimum", ignores_nan=True))


@of(np.sum)
def sum_along(
    graph: Graph, values: object, axis: Axis = None, dtype: object = None, *,
    keepdims: bool = False, where: object = True, initial: object = None, out: None = None,
) -> Any:  # fmt: skip
    """Return a sum."""
    if isinstance(values, Masked | ComplexPair):
        return values.sum() if isinstance(values, Masked) else values.sum(axis)
    array = traced(graph, values)
    if where is not True:
        array = elementwise(graph, "select", where, array, 0.0)
    if dtype not in (None, float) or initial is not None or out is not None:
        raise Untraceable("a sum with other arguments")
    if isinstance(axis, tuple) or keepdims:
        axes = range(array.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
        places = [operator.index(a) % array.ndim for a in axes]
        sums = array
        for place in sorted(places, reverse=True):
            sums = total(sums, place)
        shape = tuple(1 if i in places else n for i, n in enumerate(array.shape))
        return sums.reshape(shape) if keepdims else sums
    return total(array, axis)


@formula(np.nansum)
def nansum(np: Facade, values: object, axis: Axis = None) -> Tracer:
    """Return a sum without what is NaN."""
    array = traced(np.graph, values)
    return np.sum(np.where(array == array, array, 0.0), axis)


def _count(array: Tracer, axis: Axis) -> float:
    places = range(array.ndim) if axis is None else axis if isinstance(axis, tuple) else (axis,)
    return float(math.prod(array.shape[p] for p in places))


@of(np.mean)
def mean(
    graph: Graph, values: object, axis: Axis = None, *, keepdims: bool = False,
    where: object = True,
) -> Any:  # fmt: skip
    """Return a mean."""
    if where is not True:
        nothing = np.zeros(traced(graph, values).shape)  # a mask of another shape counts for all
        chosen = elementwise(graph, "select", where, 1.0, nothing)
        parts = sum_along(graph, values, axis, keepdims=keepdims, where=where)
        return elementwise(graph, "div", parts, sum_along(graph, chosen, axis, keepdims=keepdims))
    if isinstance(values, Masked):
        return values.mean()
    if isinstance(values, ComplexPair):
        return values.linear(lambda part: mean(graph, part, axis, keepdims=keepdims))
    array = traced(graph, values)
    sums = sum_along(graph, array, axis, keepdims=keepdims)
    return elementwise(graph, "div", sums, _count(array, axis))


@formula(np.var)
def var(
    np: Facade, values: object, axis: Axis = None, *, ddof: float = 0, keepdims: bool = False
) -> Tracer:
    """Return a variance."""
    array = with_counts(traced(np.graph, values))
    away = array - np.mean(array, axis, keepdims=True)
    return np.sum(away * away, axis, keepdims=keepdims) / max(_count(array, axis) - ddof, 0.0)


@formula(np.average)
def average(np: Facade, values: object, axis: Axis = None, weights: object = None) -> Tracer:
    """Return a weighted mean."""
    if weights is None:
        return np.mean(values, axis)
    array, weights = traced(np.graph, values), traced(np.graph, weights)
    if weights.shape != array.shape and axis is not None:
        shape = tuple(n if i == axis % array.ndim else 1 for i, n in enumerate(array.shape))
        weights = weights.reshape(shape)
    weighed = np.sum(array * weights, axis)
    if weights.shape != array.shape:
        weights = (array * 0.0 + 1.0) * weights
    return weighed / np.sum(weights, axis)


@of(np.prod)
def prod(graph: Graph, values: object, axis: Axis = None, *, keepdims: bool = False) -> Any:
    """Return a product."""
    if isinstance(values, Masked):
        return prod(graph, values.filled(1.0))

    def of_row(row: Sequence[Expr]) -> Expr:
        start = graph.const(1) if all(e.kind != "f" for e in row) else graph.const(1.0)
        whole = [graph.integer(e) if e.kind == "b" else e for e in row]
        return functools.reduce(lambda a, b: graph.op("mul", a, b), whole, start)

    return folded(graph, values, axis, keepdims, of_row)


def _of_truths(name: str, start: bool) -> Callable[..., Any]:
    def written(graph: Graph, values: object, axis: Axis = None, *, keepdims: bool = False) -> Any:
        if isinstance(values, Masked):
            values = values.filled(start)

        def of_row(row: Sequence[Expr]) -> Expr:
            truths = list(map(graph.truth, row)) or [graph.const(start)]
            return functools.reduce(functools.partial(graph.op, name), truths)

        return folded(graph, values, axis, keepdims, of_row)

    return written


any_of = of(np.any)(_of_truths("or", False))
all_of = of(np.all)(_of_truths("and", True))


@of(np.count_nonzero)
def count_nonzero(graph: Graph, values: object, axis: Axis = None) -> Tracer:
    """Return how many elements are not 0."""
    array = traced(graph, values)
    are_truths = all(e.kind == "b" for e in array.values.flat)
    return total(array if are_truths else elementwise(graph, "ne", array, 0.0), axis)


# -- orders ----------------------------------------------------------------------------------------


def _first(name: str) -> Callable[..., Any]:
    """Return what finds the first of the largest or smallest; NaN is beyond all."""

    def written(
        graph: Graph, values: object, axis: Axis = None, *, keepdims: bool = False
    ) -> Tracer:
        def of_row(row: Sequence[Expr]) -> Expr:
            best, place = _numbers(graph, row)[0], graph.const(0)
            for k, e in enumerate(_numbers(graph, row)[1:], start=1):
                beyond = graph.op(name, e, best)
                is_nan = graph.op("and", graph.op("ne", e, e), graph.op("eq", best, best))
                best_is_number = graph.op("eq", best, best)
                better = graph.op("or", graph.op("and", beyond, best_is_number), is_nan)
                best = graph.op("select", better, e, best)
                place = graph.op("select", better, graph.const(k), place)
            return place

        return folded(graph, values, axis, keepdims, of_row)

    return written


argmax = of(np.argmax)(_first("gt"))
argmin = of(np.argmin)(_first("lt"))


def _is_after(graph: Graph, a: Expr, b: Expr) -> Expr:
    """Return whether a stands behind b: it is larger, or NaN."""
    nan = graph.op("and", graph.op("ne", a, a), graph.op("eq", b, b))
    return graph.op("or", graph.op("gt", a, b), nan)


def in_order(graph: Graph, row: Sequence[Expr]) -> tuple[list[Expr], list[Expr]]:
    """Return elements in order, NaN last, and where each was; equal ones stay as they are."""
    values, places = _numbers(graph, row), [graph.const(k) for k in range(len(row))]
    if len(row) > _MIDDLE:
        raise Untraceable("too many elements to be sorted")
    for end in range(len(values) - 1, 0, -1):
        for i in range(end):
            is_inverted = _is_after(graph, values[i], values[i + 1])
            for kept in (values, places):
                a, b = kept[i], kept[i + 1]
                kept[i] = graph.op("select", is_inverted, b, a)
                kept[i + 1] = graph.op("select", is_inverted, a, b)
    return values, places


def _along(graph: Graph, values: object, axis: Any, function: Callable[..., list[Expr]]) -> Tracer:
    array = traced(graph, values)
    cells = array.elements().reshape(-1) if axis is None else array.elements()
    moved = np.moveaxis(cells, -1 if axis is None else axis, -1)
    results = np.empty(moved.shape, dtype=object)
    for index in np.ndindex(moved.shape[:-1]):
        results[index] = function(list(moved[index]))
    return Tracer(graph, np.moveaxis(results, -1, -1 if axis is None else axis))


@of(np.sort)
def sort(graph: Graph, values: object, axis: object = -1, **_how: object) -> Tracer:
    """Return an array in order."""
    return _along(graph, values, axis, lambda row: in_order(graph, row)[0])


@functools.cache
def _keeps_order(n: int) -> bool:
    """Whether NumPy leaves n elements, where they are equal, as they are: on some machines."""
    rows = (np.resize(row, n) for row in itertools.product((0.0, 1.0), repeat=min(n, _WIDE)))
    return all(np.array_equal(np.argsort(r), np.argsort(r, kind="stable")) for r in rows)


@of(np.argsort)
def argsort(
    graph: Graph, values: object, axis: object = -1, kind: str | None = None, **how: object
) -> Tracer:
    """Return where the elements of an ordered array were; called where NumPy mixes equal ones."""
    if traced(graph, values).shape[-1] > 16:
        raise Untraceable("the order of many elements, some of which may be equal")
    is_stable = kind in ("stable", "mergesort") or how.get("stable")

    def places(row: list[Expr]) -> list[Expr]:
        ordered, order = in_order(graph, row)
        for a, b in [] if is_stable or _keeps_order(len(row)) else itertools.pairwise(ordered):
            graph.limited(graph.op("ne", a, b))
        return order

    return _along(graph, values, axis, places)


@of(np.median)
def median(graph: Graph, values: object, axis: Axis = None) -> Tracer:
    """Return the one in the middle, NaN where one is NaN."""

    def of_row(row: Sequence[Expr]) -> Expr:
        ordered, _ = in_order(graph, row)
        n = len(ordered)
        low, high = ordered[(n - 1) // 2], ordered[n // 2]
        half = graph.op("div", graph.op("add", low, high), graph.const(2.0))
        middle = half if n % 2 == 0 else low
        last = ordered[-1]
        return graph.op("select", graph.op("ne", last, last), last, middle)

    return folded(graph, values, axis, False, of_row)


def _quantile(graph: Graph, row: Sequence[Expr], q: float) -> Expr:
    """Return the value below which a part lies: between two of the ordered ones."""
    ordered, _ = in_order(graph, row)
    at = (len(ordered) - 1) * q
    low = min(int(at), len(ordered) - 2) if len(ordered) > 1 else 0
    part, high = at - low, min(low + 1, len(ordered) - 1)
    a, b = ordered[low], ordered[high]
    rise = graph.op("sub", b, a)
    if part >= 0.5:
        quantile = graph.op("sub", b, graph.op("mul", rise, graph.const(1.0 - part)))
    else:
        quantile = graph.op("add", a, graph.op("mul", rise, graph.const(part)))
    last = ordered[-1]
    return graph.op("select", graph.op("ne", last, last), last, quantile)


@of(np.quantile)
def _quantiles(graph: Graph, values: object, q: object, axis: Axis = None) -> Tracer:
    """Return the value below which a part q lies."""
    parts = np.asarray(constant_value(traced(graph, q)))
    if parts.dtype != float and parts.dtype.kind != "i":
        raise Untraceable("a quantile whose part depends on the state")
    quantiles = [folded(graph, values, axis, False, functools.partial(_quantile, graph, q=float(p)))
             for p in parts.reshape(-1)]  # fmt: skip
    return quantiles[0] if not parts.shape else traced(graph, quantiles)


@formula(np.cov)
def cov(np: Facade, m: object, y: object = None, *, bias: bool = False, ddof: Any = None) -> Tracer:
    """Return the covariances of rows."""
    rows = [traced(np.graph, v) for v in (m, y) if v is not None]
    flat = [row for r in rows for row in (r if r.ndim == 2 else [r])]
    away = [r - np.mean(r) for r in flat]
    count = float(flat[0].size - (ddof if ddof is not None else 0 if bias else 1))
    covariances = [[np.sum(a * b) / count for b in away] for a in away]
    return traced(np.graph, covariances if len(away) > 1 else covariances[0][0])


@formula(np.corrcoef)
def corrcoef(np: Facade, x: object, y: object = None) -> Tracer:
    """Return the correlations of rows."""
    c = np.cov(x, y)
    sizes = [np.sqrt(c[i, i]) for i in range(len(c))]
    correlations = [[c[i, j] / a / b for j, b in enumerate(sizes)] for i, a in enumerate(sizes)]
    return np.clip(correlations, -1.0, 1.0)


def sorted_in_place(graph: Graph, values: Tracer, axis: int = -1, **_how: object) -> None:
    """Put an array in order."""
    values[...] = sort(graph, values, axis)


_SINGULAR = np.linalg.svd


@formula(np.linalg.norm)
def norm(
    np: Facade, x: object, ord: Any = None, axis: object = None,  # noqa: A002
    keepdims: bool = False,
) -> Any:  # fmt: skip
    """Return a norm of a vector or matrix."""
    x = traced(np.graph, x)
    size = np.abs(x)
    if x.ndim == 2 and axis is None and ord in (1, -1, math.inf, -math.inf):
        sums = np.sum(size, axis=0 if abs(ord) == 1 else 1)
        return np.max(sums) if ord > 0 else np.min(sums)
    if ord in (math.inf, -math.inf) and not (x.ndim == 2 and axis is None):
        return (np.max if ord > 0 else np.min)(size, axis=axis, keepdims=keepdims)
    if ord == 1 and x.ndim != 2:
        return np.sum(size, axis=axis, keepdims=keepdims)
    if x.ndim == 2 and axis is None and ord in (2, -2, "nuc"):
        values = WRITTEN[_SINGULAR](np.graph, x, compute_uv=False)
        return np.sum(values) if ord == "nuc" else values[0 if ord == 2 else -1]
    if x.ndim == 1 and isinstance(ord, int | float) and ord != 2:
        return np.power(np.sum(np.power(size, ord)), 1.0 / ord) if ord else np.sum(x != 0.0) * 1.0
    is_euclidean = ord is None or ord == "fro" or (ord == 2 and (x.ndim == 1 or axis is not None))
    if not is_euclidean:
        raise Untraceable(f"the norm {ord!r} of this array")
    return np.sqrt(np.sum(x * x, axis=axis, keepdims=keepdims))


# what is one expression
_FORMULAS = (
    (np.ptp, lambda np, values, axis=None: np.max(values, axis) - np.min(values, axis)),
    (np.std, lambda np, values, axis=None, **options: np.sqrt(np.var(values, axis, **options))),
    (np.percentile,
     lambda np, values, q, axis=None: np.quantile(values, np.divide(q, 100.0), axis)),
    (np.nanmean,
     lambda np, values, axis=None:
     np.nansum(values, axis) / np.sum(np.equal(values, values), axis)),
    (np.nanvar,
     lambda np, values:
     np.sum(np.where(values == values, np.square(values - np.nanmean(values)), 0.0))
     / np.sum(np.equal(values, values))),
    (np.nanstd, lambda np, values: np.sqrt(np.nanvar(values))),
)  # fmt: skip
for _function, _written in _FORMULAS:
    formula(_function)(_written)

ARRAY_METHODS.update(
    {name: getattr(np, name) for name in ("max", "min", "sum", "mean", "var", "std", "prod", "any",
                                          "all", "argmax", "argmin", "argsort", "ptp")},
    sort=sorted_in_place, searchsorted=np.searchsorted, nonzero=np.nonzero, choose=np.choose,
)  # fmt: skip
