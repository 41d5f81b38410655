"""What many runs of one diagram come to: a table, kept signals, and their plot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..attributes import described_record
from ..errors import ParameterError
from ..host.notebook import table_html
from ..names import unknown
from ..params import integer
from ..plotting.axes import control_plot
from ..plotting.bands import Limit, bands
from ..wording import counted

if TYPE_CHECKING:
    import pandas as pd


class MetricLike(Protocol):
    """What an ensemble asks of a metric; see `nlctl.analysis.metrics.Metric`."""

    @property
    def key(self) -> str: ...

    @property
    def start(self) -> float: ...

    @property
    def end(self) -> float: ...

    @property
    def signals(self) -> Sequence[str]: ...

    @property
    def function(self) -> Callable[..., float]: ...  # (t, samples of the first signal, ...)


class SpecLike(Protocol):
    """What a plot asks of a spec; see `nlctl.analysis.robustness.Spec`."""

    @property
    def limits(self) -> Mapping[str, Sequence[Limit]]: ...  # value, from when to when (s)


ROWS = 8  # rows of its table that an ensemble prints


class SignalsByName(dict[str, np.ndarray]):
    """Signals by name; of others it says how they are kept."""

    def __missing__(self, name: object) -> np.ndarray:
        where = "among those that were kept, ensemble_response(..., keep=[...])"
        raise unknown("signal", str(name), self, where)


@described_record(made_by="ensemble_response", repr=False)
class Ensemble:
    """Runs of one diagram."""

    # One row per finished member, by its number: what was varied, ``status`` (text), ``time``
    # reached (s), ``steps``, and the metrics; those of a run that did not end well are NaN.
    table: pd.DataFrame
    time: np.ndarray  # (m,): Times of the samples (s).
    signals: Mapping[str, np.ndarray]  # (members, m): Those kept, NaN after the end of a run.

    def to_pandas(self) -> pd.DataFrame:
        """Return the signals as a table, a row for each member and time.

        Returns
        -------
        pandas.DataFrame
            Columns member, time (s), and one for each signal that was kept.

        Examples
        --------
        >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
        >>> many = nlctl.ensemble_response(lag, [0, 1], X0=[[1.0], [2.0]], keep=["v"])
        >>> many.to_pandas().shape
        (4, 3)
        """
        import pandas as pd

        count = next((len(samples) for samples in self.signals.values()), len(self.table))
        which = {"member": np.repeat(np.arange(count), self.time.size)}
        return pd.DataFrame(
            which
            | {"time": np.tile(self.time, count)}
            | {name: samples.reshape(-1) for name, samples in self.signals.items()}
        )

    @as_annotated
    def plot(
        self,
        signals: Sequence[str] | None = None,
        *,
        members: Sequence[int] = (),
        spec: SpecLike | None = None,
    ) -> ct.ControlPlot:
        """Plot bands that hold all, 90 % and 50 % of the members at each time.

        A member that has ended counts as lying beyond both ends of every band from then on.

        Parameters
        ----------
        signals : sequence of str, optional
            Those of the signals that were kept that are shown; all by default.
        members : sequence of int, optional
            Members that are shown as lines.
        spec : Spec, optional
            Requirements whose limits are shown.

        Returns
        -------
        control.ControlPlot
            Lines, axes and figure.

        Raises
        ------
        UnknownNameError
            If a signal was not kept.
        ParameterError
            If none was, or there is no such member.

        Examples
        --------
        >>> lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
        >>> many = nlctl.ensemble_response(lag, [0, 1], X0=[[1.0], [2.0]], keep=["v"])
        >>> many.plot(members=[0]).axes.shape
        (1, 1)
        """
        import matplotlib.pyplot as plt

        shown = self._shown(signals)
        count = len(next(iter(shown.values())))
        lines = {}
        for number in members:
            number = integer("plot", "members", number, at_least=0)
            if number >= count:
                raise ParameterError(f"plot needs members from 0 to {count - 1}, got {number}")
            lines[f"member {number}"] = {name: y[number] for name, y in shown.items()}
        limits = {} if spec is None else spec.limits
        figure = plt.figure(layout="constrained")
        _, axes = bands(self.time, shown, lines, limits=limits, figure=figure)
        return control_plot(figure, axes)

    def _shown(self, signals: Sequence[str] | None) -> dict[str, np.ndarray]:
        """Return the signals that a plot shows."""
        if not self.signals:
            raise ParameterError(
                "no signal was kept: ensemble_response(..., keep=[...]) keeps outputs of a diagram"
            )
        names = [signals] if isinstance(signals, str) else signals
        names = list(self.signals if names is None else names)
        for name in names:
            if name not in self.signals:
                raise unknown("signal", name, self.signals, "among those that were kept")
        return {name: self.signals[name] for name in names}

    def _repr_html_(self) -> str:
        """What a notebook shows: how the members ended, and the first of them."""
        rows = ((n, *row) for n, *row in self.table.head(ROWS).itertuples())
        return table_html(repr(self).splitlines()[0], ["", *map(str, self.table.columns)], rows)

    def __repr__(self) -> str:
        ended = self.table["status"].value_counts() if len(self.table) else {}
        how = ", ".join(f"{count} {status}" for status, count in ended.items()) or "none finished"
        kept = f"; kept: {', '.join(self.signals)}" if self.signals else ""
        return (
            f"Ensemble of {counted(len(self.table), 'member')}: {how}; "
            f"{counted(self.time.size, 'time')} from "
            f"{self.time[0]:g} to {self.time[-1]:g} s{kept}\n{self.table.head(ROWS)}"
            + (f"\n... {len(self.table) - ROWS} more in .table" * (len(self.table) > ROWS))
        )
