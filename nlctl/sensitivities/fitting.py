"""Parameters from data: least squares with derivatives of runs, and how sure they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ..annotations import as_annotated
from ..arguments import one_of
from ..errors import DivergedError, ParameterError
from ..names import unknown
from ..native import Compiled
from ..native import compile as compile_diagram
from ..native.diagram.checks import sized
from ..native.floats import with_floats
from ..params import as_numbers, integer
from ..responses.arguments import HOLDS, checked_params, with_aliases
from .measured import (
    Fit,
    FittedExperiment,
    Measurement,
    Observations,
    check_tell,
    measurements,
    observations,
)
from .names import VariedQuantity, checked_names, parameters_and_states, varied_quantities
from .record import SensitivityResponse
from .response import sensitivity_response

if TYPE_CHECKING:
    import pandas as pd

_UNKNOWN = 1e-9  # of the largest singular value: a direction in which data say nothing
_SHARE = 0.1  # of such a direction: parameters with less are not in it
_NEXT_TO = 1e-5  # of a parameter: how far differences go, where there is no derivative
_LOST = 1e6  # noises: what a run that does not reach its end is wrong by


@as_annotated
def fit(
    diagram: ct.NonlinearIOSystem | Compiled,
    timepts: ArrayLike | None = None,
    data: Mapping[str, Any] | pd.DataFrame | Measurement | Sequence[Any] = (),
    parameters: Mapping[str, Any] | None = None,
    inputs: Any = None,
    initial_state: Mapping[str, float] | Any = None,
    *,
    separate: Sequence[str] = (),
    sigma: Mapping[str, float] | float = 1.0,
    hold: str = "foh",
    params: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    max_evaluations: int = 100,
    **aliases: object,
) -> Fit:
    """Find parameters and initial states with which a run fits data.

    Nonlinear least squares (`scipy.optimize.least_squares`) with the derivatives of runs, so that
    dead zones, backlash, relays and samples are no hindrance; where a run has none, differences of
    runs to the side that fits better take their place, and a note says so.  How sure the values are
    follows from the Fisher matrix at the end: residuals are taken to be independent and equally
    large in units of `sigma`.  Of several experiments the residuals and the Fisher matrices add up.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it.
    timepts : array_like of shape (m,), optional
        Times of the data (s); a table has its own.  Also ``T``.
    data : mapping, pandas.DataFrame, Measurement or sequence of these, optional
        Always given, by its name where there are no `timepts`:
        ``{"y": samples of shape (m,)}`` by signals as in `nlctl.sensitivity_response`; NaN where
        there are gaps.  A table has a column for each signal, and times in a column ``time`` or as
        index (s, time stamps or time differences); columns that are named as inputs of the diagram
        are its inputs.  A list has an experiment in each place, and a `Measurement` says what
        differs between these: inputs, initial states, times, noise.
    parameters : mapping, optional
        Always given, too:
        ``{"plant.a": 1.0}``: where the search starts, within what the block declares, or
        ``(start, low, high)`` with bounds of one's own.
        Initial states are ``"plant.x1(0)"``.  Several experiments share them.
    inputs : array_like, list or float, optional
        Inputs over `timepts`, 0 by default.  Also ``U``.
    initial_state : mapping, array_like or float, optional
        Of what is not sought.  Also ``X0``.
    separate : sequence of str, optional
        Names in `parameters` of which each experiment has a value of its own, such as initial
        states; in the result ``"plant.x1(0) in experiment 2"``.
    sigma : mapping or float, optional
        Standard deviation of the noise by signal, as far as known: only ratios matter.
    hold : {"foh", "zoh"}, optional
        What inputs are between these times, as in `nlctl.input_output_response`.
    params : mapping, optional
        Parameters that are overridden and not sought.
    rtol, atol : float, optional
        Tolerances of the runs.
    max_evaluations : int, optional
        Runs after which the search is given up.
    **aliases : object
        python-control's short names: ``T``, ``U``, ``X0``.

    Returns
    -------
    Fit
        Values, errors, and the run with them.

    Raises
    ------
    ParameterError
        If data or their times are missing or of another length, there are more parameters than
        data, or a start does not lie within its bounds; of several experiments with the name.
    UnknownNameError, CompileError
        As `nlctl.sensitivity_response`.
    DivergedError
        If the run with the values to start from does not reach its end.

    Examples
    --------
    >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    >>> t = np.linspace(0, 2, 21)
    >>> found = nlctl.fit(lag, t, {"v": 1 - np.exp(-t / 0.4)}, {"lag.T": 1.0}, 1.0)
    >>> print(round(found["lag.T"], 6), found.unidentifiable)
    0.4 ()

    The same from a table:

    >>> import pandas as pd
    >>> table = pd.DataFrame({"v": 1 - np.exp(-t / 0.4)}, index=t)
    >>> print(round(nlctl.fit(lag, data=table, parameters={"lag.T": 1.0}, inputs=1.0)["lag.T"], 6))
    0.4
    """
    if not parameters or not isinstance(parameters, Mapping):
        raise ParameterError(
            f"fit needs at least one parameter, {{'plant.a': 1.0}}, got {parameters!r}"
        )
    integer("fit", "max_evaluations", max_evaluations, at_least=1)
    named = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    named = with_aliases(named, aliases, fit, needed=())
    common = Measurement(data={}, params=checked_params(params), sigma=sigma, **named)
    measured = measurements(data, common)
    if not isinstance(diagram, Compiled):
        first = measured[0]
        given = 0.0 if first.inputs is None else first.inputs
        whole = sized(diagram, first.timepts, given, first.initial_state)
        diagram = compile_diagram(whole, params=params)
    diagram = with_floats(diagram, checked_names("parameters", list(parameters)))
    observed = observations(measured, diagram.system)
    sought = _sought(diagram, parameters, separate, [one.name for one in observed])
    check_tell(observed, list(parameters), len(sought.names))
    how = {"rtol": rtol, "atol": atol, "hold": one_of("fit", "hold", hold, HOLDS)}
    search = _Search(tuple(
        _Run(diagram=diagram, observed=one, names=tuple(parameters), places=places, how=how,
             low=sought.low, high=sought.high, instead={})
        for one, places in zip(observed, sought.places, strict=True)
    ))  # fmt: skip
    for run in search.runs:
        with run.observed.naming():
            run.response(sought.start)
    derivatives: Any = search.slopes  # SciPy takes functions as well as texts
    optimum = least_squares(
        search.residuals, sought.start, derivatives, (sought.low, sought.high),
        x_scale=_scale(sought.start), xtol=1e-12, ftol=1e-12, gtol=1e-12,
        max_nfev=max_evaluations,
    )  # fmt: skip
    return _fit_of(search, optimum, sought.names)


def _fit_of(search: _Search, optimum: Any, names: tuple[str, ...]) -> Fit:
    """Return what a search has led to."""
    residuals, jacobian = search.residuals(optimum.x), search.jacobian(optimum.x)
    freedom = residuals.size - optimum.x.size
    noise = float(np.sqrt(residuals @ residuals / freedom)) if freedom else np.nan
    covariance, unseen = _covariance(jacobian, _scale(optimum.x), noise)
    return Fit(
        names=names, values=optimum.x, covariance=covariance,
        unidentifiable=tuple(n for n, u in zip(names, unseen, strict=True) if u),
        at_bounds=tuple(n for n, at in zip(names, optimum.active_mask, strict=True) if at),
        noise=noise, freedom=freedom, success=bool(optimum.status > 0),
        message=str(optimum.message), notes=search.notes,
        experiments=tuple(run.fitted(optimum.x) for run in search.runs),
    )  # fmt: skip


def _covariance(
    jacobian: np.ndarray, scale: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance of parameters, and which are not identifiable from the data."""
    _, values, directions = np.linalg.svd(jacobian * scale, full_matrices=False)
    blind = values <= _UNKNOWN * max(values[0], np.finfo(float).tiny)
    unseen = np.any(np.abs(directions[blind]) > _SHARE, axis=0, keepdims=True)[0]
    inverse = np.where(blind, 0.0, 1.0 / np.where(blind, 1.0, values))
    root = directions.T * inverse
    covariance = noise**2 * (root @ root.T) * np.outer(scale, scale)
    covariance[unseen, :] = covariance[:, unseen] = 0.0
    covariance[unseen, unseen] = np.inf
    return covariance, unseen


