"""Cases of a paper: a diagram, a start, an input, how they ended, and figures of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from nlctl.attributes import described_record
from nlctl.diagrams import state_names
from nlctl.plotting.axes import STYLES, TIME, legend_above, stacked_axes
from nlctl.response import input_output_response


@described_record(eq=False)
class PaperCase:
    """One run of one example."""

    key: str
    make: Callable[[], Any]  # Returns the diagram.
    times: np.ndarray  # (m,): Output times (s).
    inputs: Any = 0.0  # Of an open diagram.
    # Initial states by qualified name; the others start as their blocks say.
    start: Mapping[str, float] = field(default_factory=dict)
    rtol: float = 1e-8
    atol: float = 1e-10


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperRun:
    """A simulated case: times (s), outputs and states by name, events."""

    case: PaperCase
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    events: pd.DataFrame

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a signal by name."""
        return self.signals[name]


def simulate_case(case: PaperCase, engine: str = "auto") -> PaperRun:
    """Simulate a case, by either engine."""
    loop = case.make()
    response = input_output_response(
        loop, case.times, case.inputs, dict(case.start), rtol=case.rtol, atol=case.atol,
        engine=engine,
    )  # fmt: skip
    outputs = np.reshape(response.outputs, (len(loop.output_labels), -1))
    states = np.reshape(response.states, (len(state_names(loop)), -1))
    signals = dict(zip(loop.output_labels, outputs, strict=True))
    signals |= dict(zip(state_names(loop), states, strict=True))
    return PaperRun(
        case=case, time=np.asarray(response.time), signals=signals, events=response.events
    )


def simulate_cases(
    cases: Sequence[PaperCase], done: Callable[[float], object] = lambda amount: None
) -> dict[str, PaperRun]:
    """Simulate cases by key, one after the other."""
    runs = {}
    for case in cases:
        runs[case.key] = simulate_case(case)
        done(1)
    return runs


def paths_figure(paths: Mapping[str, tuple[Any, Any]], across: str, up: str) -> Figure:
    """Draw up to four paths in a plane; those of a label that ends in "read" as points."""
    figure, (ax,) = stacked_axes(height=3.0)
    for (label, (x, y)), (colour, style) in zip(paths.items(), STYLES, strict=False):
        line = "o" if label.endswith("read") else style
        ax.plot(x, y, line, color=colour, linewidth=1.4, markersize=5, label=label)
    if len(paths) > 1:
        legend_above(ax)
    ax.set(xlabel=across, ylabel=up)
    return figure


def rows_over_time(rows: Mapping[str, Mapping[str, tuple[Any, Any]]]) -> Figure:
    """Draw rows of signals over time: ``{axis label: {signal: (times, values)}}``."""
    figure, axes = stacked_axes(rows=len(rows), height=2.4 if len(rows) == 1 else 1.9)
    for ax, (label, signals) in zip(axes, rows.items(), strict=True):
        for (name, (times, values)), look in zip(signals.items(), STYLES, strict=False):
            colour, style = look
            ax.plot(times, values, style, color=colour, linewidth=1.4, label=name)
        if len(signals) > 1:
            legend_above(ax)
        ax.set(ylabel=label)
    axes[-1].set(xlabel=TIME)
    return figure
