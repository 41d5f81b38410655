"""A loop that was read by its wiring, and compared with the same blocks connected by name.

The plant's own equations on balls: that it is a chain of integrators, and what drives its end.

A record's f and d say what the plant should be; what a run integrates is `update`.  The
certificate encloses the latter, so that nothing rests on the two being the same.

Whether a loop as the proof understands it is the loop that was given.

Before anything is said, derivatives and outputs of both are compared, by python-control's own
evaluation (`nlctl.diagrams.points`), at the initial state, around it and wherever a run has been.
What was compared and agreed is remembered by the content of the loop: the same comparison of the
same functions, wiring and values is made at its first point only.  With other values it is made at
every eighth one, if both loops consist of the same functions with the same values, block by block:
they can only differ in their wiring then, and that has no values.
"""

import dataclasses
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import control as ct
import numpy as np
from flint import arb

from nlctl.blocks import Block, block
from nlctl.diagrams import Place, initial_state, interconnect, leaves, overridden, state_names
from nlctl.diagrams.points import (
    PointFunction,
    PointValues,
    agree,
    explained,
    first_difference,
    rates_and_outputs,
)
from nlctl.errors import CompileError, DiagramError, ParameterError, UsageError
from nlctl.expressions.arrays import Tracer, concatenated, traced
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.names import unknown
from nlctl.native.diagram.checks import check_functions
from nlctl.native.enclosures.boxes import traced_numbers
from nlctl.native.machine.fingerprint import content_of
from nlctl.params import as_numbers
from nlctl.plants import coordinate_names
from nlctl.upstream.control_internals import current_parameters

from ...intervals.agreement import on_balls
from ...intervals.arithmetic import Ball, as_ball
from ...intervals.branch_and_bound import upper
from ...intervals.paths import Undecided, every_way
from ...loop_record import array_text, text_key
from ..bounds.decomposition import Decomposition
from ..bounds.starts import Sides, Starts, read_starts
from .roles import (
    UNREAD_CONTENT,
    LoopContent,
    Pieces,
    Remembered,
    Roles,
    check_kind,
    joined_again,
    loop_content,
    read_roles,
)

_Point = tuple[float, np.ndarray]
_COUNT, SPREADS = 8, (0.03, 0.3, 1.0)  # points of each spread
LATEST = 1e4  # s
_AGREED = Remembered()


