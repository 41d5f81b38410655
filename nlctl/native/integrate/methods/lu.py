"""Linear equations of the stiff method: a / h - J, factorised where it is not always 0.

Which entries of J are 0 for all values is known from the expressions (`expressions.dependence`).
An `Elimination` is an order of the pivots, all on the diagonal, that creates few further entries:
in an adaptive controller the weights of the network first, each of which meets a few signals only.
Where a pivot turns out to be small beside the entries below it, the matrix is factorised as a
whole, with partial pivoting.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from ..memory import Places2, Unsigned1, arrays_alike, with_table
from ..state import DIRECTIONS, INNER

# pivot, of the entries below it; as in KLU (Davis and Natarajan, TOMS 907, 2010)
LEAST_PIVOT = 1e-3
SPARSE = 0.3  # of all entries; with more of them loops over all are faster


class Elimination(NamedTuple):
    """An order of pivots, and where the factors have entries.

    The entries are kept row by row in the order of the pivots: those on the left of the pivot,
    it, those on its right.
    """

    order: Unsigned1  # the diagonal entries, as they are eliminated; none: by whole columns
    rank: Unsigned1  # when each of them is eliminated
    start: Unsigned1  # where the entries of each pivot's row begin; one more, for the end
    pivot: Unsigned1  # where each pivot is among them
    column: Unsigned1  # of each entry; in a row those on the left in the order of the pivots
    source: Unsigned1  # where entries come from (`jacobian_place`)
    # where among them eliminations subtract: for each row, for each entry on the left, for each on
    # the right in the row of its column's pivot
    target: Unsigned1
    table: Places2


INDEX = np.uint64  # without a sign: numba asks of the others whether they count from the end
ONE = INDEX(1)
WHOLE = arrays_alike(Elimination, (0,))


def elimination(structure: np.ndarray) -> Elimination:
    """Order pivots after Markowitz: the next is the one that can create the fewest entries."""
    # Shapes: `structure` (n, n).
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
    """Return what a step of the stiff method for n states takes, in steps of the explicit one."""
    # Measured, of eight diagrams within a factor of 2: 2 for what does not depend on n, the
    # Jacobian matrix, and one step for 1500 multiplications in factorising and in nine solutions,
    # or for 6000 where whole columns fill SIMD registers.
    if order.order.size:
        return 2.0 + 0.06 * n + (order.target.size + 9 * order.source.size) / 1500.0
    return 2.0 + 0.06 * n + (n**3 / 3 + 9 * n * n) / 6000.0


def _placed(order: list[int], below: list[np.ndarray], right: list[np.ndarray]) -> Elimination:
    """Give all entries their places."""
    n, rank = len(order), np.argsort(order)
    left: list[list[int]] = [[] for _ in order]  # of each row, in the order of the pivots
    for p, under in zip(order, below, strict=True):
        for i in under:
            left[rank[i]].append(p)
    rows = [[*one, p, *map(int, more)] for one, p, more in zip(left, order, right, strict=True)]
    place = {
        entry: k
        for k, entry in enumerate((p, j) for p, row in zip(order, rows, strict=True) for j in row)
    }
    target = [
        place[p, int(j)]
        for p, one in zip(order, left, strict=True) for q in one for j in right[rank[q]]
    ]  # fmt: skip
    start = np.cumsum([0, *map(len, rows)], dtype=INDEX)
    return with_table(
        Elimination,
        order=np.array(order, dtype=INDEX),
        rank=rank.astype(INDEX),
        start=start,
        pivot=start[:-1] + np.array([len(one) for one in left], dtype=INDEX),
        column=np.array([j for _, j in place], dtype=INDEX),
        source=np.array([jacobian_place(i, j, n) for i, j in place], dtype=INDEX),
        target=np.array(target, dtype=INDEX),
    )


def jacobian_place(i: int, j: int, n: int) -> int:
    """Return where the entry of row i and column j of n states is kept, time in column n."""
    # Columns are kept as they are made: `DIRECTIONS` of them together, row by row.
    return (j // DIRECTIONS * n + i) * DIRECTIONS + j % DIRECTIONS


place = numba.njit(**INNER)(jacobian_place)


@numba.njit(**INNER)
def factorise(method, diagonal, work):
    """Factorise diagonal * I - J; return whether only where there are entries."""
    if method.order.size and _factorise_entries(method, diagonal, work.jacobian_flat, work.factors):
        return True
    n, columns = work.columns.shape[0], work.columns
    for j in range(n):
        for i in range(n):
            columns[j, i] = -work.jacobian_flat[place(i, j, n)]
        columns[j, j] += diagonal
    _factorise_all(columns, work.pivots)
    return False


@numba.njit(**INNER)
def solve(method, only_entries, work, b):
    """Solve with the factors of `factorise`; `b` becomes the solution."""
    if only_entries:
        _solve_entries(method, work.factors, b)
    else:
        _solve_all(work.columns, work.pivots, b)


@numba.njit(**INNER)
def _factorise_entries(method, diagonal, jacobian, factors):
    """Factorise with the pivots of an `Elimination`; return whether all are large enough."""
    # Row by row: what is subtracted is on the right of pivots that are done. Of these their
    # inverses are kept.
    start, pivot, column, rank = method.start, method.pivot, method.column, method.rank
    source, target, done = method.source, method.target, INDEX(0)
    for e in range(source.size):
        factors[e] = -jacobian[source[e]]
    for k in range(pivot.size):
        factors[pivot[k]] += diagonal
        for e in range(start[k], pivot[k]):
            q = rank[column[e]]
            factor = factors[e] * factors[pivot[q]]
            if not LEAST_PIVOT * abs(factor) < 1.0:  # NaN is not
                return False
            factors[e] = factor
            for other in range(pivot[q] + ONE, start[q + ONE]):
                factors[target[done]] -= factor * factors[other]
                done += ONE
        if not abs(factors[pivot[k]]) > 0.0:
            return False
        factors[pivot[k]] = 1.0 / factors[pivot[k]]
    return True


@numba.njit(**INNER)
def _solve_entries(method, factors, b):
    """Solve with the factors of `_factorise_entries`, both times by sums over rows."""
    order, start, pivot, column = method.order, method.start, method.pivot, method.column
    for k in range(order.size):
        total = b[order[k]]
        for e in range(start[k], pivot[k]):
            total -= factors[e] * b[column[e]]
        b[order[k]] = total
    for k in range(order.size - 1, -1, -1):
        total = b[order[k]]
        for e in range(pivot[k] + ONE, start[k + 1]):
            total -= factors[e] * b[column[e]]
        b[order[k]] = total * factors[pivot[k]]


@numba.njit(**INNER)
def multiply(method, jacobian, v, product):
    """Fill `product` with J v."""
    n, source, column = v.size, method.source, method.column
    for i in range(n):
        product[i] = 0.0
        for j in range(0 if method.order.size else n):
            product[i] += jacobian[place(i, j, n)] * v[j]
    for k in range(method.order.size):
        # also where only factors have entries
        for e in range(method.start[k], method.start[k + 1]):
            product[method.order[k]] += jacobian[source[e]] * v[column[e]]


@numba.njit(**INNER)
def _factorise_all(columns, pivots):
    """Factorise a square matrix in place, P M = L U, with partial pivoting."""
    # Row `c` of `columns` is the matrix's column `c`: every inner loop then runs through memory and
    # adds nothing up, so that SIMD registers are full and no order of additions is left to a
    # compiler.
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
