"""Whether expressions may jump: where what they are made of does not."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from .conditions import JUMPING
from .graph import ORDERS, Expr, needed

_UNKNOWN = ("call", "solve")  # what they do is not written in the expression


def may_jump(exprs: Iterable[Expr], known: Collection[Expr] = ()) -> bool:
    """Whether expressions have jumps of their own, as far as can be read off."""
    inside = [node for node in needed(exprs, known) if node not in known]
    return any(
        node.op in JUMPING
        or node.op in _UNKNOWN
        or (node.op == "select" and not is_an_extreme(node))
        for node in inside
    )


def is_an_extreme(choice: Expr) -> bool:
    """Whether a choice between two values is by which of them is larger."""
    condition, *values = choice.args
    return condition.op in ORDERS and set(condition.args) == set(values)
