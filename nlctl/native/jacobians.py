"""Exact Jacobians of compiled diagrams, from the derivatives of their expressions."""

import sys
import threading
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import expm

from ..arguments import number
from ..blocks import Block
from ..delays.transport import PAST
from ..diagrams import supplied_blocks
from ..errors import CompileError, InexactWarning, ParameterError, UsageError
from ..expressions.derivatives import tangents
from ..expressions.evaluate import evaluate_expressions
from ..expressions.graph import Expr, Untraceable, needed
from ..names import base_name, element_index
from ..params import as_numbers, declared_params, equation_arguments, with_overrides
from ..responses.arguments import state_array
from ..sampling.clock import common_period, instants
from ..sampling.system import clocks_of
from ..wording import counted
from .codegen.solver import searched
from .diagram.nodes import Node
from .equations.blocks import Equations
from .lower import DIRECTION
from .reading import Reading

STEP = 1e-6  # by which a parameter is moved, to see what follows from it
_INSIDE = ("nlctl", "control")  # whose lines are not the caller's
_DIFFERENTIATING = threading.Lock()  # a diagram's graph grows by it


@dataclass(frozen=True, kw_only=True)
class Tangent:
    """The derivatives of a diagram's equations along a direction."""

    # for ``"dx"`` and ``"y"``, and for ``"sample0"`` and so on of sampled blocks' next states,
    # pairs of an expression, None where it is 0, and its length
    rows: Mapping[str, Sequence[tuple[Expr | None, int]]]
    equations: Equations  # of which it is the derivative


def inexact(found: Equations, results: Sequence[str] = ("dx",)) -> str | None:
    """Return what derivatives of a diagram's results are taken by differences of, and why."""
    # None if all are exact.
    parts = [expr for name in results for expr, _ in found.pieces(name)]
    names = dict.fromkeys(node.data[0] for node in needed(parts) if node.op == "call")
    used = [found.calls[name] for name in names]
    told = [f"the {c.kind} function of block '{c.block}' is called unchanged ({c.reason})"
            for c in used]  # fmt: skip
    return ", and ".join(told) or None


def tangent(reading: Reading, p: np.ndarray | None = None) -> Tangent:
    """Return the equations of a parameter vector by states, inputs and parameters."""
    # `p` is that of the diagram itself if left out.
    if reading.schedule.lines:
        delays = ", ".join(f"'{b.name}'" for b in supplied_blocks(reading.system, PAST))
        raise CompileError(
            f"'{reading.system.name}' has the transport delays {delays}, and so no finite state: "
            "put ct.ss(ct.tf(*ct.pade(delay, n))) in the place of each, beside sampled blocks "
            "nlctl.sampled(gain, dt, delay=...), which is exact; nlctl.frequency_response keeps "
            "them as they are"
        )
    return open_tangent(reading, p)


def open_tangent(reading: Reading, p: np.ndarray | None = None) -> Tangent:
    """Return the same where the transport delays are cut: what leaves them are further inputs."""
    # Behind the outputs follows what arrives at them.
    found = reading.equations if p is None else reading.equations_with(p)
    return reading.cache.found(
        Tangent, lambda known: known.equations is found, lambda: _differentiated(reading, found)
    )


def _differentiated(reading: Reading, found: Equations) -> Tangent:
    names = ("dx", "y", *(name for name in found.results if name.startswith("sample")))
    n, m = reading.system.nstates or 0, reading.schedule.ninputs
    parts = needed([expr for name in names for expr, _ in found.pieces(name)])
    rates = range(m - reading.schedule.rates, m)
    if any(e.op == "leaf" and e.data[0] == "u" and e.data[1] in rates for e in parts):
        raise CompileError(
            f"'{reading.system.name}' has no linearization by its inputs: an ideal relay slides "
            "as their rates say, too; put a lag before those that it sees"
        )
    starts = {"x": 0, "u": n, "p": n + m}
    rows = {name: along(found, name, starts) for name in names}
    return Tangent(rows=rows, equations=found)


def along(
    equations: Equations, name: str, starts: Mapping[str, int]
) -> list[tuple[Expr | None, int]]:
    """Return the derivative of a diagram's results along a direction."""
    graph = equations.graph
    pieces = equations.pieces(name)

    def seed(leaf: Expr) -> Expr | None:
        array, start, step = leaf.data
        if array not in starts or leaf.kind != "f":
            return None
        where = (DIRECTION, starts[array] + start, step)
        return graph.node("leaf", data=where, size=leaf.size, varies=True)

    try:
        with _DIFFERENTIATING, np.errstate(all="ignore"):
            found = tangents(
                graph, [e for e, _ in pieces], seed, equations.fixed_points, differences=True
            )
    except Untraceable as error:
        raise CompileError(f"the equations have no derivatives: {error}") from None
    return list(zip(found, [size for _, size in pieces], strict=True))


def jacobian(
    reading: Reading,
    x0: object,
    u0: object,
    t: float,
    p: np.ndarray,
    directions: np.ndarray,
) -> dict[str, np.ndarray]:
    """Return the derivatives of the right-hand side and of the outputs along directions."""
    # Shapes: `directions` (nstates + inputs of the program + parameters, k).
    system, t = reading.system, number("linearize", "t", t)
    made = tangent(reading, p)
    u = point_numbers("u0 needs", system.ninputs or 0, f"'{system.name}'", u0)
    u = np.append(u, np.zeros(reading.schedule.rates))  # they stand still
    columns = {"t": [t], "x": state_array(system, x0), "u": u, "p": p}
    found, cut = differentiated_at(made, columns, directions), made.equations.cut
    if cut and any(np.isnan(part).any() for part in found.values()):
        calling = reading.calling(cut)  # a loop takes more passes there than are written out
        tell_of_differences(calling, p)
        return jacobian(calling, x0, u0, t, p, directions)
    return found


