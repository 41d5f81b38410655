"""Directions in which equations are differentiated: of states, time, inputs and parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import CompileError
from ..expressions.derivatives import tangents
from ..expressions.graph import Expr, Graph, Untraceable, needed

SomeRows = tuple[Expr, int]  # some rows: one expression, and how many
Taken = Callable[[int, int, int | None], Expr | None]  # rows from, step, number


@dataclass(frozen=True, kw_only=True)
class Direction:
    """Where everything that equations read goes."""

    # for ``"x"``, ``"t"``, ``"u"``, ``"p"`` what gives some of its rows, None where they
    # stand still
    of: Mapping[str, Taken] = field(default_factory=dict)

    def __call__(self, leaf: Expr) -> Expr | None:
        """Return the derivative of what is read."""
        array, start, step = leaf.data
        if array not in self.of or leaf.kind != "f":
            return None
        return self.of[array](start, step, leaf.size)


def slopes(
    graph: Graph,
    exprs: Sequence[Expr],
    direction: Direction,
    solutions: Mapping[str, Sequence[Expr]],
) -> list[Expr | None]:
    """Return the derivatives of expressions along a direction, None where they are 0."""
    try:
        return tangents(graph, list(exprs), direction, solutions, differences=True)
    except Untraceable as error:
        raise CompileError(f"the equations have no derivatives: {error}") from None


def taken(graph: Graph, pieces: Sequence[SomeRows]) -> Taken:
    """Return what gives some of the rows that expressions make up, and stands still behind them."""
    whole, rows = graph.joined(list(pieces)) if pieces else None, sum(size for _, size in pieces)

    def rows_of(start: int, step: int, size: int | None) -> Expr | None:
        if whole is None or start >= rows:
            return None
        return graph.item(whole, start) if size is None else graph.part(whole, start, step, size)

    return rows_of


def from_time(
    graph: Graph, time: Expr | None, lines: range, rate_row: Callable[[int], int | None]
) -> Direction:
    """Return where time and inputs go while time goes by `time`, by 1 if that is None."""
    # What has no row of rates stands still, but for the rows `lines`, which are delayed signals.

    def of_time(*_: object) -> Expr:
        return graph.const(1.0) if time is None else time

    def of_inputs(start: int, step: int, size: int | None) -> Expr | None:
        row = rate_row(start)
        if row is None and start in lines:
            raise CompileError(
                "when something jumps depends on a signal whose delay varies, of which rates are "
                "not kept: put a lag behind the delay (nlctl.Lag), or take differences of runs"
            )
        if row is None:
            return None
        where = ("u", row, step)
        rate = graph.node("leaf", data=where, size=size, varies=True)
        return rate if time is None else graph.op("mul", rate, time)

    return Direction(of={"t": of_time, "u": of_inputs})


def rows_replaced(
    graph: Graph, pieces: Sequence[SomeRows], instead: Mapping[int, Expr]
) -> list[SomeRows]:
    """Return pieces with other numbers in some of their rows."""
    replaced: list[SomeRows] = []
    row = 0
    for expr, size in pieces:
        inside = sorted(k - row for k in instead if row <= k < row + size)
        at = 0
        for k in inside:
            if k > at:
                replaced.append(_part(graph, expr, at, k - at))
            replaced.append((instead[row + k], 1))
            at = k + 1
        if at < size:
            replaced.append(_part(graph, expr, at, size - at) if at else (expr, size))
        row += size
    return replaced


def _part(graph: Graph, expr: Expr, start: int, size: int) -> SomeRows:
    if expr.size is None:
        return expr, size
    return (graph.item(expr, start) if size == 1 else graph.part(expr, start, 1, size)), size


def one_sided(
    graph: Graph,
    exprs: Sequence[Expr],
    direction: Direction,
    solutions: Mapping[str, Sequence[Expr]],
) -> list[Expr]:
    """Return expressions in which `max`, `min` and `abs` at a tie go where the direction leads."""
    # Their derivatives along that direction are those to its own side.
    new: dict[Expr, Expr] = {}
    for node in needed(exprs):
        args = tuple(new.get(a, a) for a in node.args)
        if node.op in ("maximum", "minimum", "absolute") and node.varies:
            new[node] = _leading(graph, node.op, args, direction, solutions)
        elif args != node.args:
            new[node] = graph.like(node, *args)
    return [new.get(e, e) for e in exprs]


def _leading(
    graph: Graph,
    op: str,
    args: Sequence[Expr],
    direction: Direction,
    solutions: Mapping[str, Sequence[Expr]],
) -> Expr:
    pair = list(map(graph.number, args))
    if op == "absolute":
        pair.append(graph.op("neg", pair[0]))
    changes = slopes(graph, pair, direction, solutions)
    rates = [graph.const(0.0) if rate is None else rate for rate in changes]
    order = "lt" if op == "minimum" else "gt"
    ahead = graph.op("and", graph.op("eq", *pair), graph.op(order, *rates))
    first = graph.op("or", graph.op(order, *pair), ahead)
    return graph.op("select", first, *pair)
