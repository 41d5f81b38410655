"""Of what derivatives are taken, and by what: names that are looked up in a diagram."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..blocks import Block, supplied_of
from ..delays.transport import PAST
from ..diagrams import state_names
from ..errors import CompileError, ParameterError
from ..names import base_name, find_name, in_one_spelling, unknown
from ..native import Compiled
from ..native.diagram.nodes import Node
from ..native.diagram.wiring import Signal as Output
from ..native.floats import float_parameters
from ..native.jacobians import check_enters_alone
from ..params import declared_params

_AT_START = "(0)"
_WHOLE = {"i": "an integer", "b": "True or False"}


@dataclass(frozen=True, kw_only=True)
class Observed:
    """What is differentiated: a combination of outputs of blocks, or a state."""

    name: str
    combination: Any = None
    state: int = -1


@dataclass(frozen=True, kw_only=True)
class VariedQuantity:
    """By what is differentiated: a parameter by its place, or the initial value of a state.

    Its block takes a parameter between `lowest` and `highest`.
    """

    name: str
    place: int = -1
    state: int = -1
    lowest: float = -np.inf
    highest: float = np.inf


def observed_signals(compiled: Compiled, names: Sequence[str] | str | None) -> list[Observed]:
    """Return signals by their names; None for the outputs of the diagram."""
    system, read = compiled.system, compiled.schedule
    outputs: list[str] = list(system.output_labels or [])
    signals = {
        f"{node.path}.{label}": Observed(name="", combination={Output(i, k): 1.0})
        for i, node in enumerate(read.nodes)
        for k, label in enumerate(node.system.output_labels or [])
    }
    signals |= {name: Observed(name="", state=i) for i, name in enumerate(state_names(system))}
    signals |= {
        name: Observed(name="", combination=combination)
        for name, combination in zip(outputs, read.outputs, strict=False)
    }
    asked_for = checked_names("of", outputs if names is None else names)
    full = [name if name in signals else find_name("signal", name, signals) for name in asked_for]
    return [
        Observed(name=name, combination=signals[k].combination, state=signals[k].state)
        for name, k in zip(asked_for, full, strict=True)
    ]


def varied_quantities(compiled: Compiled, names: Sequence[str]) -> list[VariedQuantity]:
    """Return parameters and initial states by their names."""
    states = {name: i for i, name in enumerate(state_names(compiled.system))}
    parameters = float_parameters(compiled)
    quantities = []
    for name in names:
        if name.endswith(_AT_START):
            state = find_name("state", name.removesuffix(_AT_START), states)
            quantities.append(VariedQuantity(name=name, state=states[state]))
            continue
        if name not in parameters and name in states:
            raise unknown("parameter", name, [*parameters, f"{name}{_AT_START}"])
        _check_float(compiled, name)
        full = find_name("parameter", in_one_spelling(name), parameters)
        place, owner = parameters[full]
        _check_moves(compiled, owner, full)
        check_enters_alone(owner, full)
        lowest, highest = declared_bounds(owner, full)
        quantities.append(VariedQuantity(name=name, place=place, lowest=lowest, highest=highest))
    return quantities


def parameters_and_states(given: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the parameters of some quantities, and the initial states."""
    states = {n.removesuffix(_AT_START): v for n, v in given.items() if n.endswith(_AT_START)}
    return {n: v for n, v in given.items() if not n.endswith(_AT_START)}, states


def _check_float(compiled: Compiled, name: str) -> None:
    """Refuse an integer of our blocks, and what is true or false."""
    for slot in (s for slots in compiled.program.layout.values() for s in slots.values()):
        if slot.name == name and slot.kind != "f":
            raise ParameterError(
                f"'{name}' is {_WHOLE[slot.kind]} in '{compiled.system.name}': what does not "
                "change by a little has no derivative; take runs with other values"
            )


def _check_moves(compiled: Compiled, owner: Node, name: str) -> None:
    """Refuse what says when samples are taken, and what arrives when."""
    key = name.rpartition(".")[2]
    if any(owner is node for node in compiled.schedule.samplings):
        raise CompileError(
            f"'{name}' says when samples are taken, or what a converter keeps of them: derivatives "
            "by these are not known; take differences of runs"
        )
    if supplied_of(owner.system) is PAST and key == "delay":
        _check_delays(compiled, name)


