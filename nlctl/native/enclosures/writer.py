"""Functions of boxes as LLVM IR, from expressions.

    void values(double *x, double *v)
    void judge(double *x, double *o)

Boxes are in lanes: row i of `x` is the lower end of side i in every lane, then the upper one, and
row k of `v` the same of result k.  What `judge` writes is in `JudgedRows`.
"""

from collections.abc import Sequence
from functools import reduce
from itertools import accumulate
from typing import NamedTuple

from ...expressions.continuity import is_an_extreme
from ...expressions.graph import COMPARISONS, LOGIC, Expr, needed
from ..codegen.ir.numbers import one_line
from ..codegen.ir.text import Body, Module, Value, pointers
from . import arithmetic
from .arithmetic import Ends
from .rounding import larger, smaller
from .rules import interval_of

LANES = 8
# operations up to which rules become part of what calls them: beyond, code of a third more speed
# would take three times as long to make
INLINED = 400
_ARITHMETIC = {"sub": arithmetic.sub, "mul": arithmetic.mul, "div": arithmetic.div}
_INF = float("inf")


class JudgedRows(NamedTuple):
    """Where `judge` writes what it finds, in rows of one number per lane."""

    centre: int  # the point, a row per side; not a number for a side without an end
    weight: int  # how much each side matters, a row per side; not a number where that is unknown
    inner: int  # the box that stands for the centre
    values: int  # enclosures of the results there
    count: int  # all rows


_BEFORE = 3  # rows: upper bound of the least result, and its lower and upper bound at the centre


def judged_rows(sides: int, results: int) -> JudgedRows:
    """Return where things are of a box with so many sides, and of so many results."""
    return JudgedRows(*accumulate((_BEFORE, sides, sides, 2 * sides, 2 * results)))


def enclosure_text(
    results: Sequence[Expr], gradients: Sequence[Sequence[Expr]], sides: int, all_exist: bool
) -> str:
    """Return the IR of both functions; see `boxes.enclosed`."""
    all_of_it = needed([*results, *(g for gradient in gradients for g in gradient)])
    module = Module(inlined=len(all_of_it) <= INLINED)
    texts = [_values(module, results), _judge(module, results, gradients, sides, all_exist)]
    return "\n".join([module.text(), *texts])


def values_text(results: Sequence[Expr]) -> str:
    """Return the IR of `values` alone, in which what may jump has no value."""
    module = Module(inlined=len(needed(results)) <= INLINED)
    text = _values(module, results, continuous=True)
    return f"{module.text()}\n{text}"


