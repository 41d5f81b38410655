"""What an FMU is made of: variables, what happens at events, the plan of its equations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...native.lower import Lowered


@dataclass(frozen=True, kw_only=True)
class Bounds:
    """What a parameter may be."""

    low: float = -np.inf  # the bounds, infinite where there are none
    high: float = np.inf
    open_below: bool = False  # whether they cannot be attained
    open_above: bool = False
    # whether an importer may set it: not where the program holds for this value alone
    may_change: bool = True


@dataclass(frozen=True, kw_only=True)
class Variable:
    """One variable of a model description."""

    name: str
    reference: int  # value reference
    causality: str  # as FMI has them; `initial` is empty where it has none
    variability: str
    initial: str = ""
    start: float | None = None
    unit: str = ""
    meaning: str = ""
    bounds: Bounds = Bounds()
    derivative_of: int | None = None  # value reference of the state whose rate it is
    reinit: bool = False  # whether an event may make the state jump


@dataclass(frozen=True, kw_only=True)
class Happenings:
    """When something happens in a model, and which states jump then."""

    # instants of samples: begin, step and scale of (begin + k step) / scale
    series: tuple[tuple[int, int, int], ...]
    meetings: tuple[int, ...]  # of each function of samples which series it is for, as bits
    # until when conditions of t alone are as they were, and when they have switched (s)
    breaks: tuple[tuple[float, float], ...]
    known_until: float  # how long these are known (s)
    longest: float  # longest step that meets all that functions of t alone do (s)


@dataclass(frozen=True, kw_only=True, eq=False)
class Model:
    """A diagram as a model of FMI."""

    name: str  # its model identifier
    meaning: str  # what the diagram is called
    # time, states, rates, inputs, outputs, event indicators and parameters
    variables: tuple[Variable, ...]
    places: dict[str, int]  # first value reference of each of these kinds
    continuous: tuple[int, ...]  # places of states
    memory: tuple[int, ...]
    sampled: tuple[int, ...]
    declared: int  # number of switching functions that blocks declare, the first of what switches
    guards: tuple[int, ...]  # of each guard the block that it belongs to
    # of each block with guards its number, and where its states begin and end
    jumping: tuple[tuple[int, int, int], ...]
    parameters: np.ndarray  # values of parameters and states
    start: np.ndarray
    happenings: Happenings
    lowered: Lowered  # the plan that the code is written from
    tolerance: float  # of its default experiment
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
