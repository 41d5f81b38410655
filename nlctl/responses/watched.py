"""Functions of a run whose changes of sign are its events, or its end."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import ParameterError

__all__ = ["Watched", "watched_functions"]

STOP = "stop_when"


@dataclass(frozen=True, kw_only=True)
class Watched:
    """A function that is watched in a run.

    Attributes
    ----------
    name : str
        What a row of `Response.events` calls it.
    function : callable
        ``function(t, x, u, params)``, a number: of the time, the states, the inputs and the
        overrides of the run.
    direction : int
        Which changes of its sign count: 1 rising, -1 falling, 0 both, as in SciPy.
    ends : bool
        Whether the run ends there.
    """

    name: str
    function: Callable[..., Any]
    direction: int = 0
    ends: bool = False

    def counts(self, rises: bool) -> bool:
        """Whether a change of sign counts that rises, or falls."""
        return self.direction == 0 or (self.direction > 0) == rises

    def value(self, t: float, x: np.ndarray, u: np.ndarray, params: Any) -> float:
        """Return its value.

        Raises
        ------
        ParameterError
            If it is not one number.
        """
        found = np.asarray(self.function(t, x, u, dict(params or {})), dtype=float)
        if found.size != 1:
            raise ParameterError(
                f"event function '{self.name}' must return one number, got {found.size}"
            )
        return float(found.reshape(-1)[0])


def watched_functions(stop_when: Any, events: Any) -> tuple[Watched, ...]:
    """Return what is watched in a run.

    Parameters
    ----------
    stop_when : callable or None
        Where its value changes its sign the run ends.
    events : callable, sequence of callables, mapping or None
        Further functions, by name in a mapping; otherwise they are called by their own names.
        ``direction`` and ``terminal`` of a function are as in `scipy.integrate.solve_ivp`.

    Raises
    ------
    ParameterError
        If one is not a function, or two have the same name.
    """
    given: list[tuple[str, Any]] = [] if stop_when is None else [(STOP, stop_when)]
    if isinstance(events, Mapping):
        given += [(str(name), function) for name, function in events.items()]
    elif isinstance(events, Sequence):
        given += [(_name(f, k), f) for k, f in enumerate(events)]
    elif events is not None:
        given.append((_name(events, 0), events))
    for name, function in given:
        if not callable(function):
            raise ParameterError(
                f"event '{name}' must be a function (t, x, u, params), got {function!r}"
            )
    names = [name for name, _ in given]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(
                f"two events are called '{name}': give them by name, events={{'first': ...}}"
            )
    return tuple(_watched(name, function) for name, function in given)


def _watched(name: str, function: Any) -> Watched:
    ends = name == STOP or bool(getattr(function, "terminal", False))
    direction = int(np.sign(getattr(function, "direction", 0)))
    return Watched(name=name, function=function, direction=direction, ends=ends)


def _name(function: Any, k: int) -> str:
    name = getattr(function, "__name__", "")
    return name if name.isidentifier() else f"event {k + 1}"