def differentiated_at(
    made: Tangent, columns: Mapping[str, Any], directions: np.ndarray
) -> dict[str, np.ndarray]:
    """Return derivatives along directions at a point, given as t, x, u and p."""
    arrays = {name: np.asarray(v, dtype=float)[:, None] for name, v in columns.items()}
    arrays[DIRECTION] = directions
    searches = searches_of(made.equations)
    count, found = directions.shape[1], {}
    for name, rows in made.rows.items():
        wanted = [e for e, _ in rows if e is not None]
        values = iter(evaluate_expressions(wanted, arrays, searches))
        parts = [
            np.broadcast_to(0.0 if expr is None else next(values), (size, count))
            for expr, size in rows
        ]
        found[name] = np.concatenate([np.zeros((0, count)), *parts])
    return found


def searches_of(equations: Equations) -> dict[str, Callable[[np.ndarray], np.ndarray]]:
    """Return what finds signals of algebraic loops and calls opaque functions, by name."""
    found = {name: searched(one) for name, one in equations.solvers.items()}
    return found | {
        name: lambda given, f=call.function: np.stack([f(c.copy()) for c in given.T], axis=1)
        for name, call in equations.calls.items()
    }


def point_numbers(needs: str, count: int, what: str, given: object) -> np.ndarray:
    """Return so many finite numbers, 0 by default, or one for all of them; shape (count,)."""
    numbers = as_numbers(0.0 if given is None else given)
    if numbers is not None:
        numbers = np.full(count, float(numbers)) if numbers.ndim == 0 else numbers.reshape(-1)
    if numbers is None or numbers.size != count or not np.all(np.isfinite(numbers)):
        raise ParameterError(f"{needs} {counted(count, 'finite number')} for {what}, got {given!r}")
    return numbers


def tell_of_differences(reading: Reading, p: np.ndarray) -> None:
    """Warn of derivatives that are not exact."""
    found = reading.equations_with(p)
    names = ("dx", "y", *(r for r in found.results if r.startswith("sample")))
    why = inexact(found, names)
    if why is not None:
        tell_of(f"derivatives of '{reading.system.name}' are differences where {why}, and exact "
                "elsewhere")  # fmt: skip


def tell_of(sentence: str) -> None:
    """Warn of derivatives that are differences, at the line that has asked for them."""
    frame, level = sys._getframe(), 1
    while frame.f_back and frame.f_globals.get("__name__", "").split(".")[0] in _INSIDE:
        frame, level = frame.f_back, level + 1
    warnings.warn(sentence, InexactWarning, level)


def over_a_period(reading: Reading, found: Mapping[str, np.ndarray]) -> tuple[Any, Any, float]:
    """Return the map of a diagram with sampled blocks from period to period, exactly."""
    # States are taken before what happens at the beginning of a period, outputs after it; inputs
    # are constant over it. Between instants the map is a matrix exponential.
    # returns (nstates, nstates + ninputs).
    n, width = found["dx"].shape
    meetings = reading.program.meetings
    clocks = clocks_of(node.sampled for node in reading.schedule.nodes)
    begin, end, period = common_period(tuple(clocks.values()))
    due = instants(clocks, begin, end, meetings)
    if len(due.patterns) > len(meetings):
        raise UsageError(
            f"clocks of '{reading.system.name}' meet otherwise than when it was compiled: compile "
            "it again with these sampling times"
        )
    flow = np.zeros((width, width))
    flow[:n] = found["dx"]
    total, shown = np.eye(width), found["y"]
    gaps = np.diff(np.r_[begin, due.times, end])
    total = expm(flow * gaps[0]) @ total
    for k, (which, gap) in enumerate(zip(due.which, gaps[1:], strict=True)):
        step = _sampled_map(reading, found, int(which), width)
        if k == 0 and gaps[0] == 0.0:
            shown = shown @ step
        total = expm(flow * gap) @ step @ total
    return total[:n], shown, period


def _sampled_map(
    reading: Reading, found: Mapping[str, np.ndarray], which: int, width: int
) -> np.ndarray:
    """Return what an instant does to states and inputs."""
    step, at = np.eye(width), 0
    for row, array in reading.equations.results[f"sample{which}"]:
        places = list(reading.program.sampled[row : row + array.size])
        step[places] = found[f"sample{which}"][at : at + array.size]
        at += array.size
    return step


def check_enters_alone(node: Node, name: str) -> None:
    """Refuse a parameter that numbers follow from: these are constants to the equations."""
    spec: Any = node.system.current_spec if isinstance(node.system, Block) else None
    key = name.removeprefix(f"{node.path}.")
    field = base_name(key)
    if not hasattr(spec, "derived") or field not in declared_params(spec):
        return
    values = np.asarray(getattr(spec, field), dtype=float)
    value = float(values[element_index(key, values.shape)])
    now = equation_arguments(spec)._asdict()
    for moved in (value + STEP * max(abs(value), 1.0), value - STEP * max(abs(value), 1.0)):
        try:
            then = equation_arguments(with_overrides(spec, {key: moved}, node.path))._asdict()
        except ParameterError:  # out of its bounds: the other side tells
            continue
        for other in spec.derived():
            if not np.array_equal(now[other], then[other]):
                raise CompileError(
                    f"'{name}' has no exact derivative: '{other}' of block '{node.path}' follows "
                    "from it outside of the equations: take differences of runs"
                )
