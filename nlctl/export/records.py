"""What is exported: a sampled controller, or all equations of a diagram."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..attributes import described_record
from ..native.lower import Lowered


@described_record(made_by="export_controller", eq=False)
class ExportedController:
    """A sampled controller as code."""

    name: str  # In front of all its names in C.
    dt: float  # Sampling time and time of the first sample (s).
    offset: float
    # Labels, in the order of their arrays; the states include the outputs that blocks hold.
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    # Every number of them by its name, in the order of their array.
    parameters: Mapping[str, float]
    initial_state: np.ndarray  # (states,)
    takes_time: bool  # Whether its equations read the time, which ``step`` takes then.
    lowered: Lowered  # The plan that all code is written from.
    sampled_states: tuple[int, ...]  # Which states a sample makes, in the order in which it does.
    digest: str  # A key of all this: the same for the same program and numbers.


@described_record(made_by="export_equations", eq=False)
class ExportedEquations:
    """The equations of a diagram as code, for an integrator of one's own."""

    name: str  # In front of all its names in C.
    inputs: tuple[str, ...]  # Labels, in the order of their arrays.
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    # States that jump after each accepted step, to what ``rates`` writes to `m`.
    memory: tuple[str, ...]
    conditions: int  # Numbers in `g`: where one changes its sign, steps should end.
    # Every number of them by its name, in the order of their array.
    parameters: Mapping[str, float]
    initial_state: np.ndarray  # (states,)
    lowered: Lowered  # The plan that the code is written from.
    digest: str  # A key of all this: the same for the same program and numbers.
