"""What a program takes and gives: where parameters lie, which events and memories there are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import control as ct

from ...blocks import Block, event_count, memory_states
from ...errors import CompileError
from ...sampling.clock import Clock, meetings
from ...sampling.system import Happening
from ..diagram.schedule import Node, Schedule
from ..parameters import Slot, current_values, slots

_MOST = 40  # ways in which clocks meet


@dataclass(frozen=True, kw_only=True)
class Program:
    """The arrays of a program.

    Attributes
    ----------
    layout : mapping
        For every block the places of its parameters in the flat vector `p`.
    fixed : mapping
        For every block its parameters that are no numbers.
    corners : int
        Number of switching functions.
    memory : tuple of int
        Indices of the memory states.
    sampled : tuple of int
        Indices of the states of sampled blocks.
    clocks : tuple of Clock
        Of these blocks.
    """

    layout: Mapping[int, Mapping[str, Slot]]
    fixed: Mapping[int, Mapping[str, Any]]
    corners: int
    memory: tuple[int, ...]
    sampled: tuple[int, ...] = ()
    clocks: tuple[Clock, ...] = ()

    @cached_property
    def meetings(self) -> tuple[Happening, ...]:
        """What may happen at one instant: there is a function of the program for each.

        Raises
        ------
        CompileError
            If there is too much.
        """
        found = tuple(meetings(self.clocks))
        if len(found) > _MOST:
            raise CompileError(
                f"{len(self.clocks)} clocks of sampled blocks may meet in {len(found)} ways, at "
                f"most {_MOST} can be compiled: give blocks of one rate the same offset and delay"
            )
        return found

    @property
    def events(self) -> int:
        """Size of the array `g`: the switching functions of all corners, then what the memory
        states would be committed to.
        """
        return self.corners + len(self.memory)


def program(schedule: Schedule) -> Program:
    """Lay out the arrays of a diagram's program.

    Raises
    ------
    CompileError
        If a block is of a kind that cannot be compiled, or has no fixed size.
    """
    for node in schedule.nodes:
        _check_kind(node)
    layout = slots(schedule.nodes)
    fixed = {
        i: {k: v for k, v in current_values(node.system).items() if k not in layout[i]}
        for i, node in enumerate(schedule.nodes)
    }
    return Program(
        layout=layout,
        fixed={i: values for i, values in fixed.items() if values},
        corners=sum(count_switching_functions(node) for node in schedule.nodes),
        memory=tuple(i for node in schedule.nodes for i in memory(node)),
        sampled=tuple(
            node.state_offset + i
            for node in schedule.nodes
            for i in range(node.size if node.sampled else 0)
        ),
        clocks=tuple(dict.fromkeys(n.sampled.clock for n in schedule.nodes if n.sampled)),
    )


def count_switching_functions(node: Node) -> int:
    """Return the number of switching functions that a block declares."""
    return event_count(node.system) if isinstance(node.system, Block) and not node.sampled else 0


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
    if not isinstance(system, ct.StateSpace | ct.NonlinearIOSystem):
        raise CompileError(
            f"block '{node.path}' is a {type(system).__name__}; only nonlinear and state-space "
            "blocks can be compiled: convert it with ct.ss first"
        )
