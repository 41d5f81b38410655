"""Integers that the state decides: their bits, shifts, and quotients.

Python's integers have as many bits as they need; here they are floats, in which products by powers
of two, remainders and quotients by these are exact.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator

from .graph import Expr, Graph, Untraceable

_BITS = 53  # of an integer that is exact as a float
_FEW = 16  # of integers whose bits are gone through one by one
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
        common = _common_of_open(graph, a, b)
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


def _common_of_open(graph: Graph, a: Expr, b: Expr) -> Expr:
    """Return the bits that two integers have in common, bit by bit where either may have any."""
    first, second = _possible(a), _possible(b)
    if first is None and second is None:
        raise Untraceable("bits of two integers that depend on the state")
    places = first if second is None else second if first is None else first & second
    total = graph.const(0)
    for place in (k for k in range(places.bit_length()) if places >> k & 1):  # type: ignore[union-attr]
        bits = (graph.op("remainder", shifted(graph, e, -place), graph.const(2)) for e in (a, b))
        total = graph.op("add", total, shifted(graph, graph.op("mul", *bits), place))
    return total


def _possible(number: Expr, depth: int = 16) -> int | None:
    """Return which bits an integer of at least 0 may have; None where that is not seen of it."""
    if number.op == "const":
        is_whole = 0 <= number.data < 1 << _FEW and float(number.data).is_integer()
        return int(number.data) if is_whole else None
    if not depth:
        return None
    if number.op == "remainder" and number.args[1].op == "const":  # of at least 0, and less
        rest = _possible(number.args[1])
        return (1 << (rest - 1).bit_length()) - 1 if rest else None
    if number.op == "floor":
        return _shifted_down(number.args[0], depth)
    parts = [_possible(part, depth - 1) for part in number.args[number.op == "select" :]]
    known = [part for part in parts if part is not None]
    if number.op not in ("select", "add", "mul") or len(known) < len(parts):
        return None
    if number.op == "select" or (number.op == "add" and not known[0] & known[1]):
        return known[0] | known[1]
    most = known[0] + known[1] if number.op == "add" else known[0] * known[1]
    if number.op == "mul" and any(v and not v & (v - 1) for v in known if _is_constant(number, v)):
        return most  # by a power of two: all bits move
    return (1 << most.bit_length()) - 1 if most.bit_length() <= _FEW else None


def _is_constant(product: Expr, value: int) -> bool:
    """Whether one of the factors is this constant."""
    return any(part.op == "const" and part.data == value for part in product.args)


def _shifted_down(quotient: Expr, depth: int) -> int | None:
    """Return which bits an integer may have that is divided by a power of two."""
    if quotient.op not in ("div", "mul") or quotient.args[1].op != "const":
        return None
    factor = float(quotient.args[1].data)
    places = math.frexp(factor)[1] - 1 if factor > 0 else 0
    places = places if quotient.op == "div" else -places
    bits = _possible(quotient.args[0], depth - 1)
    is_power = factor > 0 and math.frexp(factor)[0] == 0.5
    return bits >> places if is_power and places >= 0 and bits is not None else None


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
