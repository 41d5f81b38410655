"""Parameters from data: least squares with derivatives of runs, and how sure they are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares
from scipy.stats import t as students_t

from ..annotations import as_annotated
from ..arguments import number
from ..attributes import described_record
from ..errors import DivergedError, ParameterError
from ..native import Compiled
from ..native import compile as compile_diagram
from ..native.diagram.checks import sized
from ..params import as_numbers, checked_times
from ..wording import counted
from .names import VariedQuantity, parameters_and_states, varied_quantities
from .record import SensitivityResponse
from .response import sensitivity_response

if TYPE_CHECKING:
    import pandas as pd

_UNKNOWN = 1e-9  # of the largest singular value: a direction in which data say nothing
_SHARE = 0.1  # of such a direction: parameters with less are not in it
_LOST = 1e6  # noises: what a run that does not reach its end is wrong by


@described_record(eq=False)
class Fit:
    """Parameters that fit data, of `nlctl.fit`.

    Examples
    --------
    >>> import control as ct
    >>> plant = ct.nlsys(
    ...     lambda t, x, u, params: [params["a"]], lambda t, x, u, params: x, inputs=0,
    ...     outputs=["x"], states=["x"], params={"a": 1.0}, name="plant",
    ... )
    >>> found = nlctl.fit(plant, [0, 1, 2, 3], {"x": [0.0, 1.1, 1.9, 3.0]}, {"plant.a": 0.5})
    >>> print(found)
    Fit of 1 parameter, noise 0.0802
      plant.a = 0.992857 +- 0.021
    """

    names: tuple[str, ...]
    values: np.ndarray  # (k,): The least squares.
    # (k, k): From the Fisher matrix; infinite for what data do not determine.
    covariance: np.ndarray
    # Parameters that data do not determine, or not apart from each other.
    unidentifiable: tuple[str, ...]
    noise: float  # Standard deviation of the residuals, in units of `sigma`.
    freedom: int  # Number of data less that of parameters.
    response: SensitivityResponse  # The run with these parameters, at the times of the data.
    residuals: Mapping[str, np.ndarray]  # By signal: data less the run, over `sigma`; NaN in gaps.
    success: bool  # Whether the search has converged.
    message: str  # How it ended.

    def __getitem__(self, name: str) -> float:
        return float(self.values[self.names.index(name)])

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
        lines = [f"Fit of {counted(len(self.names), 'parameter')}, noise {self.noise:.3g}"]
        lines += [f"  {name} = {value:.6g} +- {error:.2g}" for name, value, error in rows]
        if self.unidentifiable:
            lines.append(f"  not identifiable from these data: {', '.join(self.unidentifiable)}")
        lines += [f"  {lack}: data behind that say nothing" for lack in self.response.missing]
        if not self.success:
            lines.append(f"  the search has not converged: {self.message}")
        return "\n".join(lines)


@as_annotated
def fit(
    diagram: ct.NonlinearIOSystem | Compiled,
    timepts: ArrayLike,
    data: Mapping[str, Any],
    parameters: Mapping[str, Any],
    inputs: Any = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    sigma: Mapping[str, float] | float = 1.0,
    params: Mapping[str, Any] | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-10,
    max_evaluations: int = 100,
) -> Fit:
    """Find parameters and initial states with which a run fits data.

    Nonlinear least squares (`scipy.optimize.least_squares`) with the derivatives of runs, so that
    dead zones, backlash, relays and samples are no hindrance.  How sure the values are follows
    from the Fisher matrix at the end: residuals are taken to be independent and equally large in
    units of `sigma`.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it.
    timepts : array_like of shape (m,)
        Times of the data (s).
    data : mapping
        ``{"y": samples of shape (m,)}`` by signals as in `nlctl.sensitivity_response`; NaN where
        there are gaps.
    parameters : mapping
        ``{"plant.a": 1.0}``: where the search starts, within what the block declares, or
        ``(start, low, high)`` with bounds of one's own.
        Initial states are ``"plant.x1(0)"``.
    inputs : array_like, list or float, optional
        Inputs over `timepts`.
    initial_state : mapping, array_like or float, optional
        Of what is not sought.
    sigma : mapping or float, optional
        Standard deviation of the noise by signal, as far as known: only ratios matter.
    params : mapping, optional
        Parameters that are overridden and not sought.
    rtol, atol : float, optional
        Tolerances of the runs.
    max_evaluations : int, optional
        Runs after which the search is given up.

    Returns
    -------
    Fit
        Values, errors, and the run with them.

    Raises
    ------
    ParameterError
        If data are missing or of another length, there are more parameters than data, or a start
        does not lie within its bounds.
    UnknownNameError, CompileError
        As `nlctl.sensitivity_response`.
    DivergedError
        If the run with the values to start from does not reach its end.

    Examples
    --------
    >>> import numpy as np
    >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    >>> t = np.linspace(0, 2, 21)
    >>> found = nlctl.fit(lag, t, {"v": 1 - np.exp(-t / 0.4)}, {"lag.T": 1.0}, 1.0)
    >>> print(round(found["lag.T"], 6), found.unidentifiable)
    0.4 ()
    """
    times = checked_times(timepts)
    if not isinstance(diagram, Compiled):
        diagram = compile_diagram(sized(diagram, inputs, initial_state), params=params)
    given = _data(data, times, sigma)
    if not parameters:
        raise ParameterError("fit needs at least one parameter, {'plant.a': 1.0}")
    names = list(parameters)
    start, bounds = _sought(parameters, varied_quantities(diagram, names))
    count = sum(int(np.isfinite(row).sum()) for row in given.values())
    if count < len(names):
        raise ParameterError(
            f"fit needs at least as many data as parameters, got {counted(count, 'number')} for "
            f"{counted(len(names), 'parameter')}"
        )
    search = _Search(
        diagram=diagram, times=times, data=given, names=names, sigma=_sigmas(given, sigma),
        more={"inputs": inputs, "initial_state": initial_state, "params": params,
              "rtol": rtol, "atol": atol},
    )  # fmt: skip
    search.response(start)
    derivatives: Any = search.jacobian  # SciPy takes functions as well as texts
    optimum = least_squares(
        search.residuals, start, derivatives, bounds, x_scale=np.where(start, abs(start), 1.0),
        xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=max_evaluations,
    )  # fmt: skip
    return _fit_of(search, optimum)


def _fit_of(search: _Search, optimum: Any) -> Fit:
    """Return what a search has led to."""
    residuals, jacobian = search.residuals(optimum.x), search.jacobian(optimum.x)
    freedom = residuals.size - optimum.x.size
    noise = float(np.sqrt(residuals @ residuals / freedom)) if freedom else np.nan
    covariance, unknown = _covariance(jacobian, search.scale(optimum.x), noise)
    response = search.response(optimum.x)
    assert response is not None
    return Fit(
        names=tuple(search.names), values=optimum.x, covariance=covariance,
        unidentifiable=tuple(n for n, u in zip(search.names, unknown, strict=True) if u),
        noise=noise, freedom=freedom, response=response, success=bool(optimum.status > 0),
        message=str(optimum.message),
        residuals={
            name: (row - response.values[i]) / search.sigma[i]
            for i, (name, row) in enumerate(search.data.items())
        },
    )  # fmt: skip


def _covariance(
    jacobian: np.ndarray, scale: np.ndarray, noise: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the covariance of parameters, and which are not identifiable from the data."""
    _, values, directions = np.linalg.svd(jacobian * scale, full_matrices=False)
    blind = values <= _UNKNOWN * max(values[0], np.finfo(float).tiny)
    unknown = np.any(np.abs(directions[blind]) > _SHARE, axis=0, keepdims=True)[0]
    inverse = np.where(blind, 0.0, 1.0 / np.where(blind, 1.0, values))
    root = directions.T * inverse
    covariance = noise**2 * (root @ root.T) * np.outer(scale, scale)
    covariance[unknown, :] = covariance[:, unknown] = 0.0
    covariance[unknown, unknown] = np.inf
    return covariance, unknown


