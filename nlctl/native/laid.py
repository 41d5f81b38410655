"""What a task has of its program alone: it is laid out once, for all runs."""

from typing import NamedTuple

import numpy as np

from ..sampling.clock import Instants, instants
from .diagram.program import Program
from .histories import lines_of
from .integrate.delayed import DelayLines
from .integrate.events.functions import EventRows
from .integrate.events.sharp import Sharp
from .integrate.memory import with_table
from .integrate.methods.lu import WHOLE
from .integrate.methods.stiff import UNKNOWN, StiffMethod, stiff_method
from .integrate.resets import Resets
from .integrate.samples import Ticks
from .machine.evaluations import Machine
from .machine.routine import entries_of
from .reading import Reading
from .tied import tied


class Laid(NamedTuple):
    """Records of a task that machine code decides; integrators only read them."""

    code: Machine
    rows: EventRows
    resets: Resets
    sharp: Sharp
    stiff: StiffMethod  # before it is known what derivatives there are
    clocks: Ticks | None  # of a program without sampled blocks
    lines: DelayLines | None  # of one without delays


def laid_out(reading: Reading, code: Machine) -> Laid:
    """Return what tasks with this machine code have."""
    return reading.cache.found(Laid, lambda each: each.code is code, lambda: _laid(reading, code))


def _laid(reading: Reading, code: Machine) -> Laid:
    program, width, lines = reading.program, code.width, reading.schedule.lines
    nothing, signals = [instants({}, 0.0, 0.0)] * width, entries_of((code.out,))
    return Laid(
        code=code,
        rows=_rows(reading, code),
        resets=_resets(program, code),
        sharp=with_table(
            Sharp,
            functions=entries_of(code.sharp),
            kinds=np.array(code.lowered.sharp, dtype=np.int64),
        ),
        stiff=stiff_method(reading.system.nstates or 0, UNKNOWN, np.zeros((1, 1)), WHOLE),
        clocks=None if program.clocks else ticks_of(program, code, nothing),
        lines=None if lines else lines_of(reading, np.zeros((0, width)), [], signals),
    )


def _rows(reading: Reading, code: Machine) -> EventRows:
    """Return how many rows are whose: declared, located, memories."""
    program, watched = reading.program, reading.schedule.watched
    located, conditions = code.lowered.rows["g"], code.lowered.conditions
    partners = [*[0] * program.switching, *conditions.partners, *[0] * len(program.guards)]
    return with_table(
        EventRows,
        bending=program.switching,
        declared=program.switching + conditions.bending,
        guarded=located - len(program.guards),
        switching=located,
        watched=located - len(program.guards) - len(watched),
        ways=np.array([each.direction for each in watched], dtype=np.int64),
        ending=np.array([each.ends for each in watched], dtype=np.int64),
        ties=tied(reading),
        partners=np.array(partners, dtype=np.int64),
        memory=np.array(program.memory, dtype=np.int64),
    )


def _resets(program: Program, code: Machine) -> Resets:
    """Return the function of resets, the states that it fills, and whose guards are whose."""
    rows = [row for _, begin, end in program.jumping for row in range(begin, end)]
    owners = [block for block, begin, end in program.jumping for _ in range(begin, end)]
    owned = np.equal.outer(np.array(program.guards, dtype=int), np.array(owners, dtype=int))
    return with_table(
        Resets,
        functions=entries_of(code.resets),
        states=np.array(rows, dtype=np.int64),
        owned=np.ascontiguousarray(owned.reshape(len(program.guards), len(rows)), np.int64),
    )


def ticks_of(program: Program, code: Machine, due: list[Instants]) -> Ticks:
    """Return when something happens to sampled blocks of each lane, and what."""
    sampled, places = program.sampled, {what: k for k, what in enumerate(code.meetings)}
    ticks = np.full((len(due), max(one.times.size for one in due)), np.inf)
    which = np.zeros(ticks.shape, dtype=np.int64)
    for lane, one in enumerate(due):
        functions = np.array([places[what] for what in one.patterns], dtype=np.int64)
        ticks[lane, : one.times.size] = one.times
        which[lane, : one.times.size] = functions[one.which] if one.times.size else 0
    written = np.zeros((max(len(code.samples), 1), len(sampled)), dtype=np.int64)
    for k in range(len(code.samples)):
        for store in code.lowered.functions[f"sample{k}"].plan.stores:
            if store.array == "s":
                written[k, store.row : store.row + store.size] = 1
    return with_table(
        Ticks, ticks=ticks, which=which, functions=entries_of(code.samples), due=written,
        states=np.array(sampled, dtype=np.int64),
    )  # fmt: skip
