"""Cases of a paper: a diagram, a start, an input, and what was found of their runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from nlctl.attributes import described_record
from nlctl.diagrams import state_names
from nlctl.response import input_output_response

from ..metrics import Metric, over


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
    metrics: tuple[Metric, ...] = ()  # Numbers that are taken of its run.


@dataclass(frozen=True, kw_only=True, eq=False)
class PaperRun:
    """A simulated case: times (s), outputs and states by name, events, metrics by key."""

    case: Any  # A `PaperCase`, or what a paper derives from it.
    time: np.ndarray
    signals: Mapping[str, np.ndarray]
    events: pd.DataFrame = field(default_factory=pd.DataFrame)
    metrics: Mapping[str, float] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        """Return a signal by name."""
        return self.signals[name]


def simulate_case(case: PaperCase) -> PaperRun:
    """Simulate a case."""
    loop = case.make()
    response = input_output_response(
        loop, case.times, case.inputs, dict(case.start), rtol=case.rtol, atol=case.atol
    )
    outputs = np.reshape(response.outputs, (len(loop.output_labels), -1))
    states = np.reshape(response.states, (len(state_names(loop)), -1))
    signals = dict(zip(loop.output_labels, outputs, strict=True))
    signals |= dict(zip(state_names(loop), states, strict=True))
    time = np.asarray(response.time)
    metrics = numbers_of(case, time, signals)
    return PaperRun(case=case, time=time, signals=signals, events=response.events, metrics=metrics)


def numbers_of(
    case: PaperCase, time: np.ndarray, signals: Mapping[str, np.ndarray]
) -> dict[str, float]:
    """Return the metrics of a case by key, whatever simulated it."""
    return {m.key: m.function(*over(time, signals[m.signal], m.start, m.end)) for m in case.metrics}


def simulate_cases(
    cases: Sequence[PaperCase], done: Callable[[float], object] = lambda amount: None
) -> dict[str, PaperRun]:
    """Simulate cases by key, one after the other."""
    runs = {}
    for case in cases:
        runs[case.key] = simulate_case(case)
        done(1)
    return runs
