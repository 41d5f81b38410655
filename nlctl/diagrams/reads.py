"""Which parameters the functions of a third-party block may read, declared or not."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType, MethodType
from typing import Any

import control as ct
import numpy as np

from ..upstream.control_internals import current_parameters
from ..upstream.systems import System
from .third_party import declared_keys

_MOST = 2000  # objects that are visited
_VALUES = (0.0, 0.25, 1.0)  # of states and inputs at which it is called
_CONTAINERS = (tuple, list, set, frozenset)


def may_read(block: ct.NonlinearIOSystem, key: str) -> bool:
    """Whether the functions of a third-party block may read a parameter of that name."""
    functions = [f for f in (block.updfcn, block.outfcn) if f is not None]
    if key in declared_keys(block) or any(key in texts_of(f) for f in functions):
        return True
    return any(_reads(f, block, key) for f in functions)


def texts_of(function: object) -> frozenset[str]:
    """Return all text constants that a function reaches: in code, in what it reads around it."""
    texts: set[str] = set()
    waiting, seen = [function], set()
    while waiting and len(seen) < _MOST:
        thing = waiting.pop()
        if isinstance(thing, str):
            texts.add(thing)
        elif id(thing) not in seen:
            seen.add(id(thing))
            waiting.extend(_reached(thing))
    return frozenset(texts)


def _reached(member: object) -> Iterator[Any]:
    """Yield what one thing leads to."""
    if isinstance(member, CodeType):
        yield from member.co_consts
    elif isinstance(member, FunctionType):
        yield from _of_function(member)
    elif isinstance(member, MethodType):
        yield from (member.__func__, member.__self__)
    elif isinstance(member, functools.partial):
        yield from (member.func, *member.args, *member.keywords.values())
    elif isinstance(member, _CONTAINERS):
        yield from member
    elif isinstance(member, dict):
        yield from (*member, *member.values())
    elif _is_users(member):
        yield from vars(member).values()
        for kind in type(member).__mro__[:-1]:
            yield from (f for f in vars(kind).values() if isinstance(f, FunctionType | str))


def _of_function(function: FunctionType) -> Iterator[Any]:
    yield function.__code__
    yield from function.__defaults__ or ()
    yield from (function.__kwdefaults__ or {}).values()
    yield getattr(function, "__wrapped__", None)
    for cell in function.__closure__ or ():
        try:
            yield cell.cell_contents
        except ValueError:  # nothing in it yet
            continue
    for name in _names(function.__code__):
        yield function.__globals__.get(name)


def _names(code: CodeType) -> Iterator[str]:
    yield from code.co_names
    for const in code.co_consts:
        if isinstance(const, CodeType):
            yield from _names(const)


def _is_users(thing: object) -> bool:
    """Whether a thing may be an object of somebody's own class, which has attributes."""
    if isinstance(thing, type) or not hasattr(thing, "__dict__"):
        return False
    return type(thing).__module__.partition(".")[0] not in ("builtins", "numpy", "control")


class _Watched(dict):  # type: ignore[type-arg]
    """A dict that notes which of its keys are asked for, and whether all of them are."""

    def __init__(self, values: Any) -> None:
        super().__init__(values)
        self.asked: set[Any] = set()
        self.every = False


def _noting(name: str, *, one: bool) -> Callable[..., Any]:
    """Return a method of a dict that notes which key it is asked for, or that it is all."""
    method = getattr(dict, name)

    def noted(self: _Watched, *given: object) -> Any:
        self.asked.update(given[:1] if one else ())
        self.every |= not one
        return method(self, *given)

    return noted


for _name in ("__getitem__", "__contains__", "get", "pop"):
    setattr(_Watched, _name, _noting(_name, one=True))
for _name in ("__iter__", "keys", "values", "items", "copy", "__or__", "__ror__"):
    setattr(_Watched, _name, _noting(_name, one=False))


def _reads(function: Callable[..., Any], block: System, key: str) -> bool:
    """Whether a function asks for a name that is not in its code, where it is called."""
    called = False
    for value in _VALUES:
        watched = _Watched(dict(current_parameters(block)))
        x, u = np.full(block.nstates or 0, value), np.full(block.ninputs or 0, value)
        try:
            with np.errstate(all="ignore"):
                function(0.0, x, u, watched)
            called = True
        except Exception:  # whatever a function of others raises at a place that was chosen here
            pass
        if watched.every or key in watched.asked:
            return True
    return not called
