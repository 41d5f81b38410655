"""Objects of NumPy and SciPy that are functions of x: splines, polynomials, tables."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Tracer, mapped, scalar, traced
from ..constants import constant_value
from ..graph import Expr, Graph, Untraceable
from ..operators import elementwise
from . import scattered
from .surfaces import surface
from .table import enter
from .tables import (
    beyond_ends,
    constant_cells,
    interval_choice,
    interval_polynomial,
    polynomial,
)


def called_object(graph: Graph, interpolant: object, *arguments: object, **options: object) -> Any:
    """Return what an object of a library, that can be called, makes of arrays of expressions."""
    for kinds, written in _kinds():
        if isinstance(interpolant, kinds):
            return written(graph, interpolant, *arguments, **options)
    raise Untraceable(f"{type(interpolant).__name__} is not known here")


_POLYNOMIALS = ("Polynomial", "Chebyshev", "Legendre", "Hermite", "HermiteE", "Laguerre")


@functools.cache
def _kinds() -> tuple[tuple[Any, Callable[..., Any]], ...]:
    from scipy import interpolate

    return (
        (interpolate.PPoly, piecewise_polynomial),
        (interpolate.BSpline, b_spline),
        (interpolate.interp1d, table_of_one),
        (interpolate.UnivariateSpline, fitted_spline),
        (interpolate.BivariateSpline, surface),
        (interpolate.RegularGridInterpolator, _grid),
        (interpolate.LinearNDInterpolator, scattered.between_corners),
        (interpolate.NearestNDInterpolator, scattered.at_the_nearest),
        (interpolate.RBFInterpolator, scattered.radial),
        (
            (interpolate.KroghInterpolator, interpolate.BarycentricInterpolator),
            scattered.through_points,
        ),
        (np.poly1d, lambda graph, p, x: polynomial(graph, x, _floats(p.coeffs[::-1]))),
        (tuple(getattr(np.polynomial, name) for name in _POLYNOMIALS), _mapped_polynomial),
    )


@functools.cache
def enter_splines() -> None:
    """Enter SciPy's functions of splines."""
    from scipy import interpolate

    enter([interpolate.splev], splev)
    enter([interpolate.interpn], at_grid)
    enter([interpolate.griddata], scattered.on_scattered)


def _floats(values: object) -> np.ndarray:
    return np.asarray(values, dtype=float)


def _mapped_polynomial(graph: Graph, p: Any, x: Any) -> Any:
    off, scale = p.mapparms()
    p = p.convert(domain=p.domain, kind=np.polynomial.Polynomial, window=p.window)
    return polynomial(graph, float(off) + float(scale) * traced(graph, x), _floats(p.coef))


def _elementwise(graph: Graph, x: object, function: Callable[[Expr], Expr]) -> Tracer:
    cells = mapped(lambda e: function(graph.number(e)), traced(graph, x).elements())
    return Tracer(graph, cells)


def piecewise_polynomial(
    graph: Graph, interpolant: Any, x: Arithmetic, nu: int = 0, extrapolate: Any = None
) -> Any:
    """Return SciPy's piecewise polynomial, or a derivative."""
    extrapolate = interpolant.extrapolate if extrapolate is None else extrapolate
    if nu:
        interpolant = interpolant.derivative(nu)
    if interpolant.c.dtype != float:
        raise Untraceable("a piecewise polynomial of complex numbers")
    if extrapolate == "periodic":
        x, extrapolate = _in_period(graph, x, *interpolant.x[[0, -1]]), False
    if interpolant.c.ndim > 2:
        from scipy.interpolate import PPoly

        shape = interpolant.c.shape[2:]
        columns = [PPoly(interpolant.c[:, :, *k], interpolant.x, extrapolate=bool(extrapolate))
                   for k in np.ndindex(shape)]  # fmt: skip
        return _in_columns(columns, shape, interpolant.axis, piecewise_polynomial, graph, x)
    breaks, coefficients = interpolant.x, interpolant.c
    if np.any(np.diff(breaks) <= 0):
        raise Untraceable("a piecewise polynomial whose intervals do not follow one another")

    def at(e: Expr) -> Expr:
        value = interval_polynomial(graph, e, breaks, coefficients.T)
        nan = graph.const(np.nan)
        return (
            value
            if extrapolate
            else beyond_ends(graph, e, (breaks[0], breaks[-1]), value, nan, nan)
        )

    return _elementwise(graph, x, at)


