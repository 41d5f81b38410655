"""Conditions that begin a fault, as text: ``|e| > 0.5``, ``plant.y < -1``."""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..errors import ParameterError

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
NAME = r"[A-Za-z_][\w.]*(?:\[\d+\])?"
TEXT = re.compile(rf"\s*(\|?)\s*({NAME})\s*(\|?)\s*(>=?|<=?)\s*({NUMBER})\s*")


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A signal, or its magnitude, above or below a level."""

    signal: str
    level: float
    is_magnitude: bool
    is_below: bool


def parse_condition(text: str) -> Condition:
    """Read a condition such as ``|e| > 0.5``.

    ``>`` and ``>=`` say the same: the instant at which a signal reaches a level is that at which
    it passes it.
    """
    match = TEXT.fullmatch(text) if isinstance(text, str) else None
    if match is None or match[1] != match[3]:
        raise ParameterError(
            f"Fault needs a condition such as when='|e| > 0.5' or when='plant.y < -1', got {text!r}"
        )
    return Condition(
        signal=match[2],
        level=float(match[5]),
        is_magnitude=bool(match[1]),
        is_below=match[4].startswith("<"),
    )
