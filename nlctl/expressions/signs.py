"""What is seen of the sign of an expression, as it is written, from that of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

ANY_SIGN, NEVER_NEGATIVE, POSITIVE = 0, 1, 2  # wherever it is a number
_NEVER_NEGATIVE = ("absolute", "hypot", "sqrt")
_POSITIVE = ("exp", "exp2", "cosh")


class _HasSign(Protocol):
    @property
    def sign(self) -> int: ...


def sign_of(op: str, args: Sequence[_HasSign], data: Any) -> int:
    """Return the sign of an operation: one of `ANY_SIGN`, `NEVER_NEGATIVE` and `POSITIVE`."""
    if op == "const":
        return POSITIVE if data > 0 else NEVER_NEGATIVE if data >= 0 else ANY_SIGN
    if op in _POSITIVE:
        return POSITIVE
    signs = [arg.sign for arg in args]
    if op == "maximum":
        return max(signs)
    if op == "add":
        return max(signs) if min(signs) else ANY_SIGN
    sign = min(signs) if op in ("mul", "div", "sqrt") else ANY_SIGN
    is_square = op == "mul" and args[0] is args[1]
    return max(sign, NEVER_NEGATIVE) if is_square or op in _NEVER_NEGATIVE else sign
