"""What a step of Taylor's method does with coefficients, as LLVM IR.

    void growth(double *x, double *c, double *k, double *largest)
    void step(double *h, double *c, double *k, double *x, double *slope)
    void judge(double *h, double *x, double *x_new, double *slope, double *dx, double *c,
               double *k, double *largest)
    void values(double *h, double *c, double *k, double *g)

Rows are taken one after the other, of several members each as a vector, of a single member eight
at a time.
"""

from collections.abc import Callable, Sequence

from ..codegen.ir.functions import applied
from ..codegen.ir.text import Body, Module, Turns, Value, constant, pointers
from ..integrate.methods.crossings import FOLLOWED
from .folds import WIDE, SeriesLayout

_ZERO = Value("0", 0, "i")
GROWN = 4  # coefficients by whose growth a step is chosen
_Write = Callable[[str, Sequence[Value]], Sequence[Value]]  # of a place and of largest values


def steps_text(n: int, switching: int, compared: Sequence[int], layout: SeriesLayout) -> str:
    """Return the IR of the functions."""
    functions = {
        "growth": ("x c k largest", lambda f: f.growth(n)),
        "step": ("h c k x slope", lambda f: f.step(n)),
        "judge": ("h x x_new slope dx c k largest", lambda f: f.judge(n, compared)),
        "values": ("h c k g", lambda f: f.values(n, switching)),
    }
    texts = []
    for name, (arguments, write) in functions.items():
        function = _Function(layout)
        write(function)
        texts.append(function.b.function(name, pointers(arguments.split())))
    return "\n".join(texts)


