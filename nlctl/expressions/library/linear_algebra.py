"""Linear algebra of small matrices, element by element."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Special, Tracer, as_array, scalar, traced
from ..constants import constant_value
from ..elimination import eliminated, is_zero, substituted
from ..graph import Expr, Graph, Untraceable
from ..linear_systems import determinant, factors, regular, solution
from ..operators import elementwise, product, total
from .complex_numbers import ComplexPair, holds_complex, paired
from .table import WRITTEN, Facade, of

__all__: list[str] = []

_Rows = list[list[Any]]
_SMALL = 6  # rows of a matrix up to which elimination is written out, not one operation


def _rows(graph: Graph, matrix: object) -> _Rows:
    array = traced(graph, matrix)
    if array.ndim != 2:
        raise Untraceable("many matrices at once")
    return [list(row) for row in array]


def _square(graph: Graph, matrix: object) -> _Rows:
    rows = _rows(graph, matrix)
    if any(len(row) != len(rows) for row in rows):
        raise Untraceable("a matrix that is not square")
    return rows


def _guard(graph: Graph, pivots: Sequence[Any]) -> None:
    """Note that NumPy raises an error for a singular matrix."""
    for pivot in pivots:
        guard = elementwise(graph, "ne", pivot, 0.0).only
        if guard.op != "const":
            graph.guard(guard, np.linalg.LinAlgError)
        elif not guard.data:
            raise Untraceable("a singular matrix")


def solved(graph: Graph, matrix: object, b: object) -> Tracer:
    """Return the solution of linear equations: elimination with the pivots that LAPACK takes."""
    right, rows = traced(graph, b), _square(graph, matrix)
    if len(rows) > _SMALL:
        return _solved_as_one(graph, rows, right)
    columns = [[v] for v in right] if right.ndim == 1 else _rows(graph, right)
    augmented = [[*row, *more] for row, more in zip(rows, columns, strict=True)]
    triangular, pivots = eliminated(Facade(graph), augmented)
    _guard(graph, pivots)
    x = traced(graph, substituted(triangular))
    x = x + [_skipped(graph, rows, side) for side in zip(*columns, strict=True)]
    return x[:, 0] if right.ndim == 1 else x


def _skipped(graph: Graph, rows: _Rows, side: Sequence[Any] = ()) -> Any:
    """Return -0.0, or NaN where LAPACK multiplies the zeros of a matrix by what is not finite."""
    entries = list(itertools.chain(*rows))
    if not any(map(is_zero, entries)):
        return -0.0  # nothing was skipped: what is not finite is in the result
    varying = {v.only: v for v in (*entries, *side) if v.only.op != "const"}
    return functools.reduce(lambda total, v: total - 0.0 * v, varying.values(), -0.0)


def _factors(graph: Graph, rows: _Rows) -> Expr:
    """Return the factors of a matrix; NumPy raises an error where there are none."""
    entries = [(graph.number(v.only), 1) for row in rows for v in row]
    return factors(graph, entries, len(rows))


def _solved_as_one(graph: Graph, rows: _Rows, right: Tracer) -> Tracer:
    """Return the solution as one operation."""
    if not right.ndim or len(right) != len(rows) or right.ndim > 2:
        raise Untraceable("right-hand sides that do not fit to their matrix")
    lu = _factors(graph, rows)
    graph.guard(regular(graph, lu), np.linalg.LinAlgError)
    columns = 1 if right.ndim == 1 else right.shape[1]
    pieces = [p for row in (right if right.ndim == 2 else [right]) for p in row.pieces()]
    whole = solution(graph, lu, len(rows), pieces)
    starts = range(0, len(rows) * columns, columns)
    if right.ndim == 1:
        items = Tracer(graph, as_array(whole), 0, len(rows))
        return items if len(rows) > graph.small else items.short()
    lines = [Tracer(graph, as_array(graph.part(whole, k, 1, columns)), 0, columns) for k in starts]
    return traced(graph, lines if columns > graph.small else [line.short() for line in lines])


def entries_written_out(graph: Graph, rows: _Rows, op: str) -> list[Any]:
    """Return what an operation computes of a matrix, with its right-hand sides in the rows."""
    if op == "lu_det":
        return [_determinant(graph, rows)]
    triangular, pivots = eliminated(Facade(graph), [list(row) for row in rows])
    if op == "lu_regular":
        singular = _any_is_zero(Facade(graph), pivots)
        return [Facade(graph).where(singular, 0.0, 1.0)]
    return [v for row in substituted(triangular) for v in row]


def of_triangle(
    graph: Graph,
    a: object,
    b: object,
    trans: object = 0,
    lower: bool = False,
    unit_diagonal: bool = False,
    overwrite_b: bool = False,
    check_finite: bool = True,
) -> Tracer:
    """Return the solution of equations with a triangular matrix, as SciPy's `solve_triangular`."""
    matrix, right = traced(graph, a), traced(graph, b)
    if trans not in (0, 1, "N", "T"):
        raise Untraceable("a matrix that is transposed and conjugated")
    if trans in (1, "T"):
        matrix, lower = matrix.T, not lower
    rows, n = _square(graph, matrix), len(matrix)
    places = [*range(n)][:: -1 if lower else 1]
    columns = [[v] for v in right] if right.ndim == 1 else _rows(graph, right)
    for i in range(n if unit_diagonal else 0):
        rows[i][i] = traced(graph, 1.0)
    _guard(graph, [rows[i][i] for i in range(n)])
    solution = substituted([[*(rows[i][j] for j in places), *columns[i]] for i in places])
    x = [solution[places[i]] for i in range(n)]
    return traced(graph, [v for (v,) in x] if right.ndim == 1 else x)