class EnclosureWriter:
    """Writes enclosures of expressions; `names` says what each is called so far.

    Where `continuous`, what may jump has no value.
    """

    def __init__(self, b: Body, continuous: bool = False) -> None:
        self.b, self.continuous = b, continuous
        self.names: dict[Expr, Ends] = {}
        self.jumps: dict[Expr, Value] = {}  # where an expression may jump for a reason of its own

    def write(self, exprs: Sequence[Expr]) -> None:
        """Compute expressions, and all that they are made of."""
        for node in needed(exprs):
            if node not in self.names:
                self.b.note(one_line(node))
                self.names[node] = self._operation(node)

    def _operation(self, node: Expr) -> Ends:
        b, args = self.b, [self.names[a] for a in node.args]
        if node.op == "const":
            known = arithmetic.truth if node.kind == "b" else arithmetic.point_of
            return known(node.data, LANES)
        if node.op == "leaf":
            return self.ends("x", 2 * node.data[1])
        if node.op == "add":
            return arithmetic.add(b, *args)
        if node.op in _ARITHMETIC and args[0] is not args[1]:
            return arithmetic.routine(b, node.op, _ARITHMETIC[node.op], *args)
        if node.op in _ARITHMETIC:  # of one quantity: less than of two in one range
            return arithmetic.routine(
                b, f"{node.op}.same", lambda c, x: _ARITHMETIC[node.op](c, x, x), args[0]
            )
        if node.op == "neg":
            return arithmetic.neg(b, args[0])
        if node.op in COMPARISONS:
            return arithmetic.comparison_of(b, node.op, *args)
        if node.op == "not":
            return arithmetic.logic_not(b, args[0])
        if node.op in LOGIC:
            return arithmetic.logic(b, node.op, *args)
        if node.op == "select":
            return self._choice(node, *args)
        result, jumps = interval_of(b, node.op, *args)
        return result if jumps is None else self._with_jumps(node, result, jumps)

    def _with_jumps(self, node: Expr, result: Ends, jumps: Value) -> Ends:
        """Keep where an expression may jump."""
        self.jumps[node] = jumps
        if self.continuous:
            return arithmetic.defined(self.b, arithmetic.negated(self.b, jumps), result)
        return result

    def _choice(self, node: Expr, condition: Ends, x: Ends, y: Ends) -> Ends:
        if node.kind == "b":
            return arithmetic.select_truth(self.b, condition, x, y)
        if is_an_extreme(node):
            question, first = node.args[0], node.args[1]
            smaller = (question.args[0] is first) == (question.op in ("lt", "le"))
            return (arithmetic.minimum if smaller else arithmetic.maximum)(self.b, x, y)
        either = arithmetic.choice_of(self.b, condition, x, y)
        return self._with_jumps(node, either, arithmetic.left_open(self.b, condition))

    def ends(self, array: str, row: int) -> Ends:
        """Read an interval from two rows."""
        low, high = (self.b.load(self.b.address(array, (row + k) * LANES), LANES) for k in (0, 1))
        return Ends(low=low, high=high)

    def keep(self, array: str, row: int, *values: Value | float) -> None:
        """Write values to consecutive rows."""
        for k, value in enumerate(values):
            wide = self.b.wide(value, LANES)
            self.b.store(wide, self.b.address(array, (row + k) * LANES))

    def may_jump(self, expr: Expr) -> Value | None:
        """Return where an expression may jump; None if nowhere."""
        jump: Value | None = None
        for node in needed([expr]):
            if node in self.jumps:
                here = self.jumps[node]
                jump = here if jump is None else self.b.logic("or", jump, here)
        return jump


def _values(module: Module, results: Sequence[Expr], continuous: bool = False) -> str:
    b = Body(module)
    w = EnclosureWriter(b, continuous)
    w.write(results)
    for k, expr in enumerate(results):
        w.keep("v", 2 * k, *arithmetic.finite(w.names[expr]).values)
    return b.function("values", pointers("xv"))


def _judge(
    module: Module,
    results: Sequence[Expr],
    gradients: Sequence[Sequence[Expr]],
    sides: int,
    all_exist: bool,
) -> str:
    b, rows = Body(module), judged_rows(sides, len(results))
    w = EnclosureWriter(b)
    w.write([*results, *(g for gradient in gradients for g in gradient)])
    box = [w.ends("x", 2 * i) for i in range(sides)]
    slopes = [[w.names[g] for g in gradient] for gradient in gradients]
    steps = [_centre(w, rows, i, box[i], slopes[0][i]) for i in range(sides)]
    inner, written = (b.address("o", at * LANES) for at in (rows.inner, rows.values))
    b.write(f"call void @values(ptr {inner}, ptr {written})")
    bounds, at_centre = [], []
    for k, expr in enumerate(results):
        value = w.ends("o", rows.values + 2 * k)
        at_centre.append(value)
        bounds.append(_bound(w, expr, value, slopes[k], steps))
    exist = _all_are_numbers(w, results) if all_exist and len(results) > 1 else None
    _kept(w, rows, bounds, at_centre, [_weights(b, box, slope) for slope in slopes], exist)
    return b.function("judge", pointers("xo"))


_Step = tuple[Ends, Value]


