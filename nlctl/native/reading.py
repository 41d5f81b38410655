"""What was read of a diagram: its schedule, its program, its equations.

What the parameters of a diagram hang on, to see at once that nothing has changed.

To resolve them is python-control's work, block by block.  A run whose diagram is unchanged since
the run before takes what was resolved then.
"""

import operator
import threading
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from types import BuiltinFunctionType, FunctionType, MethodType, NoneType
from typing import Any, Self

import numpy as np

from ..blocks import Block
from ..diagrams import Apart, initial_state, override
from ..diagrams.third_party import own_attributes
from ..errors import UsageError
from ..names import Parameters
from ..responses.time_response import Labels, labels_of
from ..upstream.control_internals import RESOLVED
from .cache import Cache
from .diagram.parameters import packed
from .diagram.program import Program
from .diagram.schedule import Schedule
from .equations.blocks import Equations, equations
from .lower import Lowered, lower
from .purity.captured import CapturedValues

_RESOLVING = threading.Lock()


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """A diagram as it was read."""

    schedule: Schedule  # what was read from the diagram
    program: Program  # the arrays that machine code takes and fills
    original: object = None  # the diagram itself; none in another process
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

    def equations_with(self, p: np.ndarray) -> Equations:
        """Return what they compute with a parameter vector: its integers may steer what that is."""

        def fits(read: Equations) -> bool:
            return all(p[place] == value for place, value in read.graph.assumptions.items())

        def read_again() -> Equations:
            return equations(self.schedule, self.program.layout, p, self.program.meetings)

        if fits(self.equations):
            return self.equations
        return self.cache.found(Equations, fits, read_again)

    @cached_property
    def lowered(self) -> Lowered:
        """The plan of a program for one member."""
        return lower(self.schedule, self.program, 1, self.equations)

    def calling(self, cut: frozenset[tuple[int, str]]) -> Self:
        """Return the diagram with functions, of blocks at these places, called unchanged."""
        if not cut:
            return self
        read = self.schedule
        nodes = tuple(
            replace(node, called=node.called | {kind for place, kind in cut if place == i})
            for i, node in enumerate(read.nodes)
        )
        return self.cache.found(
            _Calling,
            lambda known: known.cut == cut,
            lambda: _Calling(cut=cut, reading=replace(self, schedule=replace(read, nodes=nodes))),
        ).reading

    @cached_property
    def integers(self) -> dict[str, int]:
        """Names and places of integers of third-party blocks: ours say what is one."""
        return {
            slot.name: slot.offset
            for i, own in self.program.layout.items()
            if not isinstance(self.schedule.holders[i].system, Block)
            for slot in own.values()
            if slot.kind == "i"
        }

    def with_floats(self, names: frozenset[str]) -> Self:
        """Return the diagram with some of these integers as floats."""

        def changed() -> _WithFloats:
            layout = {
                i: {
                    key: replace(slot, kind="f") if slot.name in names else slot
                    for key, slot in own.items()
                }
                for i, own in self.program.layout.items()
            }
            program = replace(self.program, layout=layout)
            return _WithFloats(names=names, reading=replace(self, program=program))

        return self.cache.found(_WithFloats, lambda one: one.names == names, changed).reading

    @cached_property
    def _captured(self) -> CapturedValues:
        return CapturedValues(self.schedule.captured)

    def parameter_vector(self, params: Mapping[str, Any] | None = None) -> np.ndarray:
        """Return the vector `p` of shape (k,) that the program takes."""
        return self.resolved(params).p.copy()

    def resolved(self, params: Mapping[str, Any] | None = None) -> "Resolved":
        """Return what a run takes of the diagram as it is now."""
        given = [*(params or {}), *(params or {}).values()]
        with _RESOLVING:  # python-control keeps what it has resolved in the blocks
            last = self.cache.of(Resolved)
            if last and self.apart is not None and last[0].stands(self.apart, given):
                self._check_captured()
                return last[0]
            last.clear()
            views = None if self.apart is None else standing(self.apart, params)
            if self.apart is not None and not self.apart.refreshed():
                raise UsageError(
                    f"'{self.system.name}' has other blocks than when it was compiled: compile "
                    "again"
                )
            self._check_captured()
            override(self.schedule.system, params)
            p = packed(self.schedule.holders, self.program.layout, self.program.fixed)
            now = Resolved(
                p=p,
                system=self.system,
                given=given,
                handed=[] if self.apart is None else handed(self.apart),
                views=views or [],
            )
            if views is not None:
                last.append(now)
            return now

    def _check_captured(self) -> None:
        """Refuse another value of what functions read from around them."""
        other = self._captured.changed()
        if other is not None:
            raise UsageError(
                f"'{other.title}' was {_short(other.then)} when '{self.system.name}' was "
                f"compiled and is {_short(other.now)} now: compile again, or make it a "
                "parameter"
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class _Calling:
    """A diagram that was read again, with some functions called."""

    cut: frozenset[tuple[int, str]]
    reading: Any


@dataclass(frozen=True, kw_only=True, eq=False)
class _WithFloats:
    """A diagram in which parameters that were integers are floats."""

    names: frozenset[str]
    reading: Any


@dataclass(frozen=True, kw_only=True, eq=False)
class Resolved:
    """What runs take of a diagram, until something that it hangs on is another object."""

    p: np.ndarray
    system: Any
    given: list[Any]  # names and values of overrides
    handed: list[Any]  # to the equations
    views: Sequence[Collection[Any]]  # of all that is looked at: what they have now
    sizes: list[int] = field(init=False)
    things: list[Any] = field(init=False)  # and what they had when it was resolved

    def __post_init__(self) -> None:
        object.__setattr__(self, "sizes", list(map(len, self.views)))
        object.__setattr__(self, "things", list(chain.from_iterable(self.views)))

    def stands(self, copies: Apart, given: list[Any]) -> bool:
        """Whether the same would come of it again, and is what the equations have."""
        return (
            self.sizes == list(map(len, self.views))
            and all(map(operator.is_, self.things, chain.from_iterable(self.views)))
            and _are_same(self.given, given)
            and _are_same(self.handed, handed(copies))
        )

    @cached_property
    def initial_state(self) -> np.ndarray:
        """The blocks' own initial states, shape (nstates,)."""
        return initial_state(self.system)

    @cached_property
    def labels(self) -> Labels:
        """Names of the states, and where the outputs come from."""
        return labels_of(self.system)


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


def standing(copies: Apart, params: Mapping[str, Any] | None) -> Sequence[Collection[Any]] | None:
    """Return views of all that parameters hang on; None where some can change in place."""
    # They are what they were if each thing in these is the same object.
    try:
        _check_fixed((params or {}).values())
        return [view for old, _ in copies.pairs.values() for view in _of_system(old)]
    except _CanChange:
        return None


def handed(copies: Apart) -> list[Any]:
    """Return what the equations of the copies have been handed as their parameters."""
    return [vars(new).get(name) for _, new in copies.pairs.values() for name in RESOLVED]


def _of_system(system: Any) -> Iterator[Collection[Any]]:
    kind = getattr(type(system), "nlctl_base", type(system))
    if kind.__module__.partition(".")[0] not in _KNOWN:
        raise _CanChange  # as a class of others may say
    yield vars(system).values()
    passing = own_attributes(system) - {"syslist"} | _READ_ONCE
    for name, value in vars(system).items():
        if name == "syslist":
            yield value
        elif isinstance(value, dict) and name not in passing:
            yield from _of_mapping(value)
        elif name not in passing:
            _check_fixed([value])


def _of_mapping(values: Mapping[str, Any]) -> Iterator[Collection[Any]]:
    _check_fixed(values.values())
    yield from (values.keys(), values.values())
    if isinstance(values, Parameters):
        yield from (values.strays, values.owners.values(), values.clashes, vars(values).values())


def _check_fixed(values: Iterable[Any]) -> None:
    if not all(map(is_fixed, values)):
        raise _CanChange


def is_fixed(value: object) -> bool:
    """Whether a value cannot change in place."""
    return type(value) in _FIXED or (type(value) is tuple and all(map(is_fixed, value)))
