"""What is exported: a sampled controller, or all equations of a diagram."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..native.lower import Lowered


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedController:
    """A sampled controller as code.

    Attributes
    ----------
    name : str
        In front of all its names in C.
    dt, offset : float
        Sampling time and time of the first sample (s).
    inputs, outputs, states : tuple of str
        Labels, in the order of their arrays; the states include the outputs that blocks hold.
    parameters : mapping of str to float
        Every number of them by its name, in the order of their array.
    initial_state : ndarray of shape (states,)
    takes_time : bool
        Whether its equations read the time, which ``step`` takes then.
    lowered : Lowered
        The plan that all code is written from.
    sampled_states : tuple of int
        Which states a sample makes, in the order in which it does.
    digest : str
        A key of all this: the same for the same program and numbers.

    Examples
    --------
    See `export_controller`.
    """

    name: str
    dt: float
    offset: float
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    parameters: Mapping[str, float]
    initial_state: np.ndarray
    takes_time: bool
    lowered: Lowered
    sampled_states: tuple[int, ...]
    digest: str


@dataclass(frozen=True, kw_only=True, eq=False)
class ExportedEquations:
    """The equations of a diagram as code, for an integrator of one's own.

    Attributes
    ----------
    name : str
        In front of all its names in C.
    inputs, outputs, states : tuple of str
        Labels, in the order of their arrays.
    memory : tuple of str
        States that jump after each accepted step, to what ``rates`` writes to `m`.
    conditions : int
        Numbers in `g`: where one changes its sign, steps should end.
    parameters : mapping of str to float
        Every number of them by its name, in the order of their array.
    initial_state : ndarray of shape (states,)
    lowered : Lowered
        The plan that the code is written from.
    digest : str
        A key of all this: the same for the same program and numbers.

    Examples
    --------
    See `export_equations`.
    """

    name: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    states: tuple[str, ...]
    memory: tuple[str, ...]
    conditions: int
    parameters: Mapping[str, float]
    initial_state: np.ndarray
    lowered: Lowered
    digest: str
