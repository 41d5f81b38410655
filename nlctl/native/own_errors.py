"""The error that a diagram's own functions raise where a run has ended.

Machine code has NaN where Python raises.  Who reads the message wants the error itself.
"""

import traceback
from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np
from scipy.integrate import solve_ivp

from ..diagrams import overridden
from ..upstream.control_internals import outputs_now, rates_now
from .reading import Reading
from .results import Trajectory

_FURTHER = 1e-3  # part of the run behind its end that is looked at
_CALLS = 2000  # of the functions, beyond which no error is expected


class _Enough(BaseException):
    """It was called often enough."""


def own_error(
    reading: Reading, made: Trajectory, params: Mapping[str, Any] | None
) -> Exception | None:
    """Return what python-control's functions raise just behind the end of a run, if they do."""
    finite = np.flatnonzero(np.isfinite(made.states).all(axis=0))
    if reading.schedule.lines or reading.program.sampled or reading.schedule.loops:
        return None  # what these do depends on more than the present
    if not finite.size or not ct.isctime(reading.system):
        return None
    system = overridden(reading.schedule.system, params)
    k, left = finite[-1], [_CALLS]
    start, x0 = float(made.time[k]), made.states[:, k]

    def rates(t: float, x: np.ndarray) -> np.ndarray:
        left[0] -= 1
        if left[0] < 0:
            raise _Enough
        u = np.array([np.interp(t, made.time, row) for row in made.inputs])
        outputs_now(system, t, x, u)
        return rates_now(system, t, x, u)

    span = float(made.time[-1] - made.time[0]) or 1.0
    end = max(float(made.statistics.time), start) + _FURTHER * span
    try:
        with np.errstate(all="ignore"):
            if np.isfinite(rates(start, x0)).all():  # else every shorter step ends the same
                solve_ivp(rates, (start, end), x0, max_step=span / 100)
    except _Enough:
        return None
    except Exception as error:  # whatever somebody's function raises
        return None if _is_of_the_library(error) else error
    return None


def _is_of_the_library(error: Exception) -> bool:
    """Whether it is python-control that raises, of values that are not finite, say."""
    *_, (frame, _) = traceback.walk_tb(error.__traceback__)
    return str(frame.f_globals.get("__name__")).partition(".")[0] in ("control", "nlctl", "scipy")
