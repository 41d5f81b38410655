"""Arrays of expressions that read nothing, as the numbers that they are."""

from __future__ import annotations

from typing import Any

import numpy as np

from .arrays import Tracer
from .evaluate import evaluate_expressions
from .graph import needed

_READS = ("leaf", "call", "solve")


def constant_value(value: Tracer) -> Any:
    """Return an array of constants as numbers, any other as it is."""
    cells = list(value.values.flat)
    if any(e.varies for e in cells) or any(e.op in _READS for e in needed(cells)):
        return value
    numbers = evaluate_expressions(cells, {})
    kinds = {e.kind for e in cells}
    as_number = {"b": bool, "i": int}.get(kinds.pop() if len(kinds) == 1 else "f", float)
    if not value.shape:
        return as_number(numbers[0])
    if value.axis is None:
        return np.array([as_number(number) for number in numbers]).reshape(value.shape)
    rows = [np.broadcast_to(np.ravel(number), value.length) for number in numbers]
    whole = np.array(rows, dtype=as_number).reshape(*value.values.shape, value.length)
    return np.moveaxis(whole, -1, value.axis)
