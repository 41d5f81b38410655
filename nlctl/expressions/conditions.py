"""Where expressions switch: for each comparison, `floor`, `abs`, `max`, what is 0 there.

A condition that an expression depends on divides what it is made of in two.  On each side the
expression is smooth; where the switching function changes its sign it may jump, or have a kink.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable
from functools import reduce
from itertools import pairwise

from .edges import domain_edges, have_edges, is_square, poles
from .graph import ORDERS, Expr, Graph, deduce, needed
from .levels import AtLevel, factors_of_difference, undone
from .without_poles import as_fraction, compared, multiplied

_OF_DIFFERENCES = (*ORDERS, "minimum", "maximum")
_OF_FIRSTS = ("absolute", "sign", "heaviside", "arctan2")
_OF_SECONDS = ("copysign",)
_OF_INTEGERS = {"floor": 0.0, "ceil": 0.0, "trunc": 0.0, "rint": 0.5}
_RESTS = ("remainder", "fmod")
_OF_QUOTIENTS = (*_RESTS, "floor_divide")
# functions that jump
JUMPING = (*_OF_INTEGERS, *_OF_QUOTIENTS, "sign", "heaviside", "copysign", "arctan2")


def conditions(
    exprs: Iterable[Expr], known: Collection[Expr] = (), unseen: Collection[Expr] = ()
) -> tuple[Expr, ...]:
    """Return all that expressions switch at, parts first; none of what is known, or unseen."""
    roots = list(exprs)
    nodes = [n for n in needed(roots, known) if n not in unseen]
    always = (n for n in nodes if n.op in ORDERS and _is_always(n))
    passed = {*known, *always}  # what has one value, whatever is compared
    nodes = [n for n in needed(roots, passed) if n not in unseen]
    return tuple(node for node in nodes if node.varies and node not in passed and _switches(node))


def _switches(node: Expr) -> bool:
    if asks_for_number(node):
        return True
    if node.op in _OF_DIFFERENCES:
        moves = any(arg.varies for arg in node.args)
        return moves and not _of_truths(node) and not _is_of_infinity(node)
    return (
        node.op in _OF_FIRSTS
        or number_rooted(node) is not None
        or at_integers(node)
        or (node.op in _OF_SECONDS and node.args[1].varies)
    )


def asks_for_number(node: Expr) -> bool:
    """Return whether a comparison says whether something is a number, as x != x does."""
    with_itself = node.op in ("eq", "ne") and node.args[0] is node.args[1]
    asks = with_itself or (node.op in ORDERS and _is_of_infinity(node))
    return asks and have_edges(needed(node.args))


def _is_always(node: Expr) -> bool:
    """Return whether a comparison never changes."""
    return _is_of_infinity(node) and not asks_for_number(node)


def at_integers(node: Expr) -> bool:
    """Return whether an operation jumps where something is an integer, as `floor` and `%` do."""
    return node.op in _OF_INTEGERS or node.op in _OF_QUOTIENTS


def number_rooted(node: Expr) -> Expr | None:
    """Return what a root is the size of, as sqrt(z z) is that of z; None of any other number."""
    square = node.args[0] if node.op in ("sqrt", "power") else node
    return square.args[0] if square is not node and is_square(square) else None


def _is_of_infinity(node: Expr) -> bool:
    """Return whether an operation compares with infinity: which is larger never changes."""
    return node.op in _OF_DIFFERENCES and any(
        arg.op == "const" and abs(arg.data) == math.inf for arg in node.args
    )


def _of_truths(node: Expr) -> bool:
    return all(arg.kind == "b" for arg in node.args)


def switching_function(graph: Graph, condition: Expr) -> Expr:
    """Return what changes its sign where a condition switches."""
    op, args = condition.op, [graph.number(arg) for arg in condition.args]
    if asks_for_number(condition):
        edges = domain_edges(graph, needed(args))
        return reduce(lambda a, b: graph.op("minimum", a, b), edges, graph.const(1.0))
    if op in _OF_DIFFERENCES:
        return _difference(graph, *args)
    if op in _OF_FIRSTS:
        return _signed(graph, args[0])
    if op in _OF_SECONDS:
        return _signed(graph, args[1])
    if (rooted := number_rooted(condition)) is not None:
        return rooted
    return _at_integers(graph, _counted(graph, condition))


def _counted(graph: Graph, condition: Expr) -> Expr:
    """Return what is an integer where a condition of integers switches."""
    args = [graph.number(arg) for arg in condition.args]
    counted = graph.op("div", *args) if condition.op in _OF_QUOTIENTS else args[0]
    shift = _OF_INTEGERS.get(condition.op, 0.0)
    return graph.op("add", counted, graph.const(shift)) if shift else counted


def switching_functions(graph: Graph, condition: Expr) -> tuple[Expr, ...]:
    """Return what changes its sign where a condition switches.

    Of a product each factor; of what jumps at integers a function for even ones, and one for odd
    ones: sin(pi z / 2) and -cos(pi z / 2), so that each says what the other one's sign means.
    """
    if at_integers(condition):
        return _at_even_and_odd(graph, _counted(graph, condition))
    if (passed := _table_passed(condition)) is not None:
        return _at_even_and_odd(graph, _place_in(graph, *passed))
    if asks_for_number(condition):
        return tuple(domain_edges(graph, needed(condition.args)))
    function = switching_function(graph, condition)
    if condition.op not in ORDERS:
        return sign_factors(graph, function)
    nodes = needed(condition.args)
    edges = [*domain_edges(graph, nodes), *poles(graph, nodes)]
    return tuple(part for product in (function, *edges) for part in sign_factors(graph, product))


def zigzag(graph: Graph, condition: Expr) -> Expr | None:
    """Return how far from an integer what `floor` or `%` counts is; None of what counts nothing."""
    # Positive above an even one and below an odd one: it is continuous between integers.
    if not at_integers(condition):
        return None
    counted = _counted(graph, condition)
    nearest = graph.op("rint", counted)
    return graph.op("mul", _sign(graph, nearest), graph.op("sub", counted, nearest))


def of_zigzag(graph: Graph, condition: Expr) -> tuple[Expr, Expr]:
    """Return what `floor` or `%` is next to an integer where its zigzag is < 0, and > 0."""
    op, nearest = condition.op, graph.op("rint", _counted(graph, condition))
    if op in _RESTS:
        below, above = _rests(graph, condition, nearest)
    else:
        op = "floor" if op in _OF_QUOTIENTS else op
        middle = 0.5 + _OF_INTEGERS[op]
        parts = (graph.op("sub", nearest, graph.const(c)) for c in (middle, middle - 1.0))
        below, above = (graph.op(op, part) for part in parts)
    even = graph.op("gt", _sign(graph, nearest), graph.const(0.0))
    return graph.op("select", even, below, above), graph.op("select", even, above, below)


def _rests(graph: Graph, rest: Expr, nearest: Expr) -> tuple[Expr, Expr]:
    """Return what a remainder is below and above an integer quotient: a divisor apart."""
    # More than half of the divisor is left on one side: a / b may be rounded to the integer itself.
    op, divisor, zero = graph.op, graph.number(rest.args[1]), graph.const(0.0)
    half = op("mul", graph.const(0.5), op("absolute", divisor))
    is_below = op("gt", op("absolute", rest), half)
    if rest.op == "fmod":  # with the sign of the dividend
        is_below = op("xor", is_below, op("lt", nearest, zero))
    below = op("select", is_below, rest, op("add", rest, divisor))
    above = op("select", is_below, op("sub", rest, divisor), rest)
    if rest.op == "remainder":
        return below, above
    jumps = op("ne", nearest, zero)
    return op("select", jumps, below, rest), op("select", jumps, above, rest)


def is_of_places(condition: Expr) -> bool:
    """Return whether a condition switches at places that are counted: integers, or a table's."""
    return at_integers(condition) or _table_passed(condition) is not None


