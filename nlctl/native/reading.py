"""What was read of a diagram: its schedule, its program, its equations.

What the parameters of a diagram hang on, to see at once that nothing has changed.

To resolve them is python-control's work, block by block.  A run whose diagram is unchanged since
the run before takes what was resolved then.
"""

from __future__ import annotations

import operator
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import BuiltinFunctionType, FunctionType, MethodType, NoneType
from typing import Any, NamedTuple

import numpy as np

from ..diagrams import Apart, override
from ..diagrams.third_party import own_attributes
from ..errors import UsageError
from ..names import Parameters
from ..upstream.control_internals import RESOLVED
from .cache import Cache
from .diagram.parameters import packed
from .diagram.program import Program
from .diagram.schedule import Schedule
from .equations.blocks import Equations, equations
from .lower import Lowered, lower
from .purity.captured import changed

_RESOLVING = threading.Lock()


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """A diagram as it was read."""

    schedule: Schedule  # what was read from the diagram
    program: Program  # the arrays that machine code takes and fills
    original: Any = None  # the diagram itself; none in another process
    apart: Apart | None = None  # the copy of it that was read, in which runs write their parameters
    # what has been made of it, such as machine code
    cache: Cache = field(init=False, repr=False, default_factory=Cache)

    @property
    def system(self) -> Any:
        """The diagram itself, or in another process the copy of it that was read."""
        return self.schedule.system if self.original is None else self.original

    @cached_property
    def equations(self) -> Equations:
        """What the blocks' functions compute as expressions."""
        return equations(self.schedule, self.program.layout, meetings=self.program.meetings)

    @cached_property
    def lowered(self) -> Lowered:
        """The plan of a program for one member."""
        return lower(self.schedule, self.program, 1, self.equations)

    def parameter_vector(self, params: Mapping[str, Any] | None = None) -> np.ndarray:
        """Return the vector `p` of shape (k,) that the program takes."""
        with _RESOLVING:  # python-control keeps what it has resolved in the blocks
            now = None if self.apart is None else standing(self.apart, params)
            known = self.cache.of(_Resolved)
            if now is not None and known and known[0].stands(self.apart, now):
                self._check_captured()
                return known[0].p.copy()
            known.clear()
            if self.apart is not None and not self.apart.refreshed():
                raise UsageError(
                    f"'{self.system.name}' has other blocks than when it was compiled: compile "
                    "again"
                )
            self._check_captured()
            override(self.schedule.system, params)
            p = packed(self.schedule.holders, self.program.layout, self.program.fixed)
            if self.apart is not None and now is not None:
                known.append(_Resolved(now, handed(self.apart), p.copy()))
            return p

    def _check_captured(self) -> None:
        """Refuse another value of what functions read from around them."""
        other = changed(self.schedule.captured)
        if other is not None:
            raise UsageError(
                f"'{other.title}' was {_short(other.then)} when '{self.system.name}' was "
                f"compiled and is {_short(other.now)} now: compile again, or make it a "
                "parameter"
            )


class _Resolved(NamedTuple):
    """What parameters hung on when they were last resolved, and what came of it."""

    now: list[Any]
    handed: list[Any]  # to the equations
    p: np.ndarray

    def stands(self, own: Any, now: list[Any]) -> bool:
        """Whether the same would come of it again, and is what the equations have."""
        return _are_same(self.now, now) and _are_same(self.handed, handed(own))


def _are_same(then: list[Any], now: list[Any]) -> bool:
    return len(then) == len(now) and all(map(operator.is_, then, now))


def _short(value: object) -> str:
    """Return a value in one line."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


_FIXED = {
    bool, int, float, complex, str, bytes, NoneType, np.bool_, np.int64, np.float64,
    FunctionType, BuiltinFunctionType, MethodType,
}  # fmt: skip
_KNOWN = ("control", __name__.partition(".")[0])
_READ_ONCE = {
    "syslist_index", "state_offset", "input_offset", "output_offset", "connect_map", "input_map",
    "output_map", "input_index", "output_index", "state_index", "spec", "inner", "sampling",
}  # fmt: skip


class _CanChange(Exception):  # noqa: N818
    """Something can change and stay the same object."""


def standing(copies: Apart, params: Mapping[str, Any] | None) -> list[Any] | None:
    """Return all that parameters hang on, in an order; None where some can change in place."""
    # They are what they were if each of it is the same object.
    try:
        things = list(_of_mapping(params or {}))
        for old, _ in copies.pairs.values():
            things += _of_system(old)
    except _CanChange:
        return None
    return things


def handed(copies: Apart) -> list[Any]:
    """Return what the equations of the copies have been handed as their parameters."""
    return [vars(new).get(name) for _, new in copies.pairs.values() for name in RESOLVED]


def _of_system(system: Any) -> Iterator[Any]:
    kind = getattr(type(system), "nlctl_base", type(system))
    if kind.__module__.partition(".")[0] not in _KNOWN:
        raise _CanChange  # as a class of others may say
    kept = own_attributes(system) - {"syslist"}
    for name, value in vars(system).items():
        if name in kept:
            continue
        yield value
        if type(value) in _FIXED or name in _READ_ONCE:
            continue
        if name == "syslist":
            yield from value
        elif isinstance(value, dict):
            yield from _of_mapping(value)
        else:
            raise _CanChange


def _of_mapping(values: Mapping[str, Any]) -> Iterator[Any]:
    yield len(values)
    for value in values.values():
        if not is_fixed(value):
            raise _CanChange
    yield from values
    yield from values.values()
    if isinstance(values, Parameters):
        yield from values.strays
        yield from values.owners.values()
        yield from (values.scope, values.table, len(values.clashes))


def is_fixed(value: Any) -> bool:
    """Whether a value cannot change in place."""
    return type(value) in _FIXED or (type(value) is tuple and all(map(is_fixed, value)))
