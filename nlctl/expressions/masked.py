"""The elements of an array that a mask chooses: how many there are, only the run knows."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from .arrays import Computed, Special, Tracer, scalar, traced
from .graph import Graph, Untraceable
from .operators import elementwise, total


class Masked(Computed):
    """``x[x > 0]``: the whole array, and where its elements, or its rows, count."""

    def __init__(self, whole: Tracer, mask: Tracer) -> None:
        if mask.shape != whole.shape[: mask.ndim]:
            raise Untraceable("a mask of another shape")
        self.graph, self.whole, self.mask = whole.graph, whole, mask

    def whole_for(self, mask: Tracer) -> Tracer:
        """Return the whole array, for the places of the same mask."""
        same = mask.shape == self.mask.shape and all(
            a is b for a, b in zip(mask.values.flat, self.mask.values.flat, strict=True)
        )
        if not same:
            raise Untraceable("elements that two different masks choose")
        return self.whole

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> Masked:
        """Return an operation on the chosen elements."""
        wholes = []
        for operand in operands:
            if isinstance(operand, Masked):
                operand = operand.whole_for(self.mask)
            elif traced(graph, operand).shape:
                raise Untraceable("an array next to elements that a mask chooses")
            wholes.append(operand)
        self._check_numbers()
        return Masked(elementwise(graph, name, *wholes), self.mask)

    def filled(self, value: object) -> Tracer:
        """Return the whole array with a value in the places that do not count."""
        self._check_numbers()
        return elementwise(self.whole.graph, "select", self.mask, self.whole, value)

    def _check_numbers(self) -> None:
        if self.mask.ndim < self.whole.ndim:
            raise Untraceable("rows that a mask chooses, all at once")

    def __getitem__(self, key: Any) -> Any:
        """Return the element or row that is the k-th of those chosen, or a column of these."""
        first, *rest = key if isinstance(key, tuple) else (key,)
        if self.mask.ndim != 1 or not (isinstance(first, int) or first == slice(None)):
            self._text()
        if isinstance(first, int):
            one = self._chosen_at(first)
            return one[tuple(rest)] if rest else one
        return Masked(self.whole[(first, *rest)], self.mask)

    def _chosen_at(self, k: int) -> Tracer:
        """Return the k-th of what is chosen, or from the end; if there is none Python says so."""
        graph, n = self.graph, len(self.mask)
        order = range(n) if k >= 0 else range(n - 1, -1, -1)
        before, rank = traced(graph, 0), k if k >= 0 else -1 - k
        chosen, places = self.whole[order[-1]], []
        for i in order:  # how many are chosen before each
            is_it = self.mask[i]
            if rank:
                is_it = elementwise(graph, "and", is_it, elementwise(graph, "eq", before, rank))
                one = elementwise(graph, "select", self.mask[i], 1, 0)
                before = elementwise(graph, "add", before, one)
            places.append((i, is_it))
        for i, is_it in reversed(places[:-1]):
            chosen = elementwise(graph, "select", is_it, self.whole[i], chosen)
        some = functools.reduce(functools.partial(elementwise, graph, "or"), (c for _, c in places))
        graph.guard(some.only, IndexError)
        return chosen

    def count(self) -> Tracer:
        """Return how many elements there are."""
        self._check_numbers()
        graph = self.whole.graph
        return total(elementwise(graph, "select", self.mask, 1, 0))

    def sum(self) -> Tracer:
        """Return the sum of the elements."""
        return total(self.filled(0.0))

    def mean(self) -> Tracer:
        """Return their mean, NaN if there is none."""
        return elementwise(self.whole.graph, "div", self.sum(), self.count())

    def var(self) -> Tracer:
        """Return their mean square deviation from the mean."""
        away = self.whole - self.mean()
        return Masked(away * away, self.mask).mean()

    def std(self) -> Tracer:
        """Return the square root of that."""
        return elementwise(self.whole.graph, "sqrt", self.var())

    size = property(count)

    def max(self) -> Tracer:
        """Return the largest of the elements."""
        return self._extreme("maximum", -math.inf)

    def min(self) -> Tracer:
        """Return the smallest of the elements."""
        return self._extreme("minimum", math.inf)

    def _extreme(self, name: str, neutral: float) -> Tracer:
        graph, some = self.graph, elementwise(self.graph, "ne", self.count(), 0)
        graph.guard(some.only, ValueError)
        elements = [scalar(graph, e) for e in self.filled(neutral).elements().flat]
        return functools.reduce(functools.partial(elementwise, graph, name), elements)

    def _text(self, *_: object) -> Any:
        raise Untraceable("elements that a mask chooses, whose number only the run knows")

    def __iter__(self) -> Iterator[Any]:
        return (self.whole[k] for k in MaskedPlaces(self.mask))

    __len__ = __bool__ = __str__ = __repr__ = _text


class MaskedPlaces(Special):
    """``np.where(x > 0)[0]``: the places that a mask chooses, for use as an index."""

    def __init__(self, mask: Tracer) -> None:
        self.mask = mask

    def count(self) -> Tracer:
        """Return how many places there are."""
        return total(elementwise(self.mask.graph, "select", self.mask, 1, 0))

    size = property(count)

    def __getitem__(self, key: Any) -> Any:
        """Return the k-th of these places."""
        if self.mask.ndim != 1:
            raise Untraceable("places in a matrix, one after the other")
        return Masked(traced(self.mask.graph, np.arange(len(self.mask))), self.mask)[key]

    def max(self) -> Any:
        """Return the last place."""
        return self[-1]

    def min(self) -> Any:
        """Return the first place."""
        return self[0]

    def __iter__(self) -> Iterator[int]:
        """Go through the places; whether each is chosen is asked when its turn comes."""
        if self.mask.ndim != 1:
            raise Untraceable("places in a matrix, one after the other")
        return (k for k in range(len(self.mask)) if self.mask[k])


def _power(self: Masked, exponent: object) -> Masked:
    if isinstance(exponent, Tracer | np.ndarray) and exponent.ndim:
        raise Untraceable("an array next to elements that a mask chooses")
    return Masked(self.whole**exponent, self.mask)  # type: ignore[operator]


Masked.__pow__ = _power  # type: ignore[attr-defined]
