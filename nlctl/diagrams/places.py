"""Where blocks stand in a diagram: their paths, and their states in its state vector."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..blocks import Block, default_state, supplied_of, within
from ..errors import DiagramError, ParameterError
from ..names import Parameters, find_name
from ..params import as_numbers
from ..supplied import Supplied
from ..upstream.control_internals import StandIn
from ..upstream.systems import System


@dataclass(frozen=True, kw_only=True, eq=False)
class Place:
    """Where a block or diagram stands: one system may stand in a diagram twice."""

    # names of the diagrams around it and its own, separated by dots; empty for the outermost
    # diagram
    path: str
    # the same without diagrams that do not put their name in front of their parameters' (those made
    # with plain ``ct.interconnect``)
    parameter_path: str
    system: Any  # a diagram or a block; only diagrams have maps and offsets
    state_offset: int  # where its states begin in the outermost diagram's state vector
    parent: Place | None  # the diagram around it, and ...
    position: int  # ... its position in that diagram's ``syslist``


def places(
    system: System, parent: Place | None = None, position: int = 0, offset: int = 0
) -> Iterator[Place]:
    """Yield a system's place and then, in the order of the state vector, those of its parts."""
    nested = isinstance(system, ct.InterconnectedSystem)
    outer, outer_parameters = ("", "") if parent is None else (parent.path, parent.parameter_path)
    name = "" if nested and parent is None else system.name
    silent = nested and not _is_scoped(system)
    here = Place(
        path=f"{outer}.{name}" if outer else name,
        parameter_path=".".join(p for p in (outer_parameters, "" if silent else name) if p),
        system=system,
        state_offset=offset,
        parent=parent,
        position=position,
    )
    yield here
    for i, part in enumerate(system.syslist if nested else ()):
        yield from places(part, here, i, offset)
        offset += part.nstates or 0


def leaves(system: ct.InputOutputSystem) -> Iterator[Place]:
    """Yield the blocks of a diagram in the order of its state vector, nested ones flattened.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Yields
    ------
    Place
        Of a block; diagrams are left out.
    """
    for place in places(system):
        if not isinstance(place.system, ct.InterconnectedSystem):
            yield place


def _is_scoped(diagram: ct.InterconnectedSystem) -> bool:
    """Whether a diagram puts its name in front of its parameters' names."""
    return isinstance(diagram.params, Parameters) and diagram.params.scope is not None


def supplied_blocks(system: Any, how: Supplied | None = None) -> list[Block]:
    """Return the blocks whose outputs are supplied, in the order of the diagram, each once."""
    supplied: dict[int, Block] = {}
    for leaf in leaves(system):
        inner = within(leaf.system)
        supply = supplied_of(inner)
        if supply is None or how not in (None, supply):
            continue
        kind = type(inner.spec).__name__
        if inner is not leaf.system or not ct.isctime(system) or inner.dt not in (0, None):
            raise DiagramError(f"block '{leaf.path}' is {_a(kind)}, which {supply.continuous}")
        if id(inner) in supplied:
            raise DiagramError(
                f"{kind} '{leaf.path}' stands in '{system.name}' twice, with one {supply.shared} "
                "for both: make a block of each"
            )
        supplied[id(inner)] = inner
    return list(supplied.values())


def _a(noun: str) -> str:
    return f"an {noun}" if noun[0] in "AEIOU" else f"a {noun}"


def known_system(who: str, system: System) -> Any:
    """Return a block or diagram; of a compiled diagram that which was compiled."""
    inner = system.system if isinstance(system, StandIn) else system
    if not isinstance(inner, ct.InputOutputSystem):
        raise ParameterError(not_a_system(who, system))
    return inner


def not_a_system(who: str, thing: object) -> str:
    """Return the sentence that refuses what is neither a block nor a diagram."""
    return (
        f"{who} needs a block or diagram, got {type(thing).__name__}: nlctl.block makes a block of "
        "a record"
    )


@as_annotated
def state_names(system: ct.InputOutputSystem) -> list[str]:
    """Return the qualified names of all states, ``"controller.law.zeta"``, in vector order.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Returns
    -------
    list of str
        One for each state.

    Examples
    --------
    >>> state_names(nlctl.block(nlctl.Backlash(), "actuator"))
    ['actuator.memory']
    """
    system = known_system("state_names", system)
    return [f"{leaf.path}.{s}" for leaf in leaves(system) for s in leaf.system.state_labels]


@as_annotated
def initial_state(
    system: ct.InputOutputSystem, values: Mapping[str, float] | None = None
) -> np.ndarray:
    """Return the initial state of a block or diagram.

    Every block starts from what its record declares (the paper's values), states of third-party
    blocks start from 0; `values` replaces some of them.

    Parameters
    ----------
    system : control.InputOutputSystem
        Block or diagram.
    values : mapping, optional
        ``{"plant.x1": 0.8}``.  A name is the path of blocks to the state, or the end of one.

    Returns
    -------
    ndarray of shape (nstates,)
        For ``ct.input_output_response(system, timepts, 0, initial_state(system))``.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one state.
    ParameterError
        If a value is not a finite number.

    Examples
    --------
    >>> print(initial_state(nlctl.block(nlctl.Backlash(v0=0.2), "actuator")))
    [0.2]
    """
    system = known_system("initial_state", system)
    if not isinstance(values, Mapping | None):
        raise ParameterError(
            f"initial_state needs values by name, {{'plant.x1': 0.8}}, got {type(values).__name__}"
        )
    x = np.concatenate([default_state(leaf.system) for leaf in leaves(system)])
    if not values:
        return x
    index = {name: i for i, name in enumerate(state_names(system))}
    for name, value in values.items():
        full = find_name("state", name, index)
        number = as_numbers(value)
        if number is None or number.ndim or not np.isfinite(number):
            raise ParameterError(f"state '{full}' needs a finite initial value, got {value!r}")
        x[index[full]] = number
    return x
