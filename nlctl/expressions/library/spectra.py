"""Eigenvalues, singular values and pseudoinverses of small matrices."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Tracer, traced
from ..constants import constant_value
from ..graph import Graph, Untraceable
from .complex_numbers import ComplexPair
from .linear_algebra import NotComputed
from .orthogonal import pseudoinverse, qr
from .reductions import sum_along
from .rotated import in_passes, singular_by_rotations, symmetric_by_rotations
from .table import Facade, of

__all__: list[str] = []


def _matrix(graph: Graph, a: object) -> Any:
    array = traced(graph, a)
    if array.ndim != 2:
        raise Untraceable("many matrices at once")
    return array.short()


def guard_finite(graph: Graph, numbers: object, error: type[Exception]) -> None:
    """Note that an error is raised where not all of the numbers are finite."""
    if isinstance(numbers, list | Tracer):
        whole = Facade(graph).all(Facade(graph).isfinite(traced(graph, numbers)))
        graph.guard(traced(graph, whole).only, error)


@of(np.linalg.eigvals)
def eigvals(graph: Graph, a: object) -> Any:
    """Return the eigenvalues of a matrix of two rows, in the order that LAPACK has them."""
    matrix, np_ = _matrix(graph, a), Facade(graph)
    if isinstance(numbers := constant_value(matrix), np.ndarray):
        return np.linalg.eigvals(numbers)
    if matrix.shape != (2, 2):
        raise Untraceable("eigenvalues of a matrix of more than two rows")
    guard_finite(graph, matrix, np.linalg.LinAlgError)
    (p, q), (r, s) = matrix
    half = 0.5 * (p - s)
    square = half * half + q * r
    root = np_.sqrt(np_.abs(square))
    first = np_.copysign(root, half) + half  # the larger one in size: nothing cancels
    far = s + first
    near = s - np_.where(first == 0.0, 0.0, q * r / np_.where(first == 0.0, 1.0, first))
    far, near = np_.where(q == 0.0, s, far), np_.where(q == 0.0, p, near)  # of a triangle: its own
    far, near = np_.where(r == 0.0, p, far), np_.where(r == 0.0, s, near)
    is_real = np_.logical_or(square >= 0.0, q * r == 0.0)
    imag = np_.where(is_real, 0.0, root)
    middle = s + half
    real = [np_.where(is_real, far, middle), np_.where(is_real, near, middle)]
    return ComplexPair(graph, traced(graph, real), traced(graph, [imag, -imag]))


of(np.linalg.qr)(qr)
_ROUNDING, _SMALLEST = np.finfo(float).eps / 2, np.finfo(float).tiny
_WITHOUT_SIGN = "singular vectors, or eigenvectors, whose signs are a question of the machine"


@of(np.linalg.svd)
def svd(
    graph: Graph, a: object, full_matrices: bool = True, compute_uv: bool = True,
    hermitian: bool = False,
) -> Any:  # fmt: skip
    """Return the singular values of a matrix, the largest one first."""
    values = _singular(graph, _matrix(graph, a))
    if not compute_uv:
        return values
    vectors = NotComputed(_WITHOUT_SIGN)
    triple: Any = type(np.linalg.svd(np.eye(1)))
    return triple(vectors, values, vectors)


def _singular(graph: Graph, matrix: Tracer) -> Tracer:
    guard_finite(graph, matrix, np.linalg.LinAlgError)
    if matrix.shape != (2, 2):
        return singular_by_rotations(graph, matrix)
    ((p, q), (r, s)), np_ = matrix, Facade(graph)
    largest = np_.hypot(p + s, r - q) * 0.5 + np_.hypot(p - s, r + q) * 0.5
    size = np_.where(largest == 0.0, 1.0, largest)
    return traced(graph, [largest, np_.abs(p / size * s - q / size * r)])


@of(np.linalg.cond)
def cond(graph: Graph, x: object, p: Any = None) -> Any:
    """Return the condition number of a matrix: the ratio of its singular values."""
    matrix, np_ = _matrix(graph, x), Facade(graph)
    if p not in (None, 2):
        raise Untraceable("the condition number of a matrix in another norm")
    values = _singular(graph, matrix)
    largest = values[0]
    if matrix.shape != (2, 2):
        return np_.where(largest == 0.0, np.inf, largest / values[-1])
    (a, b), (c, d) = matrix
    smallest = np_.abs(a * d - b * c) / largest
    return np_.where(largest == 0.0, np.inf, largest / smallest)


@of(np.linalg.matrix_rank)
def matrix_rank(graph: Graph, a: object, tol: object = None, **how: object) -> Any:
    """Return how many singular values are more than rounding."""
    matrix = _matrix(graph, a)
    if how:
        raise Untraceable("a rank with other arguments")
    values = _singular(graph, matrix)
    limit = values[0] * (max(matrix.shape) * np.finfo(float).eps) if tol is None else tol
    return sum_along(graph, Facade(graph).greater(values, limit))


@of(np.linalg.eigvalsh)
def eigvalsh(graph: Graph, a: object, UPLO: str = "L") -> Tracer:
    """Return the eigenvalues of a symmetric matrix; NumPy reads its lower half."""
    matrix, np_ = _matrix(graph, a), Facade(graph)
    matrix = matrix if UPLO == "L" else matrix.T
    lower = [matrix[i, j] for i in range(len(matrix)) for j in range(i + 1)]
    guard_finite(graph, lower, np.linalg.LinAlgError)
    if len(matrix) == 1:
        return matrix[0]
    if matrix.shape != (2, 2):
        return symmetric_by_rotations(graph, matrix)
    (p, _), (q, r) = matrix
    with in_passes(graph):
        middle, spread = (p + r) / 2.0, np_.hypot((p - r) / 2.0, q)
        is_left = middle < 0.0
        far = np_.where(is_left, middle - spread, middle + spread)  # nothing cancels
        size = np_.where(far == 0.0, 1.0, far)
        near = p / size * r - q / size * q
        ends = [np_.where(is_left, far, near), np_.where(is_left, near, far)]
    return traced(graph, ends)


@of(np.linalg.eigh)
def eigh(graph: Graph, a: object, UPLO: str = "L") -> Any:
    """Return the eigenvalues of a symmetric matrix, and of two rows the vectors, too."""
    values, matrix = eigvalsh(graph, a, UPLO), _matrix(graph, a)
    vectors: Any = NotComputed(_WITHOUT_SIGN)
    if matrix.shape == (2, 2) and _has_these_signs():
        vectors = traced(graph, _directions(Facade(graph), *_halves(matrix, UPLO)))
    pair: Any = type(np.linalg.eigh(np.eye(1)))
    return pair(values, vectors)


def _halves(matrix: Any, side: str) -> tuple[Any, Any, Any]:
    return matrix[0, 0], matrix[1, 0] if side == "L" else matrix[0, 1], matrix[1, 1]


def _directions(np_: Any, a: Any, b: Any, c: Any) -> list[list[Any]]:
    """Return the eigenvectors of [[a, b], [b, c]] as columns, with the signs of LAPACK's DLAEV2."""
    apart, twice = a - c, b + b
    root = np_.hypot(apart, twice)
    longer = np_.where(apart >= 0.0, apart + root, apart - root)
    steep = np_.abs(longer) > np_.abs(twice)
    ratio = np_.where(steep, -twice, -longer) / np_.where(
        steep, longer, np_.where(twice == 0.0, 1.0, twice)
    )
    size = np_.abs(a) + np_.abs(b) + np_.abs(c)
    scaled = (size > 1e146) | ((size < 1e-120) & (size > 0.0))  # by LAPACK, which rounds then
    one = np_.where(scaled, np.nan, 1.0 / np_.hypot(1.0, ratio))
    cosine, sine = np_.where(steep, ratio * one, one), np_.where(steep, one, ratio * one)
    alike = np_.equal(a + c >= 0.0, apart >= 0.0)
    cosine, sine = np_.where(alike, -sine, cosine), np_.where(alike, cosine, sine)
    apart_already = b * b <= _ROUNDING**2 * np_.abs(a) * np_.abs(c) + _SMALLEST
    cosine, sine = np_.where(apart_already, 1.0, cosine), np_.where(apart_already, 0.0, sine)
    swaps = np_.where(apart_already, c < a, a + c >= 0.0)
    return [[np_.where(swaps, -sine, cosine), np_.where(swaps, cosine, -sine)],
            [np_.where(swaps, cosine, sine), np_.where(swaps, sine, cosine)]]  # fmt: skip


