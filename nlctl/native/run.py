"""A run in machine code while it lasts: members that are integrated in a batch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .along import Along
from .chattering.detection import Jump
from .machine.evaluations import Machine
from .spare import Spare


@dataclass(frozen=True, kw_only=True)
class Run:
    """Members that are integrated in a batch, and all arrays that this needs.

    Attributes
    ----------
    machine : Machine
    task, work : Task, Work
        See `integrate.workspace`.
    along : Along or None
        Exact derivatives, if the stiff method has asked for them and there are any.
    jumps : mapping
        Of members that chatter, by their lanes: where.
    series : Task or None
        With Taylor's method, if it has had its turn: see `nlctl.native.taylor.turns`.
    spare : Spare or None
        Memory that the next run may take when this one is over.
    """

    machine: Machine
    task: Any
    work: Any
    along: Along | None = None
    jumps: Mapping[int, Jump] = field(default_factory=dict)
    series: Any = None
    spare: Spare | None = None

    @property
    def lanes(self) -> np.ndarray:
        """One record per member, see `integrate.state`."""
        return self.work.lanes