@dataclass(kw_only=True, eq=False)
class _Search:
    """Residuals and their derivatives; the last run is kept for both."""

    diagram: Compiled
    times: np.ndarray
    data: Mapping[str, np.ndarray]
    names: Sequence[str]
    sigma: np.ndarray
    more: Mapping[str, Any]
    _at: bytes = b""
    _last: SensitivityResponse | None = None

    def scale(self, x: np.ndarray) -> np.ndarray:
        """Return of what size parameters are."""
        return np.where(x == 0.0, 1.0, np.abs(x))

    def response(self, x: np.ndarray) -> SensitivityResponse:
        """Return the run with some parameters."""
        if self._last is None or x.tobytes() != self._at:
            params, states = parameters_and_states(dict(zip(self.names, x, strict=True)))
            start = self.more["initial_state"]
            if states:
                start = dict(start or {}) | states
            self._last = sensitivity_response(
                self.diagram, self.times, self.more["inputs"], start, of=list(self.data),
                with_respect_to=list(self.names),
                params={**(self.more["params"] or {}), **params}, rtol=self.more["rtol"],
                atol=self.more["atol"],
            )  # fmt: skip
            self._at = x.tobytes()
        return self._last

    @property
    def _has_datum(self) -> np.ndarray:
        return np.isfinite(np.stack(list(self.data.values())))

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return all data less a run, over their noise; far off for one that ends before."""
        rows = np.stack(list(self.data.values()))
        try:
            values = self.response(x).values
        except (DivergedError, ParameterError):  # it ends before, or no block takes these values
            return np.full(int(self._has_datum.sum()), _LOST)
        return np.nan_to_num((values - rows) / self.sigma[:, None], nan=_LOST)[self._has_datum]

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return their derivatives; where there are none, 0."""
        derivatives = self.response(x).derivatives / self.sigma[:, None, None]
        return np.nan_to_num(np.moveaxis(derivatives, 1, 2)[self._has_datum])


def _data(data: Any, times: np.ndarray, sigma: object) -> dict[str, np.ndarray]:
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
    if isinstance(sigma, Mapping):
        for name in rows:
            if name not in sigma:
                raise ParameterError(f"sigma has no standard deviation for '{name}'")
    return rows


def _sigmas(data: Mapping[str, np.ndarray], sigma: object) -> np.ndarray:
    """Return the noise of each signal."""
    deviations = [sigma[name] if isinstance(sigma, Mapping) else sigma for name in data]
    for name, value in zip(data, deviations, strict=True):
        number("fit", f"sigma of '{name}'", value, above=0)
    return np.array(deviations, dtype=float)


def _sought(
    parameters: Mapping[str, Any], quantities: Sequence[VariedQuantity]
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
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
    starts, lows, highs = np.array(rows, dtype=float).T
    return starts, (lows, highs)