@functools.cache
def _has_these_signs() -> bool:
    """Whether this machine's LAPACK gives eigenvectors these signs: others may have theirs."""
    cases = itertools.product((-2.0, 0.0, 1.0, 3.0), (-1.5, 0.0, 0.5), (-2.0, 0.0, 1.0, 5.0))
    return all(
        np.allclose(np.linalg.eigh([[a, 0.0], [b, c]])[1], _directions(np, a, b, c), rtol=1e-12)
        for a, b, c in cases
    )


@of(np.roots)
def roots_of_polynomial(graph: Graph, p: object) -> Any:
    """Return the roots of a polynomial up to the second degree, in the order of NumPy's."""
    numbers = traced(graph, p).short()
    if numbers.ndim != 1:
        raise Untraceable("np.roots of something else than a list")
    first = next((k for k, v in enumerate(numbers) if v.only.op != "const" or v.only.data), 0)
    c = list(numbers)[first:]
    for end in (c[0], c[-1]):  # of zeros at an end NumPy takes away as many as there are
        graph.limited(graph.op("ne", end.only, graph.const(0.0)))
    if len(c) == 2:
        return traced(graph, [-c[1] / c[0]])
    if len(c) != 3 or (c[-1].only.op == "const" and not c[-1].only.data):
        raise Untraceable("np.roots of a polynomial of more than two degrees")
    return eigvals(graph, [[-c[1] / c[0], -c[2] / c[0]], [1.0, 0.0]])