def _table_passed(condition: Expr) -> tuple[Expr, Expr] | None:
    """Return a table in increasing order, and the number that it is compared with; None of none."""
    if condition.op in ORDERS and (condition.size or 1) > 1:
        for table, number in (condition.args, condition.args[::-1]):
            if table.op == "table" and number.size is None:
                return (table, number) if all(a < b for a, b in pairwise(table.data)) else None
    return None


def _place_in(graph: Graph, table: Expr, number: Expr) -> Expr:
    """Return the place of a number in a table: k at element k, and straight lines between."""
    op, size, ends = graph.op, table.size or 1, (table.data[0], table.data[-1])
    first, last = map(graph.const, ends)
    widths = [b - a for a, b in pairwise(table.data)]
    starts = graph.table(table.data[:-1])
    part = op("div", op("sub", number, starts), graph.table(widths))
    part = op("minimum", op("maximum", part, graph.const(0.0)), graph.const(1.0))
    before = op("minimum", op("sub", number, first), graph.const(0.0))
    behind = op("maximum", op("sub", number, last), graph.const(0.0))
    beyond = op("div", op("add", before, behind), graph.const(max(widths)))
    return op("add", graph.sum(part, size - 1), beyond)


def _is_product(node: Expr) -> bool:
    return node.op == "neg" or (node.op == "mul" and not is_square(node))


