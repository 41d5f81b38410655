"""Integers that the state decides: their bits, shifts, and quotients.

Python's integers have as many bits as they need; here they are floats, in which products by powers
of two, remainders and quotients by these are exact.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator

from .graph import Expr, Graph, Untraceable

_BITS = 53  # of an integer that is exact as a float
_KNOWN = {"and": operator.and_, "or": operator.or_, "xor": operator.xor}


def with_bits(graph: Graph, name: str, a: Expr, b: Expr) -> Expr:
    """Return ``&``, ``|`` or ``^`` of truth values or of integers."""
    if a.kind == b.kind == "b":
        return graph.op(name, a, b)
    if "f" in (a.kind, b.kind):
        raise Untraceable("bits of what is not an integer")
    truth = a if a.kind == "b" else b if b.kind == "b" else None
    a, b = graph.integer(a), graph.integer(b)
    if a.value is not None and b.value is not None:
        return graph.const(_KNOWN[name](graph.assumed(a), graph.assumed(b)))
    if truth is not None:
        lowest = graph.op("remainder", b if graph.integer(truth) is a else a, graph.const(2))
        common = graph.op("select", truth, lowest, graph.const(0))
    elif a.value is None and b.value is None:
        raise Untraceable("bits of two integers that depend on the state")
    else:
        number, mask = (a, b) if a.value is None else (b, a)
        common = _common(graph, number, graph.assumed(mask))
    if name == "and":
        return common
    twice = graph.op("mul", graph.const(1 + (name == "xor")), common)
    return graph.op("sub", graph.op("add", a, b), twice)


def _common(graph: Graph, number: Expr, mask: int) -> Expr:
    """Return the bits that an integer has in common with a known one."""
    if mask < 0:  # all but those of ~mask
        return graph.op("sub", number, _common(graph, number, ~mask))
    if mask.bit_length() > _BITS:
        raise Untraceable("more bits than a float has")
    total = graph.const(0)
    for first, end in _runs(mask):
        above = shifted(graph, number, -first)
        part = graph.op("remainder", above, graph.const(1 << (end - first)))
        total = graph.op("add", total, shifted(graph, part, first))
    return total


def _runs(mask: int) -> Iterator[tuple[int, int]]:
    """Yield where the bits of an integer begin that are 1, and where they end."""
    place = 0
    while mask >> place:
        if mask >> place & 1:
            end = place
            while mask >> end & 1:
                end += 1
            yield place, end
            place = end
        place += 1


def shifted(graph: Graph, number: Expr, places: int) -> Expr:
    """Return an integer with its bits moved to the left, or to the right where that is negative."""
    if number.kind == "f" or abs(places) > _BITS:
        raise Untraceable("a shift of what is not an integer, or by too many bits")
    number = graph.integer(number)
    if places >= 0:
        return graph.op("mul", number, graph.const(1 << places))
    quotient = graph.op("div", graph.number(number), graph.const(2.0**-places))
    return graph.integer(graph.op("floor", quotient))
