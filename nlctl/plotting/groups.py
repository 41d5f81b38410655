"""Which signals of a run are drawn together: those of one kind, and others by their block.

Of one kind are signals that are equal but for their sign, those of which one is the sum or the
difference of two others, and what goes into an actuator with what comes out of it.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import control as ct
import numpy as np

from ..blocks import Block, memory_states, within

_MOST = 4  # signals in one row: as many as there are line styles
_COMPARED = 40  # signals of which sums are looked for: their pairs are
_SAMPLES = 64
_CLOSE = 1e-9  # of the largest value: sums are rounded


@dataclass(frozen=True, kw_only=True)
class Wires:
    """Where the outputs of a diagram come from."""

    # by output, the block of the diagram whose signal it is
    blocks: Mapping[str, str] = field(default_factory=dict)
    # what goes into an actuator, and what comes out of it, where both are outputs
    pairs: tuple[tuple[str, str], ...] = ()


def wires_of(system: object) -> Wires:
    """Return where the outputs of a diagram come from; of a block there is nothing to say."""
    if not isinstance(system, ct.InterconnectedSystem):
        return Wires()
    offsets = np.cumsum([0, *(part.noutputs or 0 for part in system.syslist)])
    shown: dict[int, str] = {}  # by number among the outputs of all blocks
    for label, row in zip(system.output_labels, np.asarray(system.output_map), strict=True):
        wires = np.flatnonzero(row)
        if wires.size == 1 and wires[0] < offsets[-1]:
            shown.setdefault(int(wires[0]), label)
    owner = np.repeat(np.arange(len(system.syslist)), np.diff(offsets))
    blocks = {label: system.syslist[owner[k]].name for k, label in shown.items()}
    return Wires(blocks=blocks, pairs=tuple(_pairs(system, offsets, shown)))


def _pairs(
    system: ct.InterconnectedSystem, offsets: np.ndarray, shown: Mapping[int, str]
) -> Iterator[tuple[str, str]]:
    first = 0
    for part, begin in zip(system.syslist, offsets, strict=False):
        fed = (
            np.flatnonzero(np.asarray(system.connect_map)[first : first + 1])
            if part.ninputs
            else ()
        )
        if _is_actuator(part) and len(fed) == 1 and fed[0] in shown and begin in shown:
            yield shown[int(fed[0])], shown[int(begin)]
        first += part.ninputs or 0


def _is_actuator(part: ct.NonlinearIOSystem) -> bool:
    """Whether a block has one input and one output, in one unit as far as one can know."""
    # That is a block from u to v, and a function without states that is not linear.
    if (part.ninputs, part.noutputs) != (1, 1) or isinstance(part, ct.StateSpace):
        return False
    inner = within(part)
    if isinstance(inner, Block):
        spec = inner.spec
        from_u_to_v = (tuple(spec.inputs), tuple(spec.outputs)) == (("u",), ("v",))
        return from_u_to_v or set(spec.states) == set(memory_states(spec))
    return not part.nstates or (part.input_labels, part.output_labels) == (["u"], ["v"])


def groups_of(signals: Mapping[str, np.ndarray], wires: Wires) -> dict[str, list[str]]:
    """Return rows of at most four names, in the order of their first signals, by their titles."""
    # A row is called after its block, or after its signals where these are of one kind.
    kind = {name: name for name in signals}

    def join(names: Sequence[str]) -> None:
        first, merged = kind[names[0]], {kind[name] for name in names}
        kind.update({name: first for name, old in kind.items() if old in merged})

    for names in (*_sums(signals, wires), *(p for p in wires.pairs if set(p) <= set(signals))):
        join(names)
    sizes = {key: list(kind.values()).count(key) for key in kind.values()}
    rows: dict[tuple[bool, str], list[str]] = {}
    for name, key in kind.items():
        alone = sizes[key] == 1
        rows.setdefault((alone, wires.blocks.get(name, "") if alone else key), []).append(name)
    groups: dict[str, list[str]] = {}
    for (alone, key), names in rows.items():
        for k in range(0, len(names), _MOST):
            part = names[k : k + _MOST]
            title = key if alone and key else ", ".join(part)
            groups[title if title not in groups else f"{title} ({k // _MOST + 1})"] = part
    return groups


def _sums(signals: Mapping[str, np.ndarray], wires: Wires) -> Iterator[list[str]]:
    """Yield names of signals that are equal but for their sign, or sum and summands."""
    # Of what is constant only an input may be one, a reference after a step: others may be
    # equal by chance.
    first = next(iter(signals.values()), np.zeros(1))
    at = np.unique(np.linspace(0, first.size - 1, _SAMPLES).astype(int))
    given = {n: y[at] for n, y in signals.items() if np.all(np.isfinite(y)) and np.any(y[at])}
    moving = [name for name, y in given.items() if np.ptp(y) > 0]
    given = {n: y for n, y in given.items() if n in moving or n not in wires.blocks}
    if len(given) > _COMPARED:
        return
    yield from (list(two) for two in combinations(moving, 2) if _is_sum(given, two[0], two[1:]))
    for two in combinations(moving, 2):
        for name in given:
            if name not in two and _is_sum(given, name, two):
                yield [name, *two]


def _is_sum(signals: Mapping[str, np.ndarray], name: str, parts: Sequence[str]) -> bool:
    """Whether a signal is the sum of others, each with either sign."""
    y, first = signals[name], signals[parts[0]]
    rest = signals[parts[1]] if len(parts) > 1 else np.zeros_like(y)
    scale = max(np.abs(part).max() for part in (y, first, rest))
    sums = (first + rest, first - rest)
    return any(np.abs(y - sign * s).max() <= _CLOSE * scale for s in sums for sign in (1, -1))
