"""Sets of states that are carried on by a map with two derivatives.

A set is {c + P(s) + B r}: polynomials of the numbers s where everything has begun, each between -1
and 1, and errors r in orthogonal directions.  With m the middle of c and d = x - m,

    x(h) = m(h) + J d + H (d, d) / 2,   J = Dx(h) at m,   H = D^2 x(h) somewhere in the set,

so that P becomes J P + H (P, P) / 2, up to its degree.  All that this leaves out, and what floats
round, is in the errors: K (B r + error) with K = J + H d, in directions that K B has (R. Lohner,
1987).
"""

from __future__ import annotations

import math

import numba
import numpy as np

from ..machine.export import AS_SHIPPED
from .intervals import add_image, add_product, down, matrix_product, up, write_into

_ROUNDED = 1e-13  # of all terms of a sum of less than 800
_UP = 1.0 + 1e-12  # what sums of sizes may be rounded by


@numba.njit(**AS_SHIPPED)
def box_of_set(c, P, even, B, r, box):
    """Write the box around a set."""
    write_into(box, c)
    for i in range(P.shape[0]):
        low, high = 0.0, 0.0
        for a in range(P.shape[1]):
            low -= max(-P[i, a], 0.0) if even[a] else abs(P[i, a])
            high += max(P[i, a], 0.0) if even[a] else abs(P[i, a])
        box[i, 0], box[i, 1] = down(box[i, 0] + low * _UP), up(box[i, 1] + high * _UP)
    add_image(B, r, box)


@numba.njit(**AS_SHIPPED)
def sizes(P, degrees, by_degree, whole):
    """Write the sums of the coefficients' sizes, of each degree and of all."""
    by_degree.fill(0.0)
    for i in range(P.shape[0]):
        for a in range(P.shape[1]):
            by_degree[i, degrees[a]] += abs(P[i, a]) * _UP
        whole[i] = by_degree[i].sum() * _UP


@numba.njit(**AS_SHIPPED)
def next_polynomials(J, H, P, table, error):
    """Carry polynomials on, in place, and add what that leaves out to errors."""
    # Shapes: `J` (n, n, 2), `H` (n, n, n, 2), `P` (n, monomials), `error` (n, 2).
    n, degree = P.shape[0], table.degrees[-1]  # the last one has the highest
    by_degree, whole = np.zeros((n, degree + 1)), np.zeros(n)
    sizes(P, table.degrees, by_degree, whole)
    carried, left = np.zeros_like(P), np.zeros(n)
    for k in range(n):
        for i in range(n):
            middle = 0.5 * J[k, i, 0] + 0.5 * J[k, i, 1]
            around = max(up(J[k, i, 1] - middle), up(middle - J[k, i, 0]))
            left[k] += whole[i] * (around + _ROUNDED * abs(middle))
            for a in range(P.shape[1]):
                carried[k, a] += middle * P[i, a]
    square = np.empty(P.shape[1])
    for i in range(n):
        for j in range(i + 1):
            beyond = polynomial_product(
                P[i], P[j], table.products, by_degree[i], by_degree[j], square
            )
            all_of_it, part = whole[i] * whole[j], 0.5 if i == j else 1.0
            for k in range(n):
                middle = part * (0.5 * H[k, i, j, 0] + 0.5 * H[k, i, j, 1])
                high, low = up(part * H[k, i, j, 1] - middle), up(middle - part * H[k, i, j, 0])
                left[k] += all_of_it * (max(high, low) + _ROUNDED * abs(middle))
                left[k] += beyond * abs(middle)
                for a in range(P.shape[1]):
                    carried[k, a] += middle * square[a]
    write_into(P, carried)
    for k in range(n):
        around = left[k] * _UP + 1e-300
        error[k, 0], error[k, 1] = down(error[k, 0] - around), up(error[k, 1] + around)


