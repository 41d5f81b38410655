"""A diagram with other blocks in the same places."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import control as ct
import numpy as np

from ..diagrams import reconnected


def staged(diagram: Any, first: Any = None, last: Any = None) -> Any:
    """Return a diagram whose inputs go through a block of as many, and its outputs as well."""
    connect, given, shown = diagram.connect_map, diagram.input_map, diagram.output_map
    parts = list(diagram.syslist)
    if last is not None:  # it takes what the outputs were made of
        y, u = np.split(shown, [connect.shape[1]], axis=1)
        connect = np.block([[connect, np.zeros((len(connect), len(y)))],
                            [y + u @ connect, np.zeros((len(y), len(y)))]])  # fmt: skip
        given = np.vstack([given, u @ given])
        shown = np.hstack([np.zeros_like(y), np.eye(len(y)), np.zeros((len(y), len(connect)))])
        parts.append(last)
    if first is not None:
        count = given.shape[1]
        shown = np.insert(shown, [connect.shape[1]] * count, 0.0, axis=1)
        shown = np.hstack([shown, np.zeros((len(shown), count))])
        connect = np.block([[connect, given], [np.zeros((count, connect.shape[1] + count))]])
        given = np.vstack([np.zeros_like(given), np.eye(count)])
        parts.append(first)
    return reconnected(diagram, parts, (connect, given, shown), diagram.dt)


def rebuilt(diagram: Any, change: Callable[[Any], Any], dt: Any) -> Any:
    """Return a diagram of changed blocks, connected as those of another one are."""
    parts = [
        rebuilt(part, change, dt) if isinstance(part, ct.InterconnectedSystem) else change(part)
        for part in diagram.syslist
    ]
    maps = (diagram.connect_map.copy(), diagram.input_map.copy(), diagram.output_map.copy())
    return reconnected(diagram, parts, maps, dt)
