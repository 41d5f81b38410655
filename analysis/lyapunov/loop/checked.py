"""A loop that was read by its wiring, and compared with the same blocks connected by name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import control as ct
import numpy as np
from flint import arb

from nlctl.blocks import block
from nlctl.diagrams import initial_state, interconnect, overridden, state_names
from nlctl.errors import DiagramError, ParameterError
from nlctl.names import unknown
from nlctl.params import as_numbers

from ...intervals.arithmetic import Ball
from ...intervals.branch_and_bound import upper
from ..bounds.decomposition import Decomposition
from ..bounds.starts import Sides, Starts, read_starts
from .plant_form import Acceleration, acceleration, check_chain
from .roles import (
    UNREAD_CONTENT,
    LoopContent,
    Pieces,
    Roles,
    check_kind,
    joined_again,
    loop_content,
    read_roles,
)
from .same_loop import check_same, points_around

ADDED = "declared bounds of external inputs, times their gains"


def bound_of_inputs(
    roles: Roles, inputs: Mapping[str, float], loop: ct.InterconnectedSystem
) -> float:
    """Return the bound of what external inputs add to v."""
    for name, value in inputs.items():
        if name not in roles.disturbances:
            raise unknown("external input", name, loop.input_labels, "that is added to v")
        number = as_numbers(value)
        if number is None or number.ndim or not 0 <= number < np.inf:
            raise ParameterError(f"certify needs a finite bound >= 0 of '{name}', got {value!r}")
    for name in roles.disturbances:
        if name not in inputs:
            raise DiagramError(
                f"external input '{name}' is added to the plant's v, and may be anything: declare "
                f"its bound, certify(loop, inputs={{'{name}': 0.1}}), or take it away"
            )
    return upper(
        sum((arb(abs(gain)) * inputs[name] for name, gain in roles.disturbances.items()), arb(0))
    )


def disturbed(split: Decomposition, bound: float) -> Decomposition:
    """Return the split of v = k u + (eps_u + w) with external inputs |w| <= bound."""
    if not bound:
        return split
    w = Ball(arb(bound))
    return dataclasses.replace(
        split,
        eps_low=-upper(w - split.eps_low),
        eps_high=upper(w + split.eps_high),
        how=f"{split.how}; external inputs add {bound:g} at most",
    )


@dataclass(frozen=True, kw_only=True)
class Supposed:
    """What a proof supposes of a loop besides what the loop itself says; see `certify`."""

    params: Mapping[str, Any] | None = None
    inputs: Mapping[str, float] | None = None
    starts: Any = None


NOTHING_SUPPOSED = Supposed()


@dataclass(frozen=True, kw_only=True)
class CheckedLoop:
    """What a loop is made of, after every check that does not depend on the proof."""

    roles: Roles  # places of the blocks, with the parameters of the run
    disturbance: float  # bound of what external inputs add to the plant's v
    starts: Starts  # initial states that the proof shall be about
    # x_n' as ``acceleration(t, x, v)``: the last entry of the plant's own update
    acceleration: Acceleration
    content: LoopContent = field(repr=False)  # what the loop consists of
    # a copy of the loop, with the parameters of the run
    given: ct.InterconnectedSystem = field(repr=False)
    # the loop, connected again by name, with all its signals as outputs
    understood: ct.InterconnectedSystem = field(repr=False)

    def spec(self, part: str) -> Any:
        """Return the record of a part, with the parameters of the run."""
        return self.roles.spec(part)

    def start(self, part: str) -> Sides:
        """Return the ends of the initial states of a part."""
        place = self.roles.places[part]
        return self.starts.sides(place.state_offset, place.system.nstates or 0)


def read_checked(
    loop: ct.InterconnectedSystem,
    pieces: Pieces,
    kinds: Mapping[str, tuple[type, ...]],
    given: Supposed,
    free: tuple[str, ...] = (),
) -> CheckedLoop:
    """Read a loop by its wiring, in a copy whose blocks have the parameters of the run."""
    content, params = UNREAD_CONTENT, given.params
    if isinstance(loop, ct.InterconnectedSystem):  # else it is refused
        content = loop_content(loop, params)
        loop = overridden(loop, params)
    roles = read_roles(loop, pieces, content.functions)
    disturbance = bound_of_inputs(roles, given.inputs or {}, loop)
    for part, records in kinds.items():
        if part in roles.places:  # a network may be left out
            check_kind(roles.places[part], records)
    check_chain(roles.places["plant"])
    begins = read_starts(
        loop,
        given.starts,
        free=tuple(name for part in free for name in _states(loop, roles, part)),
        kept=_states(loop, roles, "actuator"),
    )
    again = joined_again(loop, roles, lambda part, spec, name: block(spec, name))
    understood = interconnect(again, name=str(loop.name))
    check_same(loop, understood, _compared_at(loop, begins), params, content=content)
    return CheckedLoop(
        roles=roles, disturbance=disturbance, starts=begins, content=content, given=loop,
        acceleration=acceleration(roles.places["plant"]), understood=understood,
    )  # fmt: skip


def _states(loop: ct.InterconnectedSystem, roles: Roles, part: str) -> tuple[str, ...]:
    """Return the states of a part, by path."""
    place = roles.places[part]
    return tuple(state_names(loop)[place.state_offset :][: place.system.nstates or 0])


def _compared_at(loop: ct.InterconnectedSystem, starts: Starts) -> list[tuple[float, np.ndarray]]:
    """Return times and states: around the loop's own start, and the corners of all starts."""
    points = points_around(initial_state(loop))
    return points if starts.is_point else points + [(0.0, x) for x in starts.points()]
