"""One array under several names while choices are made, and what may be None or a number."""

import numpy as np

from engineers.entry import engineered


def many(x):  # enough branches to be merged
    s = 0.0
    for k in range(9):
        s += 1.0 if x[1] > k else 0.5
    return s


@engineered(2)
def alias_aug(t, x, u, params):
    z = np.zeros(2)
    y = z
    s = many(x)
    for k in range(3):
        if x[0] > k:
            z += 1.0
    return y * s + 0 * x


@engineered(2)
def alias_aug_one(t, x, u, params):
    z = np.zeros(2)
    y = z
    s = many(x)
    if x[0] > 0:
        z += 1.0
    return y * s + 0 * x


@engineered(2)
def alias_list(t, x, u, params):
    z = np.zeros(2)
    l = [z]
    s = many(x)
    if x[0] > 0:
        z *= x[1]
        z -= 1.0
    return l[0] * s + 0 * x


@engineered(2)
def alias_break(t, x, u, params):
    z = np.zeros(2)
    y = z
    for _ in range(20):
        z += 0.1 * x
        if z[0] > 0.5:
            break
    return y


@engineered(2)
def alias_break_view(t, x, u, params):
    z = np.zeros(4)
    y = z[1:3]
    for _ in range(20):
        z += 0.1 * x[0]
        z[1] = x[1]
        if z[0] > 0.5:
            break
    return y


@engineered(2)
def alias_assign_break(t, x, u, params):
    z = np.zeros(2)
    keep = z
    for _ in range(20):
        keep = z
        z = z + 0.1 * x
        if z[0] > 0.5:
            break
    return keep + 2 * z


@engineered(2)
def alias_part_short(t, x, u, params):
    big = np.zeros(4)
    v = big[0:2]
    w = np.ones(2)
    s = many(x)
    y = v if x[0] > 0 else w
    big[0] = 5.0 + x[1]
    return y * s


@engineered(2)
def alias_row(t, x, u, params):
    M = np.zeros((2, 2))
    s = many(x)
    y = M[0] if x[0] > 0 else M[1]
    M[:, 0] += x
    return y * s


@engineered(2)
def alias_transposed(t, x, u, params):
    M = np.zeros((2, 2))
    s = many(x)
    y = M.T if x[0] > 0 else np.ones((2, 2))
    M[0, 1] = x[1]
    return (y @ x) * s


@engineered(2)
def none_masked_by_max(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = float(k)
    if hit is None and x[1] > 0:
        return [s, 1.0]
    if hit is None:
        hit = -1.0
    return [max(hit, 0.0) * s, 2.0]


@engineered(2)
def none_eq(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = k
    return [s, 1.0 if hit == 1 else 2.0]


@engineered(2)
def none_in_list(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = k
    return [s, 1.0 if hit in (0, 2) else 2.0]


@engineered(2)
def none_format(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = k
    return [s, {None: 5.0, 0: 1.0, 1: 2.0, 2: 3.0}[hit]]


@engineered(2)
def none_isinstance(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = float(k)
    return [s, 1.0 if isinstance(hit, float) else 2.0]


@engineered(2)
def none_default_get(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = x + k

    def g(a=None):
        return a[0] if a is not None else -7.0

    return [g(hit) * s, g(a=hit)]


@engineered(2)
def none_tuple_ret(t, x, u, params):
    s = many(x)

    def seek():
        for k in range(9):
            if abs(x[0] - k) < 0.4:
                return k, x[1]
        return None

    r = seek()
    if r is None:
        return [s, 0.0]
    return [r[0] * s, r[1]]


@engineered(2)
def none_while(t, x, u, params):
    s = many(x)

    def seek():
        k = 0
        while k < 9:
            if abs(x[0] - k) < 0.4:
                return k
            k += 1

    r = seek()
    return [s, -1.0 if r is None else r]


@engineered(2)
def try_none(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = float(k)
    try:
        v = hit + 1.0
    except TypeError:
        v = -5.0
    return [v * s, 0.0]


@engineered(2)
def sorted_mixed(t, x, u, params):
    s = many(x)
    r = sorted([x[0], 1, x[1], 2.5, 0, -1, u[0]])
    return [r[0] + 2 * r[3], r[-1] * s]


@engineered(2)
def sort_pairs(t, x, u, params):
    s = many(x)
    r = sorted([(x[0], 1), (x[1], 2), (u[0], 3), (0.5, 4)], key=lambda p: p[0])
    return [r[0][1] * s, r[1][0] + r[2][1] // 2]


@engineered(2)
def minmax_bools(t, x, u, params):
    return [
        max([(x[0] > 0, x[1]), (x[1] > 0, x[0])], key=lambda p: p[1])[0] * 1.0,
        min(x[0], 3) / 2,
    ]


@engineered(2)
def none_eq_other(t, x, u, params):
    hit = None
    s = many(x)
    for k in range(3):
        if abs(x[0] - k) < 0.4:
            hit = k
    return [s, (1.0 if np.floor(x[1]) == hit else 2.0) + (3.0 if hit != 1 else 4.0)]
