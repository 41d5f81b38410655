"""Machine code against python-control: the first run of a program is compared, not believed.

A compiled program is a second description of a diagram, and second descriptions can be wrong.  At
some points of a run's own trajectory its right-hand side and outputs are compared with
``dynamics`` and ``output`` of the diagram as it stands.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import control as ct
import numpy as np

from ..blocks import supplied_of
from ..delays.transport import PAST
from ..diagrams import Apart, apart, override, supplied_blocks
from ..diagrams.points import (
    SHAKEN,
    Point,
    PointValues,
    agree,
    explained,
    first_difference,
    values_now,
)
from ..errors import AuditError, ParameterError
from ..sampling.system import Happening, happening
from ..supplied import SuppliedOutput, supplying
from ..upstream.control_internals import outputs_now, rates_now, set_parameters
from .codegen.solver import searched
from .compiled import Compiled
from .declared import declared_labels, declared_now, declared_rows, without_nan
from .diagram.program import instants_of
from .diagram.schedule import Schedule, Signal, signal_name
from .diagram.wiring import block_inputs
from .equations.blocks import equations
from .equations.relays import relay_places
from .lower import lower
from .machine.evaluations import Machine, machine, prepared_parameters
from .machine.routine import lowered_code
from .rounding.nudged import ROUNDINGS, nudged_values

_EVERY = "every run"
_POINTS = 5  # of a trajectory, its start and end among them
_PART_OF_RUN = 0.01
_DIFFERENCES = 1e-4  # part of a rate that differences may miss
_APART = 1e-5  # way, relative to the state, over which a rate is taken
_ONE_AT_A_TIME = threading.Lock()  # python-control keeps a run's parameters in the blocks

Audit = bool | Literal["every run"]
Evaluated = Callable[[float, np.ndarray, np.ndarray], PointValues]


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A run that is to be compared."""

    time: np.ndarray  # shape (m,)
    # shape (nstates, m)
    states: np.ndarray
    inputs: np.ndarray
    p: np.ndarray  # the program's parameter vector
    params: Mapping[str, Any] | None  # the same parameters as python-control takes them
    width: int  # members that the machine code of the run takes
    meetings: tuple[Happening, ...] = ()  # what may happen to sampled blocks in that machine code
    # what ideal relays output at a point, by the number of their blocks
    relays: Mapping[int, float] = field(default_factory=dict)
    # the diagram that python-control evaluates, with the parameters of this run
    apart: Apart | None = None

    def of(self, thing: object) -> Any:
        """Return what stands for a block in the diagram that is evaluated."""
        return thing if self.apart is None else self.apart.of(thing)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Audited:
    """Machine code that has been compared once."""

    code: Machine


def audit(compiled: Compiled, trial: Trial, wanted: Audit = True) -> None:
    """Compare a run's program with python-control, if that has not been done."""
    if not (isinstance(wanted, bool | np.bool_) or (isinstance(wanted, str) and wanted == _EVERY)):
        raise ParameterError(f"audit must be True, False or 'every run', got {wanted!r}")
    if not wanted:
        return
    with _ONE_AT_A_TIME, np.errstate(all="ignore"):
        width, p = trial.width if ct.isctime(compiled.system) else 1, trial.p[:, None]
        read, clocks = compiled.schedule, compiled.program.clocks
        due = instants_of(read, compiled.program, trial.time, p)[0].patterns if clocks else ()
        each = np.repeat(p, width, axis=1)
        code, done = machine(compiled, each, width, due), compiled.cache.of(_Audited)
        if wanted != _EVERY and any(known.code is code for known in done):
            return
        _, c = prepared_parameters(compiled, trial.p, width, due)
        evaluated, own = _evaluated(compiled, code, c), apart(compiled.schedule.system)
        params = override(own.system, trial.params)  # nobody else writes into that diagram
        trial = replace(trial, meetings=code.meetings, apart=own, params=params)
        relays = relay_places(compiled.schedule.nodes)
        outputs = every_output(compiled, trial.p) if relays else None
        for point in _points(trial):
            every = outputs(point) if outputs else {}
            known = {i: float(every[i][0]) for i in relays}
            _compare(compiled, replace(trial, relays=known), evaluated, point)
        done.append(_Audited(code=code))  # what failed is compared again


def _points(trial: Trial) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    finite = np.flatnonzero(np.isfinite(trial.states).all(axis=0))
    for k in np.unique(np.linspace(0, finite.size - 1, _POINTS).astype(int)) if finite.size else ():
        m = finite[k]
        yield float(trial.time[m]), trial.states[:, m].copy(), trial.inputs[:, m].copy()


