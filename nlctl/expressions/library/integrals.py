"""Integrals of functions of one number: QUADPACK's first sum, where that is all it takes.

Source: R. Piessens et al., QUADPACK (Springer, 1983), routines QAGS and QK21.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import traced
from ..graph import Graph, Untraceable
from ..operators import elementwise, total

# places and weights of Kronrod's sum, from the ends inwards, and weights of every other one in
# Gauss's
_PLACES = (
    0.995657163025808080735527280689003, 0.973906528517171720077964012084452,
    0.930157491355708226001207180059508, 0.865063366688984510732096688423493,
    0.780817726586416897063717578345042, 0.679409568299024406234327365114874,
    0.562757134668604683339000099272694, 0.433395394129247190799265943165784,
    0.294392862701460198131126603103866, 0.148874338981631210884826001129720, 0.0,
)  # fmt: skip
_KRONROD = (
    0.011694638867371874278064396062192, 0.032558162307964727478818972459390,
    0.054755896574351996031381300244580, 0.075039674810919952767043140916190,
    0.093125454583697605535065465083366, 0.109387158802297641899210590325805,
    0.123491976262065851077958109585166, 0.134709217311473325928054001771707,
    0.142775938577060080797094273138717, 0.147739104901338491374841515972068,
    0.149445554002916905664936468389821,
)  # fmt: skip
_GAUSS = (
    0.066671344308688137593568809893332, 0.149451349150580593145863396957658,
    0.219086362515982043995534934228163, 0.269266719309996355091226921569473,
    0.295524224714752870173815619188769,
)  # fmt: skip
_SMALLEST, _ROUNDING = np.finfo(float).tiny, np.finfo(float).eps


def quad(
    graph: Graph,
    func: Callable[..., Any],
    a: Any,
    b: Any,
    args: Any = (),
    full_output: object = 0,
    epsabs: float = 1.49e-8,
    epsrel: float = 1.49e-8,
    limit: int = 50,
) -> tuple[Any, Any]:
    """Return an integral and its error; where QUADPACK would divide the range it is called."""
    if full_output or limit < 1 or any(_is_infinite(graph, end) for end in (a, b)):
        raise Untraceable("an integral over an infinite range, or with other arguments")
    op = functools.partial(elementwise, graph)
    args = args if isinstance(args, tuple) else (args,)
    middle, half = op("add", a, b) * 0.5, op("sub", b, a) * 0.5
    pairs = [(half * place, weight) for place, weight in zip(_PLACES, _KRONROD, strict=True)]
    values = [
        (_number(graph, func(middle - away, *args)), _number(graph, func(middle + away, *args)))
        for away, _ in pairs[:-1]
    ]
    center = _number(graph, func(middle, *args))
    weights = traced(graph, np.array(_KRONROD[:-1]))
    left, right = (traced(graph, list(side)) for side in zip(*values, strict=True))
    kronrod = total(weights * (left + right)) + center * _KRONROD[-1]
    gauss = total(traced(graph, np.array(_GAUSS)) * (left + right)[1::2])
    sizes = op("absolute", left) + op("absolute", right)
    size = total(weights * sizes) + op("absolute", center) * _KRONROD[-1]
    away = kronrod * 0.5
    spread = total(weights * (op("absolute", left - away) + op("absolute", right - away)))
    spread = spread + op("absolute", center - away) * _KRONROD[-1]
    width = op("absolute", half)
    result, size, spread = kronrod * half, size * width, spread * width
    error = op("absolute", (kronrod - gauss) * half)
    share = op("div", error * 200.0, op("select", op("eq", spread, 0.0), 1.0, spread))
    sharper = spread * op("minimum", 1.0, share * op("sqrt", share))
    error = op("select", op("and", op("ne", spread, 0.0), op("ne", error, 0.0)), sharper, error)
    rounding = size * (50.0 * _ROUNDING)
    is_above = op("gt", size, _SMALLEST / (50.0 * _ROUNDING))
    error = op("select", is_above, op("maximum", rounding, error), error)
    bound = op("maximum", epsabs, op("absolute", result) * epsrel)
    is_small = op("and", op("le", error, bound), op("ne", error, spread))
    no_better = op("le", error, size * (100.0 * _ROUNDING))
    done = op("or", op("or", is_small, op("eq", error, 0.0)), no_better)
    graph.limited(done.only)
    return result, error


def _is_infinite(graph: Graph, end: Any) -> bool:
    only = traced(graph, end).only
    return only.op == "const" and math.isinf(only.data)


def _number(graph: Graph, value: Any) -> Any:
    """Return what an integrand has returned, a number or one in an array."""
    return traced(graph, value).reshape(())


def fixed_quad(
    graph: Graph, func: Callable[..., Any], a: Any, b: Any, args: Any = (), n: int = 5
) -> tuple[Any, None]:
    """Return Gauss's sum of n values, which the function is asked for at once."""
    places, weights = (traced(graph, v) for v in np.polynomial.legendre.leggauss(n))
    if any(_is_infinite(graph, end) for end in (a, b)):
        raise Untraceable("an integral over an infinite range")
    width = elementwise(graph, "sub", b, a)
    values = func(width * (places + 1.0) / 2.0 + a, *args)
    return width / 2.0 * total(weights * values, -1), None
