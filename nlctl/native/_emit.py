"""From a schedule to readable Python source of one right-hand side.

The source calls the blocks' own functions and nothing else: an equation stays written once.  It
runs as plain Python and as machine code.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._algebraic import failed, improve, new_loop, searching
from ._code import Code, code, sum_of
from ._parameters import Slot, slots
from ._schedule import Schedule, Signal
from ._values import as_vector

NEWTON = (new_loop, searching, improve, failed)  # what a program with algebraic loops calls


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
    owners : mapping
        Paths of the blocks that these functions belong to, by the same names.
    constants : mapping
        What else the source uses, by name: fixed values that are no numbers.
    fixed : mapping
        For every block its parameters that are no numbers.
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
    owners: Mapping[str, str]
    fixed: Mapping[int, Mapping[str, Any]]
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
    labels = _labels([node.path for node in schedule.nodes])
    blocks = [code(i, node, layout[i], labels[i]) for i, node in enumerate(schedule.nodes)]
    parameters = [line for block in blocks for line in block.parameter_lines()]
    outputs, ready = _output_lines(schedule, blocks)
    updates = [line for i, block in enumerate(blocks) for line in block.update_lines(i in ready)]
    events = _numbered(blocks)
    updates += [line for block, places in events for line in block.event_lines(*places)]
    results = [f"y[{i}] = {sum_of(c)}" for i, c in enumerate(schedule.outputs)]
    updates += _unsolved(schedule, ["dx[:] = np.nan", "g[:] = np.nan"])
    results += _unsolved(schedule, ["y[:] = np.nan"])
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
    constants: dict[str, Any] = {"np": np, "as_vector": as_vector}
    constants |= {f.__name__: f for f in NEWTON} if schedule.loops else {}
    return Program(
        source=source,
        functions={name: f for block in blocks for name, f in block.functions().items()},
        owners={name: block.node.path for block in blocks for name in block.functions()},
        fixed={block.index: block.fixed for block in blocks if block.fixed},
        constants=constants | {k: v for block in blocks for k, v in block.constants().items()},
        records={name: pair for block in blocks for name, pair in block.records().items()},
        layout=layout,
        corners=sum(block.corners for block in blocks),
        memory=tuple(i for block in blocks for i in block.memory),
    )


def _labels(paths: Sequence[str]) -> list[str]:
    """Return what names in the source begin with; a number is added where two would be equal."""
    clean = [re.sub(r"\W|^(?=\d)", "_", path) for path in paths]
    return [f"{name}_{i}" if clean.count(name) > 1 else name for i, name in enumerate(clean)]


def _output_lines(schedule: Schedule, blocks: Sequence[Code]) -> tuple[list[str], set[int]]:
    """Return the lines that make every block's outputs, and which blocks had their final inputs."""
    lines: list[str] = []
    ready: set[int] = set()
    at = 0
    for number, loop in enumerate(schedule.loops):
        lines += _evaluated(schedule, blocks, range(at, loop.start), {}, ready)
        name = f"loop{number}"
        guesses = {signal: f"{name}.guess[{k}]" for k, signal in enumerate(loop.torn)}
        inside = _evaluated(schedule, blocks, range(loop.start, loop.stop), guesses, ready)
        inside += [f"{name}.found[{k}] = {sum_of({s: 1.0})}" for k, s in enumerate(loop.torn)]
        names = ", ".join(blocks[s.block or 0].signal(s) for s in loop.torn)
        lines += [f"{name} = new_loop({len(loop.torn)})  # solved for {names}"]
        lines += [f"while searching({name}):"]
        lines += _indented([*inside, f"improve({name})"])
        at = loop.stop
    lines += _evaluated(schedule, blocks, range(at, len(schedule.order)), {}, ready)
    return lines, ready


def _evaluated(
    schedule: Schedule,
    blocks: Sequence[Code],
    places: Iterable[int],
    guesses: Mapping[Signal, str],
    ready: set[int],
) -> list[str]:
    lines: list[str] = []
    for place in places:
        block, unknown = schedule.order[place], schedule.unknown[place]
        lines += blocks[block].output_lines(unknown, guesses)
        (ready.discard if unknown or guesses else ready.add)(block)
    return lines


def _unsolved(schedule: Schedule, lines: list[str]) -> list[str]:
    """Make all results NaN where a loop was not solved: a block may turn NaN into a number."""
    which = " or ".join(f"failed(loop{i})" for i in range(len(schedule.loops)))
    return [f"if {which}:", *_indented(lines)] if which else []


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
