"""Python's round of its own floats to decimals: that of the decimal number, in exact arithmetic.

Source: T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math.
18 (1971) 224-242.
"""

from __future__ import annotations

from .graph import Expr, Graph

_SPLITTER = 2.0**27 + 1.0
_WHOLE = 2.0**52  # from here on floats are integers


def to_decimals(graph: Graph, x: Expr, digits: int) -> Expr:
    """Return x with so many decimals, of two that are equally far the even one."""
    op, const = graph.op, graph.const
    ten = const(10.0**digits)
    if digits == 0:
        return op("rint", x)
    scaled, rest = op("mul", x, ten), _error(graph, x, 10.0**digits)
    nearest = op("rint", scaled)
    apart = op("sub", scaled, nearest)
    up = op("and", op("eq", apart, const(0.5)), op("gt", rest, const(0.0)))
    down = op("and", op("eq", apart, const(-0.5)), op("lt", rest, const(0.0)))
    one = const(1.0)
    nearest = op("select", up, op("add", nearest, one), nearest)
    nearest = op("select", down, op("sub", nearest, one), nearest)
    is_small = op("lt", op("absolute", scaled), const(_WHOLE))
    return op("select", is_small, op("div", nearest, ten), x)


def _error(graph: Graph, x: Expr, factor: float) -> Expr:
    """Return what the product of x and a factor is more than its float."""
    op, const = graph.op, graph.const
    split = _SPLITTER * factor
    high = split - (split - factor)
    low = factor - high
    far = op("mul", const(_SPLITTER), x)
    x_high = op("sub", far, op("sub", far, x))
    x_low = op("sub", x, x_high)
    rest = op("sub", op("mul", x_high, const(high)), op("mul", x, const(factor)))
    rest = op("add", rest, op("mul", x_high, const(low)))
    rest = op("add", rest, op("mul", x_low, const(high)))
    return op("add", rest, op("mul", x_low, const(low)))
