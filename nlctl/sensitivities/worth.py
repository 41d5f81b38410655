"""What values of gains are worth: margins and a cost of runs with them, and their derivatives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import AlgebraicLoopError, CompileError, DivergedError, ParameterError
from ..native import Compiled, ensemble_response
from ..native.ensemble import MetricLike
from ..responses.arguments import input_array, interpolated
from .gradients import metric_gradient
from .names import parameters_and_states
from .response import sensitivity_response

LOST_MARGIN = -1e3  # the margin of a run that does not reach its end
# of a run: what one with derivatives costs more for each, as `benchmarks/sensitivities.py`
PER_DERIVATIVE = 0.7
_STEP = 1e-3  # of differences, in the unit cube
_NEAREST = 6  # parts of a requirement that count: the lowest


@dataclass(frozen=True, kw_only=True, eq=False)
class TuningProblem:
    """Which runs are made, and what is asked of them."""

    diagram: Compiled
    # as `nlctl.ensemble_response` takes them
    times: np.ndarray
    inputs: Any
    params: Mapping[str, Any]
    initial_state: Mapping[str, Any]
    samples: tuple[Mapping[str, float], ...]  # what else is set in each run
    names: tuple[str, ...]  # what is tuned
    # (k,)
    low: np.ndarray
    high: np.ndarray
    margins: tuple[MetricLike, ...]  # larger is better, > 0 holds
    cost: MetricLike | None  # smaller is better
    how: Mapping[str, Any]  # tolerances, steps and hold of the runs

    @property
    def metrics(self) -> tuple[MetricLike, ...]:
        """Margins, then the cost."""
        return self.margins if self.cost is None else (*self.margins, self.cost)

    @cached_property
    def rows(self) -> tuple[tuple[tuple[MetricLike, ...], ...], ...]:
        """What each margin is the least of, with fewer kinks, such as `Requirement.parts`."""
        return tuple(getattr(m, "parts", None) or ((m,),) for m in self.margins)

    @cached_property
    def parts(self) -> tuple[tuple[MetricLike, ...], ...]:
        """The same without rows."""
        return tuple(tuple(p for row in rows for p in row) for rows in self.rows)

    def with_samples(self, many: int) -> "TuningProblem":
        """Return the same runs with so many times as many samples."""
        times = self.times
        parts = np.arange(many * (times.size - 1) + 1) / many
        finer = np.interp(parts, np.arange(times.size), times)
        u = input_array(self.diagram.system, self.inputs, times)
        held = self.how["hold"] == "zoh"
        u = u[:, parts.astype(int)] if held else interpolated(u, times, finer)
        return replace(self, times=finer, inputs=u if u.size else 0.0)

    @property
    def _as_powers(self) -> np.ndarray:
        return (self.low > 0) & (self.high >= 10 * self.low)

    def values(self, cube: np.ndarray) -> np.ndarray:
        """Return gains at points of the unit cube: their logarithms where bounds lie far apart."""
        low, high = self._ends
        inside = low + np.clip(cube, 0.0, 1.0) * (high - low)
        powers = np.exp(np.where(self._as_powers, inside, 0.0))
        gains = np.clip(np.where(self._as_powers, powers, inside), self.low, self.high)
        return np.select([cube <= 0.0, cube >= 1.0], [self.low, self.high], gains)

    def cube(self, values: np.ndarray) -> np.ndarray:
        """Return the point of the unit cube of some gains."""
        low, high = self._ends
        logs = np.log(np.where(self._as_powers, values, 1.0))
        return (np.where(self._as_powers, logs, values) - low) / (high - low)

    def rates(self, values: np.ndarray) -> np.ndarray:
        """Return the derivatives of gains by coordinates of the cube."""
        low, high = self._ends
        return (high - low) * np.where(self._as_powers, values, 1.0)

    @property
    def _ends(self) -> np.ndarray:
        ends = np.stack([self.low, self.high])
        return np.where(self._as_powers, np.log(np.where(self._as_powers, ends, 1.0)), ends)


@dataclass(frozen=True, kw_only=True, eq=False)
class Worth:
    """What one choice of gains is worth."""

    table: np.ndarray  # (samples, metrics): Margins, then the cost
    count: int  # number of margins
    # (n,): what margins are the least of, in all samples; empty if there are no derivatives
    parts: np.ndarray = field(default_factory=lambda: np.empty(0))
    # (n, k): their derivatives by coordinates of the unit cube
    slopes: np.ndarray = field(default_factory=lambda: np.empty((0, 0)))
    # (k,): those of the mean cost
    cost_slopes: np.ndarray = field(default_factory=lambda: np.empty(0))

    @property
    def margins(self) -> np.ndarray:
        """All margins in a row."""
        return self.table[:, : self.count].reshape(-1)

    @property
    def least(self) -> float:
        """The least margin."""
        return float(self.margins.min(initial=np.inf))

    @property
    def cost(self) -> float:
        """The mean cost, NaN without one or if a run does not reach its end."""
        return float(self.table[:, self.count :].mean()) if self.has_cost else np.nan

    @property
    def has_cost(self) -> bool:
        """Whether there is a cost."""
        return self.table.shape[1] > self.count

    @property
    def rank(self) -> tuple[float, float]:
        """Larger is better: a cost counts where all margins hold."""
        if not self.has_cost:
            return self.least, 0.0
        return min(self.least, 0.0), -np.nan_to_num(self.cost, nan=np.inf, posinf=np.inf)

    @property
    def goal(self) -> float:
        """The cost where there is one, else the least margin."""
        return self.cost if self.has_cost else self.least

    def is_as_good_as(self, other: "Worth", tolerance: float) -> bool:
        """Whether it is no worse than another one, but for a part of a margin or of a cost."""
        room = tolerance * np.array([1.0 + abs(other.least), abs(other.rank[1])])
        return bool(np.all(np.array(self.rank) >= np.array(other.rank) - np.nan_to_num(room)))


class Runs:
    """Makes runs, counts them, and keeps what each choice of gains was worth."""

    def __init__(self, problem: TuningProblem) -> None:
        self.problem = problem
        self.plain = self.differentiated = 0
        self.why = ""  # there are no derivatives at all
        self.lacking: dict[str, int] = {}  # why there were none, and how often
        self.kinked: dict[str, int] = {}
        self.at_first: dict[str, dict[str, None]] = {}  # of what, by what the start is at a kink
        self.moved = np.zeros(len(problem.names))  # the largest derivative of anything by each
        self.slope_of = np.zeros(len(problem.margins) + 1)  # the largest derivative of each
        self.history: list[tuple[str, float, np.ndarray, Worth]] = []

    @property
    def counted(self) -> float:
        """Number of runs; one with k derivatives counts as 1 + 0.7 k."""
        effort = 1.0 + PER_DERIVATIVE * len(self.problem.names)
        return self.plain + effort * self.differentiated

    def best(self) -> tuple[np.ndarray, Worth]:
        """Return the best gains so far, the first of equals, and what they are worth."""
        _, _, cube, worth = max(self.history, key=lambda row: row[3].rank)
        return cube, worth

    def at(self, points: np.ndarray, chosen_by: str = "") -> list[Worth]:
        """Return what gains at points of the unit cube are worth, without derivatives."""
        problem = self.problem
        worths = [self._worth(table) for table in self._tables(points, problem.metrics)]
        for cube, worth in zip(points, worths, strict=True) if chosen_by else ():
            self.history.append((chosen_by, self.counted, cube, worth))
        return worths

    def with_slopes(self, cube: np.ndarray, chosen_by: str) -> Worth:
        """Return what gains are worth, with derivatives or, where there are none, differences."""
        worth = None if self.why else self._by_derivatives(cube)
        if worth is None:
            worth = self._by_differences(cube)
        self._note(worth)
        self.history.append((chosen_by, self.counted, cube, worth))
        return worth

    def _note(self, worth: Worth) -> None:
        """Keep which gains have ever moved anything, and which numbers have ever been moved."""
        problem = self.problem
        whose = np.repeat(np.arange(len(problem.margins)), [len(parts) for parts in problem.parts])
        rows = np.vstack([np.abs(worth.slopes), np.abs(worth.cost_slopes)])
        self.moved = np.maximum(self.moved, rows.max(axis=0))
        most = np.append(np.tile(whose, len(problem.samples)), len(problem.margins))
        np.maximum.at(self.slope_of, most, rows.max(axis=1))

    def _tables(self, points: np.ndarray, metrics: Sequence[MetricLike]) -> np.ndarray:
        """Return numbers of plain runs, shape (points, samples, metrics)."""
        problem, size = self.problem, len(self.problem.samples)
        values = np.repeat(problem.values(points), size, axis=0)
        given = dict(zip(problem.names, values.T, strict=True))
        for name in problem.samples[0]:
            given[name] = np.tile([sample[name] for sample in problem.samples], len(points))
        params, start = parameters_and_states(given)
        try:
            numbers = self._ensemble(params, start, metrics)
        except ParameterError:  # one of these values, or several of a block together
            if not self.history:
                raise
            if len(points) > 1:
                return np.concatenate([self._tables(p[None, :], metrics) for p in points])
            return np.full((1, size, len(metrics)), np.nan)
        self.plain += len(values)
        return numbers.reshape(len(points), size, -1)

    def _ensemble(
        self, params: Mapping[str, Any], start: Mapping[str, Any], metrics: Sequence[MetricLike]
    ) -> np.ndarray:
        """Return numbers of plain runs, shape (runs, metrics)."""
        problem = self.problem
        count = len(next(iter((params or start).values())))
        table = ensemble_response(
            problem.diagram, problem.times, problem.inputs, {**problem.initial_state, **start},
            params={**problem.params, **params}, metrics=metrics, **problem.how,
        ).table  # fmt: skip
        if len(table) < count:
            raise KeyboardInterrupt
        return table[[m.key for m in metrics]].to_numpy(dtype=float)

    def _worth(self, table: np.ndarray, **more: Any) -> Worth:
        count = len(self.problem.margins)
        table = table.copy()
        table[:, :count] = _graded(table[:, :count])
        return Worth(table=table, count=count, **more)

    def _by_derivatives(self, cube: np.ndarray) -> Worth | None:
        """Return what gains are worth, with derivatives; None where there are none."""
        problem, values, numbers = self.problem, self.problem.values(cube), []
        signals = list(dict.fromkeys(s for m in problem.metrics for s in m.signals))
        for sample in problem.samples:
            given = dict(zip(problem.names, values, strict=True)) | dict(sample)
            params, start = parameters_and_states(given)
            try:
                run = sensitivity_response(
                    problem.diagram, problem.times, problem.inputs,
                    {**problem.initial_state, **start}, of=signals,
                    with_respect_to=list(problem.names), params={**problem.params, **params},
                    **problem.how,
                )  # fmt: skip
            except (CompileError, AlgebraicLoopError) as error:
                self.why = str(error)
                return None
            except DivergedError:
                run = None
            except ParameterError:  # no block takes these together: of the start that is an error
                if not self.history:
                    raise
                run = None
            self.differentiated += 1
            numbers.append(self._lost() if run is None else self._numbers(run))
            if not all(np.isfinite(slopes).all() for slopes in numbers[-1][2:]):
                return None
        rates = problem.rates(values)
        table, parts, slopes, cost_slopes = map(np.array, zip(*numbers, strict=True))
        return self._worth(
            table, parts=_graded(parts).reshape(-1), slopes=slopes.reshape(-1, rates.size) * rates,
            cost_slopes=cost_slopes.mean(axis=0) * rates,
        )  # fmt: skip

    def _lost(self) -> tuple[np.ndarray, ...]:
        """Return the numbers of a run that does not reach its end."""
        problem, k = self.problem, len(self.problem.names)
        parts = sum(map(len, problem.parts))
        table = np.full(len(problem.metrics), np.nan)
        return table, np.full(parts, np.nan), np.zeros((parts, k)), np.zeros(k)

    def _numbers(self, run: Any) -> tuple[np.ndarray, ...]:
        """Return margins and cost, parts of margins, and their derivatives by gains."""
        problem, k = self.problem, len(self.problem.names)
        for lack in run.missing:
            self.lacking[lack.why] = self.lacking.get(lack.why, 0) + 1
        values, slopes, table = [], [], []
        if not self.history:
            self._look_for_kinks(run)
        for metric, parts, rows in zip(problem.margins, problem.parts, problem.rows, strict=True):
            values_of_parts = np.array([_value(part, run) for part in parts])
            lowest = _lowest(values_of_parts, [len(row) for row in rows])
            counting = np.full(values_of_parts.size, -LOST_MARGIN)
            counting[lowest] = values_of_parts[lowest]
            values.append(counting)
            slopes.append(np.zeros((values_of_parts.size, k)))
            for i in lowest:
                slopes[-1][i] = self._gradient(metric.key, parts[i], run)
            table.append(_value(metric, run) if len(parts) > 1 else values_of_parts[0])
        cost_slopes = np.zeros(k)
        if problem.cost is not None:
            table.append(_value(problem.cost, run))
            cost_slopes = self._gradient(problem.cost.key, problem.cost, run)
        none = np.zeros((0, k))
        return (
            np.array(table), np.concatenate([np.empty(0), *values]),
            np.concatenate([none, *slopes]), cost_slopes,
        )  # fmt: skip

    def _gradient(self, key: str, metric: MetricLike, run: Any) -> np.ndarray:
        """Return the derivatives of a number of a run, at a kink those of the middle."""
        gradient = metric_gradient(metric, run)
        if gradient.one_sided:
            self.kinked[key] = self.kinked.get(key, 0) + 1
        return 0.5 * (gradient.above + gradient.below)

    def _look_for_kinks(self, run: Any) -> None:
        """Keep what the start is at a kink of, and by what."""
        for metric in self.problem.metrics:
            for name in metric_gradient(metric, run).one_sided:
                self.at_first.setdefault(metric.key, {})[name] = None

    def _by_differences(self, cube: np.ndarray) -> Worth:
        """Return what gains are worth, with differences of runs towards the middle of the box."""
        problem, count = self.problem, len(self.problem.margins)
        every = (part for parts in problem.parts for part in parts)
        parts = tuple(
            _Part(key=f"part {i}", start=part.start, end=part.end, signals=part.signals,
                  function=part.function)
            for i, part in enumerate(every)
        )  # fmt: skip
        steps = np.where(cube < 0.5, _STEP, -_STEP)
        points = np.vstack([cube, cube + np.diag(steps)])
        here, *moved = self._tables(points, (*problem.metrics, *parts))
        wide = len(problem.metrics)
        rates = [(table - here) / h for table, h in zip(moved, steps, strict=True)]
        slopes = np.nan_to_num(np.stack(rates, axis=2))
        return self._worth(
            here[:, :wide], parts=_graded(here[:, wide:]).reshape(-1),
            slopes=slopes[:, wide:].reshape(-1, cube.size),
            cost_slopes=slopes[:, count:wide].mean(axis=0).reshape(-1)
            if problem.cost is not None else np.zeros(cube.size),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class _Part:
    """A metric under another name."""

    key: str
    start: float
    end: float
    signals: Sequence[str]
    function: Any


def _graded(margins: np.ndarray) -> np.ndarray:
    return np.maximum(
        np.nan_to_num(margins, nan=LOST_MARGIN, posinf=-LOST_MARGIN, neginf=LOST_MARGIN),
        LOST_MARGIN,
    )


def _lowest(values: np.ndarray, lengths: Sequence[int]) -> np.ndarray:
    """Return the lowest parts that are not higher than the pieces of time next to them."""
    # Others are least where they end, at what the piece next to them has, too.
    lowest, first = [], 0
    for length in lengths:
        row = np.pad(values[first : first + length], 1, constant_values=np.inf)
        lowest.append(first + np.flatnonzero((row[1:-1] < row[:-2]) & (row[1:-1] <= row[2:])))
        first += length
    every = np.concatenate(lowest)
    return every[np.argsort(values[every], kind="stable")[:_NEAREST]]


def _value(metric: MetricLike, run: Any) -> float:
    """Return a number of a run with derivatives."""
    inside = (run.time >= metric.start) & (run.time <= metric.end)
    places = [run.signals.index(signal) for signal in metric.signals]
    return float(metric.function(run.time[inside], *run.values[places][:, inside].copy()))


def checked_samples(samples: Mapping[str, Any], names: Sequence[str]) -> tuple[dict, ...]:
    """Return samples as one record for each run; an empty one for the values as they are."""
    columns = {}
    for name, values in samples.items():
        if name in names:
            raise ParameterError(f"'{name}' is tuned: leave it out of samples")
        columns[name] = np.atleast_1d(np.asarray(values, dtype=float))
    sizes = {name: column.shape for name, column in columns.items()}
    if any(len(shape) != 1 for shape in sizes.values()) or len(set(sizes.values())) > 1:
        raise ParameterError(f"samples need arrays of one length, got shapes {sizes}")
    for name, column in columns.items():
        if not (column.size and np.isfinite(column).all()):
            raise ParameterError(f"samples need finite numbers, got {column} for '{name}'")
    size = next(iter(sizes.values()))[0] if sizes else 1
    return tuple({n: float(c[i]) for n, c in columns.items()} for i in range(size))