def _centre(w: EnclosureWriter, rows: JudgedRows, i: int, side: Ends, slope: Ends) -> _Step:
    """Choose a point of a side, and write it; return what the side is around it, and if it is."""
    # It is where the mean-value form has the least upper bound (E. Baumann, BIT 28:80, 1988): an
    # end of the side where the function rises or falls. A side without end stands for itself.
    b, (low, high) = w.b, side.values
    ends = b.compare("one", b.intrinsic("fabs", b.sub(high, low, exact=True)), _INF)
    over = b.sub(b.mul(slope.high, high, exact=True), b.mul(slope.low, low, exact=True), exact=True)
    point = b.op("fdiv", over, b.sub(slope.high, slope.low, exact=True), exact=True)
    middle = b.add(b.mul(low, 0.5, exact=True), b.mul(high, 0.5, exact=True), exact=True)
    point = b.select(b.compare("ord", point, point), point, middle)
    point = b.select(b.compare("oge", slope.low, 0.0), high, point)
    point = b.select(b.compare("ole", slope.high, 0.0), low, point)
    point = smaller(b, high, larger(b, low, point))
    w.keep("o", rows.centre + i, b.select(ends, point, arithmetic.NAN))
    first, last = b.select(ends, point, low), b.select(ends, point, high)
    w.keep("o", rows.inner + 2 * i, first, last)
    step = arithmetic.sub(b, side, Ends(low=point, high=point))
    return step, b.logic("and", ends, b.compare("olt", low, high))


def _bound(
    w: EnclosureWriter, expr: Expr, at_centre: Ends, slopes: Sequence[Ends], steps: Sequence[_Step]
) -> Value:
    """Return the upper bound of a result: by its value and by the mean-value form."""
    # The latter holds where nothing jumps; infinite where there is no value.
    b, value, mean = w.b, arithmetic.finite(w.names[expr]), at_centre
    for slope, (step, moves) in zip(slopes, steps, strict=True):
        if slope.point != 0:
            change = arithmetic.routine(b, "mul", arithmetic.mul, slope, step)
            low, high = (b.select(moves, v, 0.0) for v in change.values)
            mean = arithmetic.add(b, mean, Ends(low=low, high=high))
    jumps = w.may_jump(expr)
    other = mean.high if jumps is None else b.select(jumps, _INF, mean.high)
    other = b.select(b.compare("ord", mean.low, other), other, _INF)
    bound = b.select(b.compare("olt", other, value.high), other, value.high)
    return b.select(b.compare("ord", value.low, value.high), bound, _INF)


def _weights(b: Body, box: Sequence[Ends], slopes: Sequence[Ends]) -> list[Value]:
    """Return how much a result changes along each side; not a number if one is not known."""
    widths = [b.sub(side.high, side.low, exact=True) for side in box]
    steep = [arithmetic.absolute_of(b, slope).high for slope in slopes]
    weights = [b.mul(s, width, exact=True) for s, width in zip(steep, widths, strict=True)]
    known = b.wide(0.0, box[0].low.width)
    for s in steep:
        known = b.add(known, b.mul(s, 0.0, exact=True), exact=True)
    return [b.add(v, known, exact=True) for v in weights]


def _all_are_numbers(w: EnclosureWriter, results: Sequence[Expr]) -> Value:
    exist = [w.b.compare("ord", *arithmetic.finite(w.names[expr]).values) for expr in results]
    return reduce(lambda v, u: w.b.logic("and", v, u), exist)


def _kept(
    w: EnclosureWriter,
    rows: JudgedRows,
    bounds: Sequence[Value],
    at_centre: Sequence[Ends],
    weights: Sequence[list[Value]],
    exist: Value | None,
) -> None:
    """Write the least bound with the weights of its result, and the least value at the centre."""
    b, bound, weight = w.b, bounds[0], list(weights[0])
    met, above = at_centre[0].values
    for k in range(1, len(bounds)):
        smaller = b.compare("olt", bounds[k], bound)
        bound = b.select(smaller, bounds[k], bound)
        weight = [b.select(smaller, v, u) for v, u in zip(weights[k], weight, strict=True)]
        value = arithmetic.minimum(b, Ends(low=met, high=above), at_centre[k])
        met, above = value.values
    if exist is not None:
        bound = b.select(exist, bound, _INF)
        weight = [b.select(exist, v, arithmetic.NAN) for v in weight]
    w.keep("o", 0, bound, met, above)
    w.keep("o", rows.weight, *weight)