def _evaluated(compiled: Compiled, code: Machine, c: np.ndarray) -> Evaluated:
    """Return what machine code computes at a point."""
    events = code.lowered.rows["g"]
    located = events - compiled.program.events
    declared = declared_rows(compiled.schedule, compiled.program, located)
    count, jumping = len(compiled.program.sampled), compiled.program.resets

    def several(*point: object) -> PointValues:
        dx, g, m = code.values(code.rhs, "dx g m", point, c)
        (y,) = code.values(code.out, "y", point, c)
        # next states are 0 as python-control has it where nothing is due
        due = [code.values(function, "s", point, c)[0] for function in code.samples]
        after = [code.values(function, "s", point, c)[0] for function in code.resets]
        jumped = np.concatenate([np.zeros(0), *after])[:jumping]
        sampled = [s[:count] for s in due]
        return dx, y, *sampled, *without_nan(np.append(g, m)[declared], jumped)

    return several


def _compare(compiled: Compiled, trial: Trial, evaluated: Evaluated, point: Point) -> None:
    """Compare one point."""
    system = compiled.system
    ours = evaluated(*point)
    if not all(np.isfinite(values).all() for values in ours[:-1]):
        return  # the run says that it diverged
    try:
        theirs = _by_python_control(compiled, point, trial)
        again = _by_python_control(compiled, point, trial)
    except RuntimeError as error:
        if "lgebraic loop" not in str(error) or compiled.program.sampled:
            raise
        _compare_blocks(compiled, trial, ours, point)
        return
    except Exception as error:
        raise AuditError(
            f"machine code of '{system.name}' runs on where python-control raises an error at "
            f"t = {point[0]:.6g} s: {type(error).__name__}: {error}"
        ) from error
    for one, other in zip(theirs, again, strict=True):
        if not np.array_equal(one, other, equal_nan=True):
            raise AuditError(
                f"python-control's own values of '{system.name}' differ from call to call at "
                f"t = {point[0]:.6g} s: a block has a memory or draws random numbers"
            )
    _compare_sliding(compiled, trial, point)
    if not all(np.all(agree(a, b)) for a, b in zip(ours, theirs, strict=True)):
        _compare_beyond_rounding(compiled, trial, point, (ours, theirs))


def _compare_beyond_rounding(
    compiled: Compiled, trial: Trial, point: Point, both: tuple[PointValues, PointValues]
) -> None:
    """Refuse values that differ by more than what rounding explains, looked at more closely."""
    ours, theirs = both
    allowed = explained(
        lambda *near: _by_python_control(compiled, near, trial), point, theirs, _later(point, trial)
    )
    if all(np.all(agree(*v)) for v in zip(ours, theirs, allowed, strict=True)):
        return
    rounded, system = rounding(compiled, trial, point), compiled.system
    allowed = tuple(a + b for a, b in zip(allowed, rounded, strict=True))
    after = [system.state_labels[i] for i in compiled.program.sampled]
    arrivals = [signal_name(compiled.schedule.nodes, s) for s in compiled.schedule.lines]
    names = [
        system.state_labels, [*system.output_labels, *arrivals], *[after] * len(trial.meetings),
        *declared_labels(compiled.schedule),
    ]  # fmt: skip
    differ = first_difference(names, ours, theirs, allowed)
    if differ is not None:
        if not compiled.program.sampled:
            _compare_blocks(compiled, trial, ours, point)  # it names the block, if it can
        raise _difference(differ, system.name, point[0])


def _by_python_control(compiled: Compiled, point: Point, trial: Trial) -> PointValues:
    system = trial.of(compiled.schedule.system)
    lines, point = _lines(compiled, trial, point)
    with supplying(lines), happening():
        rates, outputs = values_now(system, point)
    arriving = [line.arriving for made, line in lines.items() if supplied_of(made) is PAST]
    after, rows = [], list(compiled.program.sampled)
    for what in trial.meetings:
        now = frozenset(moment._replace(owner=trial.of(moment.owner)) for moment in what)
        with supplying(lines), happening(now):
            after.append(rates_now(system, *point)[rows])
    with supplying(lines), happening():
        declared = declared_now(compiled.schedule, system, point)
    return rates, np.concatenate([outputs, *arriving]), *after, *without_nan(*declared)


def _by_block(compiled: Compiled, values: np.ndarray) -> dict[int, np.ndarray]:
    """Divide what there is of the outputs of all blocks, by their numbers."""
    ends = np.cumsum([node.system.noutputs or 0 for node in compiled.schedule.nodes])
    return dict(enumerate(np.split(values, ends[:-1])))