def _in_period(graph: Graph, x: object, begin: float, end: float) -> Tracer:
    """Return the same place in the first period, as SciPy has it."""
    turned = elementwise(graph, "remainder", elementwise(graph, "sub", x, begin), end - begin)
    return elementwise(graph, "add", begin, turned)


def _in_columns(
    columns: Sequence[Any], shape: tuple[int, ...], axis: int, written: Callable[..., Any],
    graph: Graph, x: Arithmetic,
) -> Tracer:  # fmt: skip
    """Return several values at each place, by a function of one value for each of them."""
    values = [traced(graph, written(graph, column, x)).short() for column in columns]
    cells = np.stack([v.elements() for v in values], axis=-1)
    places = range(cells.ndim - 1)  # the axes of x come where that of the samples has been
    cells = cells.reshape(cells.shape[:-1] + shape)
    return Tracer(graph, np.moveaxis(cells, places, [axis + k for k in places]))


def _guard_range(graph: Graph, x: Expr, ends: Sequence[Any]) -> None:
    """Note that SciPy raises an error beyond the ends of a range."""
    graph.guards.append(graph.op("ge", x, graph.const(float(ends[0]))))
    graph.guards.append(graph.op("le", x, graph.const(float(ends[-1]))))


def b_spline(graph: Graph, interpolant: Any, x: Any, nu: int = 0, extrapolate: Any = None) -> Any:
    """Return SciPy's spline by its polynomial in each interval between knots."""
    from scipy.interpolate import PPoly

    extrapolate = interpolant.extrapolate if extrapolate is None else extrapolate
    if extrapolate == "periodic":
        ends = interpolant.t[[interpolant.k, -1 - interpolant.k]]
        x, extrapolate = _in_period(graph, x, *ends), False
    if interpolant.c.ndim > 1:
        from scipy.interpolate import BSpline

        shape, written = interpolant.c.shape[1:], functools.partial(b_spline, nu=nu)
        columns = [BSpline(interpolant.t, interpolant.c[:, *k], interpolant.k, bool(extrapolate))
                   for k in np.ndindex(shape)]  # fmt: skip
        return _in_columns(columns, shape, interpolant.axis, written, graph, x)
    knots = np.unique(interpolant.t[interpolant.k : interpolant.t.size - interpolant.k])
    whole = PPoly.from_spline(interpolant)
    kept = [int(np.searchsorted(whole.x, k, side="right")) - 1 for k in knots[:-1]]
    unwrapped = PPoly(whole.c[:, kept], knots, extrapolate=bool(extrapolate))
    return piecewise_polynomial(graph, unwrapped, x, nu)


def splev(graph: Graph, x: object, tck: Any, der: int = 0, ext: int = 0) -> Any:
    """Return a spline that is given by knots, coefficients and degree."""
    from scipy.interpolate import BSpline

    if isinstance(tck, BSpline):
        return b_spline(graph, tck, x, der)
    t, c, k = tck
    t, c = _floats(_numbers(t)), _floats(_numbers(c))
    spline = BSpline(t, c[: t.size - k - 1], k)
    values = b_spline(graph, spline, x, der, True)
    ends = t[k], t[t.size - k - 1]
    if ext == 0:
        return values
    array = traced(graph, x)
    if ext == 2:
        for e in array.elements().reshape(-1):
            _guard_range(graph, graph.number(e), ends)
        return values
    edges = [0.0, 0.0] if ext == 1 else [float(spline(e, der)) for e in ends]
    below, above = map(graph.const, edges)
    cells = mapped(
        lambda e, f: beyond_ends(graph, graph.number(e), ends, f, below, above),
        array.elements(), values.elements(),
    )  # fmt: skip
    return Tracer(graph, cells)