def of_cholesky(
    graph: Graph,
    c_and_lower: Any,
    b: object,
    overwrite_b: bool = False,
    check_finite: bool = True,
) -> Tracer:
    """Return the solution of equations from the factor of SciPy's `scipy.linalg.cho_factor`."""
    c, lower = c_and_lower
    first = of_triangle(graph, c, b, trans=0 if lower else 1, lower=lower)
    return of_triangle(graph, c, first, trans=1 if lower else 0, lower=lower)


def cholesky_factor(
    graph: Graph, a: object, lower: bool = False, overwrite_a: bool = False,
    check_finite: bool = True,
) -> tuple[Tracer, bool]:  # fmt: skip
    """Return SciPy's `scipy.linalg.cho_factor`: in the other triangle the matrix stays."""
    a = traced(graph, a)
    factor = cholesky(graph, a if lower else a.T)
    factor, places = (factor if lower else factor.T), np.tri(len(a), dtype=bool)
    return elementwise(graph, "select", places if lower else places.T, factor, a), lower


def of_triangles(
    graph: Graph,
    lu_and_piv: Any,
    b: object,
    trans: object = 0,
    overwrite_b: bool = False,
    check_finite: bool = True,
) -> Tracer:
    """Return the solution of equations from the factors of SciPy's `scipy.linalg.lu_factor`."""
    lu, pivots = lu_and_piv
    if isinstance(lu, _Factors) and lu is pivots:
        matrix = lu.__dict__["matrix"]
        return solved(graph, matrix if trans == 0 else matrix.T, b)
    exchanges = pivots if isinstance(pivots, np.ndarray) else constant_value(traced(graph, pivots))
    if trans != 0 or not isinstance(exchanges, np.ndarray):
        raise Untraceable("factors that are transposed, or whose exchanges depend on the state")
    order = [*range(len(exchanges))]
    for i, j in enumerate(map(int, exchanges)):
        order[i], order[j] = order[j], order[i]
    right = traced(graph, b)[order]
    first = of_triangle(graph, lu, right, lower=True, unit_diagonal=True)
    return of_triangle(graph, lu, first)


def _of_each(written: Callable[..., Any]) -> Any:
    """Return a function of one matrix as one of many, one after the other."""

    @functools.wraps(written)
    def function(graph: Graph, a: Arithmetic, *rest: object) -> Any:
        if holds_complex([a, *rest]):
            return written(graph, a, *rest)
        a, others = traced(graph, a), [traced(graph, b) for b in rest]
        if a.ndim < 3:
            return written(graph, a, *others)
        sides = [b if b.ndim == a.ndim else [b] * len(a) for b in others]
        if any(b.ndim == a.ndim and len(b) != len(a) for b in others):
            raise Untraceable("many matrices at once, with other shapes")
        return traced(graph, [function(graph, *parts) for parts in zip(a, *sides, strict=True)])

    return function


