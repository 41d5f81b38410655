"""Taylor coefficients of a motion and of its derivatives, enclosed on boxes.

Along x' = f(x) directions follow d' = Df(x) d, e' = Df(x) e, and what both change together
q' = Df(x) q + D^2 f(x) (d, e): from q = 0 it comes to the second derivative of x by where it began.
How coefficients of all these follow from those before is what Taylor's method of runs has, see
`nlctl.native.taylor.recurrences`: here each is enclosed, as any function of a box.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...expressions.derivatives import tangents
from ...expressions.functions import FUNCTIONS
from ...expressions.graph import COMPARISONS, LOGIC, Expr, Graph, Untraceable
from ..codegen.plan import Store
from ..enclosures.rates import with_leaves
from ..enclosures.scalars import scalar_expressions
from ..enclosures.writer import values_text
from ..machine.finish import Loaded, finished
from ..taylor.recurrences import Fold, NoSeriesError, recurrences

_READ = ("b", "a", "q", "o", "w", "x")  # by the coefficients of an order, one after the other
_CHOICES = {*COMPARISONS, *LOGIC, "select", "minimum", "maximum", "absolute"}


@dataclass(frozen=True, kw_only=True)
class SeriesCode:
    """Machine code of enclosed coefficients."""

    order: int  # number n of states
    rows: int  # of the coefficients of an order: the first 4 n are those of x, d, e and q
    # where what an order reads begins: ``"b"`` the order before, ``"a"`` and ``"q"`` sums, ``"o"``
    # values at order 0, ``"w"`` weights, ``"x"`` the box
    at: Mapping[str, int]
    folds: np.ndarray  # shape (sums, 3); rows of both factors, and where the sum is read
    # ``values(x, v)`` at order 0, of the box, and at an order, of what it reads
    first: Loaded
    following: Loaded
    kept: int  # rows that are written at order 0 behind the coefficients, for ``"o"``

    @property
    def addresses(self) -> tuple[int, int]:
        """Of both functions."""
        return self.first.addresses["values"], self.following.addresses["values"]

    @property
    def places(self) -> tuple[int, ...]:
        """Rows and places as numbers: rows, kept, a, o, w, x, and how many are read."""
        at = self.at
        return self.rows, self.kept, at["a"], at["o"], at["w"], at["x"], at["end"]


def series_code(rates: Sequence[Expr]) -> SeriesCode:
    """Make the code for rates of the leaves ``x[0], x[1], ...``."""
    n = len(rates)
    graph, motion = with_leaves(rates, lambda g, leaf: g.leaf("x", leaf.data[1], None))
    every = _with_derivatives(graph, motion)
    stores = [Store(array="dx", row=i, expr=graph.number(e), size=1) for i, e in enumerate(every)]
    try:
        lengths = {"x": 4 * n, "g": 0}
        series = recurrences(graph, {"dx": stores, "g": []}, lengths, packed=False, overflows=False)
    except NoSeriesError as error:
        raise Untraceable(str(error)) from None
    for node in graph.nodes:
        row = FUNCTIONS.get(node.op)
        if node.op in _CHOICES or (row is not None and row.series == "steady"):
            raise Untraceable("they have cases, kinks or jumps")
    rows = series.rows
    sizes = {"b": rows["k"], **{name: rows[name] for name in ("a", "q", "o", "w")}, "x": 4 * n}
    at, end = {}, 0
    for name in _READ:
        at[name], end = end, end + sizes[name]
    first = _code(graph, series.first, {"k": (0, rows["k"]), "o": (rows["k"], rows["o"])}, {"x": 0})
    following = _code(graph, series.following, {"k": (0, rows["k"])}, at)
    return SeriesCode(
        order=n, rows=rows["k"], at={**at, "end": end}, first=first, following=following,
        folds=np.array([*_sums(series.folds, at)], dtype=np.int64).reshape(-1, 3), kept=rows["o"],
    )  # fmt: skip


def _with_derivatives(graph: Graph, rates: Sequence[Expr]) -> list[Expr]:
    """Return rates of x, of directions d and e, and of what both together change, q."""
    # q' = Df(x) q + D^2 f(x) (d, e).
    n, zero = len(rates), graph.const(0.0)

    def along(exprs: Sequence[Expr], block: Callable[[int], int | None]) -> list[Expr]:
        """Differentiate: which block of leaves the change of each block is in."""

        def change(leaf: Expr) -> Expr | None:
            to = block(leaf.data[1] // n)
            return None if to is None else graph.leaf("x", to * n + leaf.data[1] % n, None)

        return [zero if e is None else e for e in tangents(graph, exprs, change)]

    first = along(rates, {0: 1}.get)
    return [*rates, *first, *along(rates, {0: 2}.get), *along(first, {0: 2, 1: 3}.get)]


def _code(
    graph: Graph,
    stores: Sequence[Store],
    arrays: Mapping[str, tuple[int, int]],
    at: Mapping[str, int],
) -> Loaded:
    """Make code that writes stores where their arrays begin, and 0 where there are none."""
    by_row = {
        arrays[store.array][0] + store.row + i: expr
        for store in stores
        for i, expr in enumerate(_numbers(graph, store))
    }
    flat = scalar_expressions([*by_row.values()])[1]
    _, exprs = read = with_leaves(
        flat, lambda g, leaf: g.leaf("x", at[leaf.data[0]] + leaf.data[1], None)
    )
    written, zero = dict(zip(by_row, exprs, strict=True)), read[0].const(0.0)
    count = max(begin + size for begin, size in arrays.values())
    return finished(values_text([written.get(i, zero) for i in range(count)]), ("values",))


def _numbers(graph: Graph, store: Store) -> list[Expr]:
    if store.expr.size is None:
        return [store.expr] * store.size
    return [graph.item(store.expr, i) for i in range(store.size)]


def _sums(folds: Sequence[Fold], at: Mapping[str, int]) -> Iterator[tuple[int, int, int]]:
    """Yield the rows of the factors of every sum, and where it is read."""
    for fold in folds:
        for i in range(fold.size):
            left, right = fold.left + i * fold.steps[0], fold.right + i * fold.steps[1]
            yield left, right, at[fold.array] + fold.row + i
