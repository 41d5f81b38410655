"""Algebraic loops: which signals belong together, and which of them to guess."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import TypeVar

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

_Item = TypeVar("_Item", bound=Hashable)


def first_loop(before: Mapping[_Item, set[_Item]]) -> set[_Item]:
    """Return the items of one loop that depends on no other loop."""
    items = list(before)
    number = {item: i for i, item in enumerate(items)}
    edges = [(number[item], number[other]) for item in items for other in before[item]]
    rows, columns = np.array(edges).T
    graph = coo_array((np.ones(len(edges)), (rows, columns)), shape=(len(items),) * 2)
    _, labels = connected_components(graph, connection="strong")
    leaving = {labels[i] for i, j in edges if labels[i] != labels[j]}
    inside = {labels[i] for i, j in edges if labels[i] == labels[j]}
    chosen = min(inside - leaving)
    return {item for item, label in zip(items, labels, strict=True) if label == chosen}


def tear(before: Mapping[_Item, set[_Item]]) -> tuple[_Item, ...]:
    """Choose few items of a loop without which there is no loop.

    The item with the most connections first; then what is in no loop any more drops out.  The
    result is small, not always the smallest.
    """
    left = {item: set(others) for item, others in before.items()}
    torn = []
    while True:
        ends = {i for i in left if not left[i] or not any(i in others for others in left.values())}
        if not ends and not left:
            return tuple(torn)
        if not ends:
            ends = {max(left, key=lambda i: len(left[i]) * sum(i in o for o in left.values()))}
            torn += ends
        left = {i: others - ends for i, others in left.items() if i not in ends}