def _paired_rows(graph: Graph, matrix: object) -> Tracer:
    """Return the matrix of twice as many real equations that stands for one of complex numbers."""
    z, np_ = paired(graph, matrix), Facade(graph)
    return np_.block([[z.real, -z.imag], [z.imag, z.real]])


def _solved_pairs(graph: Graph, a: object, b: object) -> ComplexPair:
    """Return the solution of linear equations of complex numbers."""
    right = paired(graph, b)
    parts = Facade(graph).concatenate([right.real, right.imag])
    solution = solved(graph, _paired_rows(graph, a), parts)
    return ComplexPair(graph, solution[: len(right)], solution[len(right) :])


def of_bands(
    graph: Graph, l_and_u: tuple[int, int], ab: object, b: object, **how: object
) -> Tracer:
    """Return the solution of equations whose matrix is given by its diagonals."""
    below, above = l_and_u
    bands = _rows(graph, ab)
    n = len(bands[0])
    whole = [
        [bands[above + i - j][j] if -above <= i - j <= below else 0.0 for j in range(n)]
        for i in range(n)
    ]
    return solved(graph, whole, b)


@of(np.linalg.solve)
@_of_each
def _solve(graph: Graph, a: object, b: object) -> Any:
    """Return the solution of linear equations."""
    is_complex = holds_complex(a) or holds_complex(b)
    return _solved_pairs(graph, a, b) if is_complex else solved(graph, a, b)


@of(np.linalg.inv)
@_of_each
def inv(graph: Graph, a: object) -> Any:
    """Return the inverse of a matrix."""
    if holds_complex(a):
        return _solved_pairs(graph, a, np.eye(len(paired(graph, a))))
    n = len(traced(graph, a))
    return solved(graph, a, np.eye(n))


_of_squares = WRITTEN[np.linalg.matrix_power]


@of(np.linalg.matrix_power)
def _matrix_power(graph: Graph, a: object, n: Any) -> Any:
    """Return the power of a matrix; one below 0 is that of its inverse."""
    is_inverse = isinstance(n, int) and n < 0
    return _of_squares(graph, inv(graph, a), -n) if is_inverse else _of_squares(graph, a, n)


@of(np.linalg.det)
@_of_each
def det(graph: Graph, a: object) -> Any:
    """Return the determinant of a matrix: the product of the pivots, each exchange a minus."""
    rows = _square(graph, a)
    if len(rows) > _SMALL:
        return scalar(graph, determinant(graph, _factors(graph, rows)))
    return _determinant(graph, rows)


@of(np.linalg.slogdet)
def slogdet(graph: Graph, a: object) -> Any:
    """Return the sign of a determinant and the logarithm of its size."""
    rows, np_ = _square(graph, a), Facade(graph)
    if len(rows) > _SMALL:
        raise Untraceable("slogdet of a large matrix")
    _, pivots = eliminated(np_, [list(row) for row in rows], exchanges := [])
    sign = functools.reduce(lambda a, b: a * b, map(np_.sign, pivots))
    for exchanged in exchanges:
        sign = np_.where(exchanged, -sign, sign)
    size = functools.reduce(lambda a, b: a + b, [np_.log(np_.abs(v)) for v in pivots])
    more, singular = _skipped(graph, rows), _any_is_zero(np_, pivots)
    parts = np_.where(singular, 0.0, sign + more), np_.where(singular, -np.inf, size + more)
    return type(np.linalg.slogdet(np.eye(1)))(*parts)


def _determinant(graph: Graph, rows: _Rows) -> Any:
    np_ = Facade(graph)
    _, pivots = eliminated(np_, [list(row) for row in rows], exchanges := [])
    products = list(itertools.accumulate(pivots, lambda a, b: a * b))
    singular, product = _any_is_zero(np_, pivots), products[-1]
    for part in products[:-1] if len(pivots) > 2 else ():  # NumPy adds logarithms instead
        inside = np_.logical_and(np_.abs(part) < np.inf, part != 0.0)
        graph.guards.append(np_.logical_or(inside, singular).only)
    for exchanged in exchanges:
        product = np_.where(exchanged, -product, product)
    return np_.where(singular, 0.0, product + _skipped(graph, rows))


