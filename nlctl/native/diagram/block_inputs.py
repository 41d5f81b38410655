"""The inputs of every block of a python-control diagram, by its own wires."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import control as ct
import numpy as np

from ...upstream.systems import System


def block_inputs(
    system: System, u: np.ndarray, outputs: Mapping[int, np.ndarray]
) -> Iterator[tuple[Any, np.ndarray]]:
    """Yield every block of a diagram with its inputs, in the order of the state vector.

    Shapes: `u` (ninputs,).
    """
    places = iter(range(len(outputs)))
    yield from ((block, given) for block, given, _ in _walked(system, u, outputs, places))


def _walked(system: System, u: np.ndarray, outputs: Any, places: Any) -> list[Any]:
    """Return (block, inputs, place) of every block."""
    if not isinstance(system, ct.InterconnectedSystem):
        return [(system, u, next(places))]
    counts = [_count(part) for part in system.syslist]
    own = [[next(places) for _ in range(count)] for count in counts]
    stacked = _inside(system, u, outputs, own)
    found = []
    for part, numbers, offset in zip(system.syslist, own, system.input_offset, strict=True):
        given = stacked[offset : offset + (part.ninputs or 0)]
        found += _walked(part, given, outputs, iter(numbers))
    return found


def _count(system: System) -> int:
    if isinstance(system, ct.InterconnectedSystem):
        return sum(map(_count, system.syslist))
    return 1


def _inside(system: Any, u: np.ndarray, outputs: Any, own: list[list[int]]) -> np.ndarray:
    """Return the stacked inputs of a diagram's parts; wires through parts take some rounds."""
    y = np.zeros(system.connect_map.shape[1])
    stacked = np.zeros(system.connect_map.shape[0])
    for _ in range(len(system.syslist) + 1):
        stacked = system.connect_map @ y + system.input_map @ u
        for i, part in enumerate(system.syslist):
            given = stacked[system.input_offset[i] :][: part.ninputs or 0]
            made = _delivered(part, given, outputs, own[i])
            y[system.output_offset[i] : system.output_offset[i] + made.size] = made
    return system.connect_map @ y + system.input_map @ u


def _delivered(system: System, u: np.ndarray, outputs: Any, numbers: list[int]) -> np.ndarray:
    """Return the outputs of a part, given those of all blocks."""
    if not isinstance(system, ct.InterconnectedSystem):
        return np.asarray(outputs[numbers[0]], dtype=float)
    rest = iter(numbers)
    own = [[next(rest) for _ in range(_count(part))] for part in system.syslist]
    stacked = _inside(system, u, outputs, own)
    y = np.zeros(system.connect_map.shape[1])
    for i, part in enumerate(system.syslist):
        given = stacked[system.input_offset[i] :][: part.ninputs or 0]
        made = _delivered(part, given, outputs, own[i])
        y[system.output_offset[i] : system.output_offset[i] + made.size] = made
    return system.output_map @ np.concatenate((y, stacked))
