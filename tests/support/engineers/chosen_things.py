"""Best so far, first and last, sorted: numbers, tuples, arrays, and what is None at first."""

import dataclasses
import heapq
import itertools
import statistics
from collections import namedtuple
from operator import attrgetter

import numpy as np

from engineers.entry import engineered

C = namedtuple("C", "soc temp")


@dataclasses.dataclass
class D:
    soc: float
    temp: float


@engineered(3)
def min_tuple_key(t, x, u, params):
    p = min([(x[0], 1.0), (x[1], 2.0), (x[2], 3.0)], key=lambda q: q[0])
    return [p[0], p[1], float(len(p + (1,)))]


@engineered(3)
def min_tuple_plain(t, x, u, params):
    p = min((abs(x[0]), 1.0), (abs(x[1]), 2.0))
    return [p[0], p[1], 0.0]


@engineered(3)
def min_dataclass(t, x, u, params):
    p = min([D(x[0], x[1]), D(x[1], x[2]), D(x[2], 0.0)], key=lambda q: q.soc)
    return [p.soc, p.temp, 1.0]


@engineered(3)
def max_dict_key(t, x, u, params):
    d = {"a": x[0], "b": x[1], "c": x[2]}
    k = max(d, key=d.get)
    return [d[k], {"a": 1.0, "b": 2.0, "c": 3.0}[k], 0]


@engineered(3)
def max_items(t, x, u, params):
    d = {"a": x[0], "b": x[1], "c": x[2]}
    k, v = max(d.items(), key=lambda kv: kv[1])
    return [v, 1.0 if k == "a" else 2.0, 0]


@engineered(3)
def min_range_key(t, x, u, params):
    i = min(range(3), key=lambda i: abs(x[i] - u[0]))
    return [x[i], float(i), x[i - 1]]


@engineered(3)
def min_arrays_key(t, x, u, params):
    pts = [np.array([0.0, 0]), np.array([1.0, 1]), np.array([2.0, -1])]
    p = min(pts, key=lambda p: np.linalg.norm(p - x[:2]))
    return [*p, 0.0]


@engineered(3)
def min_namedtuples(t, x, u, params):
    c = [C(a, b) for a, b in zip(x, x[::-1])]
    lo = min(c, key=attrgetter("soc"))
    hi = max(c, key=lambda c: c.temp)
    return [lo.soc, lo.temp, hi._replace(soc=1.0).temp]


@engineered(3)
def min_objects_default(t, x, u, params):
    c = [C(a, b) for a, b in zip(x, x[::-1]) if a > 0]
    lo = min(c, key=lambda c: c.temp, default=C(0.0, 0.0))
    return [lo.soc, lo.temp, 1]


@engineered(3)
def sorted_tuples(t, x, u, params):
    s = sorted(zip(x, (1.0, 2.0, 3.0)))
    return [s[0][1], s[1][1], s[2][0]]


@engineered(4)
def sorted_key4(t, x, u, params):
    r = sorted(range(4), key=lambda i: x[i])
    return [x[i] for i in r]


@engineered(5)
def sorted_five(t, x, u, params):
    return sorted(x)


@engineered(5)
def sorted_rev_key(t, x, u, params):
    return sorted(x, key=abs, reverse=True)


@engineered(5)
def list_sort_inplace(t, x, u, params):
    l = list(x)
    l.sort()
    l2 = [abs(v) for v in x]
    l2.sort(reverse=True)
    return [a + b for a, b in zip(l, l2)]


@engineered(5)
def smallest_and_largest_two(t, x, u, params):
    return [*heapq.nsmallest(2, x), *heapq.nlargest(2, x, key=abs), statistics.median(x)]


@engineered(4, 1)
def sorted_priority_heap(t, x, u, params):
    top = heapq.nlargest(2, x)
    low = sorted(x, reverse=True)[-1]
    rank = sorted(range(4), key=lambda i: -abs(x[i]))
    out = np.zeros(4)
    out[rank[0]] = -(top[0] - top[1])
    out[rank[-1]] = u[0] - low
    return out


