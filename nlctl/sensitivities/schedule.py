"""A diagram's schedule with room for derivatives: rates of inputs, and of what is delayed."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from enum import IntEnum
from typing import Any

import control as ct
import numpy as np

from ..blocks import block
from ..delays import TransportDelay
from ..native import Compiled
from ..native.diagram.nodes import Node
from ..native.diagram.parameters import Slot, length
from ..native.diagram.schedule import Schedule, stand_in
from ..native.diagram.wiring import Signal
from ..native.histories import direct_lines

_OWNERS = 4  # blocks of the derivatives' own: see `Extended.owner`


class Sent(IntEnum):
    """What is sent through each delay next to its signal; each has what those before it have."""

    DERIVATIVES = 0
    JUMPS = 1  # their number, heights and times, see `moving_times`
    RATES = 2  # of the signal: by its delay is differentiated, or a condition reads it
    TURNS = 3  # what is needed where a memory behind the delay reverses


class ScheduleWithRates(Schedule):
    """A schedule whose runs give the rates of all inputs, too."""

    @property
    def rates(self) -> int:
        """Number of the inputs whose rates are given."""
        return self.system.ninputs or 0


@dataclass(frozen=True, kw_only=True)
class Extended:
    """A schedule with a line for the derivatives of each delayed signal."""

    schedule: Schedule
    layout: dict[int, dict[str, Slot]]  # StatePlaces of all parameters, behind those of the diagram
    # the block that conditions belong to; memories that turn belong to the next, what turns before
    # a condition to the one behind, and jumps that leave delays to the last
    owner: int
    lines: int  # number of delayed signals
    by: int  # number of quantities
    sent: Sent  # what lines there are
    direct: np.ndarray  # whether what arrives at a line is at once made of what leaves another

    @property
    def groups(self) -> int:
        """Number of lines for each delayed signal, besides its own."""
        return count_groups(self.by, self.sent)

    @property
    def rates(self) -> int:
        """The group of the rates of delayed signals."""
        return count_groups(self.by, Sent.JUMPS)

    @property
    def bends(self) -> int:
        """The group of the rates of these rates; those of the derivatives follow."""
        return self.rates + 1

    @property
    def brought(self) -> int:
        """The first group of the derivatives of signals at times of jumps that move."""
        return self.bends + 1 + self.by

    def group_of_rates(self, group: int) -> int | None:
        """Return the group that has the rates of another, None if there is none."""
        if group == -1 and self.sent >= Sent.RATES:
            return self.rates
        if self.sent >= Sent.TURNS:
            if 0 <= group < self.by:
                return self.bends + 1 + group
            return self.bends if group == self.rates else None
        return None

    def is_delay(self, place: int) -> list[bool]:
        """Return of which delayed signals a parameter is the delay."""
        blocks = [line.block or 0 for line in self.schedule.lines[: self.lines]]
        return [self.layout[block]["delay"].offset == place for block in blocks]

    def line(self, j: int, i: int) -> int:
        """Return which line the derivative by quantity `j` of delayed signal `i` has."""
        # behind these: numbers, heights, and the derivatives of times of what jumps
        return self.lines * (1 + j) + i

    def slot(self, name: str) -> Slot:
        """Return the place of a parameter of this."""
        return self.layout[self.owner][name]


def extended(compiled: Compiled, outputs: Sequence[Any], by: int, sent: Sent) -> Extended:
    """Return the schedule of a diagram with room for its derivatives by so many quantities."""
    read = compiled.schedule
    before, arriving = len(read.nodes), read.outputs[compiled.system.noutputs or 0 :]
    groups = count_groups(by, sent)
    delays = [_derivative_of(read, i, j) for j in range(groups) for i in range(len(read.lines))]
    nothing = Node(
        path="derivatives", system=ct.ss([], [], [], []), state_offset=read.system.nstates or 0,
        inputs=(), direct=np.zeros((0, 0), dtype=bool),
    )  # fmt: skip
    nodes = (*read.nodes, *delays, *(nothing,) * _OWNERS)
    given = {f.name: getattr(read, f.name) for f in fields(Schedule)}
    given |= {
        "system": stand_in(read.system, read.system.nstates or 0, len(outputs)),
        "nodes": nodes,
        "order": (*read.order, *range(before, len(nodes))),
        "unknown": (*read.unknown, *(frozenset() for _ in range(before, len(nodes)))),
        "outputs": (*outputs, *arriving),
        "lines": (*read.lines, *(Signal(before + i, 0) for i in range(len(delays)))),
        "watched": (),
    }
    return Extended(
        schedule=ScheduleWithRates(**given), layout=_layout(compiled, len(delays), by),
        owner=len(nodes) - _OWNERS, lines=len(read.lines), by=by, sent=sent,
        direct=direct_lines(read),
    )  # fmt: skip


def count_groups(by: int, sent: Sent) -> int:
    """Return how many lines there are for each delayed signal, besides its own."""
    more = {Sent.JUMPS: 2 + by, Sent.RATES: 1, Sent.TURNS: 1 + 2 * by}
    return by + sum(count for what, count in more.items() if what <= sent)


def has_constant_delays(compiled: Compiled) -> bool:
    """Whether there are delays, none of which varies."""
    read = compiled.schedule
    delays = [read.nodes[line.block or 0].system.current_spec for line in read.lines]
    return bool(delays) and all(delay.varying is None for delay in delays)


def _derivative_of(read: Schedule, i: int, j: int) -> Node:
    """Return the delay of a derivative: like that of the signal, and 0 before the run."""
    spec = read.nodes[read.lines[i].block or 0].system.current_spec
    name = f"derivative_{j}_{i}"
    delay = TransportDelay(delay=spec.delay, varying=spec.varying)
    return Node(
        path=name, system=block(delay, name), state_offset=read.system.nstates or 0,
        inputs=({},), direct=np.zeros((1, 1), dtype=bool),
    )  # fmt: skip


def _layout(compiled: Compiled, delays: int, by: int) -> dict[int, dict[str, Slot]]:
    """Return the places of all parameters: those of the diagram stay where they are."""
    before, count = compiled.program.layout, len(compiled.schedule.nodes)
    at, layout = length(before), {i: dict(before[i]) for i in range(count)}
    for i in range(count, count + delays):
        layout[i] = {
            name: Slot(name=name, offset=at + k, shape=(), kind="f")
            for k, name in enumerate(("delay", "before"))
        }
        at += 2
    layout[count + delays] = {
        "scale": Slot(name="scale", offset=at, shape=(by,), kind="f"),
        "rtol": Slot(name="rtol", offset=at + by, shape=(), kind="f"),
        "atol": Slot(name="atol", offset=at + by + 1, shape=(), kind="f"),
        "late": Slot(name="late", offset=at + by + 2, shape=(), kind="f"),
        "steepest": Slot(name="steepest", offset=at + by + 3, shape=(), kind="f"),
        "rounding": Slot(name="rounding", offset=at + by + 4, shape=(), kind="f"),
    }
    layout |= {count + delays + k: {} for k in range(1, _OWNERS)}
    for k in range(len(compiled.schedule.samplings)):
        layout[count + delays + _OWNERS + k] = dict(before[count + k])
    return layout


def with_derivatives(
    compiled: Compiled, extended_program: Extended, states: int, outputs: int, by: int
) -> Schedule:
    """Return the schedule of the program: what arrives, and what leaves which line at once."""
    direct, lines = extended_program.direct, extended_program.schedule.lines
    arriving = []
    signals = set(range(extended_program.lines)) if extended_program.sent else set()
    for j in range(-1, extended_program.groups):
        for row in direct:
            reached = {
                extended_program.line(other, int(i))
                for i in np.flatnonzero(row)
                for other in {-1, j if j < by else -1}
            }
            # where a jump leaves a line, all derivatives jump, and another one may be sent
            reached |= signals if j >= 0 else set()
            arriving.append({lines[k]: 1.0 for k in sorted(reached)})
    return replace(
        extended_program.schedule,
        system=stand_in(compiled.system, states, outputs),
        outputs=(*({} for _ in range(outputs)), *arriving),
    )
