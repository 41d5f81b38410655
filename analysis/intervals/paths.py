"""Comparisons that balls cannot decide: they are refused, or every answer is followed in turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from nlctl.errors import DiagramError, UsageError

__all__ = ["Decisions", "Undecided", "branch", "every_way", "on_balls", "take"]

BRANCHES = 64  # ways through an equation on one box, beyond which the box is split first


class Undecided(ArithmeticError):  # noqa: N818
    """A comparison that a ball cannot decide: the box must be split.

    Examples
    --------
    A comparison of a box that is true in parts of it only, where the equation is not divided:

    >>> from flint import arb
    >>> from analysis.intervals.arithmetic import Ball
    >>> bool(Ball(arb(0, 1)) > 0)
    Traceback (most recent call last):
    analysis.intervals.paths.Undecided: ...
    """


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


def every_way(call: Callable[[], Any]) -> Iterator[Any]:
    """Yield what a call returns on every way through it, with balls that cannot decide the way.

    Raises
    ------
    Undecided
        If a comparison has no answer at all, or there are too many ways.
    """
    scripts: list[tuple[bool, ...]] = [()]
    count = 0
    while scripts:
        given = scripts.pop()
        count += 1
        with take(Decisions(given=given)) as decisions:
            value = call()
        yield value
        taken = decisions.taken
        scripts += [taken[:i] + (False,) for i in range(len(given), len(taken))]
        if count + len(scripts) > BRANCHES:
            raise Undecided(f"more than {BRANCHES} ways through an equation")


def on_balls(
    function: Callable[..., Any], refusal: Callable[[str], UsageError]
) -> Callable[..., Any]:
    """Return a function of a user's for balls: where it fails on them, `refusal` says so.

    Parameters
    ----------
    function : callable
    refusal : callable
        Takes what has gone wrong, and returns the error to be raised.

    Raises
    ------
    Undecided
        When the function that is returned compares balls that decide nothing.
    UsageError
        The refusal, when it fails otherwise.
    """

    def called(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except (Undecided, DiagramError):
            raise
        except Exception as error:  # a user's function may raise whatever it likes
            raise refusal(f"{type(error).__name__}: {error}") from error

    return called
