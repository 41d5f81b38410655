"""Qualified names (``"actuator.b_r"``) that survive python-control's parameter handling.

python-control keeps one flat parameter dict per diagram: of equal names the last one wins for
every block (0.10.2), and unknown names are ignored.  A `Parameters` dict goes through exactly
those operations (``|``, ``copy``, ``update``) and does the right thing in each, so that an
ordinary diagram made with ``ct.interconnect`` takes qualified names without being patched.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

import control as ct

from ._errors import AmbiguousNameError, UnknownNameError


def unknown(kind: str, name: str, known: Iterable[str], where: str = "") -> UnknownNameError:
    """Make the error for an unknown `name`: it says what exists, nearest first."""
    known = list(known)
    near = difflib.get_close_matches(name, known, n=3, cutoff=0.5)
    if near:
        hint = "nearest: " + ", ".join(f"'{n}'" for n in near)
    else:
        hint = "known: " + (", ".join(f"'{n}'" for n in sorted(known)[:12]) or "none")
    return UnknownNameError(f"unknown {kind} '{name}'{where and ' ' + where}; {hint}")


def base_name(name: str) -> str:
    """Return a parameter's name without an element index: ``"c.lambdas[0]"`` -> ``"c.lambdas"``."""
    return name.partition("[")[0]


def find_name(kind: str, name: str, known: Mapping[str, Any], clashes: Iterable[str] = ()) -> str:
    """Return the one key of `known` that `name` means: the full path, or the end of one path.

    Raises
    ------
    UnknownNameError
        If nothing has that name; the nearest names are given.
    AmbiguousNameError
        If several paths end in `name`, or two blocks share it.
    """
    matches = [name] if name in known else [k for k in known if k.endswith("." + name)]
    if not matches:
        raise unknown(kind, name, known)
    if len(matches) > 1:
        raise AmbiguousNameError(f"{kind} '{name}' could be {' or '.join(sorted(matches))}")
    if matches[0] in clashes:
        raise AmbiguousNameError(
            f"{kind} '{name}' belongs to two blocks of this diagram with the same name; "
            "give the blocks different names, or join the inner diagrams with "
            "nlctl.interconnect(..., name=...), which puts their name in front"
        )
    return matches[0]


class Parameters(dict):
    """``{qualified name: value}`` of a block or diagram, for use as python-control ``params``.

    Attributes
    ----------
    scope : control.InputOutputSystem or None
        Diagram whose name is put in front of every key when the diagram is nested in another.
    of_block : bool
        Whether these are the parameters of one block (and not of a diagram).
    clashes : set of str
        Keys that stand for two different blocks.  Each block then keeps its own value, and an
        override of such a name is refused.
    table : Parameters or None
        The enclosing diagram's parameters, known while python-control hands overrides down.
    """

    def __init__(self, values: Mapping[str, Any], owner: object = None) -> None:
        super().__init__(values)
        self.owners: dict[str, object] = dict.fromkeys(values, owner)
        self.of_block = owner is not None
        self.clashes: set[str] = set()
        self.scope: ct.InputOutputSystem | None = None
        self.table: Parameters | None = None

    @property
    def prefix(self) -> str:
        """What the enclosing diagram puts in front of the keys of this one."""
        return f"{self.scope.name}." if self.scope is not None else ""

    def copy(self) -> Parameters:
        """Return a copy (python-control copies defaults before it overrides them)."""
        new = Parameters(self)
        new.owners, new.clashes = self.owners.copy(), self.clashes.copy()
        new.scope, new.table, new.of_block = self.scope, self.table, self.of_block
        return new

    def __or__(self, other: Mapping[str, Any]) -> Parameters:  # type: ignore[override]
        new = self.copy()
        new.scope, new.of_block = None, False
        new._absorb(other)
        return new

    def __ror__(self, other: Mapping[str, Any]) -> Parameters:  # type: ignore[override]
        new = Parameters(other)
        new._absorb(self)
        return new

    def _absorb(self, other: Mapping[str, Any]) -> None:
        """Add the parameters of one more subsystem; note names that two blocks share."""
        if not isinstance(other, Parameters):  # a foreign block: python-control's own rule
            super().update(other)
            return
        self.clashes |= {other.prefix + key for key in other.clashes}
        for key, value in other.items():
            name, owner = other.prefix + key, other.owners.get(key)
            if owner is not None and self.owners.get(name, owner) is not owner:
                self.clashes.add(name)
            self.owners[name] = owner
            self[name] = value

    def update(self, other: Mapping[str, Any] | None = None, /, **kwargs: Any) -> None:  # type: ignore[override]
        """Override values: with the defaults of the enclosing diagram, or with a user's dict."""
        if isinstance(other, Parameters):
            self._inherit(other)
            return
        for name, value in {**(other or {}), **kwargs}.items():
            self._override(name, value)

    def _inherit(self, outer: Parameters) -> None:
        """Take over the values that the enclosing diagram has for these parameters."""
        self.table = outer
        for name, value in outer.items():
            own = name.removeprefix(self.prefix)
            is_own = name.startswith(self.prefix) and base_name(own) in self
            if (is_own and base_name(name) not in outer.clashes) or "." not in name:
                self[own] = value

    def _override(self, name: str, value: Any) -> None:
        if "." not in name:
            self._refuse_bare_twin(name)
            self[name] = value
            return
        table = self if self.table is None else self.table
        if self.table is None and self.of_block and not self._same_block(name):
            return  # the diagram was given plain-dict params, and this one is another block's
        full = find_name("parameter", base_name(name), table, table.clashes)
        own = full.removeprefix(self.prefix) if table is not self else full
        if own in self and (table is self or full.startswith(self.prefix)):
            self[own + name[len(base_name(name)) :]] = value

    def _same_block(self, name: str) -> bool:
        """Whether `name` begins with the name of the block whose parameters these are."""
        return base_name(name).rpartition(".")[0] in {k.rpartition(".")[0] for k in self}

    def _refuse_bare_twin(self, name: str) -> None:
        """A bare name is a foreign block's, unless it looks like one of ours cut short."""
        table = self if self.table is None else self.table
        twins = [k for k in table if k.endswith("." + base_name(name))]
        if name not in table and twins:
            raise UnknownNameError(
                f"unknown parameter '{name}'; parameters carry their block's name: "
                f"{' or '.join(repr(t) for t in twins)} (a block of your own that reads "
                f"'{name}' declares it in its params)"
            )
