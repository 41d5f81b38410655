"""Responses of both engines: python-control's, which say how they went and plot any diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import control as ct
import numpy as np

from ..diagrams import state_names
from ..errors import UsageError
from ..host.notebook import table_html
from ..names import find_name, unknown
from ..plotting.groups import Wires, groups_of, wires_of
from ..upstream.control_internals import is_system
from ..wording import counted
from .event_log import NO_EVENTS, EventLog

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = 6  # names that are listed before the rest is only counted
_SMALL = 100  # times `atol`: what is smaller has an error of a part of itself
_ROWS = 4  # signals that have room in a row each
_BY_KIND = "signals by kind"  # a figure that python-control does not know
_ROW = 1.2  # in, the least height of a row


class Labels(NamedTuple):
    """Qualified names of a diagram's states, and where its outputs come from."""

    state_names: Sequence[str]
    wires: Wires


class StateLabels(list[str]):
    """python-control's labels of states, ``"plant_x1"``, found by ``"plant.x1"`` as well."""

    def __init__(self, labels: Sequence[str], names: Sequence[str]) -> None:
        super().__init__(labels)
        self.names = {name: k for k, name in enumerate(names)}

    def index(self, name: Any, *args: Any) -> int:
        """Return the place of a state by its label, its qualified name or the end of one."""
        if name in self:
            return super().index(name, *args)
        return self.names[find_name("state", name, self.names)]


class Response(ct.TimeResponseData):
    """A `control.TimeResponseData` that also keeps how the run went.

    Attributes
    ----------
    statistics : Statistics or None
        Status, time reached, steps and events of a run in machine code.
    happened : EventLog
        What is in `events`.
    jump_times : ndarray of shape (n,)
        When held and delayed signals may jump (s), besides at events: where clocks tick, and where
        what jumps comes out of delays.
    state_names : list of str
        Qualified names of the states, ``"plant.x1"``.
    wires : Wires
        Where the outputs come from.
    """

    statistics: Any = None
    happened: EventLog = NO_EVENTS
    jump_times: np.ndarray = np.zeros(0)
    state_names: Sequence[str] = ()
    wires: Wires = Wires()

    @property
    def states(self) -> np.ndarray:
        """The states, found by ``"plant.x1"`` as well as by python-control's ``"plant_x1"``."""
        found: Any = super().states
        if len(self.state_names) == len(found.signal_labels or ()):
            found.signal_labels = StateLabels(found.signal_labels, self.state_names)
        return found

    if TYPE_CHECKING:  # python-control's own are partly unknown

        @property
        def time(self) -> np.ndarray: ...
        @property
        def outputs(self) -> np.ndarray: ...
        @property
        def inputs(self) -> np.ndarray: ...

    @property
    def events(self) -> pd.DataFrame:
        """What has happened in the run: time (s), block, which, direction; a row each.

        Guards that have fallen, switching functions that blocks declare, and conditions of the
        equations, where steps have ended, those of t alone included.  ``statistics.events`` is
        their number.
        """
        return self.happened.table()

    def plot(
        self, *args: object, signals: Sequence[str | Sequence[str]] | None = None, **kwargs: object
    ) -> Any:
        """Plot the response as `control.time_response_plot` does, or signals of one kind in a row.

        Of up to four signals each has a row of its own, as with arguments of python-control's.
        `signals` says what is shown, outputs and inputs: a name has a row, a list of names shares
        one, ``run.plot(signals=[["yd", "y"], "u"])``.
        """
        count = (self.noutputs or 0) + (self.ninputs or 0)
        if not args and not kwargs and not self.ntraces and (signals is not None or count > _ROWS):
            return self._plot_rows(signals)
        if signals is not None:
            raise UsageError("signals= has no meaning next to arguments of time_response_plot")
        import matplotlib.pyplot as plt

        if not self.ninputs:
            kwargs.setdefault("plot_inputs", False)
        if plt.get_fignums() and plt.gcf().get_label() == _BY_KIND:
            plt.figure()  # python-control draws into the current figure where the rows fit
        width, height = plt.rcParams["figure.figsize"]
        with plt.rc_context({"figure.figsize": (width, max(height, _ROW * count))}):
            return super().plot(*args, **kwargs)

    def rows(
        self, wanted: Sequence[str | Sequence[str]] | None = None
    ) -> tuple[dict[str, np.ndarray], dict[str, list[str]]]:
        """Return what `plot` shows: samples by name, and names by the title of their row."""
        if self.ntraces:
            raise UsageError("rows are those of one run, and this response has several traces")
        signals: dict[str, np.ndarray] = {}
        every: Any = ((self.output_labels, self.y), (self.input_labels, self.u))
        for labels, samples in every:
            signals |= dict(zip(labels or (), samples if labels else (), strict=True))
        if wanted is None:
            return signals, groups_of(signals, self.wires)
        rows = {}
        for row in wanted:
            names = [row] if isinstance(row, str) else list(row)
            for name in names:
                if name not in signals:
                    raise unknown("signal", str(name), signals, f"of '{self.sysname}'")
            rows[", ".join(names)] = names
        return {name: signals[name] for names in rows.values() for name in names}, rows

    def _plot_rows(self, wanted: Sequence[str | Sequence[str]] | None) -> Any:
        import matplotlib.pyplot as plt

        from ..plotting.axes import control_plot
        from ..plotting.signals import rows_figure

        signals, rows = self.rows(wanted)
        figure, axes = rows_figure(self.time, signals, rows, plt.figure(layout="constrained"))
        figure.set_label(_BY_KIND)
        figure.suptitle(self.title or "", fontsize="medium")
        return control_plot(figure, axes)

    def __repr__(self) -> str:
        t, run = np.atleast_1d(self.time), self.statistics
        lines = [
            f"Response of '{self.sysname}': {counted(t.size, 'time')} from {t[0]:g} to {t[-1]:g} s",
            f"  outputs  {_names(self.output_labels)}",
            f"  inputs   {_names(self.input_labels)}",
            f"  states   {self.nstates or 'none'}",
        ]
        if run is not None:
            steps = (
                f"{counted(run.accepted, 'step')}, {run.rejected} rejected, "
                f"{counted(run.events, 'event')}"
            )
            turns = f", {counted(run.turns, 'turn')} of memories" if run.turns else ""
            lines.append(f"  run      {run.status.name}, {steps}{turns}")
            if run.slides:
                lines.append(f"  slides   along {run.along}")
            if run.forks:
                lines.append(f"  forks    {run.ways}")
            if run.called:
                names = ", ".join(run.called)
                lines.append(f"  called   {names}: a loop takes more passes than are written out")
            if small := self.small_outputs():
                lines.append(f"  small    {small}")
        return "\n".join(lines)

    def small_outputs(self) -> str:
        """Say which outputs are so small that `atol` may be all of their error; '' for none.

        Examples
        --------
        >>> tank = ct.ss(-1, 1, 1, 0, inputs=["q"], outputs=["h"], name="tank")
        >>> nlctl.input_output_response(tank, [0, 1], 1e-9).small_outputs()
        'h is at most 6.32e-10, of the size of atol = 1e-10: take a smaller atol'
        """
        if self.statistics is None or not self.statistics.atol > 0:
            return ""
        largest = np.max(np.abs(np.reshape(self.y, (self.noutputs, -1))), axis=1, initial=0.0)
        rows = np.flatnonzero((largest > 0) & (largest < _SMALL * self.statistics.atol))
        if not rows.size:
            return ""
        names = _names([(self.output_labels or [])[i] for i in rows])
        return (
            f"{names} {'is' if rows.size == 1 else 'are'} at most "
            f"{largest[rows].max():.3g}, of the size of atol = {self.statistics.atol:g}: take a "
            "smaller atol"
        )

    def _repr_html_(self) -> str:
        """What a notebook shows: how the run went, and the range of each output."""
        y = np.asarray(self.y, dtype=float)
        ends = (y.min(axis=-1), y.max(axis=-1), y[..., -1])
        rows = zip(self.output_labels or [], *(_in_text(values) for values in ends), strict=True)
        return table_html(repr(self), ("output", "least", "largest", "at the end"), rows)


