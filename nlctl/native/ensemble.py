"""Many runs of one compiled diagram: batched in SIMD lanes, batches in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from threading import Event
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ..annotations import as_annotated
from ..arguments import ATOL, RTOL, one_of
from ..arguments import number as checked_number
from ..errors import ParameterError
from ..names import unknown
from ..params import checked_times, integer
from ..responses.arguments import (
    HOLDS,
    checked_params,
    held,
    input_array,
    interpolated,
    with_aliases,
)
from ..responses.breaks import sampled_between, takes_breaks, unsampled, with_jumps
from .ahead import compile_for
from .audit import Audit, Trial
from .audit import audit as compare
from .chattering.detection import new_paces
from .compiled import Compiled
from .compiled import compile as compile_diagram
from .driver import (
    Course,
    begin,
    finish,
    followed_up,
    prepared,
    trajectory,
    with_events,
)
from .ensemble_result import Ensemble, MetricLike, SignalsByName
from .floats import as_given
from .integrate.methods.tableau import Tableau
from .integrate.state import RUNNING, STIFF, Status
from .machine.evaluations import ENSEMBLE_WIDTH, fitting
from .members import Members, members
from .results import Trajectory, made
from .run import Run
from .settings import settings_of
from .windows import given_up, watched

if TYPE_CHECKING:
    import pandas as pd


@as_annotated
def ensemble_response(
    compiled: Compiled | ct.InputOutputSystem,
    timepts: ArrayLike | None = None,
    inputs: object = 0.0,
    initial_state: object = None,
    *,
    params: Mapping[str, Any] | None = None,
    metrics: Sequence[MetricLike] = (),
    keep: Sequence[str] = (),
    threads: int | None = None,
    rtol: float = RTOL,
    atol: float = ATOL,
    max_steps: int = 1_000_000,
    max_step: float | None = None,
    slide: bool = True,
    method: str | Tableau | None = None,
    hold: str = "foh",
    progress: Callable[[int], object] | None = None,
    audit: Audit = True,
    **aliases: object,
) -> Ensemble:
    """Simulate many members that differ in parameters and initial states.

    Members are independent of each other: the result is the same, bit for bit, for any number of
    threads, in any order and in any company.  (A single run by `input_output_response` sums in
    another order and agrees to rounding.)  Metrics are taken as each member ends, and only the
    signals in `keep` are stored.  After Ctrl-C the members that are finished are returned.

    A metric's function that takes ``breaks`` gets the times of the member's events.  A member with
    no sample between two of its events is run once more, with samples there, so that its metrics
    see a pulse between two of `timepts`.

    A diagram in discrete time goes from sample to sample; `rtol`, `atol`, `max_steps`, `max_step`
    and `method` then mean nothing.

    Parameters
    ----------
    compiled : Compiled or control.InputOutputSystem
        A diagram that is not compiled yet is compiled first.
    timepts : array_like of shape (m,), optional
        Times in s at which signals are sampled; they are needed, under this name or as ``T``.
    inputs : array_like, list or float, optional
        Inputs, the same for all members, as in `nlctl.input_output_response`.  Also ``U``.
    initial_state : mapping or array_like, optional
        ``{"plant.x1": array of shape (members,)}``; a number holds for all members.  An array of
        shape (n,) or a number is the state of all of them, as in `nlctl.input_output_response`,
        one of shape (members, n) has a row for each.  Also ``X0``.
    params : mapping, optional
        ``{"plant.p1": array of shape (members,)}``; a number holds for all members.
    metrics : sequence, optional
        Numbers to take of each member, such as `nlctl.analysis.metrics.Metric`.  A function that
        was compiled with ``numba.njit(nogil=True)`` keeps no thread waiting.
    keep : sequence of str, optional
        Outputs whose samples are kept.
    threads : int, optional
        Number of threads; by default one per core.
    rtol, atol : float, optional
        Tolerances of the integrator: relative (1), and absolute in the states' units.
    max_steps : int, optional
        A member that needs more steps ends with the status STEP_LIMIT, one that switches over and
        over again at a jump along which it cannot slide with CHATTERING.
    max_step : float, optional
        Longest step of the integrator (s), the same for all members.
    slide : bool, optional
        As in `nlctl.input_output_response`: whether members go along conditions.
    method : str or Tableau, optional
        As in `nlctl.input_output_response`.
    hold : {"foh", "zoh"}, optional
        As in `nlctl.input_output_response`: what inputs are between `timepts`.
    progress : callable, optional
        Called with the number of finished members.
    audit : bool or "every run", optional
        As in `nlctl.input_output_response`, for some of the members.
    **aliases : object
        python-control's short names: ``T``, ``U``, ``X0``.

    Returns
    -------
    Ensemble
        After Ctrl-C with the members that were finished.

    Raises
    ------
    AuditError
        If machine code and python-control differ.
    ParameterError
        If `timepts` is not an increasing grid or does not fit a discrete-time diagram, arrays have
        different lengths, or a value is refused; the message then names the member.  Inputs and
        initial states must be finite.
    UnknownNameError
        If a parameter, state, signal or argument of that name does not exist.

    Examples
    --------
    A sine of amplitude 1 behind gains of 1, 2 and 3, at its peak:

    >>> times = np.linspace(0, np.pi, 5)
    >>> gain = nlctl.block(nlctl.Gain(), "actuator")
    >>> many = nlctl.ensemble_response(
    ...     gain, times, np.sin(times), params={"actuator.k": np.array([1.0, 2.0, 3.0])}, keep=["v"]
    ... )
    >>> print(many.signals["v"][:, 2], many.table["status"].tolist())
    [1. 2. 3.] ['OK', 'OK', 'OK']
    """
    given = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    given = with_aliases(given, aliases, ensemble_response)
    times = checked_times(given["timepts"])
    if not isinstance(compiled, Compiled):
        compiled = compile_diagram(compiled)
    if threads is not None:
        threads = integer("ensemble_response", "threads", threads, at_least=1)
    one_of("ensemble_response", "hold", hold, HOLDS)
    params = checked_params(params) or {}
    compiled = as_given(compiled, params)
    every = members(compiled, params, given["initial_state"])
    metrics = tuple(metrics)
    _check_signals(compiled, keep, metrics)
    if max_step is not None:
        checked_number("ensemble_response", "max_step", max_step, above=0)
    settings = settings_of(
        method, rtol=rtol, atol=atol, max_steps=max_steps, max_step=max_step, slide=slide
    )
    grid, u = times, input_array(compiled.system, given["inputs"], times)
    if hold == "zoh" and ct.isctime(compiled.system) and u.size:
        grid, u = held(times, u)
    course = Course(compiled=compiled, times=grid, inputs=u, settings=settings)
    asked = _Asked(times=times, course=course, metrics=metrics)
    kept = {signal: np.full((every.size, times.size), np.nan) for signal in keep}
    rows = _run(_runner(every, asked, kept, audit), every.size, threads or cores(), progress)
    return Ensemble(table=_table(every, rows), time=times, signals=SignalsByName(kept))


def _check_signals(compiled: Compiled, keep: Sequence[str], metrics: Sequence[MetricLike]) -> None:
    """Refuse what is not a metric, and signals that are not outputs."""
    for metric in metrics:
        if not (hasattr(metric, "signals") and hasattr(metric, "function")):
            raise ParameterError(
                "ensemble_response needs metrics such as nlctl.analysis.metrics.Metric, "
                f"got {metric!r}"
            )
    labels = compiled.system.output_labels
    for signal in (*keep, *(s for m in metrics for s in m.signals)):
        if signal not in labels:
            raise unknown("signal", signal, labels)


@dataclass(frozen=True, kw_only=True)
class _Asked:
    """What each member is asked: times of its samples among those of the run, and metrics."""

    times: np.ndarray
    course: Course
    metrics: Sequence[MetricLike]

    @cached_property
    def with_breaks(self) -> list[bool]:
        """Of each metric whether its function takes breaks."""
        return [takes_breaks(metric.function) for metric in self.metrics]


def _runner(
    every: Members, asked: _Asked, kept: Mapping[str, np.ndarray], audit: Audit
) -> Callable[[range, Event], dict[int, dict[str, Any]]]:
    """Return what runs a group of members, keeps their signals and returns their rows."""
    compiled = every.compiled
    labels = compiled.system.output_labels
    _ = asked.course.varied  # once for all members
    _, p = every.batch(range(1), ENSEMBLE_WIDTH)  # checks all members before anything runs
    compile_for(compiled, p, ENSEMBLE_WIDTH)  # once, before the threads start
    audited = {0, every.size // 2, every.size - 1} if audit else ()

    def one(numbers: range, stop: Event) -> dict[int, dict[str, Any]]:
        rows = {}
        runs = _group(every, numbers, asked.course, stop)
        for number, run in zip(numbers, runs, strict=False):
            if number in audited:
                _audit(every, number, run, audit)
            run, shown = _seen(every, number, run, asked)
            run = _sampled_at(run, shown)
            at_samples = _sampled_at(run, asked.times)
            for signal, samples in kept.items():
                samples[number, : at_samples.time.size] = at_samples.outputs[labels.index(signal)]
            rows[number] = _row(run, labels, asked)
        return rows

    return one


def _audit(every: Members, number: int, run: Trajectory, wanted: Audit) -> None:
    """Compare one member with python-control."""
    _, p = every.batch(range(number, number + 1), 1)
    trial = Trial(
        time=run.time, states=run.states, inputs=run.inputs, p=p[:, 0], params=every.given(number),
        width=ENSEMBLE_WIDTH,
    )  # fmt: skip
    compare(every.compiled.calling(run.cut), trial, wanted)


def _seen(
    every: Members, number: int, run: Trajectory, asked: _Asked
) -> tuple[Trajectory, np.ndarray]:
    """Return a member with samples between all events, if metrics look, and the times of these."""
    breaks, course, done = run.happened.time, asked.course, run.statistics.status is Status.OK
    if not (asked.metrics and done and unsampled(asked.times, breaks).size):
        return run, asked.times
    shown = sampled_between(asked.times, breaks)
    grid = np.union1d(course.times, shown)
    inputs = interpolated(course.inputs, course.times, grid)
    x0, p = every.batch(range(number, number + 1), 1)
    again = trajectory(replace(course, times=grid, inputs=inputs), x0[:, 0], p[:, 0])
    if again.statistics.status is Status.OK:  # in another number of steps, by itself
        again = replace(again, statistics=run.statistics)
    return again, shown


def _sampled_at(run: Trajectory, times: np.ndarray) -> Trajectory:
    """Return a run at some of its times only."""
    if np.array_equal(run.time, times):
        return run
    shown = np.isin(run.time, times)
    return replace(
        run, time=run.time[shown], outputs=run.outputs[:, shown], states=run.states[:, shown],
        inputs=run.inputs[:, shown],
    )  # fmt: skip


def _group(every: Members, numbers: range, course: Course, stop: Event) -> Iterator[Trajectory]:
    """Run up to WIDTH members in a batch; yield them in their order."""
    compiled, (x0, p) = every.compiled, every.batch(numbers, ENSEMBLE_WIDTH)
    alone = course.settings.method == "rodas5p" or not ct.isctime(compiled.system)
    if alone:
        for j in range(len(numbers)):
            if stop.is_set():
                return
            yield trajectory(course, x0[:, j], p[:, j])
        return
    found: dict[int, tuple[Run, np.ndarray]] = {}
    while not stop.is_set() and (left := [j for j in range(len(numbers)) if j not in found]):
        first = left[0]  # members whose integers steer the equations otherwise run apart
        fits = np.roll(fitting(compiled, np.roll(p, -first, axis=1), ENSEMBLE_WIDTH), first)
        # others' places are taken by copies: what runs beside a member changes nothing
        columns = np.where(fits, np.arange(ENSEMBLE_WIDTH), first)
        ran = _ran(course, x0[:, columns], p[:, columns], stop)
        found |= {int(j): ran for j in np.flatnonzero(fits)}
    for j in range(len(numbers) if not stop.is_set() else 0):
        run, outputs = found[j]
        if run.lanes["status"][j] == STIFF:  # the stiff method is for single runs
            yield trajectory(course, x0[:, j], p[:, j])
        else:
            member = with_events(compiled, run, made(run, outputs, j), j)
            yield followed_up(course, member, x0[:, j], p[:, j])


def _ran(course: Course, x0: np.ndarray, p: np.ndarray, stop: Event) -> tuple[Run, np.ndarray]:
    """Run as many members as there are lanes; return the run and its outputs."""
    with np.errstate(all="ignore"):  # without JIT, NumPy would warn of what the status says
        run = prepared(course, x0, p)
        begin(run)
        paces = new_paces(run.lanes)
        while not stop.is_set() and np.any(run.lanes["status"] == RUNNING):
            run = watched(run, paces)
            given_up(run, paces)
        return run, finish(run)


def _row(run: Trajectory, labels: Sequence[str], asked: _Asked) -> dict[str, Any]:
    done, metrics = run.statistics, asked.metrics
    row: dict[str, Any] = {
        "status": done.status.name,
        "time": done.time,
        "steps": done.accepted + done.rejected,
    }
    if done.status is not Status.OK:
        return row | {metric.key: np.nan for metric in metrics}
    signals = {signal for metric in metrics for signal in metric.signals}
    samples = {signal: run.outputs[labels.index(signal)].copy() for signal in signals}
    breaks = with_jumps(np.unique(run.happened.time), run.jump_times, run.time)
    for metric, takes in zip(metrics, asked.with_breaks, strict=True):
        first = np.searchsorted(run.time, metric.start, "left")
        inside = slice(first, np.searchsorted(run.time, metric.end, "right"))
        given = (samples[signal][inside] for signal in metric.signals)
        known = {"breaks": breaks} if takes else {}
        row[metric.key] = metric.function(run.time[inside], *given, **known)
    return row


def _run(
    one: Callable[[range, Event], dict[int, dict[str, Any]]],
    count: int,
    threads: int,
    progress: Callable[[int], object] | None,
) -> dict[int, dict[str, Any]]:
    """Run all members in groups; after Ctrl-C return those that are finished."""
    rows: dict[int, dict[str, Any]] = {}
    stop = Event()  # set when the members that are running are no longer wanted
    groups = iter(range(i, min(i + ENSEMBLE_WIDTH, count)) for i in range(0, count, ENSEMBLE_WIDTH))
    pool = ThreadPoolExecutor(threads)
    waiting = {pool.submit(one, group, stop) for group in islice(groups, 2 * threads)}
    try:
        while waiting:
            ready, waiting = wait(waiting, return_when=FIRST_COMPLETED)
            for future in ready:
                rows |= future.result()
                waiting |= {pool.submit(one, group, stop) for group in islice(groups, 1)}
            if progress is not None:
                progress(len(rows))
    except KeyboardInterrupt:
        stop.set()
    finally:
        pool.shutdown(cancel_futures=True)
    return rows


def _table(every: Members, rows: Mapping[int, Mapping[str, Any]]) -> pd.DataFrame:
    import pandas as pd

    order = sorted(rows)
    results = pd.DataFrame([rows[i] for i in order], index=order)
    return pd.concat([every.table(order), results], axis=1).rename_axis("member")


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
