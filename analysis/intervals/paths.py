"""Comparisons that balls cannot decide: they are refused, or every answer is followed in turn."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any, TypeVar

from flint import arb

_T = TypeVar("_T")
BRANCHES = 64  # paths through an equation on one box, beyond which the box is split first


class Undecided(ArithmeticError):  # noqa: N818
    """A comparison that a ball cannot decide: the box must be split.

    Examples
    --------
    A comparison of a box that is true in parts of it only, where the equation is not divided:

    >>> from flint import arb
    >>> from nlctl.analysis.intervals.arithmetic import Ball
    >>> bool(Ball(arb(0, 1)) > 0)
    Traceback (most recent call last):
    nlctl.analysis.intervals.paths.Undecided: ...
    """


@dataclass
class Decisions:
    """The answers that one run of an equation gets where its balls cannot decide."""

    given: tuple[bool, ...] = ()  # answers that are fixed beforehand
    taken: tuple[bool, ...] = ()  # answers so far; those that were not given beforehand are True
    used: int = 0  # comparisons that were answered by decisions, this one or an earlier one
    # what answers said of two quantities
    orders: list[tuple[tuple[Any, Any], set[int]]] = field(default_factory=list, repr=False)

    def possible(self, key: tuple[Any, Any]) -> set[int]:
        """Return the orders of two quantities that earlier answers leave."""
        for (a, b), orders in self.orders:
            if a is key[0] and (b is key[1] or _same_number(b, key[1])):
                return orders
        return {-1, 0, 1}

    def restrict(self, key: tuple[Any, Any], orders: set[int]) -> None:
        """Remember what an answer says of the order of two quantities."""
        self.orders.insert(0, (key, orders))

    def next(self) -> bool:
        """Return the next answer and remember it."""
        i = len(self.taken)
        self.taken += (self.given[i] if i < len(self.given) else True,)
        return self.taken[-1]


def _same_number(a: object, b: object) -> bool:
    """Whether both are numbers without width, and equal."""
    return isinstance(a, arb) and isinstance(b, arb) and a.is_exact() and bool(a == b)


_DECISIONS: ContextVar[Decisions | None] = ContextVar("decisions", default=None)


@contextmanager
def meanwhile(variable: ContextVar[_T], value: _T) -> Iterator[_T]:
    """Give a variable of the context a value while something runs."""
    token = variable.set(value)
    try:
        yield value
    finally:
        variable.reset(token)


def undecided() -> AbstractContextManager[Any]:
    """Answer nothing: a comparison that balls cannot decide raises, whatever branch is followed."""
    return meanwhile(_DECISIONS, None)


def decided(possible: set[int], holds: set[int], key: tuple[Any, Any], what: str) -> bool:
    """Return whether the order of two quantities is one of `holds`; or see `Undecided`."""
    decisions = _DECISIONS.get()
    if decisions is not None:
        so_far = decisions.possible(key)
        decisions.used += not possible <= so_far
        possible = possible & so_far
    if possible <= holds:
        return True
    if not possible & holds:
        return False
    if decisions is None:
        raise Undecided(f"{what} is true for some points of the box and false for others")
    decisions.used += 1
    yes = decisions.next()
    decisions.restrict(key, possible & holds if yes else possible - holds)
    return yes


def decided_so_far() -> int | None:
    """Return how many comparisons were answered by decisions so far; None without any."""
    decisions = _DECISIONS.get()
    return None if decisions is None else decisions.used


def every_way(call: Callable[[], Any]) -> Iterator[Any]:
    """Yield what a call returns on every path through it, where balls cannot decide which."""
    scripts: list[tuple[bool, ...]] = [()]
    count = 0
    while scripts:
        given = scripts.pop()
        count += 1
        decisions = Decisions(given=given)
        with meanwhile(_DECISIONS, decisions):
            value = call()
        yield value
        taken = decisions.taken
        scripts += [taken[:i] + (False,) for i in range(len(given), len(taken))]
        if count + len(scripts) > BRANCHES:
            raise Undecided(f"more than {BRANCHES} paths through an equation")