@numba.njit(**AS_SHIPPED)
def polynomial_product(p, q, products, p_sizes, q_sizes, product):
    """Multiply polynomials, and return how large the product is beyond their degree at most."""
    product.fill(0.0)
    for f in range(products.shape[0]):
        product[products[f, 2]] += p[products[f, 0]] * q[products[f, 1]]
    beyond, degree = 0.0, p_sizes.size - 1
    for a in range(1, degree + 1):
        for b in range(degree + 1 - a, degree + 1):
            beyond += p_sizes[a] * q_sizes[b]
    return beyond * _UP


@numba.njit(**AS_SHIPPED)
def slopes_within(J, H, box, middle, K):
    """Write J + H d for all d between the middle and a box."""
    # With d = p + e, H (d, d) / 2 is H (p, p) / 2 and H (p + e / 2) e, and p + e / 2 is one of
    # them.
    n = middle.size
    for k in range(n):
        for i in range(n):
            K[k, i, 0], K[k, i, 1] = J[k, i, 0], J[k, i, 1]
            for j in range(n):
                first, last = down(box[j, 0] - middle[j]), up(box[j, 1] - middle[j])
                add_product(K[k, i], H[k, i, j, 0], H[k, i, j, 1], first, last)


@numba.njit(**AS_SHIPPED)
def next_errors(K, error, at, c, B, r):
    """Move errors, in place: those of `r`, with `error` added; `c` becomes what is around `at`."""
    # Shapes: `K, B` (n, n, 2), `error, c, r` (n, 2), `at` (n,).
    n = at.size
    KB, rotated = np.empty_like(B), np.empty_like(B)
    matrix_product(K, B, KB)
    columns = np.empty((n, n))
    for j in range(n):
        for i in range(n):
            columns[i, j] = (0.5 * KB[i, j, 0] + 0.5 * KB[i, j, 1]) * (r[j, 1] - r[j, 0])
    orthogonal(columns, B)
    transposed = transpose(B)
    matrix_product(transposed, KB, rotated)
    whole, errors = error.copy(), np.zeros((n, 2))
    add_image(KB, r, whole)
    add_image(rotated, r, errors)
    add_image(transposed, error, errors)
    for i in range(n):  # 0 stays among them, so that m + P(s) is in the set
        r[i, 0], r[i, 1] = min(errors[i, 0], 0.0), max(errors[i, 1], 0.0)
        if not errors[i, 0] <= errors[i, 1]:
            r[i, 0] = r[i, 1] = math.nan
    for i in range(n):
        c[i, 0] = c[i, 1] = at[i]
    add_left_out(B, transposed, whole, c)


@numba.njit(**AS_SHIPPED)
def transpose(x):
    """Return the transpose of a matrix of intervals, of shape (n, n, 2)."""
    y = np.empty_like(x)
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            for end in range(2):
                y[j, i, end] = x[i, j, end]
    return y


@numba.njit(**AS_SHIPPED)
def add_left_out(B, transposed, x, c):
    """Add x - B B^T x, which is 0 but for rounding, to c."""
    n = x.shape[0]
    errors = np.empty_like(B)
    matrix_product(B, transposed, errors)
    for i in range(n):
        for j in range(n):
            low, high, one = errors[i, j, 0], errors[i, j, 1], 1.0 if i == j else 0.0
            errors[i, j, 0], errors[i, j, 1] = down(one - high), up(one - low)
    add_image(errors, x, c)


