"""Whether rates change with the rounding of states: then no step is short enough for any method.

A hash of a state does so, and a random number at each call.  Error control shortens steps until
what is left of such noise is within the tolerance, and a run has no end of these steps.
"""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

__all__ = ["MOST_STEPS", "ROUGH", "neighbours", "next_to", "rough_state"]

MOST_STEPS = 1e6  # to come at the pace so far: with less of them a run ends anyway
ROUGH = (
    "whenever its states change by rounding alone: no step is short enough for that; make it a "
    "smooth function of states, or sample the block that has it (nlctl.sampled)"
)
_WAYS = (0.0, 4.0, -4.0, 16.0)  # distances to the next number by which states are moved
_PART = 0.1  # of the tolerance in one step
_HARDLY = 1e-6  # of a rate


def next_to(x: np.ndarray, ways: float = _WAYS[1]) -> np.ndarray:
    """Return a state that is as good as the same, of the same shape."""
    return x + ways * np.spacing(x)


def neighbours(x: np.ndarray) -> list[np.ndarray]:
    """Return a state and states that are as good as the same."""
    return [next_to(x, way) for way in _WAYS]


def _noise(rates: Callable[[np.ndarray], np.ndarray], x: np.ndarray) -> np.ndarray:
    """Return by how much rates change with the rounding of states, 0 where they hardly do."""
    # Large rates have large last digits: those of a run that diverges are no noise.
    here, *others = map(rates, neighbours(x))
    noise = np.max([np.abs(other - here) for other in others], axis=0)
    return np.where(noise > _HARDLY * np.abs(here), noise, 0.0 * noise)


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
    noise = np.array([_noise(partial(rates, t), x) for t, x in points])
    share = length * np.median(noise, axis=0) / scale
    i = int(np.nanargmax(share)) if np.isfinite(share).any() else 0
    return i if share.size and share[i] >= _PART else None
