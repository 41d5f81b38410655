"""Putting faults into a diagram: a signal is cut, and goes through the block of its fault."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, Literal

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..blocks import block, memory_states
from ..diagrams import known_system, places, reconnected
from ..errors import DiagramError, ParameterError, UnknownNameError
from ..names import find_name, unknown
from ..upstream.systems import System
from .fault import Fault


@dataclass(frozen=True, kw_only=True)
class Spot:
    """Where a signal can be cut."""

    diagram: str  # path of the diagram that has the wire; empty for the outermost one
    # ``"output"`` or ``"input"`` of a part of the diagram, or ``"external"`` input of itself
    side: Literal["output", "input", "external"]
    # where it stands among all outputs or inputs of the parts, or the inputs of the diagram
    position: int
    label: str  # what the fault is called after: ``"actuator_v"``


@dataclass(frozen=True, kw_only=True)
class _Cut:
    """A fault in its place, and the output of the diagram's parts that it watches."""

    fault: Fault
    spot: Spot
    watched: Spot | None


@as_annotated
def with_faults(diagram: System, *faults: Fault) -> ct.InterconnectedSystem:
    """Return a diagram with faults on its signals; the one that was given stays as it is.

    Each signal is cut and goes through a block, whose parameters are addressed like all others:
    ``"fault_actuator_v.onset"``, ``"fault_actuator_v.duration"``, ``"fault_actuator_v.value"``;
    that of a delay is ``"fault_actuator_v_line.delay"``.
    So one diagram, compiled once, serves for an ensemble of onsets and values; an onset of
    `nlctl.faults.NEVER` is a fault that does not begin.  A fault inside of a nested diagram has
    that diagram's name in front.  Several faults on one signal stand one behind the other, in their
    order.  An output of the diagram is the signal behind the fault.

    While no fault is present the right-hand side is the same, to the bit in python-control; in
    machine code to the rounding of a product and a sum that are contracted across the cut.  A
    fault with a memory (``stuck`` without a value, or with a condition) adds memory states, which
    may change the steps and the method that are chosen, within the tolerance.

    Parameters
    ----------
    diagram : control.InterconnectedSystem or Compiled
        Nested to any depth.  A `Compiled` stands for its diagram.
    *faults : Fault
        On signals of the diagram; those on one signal in their order.

    Returns
    -------
    control.InterconnectedSystem
        States of the faults' memories come last in their diagram: start it from
        `nlctl.initial_state`.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a fault, or its condition, names a signal that is not there, or not just one.
    DiagramError
        If it is not a diagram.
    ParameterError
        If something else than a fault is given, or one that needs a memory in discrete time.

    Examples
    --------
    >>> loop = nlctl.paper.example_1()
    >>> weak = nlctl.with_faults(loop, nlctl.Fault("actuator.v", "gain", 0.5, at=10.0))
    >>> float(nlctl.parameters(weak).value["fault_actuator_v.onset"])
    10.0
    """
    system = known_system("with_faults", diagram)
    if not isinstance(system, ct.InterconnectedSystem):
        raise DiagramError(
            f"with_faults needs a diagram, got the block '{system.name}': make a diagram of it "
            "with nlctl.interconnect"
        )
    for fault in faults:
        if not isinstance(fault, Fault):
            raise ParameterError(f"with_faults needs faults, nlctl.Fault(...), got {fault!r}")
        _check_timebase(system, fault)
    spots = _spots(system)
    cuts = [_placed(system, spots, fault) for fault in faults]
    return _rebuilt(system, "", cuts)


def signal_names(diagram: System) -> list[str]:
    """Return the names of all signals that a fault can be on."""
    # External inputs first, then outputs and inputs of all blocks and nested diagrams.
    return list(_spots(known_system("signal_names", diagram)))


def _check_timebase(system: ct.InterconnectedSystem, fault: Fault) -> None:
    """Memories are committed between steps of an integrator."""
    has_memory = fault.condition is not None or memory_states(fault.effect) or fault.line
    if has_memory and not ct.isctime(system):
        what = "a condition" if fault.condition is not None else "no value"
        what = what if fault.line is None else "a history"
        raise ParameterError(
            f"Fault '{fault.kind}' on '{fault.signal}' with {what} needs a diagram in continuous "
            f"time, '{system.name}' has dt = {system.dt}: give a time, and a value"
        )


def _spots(system: ct.InterconnectedSystem) -> dict[str, Spot]:
    """Return all signals of a diagram by their qualified names."""
    spots = {
        label: Spot(diagram="", side="external", position=i, label=label)
        for i, label in enumerate(system.input_labels)
    }
    for side in ("output", "input"):
        for place in places(system):
            if place.parent is None:
                continue
            offset = getattr(place.parent.system, f"{side}_offset")[place.position]
            for i, label in enumerate(getattr(place.system, f"{side}_labels")):
                spot = Spot(
                    diagram=place.parent.path,
                    side=side,
                    position=offset + i,
                    label=_identifier(f"{place.system.name}_{label}"),
                )
                spots.setdefault(f"{place.path}.{label}", spot)
    return spots


def _identifier(text: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in text)


