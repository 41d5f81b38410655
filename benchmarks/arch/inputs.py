"""Inputs that are constant for a while, and tables that continue in straight lines.

Plants of the competition take signals in pieces; their tables continue beyond their ends.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator

import nlctl

DATA = Path(__file__).parent / "data"


@nlctl.record
class Pieces:
    """A signal that is constant for a period each; the last value stays.

    signal(t) = value[k],   k period <= t < (k + 1) period
    """

    outputs: tuple[str, ...]
    value: tuple[float, ...] = nlctl.param((0.0,), unit="1", meaning="values, one a period")
    period: float = nlctl.param(1.0, unit="s", meaning="how long each holds", above=0)

    inputs, states, feedthrough = (), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        """The value of the piece; it is read when a piece begins, and half of it is slack."""
        value = p.value[0]
        for k in range(1, len(p.value)):
            value = np.where(t >= (k - 0.5) * p.period, p.value[k], value)
        return (value,)


def pieces(signal: str, count: int, period: float, start: float = 0.0) -> Any:
    """Return a block of so many pieces, all equal until their parameters say otherwise."""
    record = Pieces(outputs=(signal,), value=(start,) * count, period=period)
    return nlctl.sampled(nlctl.block(record, signal), period)


def names(signal: str, count: int) -> list[str]:
    """Return the full names of the values of a block of `pieces`."""
    return [f"{signal}.value[{k}]" for k in range(count)]


def numbers(file: str) -> dict[str, np.ndarray]:
    """Return the arrays of a data file."""
    read = json.loads((DATA / file).read_text(encoding="utf-8"))
    return {key: np.array(v, dtype=float) for key, v in read.items() if key != "source"}


def line(places: Sequence[float], values: Sequence[float]) -> Any:
    """Return a table of one argument, straight between its places and beyond its ends."""
    places, values = np.asarray(places, dtype=float), np.asarray(values, dtype=float)
    slopes = np.diff(values) / np.diff(places)

    def function(x: Any) -> Any:
        inside = np.interp(x, places, values)
        return (
            inside
            + slopes[0] * np.minimum(x - places[0], 0.0)
            + slopes[-1] * np.maximum(x - places[-1], 0.0)
        )

    return function


def surface(rows: Sequence[float], columns: Sequence[float], values: np.ndarray) -> Any:
    """Return a table of two arguments, bilinear between its places and beyond its ends."""
    return RegularGridInterpolator((rows, columns), values, bounds_error=False, fill_value=None)
