"""Runs of a compiled program, from arrays alone: nothing here touches a diagram."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np

from .._errors import ParameterError
from .._names import unknown
from ._compile import Compiled
from ._integrate import machine_code
from ._lane import RUNNING, Status, new_lanes
from ._work import AUTO, EXPLICIT, IMPLICIT, OUT, RHS, Task, new_work

METHODS = {"auto": AUTO, "tsit5": EXPLICIT, "rodas5p": IMPLICIT}
ROUNDS = 2000  # steps between looks at Ctrl-C and the progress


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How a run is integrated.

    Attributes
    ----------
    rtol, atol : float
        Tolerances; the error of a step is weighed with atol + rtol |x|.
    max_steps : int
        Attempted steps after which a run ends as STEP_LIMIT.
    method : {"auto", "tsit5", "rodas5p"}
        Explicit pair of orders 5(4), stiff method of orders 5(4), or whichever is faster.
    step : float
        Fixed step (s) instead of error control; 0 for error control.
    """

    rtol: float = 1e-8
    atol: float = 1e-10
    max_steps: int = 10_000_000
    method: str = "auto"
    step: float = 0.0

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise unknown("method", str(self.method), METHODS, "of a compiled diagram")
        for name in ("rtol", "atol"):
            if not 0 < getattr(self, name) < np.inf:
                raise ParameterError(f"{name} must be > 0, got {getattr(self, name)!r}")
        if not 0 <= self.step < np.inf:
            raise ParameterError(f"step must be > 0, or 0 for error control, got {self.step!r}")
        if self.max_steps < 1:
            raise ParameterError(f"max_steps must be >= 1, got {self.max_steps!r}")


@dataclass(frozen=True, kw_only=True)
class Statistics:
    """What a run took.

    Attributes
    ----------
    status : Status
    time : float
        Time that was reached (s).
    accepted, rejected : int
        Steps of the integrator; steps tried to locate events count as rejected.
    events : int
        Corners and turning memories at which a step was ended.
    stiff : bool
        Whether the run ended with the stiff method.
    """

    status: Status
    time: float
    accepted: int
    rejected: int
    events: int = 0
    stiff: bool = False


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """One run: times that were reached, outputs (outputs, m), states (states, m)."""

    time: np.ndarray
    outputs: np.ndarray
    states: np.ndarray
    statistics: Statistics


def trajectory(
    compiled: Compiled,
    times: np.ndarray,
    inputs: np.ndarray,
    x0: np.ndarray,
    p: np.ndarray,
    settings: Settings,
    progress: Callable[[float], object] | None = None,
) -> Trajectory:
    """Integrate one member.  Ctrl-C ends the run with the status STOPPED."""
    rhs, out = lane_functions(compiled)
    code = machine_code()
    lanes, task, work, states = _prepared(compiled, times, inputs, x0[:, None], p[:, None], settings)
    with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the status says
        code["start"](rhs, task, lanes, work)
        states[0] = work.x
        try:
            while lanes["status"][0] == RUNNING:
                code["advance"](rhs, task, lanes, work, states, ROUNDS)
                if progress is not None:
                    progress(float(lanes["t"][0]))
        except KeyboardInterrupt:
            lanes["status"] = Status.STOPPED
        y = np.full((times.size, compiled.system.noutputs or 0, 1), np.nan)
        code["outputs"](rhs, out, task, work, states, y)
    return _made(times, lanes[0], states[:, :, 0], y[:, :, 0])


def _prepared(
    compiled: Compiled,
    times: np.ndarray,
    inputs: np.ndarray,
    x0: np.ndarray,
    p: np.ndarray,
    settings: Settings,
) -> tuple[np.ndarray, Any, Any, np.ndarray]:
    """Return lanes, task, work arrays and samples for members side by side."""
    program, (n, count) = compiled.program, x0.shape
    task = Task(
        times=times,
        inputs=inputs,
        p=np.ascontiguousarray(p),
        corners=program.corners,
        memory=np.array(program.memory, dtype=np.int64),
        rtol=float(settings.rtol),
        atol=float(settings.atol),
        fixed=float(settings.step),
        max_steps=int(settings.max_steps),
        method=METHODS[settings.method],
        alone=int(count == 1),
    )
    lanes, work = new_lanes(times, count), new_work(n, inputs.shape[0], program.events, count)
    lanes["stiff"] = settings.method == "rodas5p"
    work.x[:] = x0
    states = np.full((times.size, n, count), np.nan)
    return lanes, task, work, states


def _made(times: np.ndarray, lane: Any, states: np.ndarray, outputs: np.ndarray) -> Trajectory:
    status, reached = Status(int(lane["status"])), float(lane["t"])
    done = times.size if status is Status.OK else int(np.searchsorted(times, reached, "right"))
    if status is Status.OK and not np.all(np.isfinite(outputs)):
        status = Status.DIVERGED
    run = Statistics(
        status=status,
        time=reached,
        accepted=int(lane["accepted"]),
        rejected=int(lane["rejected"]),
        events=int(lane["events"]),
        stiff=bool(lane["stiff"]),
    )
    return Trajectory(
        time=times[:done], outputs=outputs[:done].T, states=states[:done].T, statistics=run
    )


def lane_functions(compiled: Compiled) -> tuple[Any, Any]:
    """Return ``(rhs, out)`` of a program for one lane."""
    known = compiled.__dict__.get("_lane_functions")
    if known is None:
        one_rhs, one_out = compiled.native

        def rhs(t, x, u, p, dx, g):
            one_rhs(
                t[0], x.reshape(-1), u.reshape(-1), p.reshape(-1), dx.reshape(-1), g.reshape(-1)
            )

        def out(t, x, u, p, y):
            one_out(t[0], x.reshape(-1), u.reshape(-1), p.reshape(-1), y.reshape(-1))

        known = (
            numba.njit(RHS.signature, error_model="numpy", nogil=True)(rhs),
            numba.njit(OUT.signature, error_model="numpy", nogil=True)(out),
        )
        compiled.__dict__["_lane_functions"] = known
    return known