def _scale(x: np.ndarray) -> np.ndarray:
    """Return of what size parameters are."""
    return np.where(x == 0.0, 1.0, np.abs(x))


@dataclass(kw_only=True, eq=False)
class _Run:
    """Residuals of one experiment, and their derivatives; the last run is kept for both."""

    diagram: Compiled
    observed: Observations
    names: tuple[str, ...]
    places: np.ndarray  # where these are among all numbers that are sought
    how: Mapping[str, Any]
    low: np.ndarray  # of all numbers that are sought
    high: np.ndarray
    instead: dict[str, None]  # why differences took the place of derivatives
    _at: bytes = b""
    _last: SensitivityResponse | None = None

    def response(self, x: np.ndarray) -> SensitivityResponse:
        """Return the run with some parameters."""
        values, observed = x[self.places], self.observed
        if self._last is None or values.tobytes() != self._at:
            params, states = parameters_and_states(dict(zip(self.names, values, strict=True)))
            self._last = sensitivity_response(
                self.diagram, observed.times, observed.inputs, observed.start(states),
                of=list(observed.rows), with_respect_to=list(self.names),
                params={**observed.params, **params}, **self.how,
            )  # fmt: skip
            self._at = values.tobytes()
        return self._last

    def fitted(self, x: np.ndarray) -> FittedExperiment:
        """Return the run with some parameters, and how far data are from it."""
        observed, response = self.observed, self.response(x)
        apart = (observed.measured - response.values) / observed.deviations[:, None]
        residuals = dict(zip(observed.rows, apart, strict=True))
        return FittedExperiment(name=observed.name, response=response, residuals=residuals)

    @property
    def _has_datum(self) -> np.ndarray:
        return np.isfinite(self.observed.measured)

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return all data less a run, over their noise; far off for one that ends before."""
        observed = self.observed
        try:
            values = self.response(x).values
        except (DivergedError, ParameterError):  # it ends before, or no block takes these values
            return np.full(observed.count, _LOST)
        apart = (values - observed.measured) / observed.deviations[:, None]
        return np.nan_to_num(apart, nan=_LOST)[self._has_datum]

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return their derivatives by all that is sought; where there are none, 0."""
        derivatives = self.response(x).derivatives / self.observed.deviations[:, None, None]
        rows = np.zeros((self.observed.count, x.size))
        rows[:, self.places] = np.nan_to_num(np.moveaxis(derivatives, 1, 2)[self._has_datum])
        return rows

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Return the same; where there are none, differences to the side that fits better."""
        rows, here, lacks = self.jacobian(x), self.residuals(x), self.response(x).missing
        for name in (name for lack in lacks for name in lack.with_respect_to):
            k = self.places[self.names.index(name)]
            step = _NEXT_TO * _scale(x)[k]
            self.instead |= {lack.why: None for lack in lacks}
            for side in (step, -step):
                moved = x.copy()
                moved[k] += side
                if not self.low[k] <= moved[k] <= self.high[k]:
                    continue
                rows[:, k] = (self.residuals(moved) - here) / side
                if side * (here @ rows[:, k]) < 0.0:  # the squares fall
                    break
        return rows


@dataclass(frozen=True, eq=False)
class _Search:
    """All experiments."""

    runs: tuple[_Run, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """What was done otherwise than asked, in words."""
        whys = dict.fromkeys(why for run in self.runs for why in run.instead)
        return tuple(f"differences of runs took the place of derivatives: {why}" for why in whys)

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return the residuals of all, one experiment behind the other."""
        return np.concatenate([run.residuals(x) for run in self.runs])

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return their derivatives."""
        return np.vstack([run.jacobian(x) for run in self.runs])

    def slopes(self, x: np.ndarray) -> np.ndarray:
        """Return the same, differences where there are none."""
        return np.vstack([run.slopes(x) for run in self.runs])


@dataclass(frozen=True, kw_only=True, eq=False)
class _Sought:
    """All numbers that are sought: by names, from where, within what, and whose they are."""

    names: tuple[str, ...]
    start: np.ndarray
    low: np.ndarray
    high: np.ndarray
    places: tuple[np.ndarray, ...]  # by experiment: which of them its parameters are


def _sought(
    diagram: Compiled,
    parameters: Mapping[str, Any],
    separate: Sequence[str],
    experiments: Sequence[str],
) -> _Sought:
    """Return what is sought: a number for all experiments, or one for each."""
    if isinstance(separate, str):
        raise ParameterError(f"separate needs a list of names, got the text {separate!r}")
    for name in separate:
        if name not in parameters:
            raise unknown("parameter", str(name), list(parameters), "in parameters")
    ranges = _ranges(parameters, varied_quantities(diagram, list(parameters)))
    names, rows = [], []
    places = np.empty((len(experiments), len(parameters)), dtype=int)
    for i, name in enumerate(parameters):
        for k, experiment in enumerate(experiments):
            if k == 0 or name in separate:
                names.append(f"{name} in {experiment}" if name in separate else name)
                rows.append(ranges[i])
            places[k, i] = len(names) - 1
    start, low, high = np.array(rows, dtype=float).T
    return _Sought(names=tuple(names), start=start, low=low, high=high, places=tuple(places))


def _ranges(
    parameters: Mapping[str, Any], quantities: Sequence[VariedQuantity]
) -> list[tuple[float, float, float]]:
    """Return where a search starts, and its bounds: those of the blocks where none are given."""
    rows = []
    for (name, value), quantity in zip(parameters.items(), quantities, strict=True):
        row = as_numbers(value)
        if row is None or row.shape not in ((), (3,)):
            raise ParameterError(
                f"'{name}' needs a number to start from, or (start, low, high), got {value!r}"
            )
        start, low, high = row if row.ndim else (float(row), quantity.lowest, quantity.highest)
        if not low <= start <= high or not low < high:
            raise ParameterError(
                f"'{name}' needs a start within its bounds, got {start:g} in [{low:g}, {high:g}]"
            )
        rows.append((start, low, high))
    return rows
