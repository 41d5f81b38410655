"""The elements of an array that a mask chooses: how many there are, only the run knows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from .arrays import Computed, Special, Tracer, traced
from .graph import Graph, Untraceable
from .operators import elementwise, total


class Masked(Computed):
    """``x[x > 0]``: the whole array, and where its elements count."""

    def __init__(self, whole: Tracer, mask: Tracer) -> None:
        if mask.shape != whole.shape:
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
        return Masked(elementwise(graph, name, *wholes), self.mask)

    def filled(self, value: object) -> Tracer:
        """Return the whole array with a value in the places that do not count."""
        return elementwise(self.whole.graph, "select", self.mask, self.whole, value)

    def count(self) -> Tracer:
        """Return how many elements there are."""
        graph = self.whole.graph
        return total(elementwise(graph, "select", self.mask, 1, 0))

    def sum(self) -> Tracer:
        """Return the sum of the elements."""
        return total(self.filled(0.0))

    def mean(self) -> Tracer:
        """Return their mean, NaN if there is none."""
        return elementwise(self.whole.graph, "div", self.sum(), self.count())

    size = property(count)

    def _text(self, *_: object) -> Any:
        raise Untraceable("elements that a mask chooses, whose number only the run knows")

    def __iter__(self) -> Iterator[Any]:
        return (self.whole[k] for k in MaskedPlaces(self.mask))

    __len__ = __getitem__ = __bool__ = __str__ = __repr__ = _text


class MaskedPlaces(Special):
    """``np.where(x > 0)[0]``: the places that a mask chooses, for use as an index."""

    def __init__(self, mask: Tracer) -> None:
        self.mask = mask

    def count(self) -> Tracer:
        """Return how many places there are."""
        return total(elementwise(self.mask.graph, "select", self.mask, 1, 0))

    size = property(count)

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
