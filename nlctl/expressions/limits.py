"""Whether a number is equal to itself within limits: `u == np.clip(u, low, high)`.

As an equality that is nowhere near 0 but where it holds; as orders it has the places at which it
begins and ends, like any comparison.
"""

from __future__ import annotations

from typing import Any

_ORDER = {"minimum": "le", "maximum": "ge"}
_BEYOND = {"minimum": "gt", "maximum": "lt"}


def within_limits(graph: Any, name: str, a: Any, b: Any) -> Any:
    """Return `eq` or `ne` of a number and the same within limits, by orders; None of others."""
    for number, limited in ((a, b), (b, a)):
        if _is_within(number, limited):
            equal = _equal(graph, number, limited)
            return equal if name == "eq" else graph.op("not", equal)
    return None


def _is_within(number: Any, limited: Any) -> bool:
    """Whether one of what a number is limited by, and of what that is, is another number."""
    while limited.op in _ORDER and number not in limited.args:
        limited = next((arg for arg in limited.args if arg.op in _ORDER), limited.args[0])
    return limited.op in _ORDER and number.op != "const"


def _equal(graph: Any, number: Any, limited: Any) -> Any:
    """Return whether a number is equal to what is made of it by limits."""
    op, (one, other) = graph.op, limited.args
    if number in (one, other):
        limit = other if one is number else one
        return op(_ORDER[limited.op], number, limit)
    inner, limit = (one, other) if _is_within(number, one) else (other, one)
    inside = op("and", _equal(graph, number, inner), op(_ORDER[limited.op], number, limit))
    # Where the limits are in the wrong order, the outer one is what it is equal to.
    wrong = op("and", op(_BEYOND[limited.op], inner, limit), op("eq", number, limit))
    return inside if _are_in_order(inner, limited.op, limit) else op("or", inside, wrong)


def _are_in_order(inner: Any, outer: str, limit: Any) -> bool:
    """Whether the limits are constants, and the lower one is not above the upper one."""
    constants = [arg.data for arg in inner.args if arg.op == "const"]
    if inner.op == outer or len(constants) != 1 or limit.op != "const":
        return False
    return bool(constants[0] <= limit.data if outer == "minimum" else constants[0] >= limit.data)