@of(np.linalg.pinv)
def pinv(graph: Graph, a: object, rcond: float = 1e-15) -> Any:
    """Return the pseudoinverse of a matrix; of more than two rows and columns, of full rank."""
    matrix = _matrix(graph, a)
    if isinstance(numbers := constant_value(matrix), np.ndarray):
        return traced(graph, np.linalg.pinv(numbers, rcond))
    guard_finite(graph, matrix, np.linalg.LinAlgError)
    wide = matrix.shape[0] < matrix.shape[1]
    columns = list(matrix if wide else matrix.T)
    if len(columns) > 2:
        return pseudoinverse(graph, matrix)
    np_ = Facade(graph)
    rows = _of_lines(np_, columns)
    if len(columns) == 2:
        rows = _of_two(np_, columns[0], columns[1], rows, rcond)
    result = traced(graph, rows)
    return result.T if wide else result


def _of_lines(np_: Facade, columns: Sequence[Any]) -> list[Any]:
    """Return the pseudoinverse of columns that are parallel."""
    square = sum(np_.sum(c * c) for c in columns)
    weight = np_.where(square == 0.0, 0.0, 1.0 / np_.where(square == 0.0, 1.0, square))
    return [c * weight for c in columns]


def _of_two(
    np_: Facade, a: Arithmetic, b: object, parallel: Sequence[Any], rcond: float
) -> list[Any]:
    """Return the pseudoinverse of two columns, by an orthogonal one for each."""
    size = np_.sqrt(np_.sum(a * a))
    first = a / np_.where(size == 0.0, 1.0, size)
    share = np_.sum(first * b)
    apart = b - share * first
    more = np_.sum(first * apart)  # what rounding has left
    share, apart = share + more, apart - more * first
    height = np_.sqrt(np_.sum(apart * apart))
    # of the singular values: their product, and the sum of their squares
    both, squares = size * height, size * size + share * share + height * height
    half = 0.5 * squares
    largest = half + np_.sqrt(np_.maximum(half * half - both * both, 0.0))
    regular = both > rcond * largest
    second = apart / np_.where(regular, height * height, 1.0)
    lines = [(first - share * second) / np_.where(regular, size, 1.0), second]
    return [np_.where(regular, one, other) for one, other in zip(lines, parallel, strict=True)]
