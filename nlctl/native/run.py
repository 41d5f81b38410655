"""A run in machine code while it lasts: members that are integrated in a batch."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .along import Along
from .chattering.steps import Jump
from .integrate.workspace import Task, Work
from .machine.evaluations import Machine
from .spare import Spare


@dataclass(frozen=True, kw_only=True)
class Run:
    """Members that are integrated in a batch, and all arrays that this needs."""

    machine: Machine
    task: Task  # see `integrate.workspace`
    work: Work
    # exact derivatives, if the stiff method has asked for them and there are any
    along: Along | None = None
    # of members that chatter, by their lanes: where
    jumps: Mapping[int, Jump] = field(default_factory=dict)
    # with Taylor's method, if it has had its turn: see `nlctl.native.taylor.turns`
    series: Any = None
    early: np.ndarray = field(default_factory=lambda: np.zeros(0))  # jumps before the run (s)
    spare: Spare | None = None  # memory that the next run may take when this one is over

    @property
    def lanes(self) -> np.ndarray:
        """One record per member, see `integrate.state`."""
        return self.work.lanes
