"""Many runs of one compiled diagram, side by side in threads."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from .._diagram import state_names
from .._errors import ParameterError
from .._names import find_name, unknown
from .._param import checked_times
from ._compile import Compiled
from ._lane import Status
from ._response import input_array, state_array
from ._simulate import Settings, Trajectory, trajectory

if TYPE_CHECKING:
    import pandas as pd


class MetricLike(Protocol):
    """What an ensemble asks of a metric; see `analysis.metrics.Metric`."""

    key: str
    signal: str
    start: float
    end: float

    @property
    def function(self) -> Callable[[np.ndarray, np.ndarray], float]: ...


@dataclass(frozen=True, kw_only=True)
class Ensemble:
    """Runs of one diagram.

    Attributes
    ----------
    table : pandas.DataFrame
        One row per finished member, by its number: what was varied, ``status`` (text), ``time``
        reached (s), ``steps``, and the metrics; those of a run that did not end well are NaN.
    time : ndarray of shape (m,)
    signals : dict of ndarray of shape (members, m)
        The signals that were kept, NaN after the end of a run.
    """

    table: pd.DataFrame
    time: np.ndarray
    signals: Mapping[str, np.ndarray]


def ensemble_response(
    compiled: Compiled,
    timepts: Any,
    inputs: Any = 0.0,
    initial_state: Mapping[str, Any] | None = None,
    *,
    params: Mapping[str, Any] | None = None,
    metrics: Sequence[MetricLike] = (),
    keep: Sequence[str] = (),
    threads: int | None = None,
    rtol: float = 1e-6,
    atol: float = 1e-8,
    max_steps: int = 1_000_000,
    progress: Callable[[int], object] | None = None,
) -> Ensemble:
    """Simulate many members that differ in parameters and initial states.

    Members are independent of each other: the result is the same, bit for bit, for any number of
    threads and in any order.  Metrics are taken as each member ends, and only the signals in
    `keep` are stored.

    Parameters
    ----------
    compiled : Compiled
    timepts : array_like of shape (m,)
        Times in s at which signals are sampled.
    inputs : array_like or float, optional
        Inputs, the same for all members.
    initial_state, params : mapping, optional
        ``{"plant.p1": array of shape (members,)}``; a number holds for all members.
    metrics : sequence, optional
        Numbers to take of each member, such as `analysis.metrics.Metric`.
    keep : sequence of str, optional
        Outputs whose samples are kept.
    threads : int, optional
        Number of threads; by default one per core.
    rtol, atol : float, optional
    max_steps : int, optional
        A member that needs more steps ends with the status STEP_LIMIT.
    progress : callable, optional
        Called with the number of finished members.

    Returns
    -------
    Ensemble
        After Ctrl-C with the members that were finished.

    Raises
    ------
    ParameterError
        If `timepts` is no increasing grid, arrays have different lengths, or a value is refused;
        the message then names the member.
    UnknownNameError
        If a parameter, state or signal does not exist.
    """
    times = checked_times(timepts)
    members = _Members(compiled, params or {}, initial_state or {})
    labels = compiled.system.output_labels
    for signal in (*keep, *(m.signal for m in metrics)):
        if signal not in labels:
            raise unknown("signal", signal, labels)
    u = input_array(inputs, compiled.system.ninputs or 0, times)
    settings = Settings(rtol=rtol, atol=atol, max_steps=max_steps)
    kept = {signal: np.full((len(members), times.size), np.nan) for signal in keep}
    prepared = list(members)  # python-control resolves names in one thread only
    compiled.native  # noqa: B018 (compiled once, before the threads start)

    def one(number: int) -> dict[str, Any]:
        x0, p = prepared[number]
        made = trajectory(compiled, times, u, x0, p, settings)
        for signal, samples in kept.items():
            samples[number, : made.time.size] = made.outputs[labels.index(signal)]
        return _row(made, labels, metrics)

    rows = _run(one, len(members), threads or cores(), progress)
    return Ensemble(table=members.table(rows), time=times, signals=kept)


def _row(made: Trajectory, labels: Sequence[str], metrics: Sequence[MetricLike]) -> dict[str, Any]:
    run = made.statistics
    row: dict[str, Any] = {
        "status": run.status.name,
        "time": run.time,
        "steps": run.accepted + run.rejected,
    }
    for metric in metrics:
        value = np.nan
        if run.status is Status.OK:
            inside = (made.time >= metric.start) & (made.time <= metric.end)
            y = made.outputs[labels.index(metric.signal)]
            value = metric.function(made.time[inside], y[inside])
        row[metric.key] = value
    return row


def _run(
    one: Callable[[int], dict[str, Any]],
    count: int,
    threads: int,
    progress: Callable[[int], object] | None,
) -> dict[int, dict[str, Any]]:
    """Run all members; after Ctrl-C return those that are finished."""
    rows: dict[int, dict[str, Any]] = {}
    pool = ThreadPoolExecutor(threads)
    futures = {pool.submit(one, number): number for number in range(count)}
    try:
        for future in as_completed(futures):
            rows[futures[future]] = future.result()
            if progress is not None:
                progress(len(rows))
    except KeyboardInterrupt:
        pass
    finally:
        pool.shutdown(cancel_futures=True)
    return rows


def cores() -> int:
    """Return the number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Members:
    """The members of an ensemble: arrays by name in, a state and a parameter vector each out."""

    def __init__(
        self, compiled: Compiled, params: Mapping[str, Any], states: Mapping[str, Any]
    ) -> None:
        index = dict.fromkeys(state_names(compiled.system))
        self.compiled = compiled
        self.params = {name: np.asarray(value) for name, value in params.items()}
        self.states = {
            find_name("state", name, index): np.asarray(value) for name, value in states.items()
        }
        columns = {**self.params, **{f"{k}(0)": v for k, v in self.states.items()}}
        sizes = {name: array.shape[0] for name, array in columns.items() if array.ndim}
        if len(set(sizes.values())) > 1:
            raise ParameterError(f"an ensemble needs arrays of one length, got {sizes}")
        self.size = next(iter(sizes.values()), 1)
        self.columns = {name: np.broadcast_to(a, self.size) for name, a in columns.items()}

    def __len__(self) -> int:
        return self.size

    def __iter__(self) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        for number in range(self.size):
            params = {k: self.columns[k][number] for k in self.params}
            states = {k: self.columns[f"{k}(0)"][number] for k in self.states}
            try:
                p = self.compiled.parameter_vector(params)
                yield state_array(self.compiled.system, states), p
            except ParameterError as error:
                raise ParameterError(f"{error} (member {number})") from None

    def table(self, rows: Mapping[int, Mapping[str, Any]]) -> pd.DataFrame:
        import pandas as pd

        order = sorted(rows)
        varied = {name: values[order] for name, values in self.columns.items()}
        results = pd.DataFrame([rows[i] for i in order], index=order)
        table = pd.concat([pd.DataFrame(varied, index=order), results], axis=1)
        return table.rename_axis("member")
