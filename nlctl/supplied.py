"""Outputs that are supplied to a block from outside: it alone cannot compute them.

What leaves a transport delay has entered it earlier; what an ideal relay outputs while it slides
follows from the rates of the whole diagram.  Where such a diagram is evaluated at an instant,
`supplying` says what leaves these blocks, and keeps what arrives at them.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Supplied:
    """How a record's outputs are supplied, as its class says in `supplied`."""

    why: str  # of whom, as the end of a sentence: python-control alone would run it wrongly
    continuous: str  # likewise, why it needs continuous time
    shared: str  # what one block in two places of a diagram would have for both
    rates: int = 0  # how many numbers its equations get behind the inputs, about the rate of these
    discrete: str = ""  # what takes its place in discrete time, if nothing else says that


@dataclass(kw_only=True)
class SuppliedOutput:
    """What leaves a block at an instant, which it alone does not know, and what arrives then."""

    leaving: Callable[[float], np.ndarray]  # what leaves at a time, of shape (signals,)
    arriving: np.ndarray  # (signals,): what has arrived when it was last asked


_NOW: ContextVar[Mapping[int, SuppliedOutput] | None] = ContextVar("nlctl_supplied", default=None)


@contextmanager
def supplying(outputs: Mapping[Any, SuppliedOutput]) -> Iterator[None]:
    """Say what leaves blocks whose outputs are supplied, where a diagram is evaluated."""
    # Python-control then finds the signals of the present, and what arrives at these blocks
    # is left in `outputs`, which goes by block.
    token = _NOW.set({id(block): output for block, output in outputs.items()})
    try:
        yield
    finally:
        _NOW.reset(token)


def supplied_now(block: object) -> SuppliedOutput | None:
    """Return what is supplied to a block now, None if nothing is."""
    return (_NOW.get() or {}).get(id(block))
