"""What the names mean that parameters are overridden by: one law for every block and entry point.

"P.k" is block P's own k, also where P is a third-party block and python-control has one flat dict.
A name without a block means what python-control means by it: every third-party block that reads
it; in a diagram of `nlctl.interconnect`, where each has a value of its own, it must mean one.
"""

import functools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from types import CodeType, FunctionType, MethodType
from typing import Any

import control as ct
import numpy as np

from ..blocks import Block, within
from ..errors import AmbiguousNameError, ParameterError
from ..names import Parameters, base_name, unknown
from ..params import declared_params
from ..upstream.control_internals import current_parameters
from ..upstream.systems import System
from .places import leaves
from .third_party import Named, declared_keys, is_third_party

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


_NUMBERS = (int, float, np.number, np.ndarray)


@dataclass(kw_only=True)
class Divided:
    """Overrides, divided between python-control and single blocks."""

    given: dict[str, Any] = field(default_factory=dict)  # what python-control is given
    # what a third-party block alone is to read: by its identity, and by the names it reads
    alone: dict[int, dict[str, Any]] = field(default_factory=dict)


def divided(system: System, params: Mapping[str, Any] | None) -> Divided:
    """Divide a user's overrides."""
    parts = Divided()
    if not params:
        return parts
    law = _Law(system)
    for name, value in params.items():
        if not isinstance(name, str):
            raise ParameterError(f"params needs names of parameters, got {name!r}")
        block, key = law.meant(name)
        law.check(name, value)
        if block is None:
            parts.given[key] = value
        else:
            parts.alone.setdefault(id(block), {})[key] = value
    return parts


class _Law:
    """Knows the blocks of a diagram by their paths."""

    def __init__(self, system: Any) -> None:
        self.params = system.params or {}
        self.theirs: list[tuple[str, set[str], Any]] = []  # third-party blocks with their paths
        self.others: list[str] = []  # names of parameters of nlctl's blocks
        self.open = False  # whether there is something whose parameters nobody knows
        for leaf in leaves(system):
            block = within(leaf.system)
            if is_third_party(block):
                paths = {leaf.parameter_path or block.name, leaf.path or block.name}
                self.theirs.append((leaf.parameter_path or block.name, paths, block))
            elif isinstance(block, Block):
                self.others += [f"{block.name}.{key}" for key in declared_params(block.spec)]
            elif not isinstance(block, ct.StateSpace | ct.TransferFunction):
                self.open = True
        if isinstance(self.params, Parameters):
            self.others = [k for k in self.params if "." in k]

    def meant(self, name: str) -> tuple[Any, str]:
        """Return the one third-party block that is meant, and the name there; None for others."""
        base = base_name(name)
        path, dot, key = base.rpartition(".")
        if not dot:
            return None, self._bare(name, base)
        blocks = self._blocks(path)
        ours = [k for k in self.others if k == base or k.endswith(f".{base}")]
        if not blocks:
            if not (ours or isinstance(self.params, Parameters) or self.open):
                self._refuse(name, base)
            return None, name
        others = [k for k in ours if k.rpartition(".")[0] not in blocks]
        if len(blocks) > 1 or (others and base not in ours):
            names = sorted({*(f"{p}.{key}" for p in blocks), *ours})
            raise AmbiguousNameError(f"parameter '{name}' could be {' or '.join(names)}")
        ((path, block),) = blocks.items()
        if ours and (isinstance(block, Named) or others):
            return None, name  # python-control knows it by this name
        if not may_read(block, key):
            names = [f"{path}.{k}" for k in declared_keys(block)] or self.names()
            raise unknown("parameter", name, names, f"of block '{path}'")
        return block, key + name[len(base) :]

    def check(self, name: str, value: object) -> None:
        """Refuse text, or nothing, for a number of a third-party block."""
        if not isinstance(value, str | bytes | None):
            return
        path, _, key = base_name(name).rpartition(".")
        blocks = self._blocks(path) if path else {p: b for p, _, b in self.theirs}
        for shown, block in blocks.items():
            values = block.nlctl_own if isinstance(block, Named) else block.params
            if isinstance(values.get(key), _NUMBERS):
                raise ParameterError(
                    f"block '{shown}' needs a number for {key}, as it declares, got {value!r}"
                )

    def _blocks(self, path: str) -> dict[str, Any]:
        """Return third-party blocks of that path, or else those whose path ends in it."""
        exact = [(shown, block) for shown, paths, block in self.theirs if path in paths]
        if not exact:
            end = f".{path}"
            exact = [(s, b) for s, paths, b in self.theirs if any(p.endswith(end) for p in paths)]
        blocks = {id(block): (shown, block) for shown, block in exact}
        twins = len({shown for shown, _ in blocks.values()}) < len(blocks)
        return {f"{s}#{i}" if twins else s: b for i, (s, b) in enumerate(blocks.values())}

    def _bare(self, name: str, base: str) -> str:
        """Return what python-control calls a parameter that is named without its block."""
        # Refuse one that nobody reads, or that means more than one block.
        declaring = [f"{p}.{base}" for p, _, b in self.theirs if isinstance(b, Named) and
               base in b.nlctl_own]  # fmt: skip
        if len(declaring) > 1:
            raise AmbiguousNameError(f"parameter '{name}' could be {' or '.join(declaring)}")
        is_read = any(may_read(block, base) for _, _, block in self.theirs)
        if not (declaring or self.open or base in self.params or is_read):
            self._refuse(name, base)
        others = [b for _, _, b in self.theirs if base not in declared_keys(b)]
        if declaring and not any(base in texts_of(f) for b in others for f in (b.updfcn, b.outfcn)):
            return declaring[0] + name[len(base) :]
        return name

    def names(self) -> list[str]:
        """Return all names that are known."""
        qualified = [f"{p}.{key}" for p, _, block in self.theirs for key in declared_keys(block)]
        bare = [k for k in self.params if isinstance(k, str) and "." not in k]
        return list(dict.fromkeys([*bare, *qualified, *self.others]))

    def _refuse(self, name: str, base: str) -> None:
        twins = [k for k in self.others if k.endswith(f".{base}")]
        if not twins:  # else python-control's own way says that names carry their block's
            raise unknown("parameter", name, self.names())
