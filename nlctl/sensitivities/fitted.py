"""What a fit of parameters to data returns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import t as students_t

from ..annotations import as_annotated
from ..arguments import number
from ..attributes import described_record
from ..names import unknown
from ..wording import counted
from .record import SensitivityResponse

if TYPE_CHECKING:
    import pandas as pd


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
