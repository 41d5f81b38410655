"""Linear equations of the stiff method: a / h - J, factorised where it is not always 0.

Which entries of J are 0 for all values is known from the expressions (`expressions.dependence`).
An `Elimination` is an order of the pivots, all on the diagonal, that creates few further entries:
in an adaptive controller the weights of the network first, each of which meets a few signals only.
Where a pivot turns out to be small beside the entries below it, the matrix is factorised as a
whole, with partial pivoting.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from ..state import DIRECTIONS, INNER

LEAST_PIVOT = (
    1e-3  # pivot, of the entries below it; as in KLU (Davis and Natarajan, TOMS 907, 2010)
)
SPARSE = 0.3  # of all entries; with more of them loops over all are faster


@dataclass(frozen=True, kw_only=True)
class Elimination:
    """An order of pivots, and where the factors have entries.

    Attributes
    ----------
    order : ndarray of int
        The diagonal entries, as they are eliminated; empty for elimination of whole columns.
    below, right : ndarray of int
        Rows and columns in which pivots have entries to be eliminated, one pivot after the other.
    below_start, right_start : ndarray of int
        Where those of each pivot begin; one more, for the end.
    source : ndarray of int
        Where entries come from (`jacobian_place`).  They are kept one pivot after the other: it,
        those below it, those on its right.
    target : ndarray of int
        Where among them eliminations subtract: for each pivot, for each on its right, below it.
    """

    order: np.ndarray
    below: np.ndarray
    below_start: np.ndarray
    right: np.ndarray
    right_start: np.ndarray
    source: np.ndarray
    target: np.ndarray


_NONE = np.zeros(0, dtype=np.int64)
WHOLE = Elimination(
    order=_NONE, below=_NONE, below_start=_NONE, right=_NONE, right_start=_NONE, source=_NONE,
    target=_NONE,
)  # fmt: skip


def elimination(structure: np.ndarray) -> Elimination:
    """Order pivots after Markowitz: the next is the one that can create the fewest entries.

    Parameters
    ----------
    structure : ndarray of bool, shape (n, n)
        Where a matrix may have entries; the diagonal is taken to be full.

    Returns
    -------
    Elimination
        `WHOLE` if the factors have entries in more than `SPARSE` of all places.
    """
    n = len(structure)
    here = structure | np.eye(n, dtype=bool)
    waiting, order, below, right = np.ones(n, dtype=bool), [], [], []
    for _ in range(n):
        rows, columns = here[:, waiting].sum(axis=1) - 1, here[waiting].sum(axis=0) - 1
        p = int(np.argmin(np.where(waiting, rows * columns, n * n)))
        waiting[p] = False
        under, beside = np.flatnonzero(here[:, p] & waiting), np.flatnonzero(here[p] & waiting)
        here[under[:, None], beside] = True
        order.append(p)
        below.append(under)
        right.append(beside)
    if sum(map(len, below)) + sum(map(len, right)) + n > SPARSE * n * n:
        return WHOLE
    return _placed(order, below, right)


def cost(n: int, order: Elimination) -> float:
    """Return what a step of the stiff method for n states takes, in steps of the explicit one.

    Measured: 3 for what does not depend on n, the Jacobian matrix, and one step for 2000
    multiplications in factorising and in nine solutions.
    """
    entries, eliminations = order.source.size, order.target.size
    if not order.order.size:
        entries, eliminations = n * n, n**3 // 3
    return 3.0 + 0.12 * n + (eliminations + 9 * entries) / 2000.0


def _placed(order: list[int], below: list[np.ndarray], right: list[np.ndarray]) -> Elimination:
    """Give all entries their places."""
    n, place = len(order), {}
    for p, under, beside in zip(order, below, right, strict=True):
        for entry in [(p, p), *((int(i), p) for i in under), *((p, int(j)) for j in beside)]:
            place[entry] = len(place)
    target = [
        place[int(i), int(j)]
        for under, beside in zip(below, right, strict=True) for j in beside for i in under
    ]  # fmt: skip
    return Elimination(
        order=np.array(order, dtype=np.int64),
        below=np.concatenate([_NONE, *below]), below_start=_starts(below),
        right=np.concatenate([_NONE, *right]), right_start=_starts(right),
        source=np.array([jacobian_place(i, j, n) for i, j in place], dtype=np.int64),
        target=np.array(target, dtype=np.int64),
    )  # fmt: skip


def jacobian_place(i: int, j: int, n: int) -> int:
    """Return where the entry of row i and column j of n states is kept, time in column n.

    Columns are kept as they are made: `DIRECTIONS` of them together, row by row.
    """
    return (j // DIRECTIONS * n + i) * DIRECTIONS + j % DIRECTIONS


def _starts(parts: list[np.ndarray]) -> np.ndarray:
    return np.cumsum([0, *map(len, parts)], dtype=np.int64)


place = numba.njit(**INNER)(jacobian_place)


@numba.njit(**INNER)
def factorise(task, diagonal, w):
    """Factorise diagonal * I - J; return whether only where there are entries."""
    if task.order.size and _factorise_entries(task, diagonal, w.jacobian_flat, w.factors):
        return True
    n, columns = w.columns.shape[0], w.columns
    for j in range(n):
        for i in range(n):
            columns[j, i] = -w.jacobian_flat[place(i, j, n)]
        columns[j, j] += diagonal
    _factorise_all(columns, w.pivots)
    return False


@numba.njit(**INNER)
def solve(task, only_entries, w, b):
    """Solve with the factors of `factorise`; `b` becomes the solution."""
    if only_entries:
        _solve_entries(task, w.factors, b)
    else:
        _solve_all(w.columns, w.pivots, b)


@numba.njit(**INNER)
def _factorise_entries(task, diagonal, jacobian, factors):
    """Factorise with the pivots of an `Elimination`; return whether all are large enough.

    Of pivots their inverses are kept.
    """
    order, below, right, done = task.order, task.below_start, task.right_start, 0
    source, target = task.source, task.target
    for e in range(source.size):
        factors[e] = -jacobian[source[e]]
    for k in range(order.size):
        factors[k + below[k] + right[k]] += diagonal
    for k in range(order.size):
        pivot, largest = k + below[k] + right[k], 0.0
        first, middle = pivot + 1, pivot + 1 + below[k + 1] - below[k]
        last = middle + right[k + 1] - right[k]
        for a in range(first, middle):
            largest = max(largest, abs(factors[a]))
        if not (abs(factors[pivot]) > LEAST_PIVOT * largest):  # NaN is not
            return False
        inverse = 1.0 / factors[pivot]
        factors[pivot] = inverse
        for a in range(first, middle):
            factors[a] *= inverse
        for b in range(middle, last):
            for a in range(first, middle):
                factors[target[done]] -= factors[a] * factors[b]
                done += 1
    return True


@numba.njit(**INNER)
def _solve_entries(task, factors, b):
    """Solve with the factors of `_factorise_entries`."""
    order, below, right = task.order, task.below_start, task.right_start
    rows, columns = task.below, task.right
    for k in range(order.size):
        factor, at = b[order[k]], k + right[k] + 1
        for a in range(below[k], below[k + 1]):
            b[rows[a]] -= factors[at + a] * factor
    for k in range(order.size - 1, -1, -1):
        total, at = b[order[k]], k + below[k + 1] + 1
        for a in range(right[k], right[k + 1]):
            total -= factors[at + a] * b[columns[a]]
        b[order[k]] = total * factors[k + below[k] + right[k]]


@numba.njit(**INNER)
def _factorise_all(columns, pivots):
    """Factorise a square matrix in place, P M = L U, with partial pivoting.

    Row `c` of `columns` is the matrix's column `c`: every inner loop then runs through memory and
    adds nothing up, so that SIMD registers are full and no order of additions is left to a
    compiler.
    """
    n = columns.shape[0]
    for c in range(n):
        best = c
        for i in range(c + 1, n):
            if abs(columns[c, i]) > abs(columns[c, best]):
                best = i
        pivots[c] = best
        if best != c:
            for j in range(n):
                columns[j, c], columns[j, best] = columns[j, best], columns[j, c]
        inverse = 1.0 / columns[c, c]
        for i in range(c + 1, n):
            columns[c, i] *= inverse
        for j in range(c + 1, n):
            factor = columns[j, c]
            if factor != 0.0:
                for i in range(c + 1, n):
                    columns[j, i] -= columns[c, i] * factor


@numba.njit(**INNER)
def _solve_all(columns, pivots, b):
    """Solve with the factors of `_factorise_all`; `b` becomes the solution."""
    n = b.size
    for i in range(n):
        other = pivots[i]
        b[i], b[other] = b[other], b[i]
    for c in range(n):
        factor = b[c]
        for i in range(c + 1, n):
            b[i] -= columns[c, i] * factor
    for c in range(n - 1, -1, -1):
        factor = b[c] / columns[c, c]
        b[c] = factor
        for i in range(c):
            b[i] -= columns[c, i] * factor