@engineered(3)
def governor_of_references(t, x, u, params):
    A = np.array([[0.9, 0.1], [-0.2, 0.8]])
    ok = 0.0
    for k in np.linspace(0, 1, 11):
        v = x[2] + k * (u[0] - x[2])
        z = x[:2].copy()
        feasible = True
        for _ in range(3):
            z = A @ z + np.array([0, 0.1 * v])
            if abs(z[0]) > 1.0:
                feasible = False
                break
        if feasible:
            ok = k
    return np.append(A @ x[:2] - x[:2], ok * (u[0] - x[2]))


@engineered(2)
def active_sets_in_turn(t, x, u, params):
    H = np.array([[2.0, 0.5], [0.5, 1.0]])
    g = np.array([x[0], x[1] - 1])
    best, arg = np.inf, None
    for active in itertools.product([None, -1.0, 1.0], repeat=2):
        z = np.zeros(2)
        free = [i for i, a in enumerate(active) if a is None]
        for i, a in enumerate(active):
            if a is not None:
                z[i] = a
        if free:
            rhs = -(g + H @ z)[free]
            z[free] = np.linalg.solve(H[np.ix_(free, free)], rhs)
        if np.all(np.abs(z) <= 1 + 1e-9):
            J = 0.5 * z @ H @ z + g @ z
            if best > J:
                best, arg = J, z
    return arg - x + u[0] * 0.1


@engineered(2)
def inputs_in_turn(t, x, u, params):
    best, bu = None, None
    for c in np.linspace(-1, 1, 9):
        z = x.copy()
        cost = 0.0
        for _ in range(3):
            z = z + 0.1 * np.array([z[1], c])
            cost += z @ z + 0.1 * c**2
        if best is None or cost < best:
            best, bu = cost, c
    return [x[1], bu]


@engineered(2)
def states_in_turn(t, x, u, params):
    best, zb = np.inf, np.zeros(2)
    for c in np.linspace(-1, 1, 9):
        z = x + 0.1 * np.array([x[1], c])
        cost = z @ z
        if cost < best:
            best = cost
            zb = z
    return zb - x


@engineered(2)
def best_written_into(t, x, u, params):
    best, zb = np.inf, np.zeros(2)
    z = np.zeros(2)
    for c in np.linspace(-1, 1, 9):
        z[0] = x[0] + c
        z[1] = x[1] * c
        cost = z @ z
        if cost < best:
            best = cost
            zb[:] = z
    zb[0] += 1.0
    return zb - x


@engineered(2)
def choose_then_write(t, x, u, params):
    a = np.zeros(2)
    b = np.ones(2)
    s = 0.0
    for k in range(9):
        y = a if x[0] > k else b
        y[0] += 1.0
        s += 1 if x[1] > k else 0
    return a + b * 2 + s


@engineered(2)
def nearest_segment(t, x, u, params):
    pts = [
        (0.0, 0.0),
        (1.0, 0.0),
        (2.0, 1.0),
        (3.0, 3.0),
        (4.0, 3.0),
        (5.0, 2.0),
        (6.0, 0.0),
        (7.0, 1.0),
        (8.0, 8.0),
    ]
    dmin, foot = 1e9, None
    for a, b in zip(pts, pts[1:]):
        a, b = np.array(a), np.array(b)
        s = np.clip(np.dot(x - a, b - a) / np.dot(b - a, b - a), 0, 1)
        p = a + s * (b - a)
        d = np.linalg.norm(x - p)
        if d < dmin:
            dmin, foot = d, p
    return foot - x


@engineered(2)
def newton_of_two(t, x, u, params):
    z = np.array([1.0, 1.0])
    for _ in range(20):
        F = np.array([z[0] ** 2 + z[1] - 2 - 0.1 * np.tanh(x[0]), z[0] + z[1] ** 2 - 2])
        J = np.array([[2 * z[0], 1], [1, 2 * z[1]]])
        dz = np.linalg.solve(J, -F)
        z = z + dz
        if np.linalg.norm(dz) < 1e-10:
            break
    return z - x


@engineered(2)
def newton_in_place(t, x, u, params):
    z = np.array([1.0, 1.0])
    it = 0
    while it < 15:
        F = np.array([z[0] ** 2 + z[1] - 2 - 0.1 * np.tanh(x[0]), z[0] + z[1] ** 2 - 2])
        if np.max(np.abs(F)) < 1e-10:
            break
        J = np.array([[2 * z[0], 1], [1, 2 * z[1]]])
        z -= np.linalg.solve(J, F)
        it += 1
    return z - x


