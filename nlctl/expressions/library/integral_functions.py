"""Special functions that are integrals of smooth functions: the trapezoidal rule, in vectors.

It converges exponentially over a period, and over the whole line.

Sources: DLMF 10.9.2 and 10.32.3 (Bessel functions of integer order), 10.32.9 (Macdonald's),
10.2.2 and 10.25.2 (their series), 6.2.1 (the exponential integral); L. N. Trefethen and J. A. C.
Weideman, The exponentially convergent trapezoidal rule, SIAM Rev. 56 (2014) 385-458.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Tracer, scalar, traced
from ..constants import constant_value
from ..graph import Graph, Untraceable
from ..operators import elementwise
from .table import Facade

__all__: list[str] = []

_PLACES = 128  # of one period
_FARTHEST = 60.0  # argument up to which that many places suffice
_ORDERS = 12
_TERMS = 14  # of a power series up to 1
_STEP = 0.25  # between places on a line


def _of_each(graph: Graph, x: object, function: Callable[[Tracer], Tracer]) -> Tracer:
    """Return what a function makes of each number."""
    array = traced(graph, x).short()
    results = [function(scalar(graph, graph.number(e))) for e in array.elements().flat]
    return traced(graph, results).reshape(array.shape) if array.shape else results[0]


def _weighed(graph: Graph, weights: np.ndarray, values: Any) -> Any:
    return Facade(graph).sum(traced(graph, weights) * values)


def _order(graph: Graph, v: object) -> int:
    order = constant_value(traced(graph, v))
    if not isinstance(order, int | float) or order != int(order) or abs(order) > _ORDERS:
        raise Untraceable("a Bessel function (jv, iv) whose order is not a small integer")
    return int(order)


def _series(x: Any, order: int, sign: float) -> Any:
    """Return the power series, which is exact next to 0."""
    half, total = 0.5 * x, 0.0
    square = sign * half * half
    for k in range(_TERMS, -1, -1):
        total = total * square + 1.0 / (math.factorial(k) * math.factorial(k + order))
    return half**order * total


def _periodic(graph: Graph, v: object, x: object, sign: float) -> Tracer:
    """Return J (sign = -1) or I (sign = 1) of integer order."""
    order, np_ = _order(graph, v), Facade(graph)
    n = abs(order)
    angles = 2.0 * np.pi * np.arange(_PLACES) / _PLACES
    flips = -1.0 if sign < 0 and order < 0 and n % 2 else 1.0

    def of_one(z: Any) -> Any:
        graph.limited((np_.abs(z) <= _FARTHEST).only)
        if sign < 0:
            shift, sines = traced(graph, n * angles), traced(graph, np.sin(angles))
            far = np_.sum(np_.cos(shift - z * sines)) / _PLACES
        else:
            weights = np.cos(n * angles) / _PLACES
            far = _weighed(graph, weights, np_.exp(z * traced(graph, np.cos(angles))))
        return flips * np_.where(np_.abs(z) < 1.0, _series(z, n, sign), far)

    return _of_each(graph, x, of_one)


def bessel(graph: Graph, v: object, x: object) -> Tracer:
    """The Bessel function of the first kind, of integer order; beyond 60 it is to be called."""
    return _periodic(graph, v, x, -1.0)


def modified_bessel(graph: Graph, v: object, x: object) -> Tracer:
    """The modified Bessel function of the first kind, of integer order; up to 60."""
    return _periodic(graph, v, x, 1.0)


def macdonald(graph: Graph, v: object, x: object) -> Tracer:
    """The modified Bessel function of the second kind, from 1e-8 on: exp(-x cosh s) cosh(v s)."""
    order, np_ = constant_value(traced(graph, v)), Facade(graph)
    if not isinstance(order, int | float) or abs(order) > _ORDERS:
        raise Untraceable("a Bessel function (kv) whose order is large or depends on the state")
    places = _STEP * np.arange(104)
    weights = _STEP * np.cosh(order * places)
    weights[0] *= 0.5

    def of_one(z: Any) -> Any:
        graph.limited(np_.logical_or(z >= 1e-8, z < 0.0).only)
        height = np_.minimum(np_.maximum(z, 0.0) * traced(graph, np.cosh(places)), 1e4)
        size = _weighed(graph, weights, np_.exp(-height))
        return np_.where(z < 0.0, math.nan, size + 0.0 * z)

    return _of_each(graph, x, of_one)


def exponential_integral(graph: Graph, x: object) -> Tracer:
    """The integral of exp(-s) / s from x on, with s = x (1 + e^v)."""
    np_ = Facade(graph)
    rise = np.exp(_STEP * np.arange(-156, 128))

    def of_one(z: Any) -> Any:
        graph.limited(np_.logical_or(z >= 1e-10, z < 0.0).only)
        height = np_.minimum(np_.maximum(z, 0.0) * traced(graph, rise), 1e4)
        size = _weighed(graph, _STEP * rise / (1.0 + rise), np_.exp(-height)) * np_.exp(-z)
        return np_.where(z < 0.0, math.nan, np_.where(z == math.inf, 0.0, size))

    return _of_each(graph, x, of_one)


def fixed(function: Callable[..., Tracer], order: float) -> Callable[..., Tracer]:
    """Return a function of fixed order."""
    return lambda graph, x: function(graph, order, x)


# -- means of means --------------------------------------------------------------------------------


def _means(np_: Facade, m: Any) -> tuple[Any, Any]:
    """Return the common limit of arithmetic and geometric means, and what E subtracts."""
    a, b = 1.0 + 0.0 * m, np_.sqrt(1.0 - m)
    rest, weight = 0.5 * m, 0.5
    for _ in range(14):
        a, b, half = 0.5 * (a + b), np_.sqrt(a * b), 0.5 * (a - b)
        weight = 2.0 * weight
        rest = rest + weight * half * half
    return a, rest


def ellipk(np_: Facade, m: Any) -> Any:
    """The complete elliptic integral of the first kind, by Gauss's means (DLMF 19.8.5)."""
    return np_.where(m == 1.0, math.inf, math.pi / (2.0 * _means(np_, m)[0]))


