"""A compiled diagram in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import control as ct
import numpy as np

from ._code import code
from ._emit import Program
from ._parameters import Slot
from ._schedule import Node, Schedule

SHOWN = 8  # names that are listed before the rest is only counted


def described(
    schedule: Schedule, program: Program, p: np.ndarray, inexact: str | None = None
) -> str:
    """Return what was compiled, block by block in the order of evaluation.

    Parameters
    ----------
    schedule : Schedule
    program : Program
    p : ndarray
        The parameter vector whose values are shown.
    inexact : str, optional
        Why the stiff method has no exact Jacobian.
    """
    system, nodes = schedule.system, schedule.nodes
    lines = [
        f"Compiled '{system.name}', {_timebase(system)}: {_count(len(nodes), 'block')}, "
        f"{_count(system.ninputs, 'input')}, {_count(system.nstates, 'state')}, "
        f"{_count(system.noutputs, 'output')}",
        f"  order        {' -> '.join(nodes[i].path for i in schedule.order)}",
    ]
    if ct.isctime(system) and system.nstates:
        how = "exact" if inexact is None else f"by differences, since {inexact}"
        lines.append(f"  Jacobian     {how}")
    for loop in schedule.loops:
        torn = ", ".join(
            f"{nodes[s.block or 0].path}.{nodes[s.block or 0].system.output_labels[s.index]}"
            for s in loop.torn
        )
        lines.append(f"  solved for   {torn}")
    for i in dict.fromkeys(schedule.order):
        lines += [f"  {nodes[i].path}: {_kind(nodes[i])}"]
        lines += [
            f"    {name:<12} {text}" for name, text in _facts(i, nodes[i], program, p) if text
        ]
    return "\n".join(lines)


def _timebase(system: Any) -> str:
    if ct.isctime(system):
        return "continuous time"
    return "discrete time" if system.dt is True else f"discrete time, dt = {system.dt:g} s"


def _kind(node: Node) -> str:
    spec = getattr(node.system, "spec", node.system)
    text = "feedthrough" if node.direct.any() else "no feedthrough"
    if node.direct.any() and not node.direct.all():
        text = "feedthrough from some inputs to some outputs"
    return f"{type(spec).__name__}, {text}"


def _facts(i: int, node: Node, program: Program, p: np.ndarray) -> Iterator[tuple[str, str]]:
    own = code(i, node, program.layout[i])
    labels, first = node.system.state_labels, node.state_offset
    yield "states", _listed(labels)
    parameters = [f"{name} = {_value(slot, p)}" for name, slot in program.layout[i].items()]
    parameters += [f"{k} = {value!r} (fixed)" for k, value in program.fixed.get(i, {}).items()]
    yield "parameters", _listed(parameters)
    yield "corners", str(own.corners) if own.corners else ""
    yield "memory", _listed([labels[j - first] for j in own.memory])


def _value(slot: Slot, p: np.ndarray) -> str:
    values = p[slot.offset : slot.offset + slot.size]
    if not slot.shape:
        return f"{values[0]:g}"
    if slot.size > SHOWN:
        return f"{' x '.join(map(str, slot.shape))} values"
    return np.array2string(values.reshape(slot.shape), separator=", ").replace("\n", "")


def _listed(names: Sequence[str]) -> str:
    more = len(names) - SHOWN
    return ", ".join(names if more <= 1 else [*names[:SHOWN], f"and {more} more"])


def _count(number: int | None, what: str) -> str:
    return f"{number or 0} {what}{'' if number == 1 else 's'}"
