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
    """Yield every block of a diagram with its inputs, in the order of the state vector."""
    # Shapes: `u` (ninputs,).
    places = iter(range(len(outputs)))
    yield from ((block, given) for block, given, _ in _walked(system, u, outputs, places))


def _walked(system: System, u: np.ndarray, outputs: Any, places: Any) -> list[Any]:
    """Return (block, inputs, place) of every block."""
    if not isinstance(system, ct.InterconnectedSystem):
        return [(system, u, next(places))]
    counts = [_count(part) for part in system.syslist]
    of_parts = [[next(places) for _ in range(count)] for count in counts]
    stacked = _inside(system, u, outputs, of_parts)
    walked = []
    for part, numbers, offset in zip(system.syslist, of_parts, system.input_offset, strict=True):
        given = stacked[offset : offset + (part.ninputs or 0)]
        walked += _walked(part, given, outputs, iter(numbers))
    return walked


def _count(system: System) -> int:
    if isinstance(system, ct.InterconnectedSystem):
        return sum(map(_count, system.syslist))
    return 1


def _inside(system: Any, u: np.ndarray, outputs: Any, numbers: list[list[int]]) -> np.ndarray:
    """Return the stacked inputs of a diagram's parts; wires through parts take some rounds."""
    y = np.zeros(system.connect_map.shape[1])
    for _ in range(len(system.syslist) + 1):
        stacked = system.connect_map @ y + system.input_map @ u
        y = _of_parts(system, stacked, outputs, numbers)
    return system.connect_map @ y + system.input_map @ u


def _of_parts(
    system: Any, stacked: np.ndarray, outputs: Any, numbers: list[list[int]]
) -> np.ndarray:
    """Return the stacked outputs of a diagram's parts, given those of all blocks."""
    given = zip(system.syslist, system.input_offset, numbers, strict=True)
    parts = [
        _delivered(part, stacked[offset:][: part.ninputs or 0], outputs, inner)
        for part, offset, inner in given
    ]
    return np.concatenate([np.zeros(0), *parts])


def _delivered(system: System, u: np.ndarray, outputs: Any, numbers: list[int]) -> np.ndarray:
    """Return the outputs of a part, given those of all blocks."""
    if not isinstance(system, ct.InterconnectedSystem):
        return np.asarray(outputs[numbers[0]], dtype=float)
    rest = iter(numbers)
    inner = [[next(rest) for _ in range(_count(part))] for part in system.syslist]
    stacked = _inside(system, u, outputs, inner)
    return system.output_map @ np.concatenate((_of_parts(system, stacked, outputs, inner), stacked))
