"""Whether a loop as the proof understands it is the loop that was given.

Reading a diagram is a second description of it, and second descriptions can be wrong.  Before
anything is said, derivatives and outputs of both are compared, by python-control's own evaluation,
at the initial state, around it and wherever a run has been.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import control as ct
import numpy as np

from nlctl.diagrams import state_names
from nlctl.errors import DiagramError, UsageError

__all__ = ["check_same", "points_around"]

_Point = tuple[float, np.ndarray]
_EQUAL = 1e-9  # relative, and absolute below 1: the same functions at the same arguments
_COUNT, SPREADS = 24, (0.03, 0.3, 1.0)  # points of each spread
LATEST = 1e4  # s


def points_around(x: np.ndarray, *, seed: int = 0) -> list[_Point]:
    """Return times and states at which loops are compared: the start, and points around it.

    Parameters
    ----------
    x : ndarray of shape (n,)
    seed : int, optional
    """
    rng = np.random.default_rng(seed)
    points = [(0.0, x)]
    for spread in SPREADS:
        times = np.concatenate(
            [rng.uniform(0, 20, _COUNT // 2), rng.uniform(0, LATEST, _COUNT // 2)]
        )
        points += [(float(t), x + spread * rng.standard_normal(x.size)) for t in times]
    return points


def check_same(
    given: ct.InterconnectedSystem,
    understood: ct.InterconnectedSystem,
    points: Iterable[_Point],
    params: Mapping[str, Any] | None = None,
    own: Mapping[str, Any] | None = None,
) -> None:
    """Compare a loop with the proof's reading of it, at points.

    Parameters
    ----------
    given : control.InterconnectedSystem
        The diagram as it stands; its external inputs are 0.
    understood : control.InterconnectedSystem
        Its states begin with those of `given`; outputs of one name are compared.
    points : iterable of (t, x)
        Times (s) and states of `given`.
    params, own : mapping, optional
        Parameters of the run, for `given` and for `understood`.

    Raises
    ------
    DiagramError
        At the first difference: it names the state or output and shows both numbers.
    """
    names, u = state_names(given), np.zeros(given.ninputs or 0)
    more = np.zeros((understood.nstates or 0) - (given.nstates or 0))
    shared = [label for label in given.output_labels if label in understood.output_labels]
    places = [
        np.array([s.output_labels.index(label) for label in shared], dtype=int)
        for s in (given, understood)
    ]
    what = [*(f"d/dt {name}" for name in names), *(f"output '{label}'" for label in shared)]
    with np.errstate(all="ignore"):
        for t, x in points:
            rates, outputs = _evaluated(given, t, x, u, params)
            again, likewise = _evaluated(understood, t, np.append(x, more), np.zeros(0), own)
            a = np.concatenate([rates, outputs[places[0]]])
            b = np.concatenate([again[: x.size], likewise[places[1]]])
            _compare(given, t, what, a, b)


def _evaluated(
    system: Any, t: float, x: np.ndarray, u: np.ndarray, params: Any
) -> tuple[np.ndarray, np.ndarray]:
    """Return derivatives and outputs as python-control computes them."""
    own = dict(params or {})
    try:
        found = system.dynamics(t, x, u, params=own), system.output(t, x, u, params=own)
    except UsageError:
        raise
    except Exception as error:  # the blocks' functions may raise whatever they like
        raise DiagramError(
            f"'{system.name}' cannot be evaluated at t = {t:.6g} s, as the proof needs: "
            f"{type(error).__name__}: {error}"
        ) from error
    return np.asarray(found[0], dtype=float), np.asarray(found[1], dtype=float)


def _compare(given: Any, t: float, what: list[str], a: np.ndarray, b: np.ndarray) -> None:
    size = np.maximum(1.0, np.maximum(np.abs(a), np.abs(b)))
    same = (a == b) | (np.isnan(a) & np.isnan(b)) | (np.abs(a - b) <= _EQUAL * size)
    if not same.all():
        i = int(np.argmin(same))
        raise DiagramError(
            f"'{given.name}' is not the loop that the proof is about: at t = {t:.6g} s {what[i]} "
            f"is {a[i]:.9g}, and {b[i]:.9g} with the blocks connected by name"
        )