class _Function:
    """Writes one function."""

    def __init__(self, layout: SeriesLayout) -> None:
        self.b, self.lanes = Body(Module(inlined=False)), layout.lanes
        self.size = layout.rows * layout.lanes
        self.at = layout.at

    def setting(self, name: str) -> Value:
        """Read a setting from `c`."""
        where = self.place("c", str(self.at[name] * self.lanes))
        return self.b.load(where, 0)

    def highest(self) -> str:
        """Return the highest order."""
        return self.b.new(f"fptosi {self.setting('order')} to i64").text

    def below(self, order: str) -> str:
        """Return an order less by one: the highest of all but the states."""
        return self.b.new(f"add i64 {order}, -1").text

    def place(self, array: str, at: str) -> str:
        return self.b.moved(f"%{array}", at)

    def coefficients(self, order: str) -> str:
        """Return where the coefficients of an order are."""
        return self.place("k", self.b.new(f"mul i64 {order}, {self.size}").text)

    def read(self, array: str, at: str, width: int) -> Value:
        return self.b.load(self.place(array, at), width)

    # -- loops

    def rows(self, count: int, carried: int, write: _Write) -> list[Value]:
        """Write what is done with the numbers from a place on; return the largest values."""
        # The last rows of a single member are taken once more together with those before
        # them.
        width, total = self.width(count), count * self.lanes
        step = width or 1
        zeros = [constant(0.0, width)] * carried
        turns = total // step
        largest = self._loop(turns, step, zeros, write) if turns else zeros
        if total % step:
            largest = list(write(str(total - step), largest))
        return largest

    def width(self, count: int) -> int:
        """Return how many numbers are taken together."""
        return self.lanes if self.lanes > 1 else WIDE if count >= WIDE else 0

    def _loop(self, turns: int, step: int, zeros: list[Value], write: _Write) -> list[Value]:
        b = self.b
        loop = Turns(b, [_ZERO, *zeros])
        index, *entries = loop.carried
        values = list(write(index.text, entries))
        following = b.new(f"add i64 {index.text}, {step}")
        loop.end(b.new(f"icmp slt i64 {following.text}, {turns * step}"), [following, *values])
        return values

    def _countdown(self, turns: Turns, left: Value, following: Sequence[Value]) -> None:
        """End a loop that has as many turns as `left`, which it carries last."""
        less = self.b.new(f"add i64 {left.text}, -1")
        turns.end(self.b.new(f"icmp sgt i64 {less.text}, 0"), [*following, less])

    def polynomial(
        self, highest: str, at: str, h: Value, *, slope: bool, magnitudes: bool = False
    ) -> list[Value]:
        """Return a polynomial's value at h, and its slope: from the highest order downwards."""
        # With `magnitudes` the terms' magnitudes are added up, for h > 0.
        b, width = self.b, h.width
        top = b.moved(self.coefficients(highest), at)
        read = self.magnitude if magnitudes else lambda value: value
        start = [read(b.load(top, width))] + [constant(0.0, width)] * slope
        turns = Turns(b, [Value(top, 0, "p"), *start, Value(highest, 0, "i")])
        place, *entries, left = turns.carried
        below = b.new(f"getelementptr double, ptr {place.text}, i64 {-self.size}")
        values = [b.add(b.mul(entries[0], h), read(b.load(below.text, width)))]
        if slope:
            values.append(b.add(b.mul(entries[1], h), entries[0]))
        self._countdown(turns, left, [below, *values])
        return values

    def power(self, highest: str, h: Value) -> Value:
        """Return h to the power of the highest order."""
        turns = Turns(self.b, [constant(1.0, h.width), Value(highest, 0, "i")])
        so_far, left = turns.carried
        power = self.b.mul(so_far, h)
        self._countdown(turns, left, [power])
        return power

    # -- largest values

    def larger(self, a: Value, b: Value) -> Value:
        """Return the larger of two values; NaN is larger than all."""
        return applied(self.b, "maximum", a, b)

    def over_lanes(self, value: Value) -> Value:
        """Return the largest of a single member's rows; those of several are apart already."""
        if self.lanes > 1 or not value.width:
            return value
        return self.b.halved(value, self.larger)

    def write_largest(self, values: Sequence[Value]) -> None:
        """Write the largest of each member."""
        for i, value in enumerate(values):
            self.b.store(value, self.place("largest", str(i * self.lanes)))

    def tolerances(self, count: int) -> tuple[Value, Value]:
        """Read rtol and atol."""
        rtol, atol = (self.setting(name) for name in ("rtol", "atol"))
        width = self.width(count)
        return (self.b.wide(rtol, width), self.b.wide(atol, width)) if width else (rtol, atol)

    def weight(self, size: Value, tolerances: tuple[Value, Value]) -> Value:
        """Return 1 / (atol + rtol |x|)."""
        rtol, atol = tolerances
        return self.b.op("fdiv", 1.0, self.b.add(self.b.mul(rtol, size), atol))

    # -- the functions

    def magnitude(self, x: Value) -> Value:
        """Return |x|: its bits without the sign."""
        return self.b.real(self.b.integer("and", self.b.bits(x), 2**63 - 1))

    def growth(self, n: int) -> None:
        """Write the last coefficients over the tolerance, that of the highest order first."""
        b, highest, width = self.b, self.highest(), self.width(n)
        tolerances = self.tolerances(n)
        orders = [self.coefficients(b.new(f"add i64 {highest}, {-i}").text) for i in range(GROWN)]

        def write(at: str, largest: Sequence[Value]) -> list[Value]:
            size = self.magnitude(self.read("x", at, width))
            scale = self.weight(size, tolerances)
            parts = []
            for order, before in zip(orders, largest, strict=True):
                part = b.mul(self.magnitude(b.load(b.moved(order, at), width)), scale)
                parts.append(self.larger(before, part))
            return parts

        self.write_largest([self.over_lanes(value) for value in self.rows(n, GROWN, write)])

    def step(self, n: int) -> None:
        """Write the states and their polynomials' slopes at the ends of steps h."""
        highest, h = self.highest(), self.steps(n)

        def write(at: str, _: Sequence[Value]) -> list[Value]:
            ends = self.polynomial(highest, at, h, slope=True)
            for array, value in zip(("x", "slope"), ends, strict=True):
                self.b.store(value, self.place(array, at))
            return []

        self.rows(n, 0, write)

    def steps(self, count: int) -> Value:
        """Read h."""
        width = self.width(count)
        h = self.b.load("%h", self.lanes if self.lanes > 1 else 0)
        return self.b.wide(h, width) if width else h

    def judge(self, n: int, compared: Sequence[int]) -> None:
        """Write h times the defect, and the last term, over the tolerance."""
        # Both are not finite where a state is not. A third number is above 0 where
        # something that is compared may change its side, or its polynomial is not to be
        # trusted.
        b, width, highest = self.b, self.width(n), self.highest()
        h, tolerances = self.steps(n), self.tolerances(n)
        power, last = self.power(highest, h), self.coefficients(highest)

        def write(at: str, largest: Sequence[Value]) -> list[Value]:
            x, x_new, slope, dx = (self.read(a, at, width) for a in ("x", "x_new", "slope", "dx"))
            size = self.larger(self.magnitude(x), self.magnitude(x_new))
            scale = self.weight(size, tolerances)
            missed = b.mul(self.magnitude(b.mul(h, b.sub(dx, slope))), scale)
            missed = b.add(missed, b.mul(x_new, 0.0))
            last_terms = b.load(b.moved(last, at), width)
            term = b.mul(self.magnitude(b.mul(power, last_terms)), scale)
            parts = zip(largest, (missed, term), strict=True)
            return [self.larger(before, part) for before, part in parts]

        greatest = [self.over_lanes(value) for value in self.rows(n, 2, write)]
        doubts = constant(-1.0, self.lanes if self.lanes > 1 else 0)
        for row, count in runs(compared):
            doubts = self._doubts(row, count, self.below(highest), doubts)
        self.write_largest([*greatest, doubts])

    def _doubts(self, row: int, count: int, highest: str, before: Value) -> Value:
        """Return the largest doubt of some rows, or that of rows before."""
        b, width, h = self.b, self.width(count), self.steps(count)
        power = b.op("fdiv", self.power(highest, h), h)  # NaN for h = 0: a lane that has ended

        def write(at: str, largest: Sequence[Value]) -> list[Value]:
            here = b.new(f"add i64 {at}, {row * self.lanes}").text
            total = self.polynomial(highest, here, h, slope=False, magnitudes=True)[0]
            first = self.magnitude(self.read("k", here, width))
            orders = [b.new(f"add i64 {highest}, {-i}").text for i in range(2)]
            last, other = (
                self.magnitude(b.load(b.moved(self.coefficients(order), here), width))
                for order in orders
            )
            ending = b.mul(power, b.add(other, b.mul(last, h)))
            doubt = b.sub(ending, b.mul(total, FOLLOWED))
            crossing = b.sub(total, b.mul(first, 2.0))
            doubt = b.select(b.compare("ogt", crossing, doubt), crossing, doubt)
            return [b.select(b.compare("ogt", doubt, largest[0]), doubt, largest[0])]

        (most,) = self.rows(count, 1, write)
        most = self.over_lanes(most)
        return b.select(b.compare("ogt", most, before), most, before)

    def values(self, n: int, count: int) -> None:
        """Write the switching functions' polynomials at h."""
        if not count:
            return
        highest, h = self.below(self.highest()), self.steps(count)

        def write(at: str, _: Sequence[Value]) -> list[Value]:
            here = self.b.new(f"add i64 {at}, {n * self.lanes}").text
            self.b.store(self.polynomial(highest, here, h, slope=False)[0], self.place("g", at))
            return []

        self.rows(count, 0, write)


def runs(rows: Sequence[int]) -> list[tuple[int, int]]:
    """Return consecutive rows as pairs of the first and how many.

    Examples
    --------
    >>> runs([7, 3, 4, 5])
    [(3, 3), (7, 1)]
    """
    pairs: list[tuple[int, int]] = []
    for row in sorted(rows):
        if pairs and row == sum(pairs[-1]):
            pairs[-1] = (pairs[-1][0], pairs[-1][1] + 1)
        else:
            pairs.append((row, 1))
    return pairs