def ellipe(np_: Facade, m: Any) -> Any:
    """The complete elliptic integral of the second kind (DLMF 19.8.6)."""
    mean, rest = _means(np_, m)
    return np_.where(m == 1.0, 1.0, math.pi / (2.0 * mean) * (1.0 - rest))


# -- inverse error functions -----------------------------------------------------------------------

_FLAT = 0.147  # of Winitzki's approximation


def _guess(np_: Facade, logarithm: Any) -> Any:
    half = 2.0 / (math.pi * _FLAT) + 0.5 * logarithm
    return np_.sqrt(np_.sqrt(half * half - logarithm / _FLAT) - half)


def _polished(np_: Facade, x: Any, distance: Callable[[Any], Any]) -> Any:
    """Return a root of what has the slope of the error function, by Halley's method."""
    for _ in range(4):
        step = distance(x) * (0.5 * math.sqrt(math.pi)) * np_.exp(x * x)
        x = x - step / (1.0 + x * step)
    return x


def _of_tail(np_: Facade, c: Any) -> Any:
    """Return where the complementary error function is c, for c up to 1."""
    x = _guess(np_, np_.log(c * (2.0 - c)))
    return _polished(np_, x, lambda x: c - elementwise(np_.graph, "erfc", x))


def _near(np_: Facade, y: Any) -> Any:
    x = np_.copysign(_guess(np_, np_.log1p(-y * y)), y)
    return _polished(np_, x, lambda x: elementwise(np_.graph, "erf", x) - y)


def erfinv(np_: Facade, y: Any) -> Any:
    """Where the error function is y."""
    size = np_.abs(y)
    inside = size <= 0.5
    near = _near(np_, np_.where(inside, y, 0.25))
    far = _of_tail(np_, np_.where(inside | (size >= 1.0), 0.25, 1.0 - size))
    value = np_.where(inside, near, np_.copysign(far, y))
    return np_.where(size < 1.0, value, np_.where(size == 1.0, y * math.inf, math.nan))


def erfcinv(np_: Facade, c: Any) -> Any:
    """Where the complementary error function is c."""
    inside = np_.abs(1.0 - c) <= 0.5
    lower = c < 1.0
    tail = np_.where(lower, c, 2.0 - c)
    regular = np_.logical_not(inside) & (tail > 0.0)
    far = _of_tail(np_, np_.where(regular, tail, 0.25))
    near = _near(np_, np_.where(inside, 1.0 - c, 0.25))
    value = np_.where(inside, near, np_.where(lower, far, -far))
    ends = np_.where(c == 0.0, math.inf, np_.where(c == 2.0, -math.inf, math.nan))
    return np_.where(tail > 0.0, value, ends)


def ndtri(np_: Facade, p: Any) -> Any:
    """Where the normal distribution is p."""
    return -math.sqrt(2.0) * erfcinv(np_, 2.0 * p)


# -- gamma's ---------------------------------------------------------------------------------------

_BERNOULLI = (1 / 12, -1 / 120, 1 / 252, -1 / 240, 1 / 132, -691 / 32760, 1 / 12)


def digamma(np_: Facade, x: Any) -> Any:
    """The derivative of ln gamma (DLMF 5.5.2, 5.5.4, 5.11.2)."""
    left = x < 0.5
    z = np_.where(left, 1.0 - x, x)
    far = z + 10.0
    square = 1.0 / (far * far)
    series: Any = 0.0
    for c in reversed(_BERNOULLI):
        series = (series + c) * square
    value = np_.log(far) - 0.5 / far - series
    for k in range(10):
        value = value - 1.0 / (z + k)
    whole = np_.rint(x)
    turned = value - math.pi / np_.tan(math.pi * (x - whole))
    pole = (x == whole) & (x <= 0.0)
    value = np_.where(pole, math.nan, np_.where(left, turned, value))
    return np_.where(x == 0.0, -np_.copysign(math.inf, x), value)
