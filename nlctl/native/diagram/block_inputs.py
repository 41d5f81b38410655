"""The inputs of every block of a python-control diagram, by its own wires."""

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from ...diagrams import leaves
from ...upstream.systems import System


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