def sign_factors(graph: Graph, function: Expr) -> tuple[Expr, ...]:
    """Return what a product changes its sign with: between two roots close by it is hardly < 0."""
    known: dict[Expr, tuple[Expr, ...]] = {}

    def of_product(node: Expr) -> tuple[Expr, ...]:
        if not _is_product(node):
            return factors_of_difference(graph, node)
        several = [part for arg in node.args if arg.varies for part in known[arg]]
        return tuple(several) if len(set(several)) == len(several) > 0 else (node,)

    return deduce(known, function, lambda e: e.args if _is_product(e) else (), of_product)


def _signed(graph: Graph, number: Expr) -> Expr:
    """Return what has the sign of a number, as a difference what is compared."""
    if number.op == "sub" and number.args[0].op != "const":
        return _difference(graph, *number.args)
    return _difference(graph, graph.const(0.0), number)


def _difference(graph: Graph, a: Expr, b: Expr) -> Expr:
    """Return a - b; of what is compared with 0 itself, so that no rounding comes in."""
    # Of a root, a distance, the squares: near 0 it has a corner that no polynomial follows, so that
    # a step could pass through a small circle unseen.
    first, second = as_fraction(graph, a), as_fraction(graph, b)
    if not (first.is_whole and second.is_whole):
        for one, other in ((first, b), (second, a)):
            if _is_zero(other):
                return multiplied(graph, one.dividend, one.poles)
        return compared(graph, first, second)
    for one, other in ((a, b), (b, a)):
        if _is_zero(other) and one.op == "sub":  # what that says is compared
            a, b = map(graph.number, one.args)
            break
    if _is_zero(a):
        return b
    for rising, level, falls in ((a, b, False), (b, a, True)):
        # e^(-z^2) - c may be a narrow peak, -z^2 - log c is none
        at = undone(graph, AtLevel(rising, level, falls))
        if at is not None and not at.is_blurred:
            return at.difference(graph)
    return graph.op("sub", a, b)


def _is_zero(expr: Expr) -> bool:
    return expr.op == "const" and expr.data == 0.0


def _at_integers(graph: Graph, z: Expr) -> Expr:
    """Return what has a simple root where z is an integer."""
    # sin(pi z) = (-1)^n sin(pi (z - n)) with the nearest integer n: rounding of pi z does not move
    # the roots.
    nearest = graph.op("rint", z)
    rest = graph.op("mul", graph.const(math.pi), graph.op("sub", z, nearest))
    return graph.op("mul", _sign(graph, nearest), graph.op("sin", rest))


def _at_even_and_odd(graph: Graph, z: Expr) -> tuple[Expr, Expr]:
    """Return sin(pi z / 2) and -cos(pi z / 2), whose roots rounding does not move either."""
    one, nearest = graph.const(1.0), graph.op("rint", z)
    rest = graph.op("mul", graph.const(0.5 * math.pi), graph.op("sub", z, nearest))
    sine, cosine = graph.op("sin", rest), graph.op("cos", rest)
    half = graph.op("floor", graph.op("mul", nearest, graph.const(0.5)))
    odd = graph.op("sub", nearest, graph.op("add", half, half))
    even, sign = graph.op("sub", one, odd), _sign(graph, half)
    parts = [graph.op("mul", a, b) for a in (even, odd) for b in (sine, cosine)]
    return (
        graph.op("mul", sign, graph.op("add", parts[0], parts[3])),
        graph.op("mul", sign, graph.op("sub", parts[2], parts[1])),
    )


def _sign(graph: Graph, integer: Expr) -> Expr:
    """Return (-1)^n."""
    half = graph.op("mul", integer, graph.const(0.5))
    odd = graph.op("sub", half, graph.op("floor", half))  # 0 or 1/2
    return graph.op("sub", graph.const(1.0), graph.op("mul", graph.const(4.0), odd))
