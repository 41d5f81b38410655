"""What a program takes and gives: where parameters lie, which events and memories there are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import control as ct
import numpy as np

from ...blocks import Block, event_count, guard_count, memory_states
from ...errors import BlockError, CompileError
from ...expressions.arrays import Tracer
from ...expressions.continuity import may_jump
from ...sampling.clock import Clock, Instants, instants, meetings
from ...sampling.system import Happening, clocks_of
from ...upstream.control_internals import StandIn
from ..purity.captured import recorded
from .nodes import Node
from .parameters import Slot, current_values, slots
from .schedule import Schedule

_MOST = 40  # ways in which clocks meet
_OF_CLOCK = ("dt", "offset", "delay", "jitter", "seed")  # what says when samples are taken


@dataclass(frozen=True, kw_only=True)
class Program:
    """The arrays of a program."""

    # for every block the places of its parameters in the flat vector `p`
    layout: Mapping[int, Mapping[str, Slot]]
    fixed: Mapping[int, Mapping[str, Any]]  # for every block its parameters that are no numbers
    switching: int  # number of switching functions
    memory: tuple[int, ...]  # indices of the memory states
    guards: tuple[int, ...] = ()  # of each guard, in their order, the block that it belongs to
    # of each block with guards its number, and where its states begin and end
    jumping: tuple[tuple[int, int, int], ...] = ()
    sampled: tuple[int, ...] = ()  # indices of the states of sampled blocks
    # of these blocks, as they were when the diagram was compiled, by their owners
    clocks: Mapping[Any, Clock] = field(default_factory=dict)

    @cached_property
    def meetings(self) -> tuple[Happening, ...]:
        """What may happen at one instant: there is a function of the program for each."""
        # Where parameters of clocks are overridden, more may; see `machine.evaluations`.
        every = tuple(meetings(self.clocks))
        if len(every) > _MOST:
            raise CompileError(
                f"{len(self.clocks)} clocks of sampled blocks may meet in {len(every)} ways, at "
                f"most {_MOST} can be compiled: give blocks of one rate the same offset and delay"
            )
        return every

    @property
    def events(self) -> int:
        """Size of the array `g` but for located conditions: switching functions and guards."""
        return self.switching + len(self.guards)

    @property
    def resets(self) -> int:
        """Number of states that resets return."""
        return sum(end - begin for _, begin, end in self.jumping)


def program(schedule: Schedule) -> Program:
    """Lay out the arrays of a diagram's program."""
    for node in schedule.nodes:
        _check_kind(node)
    layout = slots(schedule.holders)
    fixed = {
        i: {k: recorded(v) for k, v in current_values(node.system).items() if k not in layout[i]}
        for i, node in enumerate(schedule.holders)
    }
    return Program(
        layout=layout,
        fixed={i: values for i, values in fixed.items() if values},
        switching=sum(count_switching_functions(node) for node in schedule.nodes),
        memory=tuple(i for node in schedule.nodes for i in memory(node)),
        guards=tuple(i for i, node in enumerate(schedule.nodes) for _ in range(count_guards(node))),
        jumping=tuple(
            (i, node.state_offset, node.state_offset + node.size)
            for i, node in enumerate(schedule.nodes)
            if count_guards(node)
        ),
        sampled=tuple(
            node.state_offset + i
            for node in schedule.nodes
            for i in range(node.size if node.sampled else 0)
        ),
        clocks=clocks_of(n.sampled for n in schedule.nodes),
    )


def instants_of(
    schedule: Schedule, program: Program, times: np.ndarray, p: np.ndarray
) -> list[Instants]:
    """Return what is due to sampled blocks, for each column of `p`; at the last time, too."""
    begin, behind_end = float(times[0]), float(np.nextafter(times[-1], np.inf))
    known: dict[tuple[Clock, ...], Instants] = {}
    every = []
    for column in p.T:
        clocks = clocks_at(schedule, program, column)
        key = tuple(clocks.values())
        if key not in known:
            known[key] = instants(clocks, begin, behind_end, program.meetings)
        every.append(known[key])
    return every


def clocks_at(schedule: Schedule, program: Program, p: np.ndarray) -> dict[Any, Clock]:
    """Return the clocks of sampled blocks that a parameter vector says, by their owners."""
    owners = (holder.system for holder in schedule.samplings)
    every = slots_of_clocks(schedule, program)
    clocks = {}
    for owner, of_clock in zip(owners, every, strict=True):
        values = {name: p[slot.offset].item() for name, slot in of_clock.items()}
        clocks[owner] = Clock(**values | {"seed": int(values["seed"])})
    return clocks


def slots_of_clocks(schedule: Schedule, program: Program) -> list[dict[str, Slot]]:
    """Return where the parameters of each clock lie, by their names."""
    first = len(schedule.nodes)
    layouts = (program.layout[first + k] for k in range(len(schedule.samplings)))
    return [{name: layout[name] for name in _OF_CLOCK} for layout in layouts]


def count_switching_functions(node: Node) -> int:
    """Return the number of switching functions that a block declares."""
    return event_count(node.system) if isinstance(node.system, Block) and not node.sampled else 0


def count_guards(node: Node) -> int:
    """Return the number of guards of a block."""
    return guard_count(node.system) if isinstance(node.system, Block) and not node.sampled else 0


def memory(node: Node) -> list[int]:
    """Return the indices of a block's memory states in the diagram's state."""
    if not isinstance(node.system, Block) or node.sampled:
        return []
    spec = node.system.spec
    return [node.state_offset + list(spec.states).index(m) for m in memory_states(spec)]


def _check_kind(node: Node) -> None:
    system = node.system
    for kind in ("inputs", "outputs", "states"):
        if getattr(system, f"n{kind}") is None:
            raise CompileError(
                f"block '{node.path}' does not say how many {kind} it has: give {kind}=... to "
                "ct.nlsys"
            )
    if isinstance(system, StandIn):
        raise CompileError(
            f"block '{node.path}' is compiled already: connect the diagram, its .system, and "
            "compile the whole"
        )
    if not isinstance(system, ct.StateSpace | ct.NonlinearIOSystem):
        raise CompileError(
            f"block '{node.path}' is a {type(system).__name__}; only nonlinear and state-space "
            "blocks can be compiled: convert it with ct.ss first"
        )


def check_continuous(node: Node, committed: Tracer, inputs: Tracer) -> None:
    """Refuse a memory without switching functions that may jump: error control does not see it."""
    known = {expr for expr, _ in inputs.pieces()}
    if may_jump([expr for expr, _ in committed.pieces()], known):
        raise BlockError(
            f"{type(node.system.spec).__name__} (block '{node.path}') needs a method switching: "
            "its commit may jump, and steps go past where it does unless a switching function is "
            "0 there; one that does not jump is written with np.minimum and np.maximum"
        )
