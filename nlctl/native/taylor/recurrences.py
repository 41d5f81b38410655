"""How each coefficient of a Taylor polynomial follows from those before, as expressions.

With x(t0 + h) = x_0 + x_1 h + x_2 h^2 + ..., what is made of x has such a polynomial too:

    (a + b)_k = a_k + b_k
    (a b)_k   = a_0 b_k + a_k b_0 + sum_{j=1}^{k-1} a_j b_{k-j}
    f(x)_k    = (1 / k) (k x_k d_0 + sum_{j=1}^{k-1} j x_j d_{k-j}),   where d = f'(x)

and x_{k+1} = f_k / (k + 1) of the right-hand side f (Jorba, Zou, Experimental Mathematics 14:99,
2005).  The last line is y' = f'(x) x' with the derivative of the one table of functions; it needs
d up to order k - 1 only, so d may be made of f(x) itself, as that of exp is, or of what is
differentiated in turn, as sin and cos.

The sums are left to one loop, see `folds`; all else at an order k is a function like any other.
What is affine in time, as are inputs between two break points, has no sums.  At a kink the side
counts on which the solution continues: that of the first coefficient that is not 0.  A function of
what is so large that it does not depend on it any more, as 1 / cosh(t)^2, is constant: coefficients
of an argument that overflows are not asked for.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

from ...expressions.arrays import scalar
from ...expressions.conditions import at_integers, switching_function
from ...expressions.derivatives import linear, partials
from ...expressions.functions import FUNCTIONS
from ...expressions.graph import COMPARISONS, LOGIC, OF_FACTORS, Expr, Graph, deduce, needed
from ...expressions.linear_systems import solution
from ...expressions.stage import Stage
from ...expressions.without_poles import as_fraction, multiplied
from ...wording import counted
from ..codegen.plan import Store
from .products import constant_factors, without_zeros

_WEIGHT_ROWS = 3  # of "w": k, 1 / k, and 1 for k = 1, otherwise 0
ORDER_ROW, RECIPROCAL_ROW, IS_FIRST_ROW = range(_WEIGHT_ROWS)
_LARGE, _FLAT = 1e150, 1e-250  # an argument, and a derivative at it that says nothing more
ROOM = 8  # rows that sums of vectors take are a multiple of this


class NoSeriesError(Exception):
    """Something has no Taylor coefficients; the message says what and why."""


@dataclass(frozen=True, kw_only=True)
class Fold:
    """The sums over j = 1..k-1 of left_j right_{k-j}, of consecutive rows."""

    # first rows of the factors
    left: int
    right: int
    steps: tuple[int, int]  # 1 where a factor has a row for each sum, 0 where it has one for all
    array: str  # where the sums are written, ``"a"`` or ``"q"``
    # the first row there, and how many
    row: int
    size: int


@dataclass(frozen=True, kw_only=True)
class Recurrences:
    """What is written at order 0 and at each order after it."""

    # to ``"k"``, the coefficients of an order; at order 0 also to ``"o"``. At order k they
    # read the coefficients ``"b"`` of order k - 1, the sums ``"a"`` and ``"q"``, and ``"o"``.
    # At the highest order there are the states' alone, which need no sums.
    first: list[Store]
    following: list[Store]
    last: list[Store]
    folds: list[Fold]
    rows: dict[str, int]  # of every array
    # rows of ``"k"`` for each comparison: the difference of what is compared, and the first
    # of its coefficients that is not 0; the same of what is 0 where `floor` and its like jump;
    # and what that is
    sides: list[tuple[int, int, Expr]]


def recurrences(
    graph: Graph, stores: Mapping[str, Sequence[Store]], sizes: Mapping[str, int], *,
    packed: bool, overflows: bool = True,
) -> Recurrences:  # fmt: skip
    """Return how the coefficients of a right-hand side follow."""
    # The first rows of an order are the states, then switching functions, then the right-hand
    # side.
    reader = _Reader(graph=graph, n=sizes["x"], g=sizes["g"], overflows=overflows)
    return reader.read(stores, packed)


_Key = tuple[str, Expr]  # "term": an expression at order k; "node": the coefficients of a node


def _affine(node: Expr) -> tuple[Expr, ...]:
    """Return the parts of what is affine in them."""
    affine = node.op in ("add", "sub", "neg")
    affine |= node.op == "mul" and not all(a.varies for a in node.args)
    affine |= node.op == "div" and not node.args[1].varies
    return node.args if affine and node.varies else ()


@dataclass(kw_only=True)
class _Reader:
    """Goes through a graph."""

    graph: Graph
    n: int
    g: int
    # whether what is flat at arguments that overflow is constant there; not so on boxes
    overflows: bool
    # the k-th coefficient of each expression, None where it is 0
    terms: dict[Expr, Expr | None] = field(default_factory=dict)
    # what an expression that is affine in time changes by, None for nothing; False for others
    slopes: dict[Expr, Expr | bool | None] = field(default_factory=dict)
    # rows of "o" that have an expression's value, and rows of "k" that have its coefficients
    # or, of a comparison, its side
    values: dict[Expr, int] = field(default_factory=dict)
    before: dict[Expr, int] = field(default_factory=dict)
    sides: dict[Expr, Expr] = field(default_factory=dict)
    # of what is compared with 0, its first coefficient that is not 0
    distances: dict[Expr, Expr] = field(default_factory=dict)
    # which sums there are, by their factors
    sums: dict[tuple[_Key, _Key], Expr] = field(default_factory=dict)
    pairs: list[tuple[int, int, Expr]] = field(default_factory=list)  # see `Recurrences.sides`
    waiting: list[tuple[Expr, bool]] = field(default_factory=list)
    first: list[Store] = field(default_factory=list)
    following: list[Store] = field(default_factory=list)
    rows: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.rows = {"k": 2 * self.n + self.g, "o": 0, "a": 0, "q": 0, "w": _WEIGHT_ROWS}
        self.partial = partials(self.graph)
        self.stage = Stage(self.graph)

    def read(self, stores: Mapping[str, Sequence[Store]], packed: bool) -> Recurrences:
        """Go through all that is to be written, then through what that needs."""
        graph, n = self.graph, self.n
        states = graph.leaf("x", 0, n if n > 1 else None)
        self._write("k", 0, states, self.term(states), n)
        last = list(self.following)
        for name, begin in (("g", n), ("dx", n + self.g)):
            for s in stores[name]:
                self._write("k", begin + s.row, s.expr, self.term(s.expr), s.size)
        for node in needed([s.expr for s in stores["dx"]]):
            if at_integers(node) and not _of_time(node):
                self._side_of(switching_function(graph, node))
        while self.waiting:
            node, is_read = self.waiting.pop()
            term = self.term(node)
            if is_read:
                self._write("k", self.before[node], node, term, node.size or 1)
        folds = self._folds(packed)
        return Recurrences(
            first=self.first, following=self.following, last=last, folds=folds, rows=self.rows,
            sides=self.pairs,
        )  # fmt: skip

    def _write(self, array: str, row: int, value: Expr, term: Expr | None, size: int) -> None:
        self.first.append(Store(array=array, row=row, expr=value, size=size))
        later = self.graph.const(0.0) if term is None else term
        self.following.append(Store(array=array, row=row, expr=later, size=size))

    def _take(self, array: str, size: int) -> int:
        row = self.rows[array]
        self.rows[array] += size
        return row

    # -- what an expression is at order 0, at order k - 1, and at order k

    def value(self, node: Expr) -> Expr:
        """Return an expression's value where the step begins."""
        if not node.varies or node.op == "leaf":
            return node
        if node not in self.values:
            self.values[node] = self._take("o", node.size or 1)
            self.first.append(
                Store(array="o", row=self.values[node], expr=node, size=node.size or 1)
            )
        return self.graph.leaf("o", self.values[node], node.size)

    def previous(self, node: Expr) -> Expr:
        """Return an expression's coefficient of order k - 1."""
        if node not in self.before:
            self.before[node] = self._take("k", node.size or 1)
            self.waiting.append((node, True))
        return self.graph.leaf("b", self.before[node], node.size)

    def weight(self, row: int) -> Expr:
        """Return k, 1 / k, or whether k is 1."""
        return self.graph.leaf("w", row, None)

    def term(self, node: Expr) -> Expr | None:
        """Return an expression's coefficient of order k, None where it is 0."""
        return deduce(self.terms, node, self._behind, self._coefficient)

    def _behind(self, node: Expr) -> tuple[Expr, ...]:
        """Return the expressions whose terms make that of another."""
        if self.slope(node) is not False or node.op in ("leaf", "call", "solve", *OF_FACTORS):
            return ()
        return node.args[1:] if node.op == "select" else node.args

    def _coefficient(self, node: Expr) -> Expr | None:
        slope = self.slope(node)
        if isinstance(slope, Expr):
            return self.graph.op("mul", slope, self.weight(IS_FIRST_ROW))
        return None if slope is None else self._term(node)

    def slope(self, node: Expr) -> Expr | bool | None:
        """Return the slope of what is affine in time; False for what is not, or may not be."""
        return deduce(self.slopes, node, _affine, self._slope)

    def _slope(self, node: Expr) -> Expr | bool | None:
        if not node.varies:
            return None
        if node.op == "leaf" and node.data[0] == "t":
            return self.graph.const(1.0)
        if node.op == "leaf" and node.data[0] == "u":
            return _moved(self.graph, node, "v", 0)
        slopes = [self.slope(a) for a in _affine(node)] or [False]
        if any(s is False for s in slopes):
            return False
        return self._linear(node, [s if isinstance(s, Expr) else None for s in slopes])

    # -- operations

    def _term(self, node: Expr) -> Expr | None:
        if node.op == "leaf":
            following = _moved(self.graph, node, "b", self.n + self.g)
            return self.graph.op("mul", following, self.weight(RECIPROCAL_ROW))
        if node.op in ("call", "solve"):
            what = "an algebraic loop" if node.op == "solve" else f"the function {node.data[0]}"
            raise NoSeriesError(f"{what} is solved or called unchanged")
        if node.op in FUNCTIONS:
            return self._function(node)
        if node.op == "select":
            parts = [self.term(a) for a in node.args[1:]]
            if parts == [None, None] and self._is_steady(node.args[0]):
                return None  # a place in a table: it need not be compared with each
            side = self.side(node.args[0])
            if parts == [None, None]:
                return None
            zero = self.graph.const(0.0)
            return self.graph.op("select", side, *(p or zero for p in parts))
        if node.op in OF_FACTORS:
            return self._of_factors(node)
        terms = [self.term(a) for a in node.args]
        if node.op == "lu":
            return linear(self.graph, node, terms) if any(terms) else None
        if node.op == "lu_solve":
            return self._solution(node, terms[0], terms[1:])
        if node.op in ("mul", "div") and all(a.varies for a in node.args[node.op == "div" :]):
            return self._product(node, *terms) if node.op == "mul" else self._quotient(node, *terms)
        return self._linear(node, terms)

    def _linear(self, node: Expr, terms: Sequence[Expr | None]) -> Expr | None:
        """Return what an operation makes of the terms of what it is linear in."""
        graph, zero = self.graph, self.graph.const(0.0)
        if all(term is None for term in terms):
            return None
        a, b = terms[0], terms[-1]
        if node.op == "mul":
            other = node.args[0] if a is None else node.args[1]
            return None if other.op == "const" and other.data == 0.0 else graph.op(
                "mul", other, a or b or zero
            )  # fmt: skip
        if node.op == "div":
            return graph.op("div", a, node.args[1]) if a else None
        return linear(graph, node, terms)

    def _product(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        """a_0 b_k + a_k b_0 + sum a_j b_{k-j}; of what is affine there is one term of the sum."""
        graph, (first, second) = self.graph, node.args
        if a is None or b is None:
            term, other = (a, second) if b is None else (b, first)
            return None if term is None else graph.op("mul", self.value(other), term)
        parts = [graph.op("mul", self.value(o), term) for o, term in ((first, b), (second, a))]
        for this, other, term in ((first, second, b), (second, first, a)):
            slope = self.slope(this)
            if isinstance(slope, Expr):
                before = graph.op("mul", slope, self.previous(other))
                return graph.op("add", graph.op("mul", self.value(this), term), before)
        return graph.op("add", self._sum(a, b), graph.op("add", *parts))

    def _quotient(self, node: Expr, a: Expr | None, b: Expr | None) -> Expr | None:
        """q = a / b: q_k = (a_k - sum_{j=1}^{k} b_j q_{k-j}) / b_0."""
        graph, under = self.graph, node.args[1]
        numerator = a
        if b is not None:
            last = graph.op("mul", b, self.value(node))
            inner = graph.op("add", self._sum(b, ("node", node)), last)
            inner = self._unless_flat(inner, under, graph.op("div", node, under))
            numerator = graph.op("sub", a, inner) if a else graph.op("neg", inner)
        reciprocal = self.value(graph.op("div", graph.const(1.0), under))
        return graph.op("mul", numerator, reciprocal) if numerator else None

    def _of_factors(self, node: Expr) -> None:
        """Refuse a determinant; whether a matrix is regular does not change within a step."""
        if node.op == "lu_det" and node.varies:
            rows = counted(node.args[0].data[0], "row")
            raise NoSeriesError(f"no Taylor coefficients of the determinant of {rows} are known")

    def _solution(
        self, node: Expr, matrix: Expr | None, right: Sequence[Expr | None]
    ) -> Expr | None:
        """A_0 X_k = B_k - sum_{j=1}^{k} A_j X_{k-j}, with the factors of A_0."""
        graph, lu = self.graph, self.value(node.args[0])
        zero, (n, m), sizes = graph.const(0.0), node.data[0], node.data[1][1:]
        given = [(term or zero, size) for term, size in zip(right, sizes, strict=True)]
        if matrix is None:
            return solution(graph, lu, n, given) if any(right) else None
        change, before = graph.joined(given), self.value(node)
        rows = []
        for i, j in product(range(n), range(m)):
            left = graph.part(matrix, i * n, 1, n)
            column = graph.part(node, j, m, n)
            inner = graph.op("add", self._sum(left, ("node", column)),
                             graph.op("mul", left, graph.part(before, j, m, n)))  # fmt: skip
            moved = graph.sum(inner, n)
            rows.append((graph.op("sub", graph.item(change, i * m + j), moved), 1))
        return solution(graph, lu, n, rows)

    def _function(self, node: Expr) -> Expr | None:
        """Return the coefficient of a function of the table, as its row says."""
        terms, row = [self.term(a) for a in node.args], FUNCTIONS[node.op].series
        if row == "steady" or all(t is None for t in terms):
            return None
        if row == "unknown":
            raise NoSeriesError(f"no Taylor coefficients of '{node.op}' are known")
        if isinstance(row, Callable):
            given = [scalar(self.graph, self.graph.number(a)) for a in node.args]
            return self.term(self.stage.copied(row)(*given).only)
        total: Expr | None = None
        for i, (arg, term) in enumerate(zip(node.args, terms, strict=True)):
            if term is not None:
                derivative = without_zeros(self.graph, self.partial(node, i), node)
                part = self._chained(arg, term, derivative)
                part = part and self._unless_flat(part, arg, derivative)
                total = self.graph.op("add", total, part) if total and part else total or part
        return self.graph.op("mul", total, self.weight(RECIPROCAL_ROW)) if total else None

    def _chained(self, arg: Expr, term: Expr, derivative: Expr) -> Expr | None:
        """Return k times the coefficient of f(x): the sum over j = 1..k of j x_j d_{k-j}."""
        graph = self.graph
        factors, inner = constant_factors(derivative)
        slope = self.slope(arg)
        if not inner.varies:
            product = graph.op("mul", graph.op("mul", term, self.weight(ORDER_ROW)), inner)
        elif isinstance(slope, Expr):
            product = graph.op("mul", slope, self.previous(inner))
        else:
            rate = graph.op("mul", term, self.weight(ORDER_ROW))
            last = graph.op("mul", rate, self.value(inner))
            product = graph.op("add", self._sum(rate, ("node", inner)), last)
        for factor in factors:
            product = graph.op("mul", factor, product) if factor else graph.op("neg", product)
        return product

    def _unless_flat(self, part: Expr, arg: Expr, derivative: Expr) -> Expr:
        """Return what follows from an argument, 0 where that is large and nothing follows."""
        graph = self.graph
        if not derivative.varies or not self.overflows:
            return part
        large = graph.op("gt", graph.op("absolute", arg), graph.const(_LARGE))
        says = graph.op("ge", graph.op("absolute", derivative), graph.const(_FLAT))
        flat = graph.op("and", large, graph.op("not", says))  # NaN says nothing: inf * 0
        zero = graph.const(0.0)
        counts = self.value(graph.op("select", flat, zero, graph.const(1.0)))
        return graph.op("select", graph.op("ne", counts, zero), part, zero)

    def _sum(self, a: Expr, b: Expr | _Key) -> Expr:
        """Return the sum over j = 1..k-1 of a_j b_{k-j}, of terms or of a node's coefficients."""
        (left, turned), right = _without_sign(a), b
        if isinstance(right, Expr):
            right, other = _without_sign(right)
            turned ^= other
            left, right = sorted((left, right), key=lambda e: e.index)
            right = ("term", right)
        elif right[1] not in self.terms:
            self.waiting.append((right[1], False))
        key = (("term", left), right)
        if key not in self.sums:
            size = left.size or right[1].size
            array = "q" if size else "a"
            room = -(-(size or 1) // ROOM) * ROOM if size else 1  # whole vectors are written
            self.sums[key] = self.graph.leaf(array, self._take(array, room), size)
        total = self.sums[key]
        return self.graph.op("neg", total) if turned else total

    # -- conditions

    def side(self, condition: Expr) -> Expr:
        """Return a condition as it holds right behind the beginning of the step."""
        if not condition.varies or condition.op == "const":
            return condition
        if condition not in self.sides:
            self.sides[condition] = self._side(condition)
        return self.sides[condition]

    def _is_steady(self, condition: Expr) -> bool:
        """Whether all that a condition compares is constant within a step."""
        if condition.op in LOGIC or condition.op == "select":
            return all(self._is_steady(a) for a in condition.args)
        return condition.op in COMPARISONS and all(self.term(a) is None for a in condition.args)

    def _side(self, node: Expr) -> Expr:
        graph, zero = self.graph, self.graph.const(0.0)
        if node.op in LOGIC or node.op == "select":
            return graph.op(node.op, *(self.side(a) for a in node.args))
        if node.op not in COMPARISONS:
            raise NoSeriesError(f"it is not known on which side '{node.op}' continues")
        # with a pole no polynomial follows it: the sign of p / q is that of p q
        distance = as_fraction(graph, graph.op("sub", *node.args))
        product = multiplied(graph, distance.dividend, distance.poles)
        return graph.op(node.op, self._side_of(product), zero)

    def _side_of(self, distance: Expr) -> Expr:
        """Return the first coefficient of what is compared with 0 that is not 0 itself."""
        if distance in self.distances:
            return self.distances[distance]
        graph, zero, size = self.graph, self.graph.const(0.0), distance.size or 1
        row, term = self._take("k", size), self.term(distance)
        self.previous(distance)  # for its polynomial
        self.pairs += [(self.before[distance] + i, row + i, distance) for i in range(size)]
        before = graph.leaf("b", row, distance.size)
        now = graph.op(
            "select", graph.op("eq", before, zero), zero if term is None else term, before
        )
        self._write("k", row, distance, now, size)
        self.distances[distance] = now
        return now

    # -- where factors lie

    def _folds(self, packed: bool) -> list[Fold]:
        """Give the factors of sums their rows."""
        zero, folds, pairs, places = self.graph.const(0.0), [], [], {}
        for node, term in self.terms.items():
            if node.op == "leaf" and node.data[0] == "x" and node.data[2] < 2:
                places[term] = node.data[1]  # where the states' own coefficients are
        shared = {self.term(e) for _, (kind, e) in self.sums if kind == "node"}
        for keys, total in self.sums.items():
            left, right = ((self.term(e) or zero) if kind == "node" else e for kind, e in keys)
            if left in shared and right not in shared:
                left, right = right, left  # what several sums have is read once for them
            pairs.append((left, right, total))
        numbers = [pair for pair in pairs if pair[2].size is None]
        if packed and numbers:
            rows = [self._take("k", len(numbers)) for _ in range(2)]
            for left, right, total in numbers:
                for factor, begin in zip((left, right), rows, strict=True):
                    self._later(begin + total.data[1], factor)
            folds.append(Fold(left=rows[0], right=rows[1], steps=(1, 1), array="a", row=0,
                              size=len(numbers)))  # fmt: skip
        for left, right, total in pairs:
            if not (packed and total.size is None):
                rows = [self._placed(factor, places) for factor in (left, right)]
                steps = (int(left.size is not None), int(right.size is not None))
                folds.append(Fold(left=rows[0], right=rows[1], steps=steps, array=total.data[0],
                                  row=total.data[1], size=total.size or 1))  # fmt: skip
        return folds

    def _placed(self, factor: Expr, places: dict[Expr | None, int]) -> int:
        if factor not in places:
            places[factor] = self._take("k", factor.size or 1)
            self._later(places[factor], factor)
        return places[factor]

    def _later(self, row: int, factor: Expr) -> None:
        self.following.append(Store(array="k", row=row, expr=factor, size=factor.size or 1))


def _of_time(node: Expr) -> bool:
    """Whether an expression varies with t alone: its jumps are known before a run."""
    return all(e.data[0] == "t" for e in needed([node]) if e.op == "leaf" and e.varies)


def _moved(graph: Graph, leaf: Expr, array: str, by: int) -> Expr:
    """Return the same rows of another array, so many further on."""
    _, start, step = leaf.data
    return graph.node("leaf", data=(array, start + by, step), size=leaf.size, varies=True)


def _without_sign(node: Expr) -> tuple[Expr, bool]:
    return (node.args[0], True) if node.op == "neg" else (node, False)