def _any_is_zero(np_: Facade, pivots: Sequence[Any]) -> Any:
    any_is_zero = np_.equal(pivots[0], 0.0)
    for pivot in pivots[1:]:
        any_is_zero = np_.logical_or(any_is_zero, np_.equal(pivot, 0.0))
    return any_is_zero


class NotComputed(Special):
    """What a function returns besides, of which nothing can be asked."""

    __array_ufunc__ = None

    def __init__(self, what: str) -> None:
        self.__dict__["what"] = what

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> Any:
        """Refuse it."""
        raise Untraceable(self.__dict__["what"])

    def _asked(self, *_: Any) -> Any:
        raise Untraceable(self.__dict__["what"])

    __getattr__ = __bool__ = __eq__ = __hash__ = __len__ = __iter__ = __getitem__ = _asked
    __add__ = __sub__ = __mul__ = __matmul__ = __truediv__ = __neg__ = _asked
    __radd__ = __rsub__ = __rmul__ = __rmatmul__ = __rtruediv__ = _asked


_REST = "rank, residuals or singular values of a matrix that the state decides"


@of(np.linalg.lstsq)
def lstsq(graph: Graph, a: object, b: object, rcond: Any = None) -> tuple[Any, ...]:
    """Return the least squares solution; of a matrix that is constant the rest, too."""
    matrix = constant_value(traced(graph, a))
    if not isinstance(matrix, np.ndarray):
        rcond = np.finfo(float).eps * max(matrix.shape) if rcond is None else rcond
        inverse = WRITTEN[np.linalg.pinv](graph, matrix, rcond)
        return _all_or_none(graph, inverse, traced(graph, b)), *[NotComputed(_REST)] * 3
    b = traced(graph, b)
    solution = _all_or_none(graph, traced(graph, np.linalg.pinv(matrix)), b)
    singular = np.linalg.svd(matrix, compute_uv=False)
    rank = int(np.linalg.matrix_rank(matrix))
    rest = traced(graph, np.zeros(0))
    if rank == matrix.shape[1] < matrix.shape[0]:
        apart = elementwise(graph, "sub", b, product(traced(graph, matrix), solution))
        rest = total(elementwise(graph, "mul", apart, apart), 0)
        rest = rest if rest.shape else rest.reshape(1)
    return solution, rest, rank, traced(graph, singular)


def _all_or_none(graph: Graph, inverse: Tracer, b: Tracer) -> Tracer:
    """Return the product with an inverse; it is NaN where LAPACK is given what is not finite."""
    spread = total(elementwise(graph, "mul", b, 0.0), 0)
    return product(inverse, elementwise(graph, "sub", b, spread))


class _Factors(NotComputed):
    """The factors of a matrix, of which nothing but a solution can be asked."""

    def __init__(self, matrix: Tracer) -> None:
        super().__init__("elements of the factors of a matrix that the state decides")
        self.__dict__["matrix"] = matrix


def lu_factor(
    graph: Graph, a: object, overwrite_a: bool = False, check_finite: bool = True
) -> tuple[Any, Any]:
    """Return what `of_triangles` takes, as SciPy's `scipy.linalg.lu_factor`."""
    factored = _Factors(traced(graph, a).copy())
    return factored, factored


@of(np.linalg.cholesky)
def cholesky(graph: Graph, a: object) -> Tracer:
    """Return the lower factor of a positive definite matrix."""
    rows, np_ = _square(graph, a), Facade(graph)
    n = len(rows)
    lower: _Rows = [[0.0] * n for _ in range(n)]
    for j in range(n):
        rest = rows[j][j]
        for k in range(j):
            rest = rest - lower[j][k] * lower[j][k]
        guard = elementwise(graph, "gt", rest, 0.0).only
        if guard.op != "const":
            graph.guard(guard, np.linalg.LinAlgError)
        lower[j][j] = np_.sqrt(rest)
        for i in range(j + 1, n):
            rest = rows[i][j]
            for k in range(j):
                rest = rest - lower[i][k] * lower[j][k]
            lower[i][j] = rest / lower[j][j]
    return traced(graph, lower)
