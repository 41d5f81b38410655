"""SciPy's interpolation between scattered points, and polynomials through points.

Source: SciPy's `LinearNDInterpolator`: a value belongs to a triangle, or is NaN, by barycentric
coordinates down to -100 times the unit of rounding.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Tracer, scalar, traced
from ..graph import Expr, Graph, Untraceable
from ..operators import elementwise
from .reductions import argmin
from .spectra import guard_finite
from .table import Facade, known_numbers

__all__: list[str] = []

_MOST = 256  # triangles or points
_INSIDE = -100 * float(np.finfo(float).eps)


def _coordinates(graph: Graph, given: tuple[Any, ...]) -> tuple[list[Any], tuple[int, ...]]:
    """Return coordinates as columns, and the shape of the values."""
    if len(given) == 1 and not isinstance(given[0], tuple):
        points = traced(graph, given[0]).short()
        columns = [points[..., k] for k in range(points.shape[-1])]
        shape = points.shape[:-1] or (1,)  # of one point SciPy returns one value, in a row
    else:
        columns = given[0] if len(given) == 1 else given
        columns = [traced(graph, v).short() for v in columns]
        shape = np.broadcast_shapes(*(c.shape for c in columns))
    zero = traced(graph, np.zeros(shape))
    return [elementwise(graph, "add", c, zero).reshape(-1) for c in columns], shape


def at_points(graph: Graph, given: tuple[Any, ...], function: Any) -> Any:
    """Return what a function makes of each point, which is given by arrays as SciPy takes them."""
    columns, shape = _coordinates(graph, given)
    values = [function(*place) for place in zip(*columns, strict=True)]
    return traced(graph, values).reshape(shape) if shape else values[0]


def between_corners(graph: Graph, table: Any, *given: Any, **options: object) -> Any:
    """Return SciPy's linear interpolation between the corners of triangles."""
    corners = table.tri.simplices
    values = np.asarray(table.values)
    if options or table.scale is not None or corners.shape[1] != 3:
        raise Untraceable("LinearNDInterpolator in another way, or of more than two coordinates")
    if len(corners) > _MOST or values.dtype != float or values.shape[1:] not in ((), (1,)):
        raise Untraceable("LinearNDInterpolator of too many points, or of several values")
    fill = float(np.ravel(table.fill_value)[0])
    point = functools.partial(_in_triangles, graph, table.tri, values.reshape(-1), fill)
    return at_points(graph, given, point)


def _in_triangles(
    graph: Graph, tri: Any, values: np.ndarray, fill: float, x: Arithmetic, y: Arithmetic
) -> Any:
    np_, change = Facade(graph), tri.transform
    weights = []
    for k in range(2):
        from_x = traced(graph, change[:, k, 0]) * (x - traced(graph, change[:, 2, 0]))
        weights.append(
            from_x + traced(graph, change[:, k, 1]) * (y - traced(graph, change[:, 2, 1]))
        )
    weights.append(1.0 - weights[0] - weights[1])
    here = [traced(graph, values[tri.simplices[:, k]]) * w for k, w in enumerate(weights)]
    lowest = np_.minimum(np_.minimum(weights[0], weights[1]), weights[2])
    chosen, depth = _deepest(
        graph, traced(graph, lowest), traced(graph, here[0] + here[1] + here[2])
    )
    return np_.where(depth >= _INSIDE, chosen, np_.where(depth == depth, fill, math.nan))


def _deepest(graph: Graph, depth: Tracer, values: Tracer) -> tuple[Tracer, Any]:
    """Return the value where a depth is largest, and that depth; NaN is the deepest."""
    best: list[Expr] = []
    for d, v in zip(depth.elements().flat, values.elements().flat, strict=True):
        if not best:
            best = [d, v]
            continue
        deeper = graph.op("not", graph.op("le", d, best[0]))
        best = [graph.op("select", deeper, new, old) for new, old in zip((d, v), best, strict=True)]
    return scalar(graph, best[1]), scalar(graph, best[0])


def at_the_nearest(graph: Graph, table: Any, *given: Any, **options: object) -> Any:
    """Return the value of the nearest point; between two that are equally near it is called."""
    points, values = np.asarray(table.points, dtype=float), np.asarray(table.values, dtype=float)
    if options or getattr(table, "scale", None) is not None or values.ndim != 1:
        raise Untraceable("NearestNDInterpolator in another way, or of several values")
    if len(points) > _MOST // 4:
        raise Untraceable("NearestNDInterpolator of too many points")

    def at(*place: Any) -> Any:
        guard_finite(graph, list(place), ValueError)
        parts = [(v - traced(graph, points[:, k])) for k, v in enumerate(place)]
        apart = functools.reduce(lambda a, b: a + b, (p * p for p in parts))
        order = sorted_two(graph, apart)
        graph.limited(graph.op("or", graph.op("ne", order[0], order[0]),
                               graph.op("lt", order[0], order[1])))  # fmt: skip
        return traced(graph, values)[argmin(graph, apart)]

    return at_points(graph, given, at)


