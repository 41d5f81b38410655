"""At which block a run chatters, and between which values."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ...accumulation import EVER_FASTER, SECOND_ORDER, accumulation_words
from ...diagrams import overridden
from ...reference.rough import ROUGH
from ...upstream.control_internals import rates_now
from ...upstream.systems import System
from ..audit import every_output
from ..compiled import Compiled
from ..diagram.program import count_switching_functions, memory
from ..diagram.wiring import block_inputs
from ..equations.relays import relay_places
from ..happened import row_labels
from .steps import Jump

_WIDER = (0.0, *(4.0**k for k in range(14)))  # in distances between neighbouring states
_JUMPS = 1e3  # change of an output over that of inputs and states, which no usual function has
_ROUNDING = 1e-9  # of a value: what is not a jump
_SMALL = 1e-300  # what is divided by where nothing else has changed


def chattering_words(
    compiled: Compiled, p: np.ndarray, params: Mapping[str, Any] | None, jump: Jump
) -> str:
    """Return which signal jumps between which values, and what to do."""
    relays = relay_places(compiled.schedule.nodes)
    if jump.crowd is not None:
        labels = row_labels(compiled, compiled.lowered.conditions)
        row = jump.crowd.row
        which = labels[row] if row < len(labels) else ("", "a condition")
        why = "and what is compared is within tolerances of 0"
        if jump.goes_on:
            return accumulation_words(which, jump.crowd, "each at another place", EVER_FASTER)
        return accumulation_words(which, jump.crowd, why)
    if jump.is_rough:
        return f"{_changed(compiled, p, params, jump)} {ROUGH}"
    if relays and _keeps_on_switching(compiled, p, jump):
        return f"{_committed(compiled, p, jump)}: its switches accumulate; {SECOND_ORDER}"
    advice = (
        "the run comes back to it with each of the shortest steps: smooth the jump over a small "
        "width, give it hysteresis, or sample the controller (nlctl.sampled)"
        + ("" if relays else "; a sign slides as a block of its own, nlctl.IdealRelay")
    )
    found = _committed(compiled, p, jump) or _changed(compiled, p, params, jump)
    return f"{found}; {advice}"


def _keeps_on_switching(compiled: Compiled, p: np.ndarray, jump: Jump) -> bool:
    """Whether what jumps is the mode of an ideal relay."""
    nodes, switched = compiled.schedule.nodes, _switched(compiled, p, jump)
    return switched is not None and any(
        switched[0] in memory(nodes[i]) for i in relay_places(nodes)
    )


def _committed(compiled: Compiled, p: np.ndarray, jump: Jump) -> str:
    """Return which memory switches, if one does and that is what jumps."""
    switched = _switched(compiled, p, jump)
    if switched is None:
        return ""
    m, before, after = switched
    node = next(node for node in compiled.schedule.nodes if m in memory(node))
    return _between(node.system.state_labels[m - node.state_offset], node.path, before, after)


def _switched(compiled: Compiled, p: np.ndarray, jump: Jump) -> tuple[int, float, float] | None:
    """Return which memory state changes most at a jump, from what to what; None if none does."""
    before, after = (_declared(compiled, p, side)[1] for side in jump.sides())
    changes = np.abs(after - before)
    if not changes.size or not changes.max() > 1e-3:
        return None
    place = int(changes.argmax())
    return compiled.program.memory[place], float(before[place]), float(after[place])


def _declared(compiled: Compiled, p: np.ndarray, side: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return switching functions, and what memories would become, on a side of a jump."""
    rhs, _ = compiled.native
    g, m = (np.zeros(compiled.lowered.rows[name]) for name in "gm")
    t, x, u = side
    rhs(t, x.copy(), u.copy(), p, np.empty(x.size), g, m)
    return g, m


def _changed(
    compiled: Compiled, p: np.ndarray, params: Mapping[str, Any] | None, jump: Jump
) -> str:
    """Return the block whose values change most for what changes at its inputs and states."""
    with np.errstate(all="ignore"):  # of a copy of the diagram, which nobody else evaluates
        system = overridden(compiled.schedule.system, params)
        for wider in _WIDER:  # it rounds otherwise than machine code
            before, after = (list(_blocks(compiled, system, p, side)) for side in jump.sides(wider))
            found = _sharpest(compiled, p, jump, before, after)
            if found:
                return found
    return "its right-hand side jumps there"


def _sharpest(compiled: Compiled, p: np.ndarray, jump: Jump, before: list, after: list) -> str:
    """Return what changes most between both sides, "" if nothing jumps."""
    sharpest, words = _JUMPS, ""
    for i, ((given, labels, values), (given_2, _, values_2)) in enumerate(
        zip(before, after, strict=True)
    ):
        if not values.size:
            continue
        change = np.abs(values_2 - values)
        k = int(np.argmax(np.where(np.isfinite(change), change, 0.0)))
        sharp = change[k] / max(float(np.abs(given_2 - given).max(initial=0.0)), _SMALL)
        if change[k] > _ROUNDING * abs(values[k]) and sharp > sharpest:
            node = compiled.schedule.nodes[i]
            words = _between(labels[k], node.path, values[k], values_2[k])
            sharpest = float(sharp)
            words += _switching_function(compiled, i, p, jump)
    return words


def _blocks(
    compiled: Compiled, system: System, p: np.ndarray, point: Any
) -> Iterator[tuple[np.ndarray, list[str], np.ndarray]]:
    """Yield for each block what it is given, and its outputs and rates with their names."""
    t, x, u = point
    nodes = compiled.schedule.nodes
    outputs = every_output(compiled, p)(point)
    given = block_inputs(system, u[: system.ninputs or 0], outputs)
    for i, (node, (block, inputs)) in enumerate(zip(nodes, given, strict=True)):
        own = x[node.state_offset :][: block.nstates or 0]
        values, labels = [np.asarray(outputs[i], dtype=float)], list(block.output_labels)
        if block.nstates and node.sampled is None:
            values.append(np.asarray(rates_now(block, t, own, inputs), dtype=float))
            labels += [f"{label}'" for label in block.state_labels]
        yield np.concatenate([inputs, own]), labels, np.concatenate(values)


def _switching_function(compiled: Compiled, i: int, p: np.ndarray, jump: Jump) -> str:
    """Return which switching function of a block changes its sign, of a block that has several."""
    nodes = compiled.schedule.nodes
    counts = np.cumsum([0, *(count_switching_functions(node) for node in nodes)])
    sides = [_declared(compiled, p, side)[0][counts[i] :] for side in jump.sides()]
    count = int(counts[i + 1] - counts[i])
    changed = np.flatnonzero(np.sign(sides[0][:count]) != np.sign(sides[1][:count]))
    if count < 2 or not changed.size:
        return ""
    return f" where its switching function {changed[0] + 1} of {count} is 0"


def _between(label: str, block: str, one: float, other: float) -> str:
    between = f"between {one + 0.0:.6g} and {other + 0.0:.6g}"
    if f"{one:.6g}" == f"{other:.6g}":  # as in a run that diverges, where rounding is that large
        between = f"by {abs(other - one):.3g} at {one:.6g}"
    return f"'{label}' of block '{block}' jumps {between}"
