"""One function of the corpus, with what makes a system of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control as ct

ENTRIES: list[Entry] = []


@dataclass(frozen=True, kw_only=True)
class Entry:
    """A right-hand side.

    Attributes
    ----------
    name, theme : str
        The function's and its module's.
    update : callable
        It: takes t, x, u and params.
    states, inputs : int
    params : dict
    """

    name: str
    theme: str
    update: Callable[..., Any]
    states: int
    inputs: int
    params: dict[str, Any]


def engineered(states: int, inputs: int = 1, **params: Any) -> Callable[[Any], Any]:
    """Put a function into the corpus; it stays what it is."""

    def noted(update: Any) -> Any:
        theme = update.__module__.rpartition(".")[2]
        ENTRIES.append(
            Entry(
                name=update.__name__, theme=theme, update=update, states=states, inputs=inputs,
                params=params,
            )
        )  # fmt: skip
        return update

    return noted


def system(entry: Entry) -> ct.NonlinearIOSystem:
    """Return the system that python-control makes of it."""
    return ct.nlsys(
        entry.update, None, states=entry.states, inputs=entry.inputs, outputs=entry.states,
        params=dict(entry.params), name=entry.name,
    )  # fmt: skip
