"""What is known of a comparison with a number from comparisons of the same thing before.

``if t < 3`` and then ``if t < 7``: where the first holds the second does, and a function with many
thresholds in a row has few paths through it.  NaN is on no side of any number, so that what did not
hold before says nothing of where a thing is that may be NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from .graph import Expr

_TURNED = {"lt": "gt", "le": "ge", "gt": "lt", "ge": "le"}
_OPPOSITE = {"lt": "ge", "le": "gt", "gt": "le", "ge": "lt"}


def implied_by(condition: Expr, decisions: Mapping[Expr, bool]) -> bool | None:
    """Return whether a condition holds where others do or do not; None if that is not known."""
    comparison = _with_number(condition)
    if comparison is None:
        return None
    thing, order, number = comparison
    is_number = thing.op == "leaf" and thing.data[0] == "t"
    facts = []
    for other, holds in decisions.items():
        decided = _with_number(other)
        if decided is not None and decided[0] is thing:
            facts.append((decided[1] if holds else _OPPOSITE[decided[1]], decided[2]))
            is_number |= holds
    if any(_implies(fact, (_OPPOSITE[order], number)) for fact in facts):
        return False
    if is_number and any(_implies(fact, (order, number)) for fact in facts):
        return True
    return None


def _with_number(condition: Expr) -> tuple[Expr, str, float] | None:
    """Return what is compared with which number, and how; None of other conditions."""
    if condition.op not in _TURNED:
        return None
    left, right = condition.args
    if right.op == "const" and left.op != "const" and not left.size:
        return left, condition.op, float(right.data)
    if left.op == "const" and right.op != "const" and not right.size:
        return right, _TURNED[condition.op], float(left.data)
    return None


def _implies(fact: tuple[str, float], question: tuple[str, float]) -> bool:
    """Whether one comparison of a thing that is not NaN implies another."""
    (order, number), (relation, limit) = fact, question
    if order[0] != relation[0] or math.isnan(number) or math.isnan(limit):
        return False
    if number == limit:
        return order == relation or relation.endswith("e")
    return number < limit if order[0] == "l" else number > limit
