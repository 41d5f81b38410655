"""Comparisons that balls cannot decide: they are refused, or every answer is followed in turn."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

__all__ = ["Decisions", "Undecided", "branch", "take"]


class Undecided(ArithmeticError):  # noqa: N818
    """A comparison that a ball cannot decide: the box must be split."""


@dataclass
class Decisions:
    """The answers that one run of an equation gets where its balls cannot decide.

    Attributes
    ----------
    taken : tuple of bool
        Answers so far; those that were not given beforehand are True.
    given : tuple of bool
        Answers that are fixed beforehand.
    """

    given: tuple[bool, ...] = ()
    taken: tuple[bool, ...] = ()

    def next(self) -> bool:
        """Return the next answer and remember it."""
        i = len(self.taken)
        self.taken += (self.given[i] if i < len(self.given) else True,)
        return self.taken[-1]


_DECISIONS: ContextVar[Decisions | None] = ContextVar("decisions", default=None)


@contextmanager
def take(decisions: Decisions) -> Iterator[Decisions]:
    """Answer undecided comparisons by `decisions`, for one who follows every branch in turn."""
    token = _DECISIONS.set(decisions)
    try:
        yield decisions
    finally:
        _DECISIONS.reset(token)


def branch(yes: bool, no: bool, what: str) -> bool:
    """Return the outcome of a comparison that is certain, or see `Undecided`."""
    if yes or no:
        return yes
    decisions = _DECISIONS.get()
    if decisions is None:
        raise Undecided(f"{what} is true for some points of the box and false for others")
    return decisions.next()