def _numbers(values: object) -> Any:
    constant = constant_value(values) if isinstance(values, Tracer) else values
    if isinstance(constant, Tracer):
        raise Untraceable("a spline that depends on the state or on parameters")
    return constant


def fitted_spline(
    graph: Graph, interpolant: Any, x: Arithmetic, nu: int = 0, ext: Any = None
) -> Any:
    """Return one of SciPy's splines that are fitted to data."""
    codes = {"extrapolate": 0, "zeros": 1, "raise": 2, "const": 3}
    how = interpolant.ext if ext is None else ext
    code: Any = codes.get(how, how)
    return splev(graph, x, interpolant._eval_args, nu, code)


def table_of_one(graph: Graph, interpolant: Any, x: Arithmetic) -> Any:
    """Return SciPy's interp1d."""
    kind = getattr(interpolant, "_kind", "")
    values = np.asarray(interpolant.y, dtype=float)
    if values.ndim > 1:
        axis = interpolant.axis % values.ndim
        rows = np.moveaxis(values, axis, 0)
        columns = _of_columns(interpolant, rows.reshape(len(rows), -1))
        return _in_columns(columns, rows.shape[1:], axis, table_of_one, graph, x)
    if kind in ("linear", "linear-np", "slinear") and not hasattr(interpolant, "_spline"):
        lines = np.stack([np.diff(values) / np.diff(interpolant.x), values[:-1]], axis=1)
        rule = lambda e: interval_polynomial(graph, e, interpolant.x, lines)  # noqa: E731
    elif hasattr(interpolant, "_spline"):
        spline = _of_one_value(interpolant._spline)
        rule = lambda e: b_spline(graph, spline, scalar(graph, e), 0, True).only  # noqa: E731
    elif kind in _STEPS:
        rule = functools.partial(_step, graph, interpolant, values, kind)
    else:
        raise Untraceable(f"interp1d of kind {kind!r}")
    extrapolates, bounded = bool(interpolant._extrapolate), bool(interpolant.bounds_error)
    below, above = (graph.const(float(np.ravel(v)[0])) if not extrapolates else None
                    for v in _fill(interpolant))  # fmt: skip

    def at(e: Expr) -> Expr:
        value, ends = rule(e), (interpolant.x[0], interpolant.x[-1])
        if bounded:
            _guard_range(graph, e, ends)
        if extrapolates or below is None or above is None:
            return value
        return beyond_ends(graph, e, ends, value, below, above)

    return _elementwise(graph, x, at)


def _of_columns(interpolant: Any, values: np.ndarray) -> list[Any]:
    """Return a table of one value for each column of one of several."""
    spline = getattr(interpolant, "_spline", None)
    how = {"kind": interpolant._kind if spline is None else spline.k,
           "bounds_error": interpolant.bounds_error}  # fmt: skip
    ends: Any = ["extrapolate"] * values.shape[1]
    if not interpolant._extrapolate:
        shape = np.delete(np.shape(interpolant.y), interpolant.axis)
        ends = zip(*(np.broadcast_to(v, shape).ravel() for v in _fill(interpolant)), strict=True)
    return [type(interpolant)(interpolant.x, column, fill_value=end, **how)
            for column, end in zip(values.T, ends, strict=True)]  # fmt: skip


_STEPS = ("nearest", "nearest-up", "previous", "next")


def _step(graph: Graph, interpolant: Any, values: np.ndarray, kind: str, x: Expr) -> Expr:
    """Return the value of the place that is nearest to x, before it or behind it."""
    places = np.asarray(interpolant.x, dtype=float)
    middles = places[1:] / 2.0 + places[:-1] / 2.0  # rounded as SciPy does
    bounds = {"previous": places[1:], "next": np.nextafter(places[:-1], np.inf)}.get(kind, middles)
    if kind == "nearest":  # of two that are equally near the first
        bounds = np.nextafter(bounds, np.inf)
    pieces = [graph.const(float(value)) for value in values]
    chosen = interval_choice(graph, x, list(bounds), pieces)
    return graph.op("select", graph.op("eq", x, x), chosen, graph.const(np.nan))


