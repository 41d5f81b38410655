"""What an entry of the corpus is, and how a system is made of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import control as ct

SIZES = (2, 9, 40)  # few states, more than eight, and many
FOUND: list[Entry] = []


@dataclass(frozen=True)
class Pieces:
    """What `ct.nlsys` takes, made afresh by each call of a factory.

    Attributes
    ----------
    changed : dict
        Other values of the parameters, for a second comparison.
    """

    update: Callable[..., Any] | None
    output: Callable[..., Any] | None
    states: int
    inputs: int
    outputs: int
    params: dict[str, Any] = field(default_factory=dict)
    changed: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Entry:
    """One function as somebody wrote it.

    Attributes
    ----------
    name : str
        Name of the factory.
    make : callable
        Makes fresh pieces for a number of states.
    pure : bool
        Whether the result depends on the arguments alone: such a function agrees with
        python-control or is refused.  Any other is refused.
    discrete : bool
        Whether it is also checked in discrete time.
    alone : bool
        Whether it changes its arguments: within a diagram python-control lets that leak into
        other blocks, so that it is compared by itself alone.
    repeatable : bool
        Whether two fresh instances give the same numbers: clocks do not.
    theme : str
        Module of the entry.
    """

    name: str
    make: Callable[[int], Pieces]
    pure: bool = True
    discrete: bool = False
    alone: bool = False
    repeatable: bool = True
    theme: str = ""


def entry(make=None, **options):
    """Put a factory into the corpus; with options, as `@entry(pure=False)`."""
    if make is None:
        return lambda given: entry(given, **options)
    theme = make.__module__.rpartition(".")[2]
    FOUND.append(Entry(name=make.__name__, make=make, theme=theme, **options))
    return make


def pieces(update=None, output=None, *, states=0, inputs=2, outputs=None, changed=None, **params):
    """Return `Pieces`: y = x without an output function; other parameters are 10 % larger."""
    if outputs is None:
        outputs = 1 if output is not None else states
    if changed is None:
        changed = {key: other(value) for key, value in params.items()}
    return Pieces(update, output, states, inputs, outputs, params, changed)


def other(value):
    """Return another value of a parameter: of numbers alone, and not of whole ones."""
    if isinstance(value, bool):
        return not value
    return 1.1 * value + 0.05 if isinstance(value, float) else value


def system(made: Pieces, name: str, dt: float = 0):
    """Return the block, as a user makes it."""
    return ct.nlsys(
        made.update,
        made.output,
        states=made.states or None,
        inputs=made.inputs,
        outputs=made.outputs,
        params=dict(made.params),
        name=name,
        dt=dt,
    )
