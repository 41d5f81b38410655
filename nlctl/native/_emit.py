"""From a schedule to readable Python source of one right-hand side.

The source calls the blocks' own functions and nothing else: an equation stays written once.  It
runs as plain Python and as machine code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._code import Code, code, sum_of
from ._parameters import Slot, slots
from ._schedule import Schedule
from ._values import as_vector


@dataclass(frozen=True, kw_only=True)
class Program:
    """Emitted source, and what it refers to.

    Attributes
    ----------
    source : str
        Defines ``rhs(t, x, u, p, dx, g)`` and ``out(t, x, u, p, y)``, which fill the derivatives
        `dx`, the outputs `y`, and in `g` first the switching functions of all corners, then what
        the memory states would be committed to.
    functions : mapping
        The blocks' own functions, by the names that the source uses.
    constants : mapping
        Fixed values that are no numbers, by name.
    records : mapping
        What gathers a block's parameters, by name: in plain Python, and in machine code.
    layout : mapping
        For every block the places of its parameters in the flat vector `p`.
    corners : int
        Number of switching functions.
    memory : tuple of int
        Indices of the memory states.
    """

    source: str
    functions: Mapping[str, Callable[..., Any]]
    constants: Mapping[str, Any]
    records: Mapping[str, tuple[Callable[..., Any], type]]
    layout: Mapping[int, Mapping[str, Slot]]
    corners: int
    memory: tuple[int, ...]

    @property
    def events(self) -> int:
        """Size of `g`."""
        return self.corners + len(self.memory)

    def namespace(self, *, native: bool) -> dict[str, Any]:
        """Return everything that the source refers to, by name."""
        records = {name: pair[native] for name, pair in self.records.items()}
        return {**self.constants, **self.functions, **records}


def emit(schedule: Schedule) -> Program:
    """Write the program of a schedule.

    Parameters
    ----------
    schedule : Schedule

    Returns
    -------
    Program

    Raises
    ------
    CompileError
        If a block is of a kind that cannot be compiled.
    """
    layout = slots(schedule.nodes)
    blocks = [code(i, node, layout[i]) for i, node in enumerate(schedule.nodes)]
    parameters = [line for block in blocks for line in block.parameter_lines()]
    outputs = [line for i in schedule.order for line in blocks[i].output_lines()]
    updates = [line for block in blocks for line in block.update_lines()]
    events = _numbered(blocks)
    updates += [line for block, places in events for line in block.event_lines(*places)]
    results = [f"y[{i}] = {sum_of(c)}" for i, c in enumerate(schedule.outputs)]
    source = "\n".join(
        [
            "def rhs(t, x, u, p, dx, g):",
            *_indented([*parameters, *outputs, *(updates or ["pass"])]),
            "",
            "",
            "def out(t, x, u, p, y):",
            *_indented([*parameters, *outputs, *(results or ["pass"])]),
            "",
        ]
    )
    functions: dict[str, Callable[..., Any]] = {}
    constants: dict[str, Any] = {"np": np, "as_vector": as_vector}
    records: dict[str, tuple[Callable[..., Any], type]] = {}
    for block in blocks:
        functions |= block.functions()
        constants |= block.constants()
        records |= block.records()
    return Program(
        source=source,
        functions=functions,
        constants=constants,
        records=records,
        layout=layout,
        corners=sum(block.corners for block in blocks),
        memory=tuple(i for block in blocks for i in block.memory),
    )


def _numbered(blocks: Sequence[Code]) -> list[tuple[Code, tuple[int, int]]]:
    """Give each block its places among the corners, and after all corners among the memories."""
    corner, memory = 0, sum(block.corners for block in blocks)
    places = []
    for block in blocks:
        places.append((block, (corner, memory)))
        corner, memory = corner + block.corners, memory + len(block.memory)
    return places


def _indented(lines: list[str]) -> Iterator[str]:
    return (f"    {line}" for line in lines)