def _of_one_value(spline: Any) -> Any:
    """Return a spline whose values are numbers instead of rows of one number."""
    from scipy.interpolate import BSpline

    return BSpline(spline.t, spline.c.reshape(len(spline.c), -1)[:, 0], spline.k)


def _fill(interpolant: Any) -> tuple[Any, Any]:
    if interpolant._extrapolate:
        return None, None
    return interpolant._fill_value_below, interpolant._fill_value_above


def _grid(graph: Graph, interpolant: Any, xi: object, method: Any = None) -> Any:
    """Return SciPy's interpolation on a grid: linear along one axis after the other."""
    values = np.asarray(interpolant.values, dtype=float)
    how = method or interpolant.method
    if how not in _ALONG or values.ndim != len(interpolant.grid):
        raise Untraceable("an interpolation on a grid that is neither linear nor nearest")

    def at(*place: Any) -> Any:
        numbers = [graph.number(v.only) for v in place]
        return scalar(graph, _on_grid(graph, interpolant, how, values, numbers))

    return scattered.at_points(graph, (xi,), at)


def at_grid(
    graph: Graph, points: Any, values: object, xi: object, *rest: Any, **options: object
) -> Any:
    """Return SciPy's `interpn`."""
    from scipy.interpolate import RegularGridInterpolator

    places = tuple(np.asarray(_numbers(v)) for v in points)
    return _grid(
        graph,
        RegularGridInterpolator(places, _numbers(values), *rest, **options),
        _in_a_row(graph, xi),
    )


def _in_a_row(graph: Graph, xi: object) -> Any:
    """Return coordinates of one point as an array, of which SciPy returns one value in a row."""
    array = traced(graph, list(xi)) if isinstance(xi, tuple) else xi
    return array if isinstance(array, Tracer) and array.ndim < 2 else xi


def _on_grid(
    graph: Graph, interpolant: Any, how: str, values: np.ndarray, x: Sequence[Expr]
) -> Expr:
    cells: Any = constant_cells(graph, values)
    for axis in range(len(x) - 1, -1, -1):
        places = np.asarray(interpolant.grid[axis], dtype=float)
        reduced = np.empty(cells.shape[:-1], dtype=object)
        for index in np.ndindex(reduced.shape):
            reduced[index] = _ALONG[how](graph, places, cells[index], x[axis])
        cells = reduced
    value: Any = cells[()] if isinstance(cells, np.ndarray) else cells
    for axis, e in enumerate(x):
        ends = interpolant.grid[axis][0], interpolant.grid[axis][-1]
        if interpolant.bounds_error:
            _guard_range(graph, e, ends)
        elif interpolant.fill_value is not None:
            fill = graph.const(float(interpolant.fill_value))
            value = beyond_ends(graph, e, ends, value, fill, fill)
    return value


def _between(graph: Graph, places: np.ndarray, values: Sequence[Expr], x: Expr) -> Expr:
    """Return the weighted mean of the two values next to x."""
    op, const = graph.op, graph.const
    pieces = []
    for j in range(places.size - 1):
        width = const(float(places[j + 1] - places[j]))
        part = op("div", op("sub", x, const(float(places[j]))), width)
        low = op("mul", values[j], op("sub", const(1.0), part))
        pieces.append(op("add", low, op("mul", values[j + 1], part)))
    return interval_choice(graph, x, list(map(float, places[1:-1])), pieces)


def _next(graph: Graph, places: np.ndarray, values: Sequence[Expr], x: Expr) -> Expr:
    """Return the value next to x: up to the middle, as SciPy computes that, the left one."""
    op, const = graph.op, graph.const
    pieces = []
    for j in range(places.size - 1):
        part = op("div", op("sub", x, const(float(places[j]))),
                  const(float(places[j + 1] - places[j])))  # fmt: skip
        pieces.append(op("select", op("le", part, const(0.5)), values[j], values[j + 1]))
    chosen = interval_choice(graph, x, list(map(float, places[1:-1])), pieces)
    return op("select", op("eq", x, x), chosen, const(np.nan))


_ALONG = {"linear": _between, "nearest": _next}
