"""A diagram read as a model of FMI; what such a model cannot be is refused by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np

from ... import native
from ...diagrams import initial_state as state_of
from ...diagrams import supplied_blocks
from ...errors import CompileError
from ...native import Compiled
from ...native.diagram.program import clocks_at, slots_of_clocks
from ...native.floats import with_every_float
from ...native.timed.ahead import ahead
from ...sampling.clock import Clock, schedules
from ...sliding.relay import SLIDING
from ...wording import counted
from ..words import c_name, check_integers, check_written_out, refuse_if_any
from .records import Happenings, Model
from .variables import all_variables, value_references

_MOST_SERIES = 31  # of instants of samples: bits of a number


def read_model(
    diagram: Any,
    params: Mapping[str, Any] | None,
    initial_state: Mapping[str, float] | None,
    name: str | None,
    stop_time: float,
    tolerance: float,
) -> Model:
    """Return what an FMU of a diagram is made of."""
    compiled = with_every_float(native.compile(diagram))
    system, what, program = compiled.system, str(compiled.system.name), compiled.program
    p = compiled.parameter_vector(params)
    _check(compiled, what, p)
    start, lowered = state_of(system, initial_state), compiled.lowered
    check_integers(compiled, p, what)
    happenings = _happenings(compiled, p, stop_time, what)
    rows = lowered.rows
    at = value_references(rows["x"], rows["u"], rows["y"], rows["g"] + len(program.memory), p.size)
    fixed = _fixed(compiled)
    still = {*program.memory, *program.sampled}
    return Model(
        name=c_name(name, what), meaning=what,
        variables=tuple(all_variables(compiled, system, at, p, start, fixed)), places=at,
        continuous=tuple(i for i in range(rows["x"]) if i not in still), memory=program.memory,
        sampled=program.sampled, declared=program.switching, guards=program.guards,
        jumping=program.jumping, parameters=p, start=start, happenings=happenings,
        lowered=lowered, tolerance=tolerance, stop_time=stop_time,
    )  # fmt: skip


def _check(compiled: Compiled, what: str, p: np.ndarray) -> None:
    """Refuse what the C of an FMU cannot say."""
    check_written_out(compiled, what, p)
    is_continuous = ct.isctime(compiled.system)
    refuse_if_any(what, {
        "is in discrete time; put it into a diagram by nlctl.sampled": not is_continuous,
        "has transport delays": bool(compiled.schedule.lines),
    })  # fmt: skip
    for relay in supplied_blocks(compiled.system, SLIDING):
        raise CompileError(
            f"'{what}' cannot be exported: block '{relay.name}' is an ideal relay, whose sliding "
            "an importer does not know; nlctl.Relay has a hysteresis"
        )
    beyond = compiled.lowered.conditions.beyond
    refuse_if_any(what, {f"has {counted(beyond, 'condition')} more than are located": beyond > 0})


def _fixed(compiled: Compiled) -> set[int]:
    """Return the places of parameters that hold at export alone: of clocks, of instants, of loops.

    And those that steer which equations there are.
    """
    fixed = {*compiled.lowered.assumed, *compiled.lowered.timed.parameters.tolist()}
    clocks = slots_of_clocks(compiled.schedule, compiled.program)
    return fixed | {slot.offset for slots in clocks for slot in slots.values()}


def _happenings(compiled: Compiled, p: np.ndarray, stop_time: float, what: str) -> Happenings:
    """Return when something happens in it."""
    clocks = clocks_at(compiled.schedule, compiled.program, p)
    series, meetings = _series(clocks, compiled, what)
    timed = compiled.lowered.timed
    known = ahead(timed, p[:, None], np.array([0.0, stop_time]), np.inf)
    pairs = zip(known["until"][0].tolist(), known["jumps"][0].tolist(), strict=True)
    longest = float(known["longest"][0])
    reach = known["reach"][0]
    if reach.size:  # no step may pass over half of a pulse, wherever it begins
        begins = np.linspace(0.0, stop_time, reach.size + 1)[:-1]
        longest = min(longest, float(np.min(reach - begins)))
    return Happenings(
        series=series, meetings=meetings, breaks=tuple(pair for pair in pairs if pair[1] < np.inf),
        known_until=stop_time if timed.conditions.of_time else np.inf, longest=longest,
    )  # fmt: skip


def _series(
    clocks: Mapping[Any, Clock], compiled: Compiled, what: str
) -> tuple[tuple[tuple[int, int, int], ...], tuple[int, ...]]:
    """Return the instants of clocks, and of each meeting which of these meet."""
    for clock in clocks.values():
        if clock.jitter:
            raise CompileError(
                f"'{what}' cannot be exported: a clock has a jitter of {clock.jitter:g} s, random "
                "times that are the computer's; set it to 0"
            )
    series = schedules(clocks)
    largest = max((max(numbers) for numbers, _ in series), default=0)
    if len(series) > _MOST_SERIES or largest >= 2**40:
        raise CompileError(
            f"'{what}' cannot be exported: its clocks have instants in parts of 1/{largest} s, or "
            f"{len(series)} different ones, more than its C counts; round their times"
        )
    meetings = tuple(
        sum(1 << k for k, (_, together) in enumerate(series) if together <= meeting)
        for meeting in compiled.program.meetings
    )
    return tuple(numbers for numbers, _ in series), meetings