def sorted_two(graph: Graph, values: Tracer) -> tuple[Expr, Expr]:
    """Return the smallest of at least two numbers, and the next one."""
    first, second = graph.const(math.inf), graph.const(math.inf)
    for e in values.elements().flat:
        larger = graph.op("maximum", first, e)
        first, second = graph.op("minimum", first, e), graph.op("minimum", second, larger)
    return first, second


def on_scattered(
    graph: Graph, points: Any, values: object, xi: Any, method: str = "linear",
    fill_value: float = math.nan, rescale: bool = False,
) -> Any:  # fmt: skip
    """Return SciPy's `griddata`."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

    places = known_numbers(points, "points of a table")
    places = places.T if isinstance(points, tuple) else places
    known, several = known_numbers(values, "values of a table"), isinstance(xi, tuple)
    if rescale or method not in ("linear", "nearest") or places.ndim != 2:
        raise Untraceable(f"scipy.interpolate.griddata of method {method!r}, or in one dimension")
    given = tuple(xi) if several else (xi,)
    if method == "nearest":
        return at_the_nearest(graph, NearestNDInterpolator(places, known), *given)
    return between_corners(graph, LinearNDInterpolator(places, known, fill_value), *given)


def radial(graph: Graph, table: Any, x: object) -> Any:
    """Return SciPy's `RBFInterpolator`, whose kernel is a function of the distance."""
    kernel = _KERNELS.get(table.kernel)
    if kernel is None or table.neighbors is not None or table.d_dtype not in (float, np.float64):
        raise Untraceable(f"RBFInterpolator of kernel {table.kernel!r}, or of neighbors")
    np_, points = Facade(graph), traced(graph, x).short()
    if table.d.shape[1] != 1 or points.ndim != 2 or len(table.y) > _MOST:
        raise Untraceable("RBFInterpolator of several values, or of too many points")
    weights = table._coeffs[: len(table.y), 0]
    tail = table._coeffs[len(table.y) :, 0]

    def at(place: Any) -> Any:
        apart = [(place[k] - traced(graph, table.y[:, k])) * table.epsilon
                 for k in range(table.y.shape[1])]  # fmt: skip
        size = np_.sqrt(functools.reduce(lambda a, b: a + b, (p * p for p in apart)))
        total = np_.sum(traced(graph, weights) * kernel(np_, size))
        scaled = [(place[k] - s) / w for k, (s, w) in enumerate(zip(table._shift, table._scale,
                                                                     strict=True))]  # fmt: skip
        for c, powers in zip(tail, table.powers, strict=True):
            part: Any = float(c)
            for value, n in zip(scaled, powers, strict=True):
                part = part * (value ** int(n) if n else 1.0)
            total = total + part
        return total

    return traced(graph, [at(row) for row in points])


_KERNELS: dict[str, Any] = {
    "linear": lambda np, r: -r,
    "thin_plate_spline": lambda np, r: np.where(
        r == 0.0, 0.0, r * r * np.log(np.where(r == 0.0, 1.0, r))),
    "cubic": lambda np, r: r * r * r,
    "quintic": lambda np, r: -(r * r * r * r * r),
    "multiquadric": lambda np, r: -np.sqrt(r * r + 1.0),
    "inverse_multiquadric": lambda np, r: 1.0 / np.sqrt(r * r + 1.0),
    "inverse_quadratic": lambda np, r: 1.0 / (r * r + 1.0),
    "gaussian": lambda np, r: np.exp(-r * r),
}  # fmt: skip


def through_points(graph: Graph, polynomial: Any, x: object) -> Any:
    """Return SciPy's polynomials through points: by Newton's form, or by weights."""
    x, np_ = traced(graph, x), Facade(graph)
    if polynomial._y_extra_shape != ():
        raise Untraceable(f"{type(polynomial).__name__} of several values")
    if hasattr(polynomial, "wi"):
        return _by_weights(np_, polynomial, x)
    c = polynomial.c[:, 0]
    value, factor = float(c[0]) + 0.0 * x, 1.0
    for place, weight in zip(polynomial.xi, c[1:], strict=False):
        factor = factor * (x - float(place))
        value = value + factor * float(weight)
    return value


def _by_weights(np_: Facade, polynomial: Any, x: Arithmetic) -> Any:
    above, below, exact = 0.0, 0.0, []
    for place, value, weight in zip(polynomial.xi, polynomial.yi[:, 0], polynomial.wi, strict=True):
        apart = x - float(place)
        share = float(weight) / np_.where(apart == 0.0, 1.0, apart)
        above, below = above + share * float(value), below + share
        exact.append((apart == 0.0, float(value)))
    result = above / below
    for at_place, value in exact:
        result = np_.where(at_place, value, result)
    return result