@engineered(3)
def power_iteration(t, x, u, params):
    A = np.diag([3.0, 2.0, 1.0]) + 0.1 * np.outer(np.tanh(x), np.tanh(x))
    v = np.ones(3) / np.sqrt(3)
    lam = 0.0
    for _ in range(50):
        w = A @ v
        lam_new = np.linalg.norm(w)
        v = w / lam_new
        if abs(lam_new - lam) < 1e-8:
            break
        lam = lam_new
    return -lam * x


@engineered(3)
def first_that_fits(t, x, u, params):
    found = None
    for k in range(9):
        if x[0] > k - 4 and x[1] < k:
            found = k
            break
    if found is None:
        return -x
    return [found * x[2], x[0], x[1]]


@engineered(3)
def last_that_fits(t, x, u, params):
    hit = None
    for k in range(9):
        if abs(x[0] - k) < 0.7:
            hit = x + k
    return x if hit is None else hit * 2


@engineered(3)
def once_or_again(t, x, u, params):
    hit, n = None, 0
    for k in range(9):
        if abs(x[0] - k) < 0.7 and (hit is None or x[1] > 0):
            hit = x[2] + k
            n += 1
    if hit is not None and hit > 2:
        return [hit, n, 0.0]
    return [0.0, n, 1.0]


@engineered(3)
def none_truthy(t, x, u, params):
    hit = None
    for k in range(9):
        if abs(x[0] - k) < 0.7:
            hit = float(k)
    v = hit or 5.0
    return [v, 1.0 if hit else 2.0, 0.0]


@engineered(3)
def none_dead_use(t, x, u, params):
    hit = None
    for k in range(9):
        if abs(x[0] - k) < 0.7:
            hit = float(k)
    d = hit * 2 if hit is not None else -1.0
    return [d, 0.0, 0.0]


@engineered(3)
def an_argument_that_may_be_none(t, x, u, params):
    def cost(v, ref=None):
        if ref is None:
            ref = np.zeros(3)
        return (v - ref) @ (v - ref)

    hit = None
    for k in range(9):
        if abs(x[0] - k) < 0.7:
            hit = x * k
    return [cost(x, hit), 0.0, 0.0]


@engineered(3)
def none_returned(t, x, u, params):
    def seek():
        for k in range(9):
            if abs(x[0] - k) < 0.7 and x[1] > k - 3:
                return k
        return None

    k = seek()
    if k is None:
        return 0 * x
    return x * k


@engineered(3)
def nothing_returned(t, x, u, params):
    def seek():
        for k in range(9):
            if abs(x[0] - k) < 0.7 and x[1] > k - 3:
                return x + k

    k = seek()
    return 0 * x if k is None else x * k


@engineered(3)
def views_of_either(t, x, u, params):
    a, b = np.zeros(3), np.ones(3)
    s = 0
    for k in range(9):
        s += 1 if x[1] > k else 0
        y = a if x[0] > k else b
        v = y[1:]
        v[0] = v[0] + x[2]
    return a + 2 * b + s


@engineered(3)
def either_row(t, x, u, params):
    A = np.zeros((2, 3))
    s = 0
    for k in range(9):
        r = A[0] if x[0] > k else A[1]
        s = s + (r[0] if x[1] > k else 1.0)
        A[0] = A[0] + x
    return A[0] + s + r


@engineered(3)
def hash_clip(t, x, u, params):
    key = tuple(np.round(np.clip(x[:2], -1, 1)).astype(int))
    return [{(i, j): i - 2.0 * j for i in (-1, 0, 1) for j in (-1, 0, 1)}[key], 0.0, 0.0]


@engineered(3)
def hash_int(t, x, u, params):
    key = round(max(-2, min(2, float(x[0]))))
    return [{-2: 1.0, -1: 0.5, 0: 0.0, 1: 2.0, 2: 4.0}[key], 0.0, 0.0]


@engineered(3, 1)
def quantized_hashmap(t, x, u, params):
    key = tuple(np.round(np.clip(x[:2], -1, 1)).astype(int))
    policy = {(i, j): i * 0.5 - j for i in (-1, 0, 1) for j in (-1, 0, 1)}
    return [x[1], x[2], policy[key] + u[0]]