def _compare_sliding(compiled: Compiled, trial: Trial, point: Point) -> None:
    """Compare the rates of sliding relays' inputs with those that they are to have."""
    # Python-control's right-hand side is compared with the relays' outputs as machine code has
    # them. That these keep the inputs where they are is seen here, from python-control's own rates.
    for i, v in trial.relays.items():
        node = compiled.schedule.nodes[i]
        spec = trial.of(node.system).current_spec  # the run's parameters are resolved by now
        if point[1][node.state_offset] != 0:
            continue
        sides = [replace(trial, relays={**trial.relays, i: k * spec.height}) for k in (-1, 1)]
        scale = sum(np.abs(_rates_of_input(compiled, each, i, point)).max() for each in sides)
        wanted = -spec.rate * _arriving(compiled, trial, i, point)
        now = _rates_of_input(compiled, trial, i, point)
        reach = np.abs(np.subtract(*(_rates_of_input(compiled, one, i, point) for one in sides)))
        if reach.max() <= _DIFFERENCES * scale and np.abs(now).min() <= spec.rest_rate:
            continue  # it acts on u'' alone, and what is left of u' decays
        if np.all(np.abs(now - wanted) > _DIFFERENCES * scale):  # at a kink one of them holds
            raise AuditError(
                f"while ideal relay '{node.path}' slides with an output of {v:.6g}, its input has "
                f"the rate {wanted:.6g} in machine code and {now[1]:.6g} in python-control, by "
                f"differences, at t = {point[0]:.6g} s; nothing was returned"
            )


def _rates_of_input(compiled: Compiled, trial: Trial, i: int, point: Point) -> np.ndarray:
    """Return how fast a relay's input changes along python-control's own rates."""
    # By differences before the point, around it and behind it.
    t, x, u = point
    rates = _by_python_control(compiled, point, trial)[0]
    rates[list(compiled.program.memory)] = 0.0  # they stand still within a step
    part = _APART * (1.0 + np.abs(x).max()) / (1.0 + np.abs(rates).max())
    given = np.zeros(u.size)
    count = compiled.schedule.rates
    given[:count] = u[u.size - count :]
    ends = [(t + k * part, x + k * part * rates, u + k * part * given) for k in (-1, 0, 1)]
    before, here, after = (_arriving(compiled, trial, i, end) for end in ends)
    return np.array([here - before, 0.5 * (after - before), after - here]) / part


def _arriving(compiled: Compiled, trial: Trial, i: int, point: Point) -> float:
    """Return what python-control finds at the input of an ideal relay."""
    lines, point = _lines(compiled, trial, point)
    with supplying(lines), happening():
        rates_now(trial.of(compiled.schedule.system), *point)
    return float(lines[trial.of(compiled.schedule.nodes[i].system)].arriving[0])


def _lines(compiled: Compiled, trial: Trial, point: Point) -> tuple[dict[Any, SuppliedOutput], Any]:
    """Return what leaves transport delays and relays, and the point with the diagram's inputs."""
    t, x, u = point
    own = compiled.system.ninputs or 0
    nodes = compiled.schedule.nodes
    lines = {trial.of(nodes[i].system): _line(np.array([v])) for i, v in trial.relays.items()}
    at = own
    system = trial.of(compiled.schedule.system)
    for made in supplied_blocks(system, PAST) if compiled.schedule.lines else ():
        count = made.noutputs or 0
        values = u[at : at + count]
        lines[made], at = _line(values), at + count
    return lines, (t, x, u[:own])


def _line(values: np.ndarray) -> SuppliedOutput:
    return SuppliedOutput(leaving=lambda t: values, arriving=np.full(values.size, np.nan))


def _later(point: Point, trial: Trial) -> float:
    """Return how much later rounding may make it; near t = 0 a part of the run counts."""
    # It must be seen next to phases: machine code knows that sin(w t + pi) is -sin(w t), NumPy's is
    # 1.2e-16 at t = 0.
    step = float(np.max(np.diff(trial.time), initial=0.0))
    return SHAKEN * max(abs(point[0]), step, _PART_OF_RUN * float(np.ptp(trial.time)))


