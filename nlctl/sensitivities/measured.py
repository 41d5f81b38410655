"""Experiments that parameters are fitted to: what was measured, what a run was given, what fits."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from scipy.stats import t as students_t

from ..annotations import as_annotated
from ..arguments import number
from ..attributes import described_record
from ..diagrams import state_names
from ..errors import CompileError, DivergedError, ParameterError, UnknownNameError
from ..names import unknown
from ..params import as_numbers, checked_times
from ..responses.arguments import input_array, state_array
from ..wording import counted
from .record import SensitivityResponse

if TYPE_CHECKING:
    import pandas as pd

_TIME = "time"  # the column of a table that has times


@as_annotated
@described_record(eq=False)
class Measurement:
    """One of several experiments that `nlctl.fit` fits at once.

    What it does not say is as `nlctl.fit` is given it.

    Examples
    --------
    >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    >>> t = np.linspace(0, 2, 21)
    >>> steps = [
    ...     nlctl.Measurement(data={"v": h * (1 - np.exp(-t / 0.4))}, inputs=h) for h in (1, 2)
    ... ]
    >>> found = nlctl.fit(lag, t, steps, {"lag.T": 1.0})
    >>> print(round(found["lag.T"], 6), len(found.experiments))
    0.4 2
    """

    # ``{"y": samples of shape (m,)}`` or a table, as `nlctl.fit` takes them.
    data: Mapping[str, Any] | pd.DataFrame
    timepts: Any = None  # (m,): Times of the data in s; those of a table by default.
    inputs: Any = None  # Inputs over these times.
    initial_state: Any = None  # Of what is not sought.
    params: Mapping[str, Any] | None = None  # Overrides, next to those of all experiments.
    sigma: Mapping[str, float] | float | None = None  # Standard deviation of the noise, by signal.
    name: str = ""  # By which errors and results name it; "experiment 1" by default.


@described_record(eq=False)
class Observations:
    """An experiment, checked: rows over time, and what its run is given."""

    name: str
    times: np.ndarray  # (m,)
    rows: Mapping[str, np.ndarray]  # (m,) by signal, NaN in gaps
    deviations: np.ndarray  # (signals,): of the noise
    inputs: np.ndarray  # (inputs, m)
    initial_state: Mapping[str, float]
    params: Mapping[str, Any]
    alone: bool  # whether it is the only one

    @property
    def measured(self) -> np.ndarray:
        """All data, shape (signals, m)."""
        return np.stack(list(self.rows.values()))

    @property
    def count(self) -> int:
        """Number of data, gaps not counted."""
        return int(np.isfinite(self.measured).sum())

    def start(self, states: Mapping[str, float]) -> Mapping[str, float]:
        """Return the initial state, some of which is sought."""
        return {**self.initial_state, **states}

    @contextmanager
    def naming(self) -> Iterator[None]:
        """Let errors say which of several experiments they are about."""
        with _naming("" if self.alone else self.name):
            yield


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Let errors name an experiment, if it has a name."""
    try:
        yield
    except DivergedError as error:
        if name:
            raise DivergedError(f"{error} (in '{name}')", error.time) from None
        raise
    except (ParameterError, UnknownNameError, CompileError) as error:
        if name:
            raise type(error)(f"{error} (in '{name}')") from None
        raise


def _is_table(data: object) -> bool:
    """Whether data are a table of pandas."""
    pandas = sys.modules.get("pandas")
    return pandas is not None and isinstance(data, pandas.DataFrame)


def _is_experiment(data: object) -> bool:
    return isinstance(data, Mapping | Measurement) or _is_table(data)


def measurements(data: Any, common: Measurement) -> list[Measurement]:
    """Return the experiments, each with what is common to all where it says nothing."""
    times = common.timepts
    if any(map(_is_experiment, times if isinstance(times, list | tuple) else [times])):
        raise ParameterError(
            "timepts are data: nlctl.fit(diagram, data=..., parameters=...) takes the times that "
            "these have"
        )
    rows = list(data) if isinstance(data, list | tuple) else [data]
    if not rows:
        raise ParameterError("data need at least one experiment, got none")
    named = [_measurement(row, k, common) for k, row in enumerate(rows)]
    names = [one.name for one in named]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ParameterError(f"two experiments have the name '{twice}': give each one of its own")
    return named


def _measurement(data: Any, k: int, common: Measurement) -> Measurement:
    one = data if isinstance(data, Measurement) else Measurement(data=data)
    if not _is_experiment(one.data):
        raise ParameterError(
            "data need {'y': samples}, a pandas.DataFrame, nlctl.Measurement or a list of these, "
            f"got {type(one.data).__name__}"
        )
    given = {
        name: getattr(common if getattr(one, name) is None else one, name)
        for name in ("timepts", "inputs", "initial_state", "sigma")
    }
    params = {**(common.params or {}), **(one.params or {})}
    name = one.name or f"experiment {k + 1}"
    return Measurement(data=one.data, params=params, name=name, **given)


