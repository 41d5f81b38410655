"""What becomes of one function of the corpus: traced, called as it stands, or refused."""

from __future__ import annotations

import time
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
from user_function_checks import Plain, Points, agrees, expected, shown

import nlctl
from engineers.entry import Entry, system

SCALES = (0.1, 1.0, 10.0)
TIMES = np.linspace(0.0, 0.1, 11)


@dataclass(frozen=True, kw_only=True)
class Fate:
    """What becomes of a function.

    Attributes
    ----------
    kind : str
        ``"traced"``, ``"called"`` as it stands, or ``"refused"``.
    why : str
        The reason that nlctl gives where it is not traced.
    apart : str
        Where the values differ from python-control's, nothing if they do not.
    """

    kind: str
    why: str = ""
    apart: str = ""


def points(entry: Entry, count: int = 24) -> Points:
    """Return random points; behind them ties, zeros, halves, signs and NaN."""
    rng = np.random.default_rng(len(entry.name))
    scale = np.resize(SCALES, count)
    x = rng.normal(size=(entry.states, count)) * scale
    u = rng.normal(size=(entry.inputs, count)) * scale
    t = rng.uniform(0, 3, count)
    x[:, 0], u[:, 0], t[0] = 0.0, 0.0, 0.0
    x[:, 1], u[:, 1] = 1.0, 1.0
    x[:, 2], u[:, 2] = np.resize([-1.0, 1.0, 2.0, 0.5], entry.states), -1.0
    x[:, 3] = np.resize([2.0, 2.0, -2.0, 0.0], entry.states)
    x[:, 4] = np.resize([20.0, 5.0, 10.0], entry.states)
    x[:, 5] = np.round(2 * x[:, 5]) / 2
    x[-1:, 6] = np.nan
    x[:1, 7] = np.nan
    return Points(t, x, u)


def fate(entry: Entry) -> Fate:
    """Return whether a function is traced, and whether its values are python-control's."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        made = system(entry)
        try:
            compiled = nlctl.compile(made)
        except nlctl.errors.CompileError as error:
            return Fate(kind="refused", why=str(error))
        if compiled.equations.calls:
            reason = next(iter(compiled.equations.calls.values())).reason
            return Fate(kind="called", why=reason)
        return Fate(kind="traced", apart=_apart(compiled, made, points(entry)))


def _apart(compiled: nlctl.native.Compiled, made: Any, at: Points) -> str:
    dx, _ = Plain(compiled).run(at)
    for lane in range(at.t.size):
        want, _ = expected(made, at.at(lane))
        found = dx[:, lane]
        if want is not None and np.isnan(at.x[:, lane]).any():
            more = np.isnan(found) & np.isfinite(want)  # NaN may travel further, never less far
            found = np.where(more, want, found)
        if not agrees(found, want):
            return f"point {lane}, x = {at.x[:, lane]}: {shown('dx', found, want)}"
    return ""


def first_run(entry: Entry) -> float:
    """Return how long it takes from a diagram to its first response (s)."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        made = system(entry)
        x0 = np.linspace(0.3, 0.7, entry.states)
        start = time.perf_counter()
        compiled = nlctl.compile(made)
        inputs = np.full((entry.inputs, TIMES.size), 0.2) if entry.inputs else 0.0
        nlctl.input_output_response(compiled, TIMES, inputs, x0)
        return time.perf_counter() - start