def points_around(x: np.ndarray, *, seed: int = 0) -> list[_Point]:
    """Return times and states at which loops are compared: the start, and points around it."""
    # Shapes: `x` (n,).
    rng = np.random.default_rng(seed)
    points = [(0.0, x)]
    for spread in SPREADS:
        times = np.concatenate(
            [rng.uniform(0, 20, _COUNT // 2), rng.uniform(0, LATEST, _COUNT // 2)]
        )
        points += [(float(t), x + spread * rng.standard_normal(x.size)) for t in times]
    return points


def check_same(
    given: ct.InterconnectedSystem,
    understood: ct.InterconnectedSystem,
    points: Iterable[_Point],
    params: Mapping[str, Any] | None = None,
    read_params: Mapping[str, Any] | None = None,
    content: LoopContent = UNREAD_CONTENT,
) -> None:
    """Compare a loop with the proof's reading of it, at points; `content` is of the loop."""
    points = list(points)
    comparisons = _comparisons(content, points)
    points = points[:: _step(given, understood, comparisons, len(points))]
    names, u = state_names(given), np.zeros(given.ninputs or 0)
    more = np.zeros((understood.nstates or 0) - (given.nstates or 0))
    shared = [label for label in given.output_labels if label in understood.output_labels]
    rows, others = (
        np.array([s.output_labels.index(label) for label in shared], dtype=int)
        for s in (given, understood)
    )
    what = [*(f"d/dt {name}" for name in names), *(f"output '{label}'" for label in shared)]
    one, other = _named(given, params), _named(understood, read_params)

    def as_given(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        rates, outputs = one(t, x, u)
        return (np.concatenate([rates, outputs[rows]]),)

    def read(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        rates, outputs = other(t, np.append(x, more), u[:0])
        return (np.concatenate([rates[: x.size], outputs[others]]),)

    with np.errstate(all="ignore"):
        for t, x in points:
            _compare(given, (as_given, read), (t, x, u), what)
    for comparison in comparisons:
        _AGREED.add(comparison)


def _comparisons(content: LoopContent, points: list[_Point]) -> list[str]:
    """Return keys of a comparison: with these values, and with any."""
    where = f" {[(t, array_text(x)) for t, x in points]}"
    return [key and text_key(key + where) for key in (content.key, content.functions)]


def _step(given: object, understood: object, comparisons: list[str], count: int) -> int:
    """Return the step from a point that is still to be compared to the next."""
    if comparisons[0] in _AGREED:
        return max(count, 1)
    return _COUNT if comparisons[1] in _AGREED and _has_same_blocks(given, understood) else 1


def _has_same_blocks(given: Any, understood: Any) -> bool:
    """Whether both consist of the same functions and records, block by block."""
    one, other = ({place.path: place.system for place in leaves(s)} for s in (given, understood))
    return one.keys() == other.keys() and all(
        type(a) is type(other[path]) is Block
        and a.current_spec is other[path].current_spec
        and a.outfcn is other[path].outfcn
        and (not a.nstates or a.updfcn is other[path].updfcn)
        for path, a in one.items()
    )


def _named(system: Any, params: Mapping[str, Any] | None) -> PointFunction:
    """Return what evaluates a system, and says which one where that fails."""
    function = rates_and_outputs(system, params)

    def values(t: float, x: np.ndarray, u: np.ndarray) -> PointValues:
        try:
            return function(t, x, u)
        except UsageError:
            raise
        except Exception as error:  # the blocks' functions may raise whatever they like
            raise DiagramError(
                f"'{system.name}' cannot be evaluated at t = {t:.6g} s, as the proof needs: "
                f"{type(error).__name__}: {error}"
            ) from error

    return values


def _compare(
    given: Any, both: tuple[PointFunction, PointFunction], point: Any, what: list[str]
) -> None:
    """Compare one point; what is not a number in both is the same."""
    (a,), (b,) = (function(*point) for function in both)
    a, b = (np.where(np.isnan(a) & np.isnan(b), 0.0, values) for values in (a, b))
    if agree(a, b).all():
        return
    differ = first_difference([what], (a,), (b,), explained(both[0], point, (a,)))
    if differ is not None:
        label, one, other = differ
        raise DiagramError(
            f"'{given.name}' is not the loop that the proof is about: at t = {point[0]:.6g} s "
            f"{label} is {one:.9g}, and {other:.9g} with the blocks connected by name"
        )


@dataclass(frozen=True, kw_only=True)
class Acceleration:
    """x_n', the last rate of a plant's own update; two of the same content are equal."""

    plant: Place = field(compare=False)
    update: Callable[..., Any] = field(compare=False)
    p: Any = field(compare=False)
    content: object

    def __call__(self, t: object, x: object, v: object) -> Any:
        """Return it of balls or numbers."""
        return self.update(t, _objects(x), _objects((v,)), self.p)[-1]

    def expression(self, graph: Graph, t: Tracer, x: Sequence[Tracer], v: object) -> Expr:
        """Return it of symbols, as an expression of the graph; Untraceable if there is none."""
        system = self.plant.system
        try:
            check_functions(self.plant.path, system)
        except CompileError as error:
            raise Untraceable(str(error)) from None
        states = concatenated(graph, [one.reshape(1) for one in x])
        inputs = traced(graph, v).reshape(1)
        given = lambda: (t, states.copy(), inputs.copy(), self.p)  # noqa: E731
        return traced_numbers(graph, system.updfcn, given)[-1]


def on_intervals(path: str, function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a block's function; that intervals cannot go through it is said with its name."""

    def refusal(why: str) -> DiagramError:
        return DiagramError(
            f"the equations of block '{path}' cannot be evaluated on intervals, which the "
            f"proof needs ({why}): write them with arithmetic and NumPy functions of numbers"
        )

    return on_balls(function, refusal)


def acceleration(plant: Place) -> Acceleration:
    """Return x_n', from what a run integrates, with its parameters."""
    p = current_parameters(plant.system)
    update = on_intervals(plant.path, plant.system.updfcn)  # with arrays of floats, as a run
    key, unseen = content_of(plant.system.updfcn, p)
    return Acceleration(plant=plant, update=update, p=p, content=object() if unseen else key)


def check_chain(plant: Place) -> None:
    """Prove x_i' = x_{i+1} for i < n, and that the outputs are y = x_1 and x_1, ..., x_n."""
    # For all x and v and all t >= 0: on every path through the function each is the coordinate
    # itself, or, where there is one path only, it has the coordinate's gradient everywhere and its
    # value at 0.
    system, n = plant.system, plant.system.nstates
    states, outputs = coordinate_names(n), list(system.current_spec.outputs)
    update = [(i, f"{states[i]}'", i + 1) for i in range(n - 1)]
    output = [(outputs.index(s), s, states.index(s)) for s in states if s in outputs]
    output += [(outputs.index("y"), "y", 0)]
    for what, function, coordinates in (
        ("update", system.updfcn, update), ("output", system.outfcn, output)
    ):  # fmt: skip
        for i, name, k in coordinates:
            if not _is_coordinate(plant, function, i, k):
                raise DiagramError(
                    f"the proof is about plants (1), with {name} = {states[k]}; the {what} "
                    f"function of block '{plant.path}' makes {name} something else, or it cannot "
                    "be decided"
                )


def _is_coordinate(plant: Place, function: Any, i: int, k: int) -> bool:
    """Whether result i of a plant's function is x_{k+1}, for all states, inputs and times."""
    n, p = plant.system.nstates, current_parameters(plant.system)
    called = on_intervals(plant.path, function)

    def result(z: list[Ball]) -> Any:
        return called(z[n + 1], _objects(z[:n]), _objects(z[n : n + 1]), p)[i]

    unit = [tuple(arb(int(a == b)) for a in range(n + 2)) for b in range(n + 2)]
    wide = [Ball(arb(0, "inf"), gradient) for gradient in unit]
    try:
        ways = list(every_way(lambda: result(wide)))
        if all(way is wide[k] for way in ways):
            return True
        ball, start = as_ball(ways[0]), as_ball(result([Ball(arb(0))] * (n + 2)))
    except Undecided:
        return False
    if len(ways) > 1 or ball is NotImplemented or start is NotImplemented:
        return False
    slopes = [bool(g == int(j == k)) for j, g in enumerate(ball.gradient)]
    return bool(slopes) and all(slopes) and bool(start.value == 0)


def _objects(values: Any) -> np.ndarray:
    """Return balls as an array, which equations may unpack, slice or compute with."""
    array = np.empty(len(values), dtype=object)
    array[:] = list(values)
    return array


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
