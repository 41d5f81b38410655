"""Results as JSON can hold them, and back."""

import math
from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any

import numpy as np

NON_FINITE = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def as_json(value: object, *, null: bool = False) -> Any:
    """Return a value as JSON can hold it."""
    if isinstance(value, Mapping):
        return {str(key): as_json(part, null=null) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [as_json(part, null=null) for part in value]
    if isinstance(value, np.ndarray):
        return as_json(value.tolist(), null=null)
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, Integral):
        return int(value)
    if isinstance(value, Real):
        number = float(value)
        return number if math.isfinite(number) else None if null else str(number)
    return value if value is None else str(value)


def from_json(value: object) -> Any:
    """Undo `as_json`, up to the type of sequences."""
    if isinstance(value, dict):
        return {key: from_json(part) for key, part in value.items()}
    if isinstance(value, list):
        return [from_json(part) for part in value]
    return NON_FINITE.get(value, value) if isinstance(value, str) else value