def _check_delays(compiled: Compiled, name: str) -> None:
    """Refuse a delay where rates of what is delayed are not known, or when that jumps."""
    read = compiled.schedule
    specs = [read.nodes[line.block or 0].system.current_spec for line in read.lines]
    lacks = {
        "a delay that varies": any(spec.varying is not None for spec in specs),
        "a history": any(spec.history is not None for spec in specs),
        "sampled blocks": bool(compiled.program.sampled),
    }
    for lack in (what for what, there in lacks.items() if there):
        raise CompileError(
            f"'{name}' is a delay: derivatives by it are not known in a diagram with {lack}; take "
            "differences of runs"
        )


def declared_bounds(owner: Node, name: str) -> tuple[float, float]:
    """Return between what a block declares that a parameter lies."""
    if not isinstance(owner.system, Block):
        return -np.inf, np.inf
    field = base_name(name.removeprefix(f"{owner.path}."))
    declared = declared_params(owner.system.spec).get(field)
    if declared is None:
        return -np.inf, np.inf
    (low, _), (high, _) = declared.ends
    return low, high


def checked_names(what: str, names: object) -> list[str]:
    """Return some names as a list; one may stand alone."""
    names = [names] if isinstance(names, str) else names
    if not isinstance(names, list | tuple) or not all(isinstance(n, str) for n in names):
        raise ParameterError(f"{what} needs a list of names, got {names!r}")
    if not names:
        raise ParameterError(f"{what} needs at least one name")
    for name in names:
        if list(names).count(name) > 1:
            raise ParameterError(f"{what} has '{name}' twice")
    return list(names)


@dataclass(frozen=True, kw_only=True)
class StatePlaces:
    """States of a program with derivatives, one group behind the other."""

    states: int  # of the diagram; their derivatives follow, those by one quantity together
    by: int  # number of quantities
    branches: int = 0  # number of sides of jumps that are kept
    lines: int = 0  # number of delayed signals whose jumps come back
    turns: bool = False  # whether memories behind these reverse
    driven: int = 0  # number of memories that are driven
    samples: int = 0  # number of samples that drive memories, and of their derivatives
    delays: tuple[list[bool], ...] = ()  # by quantity: whether it is the delay of each of these

    def derivative(self, j: int) -> int:
        """Return where the derivatives by quantity `j` begin."""
        return self.states * (1 + j)

    # where the sides begin that are kept
    kept = property(lambda self: self.states * (1 + self.by))
    # when two conditions were first met at one instant, by each quantity with other derivatives
    together = property(lambda self: self.kept + self.branches)
    # when a condition was first met at a rate of 0
    grazing = property(lambda self: self.together + self.by)
    # when something first jumped at a time that moves
    jumped = property(lambda self: self.grazing + 1)
    # when a block last jumped, at a guard or a clock
    last = property(lambda self: self.grazing + 2)
    # when a guard and a condition were first met at one instant, by each quantity
    at_reset = property(lambda self: self.grazing + 3)
    # of either sign, the other behind each reset
    parity = property(lambda self: self.at_reset + self.by)
    # when each memory that is driven was first touched at its end, or hardly moved
    touched = property(lambda self: self.parity + 1)
    # when it first reversed at two corners at once
    cornered = property(lambda self: self.touched + self.driven)
    # where it stood before it was moved
    stood = property(lambda self: self.cornered + self.driven)
    # when it last reversed
    turned = property(lambda self: self.stood + self.driven)
    # number of jumps that were sent through each delay
    number = property(lambda self: self.turned + self.driven)
    # how far each delayed signal has jumped last
    height = property(lambda self: self.number + self.lines)
    # how the time of that moves, by each quantity
    moved = property(lambda self: self.height + self.lines)
    # the derivatives of all delayed signals right before that, at a time that moves
    brought = property(lambda self: self.moved + self.by)
    # how many of these jumps have left each line
    arrived = property(
        lambda self: self.brought + self.turns * self.by * self.lines if self.lines else self.number
    )
    # when each quantity first moved a kink or jump that a sample was right at
    chosen = property(lambda self: self.arrived + self.lines)
    # when a clock last ticked, and the samples before that, with their derivatives
    ticked = property(lambda self: self.chosen + self.by)
    earlier = property(lambda self: self.ticked + (self.samples > 0))
    size = property(lambda self: self.earlier + self.samples)  # number of all states
