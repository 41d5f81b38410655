"""The loops of Taylor's method as LLVM IR: over the orders, and the sums at each order.

    void taylor(double *t, double *x, double *u, double *v, double *c, double *k)

fills the coefficients `k` (orders, rows, members); `v` are the rates of the inputs `u`.  All sums
of an order go over earlier orders alone, so that they are independent of each other: a loop over
j has as many of them at once as there is room for in registers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from ..codegen.ir.text import Body, Module, Turns, Value, constant, pointers
from .recurrences import IS_FIRST_ROW, ORDER_ROW, RECIPROCAL_ROW, ROOM, Fold

WIDE = ROOM  # consecutive rows of a single member that are read together
_AT_ONCE = 8  # sums in registers


@dataclass(frozen=True, kw_only=True)
class SeriesLayout:
    """Where things lie."""

    rows: int  # of the coefficients of one order
    # rows of `c` from which on the arrays ``"w"``, ``"o"``, ``"a"`` and ``"q"`` lie, and the
    # rows ``"order"``, ``"rtol"`` and ``"atol"`` with the settings
    at: dict[str, int]
    lanes: int  # number of members
    size: int  # rows of `c`


@dataclass(frozen=True, kw_only=True)
class _Sum:
    """One vector of sums: distances from the first row in numbers, and whether each varies."""

    left: int
    right: int
    steps: tuple[int, int]
    array: str
    target: int


def taylor_text(folds: Sequence[Fold], layout: SeriesLayout) -> str:
    """Return the IR of the function, and of the sums that it calls."""
    return "\n".join([_sums_text(folds, layout), _orders_text(layout)])


def _orders_text(layout: SeriesLayout) -> str:
    """Write the loop over the orders; the last one has the states alone."""
    b, lanes, size = Body(Module(inlined=False)), layout.lanes, layout.rows * layout.lanes
    place = {name: b.moved("%c", row * lanes) for name, row in layout.at.items()}
    highest = b.new(f"fptosi {b.load(place['order'], 0)} to i64").text
    b.write(f"call void @first(ptr %t, ptr %x, ptr %u, ptr %c, ptr {place['o']}, ptr %k)")
    turns = Turns(b, [constant(1, kind="i")])
    order = turns.carried[0].text
    _write_weights(b, place["w"], order, lanes)
    b.write(f"call void @sums(ptr %k, i64 {order}, ptr {place['a']}, ptr {place['q']})")
    before, here = _orders_at(b, order, size)
    given = ", ".join(
        f"ptr {p}"
        for p in ("%t", "%x", "%u", "%c", "%v", *(place[n] for n in "wo"), before,
                  place["a"], place["q"], here)
    )  # fmt: skip
    b.write(f"call void @following({given})")
    following = b.new(f"add i64 {order}, 1")
    turns.end(b.new(f"icmp slt i64 {following.text}, {highest}"), [following])
    _write_weights(b, place["w"], highest, lanes)
    before, here = _orders_at(b, highest, size)
    b.write(f"call void @last(ptr {place['w']}, ptr {before}, ptr {here})")
    return b.function("taylor", ", ".join(f"ptr %{a}" for a in "txuvck"))


def _orders_at(b: Body, order: str, size: int) -> tuple[str, str]:
    """Return where the coefficients of the order before and of an order are."""
    at = b.new(f"mul i64 {order}, {size}").text
    here = b.moved("%k", at)
    return b.moved(here, -size), here


def _write_weights(b: Body, place: str, order: str, lanes: int) -> None:
    number = b.new(f"sitofp i64 {order} to double")
    is_first = b.new(f"fcmp oeq {number}, {constant(1.0).text}", 0, "b")
    weights = {
        ORDER_ROW: number,
        RECIPROCAL_ROW: b.op("fdiv", 1.0, number),
        IS_FIRST_ROW: b.select(is_first, constant(1.0), constant(0.0)),
    }
    for row, weight in weights.items():
        b.store(b.wide(weight, lanes) if lanes > 1 else weight, b.moved(place, row * lanes))


def _sums_text(folds: Sequence[Fold], layout: SeriesLayout) -> str:
    b, lanes = Body(Module(inlined=False)), layout.lanes
    size = layout.rows * lanes
    sums = [one for fold in folds for one in _vectors(fold, lanes)]
    sums.sort(key=lambda s: (s.right, s.left))  # so that one loop has what shares a factor
    b.write(f"%first = getelementptr double, ptr %k, i64 {size}")
    b.write("%end = add i64 %order, -1")
    b.write(f"%distance = mul i64 %end, {size}")
    b.write("%last = getelementptr double, ptr %k, i64 %distance")
    b.write("%any = icmp sgt i64 %order, 1")
    for begin in range(0, len(sums), _AT_ONCE):
        _chunk(b, sums[begin : begin + _AT_ONCE], lanes, size)
    given = f"{pointers('k')}, i64 %order, {pointers('aq')}"
    return b.function("sums", given, "internal ")


def _vectors(fold: Fold, lanes: int) -> list[_Sum]:
    """Return the vectors of sums: of all members, or of consecutive rows of a single one."""
    # Those of a single member are padded: what is behind the last rows is read by nobody.
    step = 1 if lanes > 1 else WIDE
    return [
        _Sum(
            left=(fold.left + i * fold.steps[0]) * lanes,
            right=(fold.right + i * fold.steps[1]) * lanes,
            steps=fold.steps if lanes == 1 else (1, 1),
            array=fold.array,
            target=(fold.row + i) * lanes,
        )
        for i in range(0, fold.size, step)
    ]


def _chunk(b: Body, sums: Sequence[_Sum], lanes: int, size: int) -> None:
    """Write a loop over j that adds up some sums, and what writes them."""
    width = lanes if lanes > 1 else WIDE
    zero = constant(0.0, width)
    first = [Value("%first", 0, "p"), Value("%last", 0, "p"), Value("0", 0, "i")]
    turns = Turns(b, [*first, *[zero] * len(sums)], only_if="%any")
    (left, right, index), totals = (v.text for v in turns.carried[:3]), turns.carried[3:]
    known: dict[tuple[str, int, int], Value] = {}

    def factor(pointer: str, at: int, step: int) -> Value:
        key = (pointer, at, step)
        if key not in known:
            one = b.load(b.moved(pointer, at), width if step else 0)
            known[key] = one if step else b.wide(one, width)
        return known[key]

    added = [
        b.add(total, b.mul(factor(left, s.left, s.steps[0]), factor(right, s.right, s.steps[1])))
        for s, total in zip(sums, totals, strict=True)
    ]
    moved = b.new(f"getelementptr double, ptr {left}, i64 {size}")
    back = b.new(f"getelementptr double, ptr {right}, i64 {-size}")
    following = b.new(f"add i64 {index}, 1")
    turns.end(b.new(f"icmp slt i64 {following.text}, %end"), [moved, back, following, *added])
    before, loop = turns.before, turns.loop
    results = [
        b.new(f"phi {new.type} [{zero.text}, %{before}], [{new.text}, %{loop}]", width)
        for new in added
    ]
    for s, result in zip(sums, results, strict=True):
        b.store(result, b.moved(f"%{s.array}", s.target))
