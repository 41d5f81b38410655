"""Whether rates change with the rounding of states: then no step is short enough for any method.

A hash of a state does so, and a random number at each call.  Error control shortens steps until
what is left of such noise is within the tolerance, and a run has no end of these steps.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

__all__ = ["MOST_STEPS", "ROUGH", "next_to", "rough_state"]

MOST_STEPS = 1e6  # to come at the pace so far: with less of them a run ends anyway
ROUGH = (
    "whenever its states change by rounding alone: no step is short enough for that; make it a "
    "smooth function of states, or sample the block that has it (nlctl.sampled)"
)
_WAYS = (0.0, 4.0, -4.0, 16.0)  # distances to the next number by which states are moved
_PART = 0.1  # of the tolerance in one step


def next_to(x: np.ndarray, ways: float = _WAYS[1]) -> np.ndarray:
    """Return a state that is as good as the same, of the same shape."""
    return x + ways * np.spacing(x)


def rough_state(
    rates: Callable[[float, np.ndarray], np.ndarray],
    points: Sequence[tuple[float, np.ndarray]],
    length: float,
    scale: np.ndarray,
) -> int | None:
    """Return the state whose rate is noise that shortens steps of some length, None without one.

    Shapes: `scale` (nstates,), the tolerances.
    """
    if not points:
        return None
    noise = np.array([
        np.max([np.abs(rates(t, next_to(x, way)) - rates(t, x)) for way in _WAYS], axis=0)
        for t, x in points
    ])  # fmt: skip
    share = length * np.median(noise, axis=0) / scale
    i = int(np.nanargmax(share)) if np.isfinite(share).any() else 0
    return i if share.size and share[i] >= _PART else None
