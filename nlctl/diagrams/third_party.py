"""Third-party blocks whose parameters go by qualified names, as those of nlctl's blocks do.

python-control has one flat dict of parameters for a diagram: of equal names the last one wins for
every block, and wins over each block's own values.  `with_own_values` gives the blocks of a diagram
values of their own, and `apart` gives a run a diagram of its own.
"""

import copy
import functools
import operator
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any

import control as ct
import numpy as np

from ..blocks import Block, sampling_of, within
from ..errors import ParameterError
from ..names import Parameters, base_name, element_index, is_element
from ..upstream.control_internals import (
    RESOLVED,
    OwnParameters,
    current_parameters,
    set_parameters,
    takes_a_dict,
)
from ..upstream.systems import System
from .places import leaves


def is_third_party(system: System) -> bool:
    """Whether a block has functions of others, which read their parameters from a dict."""
    linear = isinstance(system, ct.StateSpace | ct.InterconnectedSystem)
    is_nonlinear = isinstance(system, ct.NonlinearIOSystem) and not linear
    return is_nonlinear and not isinstance(system, Block) and takes_a_dict(system)


def declared_keys(block: ct.NonlinearIOSystem) -> list[str]:
    """Return the parameters that a third-party block declares, by the names that it reads."""
    return list(block.nlctl_own if isinstance(block, Named) else block.params)


class _TakesADict(OwnParameters):
    """A third-party block that takes its parameters in another way than python-control has it."""

    reads_a_dict = True
    nlctl_base: type
    nlctl_kind: type
    nlctl_overrides: dict[str, Any]

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self).nlctl_kind, type(self).nlctl_base), self.__dict__


