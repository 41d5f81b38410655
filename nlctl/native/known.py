"""What the graph of a diagram says of its conditions, for a run in python-control."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import control as ct
import numpy as np

from ..errors import AlgebraicLoopError, CompileError, UsageError
from ..reference.known import Known
from ..responses.watched import Watched
from ..upstream.systems import System
from . import compiled as engine
from .compiled import Compiled, with_watched
from .followed import followed
from .happened import declared_switches, row_labels
from .machine.evaluations import prepared_parameters
from .machine.routine import Routine
from .timed.ahead import ahead


def known_conditions(
    system: System,
    params: Mapping[str, Any] | None,
    times: np.ndarray,
    watched: tuple[Watched, ...] = (),
) -> Known:
    """Return what is known of the conditions of a diagram; nothing where it cannot be read."""
    if not ct.isctime(system):
        return Known()
    try:
        compiled = with_watched(engine.compile(system, params=params), watched, params)
        p = compiled.parameter_vector(params)
        lowered = compiled.lowered
    except (CompileError, AlgebraicLoopError, UsageError):
        return known_conditions(system, params, times) if watched else Known()
    found = {k: v[0] for k, v in ahead(lowered.timed, p[:, None], times, np.inf).items()}
    stops = np.stack([found["until"], found["jumps"]])[:, np.isfinite(found["jumps"])]
    located = lowered.conditions.rows - len(watched)  # these the run watches itself
    known = Known(
        stops=stops, switched=_switched(compiled, p), longest=_longest(found, times),
        followed=followed(compiled, p),
    )  # fmt: skip
    if not located:
        return known
    first = compiled.program.switching
    labels = row_labels(compiled, lowered.conditions)[first : first + located]
    return replace(
        known, labels=tuple(labels), partners=tuple(lowered.conditions.partners[:located]),
        crossings=_crossings(compiled, p, slice(first, first + located)),
    )  # fmt: skip


def _switched(compiled: Compiled, p: np.ndarray) -> Callable[[float], list[tuple[str, str, str]]]:
    """Return a function that says which declared functions of t switch at a time."""
    conditions = compiled.lowered.conditions
    labels = row_labels(compiled, conditions)

    def switched(t: float) -> list[tuple[str, str, str]]:
        rows = declared_switches(conditions, p, t)
        return [(*labels[row], "rising" if rises else "falling") for row, rises in rows]

    return switched


def _longest(found: dict[str, Any], times: np.ndarray) -> Callable[[float], float]:
    """Return how long steps may be: half a wave, and until where `reach` says."""
    begin, span, reach = float(times[0]), float(times[-1] - times[0]), found["reach"]

    def longest(t: float) -> float:
        if not reach.size:
            return float(found["longest"])
        cell = min(int((t - begin) / span * reach.size), reach.size - 1)
        return float(min(found["longest"], max(reach[cell] - t, span / reach.size)))

    return longest


def _crossings(compiled: Compiled, p: np.ndarray, which: slice) -> Callable[..., np.ndarray]:
    code, c = prepared_parameters(compiled, p)
    rows = code.lowered.rows
    x_now, u_now, dx, g, m = (np.empty((rows[name], 1)) for name in ("x", "u", "dx", "g", "m"))
    now = np.empty(1)
    given = now, x_now, u_now, c, dx, g, m
    rhs = code.rhs.bound(*given) if isinstance(code.rhs, Routine) else partial(code.rhs, *given)

    def crossings(t: float, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        now[0], x_now[:, 0], u_now[:, 0] = t, x, u
        rhs()
        return g[which, 0].copy()

    return crossings
