"""What blocks say of jumps, in python-control: switching functions, guards, memories, resets.

Machine code computes the same in its arrays ``g``, ``m`` and ``reset``.  What it locates beyond
that are conditions of the very expressions whose rates are compared.
"""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..blocks import equation_now, supplied_of
from ..sliding.relay import SLIDING
from ..upstream.control_internals import parts_now
from ..upstream.systems import System
from ..wording import numbered
from .diagram.nodes import Node
from .diagram.program import Program, count_guards, count_switching_functions, memory
from .diagram.schedule import Schedule

_DECLARED = {  # the functions of a block, and how many values of each are compared
    "switching": count_switching_functions,
    "guard": count_guards,
    "commit": lambda node: len(memory(node)),
}


def declared_rows(schedule: Schedule, program: Program, located: int) -> np.ndarray:
    """Return which rows of ``g`` and ``m`` blocks and event functions compute."""
    # The others, of the `located` ones, are conditions of expressions.
    # What an ideal relay declares is of its input's rate too, and is compared as it slides.
    signed = [_is_own(n) for n in schedule.nodes for _ in range(count_switching_functions(n))]
    kept = [_is_own(node) for node in schedule.nodes for _ in memory(node)]
    unknown = located - len(schedule.watched)
    others = len(schedule.watched) + len(program.guards)
    return np.flatnonzero([*signed, *[False] * unknown, *[True] * others, *kept])


def _is_own(node: Node) -> bool:
    """Whether a block's jumps follow from its input alone, and not from the input's rate."""
    return supplied_of(node.system) is not SLIDING


def declared_labels(schedule: Schedule) -> tuple[list[str], list[str]]:
    """Return names of the rows of `declared_now`."""
    labels: dict[str, list[str]] = {equation: [] for equation in _DECLARED}
    for (equation, count), node in _each(schedule.nodes):
        labels[equation] += [f"{node.path}: {name}" for name in numbered(equation, count)]
    guarded = [node for node in schedule.nodes if count_guards(node)]
    states = [f"{n.path}: reset of '{name}'" for n in guarded for name in n.system.state_labels]
    watched = [each.name for each in schedule.watched]
    return [*labels["switching"], *watched, *labels["guard"], *labels["commit"]], states


def declared_now(
    schedule: Schedule, system: System, point: tuple[Any, Any, Any]
) -> tuple[np.ndarray, np.ndarray]:
    """Return switching functions, watched ones, guards and commits, and what resets return."""
    t, x, u = point
    parts = dict(zip(map(id, schedule.nodes), parts_now(system, t, x, u), strict=True))

    def value(equation: str, node: Node) -> np.ndarray:
        block, states, inputs = parts[id(node)]
        return equation_now(block, equation, t, states, inputs)

    computed: dict[str, list[np.ndarray]] = {equation: [] for equation in _DECLARED}
    for (equation, _), node in _each(schedule.nodes):
        computed[equation].append(value(equation, node))
    resets = [value("reset", node) for node in schedule.nodes if count_guards(node)]
    memories = [place for node in schedule.nodes if _is_own(node) for place in memory(node)]
    now = np.array(x, dtype=float)
    now[memories] = np.concatenate([np.zeros(0), *computed["commit"]])
    watched = [[one.value(t, now, u, dict(schedule.overrides))] for one in schedule.watched]
    rows = [*computed["switching"], *watched, *computed["guard"], *computed["commit"]]
    return np.concatenate([np.zeros(0), *rows]), np.concatenate([np.zeros(0), *resets])


def without_nan(*rows: np.ndarray) -> list[np.ndarray]:
    """Return rows in which what is NaN agrees with itself: a guard or a reset may be, elsewhere."""
    return [np.where(np.isnan(row), np.inf, row) for row in rows]


def _each(nodes: Sequence[Node]) -> Iterator[tuple[tuple[str, int], Node]]:
    """Yield what each block declares: the function's name and its number of values."""
    for node in nodes:
        for what, count in _DECLARED.items():
            if count(node) and _is_own(node):
                yield (what, count(node)), node
