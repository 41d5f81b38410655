"""What is known before a run in python-control of where its equations change."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

__all__ = ["Known"]


def _unbounded(t: float) -> float:
    return np.inf


def _none(t: float) -> list[tuple[str, str, str]]:
    return []


@dataclass(frozen=True, kw_only=True)
class Known:
    """Conditions of a diagram's equations, as far as these can be read."""

    # times (s) until which conditions of t alone are as they were, and when they have changed
    stops: np.ndarray = field(default_factory=lambda: np.zeros((2, 0)))
    # ``switched(t)``: block, name and direction of the declared functions of t that switch there
    switched: Callable[[float], list[tuple[str, str, str]]] = _none
    # ``longest(t)``: how long a step from there may be (s), so that nothing that is a function of
    # t alone is stepped over
    longest: Callable[[float], float] = _unbounded
    # ``crossings(t, x, u)``: numbers that change their sign where other conditions change; u has
    # the inputs of the diagram, and behind them what leaves its delays
    crossings: Callable[[float, Any, Any], Any] | None = None
    labels: tuple[tuple[str, str], ...] = ()  # block and name of each of these
    # and how far behind it, or with a sign before, that is which says what its sign means; 0 for
    # none
    partners: tuple[int, ...] = ()
    # ``followed(places, t, x, u)``: up to which part of a step functions that are flat elsewhere
    # are followed, by times, states and inputs as of `crossings` at some parts of it, in columns
    followed: Callable[..., float] | None = None
