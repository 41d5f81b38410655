"""Functions of `math` and of SciPy that are formulas of others."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ..arrays import Tracer, concatenated, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise
from .creation import whole_numbers
from .reductions import norm_of, prod, sum_along
from .shapes import by_moving
from .table import WRITTEN, Facade, enter, of


@functools.cache
def enter_scipy() -> None:
    """Enter functions of SciPy, as soon as somebody uses one."""
    from scipy import integrate, linalg, special

    enter([integrate.cumulative_trapezoid], cumulative_trapezoid)
    for name in ("solve", "inv", "det", "cholesky", "norm"):
        enter([getattr(linalg, name)], _of_linalg(name))
    enter([linalg.block_diag], by_moving(linalg.block_diag))
    for name, formula_of in _FORMULAS.items():
        enter([getattr(special, name)], _with_facade(formula_of))
    for name in ("erf", "erfc"):
        enter([getattr(special, name)], functools.partial(_elementwise, name))
    for name in ("log1p", "expm1", "exp2", "cbrt"):
        if getattr(special, name) is not getattr(np, name):
            enter([getattr(special, name)], functools.partial(_elementwise, name))


def cumulative_trapezoid(
    graph: Graph, y: Any, x: Any = None, dx: Any = 1.0, axis: int = -1, initial: Any = None
) -> Tracer:
    """Return the integrals from the first place to each."""
    array = traced(graph, y)
    if array.ndim != 1 or axis not in (0, -1):
        raise Untraceable("integrals along one axis of several")
    width = dx if x is None else elementwise(graph, "sub", *(traced(graph, x)[s] for s in _SHIFTED))
    both = elementwise(graph, "add", *(array[s] for s in _SHIFTED))
    areas = elementwise(graph, "div", elementwise(graph, "mul", width, both), 2.0)
    sums = WRITTEN[np.cumsum](graph, areas)
    if initial is None:
        return sums
    return concatenated(graph, [traced(graph, [initial]), sums])


_SHIFTED = (slice(1, None), slice(None, -1))


def _of_linalg(name: str) -> Any:
    written = WRITTEN[getattr(np.linalg, name)]

    def function(graph: Graph, *arguments: Any, **options: Any) -> Any:
        if name == "cholesky":
            lower = options.pop("lower", False)
            upper = written(graph, *arguments)
            return upper if lower else upper.T
        options = {k: v for k, v in options.items() if k not in _HOW}
        return written(graph, *arguments, **options)

    return function


_HOW = ("assume_a", "check_finite", "overwrite_a", "overwrite_b")  # how, not what


def _elementwise(name: str, graph: Graph, x: Any) -> Tracer:
    return elementwise(graph, name, x)


def _with_facade(written: Any) -> Any:
    return lambda graph, *rest, **named: written(Facade(graph), *rest, **named)


def softmax(np: Facade, x: Any, axis: object = None) -> Any:
    """e^x, divided by the sum of all."""
    e = np.exp(x - np.max(x, axis=axis, keepdims=True))
    return e / np.sum(e, axis=axis, keepdims=True)


def logsumexp(np: Facade, a: Any, axis: object = None) -> Any:
    """ln of the sum of e^a."""
    top = np.max(a, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    logarithm = np.log(np.sum(np.exp(a - top), axis=axis))
    return logarithm + (np.sum(top) if axis is None else np.squeeze(top, axis=axis))


_FORMULAS = {
    "expit": lambda np, x: 1.0 / (1.0 + np.exp(-1.0 * x)),
    "logit": lambda np, x: np.log(x / (1.0 - x)),
    "log_expit": lambda np, x: -1.0 * np.logaddexp(0.0, -1.0 * x),
    "xlogy": lambda np, x, y: np.where(np.logical_and(x == 0.0, y == y), 0.0, x * np.log(y)),
    "xlog1py": lambda np, x, y: np.where(np.logical_and(x == 0.0, y == y), 0.0, x * np.log1p(y)),
    "softmax": softmax,
    "logsumexp": logsumexp,
}


# -- math ------------------------------------------------------------------------------------------


def _whole(name: str) -> Any:
    def written(graph: Graph, x: Any) -> Any:
        value = traced(graph, x)
        if value.shape:
            raise Untraceable("a function of math of an array")
        finite = elementwise(graph, "lt", elementwise(graph, "absolute", value), math.inf).only
        if finite.op != "const":
            graph.guards.append(finite)
        return whole_numbers(graph, elementwise(graph, name, value))

    return written


of(math.floor)(_whole("floor"))
of(math.ceil)(_whole("ceil"))
of(math.trunc)(_whole("trunc"))


@of(math.dist)
def dist(graph: Graph, p: Any, q: Any) -> Tracer:
    """Return the distance of two points."""
    return norm_of(graph, elementwise(graph, "sub", traced(graph, p), traced(graph, q)))


@of(math.fsum)
def fsum(graph: Graph, values: Any) -> Tracer:
    """Return a sum."""
    return sum_along(graph, list(values))


@of(math.prod)
def _product(graph: Graph, values: Any, *, start: Any = 1) -> Tracer:
    """Return a product."""
    return elementwise(graph, "mul", start, prod(graph, list(values)))


@of(math.remainder)
def ieee_remainder(graph: Graph, x: Any, y: Any) -> Tracer:
    """Return what the nearest multiple of y leaves of x; of two equally far the even one."""
    op = functools.partial(elementwise, graph)
    size = op("absolute", y)
    rest = op("fmod", x, size)
    half = op("mul", 0.5, size)
    odd = op("ne", op("fmod", x, op("mul", 2.0, size)), rest)
    above = op("or", op("gt", rest, half), op("and", op("eq", rest, half), odd))
    below = op("or", op("lt", rest, op("neg", half)), op("and", op("eq", rest, op("neg", half)),
                                                         odd))  # fmt: skip
    remainder = op("select", above, op("sub", rest, size), rest)
    remainder = op("select", below, op("add", rest, size), remainder)
    return op("select", op("eq", size, math.inf), x, remainder)


@of(math.isclose)
def _isclose(graph: Graph, a: Any, b: Any, *, rel_tol: Any = 1e-9, abs_tol: Any = 0.0) -> Any:
    """Return whether a is next to b."""
    op = functools.partial(elementwise, graph)
    scale = op("maximum", op("absolute", a), op("absolute", b))
    near = op("le", op("absolute", op("sub", a, b)), op("maximum", op("mul", rel_tol, scale),
                                                        abs_tol))  # fmt: skip
    finite = op("lt", scale, math.inf)
    return op("or", op("and", near, finite), op("eq", a, b))
