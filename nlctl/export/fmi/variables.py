"""The variables of a model: names, units, meanings, bounds, and their value references."""

from __future__ import annotations

import re
from collections.abc import Collection
from itertools import accumulate
from typing import Any

import control as ct
import numpy as np

from ...diagrams import state_names
from ...diagrams.parameters import declared_rules
from ...native import Compiled
from ...native.diagram.program import Program
from ...params import Param
from ..words import parameter_places
from .records import Bounds, Variable

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