def observations(
    measured: Sequence[Measurement], system: ct.NonlinearIOSystem
) -> list[Observations]:
    """Return experiments of a diagram, checked."""
    checked = []
    for one in measured:
        with _naming(one.name if len(measured) > 1 else ""):
            checked.append(_observations(one, system, alone=len(measured) == 1))
    return checked


def _observations(one: Measurement, system: ct.NonlinearIOSystem, alone: bool) -> Observations:
    data: Any = one.data
    times, columns, inputs = one.timepts, data, one.inputs
    if _is_table(data):
        times, columns = _of_table(data, times)
        columns, inputs = _divided(columns, inputs, system)
    if times is None:
        raise ParameterError(
            "data need times: timepts in s, or a pandas.DataFrame with times in its index or in a "
            f"column '{_TIME}'"
        )
    times = checked_times(times)
    rows, states = _rows(columns, times), state_array(system, one.initial_state)
    return Observations(
        name=one.name, times=times, rows=rows, deviations=_deviations(rows, one.sigma),
        inputs=input_array(system, 0.0 if inputs is None else inputs, times),
        initial_state=dict(zip(state_names(system), states, strict=True)),
        params=one.params or {}, alone=alone,
    )  # fmt: skip


def _of_table(table: pd.DataFrame, timepts: Any) -> tuple[Any, dict[str, Any]]:
    """Return the times of a table and its columns."""
    import pandas as pd

    if not table.columns.is_unique:
        twice = table.columns[table.columns.duplicated()][0]
        raise ParameterError(f"data have two columns '{twice}': give each a name of its own")
    columns = {str(name): column.to_numpy() for name, column in table.items()}
    times = columns.pop(_TIME, None)
    if timepts is not None and times is not None:
        raise ParameterError(f"times are given twice, as timepts and as the column '{_TIME}'")
    if timepts is not None or times is not None:
        return (times if timepts is None else timepts), columns
    index = table.index
    if isinstance(index, pd.DatetimeIndex):
        index = index - index[0]
    if isinstance(index, pd.TimedeltaIndex):
        return index.total_seconds().to_numpy(), columns
    if isinstance(index, pd.RangeIndex) and index.name is None:
        raise ParameterError(
            f"data need times in s: the table has no column '{_TIME}', and its index only counts "
            f"the rows, {index.start} to {index.stop}; with table.index = times it has them"
        )
    return index.to_numpy(), columns


def _divided(
    columns: dict[str, Any], inputs: Any, system: ct.NonlinearIOSystem
) -> tuple[dict[str, Any], Any]:
    """Return the columns of signals, and the inputs: of the columns named as these, if any."""
    labels, outputs = list(system.input_labels or []), list(system.output_labels or [])
    given = {name: columns[name] for name in labels if name in columns}
    if inputs is not None:
        twice = next((name for name in given if name not in outputs), None)
        if twice is not None:
            raise ParameterError(
                f"the input '{twice}' is given twice, as a column of data and in inputs: leave "
                "one out"
            )
        return columns, inputs
    either = next((name for name in given if name in outputs), None)
    if either is not None:
        raise ParameterError(
            f"the column '{either}' may be the input or the output of that name: give inputs=, or "
            f"call an output by its block, 'block.{either}'"
        )
    rest = {name: column for name, column in columns.items() if name not in given}
    return rest, [given.get(name, 0.0) for name in labels] if given else None


def _rows(data: Mapping[str, Any], times: np.ndarray) -> dict[str, np.ndarray]:
    """Return the data as rows over time."""
    rows = {}
    for name, samples in data.items():
        row = as_numbers(samples)
        if row is None or row.shape != times.shape:
            shape = "no numbers" if row is None else f"shape {row.shape}"
            raise ParameterError(
                f"data of '{name}' need shape {times.shape} for these times, got {shape}: gaps "
                "are NaN"
            )
        if np.isinf(row).any():
            raise ParameterError(f"data of '{name}' have an infinite number: gaps are NaN")
        rows[name] = row.astype(float)
    if not rows:
        raise ParameterError("data need at least one signal, {'y': samples}")
    return rows


def _deviations(rows: Mapping[str, np.ndarray], sigma: object) -> np.ndarray:
    """Return the noise of each signal."""
    if isinstance(sigma, Mapping):
        for name in rows:
            if name not in sigma:
                raise ParameterError(f"sigma has no standard deviation for '{name}'")
    deviations = [sigma[name] if isinstance(sigma, Mapping) else sigma for name in rows]
    for name, value in zip(rows, deviations, strict=True):
        number("fit", f"sigma of '{name}'", value, above=0)
    return np.array(deviations, dtype=float)


