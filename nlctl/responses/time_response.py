"""Responses of both engines: python-control's, which say how they went and plot any diagram."""

from __future__ import annotations

from typing import Any

import control as ct
import numpy as np

_SHOWN = 6  # names that are listed before the rest is only counted


class Response(ct.TimeResponseData):
    """A `control.TimeResponseData` that also keeps how the run went.

    Attributes
    ----------
    statistics : Statistics or None
        Status, time reached and steps of a run in machine code.
    """

    statistics: Any = None

    def plot(self, *args: Any, **kwargs: Any) -> Any:
        """Plot the response as `control.time_response_plot` does, also without inputs."""
        if not self.ninputs:
            kwargs.setdefault("plot_inputs", False)
        return super().plot(*args, **kwargs)

    def __repr__(self) -> str:
        t, run = np.atleast_1d(self.time), self.statistics
        lines = [
            f"Response of '{self.sysname}': {t.size} times from {t[0]:g} to {t[-1]:g} s",
            f"  outputs  {_names(self.output_labels)}",
            f"  inputs   {_names(self.input_labels)}",
            f"  states   {self.nstates or 'none'}",
        ]
        if run is not None:
            steps = f"{run.accepted} steps, {run.rejected} rejected, {run.events} events"
            lines.append(f"  run      {run.status.name}, {steps}")
        return "\n".join(lines)


def as_response(response: ct.TimeResponseData) -> Response:
    """Return python-control's response with what `Response` adds."""
    made = Response.__new__(Response)
    made.__dict__.update(response.__dict__)
    return made


def _names(labels: Any) -> str:
    names = list(labels or ())
    rest = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(names[:_SHOWN]) or "none") + rest
