"""A block of a diagram, as everything that reads the diagram sees it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...sampling.system import Sampled
from .wiring import Combination


@dataclass(frozen=True, kw_only=True)
class Node:
    """One block of the schedule.

    Attributes
    ----------
    path : str
        Names of the diagrams around it and its own, separated by dots.
    system : control.InputOutputSystem
    state_offset : int
        Where its states begin in the diagram's state vector.
    inputs : tuple of mappings
        For every input the linear combination of signals that feeds it.
    direct : ndarray of bool, shape (noutputs, ninputs)
        Which outputs depend on which inputs at the same instant.
    unbound : tuple of str
        Names in its functions that have no value on one of the ways: only traced are these right.
    sampled : Sampled or None
        What samples the block, whose states are the first ones of this.
    """

    path: str
    system: Any
    state_offset: int
    inputs: tuple[Combination, ...]
    direct: np.ndarray
    unbound: tuple[str, ...] = ()
    sampled: Sampled | None = None

    @property
    def size(self) -> int:
        """Number of its states."""
        return (self.sampled or self.system).nstates or 0
