"""What an FMU is made of: variables, what happens at events, the plan of its equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native.lower import Lowered


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """What a parameter may be.

    Attributes
    ----------
    low, high : float
        The bounds, infinite where there are none.
    open_below, open_above : bool
        Whether they cannot be attained.
    may_change : bool
        Whether an importer may set it: not where the program holds for this value alone.
    """

    low: float = -np.inf
    high: float = np.inf
    open_below: bool = False
    open_above: bool = False
    may_change: bool = True


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable of a model description.

    Attributes
    ----------
    name, unit, meaning : str
    reference : int
        Value reference.
    causality, variability, initial : str
        As FMI has them; `initial` is empty where it has none.
    start : float or None
    bounds : Bounds
    derivative_of : int or None
        Value reference of the state whose rate it is.
    reinit : bool
        Whether an event may make the state jump.
    """

    name: str
    reference: int
    causality: str
    variability: str
    initial: str = ""
    start: float | None = None
    unit: str = ""
    meaning: str = ""
    bounds: Bounds = Bounds()
    derivative_of: int | None = None
    reinit: bool = False


@dataclass(frozen=True, kw_only=True)
class Happenings:
    """When something happens in a model, and which states jump then.

    Attributes
    ----------
    series : tuple of tuple of int
        Instants of samples: begin, step and scale of (begin + k step) / scale.
    meetings : tuple of int
        Of each function of samples which series it is for, as bits.
    breaks : tuple of float
        When conditions of t alone switch (s).
    known_until : float
        How long these are known (s).
    longest : float
        Longest step that meets all that functions of t alone do (s).
    """

    series: tuple[tuple[int, int, int], ...]
    meetings: tuple[int, ...]
    breaks: tuple[float, ...]
    known_until: float
    longest: float


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """A diagram as a model of FMI.

    Attributes
    ----------
    name : str
        Its model identifier.
    meaning : str
        What the diagram is called.
    variables : tuple of Variable
        Time, states, rates, inputs, outputs, event indicators and parameters.
    places : dict
        First value reference of each of these kinds.
    continuous, memory, sampled : tuple of int
        Places of states.
    declared : int
        Number of switching functions that blocks declare, the first of what switches.
    guards : tuple of int
        Of each guard the block that it belongs to.
    jumping : tuple of tuple
        Of each block with guards its number, and where its states begin and end.
    parameters, start : ndarray
        Values of parameters and states.
    happenings : Happenings
    lowered : Lowered
        The plan that the code is written from.
    tolerance, stop_time : float
        Of its default experiment.
    """

    name: str
    meaning: str
    variables: tuple[Variable, ...]
    places: dict[str, int]
    continuous: tuple[int, ...]
    memory: tuple[int, ...]
    sampled: tuple[int, ...]
    declared: int
    guards: tuple[int, ...]
    jumping: tuple[tuple[int, int, int], ...]
    parameters: np.ndarray
    start: np.ndarray
    happenings: Happenings
    lowered: Lowered
    tolerance: float
    stop_time: float

    @property
    def indicators(self) -> int:
        """Number of event indicators: what switches, and whether memories reverse."""
        return self.lowered.rows["g"] + len(self.memory)

    def of(self, kind: str) -> list[Variable]:
        """Return the variables of a kind, a key of `places`."""
        kinds = list(self.places)
        k = kinds.index(kind)
        end = self.places[kinds[k + 1]] if k + 1 < len(kinds) else np.inf
        return [v for v in self.variables if self.places[kind] <= v.reference < end]
