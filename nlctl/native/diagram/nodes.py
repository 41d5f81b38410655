"""A block of a diagram, as everything that reads the diagram sees it."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...expressions.registers import Register
from ...sampling.system import Sampled
from ..purity.values import Message
from .wiring import Combination


@dataclass(frozen=True, kw_only=True)
class Slide:
    """Conditions that change at one place, and at which runs slide: a node stands for them."""

    what: tuple[str, str]  # block and name of the first
    places: tuple[int, ...]  # of them among the located conditions
    declared: tuple[int, ...]  # of them among the switching functions that blocks declare
    # of each comparison that changes there, what it is where the first's function is below 0, above
    sides: tuple[tuple[float, float], ...]
    # whether that is at each integer of something: two conditions, of even ones and of odd ones
    integers: bool = False

    @property
    def name(self) -> str:
        """What it is called: the first condition, and its block."""
        block, what = self.what
        return f"{what} of block '{block}'"

    def shares(self, other: "Slide") -> bool:
        """Whether it has a condition that another one has."""
        apart = set(self.places).isdisjoint(other.places)
        return not (apart and set(self.declared).isdisjoint(other.declared))


@dataclass(frozen=True, kw_only=True)
class Node:
    """One block of the schedule."""

    path: str  # names of the diagrams around it and its own, separated by dots
    system: Any
    state_offset: int  # where its states begin in the diagram's state vector
    # for every input the linear combination of signals that feeds it
    inputs: tuple[Combination, ...]
    # shape (noutputs, ninputs); which outputs depend on which inputs at the same instant
    direct: np.ndarray
    # why numba would compute its functions differently: they are traced, or called in Python
    numba_differs: tuple[str, ...] = ()
    messages: tuple[Message, ...] = ()  # that its functions write: they are traced or refused
    registers: tuple[Register, ...] = ()  # that its functions write: they are traced or refused
    called: frozenset[str] = frozenset()  # kinds of its functions that are not to be traced
    slide: Slide | None = None  # of the ideal relay that stands for a condition: what for
    # what samples the block, whose states are the first ones of this
    sampled: Sampled | None = None

    @property
    def size(self) -> int:
        """Number of its states."""
        return (self.sampled or self.system).nstates or 0
