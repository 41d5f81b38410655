"""Qualified names (``"actuator.b_r"``) that survive python-control's parameter handling.

python-control keeps one flat parameter dict per diagram: of equal names the last one wins for
every block (0.10.2), and unknown names are ignored.  A `Parameters` dict goes through exactly
those operations (``|``, ``copy``, ``update``) and does the right thing in each, so that an
ordinary diagram made with ``ct.interconnect`` takes qualified names without being patched.

What is relied on of python-control: a diagram's parameters are those of its parts, taken together
with ``|`` and copied when they are complete; in a run each part's are copied and updated, first
with the diagram's, then with what the diagram was given.  How often they are copied makes no
difference (``tests/diagrams/test_copied_parameters.py``).
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import Any

import control as ct

from .errors import AmbiguousNameError, ParameterError, UnknownNameError
from .wording import counted, nearest

_PARTS = re.compile(r"((?:.*\.)?[^.\[\]]*)(?:\[.*)?", re.DOTALL)  # a name, and what follows it
_ELEMENT = re.compile(r"\[\d+(?:, ?\d+)*\]|(?:\[\d+\])+")  # as NumPy has it, and as lists have it
_LISTED = 24  # names that a message lists; it says how many more there are


def unknown(
    kind: str,
    name: str,
    known: Iterable[str],
    where: str = "",
    error: type[UnknownNameError] = UnknownNameError,
) -> UnknownNameError:
    """Make the error for an unknown `name`: it says what exists, nearest first."""
    known = list(known)
    near = nearest(name, known, most=3, cutoff=0.5)
    if near:
        hint = "nearest: " + ", ".join(f"'{n}'" for n in near)
    else:
        names = sorted(dict.fromkeys(known))
        hint = "known: " + (", ".join(f"'{n}'" for n in names[:_LISTED]) or "none")
        hint += f" and {len(names) - _LISTED} more" if len(names) > _LISTED else ""
    return error(f"unknown {kind} '{name}'{where and ' ' + where}; {hint}")


def check_known(kind: str, name: str, known: Collection[str], where: str = "") -> None:
    """Refuse a `name` that is none of those that are known."""
    if name not in known:
        raise unknown(kind, name, known, where)


def base_name(name: str) -> str:
    """Return a parameter's name without an element index: ``"c.lambdas[0]"`` -> ``"c.lambdas"``."""
    # Block names may hold brackets as well (python-control's generic ``sys[0]``); they stay.
    parts = _PARTS.fullmatch(name) if "[" in name else None
    return name if parts is None else parts[1]


def element_name(base: str, index: Sequence[int]) -> str:
    """Return the name of an element of a parameter: ``"c.W[0, 1]"``, and itself of a number."""
    return f"{base}[{', '.join(map(str, index))}]" if index else base


def is_element(name: object) -> bool:
    """Whether a name is that of an element, whether there is one or not."""
    return isinstance(name, str) and "[" in name and name != base_name(name)


def in_one_spelling(name: str) -> str:
    """Return the name of an element as `element_name` spells it: ``"c.W[0][1]"`` may be given."""
    base = base_name(name)
    is_element = _ELEMENT.fullmatch(name, len(base))
    return element_name(base, _numbers(name[len(base) :])) if is_element else name


def element_index(name: str, shape: Sequence[int]) -> tuple[int, ...]:
    """Return which element of a parameter of some shape is meant by a name."""
    base = base_name(name)
    index = _numbers(name[len(base) :]) if _ELEMENT.fullmatch(name, len(base)) else ()
    wrong = name != base and not index
    if wrong or len(index) != len(shape) or any(i >= n for i, n in zip(index, shape, strict=True)):
        if not shape:
            raise ParameterError(f"'{base}' is one number, of which '{name}' is not an element")
        example = element_name(base, [0] * len(shape))
        raise ParameterError(
            f"'{name}' is not one number: name one, such as '{example}' (the shape of '{base}' is "
            f"{tuple(shape)})"
        )
    return index


def _numbers(text: str) -> tuple[int, ...]:
    return tuple(map(int, re.findall(r"\d+", text)))


def find_name(kind: str, name: str, known: Mapping[str, Any], clashes: Iterable[str] = ()) -> str:
    """Return the one key of `known` that `name` means: the full path, or the end of one path."""
    matches = [name] if name in known else [k for k in known if k.endswith("." + name)]
    if not matches:
        raise unknown(kind, name, known)
    if len(matches) > 1:
        raise AmbiguousNameError(f"{kind} '{name}' could be {' or '.join(sorted(matches))}")
    if matches[0] in clashes:
        raise AmbiguousNameError(
            f"{kind} '{name}' belongs to two blocks of this diagram with the same name; "
            "give the blocks different names, or connect the inner diagrams with "
            "nlctl.interconnect(..., name=...), which puts their name in front"
        )
    return matches[0]