def _compare_blocks(compiled: Compiled, trial: Trial, ours: PointValues, point: Point) -> None:
    """Compare block by block: each with python-control's equations at the inputs it has here."""
    t, x, u = point
    nodes = compiled.schedule.nodes
    system = trial.of(compiled.schedule.system)
    if system.nstates:
        set_parameters(system, dict(trial.params) if trial.params else None)
    schedule = _with_every_output(compiled)
    outputs = every_output(compiled, trial.p)(point)
    rates, rounded, *_ = rounding(compiled, replace(trial, meetings=()), point, schedule)
    every = _by_block(compiled, rounded)
    given = block_inputs(system, u[: system.ninputs or 0], outputs)
    for i in dict.fromkeys((*compiled.schedule.order, *range(len(nodes)))):
        node, (block, inputs) = nodes[i], given[i]
        if supplied_of(block) is not None:
            continue
        own = slice(node.state_offset, node.state_offset + (block.nstates or 0))
        pairs = [(outputs[i], every[i], outputs_now, block.output_labels)]
        pairs += (
            [(ours[0][own], rates[own], rates_now, block.state_labels)] if block.nstates else []
        )
        for a, most, function, labels in pairs if block.noutputs else pairs[1:]:
            b = function(block, t, x[own], inputs).astype(float)
            (moved,) = explained(
                lambda *near, f=function, s=block: (f(s, *near),), (t, x[own], inputs), (b,),
                _later(point, trial),
            )  # fmt: skip
            differ = first_difference([labels], (a,), (b,), (moved + most,))
            if differ is not None:
                raise _difference(differ, node.path, t)


def _with_every_output(compiled: Compiled) -> Schedule:
    """Return the schedule with the outputs of all blocks as those of the diagram."""
    counts = [node.system.noutputs or 0 for node in compiled.schedule.nodes]
    every = tuple({Signal(i, k): 1.0} for i, count in enumerate(counts) for k in range(count))
    return replace(compiled.schedule, outputs=every)


def rounding(
    compiled: Compiled, trial: Trial, point: Point, schedule: Schedule | None = None
) -> PointValues:
    """Return how far results may be moved by what the operations before them round."""
    schedule = schedule or compiled.schedule
    found = equations(schedule, compiled.program.layout, trial.p, trial.meetings)
    t, x, u = point
    arrays = {"t": [t], "x": x, "u": u, "p": trial.p}
    meetings = [f"sample{k}" for k in range(len(trial.meetings))]
    names = [name for name in ("dx", "y", *meetings, "g", "m", "reset") if name in found.results]
    values = iter(
        nudged_values(
            [expr for name in names for expr, _ in found.pieces(name)],
            {name: np.asarray(v, dtype=float).reshape(-1, 1) for name, v in arrays.items()},
            {name: searched(one) for name, one in found.solvers.items()},
            {name: call.function for name, call in found.calls.items()},
            found.fixed_points,
        )
    )
    located, program = found.conditions.rows, compiled.program
    sizes = [x.size, len(schedule.outputs), *[len(program.sampled)] * len(meetings)]
    moved = [
        np.zeros(size)
        for size in (*sizes, program.events + located, len(program.memory), program.resets)
    ]
    for name, total in zip(names, moved, strict=False):  # there may be no resets
        for row, array in found.results[name]:
            at = row
            for _, size in array.pieces():
                ways = np.broadcast_to(next(values), (size, ROUNDINGS))
                far = np.abs(ways - ways[:, :1])
                total[at : at + size] = np.where(np.isfinite(far), far, 0.0).max(axis=1)
                at += size
    *others, g, m, after = moved
    return *others, np.append(g, m)[declared_rows(schedule, program, located)], after


def every_output(compiled: Compiled, p: np.ndarray) -> Callable[[Any], dict[int, np.ndarray]]:
    """Return what computes the outputs of all blocks at a point, as the run's program does."""
    schedule = _with_every_output(compiled)
    found = equations(schedule, compiled.program.layout, p)
    lowered = lower(schedule, compiled.program, 1, found)
    prepare, _, out, *_ = lowered_code(lowered)
    c = np.zeros((lowered.size, 1))
    prepare(np.ascontiguousarray(p[:, None]), c)

    def outputs(point: Point) -> dict[int, np.ndarray]:
        t, x, u = point
        y = np.empty((len(schedule.outputs), 1))
        out(np.array([t]), x[:, None], u[:, None], c, y)
        return _by_block(compiled, y[:, 0])

    return outputs


def _difference(differ: tuple[str, float, float], block: str, t: float) -> AuditError:
    label, ours, theirs = differ
    return AuditError(
        f"machine code and python-control differ at '{label}' of block '{block}': {ours:.17g} and "
        f"{theirs:.17g} at t = {t:.6g} s; nothing was returned: run it with "
        "engine='python-control'"
    )