def _placed(system: System, spots: Mapping[str, Spot], fault: Fault) -> _Cut:
    """Find the signal of a fault, and that of its condition."""
    spot = _spot(spots, fault.signal)
    if fault.condition is None:
        return _Cut(fault=fault, spot=spot, watched=None)
    inside = f"{spot.diagram}." if spot.diagram else ""
    here = {n.removeprefix(inside): s for n, s in spots.items() if s.diagram == spot.diagram}
    readable = {n: s for n, s in here.items() if s.side != "input"}
    if inside:
        part = next(p.system for p in places(system) if p.path == spot.diagram)
        for i, label in enumerate(part.input_labels):
            readable[label] = Spot(diagram="", side="external", position=i, label=label)
    try:
        watched = _spot(readable, fault.condition.signal)
    except UnknownNameError as error:
        raise UnknownNameError(
            f"{error} (the condition of a fault sees the signals of the diagram that the fault "
            f"lies in, here '{spot.diagram or system.name}')"
        ) from None
    return _Cut(fault=fault, spot=spot, watched=watched)


def _spot(spots: Mapping[str, Spot], name: str) -> Spot:
    """Return the signal that a name means: the full path, or the end of one; outputs first."""
    for side in ("external", "output", "input"):
        of_side = {n: s for n, s in spots.items() if s.side == side}
        if name in of_side or any(n.endswith(f".{name}") for n in of_side):
            return of_side[find_name("signal", name, of_side)]
    raise unknown("signal", name, spots)


def _rebuilt(system: System, path: str, cuts: Sequence[_Cut]) -> Any:
    """Return a copy of a diagram with the faults that lie in it, blocks copied as well."""
    if not isinstance(system, ct.InterconnectedSystem):
        return copy.copy(system)
    inside = f"{path}." if path else ""
    parts = [_rebuilt(part, f"{inside}{part.name}", cuts) for part in system.syslist]
    wires, dt = _Wires(system), None if ct.isctime(system) else system.dt
    for cut in cuts:
        if cut.spot.diagram == path:
            parts += wires.through(cut, {part.name for part in parts}, dt)
    return reconnected(system, parts, wires.maps, system.dt)


class _Wires:
    """The maps of a diagram while blocks are put into its wires."""

    def __init__(self, system: ct.InterconnectedSystem) -> None:
        self.connect = system.connect_map.copy()
        self.input = system.input_map.copy()
        outputs = self.connect.shape[1]
        self.from_outputs = system.output_map[:, :outputs].copy()
        self.from_inputs = system.output_map[:, outputs:].copy()
        self.source: dict[Spot, int] = {}  # the output that a cut signal comes from now

    @property
    def maps(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """``connect_map``, ``input_map`` and ``output_map``."""
        return self.connect, self.input, np.hstack([self.from_outputs, self.from_inputs])

    def through(self, cut: _Cut, taken: set[str], dt: Any) -> list[Any]:
        """Wire a fault; return its blocks."""
        name = _free(cut.fault.name or f"fault_{cut.spot.label}", taken)
        effect = block(cut.fault.effect, name, dt=dt)
        row, column = self._add(effect)
        self._cut(replace(cut.spot, label=""), row, column)
        blocks = [effect]
        if cut.fault.line is not None:
            blocks.append(block(cut.fault.line, _free(f"{name}_line", taken)))
            before, late = self._add(blocks[-1])
            self.connect[before], self.input[before] = self.connect[row], self.input[row]
            self.connect[row + len(effect.input_labels) - 1, late] = 1.0
        if cut.watched is not None:
            blocks.append(block(cut.fault.latch, _free(f"{name}_condition", taken)))
            watch, on = self._add(blocks[-1])
            self._read(replace(cut.watched, label=""), watch)
            self.connect[row + 1, on] = self.connect[row + 2, on + 1] = 1.0
        return blocks

    def _add(self, added: Any) -> tuple[int, int]:
        """Make room for a block; return its first input and output."""
        row, column = self.connect.shape
        more_in, more_out = added.ninputs, added.noutputs
        self.connect = np.pad(self.connect, ((0, more_in), (0, more_out)))
        self.input = np.pad(self.input, ((0, more_in), (0, 0)))
        self.from_outputs = np.pad(self.from_outputs, ((0, 0), (0, more_out)))
        self.from_inputs = np.pad(self.from_inputs, ((0, 0), (0, more_in)))
        return row, column

    def _cut(self, spot: Spot, row: int, column: int) -> None:
        """Let a signal go to the input `row`, and what read it read the output `column`."""
        if spot.side == "input":
            reader = spot.position
            self.connect[row], self.input[row] = self.connect[reader], self.input[reader]
            self.connect[reader] = self.input[reader] = 0.0
            self.connect[reader, column] = 1.0
            return
        before = self.source.get(spot, spot.position if spot.side == "output" else -1)
        if before < 0:  # an external input
            self.connect[:, column] += self.input[:, spot.position]
            self.input[:, spot.position] = 0.0
            self.input[row, spot.position] = 1.0
        else:
            for wires in (self.connect, self.from_outputs):
                wires[:, column] = wires[:, before]
                wires[:, before] = 0.0
            self.connect[row, before] = 1.0
        self.source[spot] = column

    def _read(self, spot: Spot, row: int) -> None:
        """Let the input `row` read a signal as all others do, behind its faults."""
        column = self.source.get(spot, spot.position if spot.side == "output" else -1)
        if column < 0:
            self.input[row, spot.position] = 1.0
        else:
            self.connect[row, column] = 1.0


def _free(name: str, taken: set[str]) -> str:
    """Return the name, numbered where it is taken."""
    every = (name if i == 1 else f"{name}_{i}" for i in count(1))
    return next(n for n in every if n not in taken)
