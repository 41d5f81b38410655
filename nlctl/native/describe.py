"""A compiled diagram in words."""

from collections.abc import Iterable, Iterator, Sequence

import control as ct
import numpy as np

from ..blocks import Block
from ..expressions.iterated import WRITTEN_PASSES
from ..upstream.systems import System
from ..wording import counted
from .diagram.nodes import Node
from .diagram.parameters import Slot
from .diagram.program import Program, count_guards, count_switching_functions, memory
from .diagram.schedule import Schedule, signal_name
from .jacobians import inexact
from .machine.evaluations import Machine
from .reading import Reading

USE = (
    "nlctl.input_output_response, nlctl.ensemble_response, .linearize(x0, u0); "
    "python-control's other functions take .system"
)
SLOW = "called back in Python, no faster than python-control until that is written otherwise"
_SHOWN = 8  # names that are listed before the rest is only counted


def described(reading: Reading) -> str:
    """Return what was compiled, block by block in the order of evaluation."""
    schedule, program, p = reading.schedule, reading.program, reading.parameter_vector()
    system, nodes = schedule.system, schedule.nodes
    lines = [
        f"Compiled '{system.name}', {_timebase(system)}: {counted(len(nodes), 'block')}, "
        f"{counted(system.ninputs or 0, 'input')}, {counted(system.nstates or 0, 'state')}, "
        f"{counted(system.noutputs or 0, 'output')}",
        f"  order        {' -> '.join(nodes[i].path for i in schedule.order)}",
        f"  run it by    {USE}",
    ]
    if ct.isctime(system) and system.nstates:
        why = inexact(reading.equations)
        how = "exact" if why is None else f"exact, with differences where {why}"
        lines.append(f"  Jacobian     {how}")
    lines += [f"  conditions   {line}" for line in _conditions(reading)]
    for loop in schedule.loops:
        torn = ", ".join(signal_name(nodes, s) for s in loop.torn)
        lines.append(f"  solved for   {torn}")
    lines += [f"  unchanged    {line}" for line in called(reading)]
    lines += [
        f"  passes       at most {WRITTEN_PASSES} of each loop are written out; "
        f"a run that takes more calls the {name}"
        for name in described_functions(schedule, reading.equations.cut)
    ]
    for i in dict.fromkeys(schedule.order):
        lines += [f"  {nodes[i].path}: {_kind(nodes[i])}"]
        lines += [
            f"    {name:<12} {text}" for name, text in _facts(i, nodes[i], program, p) if text
        ]
        own = [each for each in reading.equations.conditions.located if each.block == nodes[i].path]
        if own:
            lines.append(f"    {'conditions':<12} {sum(each.counted for each in own)}")
    return "\n".join(lines)


def called(reading: Reading) -> Iterator[str]:
    """Yield which functions are called unchanged, how, and why: a line each."""
    # Which of the two ways it is, is known as soon as machine code has been made.
    made = reading.cache.of(Machine)
    back = {name for each in made for name in each.called_back}
    for name, call in reading.equations.calls.items():
        how = f", {SLOW if name in back else 'in machine code of numba'}" if made else ""
        yield f"{call.kind} of block '{call.block}'{how}: {call.why}"


def described_functions(schedule: Schedule, cut: Iterable[tuple[int, str]]) -> tuple[str, ...]:
    """Return in words functions that are known by their blocks' places and by their kinds."""
    return tuple(f"{kind} function of block '{schedule.nodes[i].path}'" for i, kind in sorted(cut))


def _conditions(reading: Reading) -> Iterator[str]:
    """Yield how many conditions of the equations are located, and what may hide others."""
    found = reading.equations.conditions
    parts = [f"{found.count} located"] if found.rows else []
    parts += [f"{len(found.of_time)} of t alone, solved before a run"] if found.of_time else []
    parts += [f"{found.beyond} too many to be located"] if found.beyond else []
    parts += [f"{found.shown} of outputs alone, not located"] if found.shown else []
    if parts:
        yield ", ".join(parts)
    if reading.equations.calls:
        yield "none known of functions that are called unchanged: steps may pass over theirs"


def _timebase(system: System) -> str:
    if ct.isctime(system):
        return "continuous time"
    return "discrete time" if system.dt is True else f"discrete time, dt = {system.dt:g} s"


def _kind(node: Node) -> str:
    spec = node.system.spec if isinstance(node.system, Block) else node.system
    text = "feedthrough" if node.direct.any() else "no feedthrough"
    if node.direct.any() and not node.direct.all():
        text = "feedthrough from some inputs to some outputs"
    return f"{type(spec).__name__}, {text}"


def _facts(i: int, node: Node, program: Program, p: np.ndarray) -> Iterator[tuple[str, str]]:
    labels, first = node.system.state_labels, node.state_offset
    yield "states", _listed(labels)
    parameters = [f"{name} = {_value(slot, p)}" for name, slot in program.layout[i].items()]
    parameters += [f"{k} = {value!r} (fixed)" for k, value in program.fixed.get(i, {}).items()]
    yield "parameters", _listed(parameters)
    yield "switching functions", str(count_switching_functions(node) or "")
    yield "guards", str(count_guards(node) or "")
    yield "memory", _listed([labels[j - first] for j in memory(node)])


def _value(slot: Slot, p: np.ndarray) -> str:
    values = p[slot.offset : slot.offset + slot.size]
    if not slot.shape:
        return f"{values[0]:g}"
    if slot.size > _SHOWN:
        return f"{' x '.join(map(str, slot.shape))} values"
    return np.array2string(values.reshape(slot.shape), separator=", ").replace("\n", "")


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _SHOWN
    return ", ".join(names if more <= 1 else [*names[:_SHOWN], f"and {more} more"])