def renamed(who: str, kind: str, had: list[str], given: Any) -> list[str]:
    """Return the names of signals after all, or those in a mapping, are given others."""
    if isinstance(given, Mapping):
        for signal in given:
            if signal not in had:
                raise unknown(kind, str(signal), had, f"of {who}")
        names = [given.get(signal, signal) for signal in had]
    else:
        names = [given] if isinstance(given, str) else list(given)
    are_labels = all(isinstance(name, str) and name and "." not in name for name in names)
    if not (are_labels and len(names) == len(set(names)) == len(had)):
        raise ParameterError(
            f"{who} has {counted(len(had), kind)} ({', '.join(had)}): {kind}s needs as many "
            f"different names without dots, got {given!r}"
        )
    return names


class Parameters(dict[str, Any]):
    """``{qualified name: value}`` of a block or diagram, for use as python-control ``params``."""

    def __init__(self, values: Mapping[str, Any], block: Any = None) -> None:
        super().__init__(values)
        self.block = block  # whose parameters these are; None for a diagram's
        self.owners: dict[str, Any] = dict.fromkeys(values, block)
        # keys that do not stand for exactly one block: each keeps its own value, and an override
        # of such a name is refused
        self.clashes: set[str] = set()
        # the diagram whose name is put in front of every key when it is nested in another
        self.scope: ct.InputOutputSystem | None = None
        # the enclosing diagram's parameters, known while python-control hands overrides down
        self.table: Parameters | None = None
        # whether this is a copy: what was not copied yet is a block's own values, or a diagram's
        # parameters while python-control still collects them
        self.complete = False
        # names in a plain dict that mean no block here: in a copy that python-control hands down
        # those of blocks elsewhere, in a diagram's own parameters misspelt ones
        self.strays: list[str] = []

    @property
    def prefix(self) -> str:
        """What the enclosing diagram puts in front of the keys of this one."""
        return f"{self.scope.name}." if self.scope is not None else ""

    def copy(self) -> Parameters:
        """Return a copy (python-control copies defaults before it overrides them)."""
        new = Parameters(self, self.block)
        new.owners, new.clashes = self.owners.copy(), self.clashes.copy()
        new.scope, new.table = self.scope, self.table
        new.complete, new.strays = True, self.strays.copy()
        return new

    def __reduce__(self) -> tuple[Any, ...]:
        # contents last: scope leads to the diagram, and the diagram back here
        return Parameters, ({},), (dict(self), self.__dict__)

    def __setstate__(self, state: tuple[dict[str, Any], dict[str, Any]]) -> None:
        dict.update(self, state[0])
        self.__dict__.update(state[1])

    def __or__(self, other: Mapping[str, Any]) -> Parameters:  # type: ignore[override]
        new = self.copy()
        if self.complete and not isinstance(other, Parameters):
            for name in sorted(other, key=is_element):  # a diagram's parameters, some changed
                new[name] = other[name]
            return new
        new.scope, new.block, new.complete = None, None, False
        new._absorb(other)
        return new

    def __ror__(self, other: Mapping[str, Any]) -> Parameters:  # type: ignore[override]
        new = Parameters(other)
        new._absorb(self)
        return new

    def __ior__(self, other: Mapping[str, Any]) -> Parameters:  # type: ignore[override,misc]
        self.update(other)
        return self

    def __setitem__(self, name: str, value: object) -> None:
        self._override(name, value)

    def _absorb(self, other: Mapping[str, Any]) -> None:
        """Add the parameters of one more subsystem; note names that do not mean one block."""
        if not isinstance(other, Parameters):  # a third-party block: python-control's own rule
            dict.update(self, other)
            return
        elsewhere: dict[tuple[int, str], str]
        elsewhere = {(id(o), k.rpartition(".")[2]): k for k, o in self.owners.items() if o}
        self.clashes.update(other.prefix + key for key in other.clashes)
        for key, value in other.items():
            name = other.prefix + key if "." in key else key  # bare names are third-party blocks'
            owner = other.owners.get(key)
            twin = elsewhere.get((id(owner), key.rpartition(".")[2]), name)
            if owner is not None and self.owners.get(name, owner) is not owner:
                self.clashes.add(name)  # two blocks with one name
            if twin != name:
                self.clashes.update({name, twin})  # one block in two places
            self.owners[name] = owner
            dict.__setitem__(self, name, value)

    def update(self, other: Mapping[str, Any] | None = None, /, **kwargs: object) -> None:  # type: ignore[override]
        """Override values: with the defaults of the enclosing diagram, or with a user's dict."""
        if isinstance(other, Parameters):
            self._inherit(other)
            return
        given = {**(other or {}), **kwargs}
        for name in sorted(given, key=is_element):  # behind what they are elements of
            if not self._is_elsewhere(name):
                self._override(name, given[name])

    def _inherit(self, outer: Parameters) -> None:
        """Take over the values that the enclosing diagram has for these parameters."""
        if outer.strays and self.table is None:  # the diagram's own; what it was given follows
            names, _ = outer._known_names()
            where = "given to params.update (params.strays.clear() forgets it)"
            raise unknown("parameter", outer.strays[0], names, where)
        self.table = outer
        prefix = self.prefix
        for key in list(self):
            if is_element(key) and prefix + base_name(key) in outer:
                del self[key]  # an element's default gives way to what the outside says
        for key in [k for k in self if "." in prefix + k and self._means_one(prefix + k, outer)]:
            dict.__setitem__(self, key, outer[prefix + key])
        for name in [n for n in outer if "." not in n or "[" in n]:  # few: bare ones, elements
            local = name.removeprefix(prefix)
            is_own = name.startswith(prefix) and base_name(local) in self
            if "." not in name or (is_own and self._means_one(name, outer)):
                dict.__setitem__(self, local, outer[name])

    @staticmethod
    def _means_one(name: str, outer: Parameters) -> bool:
        """Whether the enclosing diagram has a parameter of one block under that name."""
        return name in outer and not (outer.clashes and base_name(name) in outer.clashes)

    def _override(self, name: str, value: Any) -> None:
        """Set a parameter by a name that a user wrote."""
        if "." not in name:
            path = self._path_of_bare(name)
            if not path:
                dict.__setitem__(self, name, value)
                return
            name = f"{path}.{name}"
        base = base_name(name)
        names, clashes = self._known_names()
        if self.table is None and base in self:
            base = self.prefix + base  # seen from inside the diagram
        full = find_name("parameter", base, names, clashes)
        local = full.removeprefix(self.prefix)
        if not (full.startswith(self.prefix) and local in self):
            return  # another block's
        index = name[len(base_name(name)) :]
        if not index:
            for key in [k for k in self if k != local and base_name(k) == local]:
                del self[key]  # the whole vector replaces elements set before
        if self.block is not None and not self.complete:
            self.block.params = {local + index: value}
        dict.__setitem__(self, local + index, value)

    def _known_names(self) -> tuple[Mapping[str, Any], set[str]]:
        """Return the names that overrides may use here, and those that are ambiguous."""
        if self.table is not None:
            return self.table, self.table.clashes
        return {self.prefix + k: v for k, v in self.items()}, {
            self.prefix + k for k in self.clashes
        }

    def _is_elsewhere(self, name: str) -> bool:
        """Whether a name may mean a block elsewhere: python-control has not given all names yet."""
        is_own = self.block is not None and not self.complete
        known = is_own or self.table is not None or "." not in name
        if known or _same_block(base_name(name), self._known_names()[0]):
            return False
        self.strays.append(name)
        return True

    def _path_of_bare(self, name: str) -> str:
        """Return the path of the block that a name without one means, if it means one."""
        # It is a third-party block's, unless it looks like one of ours cut short.
        names, _ = self._known_names()
        twins = [k for k in names if k.endswith("." + base_name(name))]
        if name in names or not twins:
            return ""
        table = self if self.table is None else self.table
        prefix = self.prefix if self.table is None else ""
        theirs = [k for k in twins if _reads_a_dict(table.owners.get(k.removeprefix(prefix)))]
        if len(theirs) > 1:
            raise AmbiguousNameError(f"parameter '{name}' could be {' or '.join(sorted(theirs))}")
        if theirs:
            return theirs[0].rpartition(".")[0]
        raise UnknownNameError(
            f"unknown parameter '{name}'; parameters carry their block's name: "
            f"{' or '.join(repr(t) for t in twins)} (a block of your own that reads "
            f"'{name}' declares it in its params)"
        )


def _reads_a_dict(block: Any) -> bool:
    """Whether a block is a third-party one, whose parameters may go without its name."""
    return bool(getattr(type(block), "reads_a_dict", False))


def _same_block(name: str, names: Iterable[str]) -> bool:
    """Whether `name` is a parameter, known or not, of a block that has one of `names`."""
    block = name.rpartition(".")[0]
    return any(f".{k.rpartition('.')[0]}".endswith(f".{block}") for k in names)
