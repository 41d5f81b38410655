"""Which outputs of a block depend on which of its inputs at the same instant."""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np

from ...blocks import Block
from ...expressions.graph import Ambiguous
from .parameters import slots_of
from .trace import dependence


def feedthrough(system: Any) -> np.ndarray:
    """Return which outputs depend directly on which inputs."""
    # nlctl's blocks declare it, linear systems have their D matrix, and the output functions of
    # others are traced: what reaches an output in their expressions is depended on, whatever the
    # values are.
    # returns (noutputs, ninputs).
    shape = (system.noutputs or 0, system.ninputs or 0)
    if isinstance(system, Block):
        return np.full(shape, bool(system.spec.feedthrough))
    if isinstance(system, ct.StateSpace):
        return np.not_equal(system.D, 0.0)
    if 0 in shape or getattr(system, "outfcn", None) is None:
        return np.zeros(shape, dtype=bool)
    return _traced(system)


def closer_feedthrough(system: Any, direct: np.ndarray) -> np.ndarray:
    """Return which entries of `direct` are there in the expressions of a block of nlctl."""
    return direct & _traced(system) if isinstance(system, Block) and direct.any() else direct


def _traced(system: Any) -> np.ndarray:
    try:
        return dependence(system, system.outfcn, slots_of(system))
    except Ambiguous:  # the block is refused when it is read
        return np.ones((system.noutputs or 0, system.ninputs or 0), dtype=bool)