class Named(_TakesADict):
    """A third-party block in a diagram of `interconnect`: "P.k" is its own k, and no one else's."""

    nlctl_own: dict[str, Any]  # its parameters, by the names that its functions read

    @property
    def params(self) -> Parameters:
        """Parameters by qualified name.  Assign a dict to change the block's own values."""
        return Parameters({f"{self.name}.{k}": v for k, v in self.nlctl_own.items()}, block=self)

    @params.setter
    def params(self, values: Mapping[str, Any]) -> None:
        self.nlctl_own = self._taken(values or {})
        set_parameters(self, None)

    def _taken(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Return what its functions read: its own values, overridden."""
        values, prefix = dict(self.nlctl_own), f"{self.name}."
        for given in (params, vars(self).get("nlctl_overrides", {})):
            local = {str(name).removeprefix(prefix): value for name, value in given.items()}
            set_keys(values, local, self.name)
        return values


class Overridden(_TakesADict):
    """A third-party block of a run of its own, see `apart`."""

    def _taken(self, params: Mapping[str, Any]) -> dict[str, Any]:
        """Return what its functions read."""
        values = {**self.params, **params}
        set_keys(values, self.nlctl_overrides, self.name)
        return values


def set_keys(values: dict[str, Any], given: Mapping[str, Any], block: str) -> None:
    """Set parameters of a block in a dict, elements behind what they are elements of."""
    for name in sorted(given, key=is_element):
        _set_key(values, name, given[name], block)


def _set_key(values: dict[str, Any], name: str, value: object, block: str) -> None:
    base = base_name(name)
    if base == name or name in values or base not in values:
        values[name] = value
        return
    old = values[base]
    if np.asarray(value).ndim:
        raise ParameterError(f"'{block}.{name}' needs one number, got {value!r}")
    array = np.array(old, dtype=np.result_type(np.asarray(old), np.asarray(value)))
    array[element_index(f"{block}.{name}", array.shape)] = value
    values[base] = array if isinstance(old, np.ndarray) else type(old)(array.tolist())


@functools.cache
def _with(kind: type, base: type) -> type:
    """Return a class of systems of another one that take their parameters in another way."""
    names = {"__module__": base.__module__, "nlctl_kind": kind, "nlctl_base": base}
    derived = type(base.__name__, (kind, base), names)
    derived.__qualname__ = base.__qualname__
    return derived


def _again(kind: type, base: type) -> Any:
    derived = _with(kind, base)
    return object.__new__(derived)


# -- values of their own ---------------------------------------------------------------------------


def with_own_values(system: Any) -> Any:
    """Return a system whose third-party blocks have values of their own; itself if all have."""
    if not any(_lacks_own(within(leaf.system)) for leaf in leaves(system)):
        return system
    given = apart(system)
    set_parameters(given.system, None)
    return _named(system, given)


def _lacks_own(block: ct.NonlinearIOSystem) -> bool:
    if not is_third_party(block) or isinstance(block, Named) or "params" not in vars(block):
        return False
    return bool(block.params) and all(isinstance(k, str) and "." not in k for k in block.params)


def _named(system: Any, given: "Apart") -> Any:
    if isinstance(system, ct.InterconnectedSystem):
        return _named_diagram(system, [_named(part, given) for part in system.syslist])
    block = within(system)
    if not _lacks_own(block):
        return system
    named, values = copy.copy(block), current_parameters(given.of(block))
    declared = {key: values[key] for key in block.params}
    del named.params
    named.__class__ = _with(Named, type(block))
    named.nlctl_own = declared
    set_parameters(named, None)
    if block is system:
        return named
    around = copy.copy(system)
    around.inner = named
    return around


def _named_diagram(diagram: ct.InterconnectedSystem, parts: list[Any]) -> Any:
    """Return a diagram of other parts, with the values that its parameters have."""
    if all(new is old for new, old in zip(parts, diagram.syslist, strict=True)):
        return diagram
    named = copy.copy(diagram)
    named.syslist = parts
    params: Any = functools.reduce(operator.or_, (part.params for part in parts), {})
    keys = {base_name(name).rpartition(".")[2] for name in params}
    for name, value in diagram.params.items():
        if name in params or ("." not in name and name not in keys):
            dict.__setitem__(params, name, value)
    if isinstance(diagram.params, Parameters) and diagram.params.scope is not None:
        params.scope = named
    named.params = params
    return named


# -- a diagram of one's own ------------------------------------------------------------------------


@dataclass(kw_only=True, eq=False)
class Apart:
    """A copy of a diagram in which a run may write its parameters."""

    system: Any
    # blocks and diagrams with their copies, by identity.  Linear systems are not copied: they have
    # no parameters
    pairs: dict[int, tuple[Any, Any]]

    def of(self, thing: object) -> Any:
        """Return the copy of a block or diagram; anything else as it is."""
        return self.pairs.get(id(thing), (thing, thing))[1]

    def refreshed(self) -> bool:
        """Take over what was changed in the original; whether it still has the same parts."""
        for old, new in self.pairs.values():
            if any(self.of(part) is not copied for part, copied in _parts(old, new)):
                return False
            kept, state = own_attributes(old), vars(old)
            for name in [k for k in vars(new) if k not in state and k not in kept]:
                del new.__dict__[name]
            new.__dict__.update({k: v for k, v in state.items() if k not in kept})
            self.connect(old, new)
        return True

    def connect(self, old: object, new: ct.NonlinearIOSystem) -> None:
        """Give a diagram's copy the parameters of the diagram, of the copies of its blocks."""
        params = getattr(old, "params", None)
        if not isinstance(old, ct.InterconnectedSystem) or not isinstance(params, Parameters):
            return
        new.params = copy.copy(params)
        new.params.owners = {name: self.of(owner) for name, owner in params.owners.items()}
        new.params.scope = self.of(params.scope)


def apart(system: System) -> Apart:
    """Return a copy of a diagram, with copies of its blocks."""
    copies = Apart(system=None, pairs={})

    def copied(old: Any) -> Any:
        if not isinstance(old, ct.NonlinearIOSystem) or isinstance(old, ct.StateSpace):
            return old
        if id(old) in copies.pairs:
            return copies.pairs[id(old)][1]
        new: Any = copy.copy(old)
        copies.pairs[id(old)] = old, new
        if isinstance(old, ct.InterconnectedSystem):
            new.syslist = [copied(part) for part in old.syslist]
        elif within(old) is not old:
            new.inner, new.sampling = copied(within(old)), copied(sampling_of(old))
        elif is_third_party(old) and not isinstance(old, _TakesADict):
            new.__class__ = _with(Overridden, type(old))
        if isinstance(new, _TakesADict):
            new.nlctl_overrides = {}
        return new

    copies.system = copied(system)
    for old, new in list(copies.pairs.values()):
        copies.connect(old, new)
    return copies


def own_attributes(old: ct.NonlinearIOSystem) -> set[str]:
    """Return the attributes that a copy has of its own."""
    kept = {*RESOLVED, "nlctl_overrides"}
    if isinstance(old, Block):
        return kept | {"current_spec"}
    if isinstance(old, ct.InterconnectedSystem):
        return kept | {"syslist"}
    return kept if within(old) is old else kept | {"inner", "sampling"}


def _parts(old: Any, new: Any) -> Iterator[tuple[Any, Any]]:
    """Yield parts of a diagram or of a sampled block with those of its copy."""
    if isinstance(old, ct.InterconnectedSystem):
        yield from zip_longest(old.syslist, new.syslist)
    elif within(old) is not old:
        yield within(old), within(new)
        yield sampling_of(old), sampling_of(new)
