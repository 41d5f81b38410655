"""Factors of matrices and solutions of linear equations, as loops over numbers in memory.

What is given lies in front of what results, as for every call; rows lie one behind the other.
"""

from collections.abc import Callable

from .text import Body, Value


class _Memory:
    """Numbers in memory, and integers; `b` writes IR or C."""

    def __init__(self, b: Body, step: int) -> None:
        self.b, self.step = b, step
        self.zero, self.one = self.whole(0), self.whole(1)

    def whole(self, k: int) -> Value:
        return Value(str(k), 0, "i")

    def at(self, *terms: Value | tuple[Value, Value]) -> str:
        """Return the address of the entry at a sum of integers and of products of two."""
        total: Value | None = None
        for term in terms:
            value = self.b.logic("mul", *term) if isinstance(term, tuple) else term
            total = self.b.logic("add", total, value) if total else value
        assert total is not None
        return self.b.address("a", 0, total.text, self.step)

    def load(self, *terms: Value | tuple[Value, Value]) -> Value:
        return self.b.load(self.at(*terms), 0)

    def less(self, where: str, factor: Value, other: Value) -> None:
        """Subtract a product from the number at an address."""
        self.b.store(self.b.sub(self.b.load(where, 0), self.b.mul(factor, other)), where)


def factorised(b: Body, step: int, n: Value) -> None:
    """Write the factors of an n x n matrix: each column's first largest entry comes up."""
    m = _Memory(b, step)
    begin = b.logic("mul", n, n)
    order = b.logic("add", begin, begin)
    det, flag = b.logic("add", order, n), b.logic("add", b.logic("add", order, n), m.one)
    b.counted(m.zero, begin, lambda k: b.store(m.load(k), m.at(begin, k)))
    b.counted(m.zero, n, lambda k: b.store(b.as_number(k), m.at(order, k)))
    for place in (det, flag):
        b.store(b.literal(1.0), m.at(place))

    def column(i: Value) -> None:
        following = b.logic("add", i, m.one)
        b.store(b.as_number(i), m.at(m.zero))  # (what was given is not needed any more)

        def compare(k: Value) -> None:
            best = b.as_index(m.load(m.zero))
            sizes = [b.intrinsic("fabs", m.load(begin, (r, n), i)) for r in (k, best)]
            b.when(b.compare("ogt", *sizes), lambda: b.store(b.as_number(k), m.at(m.zero)))

        b.counted(following, n, compare)
        best = b.as_index(m.load(m.zero))

        def exchange(one: str, other: str) -> None:
            first, second = b.load(one, 0), b.load(other, 0)
            b.store(second, one)
            b.store(first, other)

        def brought_up() -> None:
            b.counted(m.zero, n, lambda j: exchange(m.at(begin, (i, n), j),
                                                    m.at(begin, (best, n), j)))  # fmt: skip
            exchange(m.at(order, i), m.at(order, best))
            b.store(b.neg(m.load(det)), m.at(det))

        b.when(b.compare("une", m.load(m.zero), b.as_number(i)), brought_up)
        pivot = m.load(begin, (i, n), i)
        b.store(b.mul(m.load(det), pivot), m.at(det))
        is_zero = b.compare("oeq", pivot, 0.0)
        b.when(is_zero, lambda: b.store(b.literal(0.0), m.at(flag)))
        divisor = b.select(is_zero, b.literal(1.0), pivot)

        def below(k: Value) -> None:
            factor = b.op("fdiv", m.load(begin, (k, n), i), divisor)
            b.store(factor, m.at(begin, (k, n), i))
            b.counted(following, n, lambda j: m.less(m.at(begin, (k, n), j), factor,
                                                     m.load(begin, (i, n), j)))  # fmt: skip

        b.counted(following, n, below)

    b.counted(m.zero, n, column)


def back_substituted(b: Body, step: int, n: Value, columns: Value) -> None:
    """Write the solution for some right-hand sides, from the factors in front of them."""
    m = _Memory(b, step)
    order = b.logic("mul", n, n)
    right = b.logic("add", b.logic("add", order, n), m.whole(2))
    begin = b.logic("add", right, b.logic("mul", n, columns))

    def taken(k: Value) -> None:
        source = b.as_index(m.load(order, k))
        b.counted(m.zero, columns, lambda j: b.store(m.load(right, (source, columns), j),
                                                     m.at(begin, (k, columns), j)))  # fmt: skip

    def less(k: Value, i: Value) -> None:
        factor = m.load((k, n), i)
        b.counted(m.zero, columns, lambda j: m.less(m.at(begin, (k, columns), j), factor,
                                                    m.load(begin, (i, columns), j)))  # fmt: skip

    def back(turn: Value) -> None:
        k = b.logic("sub", b.logic("sub", n, m.one), turn)
        b.counted(b.logic("add", k, m.one), n, lambda i: less(k, i))
        pivot = m.load((k, n), k)

        def divided(j: Value) -> None:
            where = m.at(begin, (k, columns), j)
            b.store(b.op("fdiv", b.load(where, 0), pivot), where)

        b.counted(m.zero, columns, divided)

    b.counted(m.zero, n, taken)
    b.counted(m.zero, n, lambda k: b.counted(m.zero, k, lambda i: less(k, i)))
    b.counted(m.zero, n, back)


# by operation: what writes its function, given the numbers of members and the sizes
ROUTINES: dict[str, Callable[..., None]] = {"lu": factorised, "lu_solve": back_substituted}