def check_tell(observed: Sequence[Observations], names: Sequence[str], parameters: int) -> None:
    """Refuse fewer data than parameters, and values of what is sought."""
    for one in observed:
        given = next((name for name in names if name in one.params), None)
        if given is not None:
            raise ParameterError(f"'{given}' is sought: leave it out of params")
    count = sum(one.count for one in observed)
    if count < parameters:
        raise ParameterError(
            f"fit needs at least as many data as parameters, got {counted(count, 'number')} for "
            f"{counted(parameters, 'parameter')}"
        )


@described_record(made_by="fit", eq=False)
class FittedExperiment:
    """One of the experiments that parameters were fitted to, next to its run."""

    name: str  # That of the `Measurement`, or "experiment 1".
    response: SensitivityResponse  # The run with the fitted parameters, at the times of the data.
    residuals: Mapping[str, np.ndarray]  # By signal: data less the run, over `sigma`; NaN in gaps.


@described_record(eq=False)
class Fit:
    """Parameters that fit data, of `nlctl.fit`.

    Examples
    --------
    >>> plant = ct.nlsys(
    ...     lambda t, x, u, params: [params["a"]], lambda t, x, u, params: x, inputs=0,
    ...     outputs=["x"], states=["x"], params={"a": 1.0}, name="plant",
    ... )
    >>> found = nlctl.fit(plant, [0, 1, 2, 3], {"x": [0.0, 1.1, 1.9, 3.0]}, {"plant.a": 0.5})
    >>> print(found)
    Fit of 1 parameter, noise 0.0802
      plant.a = 0.992857 +- 0.021
    """

    # What was sought; of `separate` parameters each experiment has its own,
    # ``"plant.x(0) in experiment 2"``.
    names: tuple[str, ...]
    values: np.ndarray  # (k,): The least squares.
    # (k, k): From the Fisher matrix of all experiments; infinite for what data do not determine.
    covariance: np.ndarray
    # Parameters that data do not determine, or not apart from each other.
    unidentifiable: tuple[str, ...]
    at_bounds: tuple[str, ...]  # Parameters at a bound of their search: errors take no bounds.
    noise: float  # Standard deviation of the residuals, in units of `sigma`.
    freedom: int  # Number of data less that of parameters.
    experiments: tuple[FittedExperiment, ...]  # In the order of the data, one at least.
    success: bool  # Whether the search has converged.
    message: str  # How it ended.
    notes: tuple[str, ...] = ()  # What had to be done otherwise, a sentence each.

    def __getitem__(self, name: str) -> float:
        if name not in self.names:
            raise unknown("parameter", str(name), self.names, "of this fit")
        return float(self.values[self.names.index(name)])

    @property
    def response(self) -> SensitivityResponse:
        """The run with these parameters at the times of the data; of several the first."""
        return self.experiments[0].response

    @property
    def residuals(self) -> Mapping[str, np.ndarray]:
        """By signal: data less the run, over `sigma`; NaN in gaps; of several runs the first."""
        return self.experiments[0].residuals

    @property
    def errors(self) -> np.ndarray:
        """Standard errors of the values, shape (k,)."""
        return np.sqrt(np.diag(self.covariance))

    @as_annotated
    def intervals(self, confidence: float = 0.95) -> np.ndarray:
        """Return confidence intervals, of Student's t with the data's degrees of freedom.

        Parameters
        ----------
        confidence : float, optional
            Between 0 and 1.

        Returns
        -------
        ndarray of shape (k, 2)
            In the units of the parameters.

        Raises
        ------
        ParameterError
            If the confidence is not between 0 and 1.
        """
        number("intervals", "confidence", confidence, above=0, below=1)
        width = students_t.ppf(0.5 + confidence / 2, self.freedom) * self.errors
        return np.stack([self.values - width, self.values + width], axis=1)

    @as_annotated
    def to_pandas(self) -> pd.DataFrame:
        """Return a row for each parameter: value, standard error, 95 % interval.

        Returns
        -------
        pandas.DataFrame
            In the units of the parameters.
        """
        import pandas as pd

        low, high = self.intervals().T
        columns = {"value": self.values, "error": self.errors, "low": low, "high": high}
        return pd.DataFrame(columns, index=pd.Index(self.names, name="parameter"))

    def __repr__(self) -> str:
        rows = zip(self.names, self.values, self.errors, strict=True)
        several = len(self.experiments) > 1
        to = f" to {counted(len(self.experiments), 'experiment')}" if several else ""
        lines = [f"Fit of {counted(len(self.names), 'parameter')}{to}, noise {self.noise:.3g}"]
        lines += [f"  {name} = {value:.6g} +- {error:.2g}" for name, value, error in rows]
        if self.unidentifiable:
            lines.append(f"  not identifiable from these data: {', '.join(self.unidentifiable)}")
        if self.at_bounds:
            lines.append(f"  at a bound, which errors do not know: {', '.join(self.at_bounds)}")
        lines += [
            f"  {lack}: data behind that say nothing" + (f" (in '{one.name}')" if several else "")
            for one in self.experiments
            for lack in one.response.missing
        ]
        if not self.success:
            lines.append(f"  the search has not converged: {self.message}")
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])
