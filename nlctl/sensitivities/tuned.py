"""What tuning of gains returns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..annotations import as_annotated
from ..attributes import described_record
from ..names import unknown
from ..wording import counted
from .names import parameters_and_states

if TYPE_CHECKING:
    import pandas as pd


@described_record(made_by="tune", eq=False)
class Tuned:
    """Gains that were found, of `nlctl.tune`."""

    names: tuple[str, ...]  # What was tuned.
    low: np.ndarray  # (k,): Within what.
    high: np.ndarray
    start: np.ndarray  # (k,): Before and after.
    values: np.ndarray
    # By key: the least margin of each requirement over all samples, and the mean cost.
    before: Mapping[str, float]
    after: Mapping[str, float]
    # (k,): Least margin, or the mean cost where there is one, with this gain alone at its new
    # value, and with all but this one.
    alone: np.ndarray
    put_back: np.ndarray
    cost: str  # Key of the cost; empty without one.
    # Every choice of gains that was tried: ``by`` what it was chosen, ``runs`` that were made until
    # then, the least ``margin``, ``cost``, and the gains.
    history: pd.DataFrame
    plain_runs: int  # How many runs were made, without and with derivatives.
    differentiated_runs: int
    counted_runs: float  # Both together; one with k derivatives counts as 1 + 0.7 k.
    notes: tuple[str, ...]  # What had to be done otherwise, a sentence each.
    message: str  # How the search ended.

    def __getitem__(self, name: str) -> float:
        if name not in self.names:
            raise unknown("gain", str(name), self.names, "of this tuning")
        return float(self.values[self.names.index(name)])

    @property
    def params(self) -> dict[str, float]:
        """The gains, for ``params=`` of a run."""
        return parameters_and_states(dict(zip(self.names, map(float, self.values), strict=True)))[0]

    @property
    def margin(self) -> float:
        """The least margin with these gains; NaN if only a cost was asked."""
        return _least(self.after, self.cost)

    @property
    def margin_before(self) -> float:
        """The least margin with the gains of the start; NaN if only a cost was asked."""
        return _least(self.before, self.cost)

    @as_annotated
    def to_pandas(self) -> pd.DataFrame:
        """Return a row for each gain: before, after, bounds, and what it has bought.

        Returns
        -------
        pandas.DataFrame
            Columns ``before``, ``after``, ``low``, ``high``, ``alone``, ``put_back``.
        """
        import pandas as pd

        columns = {"before": self.start, "after": self.values, "low": self.low, "high": self.high}
        columns |= {"alone": self.alone, "put_back": self.put_back}
        return pd.DataFrame(columns, index=pd.Index(self.names, name="gain"))

    def __repr__(self) -> str:
        what = "cost" if self.cost else "least margin"
        number = counted(len(self.names), "gain")
        lines = [f"Tuning of {number}: {self.message}; runs as counted: {self.counted_runs:.0f}"]
        lines += [
            f"  {key}: {self.before[key]:.4g} before, {self.after[key]:.4g} after"
            for key in self.after
        ]
        rows = zip(self.names, self.start, self.values, self.alone, self.put_back, strict=True)
        lines += [
            f"  {name} = {new:.4g} (was {old:.4g}); {what} {alone:.4g} with it alone, "
            f"{without:.4g} without it"
            for name, old, new, alone, without in rows
        ]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def _least(numbers: Mapping[str, float], cost: str) -> float:
    margins = [value for key, value in numbers.items() if key != cost]
    return min(margins, default=np.nan)