def _in_text(values: np.ndarray) -> list[str]:
    """Return one text for each output; those of several traces in one row."""
    return [", ".join(f"{v:.6g}" for v in np.ravel(own)) for own in values]


def as_response(response: ct.TimeResponseData, system: Any = None) -> Response:
    """Return python-control's response of a system with what `Response` adds."""
    extended = Response.__new__(Response)
    extended.__dict__.update(response.__dict__)
    return _labelled(extended, labels_of(system)) if is_system(system) else extended


def labels_of(system: Any) -> Labels:
    """Return where the signals and states of a response of a system come from."""
    return Labels(state_names=state_names(system), wires=wires_of(system))


def _labelled(response: Response, labels: Labels) -> Response:
    """Let a response know where its signals and states come from."""
    response.state_names, response.wires = labels
    return response


def response_of(
    system: Any,
    signals: Sequence[Any],
    params: Any,
    form: Mapping[str, Any],
    labels: Labels,
    **more: object,
) -> Response:
    """Return a response of a system."""
    response = Response(
        *signals,
        issiso=system.issiso(),
        params=dict(system.params) | dict(params or {}),
        output_labels=system.output_labels,
        input_labels=system.input_labels,
        state_labels=system.state_labels,
        title=f"Input/output response for {system.name}",
        sysname=system.name,
        squeeze=form.get("squeeze"),
        transpose=bool(form.get("transpose")),
        return_x=bool(form.get("return_states")),
        **more,
    )
    return _labelled(response, labels)


def _names(labels: Any) -> str:
    names = list(labels or ())
    rest = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(names[:_SHOWN]) or "none") + rest
