"""What Python puts in order: the first or last of several things, and lists that are sorted.

Numbers, and tuples of numbers, are chosen by `select`.  Of other things, texts and objects, one way
through the function is followed for each that may be chosen.
"""

from __future__ import annotations

import builtins
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from ..arrays import Tracer, python_number, scalar, traced
from ..graph import Expr, Graph
from ..operators import elementwise

_SORTED = 16  # things that are sorted by exchanges: there is one for every two


def sorted_things(
    graph: Graph, things: Iterable[Any], *, key: Any = None, reverse: Any = False
) -> list[Any]:
    """Return Python's ``sorted(things)``."""
    values = list(things)
    keys = values if key is None else [key(v) for v in values]
    numbers = all(is_number(k) and traced(graph, k).only.kind != "b" for k in keys)
    if not (graph.merges and numbers and len(keys) <= _SORTED and are_alike(graph, values)):
        order = builtins.sorted(range(len(keys)), key=keys.__getitem__, reverse=reverse)
        return [values[i] for i in order]
    return _by_exchanges(graph, keys, values, "gt" if reverse else "lt")


def _by_exchanges(graph: Graph, keys: Sequence[Any], values: Sequence[Any], name: str) -> list[Any]:
    """Sort numbers: neighbours change places, what is equal never does."""
    keys, values = list(keys), list(values)
    for number in (traced(graph, k).only for k in keys):  # where NaN ends up only Python says
        if number.op != "const":
            graph.limited(graph.op("eq", number, number))
    for end in range(len(keys) - 1, 0, -1):
        for j in range(end):
            swaps = elementwise(graph, name, keys[j + 1], keys[j]).only
            for row in (keys, values):
                row[j : j + 2] = (
                    chosen_thing(graph, swaps, row[j + 1], row[j]),
                    chosen_thing(graph, swaps, row[j], row[j + 1]),
                )
    return values


def extreme(name: str, things: Sequence[Any], keys: Sequence[Any], graph: Graph) -> Any:
    """Return Python's min or max of several things: the first that no other is beyond."""
    if not (all(map(is_number, keys)) and are_alike(graph, things)):
        return things[getattr(builtins, name)(range(len(keys)), key=keys.__getitem__)]
    best, rank = things[0], keys[0]
    for thing, key in zip(things[1:], keys[1:], strict=True):
        beyond = elementwise(graph, "lt" if name == "min" else "gt", key, rank).only
        best, rank = (
            chosen_thing(graph, beyond, thing, best), chosen_thing(graph, beyond, key, rank)
        )  # fmt: skip
    return best


def is_number(value: object) -> bool:
    """Whether a value is a single number."""
    if isinstance(value, Tracer):
        return not value.shape
    return isinstance(value, bool | int | float | np.bool_ | np.integer | np.floating)


def are_alike(graph: Graph, things: Sequence[Any]) -> bool:
    """Whether all things are numbers, or tuples of as many numbers: one can be chosen by parts."""
    if all(map(is_number, things)):
        kinds = {traced(graph, v).only.kind for v in things}
        return len(kinds) == 1 or "b" not in kinds
    first = things[0]
    if not isinstance(first, tuple) or any(type(v) is not type(first) for v in things):
        return False
    lengths = {len(v) for v in things}
    return len(lengths) == 1 and all(
        are_alike(graph, column) for column in zip(*things, strict=True)
    )


def chosen_thing(graph: Graph, condition: Expr, one: Any, other: Any) -> Any:
    """Return one of two numbers or tuples that are alike where a condition holds, else another."""
    if one is other:
        return one
    if isinstance(one, tuple):
        parts = [chosen_thing(graph, condition, a, b) for a, b in zip(one, other, strict=True)]
        return type(one)._make(parts) if hasattr(one, "_fields") else tuple(parts)  # type: ignore[attr-defined]
    chosen = elementwise(graph, "select", scalar(graph, condition), one, other).only
    if len({traced(graph, v).only.kind for v in (one, other)}) > 1:
        graph.mixed.add(chosen)
    are_pythons = all(
        v.is_pythons if isinstance(v, Tracer) else type(v) in (bool, int, float)
        for v in (one, other)
    )
    return python_number(graph, chosen) if are_pythons else scalar(graph, chosen)


def first_ones(reverse: bool) -> Callable[..., Any]:
    """Return what gives the smallest or largest of several things."""

    def written(graph: Graph, n: int, iterable: Any, key: Any = None) -> Any:
        return sorted_things(graph, iterable, key=key, reverse=reverse)[:n]

    return written


def sorted_list(graph: Graph, whole: Any, *rest: Any, **options: Any) -> Any:
    """Do what ``whole.sort()`` does; NumPy's ``np.sort(values)`` is spelt like that, too."""
    if type(whole) is not list or rest:
        return whole.sort(*rest, **options)
    whole[:] = sorted_things(graph, whole, **options)
    return None
