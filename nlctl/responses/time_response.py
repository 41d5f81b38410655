"""Responses of both engines: python-control's, which say how they went and plot any diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from ..host.notebook import table_html
from ..wording import counted
from .event_log import NO_EVENTS, EventLog

if TYPE_CHECKING:
    import pandas as pd

_SHOWN = 6  # names that are listed before the rest is only counted


class Response(ct.TimeResponseData):
    """A `control.TimeResponseData` that also keeps how the run went.

    Attributes
    ----------
    statistics : Statistics or None
        Status, time reached, steps and events of a run in machine code.
    happened : EventLog
        What is in `events`.
    """

    statistics: Any = None
    happened: EventLog = NO_EVENTS

    if TYPE_CHECKING:  # python-control's own are partly unknown

        @property
        def time(self) -> np.ndarray: ...
        @property
        def outputs(self) -> np.ndarray: ...
        @property
        def states(self) -> np.ndarray: ...
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

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """Plot the response as `control.time_response_plot` does, also without inputs."""
        if not self.ninputs:
            kwargs.setdefault("plot_inputs", False)
        return super().plot(*args, **kwargs)

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
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        """What a notebook shows: how the run went, and the range of each output."""
        y = np.asarray(self.y, dtype=float)
        ends = (y.min(axis=-1), y.max(axis=-1), y[..., -1])
        rows = zip(self.output_labels or [], *(_in_text(values) for values in ends), strict=True)
        return table_html(repr(self), ("output", "least", "largest", "at the end"), rows)


def _in_text(values: np.ndarray) -> list[str]:
    """Return one text for each output; those of several traces in one row."""
    return [", ".join(f"{v:.6g}" for v in np.ravel(own)) for own in values]


def as_response(response: ct.TimeResponseData) -> Response:
    """Return python-control's response with what `Response` adds."""
    made = Response.__new__(Response)
    made.__dict__.update(response.__dict__)
    return made


def response_of(
    system: Any,
    signals: Sequence[Any],
    params: Any,
    form: Mapping[str, Any],
    **more: Any,
) -> Response:
    """Return a response of a system."""
    return Response(
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


def _names(labels: Any) -> str:
    names = list(labels or ())
    rest = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(names[:_SHOWN]) or "none") + rest
