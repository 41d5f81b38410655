"""What became of a run: statistics, and the times that were reached."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from ..attributes import described_record
from ..delays.variation import arrivals, variations_in
from ..responses.breaks import jump_times
from ..responses.event_log import NO_EVENTS, EventLog
from ..wording import counted
from .chattering.steps import Jump
from .integrate.state import Status


@described_record
class Statistics:
    """What a run took."""

    status: Status  # How it has ended.
    time: float  # Time that was reached (s).
    # Steps of the integrator; steps tried to locate events count as rejected.
    accepted: int
    rejected: int
    # What has happened: as many as there are rows in the ``events`` of a single run's response.
    # Guards that have fallen, switching functions and conditions of the equations that have
    # changed their signs, and conditions of t alone.
    events: int = 0
    stiff: bool = False  # Whether the run ended with the stiff method.
    jump: Jump | None = None  # Where it chatters, of a run that ended as CHATTERING.
    conditions: int = 0  # Conditions of the equations that were located, guards included.
    opaque: bool = False  # Whether a function was called unchanged: its conditions are not known.
    # Steps that were ended where a memory turns or jumps, and nothing else happens: no events.
    turns: int = 0
    # Functions that were called, not written out, since a loop in them took too many passes.
    called: tuple[str, ...] = ()
    # Conditions of the equations along which it has slid, as Filippov's solutions do: it has come
    # back to them from both sides, and was run again with an ideal relay for each.
    slides: tuple[str, ...] = ()
    # When it has left one of these where both sides begin to lead away (s): there are several
    # solutions from there on, of which a run takes one.
    forks: tuple[float, ...] = ()
    rtol: float = np.nan  # Tolerances of steps; none in discrete time.
    atol: float = np.nan

    @property
    def along(self) -> str:
        """Along what it has slid, in words."""
        counts = Counter(self.slides).items()
        return ", ".join(f"{n} x {name}" if n > 1 else name for name, n in counts)

    @property
    def ways(self) -> str:
        """Where it takes one of several solutions, in words."""
        also = f", {counted(len(self.forks), 'time')} in all," if len(self.forks) > 1 else ""
        first = f"at {min(self.forks):g} s{also} both sides lead away"
        return f"{first}: there are several solutions, this is one"


@dataclass(frozen=True, kw_only=True)
class Trajectory:
    """One run: times that were reached, outputs (outputs, m), states (states, m), inputs."""

    time: np.ndarray
    outputs: np.ndarray
    states: np.ndarray
    statistics: Statistics
    inputs: np.ndarray  # what leaves transport delays, and rates: as the program has them
    happened: EventLog = NO_EVENTS  # of a single run
    # when clocks tick, what is delayed has jumped before the run, and delays bend (s)
    due: np.ndarray = field(default_factory=lambda: np.zeros(0))
    leaving: Sequence[Callable[[np.ndarray], np.ndarray]] = ()  # when leaves what comes at times
    culprit: int = -1  # the guard that has fallen last, or has ended it
    guard: float = 0.0  # and its value
    since: float = np.nan  # time of the first of the jumps that have ended it
    # functions, by their blocks' places and kinds, of which a loop may have ended it that takes
    # more passes than are written out, or that were called for that
    cut: frozenset[tuple[int, str]] = frozenset()

    @property
    def jump_times(self) -> np.ndarray:
        """When held and delayed signals may jump (s), besides at events."""
        begin = self.time[:1]  # there a history ends
        return jump_times(np.concatenate([self.due, begin, self.happened.time]), self.leaving)

    def cut_short(self, cut: frozenset[tuple[int, str]]) -> "Trajectory":
        """Return it with the functions of which a loop may have ended it, if one may."""
        ended = self.statistics.status in (Status.DIVERGED, Status.STEP_TOO_SMALL)
        return replace(self, cut=cut) if ended else self


def made(run: Any, outputs: np.ndarray, j: int) -> Trajectory:
    """Return what became of one member."""
    lane, times, outputs = run.lanes[j], run.task.times, outputs[:, :, j]
    status, reached = Status(int(lane["status"])), float(lane["t"])
    done = times.size if status is Status.OK else int(np.searchsorted(times, reached, "right"))
    if status is Status.OK and not np.all(np.isfinite(outputs)):
        status = Status.DIVERGED
    statistics = Statistics(
        status=status,
        time=reached,
        accepted=int(lane["accepted"]),
        rejected=int(lane["rejected"]),
        events=int(lane["noted"]),
        stiff=bool(lane["stiff"]),
        jump=run.jumps.get(j),
        conditions=int(
            run.task.rows.switching - run.task.rows.bending - np.sum(run.task.rows.partners < 0)
        ),
        opaque=bool(run.task.timed.opaque),
        turns=int(lane["turns"]),
        rtol=float(run.task.rtol),
        atol=float(run.task.atol),
    )
    states = run.work.samples[:done, :, j].T.copy()  # the next run may have the memory of this one
    if lane["resumes"]:  # a run that resumes there takes the sample
        states[:, times.size - 1 :] = run.work.resume[:, j : j + 1]
    return Trajectory(
        time=times[:done].copy(),
        outputs=outputs[:done].T.copy(),
        states=states,
        statistics=statistics,
        inputs=_every_input(run, j, done),
        due=_due(run, j, reached),
        leaving=_leaving(run.task.lines, j),
        culprit=int(lane["culprit"]),
        since=float(lane["since"]),
        guard=float(run.work.events.g[run.task.rows.guarded + lane["culprit"], j])
        if lane["culprit"] >= 0
        else 0.0,
    ).cut_short(run.machine.lowered.cut)


def _due(run: Any, j: int, reached: float) -> np.ndarray:
    """Return when something was known to be due in lane `j`, until a time."""
    ticks, kinks = run.task.clocks.ticks, run.task.lines.kinks
    due = np.concatenate([ticks[j] if ticks.size else ticks.ravel(), kinks.ravel(), run.early])
    return due[due <= reached]


def _leaving(lines: Any, j: int) -> Sequence[Callable[[np.ndarray], np.ndarray]]:
    """Return of each delay of lane `j` a function: when leaves what it is given at times."""
    every = zip(lines.delays[:, j], variations_in(lines), strict=True)
    return [partial(arrivals, delay=float(delay), varied=varied) for delay, varied in every]


def _every_input(run: Any, j: int, done: int) -> np.ndarray:
    """Return all that the program takes as inputs, at the times that lane `j` has reached."""
    given, times = run.task.inputs, run.task.times
    parts = [given[:, :done], run.work.past.shown[:done, :, j].T]
    if run.work.u.shape[0] > sum(map(len, parts)):  # the rates of the segment that begins
        rates = np.diff(given) / np.diff(times)
        parts.append(rates[:, np.minimum(np.arange(done), times.size - 2)])
    return np.concatenate(parts)


def at_its_end(run: Any, reached: Trajectory, u: np.ndarray) -> Trajectory:
    """Return a single run with the instant at which a function has ended it as its last time."""
    if reached.statistics.status is not Status.ENDED or run.lanes["t"][0] <= reached.time[-1]:
        return reached
    t, x = (np.ascontiguousarray(v) for v in (run.lanes["t"][:1], run.work.x))
    y = np.empty((run.work.y.shape[1], x.shape[1]))
    run.machine.out(t, x, u, run.task.p, y)
    return replace(
        reached,
        time=np.append(reached.time, t),
        outputs=np.column_stack([reached.outputs, y[: run.task.outputs]]),
        states=np.column_stack([reached.states, x]),
        inputs=np.column_stack([reached.inputs, u]),
    )