@numba.njit(**AS_SHIPPED)
def renewed(c, P, even, B, r, most):
    """Begin with new numbers s where errors have become larger than a part of the polynomials."""
    # Return whether. What was there lies in a box along orthogonal directions, with a number for
    # each of them.
    n = r.shape[0]
    errors, numbers = 0.0, 0.0
    for k in range(n):
        for j in range(n):
            errors += abs(B[k, j, 0]) * (r[j, 1] - r[j, 0]) * 0.5
        numbers += np.abs(P[k]).sum()
    if not errors > most * numbers or errors == 0.0:
        return False
    columns, Q, rotated = np.empty((n, 2 * n)), np.empty_like(B), np.empty_like(B)
    for j in range(n):
        for i in range(n):
            columns[i, j] = P[i, j]
            columns[i, n + j] = B[i, j, 0] * (r[j, 1] - r[j, 0]) * 0.5
    orthogonal(columns, Q)
    transposed = transpose(Q)
    matrix_product(transposed, B, rotated)
    box, whole = np.zeros((n, 2)), np.empty((n, 2))
    box_of_set(np.zeros((n, 2)), P, even, B, r, whole)
    box_of_set(box, in_directions(Q, P), even, rotated, r, box)
    for i in range(n):
        rounded = 0.0
        for k in range(n):
            rounded += abs(Q[k, i, 0]) * np.abs(P[k]).sum()
        box[i, 0] = down(box[i, 0] - _ROUNDED * rounded)
        box[i, 1] = up(box[i, 1] + _ROUNDED * rounded)
    add_left_out(Q, transposed, whole, c)
    P.fill(0.0)
    for i in range(n):
        middle = 0.5 * box[i, 0] + 0.5 * box[i, 1]
        half = max(up(box[i, 1] - middle), up(middle - box[i, 0]))
        for k in range(n):
            P[k, i] = Q[k, i, 0] * half
            around = _ROUNDED * abs(P[k, i]) + 1e-300
            add_product(c[k], Q[k, i, 0], Q[k, i, 1], middle, middle)
            c[k, 0], c[k, 1] = down(c[k, 0] - around), up(c[k, 1] + around)
    write_into(B, Q)
    r.fill(0.0)
    return True


@numba.njit(**AS_SHIPPED)
def in_directions(Q, P):
    """Return polynomials along orthogonal directions, without what is rounded."""
    parts = np.zeros(P.shape)
    for i in range(P.shape[0]):
        for k in range(P.shape[0]):
            for a in range(P.shape[1]):
                parts[i, a] += Q[k, i, 0] * P[k, a]
    return parts


@numba.njit(**AS_SHIPPED)
def orthogonal(columns, B):
    """Write orthogonal directions of columns, a matrix (n, m), those that matter most first."""
    n = columns.shape[0]
    rest, taken = columns.copy(), np.zeros(columns.shape[1])
    unit, v = 0, np.empty(n)
    scale = 0.0
    for place in range(n):
        best, largest = -1, 0.0
        for j in range(columns.shape[1]):
            size = 0.0
            for i in range(n):
                size += rest[i, j] * rest[i, j]
            if taken[j] == 0.0 and size > largest:
                best, largest = j, size
        scale = max(scale, math.sqrt(largest))
        left = 0.0
        if best >= 0:
            taken[best] = 1.0
            for i in range(n):
                v[i] = columns[i, best]
            left = _without(v, B, place)
        while not left > 1e-12 * scale and unit < n:  # a direction that nothing has yet
            v.fill(0.0)
            v[unit], unit = 1.0, unit + 1
            left = _without(v, B, place)
            left = left if left > 0.5 / math.sqrt(n) else 0.0
        for i in range(n):
            B[i, place, 0] = B[i, place, 1] = v[i] / left if left > 0.0 else 0.0
        for j in range(columns.shape[1]):
            part = 0.0
            for i in range(n):
                part += rest[i, j] * B[i, place, 0]
            for i in range(n):
                rest[i, j] -= part * B[i, place, 0]


@numba.njit(**AS_SHIPPED)
def _without(v, B, count):
    """Take away what a vector has of the first columns, and return its length."""
    for _ in range(2):
        for j in range(count):
            total = 0.0
            for i in range(v.size):
                total += v[i] * B[i, j, 0]
            for i in range(v.size):
                v[i] -= total * B[i, j, 0]
    total = 0.0
    for i in range(v.size):
        total += v[i] * v[i]
    return math.sqrt(total)
