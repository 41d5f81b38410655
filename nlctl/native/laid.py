"""What a task has of its program alone: it is laid out once, for all runs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..responses.watched import Watched
from .diagram.program import Program
from .integrate.events.functions import EventRows
from .integrate.memory import with_table
from .integrate.methods.lu import WHOLE
from .integrate.methods.stiff import UNKNOWN, StiffMethod, stiff_method
from .integrate.resets import Resets
from .machine.evaluations import Machine
from .reading import Reading


class Laid(NamedTuple):
    """Records of a task that machine code decides; integrators only read them."""

    code: Machine
    rows: EventRows
    resets: Resets
    stiff: StiffMethod  # before it is known what derivatives there are


def laid_out(reading: Reading, code: Machine) -> Laid:
    """Return what tasks with this machine code have."""
    return reading.cache.found(
        Laid,
        lambda each: each.code is code,
        lambda: Laid(
            code=code,
            rows=_rows(reading.program, code, reading.schedule.watched),
            resets=_resets(reading.program, code),
            stiff=stiff_method(reading.system.nstates or 0, UNKNOWN, np.zeros((1, 1)), WHOLE),
        ),
    )


def _rows(program: Program, code: Machine, watched: tuple[Watched, ...]) -> EventRows:
    """Return how many rows are whose: declared, located, memories."""
    located = code.lowered.rows["g"]
    bending = code.lowered.conditions.bending
    return with_table(
        EventRows,
        bending=program.switching,
        declared=program.switching + bending,
        guarded=located - len(program.guards),
        switching=located,
        watched=located - len(program.guards) - len(watched),
        ways=np.array([each.direction for each in watched], dtype=np.int64),
        ending=np.array([each.ends for each in watched], dtype=np.int64),
        memory=np.array(program.memory, dtype=np.int64),
    )


def _resets(program: Program, code: Machine) -> Resets:
    """Return the function of resets, the states that it fills, and whose guards are whose."""
    rows = [row for _, begin, end in program.jumping for row in range(begin, end)]
    owners = [block for block, begin, end in program.jumping for _ in range(begin, end)]
    owned = np.equal.outer(np.array(program.guards, dtype=int), np.array(owners, dtype=int))
    return with_table(
        Resets,
        functions=code.reset_entries,
        states=np.array(rows, dtype=np.int64),
        owned=np.ascontiguousarray(owned.reshape(len(program.guards), len(rows)), np.int64),
    )
