"""Directions in which equations are differentiated: of states, time, inputs and parameters."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from ..errors import CompileError
from ..expressions.derivatives import tangents
from ..expressions.graph import Expr, Graph, Untraceable, needed

_AGREE = 1e-6  # derivatives of a time by two conditions that are one
_AT_REST = 1e2  # times what is passed at once: a time that moves by less stands still


@dataclass(frozen=True, kw_only=True)
class When:
    """How the time at which something happens moves."""

    moves: list[Expr]  # its derivative by each quantity
    grazes: Expr  # whether what it depends on is there at a rate of 0
    apart: list[Expr]  # by each quantity, whether two conditions say different things
    happens: Expr  # whether anything happens at a time that moves
    met: Expr  # whether anything has been met at a rate

    def unless(self, condition: Expr, other: "When", graph: Graph) -> "When":
        """Return this, or another if a condition holds."""

        def either(one: Expr, two: Expr) -> Expr:
            return graph.op("select", condition, two, one)

        def each(ones: Sequence[Expr], twos: Sequence[Expr]) -> list[Expr]:
            return [either(*pair) for pair in zip(ones, twos, strict=True)]

        return When(
            moves=each(self.moves, other.moves), apart=each(self.apart, other.apart),
            grazes=either(self.grazes, other.grazes), happens=either(self.happens, other.happens),
            met=either(self.met, other.met),
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Cause:
    """A condition that may have been met."""

    met: Expr  # whether it was
    moves: list[Expr]  # the derivative by each quantity of the time at which it was
    grazes: Expr  # whether it was at a rate of 0


def when_of(graph: Graph, causes: Sequence[Cause], by: int, rounding: Expr) -> When:
    """Return how a time moves by `by` quantities, by the first condition that was met at a rate."""
    # What is left of a state at rest, such as a velocity that sticks, may change its sign where
    # something else sets it in motion. That is met at no rate, and says nothing.
    no, zero = graph.const(False), graph.const(0.0)
    moves, grazes, moving = [zero] * by, no, no
    for cause in reversed(causes):
        met = graph.op("and", cause.met, graph.op("not", cause.grazes))
        pairs = zip(cause.moves, moves, strict=True)
        moves = [graph.op("select", met, a, b) for a, b in pairs]
        moving = graph.op("or", moving, met)
        grazes = graph.op("or", grazes, graph.op("and", cause.met, cause.grazes))
    grazes = graph.op("and", grazes, graph.op("not", moving))
    apart, happens = [no] * by, no
    for cause in causes:
        met = graph.op("and", cause.met, graph.op("not", cause.grazes))
        for j, move in enumerate(cause.moves):
            differs = differ(graph, move, moves[j], rounding)
            apart[j] = graph.op("or", apart[j], graph.op("and", met, differs))
    for move in moves:
        happens = graph.op("or", happens, graph.op("ne", move, zero))
    return When(moves=moves, grazes=grazes, apart=apart, happens=happens, met=moving)


def at_once(graph: Graph, one: When, other: When, rounding: Expr) -> list[Expr]:
    """Return by each quantity whether what is met at one instant says different things."""
    rows = zip(one.moves, other.moves, other.apart, strict=True)
    differing = [graph.op("or", apart, differ(graph, a, b, rounding)) for a, b, apart in rows]
    return [graph.op("and", other.met, differs) for differs in differing]


def differ(graph: Graph, one: Expr, other: Expr, rounding: Expr) -> Expr:
    """Return whether two times move by different derivatives."""
    gap = graph.op("absolute", graph.op("sub", one, other))
    size = graph.op("add", graph.op("absolute", one), graph.op("absolute", other))
    still = graph.op("mul", graph.const(_AT_REST), rounding)
    least = graph.op("add", still, graph.op("mul", graph.const(_AGREE), size))
    return graph.op("gt", gap, least)


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
