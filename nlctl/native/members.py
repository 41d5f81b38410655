"""The members of an ensemble: arrays by name in, states and parameter vectors out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from ..blocks import Block
from ..diagrams import initial_state, state_names
from ..diagrams.addresses import divided
from ..errors import ParameterError, UsageError
from ..names import Parameters, base_name, find_name
from ..params import as_numbers, equation_arguments, with_overrides
from ..responses.arguments import state_array
from .compiled import Compiled
from .diagram.parameters import Slot, filled

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Members:
    """What differs between the runs of an ensemble."""

    compiled: Compiled
    # values by name, each one number or an array with an entry per member
    params: Mapping[str, np.ndarray]
    states: Mapping[str, np.ndarray]
    size: int  # number of members

    def batch(self, numbers: range, width: int) -> tuple[np.ndarray, np.ndarray]:
        """Return initial states (states, width) and parameter vectors (parameters, width)."""
        # Where there are fewer members, the last one is repeated.
        chosen = np.minimum(np.arange(numbers.start, numbers.start + width), numbers.stop - 1)
        x0 = np.repeat(self._first_state[:, None], width, axis=1)
        for name, values in self.states.items():
            x0[self._rows[name]] = values[chosen] if values.ndim else values
        p = np.repeat(self._first_vector[:, None], width, axis=1)
        places, varied = self.varied
        p[places] = varied[:, chosen]
        return x0, p

    def given(self, number: int) -> dict[str, Any]:
        """Return a member's parameters, as python-control takes them."""
        return {name: _one(values, number) for name, values in self.params.items()}

    def table(self, order: list[int]) -> pd.DataFrame:
        """Return what was varied, one row for each of these members."""
        import pandas as pd

        columns = {**self.params, **{f"{k}(0)": v for k, v in self.states.items()}}
        varied = {k: np.broadcast_to(v, (self.size, *v.shape[1:])) for k, v in columns.items()}
        return pd.DataFrame({k: list(v[order]) for k, v in varied.items()}, index=order)

    @cached_property
    def varied(self) -> tuple[np.ndarray, np.ndarray]:
        """Places in the parameter vector that vary, and their values (places, members)."""
        # nlctl's blocks check and derive their own parameters, and only those that vary do; third-
        # party parameters go through python-control, member by member.
        owners = self._owners
        if owners is None:
            places = np.arange(self._first_vector.size)
        else:
            slots = [slot for _, own, _ in owners for slot in own.values()]
            places = np.array(
                [k for s in slots for k in range(s.offset, s.offset + s.size)], dtype=int
            )
        values, p = np.empty((places.size, self.size)), self._first_vector.copy()
        for number in range(self.size) if places.size else ():
            try:
                self._fill(p, number, owners)
            except UsageError as error:
                raise ParameterError(f"{error} (member {number})") from None
            values[:, number] = p[places]
        return places, values

    def _fill(self, p: np.ndarray, number: int, owners: Any) -> None:
        """Write a member's parameters into a parameter vector."""
        if owners is None:
            p[:] = self.compiled.parameter_vector(self.given(number))
            return
        for block, slots, names in owners:
            given = {key: _one(self.params[name], number) for key, name in names.items()}
            values = equation_arguments(with_overrides(block.current_spec, given, block.name))
            for name, slot in slots.items():
                filled(p, slot, getattr(values, name))

    @cached_property
    def _rows(self) -> dict[str, int]:
        return {name: i for i, name in enumerate(state_names(self.compiled.system))}

    @cached_property
    def _first_state(self) -> np.ndarray:
        return initial_state(self.compiled.system)

    @cached_property
    def _first_vector(self) -> np.ndarray:
        """Parameters of the first member; python-control has checked their names."""
        try:
            return self.compiled.parameter_vector(self.given(0))
        except ParameterError as error:
            raise ParameterError(f"{error} (member 0)") from None

    @cached_property
    def _owners(self) -> list[tuple[Block, Mapping[str, Slot], dict[str, str]]] | None:
        """Blocks whose parameters vary, with their places; None if third-party ones do."""
        self._first_vector  # noqa: B018 (names and fixed values are resolved first)
        diagram = self.compiled.schedule.system
        known = diagram.params
        if divided(diagram, self.given(0)).alone:
            return None
        nodes = [node.system for node in self.compiled.schedule.holders]
        found: dict[int, dict[str, str]] = {}
        for name, values in self.params.items():
            if not values.shape[:1]:
                continue
            if not isinstance(known, Parameters) or "." not in name:
                return None
            full = find_name("parameter", base_name(name), known, known.clashes)
            owner = known.owners.get(full)
            index = next((i for i, system in enumerate(nodes) if system is owner), None)
            if index is None or not isinstance(owner, Block):
                return None
            key = full.rpartition(".")[2] + name[len(base_name(name)) :]
            found.setdefault(index, {})[key] = name
        layout = self.compiled.program.layout
        return [(nodes[i], layout[i], names) for i, names in found.items()]


def members(compiled: Compiled, params: Mapping[str, Any], states: object) -> Members:
    """Gather the members of an ensemble."""
    if states is not None and not isinstance(states, Mapping):
        states = _by_name(compiled.system, states)
    index = dict.fromkeys(state_names(compiled.system))
    values = {name: np.asarray(value) for name, value in params.items()}
    initial = {}
    for name, value in (states or {}).items():
        full = find_name("state", name, index)
        initial[full] = _finite(full, value)
    columns = {**values, **{f"{k}(0)": v for k, v in initial.items()}}
    sizes = {name: array.shape[0] for name, array in columns.items() if array.ndim}
    if len(set(sizes.values())) > 1:
        raise ParameterError(f"an ensemble needs arrays of one length, got {sizes}")
    size = next(iter(sizes.values()), 1)
    if size == 0:
        raise ParameterError(
            f"an ensemble needs at least one member, got no values of '{next(iter(sizes))}'"
        )
    return Members(compiled=compiled, params=values, states=initial, size=size)


def _by_name(system: ct.NonlinearIOSystem, states: object) -> dict[str, np.ndarray]:
    """Return states by name that are given as one state, or as a row for each member."""
    # States that no member changes are left out.
    given = as_numbers(states)
    if given is not None and given.ndim == 2:
        rows = np.array([_member_state(system, k, row) for k, row in enumerate(given)])
    else:
        rows = state_array(system, states)
    own = initial_state(system)
    columns = rows.reshape(-1, own.size).T
    changed = np.flatnonzero((columns != own[:, None]).any(axis=1))
    if rows.ndim == 2 and rows.size and not changed.size:
        changed = np.arange(1)  # the number of members is known by it
    names = state_names(system)
    return {names[i]: columns[i] if rows.ndim == 2 else columns[i, 0] for i in changed}


def _member_state(system: ct.NonlinearIOSystem, number: int, row: np.ndarray) -> np.ndarray:
    try:
        return state_array(system, row)
    except ParameterError as error:
        raise ParameterError(f"{error} (member {number}); a row is a member") from None


def _finite(name: str, value: object) -> np.ndarray:
    """Return the initial values of a state."""
    array = as_numbers(value)
    if array is None or array.ndim > 1:
        raise ParameterError(
            f"initial_state of '{name}' needs a number, or one for each member, got {value!r}"
        )
    for i in np.flatnonzero(~np.isfinite(array))[:1]:
        where = f", member {i}" if array.ndim else ""
        raise ParameterError(
            f"initial_state has {array.flat[i]} at '{name}'{where}: "
            "every state needs a finite number"
        )
    return array


def _one(values: np.ndarray, number: int) -> Any:
    return values[number] if values.ndim else values[()]
