"""Reading a diagram: which blocks there are, what feeds them, in which order they are evaluated.

python-control evaluates every output function up to n + 1 times per right-hand side, until no
signal changes.  A schedule orders the outputs once, so that each is evaluated once.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from itertools import pairwise
from typing import Any

import control as ct
import numpy as np

from .._diagram import leaves
from .._errors import UsageError
from ._feedthrough import feedthrough

Combination = Mapping["Signal", float]


class AlgebraicLoopError(UsageError):
    """Signals that depend on each other at the same instant; the message prints the ring."""


@dataclass(frozen=True)
class Signal:
    """An elementary signal: output `index` of block `block`, or external input `index`.

    ``block`` is None for an external input.
    """

    block: int | None
    index: int


@dataclass(frozen=True, kw_only=True)
class Node:
    """One block of the schedule.

    Attributes
    ----------
    path : str
        Names of the diagrams around it and its own, joined by dots.
    system : control.InputOutputSystem
    state_offset : int
        Where its states begin in the diagram's state vector.
    inputs : tuple of mappings
        For every input the linear combination of signals that feeds it.
    direct : ndarray of bool, shape (noutputs, ninputs)
        Which outputs depend on which inputs at the same instant.
    """

    path: str
    system: Any
    state_offset: int
    inputs: tuple[Combination, ...]
    direct: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Schedule:
    """A flattened diagram.

    Attributes
    ----------
    system : control.InputOutputSystem
        The diagram that was read.
    nodes : tuple of Node
        Blocks in the order of the state vector.
    order : tuple of int
        Indices of the blocks in an order in which every output can be evaluated once.
    outputs : tuple of mappings
        Linear combination of signals that makes each output of the diagram.
    """

    system: Any
    nodes: tuple[Node, ...]
    order: tuple[int, ...]
    outputs: tuple[Combination, ...]


def schedule(system: ct.InputOutputSystem) -> Schedule:
    """Flatten a diagram and order its blocks.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram, nested to any depth, or a single block.

    Returns
    -------
    Schedule

    Raises
    ------
    AlgebraicLoopError
        If signals depend on each other without a state in between.
    """
    wiring = _Wiring(system)
    nodes = tuple(
        Node(
            path=leaf.path,
            system=leaf.system,
            state_offset=leaf.state_offset,
            inputs=tuple(wiring.inputs(occurrence)),
            direct=feedthrough(leaf.system),
        )
        for leaf, occurrence in zip(leaves(system), wiring.blocks, strict=True)
    )
    outputs = tuple(wiring.output(wiring.top, i) for i in range(system.noutputs or 0))
    return Schedule(system=system, nodes=nodes, order=_ordered(nodes), outputs=outputs)


def _ordered(nodes: tuple[Node, ...]) -> tuple[int, ...]:
    """Order blocks so that whatever an output depends on comes before it."""
    before: dict[int, set[int]] = {i: set() for i in range(len(nodes))}
    for i, node in enumerate(nodes):
        for j, combination in enumerate(node.inputs):
            if node.direct[:, j].any():
                before[i] |= {s.block for s in combination if s.block is not None}
    try:
        return tuple(TopologicalSorter(before).static_order())
    except CycleError as error:
        ring = error.args[1]
        raise AlgebraicLoopError(
            f"algebraic loop: {_ring_text(nodes, ring)} has no state in it"
        ) from None


def _ring_text(nodes: tuple[Node, ...], ring: list[int]) -> str:
    """Print a ring of blocks with the signals that join them."""
    labels = []
    for here, there in pairwise(ring):
        signals = [
            s
            for j, combination in enumerate(nodes[there].inputs)
            for s in combination
            if s.block == here and nodes[there].direct[:, j].any()
        ]
        label = nodes[here].system.output_labels[signals[0].index]
        labels.append(f"{nodes[here].path}.{label}")
    return " -> ".join([*labels, labels[0]])


@dataclass(frozen=True, eq=False)
class _Occurrence:
    """A system in its place: the same object may stand in a diagram twice."""

    system: Any  # a diagram or a block; only diagrams have maps and offsets
    parent: _Occurrence | None
    position: int


class _Wiring:
    """The symbolic equations of a diagram's wiring, solved on demand."""

    def __init__(self, system: ct.InputOutputSystem) -> None:
        self.blocks: list[_Occurrence] = []
        self._parts: dict[_Occurrence, list[_Occurrence]] = {}
        self._solved: dict[tuple[str, _Occurrence, int], dict[Signal, float] | None] = {}
        self.top = self._place(system, None, 0)
        self._index = {block: i for i, block in enumerate(self.blocks)}

    def _place(
        self, system: ct.InputOutputSystem, parent: _Occurrence | None, position: int
    ) -> _Occurrence:
        here = _Occurrence(system, parent, position)
        if isinstance(system, ct.InterconnectedSystem):
            parts = enumerate(system.syslist)
            self._parts[here] = [self._place(part, here, i) for i, part in parts]
        else:
            self.blocks.append(here)
        return here

    def inputs(self, here: _Occurrence) -> Iterator[Combination]:
        """Yield what feeds each input of a block."""
        for i in range(here.system.ninputs or 0):
            yield self._solve("in", here, i)

    def output(self, here: _Occurrence, i: int) -> Combination:
        """Return what makes output i of a block or diagram."""
        return self._solve("out", here, i)

    def _solve(self, kind: str, here: _Occurrence, i: int) -> dict[Signal, float]:
        key = (kind, here, i)
        if key not in self._solved:
            self._solved[key] = None  # being solved
            terms = self._input_terms(here, i) if kind == "in" else self._output_terms(here, i)
            total: dict[Signal, float] = {}
            for gain, combination in terms:
                for signal, weight in combination.items():
                    total[signal] = total.get(signal, 0.0) + gain * weight
            self._solved[key] = total
        found = self._solved[key]
        if found is None:
            raise AlgebraicLoopError(
                f"algebraic loop: signal {i} of '{here.system.name}' is wired to itself"
            )
        return found

    def _input_terms(
        self, here: _Occurrence, i: int
    ) -> Iterator[tuple[float, dict[Signal, float]]]:
        if here.parent is None:
            yield 1.0, {Signal(None, i): 1.0}
            return
        diagram = here.parent.system
        row = diagram.input_offset[here.position] + i
        for column in np.flatnonzero(diagram.connect_map[row]):
            yield float(diagram.connect_map[row, column]), self._stacked(here.parent, int(column))
        for column in np.flatnonzero(diagram.input_map[row]):
            gain = float(diagram.input_map[row, column])
            yield gain, self._solve("in", here.parent, int(column))

    def _output_terms(
        self, here: _Occurrence, i: int
    ) -> Iterator[tuple[float, dict[Signal, float]]]:
        if here not in self._parts:
            yield 1.0, {Signal(self._index[here], i): 1.0}
            return
        for column in np.flatnonzero(here.system.output_map[i]):
            yield float(here.system.output_map[i, column]), self._stacked(here, int(column))

    def _stacked(self, diagram: _Occurrence, column: int) -> dict[Signal, float]:
        """Solve for an entry of a diagram's stacked outputs, followed by its stacked inputs."""
        system = diagram.system
        count = system.connect_map.shape[1]
        kind, offsets = (
            ("out", system.output_offset) if column < count else ("in", system.input_offset)
        )
        position = column if column < count else column - count
        part = int(np.searchsorted(offsets, position, side="right")) - 1
        return self._solve(kind, self._parts[diagram][part], int(position - offsets[part]))
