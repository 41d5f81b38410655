"""The wires of a diagram: what feeds every block, nested diagrams flattened, and with what."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from ...diagrams import Place, leaves, places
from ...errors import AlgebraicLoopError
from ...upstream.systems import System

Combination = Mapping["Signal", float]


@dataclass(frozen=True)
class Signal:
    """An elementary signal: output `index` of block `block`, or external input `index`."""

    block: int | None  # None for an external input
    index: int


class Wiring:
    """The symbolic equations of a diagram's wiring, solved on demand."""

    def __init__(self, system: ct.InputOutputSystem) -> None:
        self.blocks: list[Place] = []
        self._parts: dict[Place, list[Place]] = {}
        self._solved: dict[tuple[str, Place, int], dict[Signal, float] | None] = {}
        for place in places(system):
            if isinstance(place.system, ct.InterconnectedSystem):
                self._parts[place] = []
            else:
                self.blocks.append(place)
            if place.parent is None:
                self.top = place
            else:
                self._parts[place.parent].append(place)
        self._index = {block: i for i, block in enumerate(self.blocks)}

    def inputs(self, here: Place) -> Iterator[Combination]:
        """Yield what feeds each input of a block."""
        for i in range(here.system.ninputs or 0):
            yield self._solve("in", here, i)

    def output(self, here: Place, i: int) -> Combination:
        """Return what makes output i of a block or diagram."""
        return self._solve("out", here, i)

    def _solve(self, kind: str, here: Place, i: int) -> dict[Signal, float]:
        key = (kind, here, i)
        if key not in self._solved:
            self._solved[key] = None  # being solved
            terms = self._input_terms(here, i) if kind == "in" else self._output_terms(here, i)
            total: dict[Signal, float] = {}
            for gain, combination in terms:
                for signal, weight in combination.items():
                    total[signal] = total.get(signal, 0.0) + gain * weight
            self._solved[key] = total
        solution = self._solved[key]
        if solution is None:
            raise AlgebraicLoopError(
                f"algebraic loop: signal {i} of '{here.system.name}' is wired to itself"
            )
        return solution

    def _input_terms(self, here: Place, i: int) -> Iterator[tuple[float, dict[Signal, float]]]:
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

    def _output_terms(self, here: Place, i: int) -> Iterator[tuple[float, dict[Signal, float]]]:
        if here not in self._parts:
            yield 1.0, {Signal(self._index[here], i): 1.0}
            return
        for column in np.flatnonzero(here.system.output_map[i]):
            yield float(here.system.output_map[i, column]), self._stacked(here, int(column))

    def _stacked(self, diagram: Place, column: int) -> dict[Signal, float]:
        """Solve for an entry of a diagram's stacked outputs, followed by its stacked inputs."""
        system = diagram.system
        count = system.connect_map.shape[1]
        kind, offsets, position = "out", system.output_offset, column
        if column >= count:
            kind, offsets, position = "in", system.input_offset, column - count
        part = int(np.searchsorted(offsets, position, side="right")) - 1
        return self._solve(kind, self._parts[diagram][part], int(position - offsets[part]))


def block_inputs(
    system: System, u: np.ndarray, outputs: Mapping[int, np.ndarray]
) -> list[tuple[Any, np.ndarray]]:
    """Return every block of a diagram with its inputs, in the order of the state vector."""
    # Shapes: `u` (ninputs,).
    return _walked(system, u, list(outputs.values()))[0]


def _walked(
    system: System, u: np.ndarray, outputs: Sequence[np.ndarray]
) -> tuple[list[tuple[Any, np.ndarray]], np.ndarray]:
    """Return the blocks of a part with their inputs, and its outputs, given those of all blocks."""
    if not isinstance(system, ct.InterconnectedSystem):
        return [(system, u)], np.asarray(outputs[0], dtype=float)
    ends = np.cumsum([0, *(len(list(leaves(part))) for part in system.syslist)])
    stacked, y, walked = np.zeros(0), np.zeros(system.connect_map.shape[1]), []
    for _ in range(len(system.syslist) + 2):  # wires through parts take some rounds
        stacked = system.connect_map @ y + system.input_map @ u
        walked = [
            _walked(part, stacked[offset:][: part.ninputs or 0], outputs[begin:end])
            for part, offset, begin, end in zip(
                system.syslist, system.input_offset, ends[:-1], ends[1:], strict=True
            )
        ]
        y = np.concatenate([np.zeros(0), *(shown for _, shown in walked)])
    blocks = [block for inner, _ in walked for block in inner]
    return blocks, system.output_map @ np.concatenate((y, stacked))
