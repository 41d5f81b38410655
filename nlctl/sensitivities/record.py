"""What derivatives of a run are returned as."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..annotations import as_annotated
from ..attributes import described_record
from ..names import unknown
from ..wording import counted

if TYPE_CHECKING:
    import pandas as pd


@described_record
class NoDerivative:
    """Where a run has no derivative from some time on.

    Examples
    --------
    >>> lack = nlctl.sensitivities.NoDerivative(
    ...     time=0.5, where="guard of 'a'", why="grazing", with_respect_to=("p",)
    ... )
    >>> print(lack)
    no derivative by p from t = 0.5 s on (guard of 'a'): grazing
    """

    time: float  # From when on (s).
    where: str  # The block and what happens in it.
    why: str  # What there is instead of a derivative.
    with_respect_to: tuple[str, ...]  # By what there is none.

    def __str__(self) -> str:
        where = f" ({self.where})" if self.where else ""
        by = ", ".join(self.with_respect_to)
        return f"no derivative by {by} from t = {self.time:.9g} s on{where}: {self.why}"


@described_record(eq=False)
class SensitivityResponse:
    """A run with its derivatives, of `nlctl.sensitivity_response`.

    ``response["plant.y", "law.beta"]`` is the derivative of one signal by one quantity over time.

    Examples
    --------
    >>> lag = nlctl.block(nlctl.Lag(T=0.5), "lag")
    >>> response = nlctl.sensitivity_response(lag, [0, 1], 1.0, with_respect_to=["lag.T"])
    >>> print(round(float(response["v", "lag.T"][-1]), 6))  # -exp(-1 / T) / T^2
    -0.541341
    """

    time: np.ndarray  # (m,): Times in s.
    signals: tuple[str, ...]  # Of what derivatives are taken.
    with_respect_to: tuple[str, ...]  # By what.
    values: np.ndarray  # (signals, m): The signals themselves.
    derivatives: np.ndarray  # (signals, quantities, m): NaN where there is none.
    # (quantities,): Of what size each quantity is taken to be: tolerances hold for a derivative
    # times that.
    scale: np.ndarray
    # Where, and why; empty if there are derivatives up to the end.
    missing: tuple[NoDerivative, ...] = ()
    statistics: Any = None  # `Statistics`: status, time reached, steps.

    @property
    def success(self) -> bool:
        """Whether there are derivatives up to the end."""
        return not self.missing

    @property
    def message(self) -> str | None:
        """Why there are none from some time on, in words."""
        return "; ".join(map(str, self.missing)) or None

    def __getitem__(self, names: tuple[str, str]) -> np.ndarray:
        signal, quantity = names
        if signal not in self.signals:
            raise unknown("signal", str(signal), self.signals, "of this response")
        if quantity not in self.with_respect_to:
            raise unknown("quantity", str(quantity), self.with_respect_to, "of this response")
        place = self.signals.index(signal), self.with_respect_to.index(quantity)
        return self.derivatives[place]

    @as_annotated
    def to_pandas(self) -> pd.DataFrame:
        """Return everything over time as a table.

        Returns
        -------
        pandas.DataFrame
            A row for each time: ``time``, the signals, and their derivatives with names such as
            ``d(y)/d(law.beta)``.
        """
        import pandas as pd

        columns = {"time": self.time, **dict(zip(self.signals, self.values, strict=True))}
        for i, signal in enumerate(self.signals):
            for j, quantity in enumerate(self.with_respect_to):
                columns[f"d({signal})/d({quantity})"] = self.derivatives[i, j]
        return pd.DataFrame(columns)

    def __repr__(self) -> str:
        t = self.time
        lines = [
            f"Derivatives of a run: {counted(t.size, 'time')} from {t[0]:g} to {t[-1]:g} s",
            f"  of               {', '.join(self.signals)}",
            f"  with respect to  {', '.join(self.with_respect_to)}",
        ]
        lines += [f"  {lack}" for lack in self.missing]
        return "\n".join(lines)
