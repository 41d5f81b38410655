"""The variables of a model: names, units, meanings, bounds, and their value references."""

import re
from collections.abc import Collection
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import control as ct
import numpy as np

from ...diagrams import state_names
from ...diagrams.parameters import declared_rules
from ...native import Compiled
from ...native.diagram.program import Program
from ...native.lower import Lowered
from ...params import Param
from ..words import parameter_places


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


_KINDS = ("states", "rates", "inputs", "outputs", "indicators", "parameters", "nothing")
STRUCTURED = re.compile(
    r"[A-Za-z_]\w*(\[\d+(,\d+)*\])?(\.[A-Za-z_]\w*(\[\d+(,\d+)*\])?)*", re.ASCII
)


def value_references(
    states: int, inputs: int, outputs: int, indicators: int, count: int
) -> dict[str, int]:
    """Return the first value reference of each kind; 0 is the time."""
    sizes = (states, states, inputs, outputs, indicators, count)
    return dict(zip(_KINDS, accumulate(sizes, initial=1), strict=True))


def is_structured(variables: Collection[Variable]) -> bool:
    """Whether names follow FMI's structured convention."""
    return all(
        STRUCTURED.fullmatch(v.name.removeprefix("der(").removesuffix(")")) for v in variables
    )


def all_variables(
    compiled: Compiled,
    diagram: ct.InterconnectedSystem,
    at: dict[str, int],
    p: np.ndarray,
    start: np.ndarray,
    fixed: Collection[int],
) -> list[Variable]:
    """Return all variables; parameters at the places `fixed` are constants."""
    before = [
        Variable(name="time", reference=0, causality="independent", variability="continuous",
                 unit="s", meaning="time"),
        *_states_and_rates(compiled.program, state_names(diagram), at, start),
    ]  # fmt: skip
    parameters = _parameters(compiled, diagram, at["parameters"], p, fixed)
    indicators = [
        Variable(
            name=f"event_indicator_{i}", reference=at["indicators"] + i, causality="local",
            variability="continuous", initial="calculated", meaning="changes its sign at an event",
        )
        for i in range(at["parameters"] - at["indicators"])
    ]  # fmt: skip
    known = {v.name for v in [*before, *parameters, *indicators]}
    signals = _signals(diagram, at, known)
    return [*before, *signals, *indicators, *parameters]


def _states_and_rates(
    program: Program, names: list[str], at: dict[str, int], start: np.ndarray
) -> list[Variable]:
    still = {*program.memory, *program.sampled}
    jump = {i for _, begin, end in program.jumping for i in range(begin, end)} - still
    states = [
        Variable(
            name=name, reference=at["states"] + i, causality="local", initial="exact",
            variability="discrete" if i in still else "continuous", start=float(start[i]),
            meaning="state of a computer or memory" if i in still else "state", reinit=i in jump,
        )
        for i, name in enumerate(names)
    ]  # fmt: skip
    rates = [
        Variable(
            name=f"der({v.name})", reference=v.reference - at["states"] + at["rates"],
            causality="local", variability="continuous", initial="calculated",
            meaning=f"rate of {v.name}", derivative_of=v.reference,
        )
        for i, v in enumerate(states) if i not in still
    ]  # fmt: skip
    return [*states, *rates]


def _signals(diagram: object, at: dict[str, int], known: set[str]) -> list[Variable]:
    """Return inputs and outputs; one whose name is taken gets a path in front of it."""
    signals = []
    for kind in ("inputs", "outputs"):
        for i, label in enumerate(getattr(diagram, f"{kind[:-1]}_labels") or ()):
            name = label if label not in known else f"{kind}.{label}"
            known.add(name)
            is_input = kind == "inputs"
            signals.append(
                Variable(
                    name=name, reference=at[kind] + i, causality=kind[:-1],
                    variability="continuous", meaning=f"{kind[:-1]} of the diagram",
                    initial="" if is_input else "calculated", start=0.0 if is_input else None,
                )
            )  # fmt: skip
    return signals


def _parameters(
    compiled: Compiled, diagram: Any, first: int, p: np.ndarray, fixed: Collection[int]
) -> list[Variable]:
    """Return every number of the parameter vector, with what its record says of it."""
    rules, parameters = declared_rules(diagram), []
    for slot, index, place in parameter_places(compiled):
        rule, may_change = rules.get(slot.name), place not in fixed
        parameters.append(Variable(
            name=slot.name + (f"[{','.join(map(str, index))}]" if index else ""),
            reference=first + place, initial="exact", start=float(p[place]),
            causality="parameter" if may_change else "local",
            variability="tunable" if may_change else "constant",
            unit="" if rule is None else rule.unit, meaning="" if rule is None else rule.meaning,
            bounds=_bounds(rule, may_change),
        ))  # fmt: skip
    return parameters


def _bounds(rule: Param | None, may_change: bool) -> Bounds:
    if rule is None:
        return Bounds(may_change=may_change)
    (low, open_below), (high, open_above) = rule.ends
    return Bounds(
        low=low, open_below=open_below, high=high, open_above=open_above, may_change=may_change
    )
