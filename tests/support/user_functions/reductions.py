"""Sums, extremes, orders, differences: NumPy's and the builtins."""

import functools
import math
import operator

import numpy as np

from ._entry import entry, pieces


@entry
def sums_of_all_kinds(n):
    def update(t, x, u, params):
        return -x + sum(x) + np.sum(x**2) + x.sum() + math.fsum(x) + np.add.reduce(x) + sum(u, 1.0)

    return pieces(update, states=n)


@entry
def mean_and_spread(n):
    def update(t, x, u, params):
        return (x - x.mean()) / (1 + np.std(x)) + np.var(x, ddof=1) * u[0] + np.average(x)

    return pieces(update, states=n)


@entry
def median_and_quantile(n):
    def update(t, x, u, params):
        return x - np.median(x) + np.quantile(x, 0.3) + np.percentile(u, 50)

    return pieces(update, states=n)


@entry
def products(n):
    def update(t, x, u, params):
        s = np.tanh(x)
        return np.cumprod(s) + np.prod(u) + math.prod(u) + functools.reduce(operator.mul, s)

    return pieces(update, states=n)


@entry
def builtin_extremes(n):
    def update(t, x, u, params):
        top, low = max(x), min(x)
        return -x * (top - low) + max(u[0], 0.0, -u[1]) + min(abs(u[0]), params["limit"])

    return pieces(update, states=n, limit=0.6)


@entry
def extremes_with_keys(n):
    def update(t, x, u, params):
        far = max(x, key=abs)
        first = min(range(n), key=lambda i: x[i])
        return -x + far * u[0] + first + max([], default=2.0)

    return pieces(update, states=n)


@entry
def numpy_extremes(n):
    def update(t, x, u, params):
        a = np.maximum(x, u[0]) - np.minimum(x, 0)
        return a + np.max(x) - x.min() + np.amax(u) + np.ptp(x) + np.maximum.reduce(x)

    return pieces(update, states=n)


@entry
def extremes_and_nan(n):
    def update(t, x, u, params):
        bad = np.where(x > 0.5, np.nan, x)
        total = np.nansum(bad) + np.fmax(bad, -1.0)
        return total + np.fmin(x, u[0]) + np.maximum(x, u[1])

    return pieces(update, states=n)


@entry
def python_max_with_nan(n):
    """The first argument wins where the other is NaN."""

    def update(t, x, u, params):
        bad = float("nan") if u[0] > 0 else 0.3
        return -x + max(0.1, bad) + min(bad, 0.2)

    return pieces(update, states=n)


@entry
def nan_tests(n):
    def update(t, x, u, params):
        r = x / u[0]
        r[np.isnan(r)] = 0.0
        r[~np.isfinite(r)] = 1.0
        return np.nan_to_num(r) - math.isnan(u[1]) + np.isinf(x).sum()

    return pieces(update, states=n)


@entry
def argmax_of_ties(n):
    def update(t, x, u, params):
        s = np.round(x)
        return -x + s.argmax() - 2 * s.argmin() + np.argmax(np.abs(s))

    return pieces(update, states=n)


@entry
def sorts(n):
    def update(t, x, u, params):
        order = np.argsort(x, kind="stable")
        return np.sort(x)[::-1] + x[order] * u[0] + order

    return pieces(update, states=n)


@entry
def sorted_with_key(n):
    def update(t, x, u, params):
        s = sorted(x, key=lambda v: -abs(v))
        return np.array(s) * u[1] + sorted(u, reverse=True)[0]

    return pieces(update, states=n)


@entry(discrete=True)
def cumulative_sums(n):
    def update(t, x, u, params):
        c = np.cumsum(x)
        return c - x + c[-1] * u[0] + np.cumsum(x[::-1])[::-1]

    return pieces(update, states=n)


@entry
def differences(n):
    def update(t, x, u, params):
        d = np.diff(x, prepend=u[0])
        e = np.diff(x, append=u[1])
        return e - d + np.diff(x).sum()

    return pieces(update, states=n)


@entry
def second_differences(n):
    def update(t, x, u, params):
        wide = np.concatenate(([u[0]], x, [u[1]]))
        return np.diff(wide, n=2) * params["k"]

    return pieces(update, states=n, k=2.0)


@entry
def gradient(n):
    def update(t, x, u, params):
        return np.gradient(x, 0.5) + u[0]

    return pieces(update, states=n)


@entry
def integrals(n):
    grid = np.linspace(0, 1, n) ** 2

    def update(t, x, u, params):
        return -x + np.trapezoid(x, grid) + np.trapezoid(x, dx=0.1) * u[0]

    return pieces(update, states=n)


@entry
def any_and_all(n):
    def update(t, x, u, params):
        if np.any(x > 2) or not np.all(u < 5):
            return -x
        if any(v < -1 for v in x) and all([u[0] > 0, u[1] > 0]):
            return -2 * x
        return x.any() + np.zeros(n)

    return pieces(update, states=n)


@entry
def counting(n):
    def update(t, x, u, params):
        return -x + np.count_nonzero(x > 0) + np.sum(x > u[0]) + np.nonzero(x > 0)[0].size

    return pieces(update, states=n)


@entry
def reductions_along_axes(n):
    def update(t, x, u, params):
        m = np.outer(u, x)
        a = m.sum(axis=0) + m.max(axis=0) - m.mean(axis=0)
        b = m.sum(axis=1, keepdims=True)
        return a + (m / (1 + abs(b))).sum(0) + m.cumsum(axis=0)[-1] + m.argmax(axis=0)

    return pieces(update, states=n)


@entry
def searchsorted_and_digitize(n):
    edges = np.array([-1.0, 0.0, 0.5, 2.0])

    def update(t, x, u, params):
        i = np.searchsorted(edges, u[0])
        return np.digitize(x, edges) - x + i + np.searchsorted(edges, 0.5, side="right")

    return pieces(update, states=n)


@entry
def accumulate(n):
    def update(t, x, u, params):
        top = np.maximum.accumulate(x)
        return top - x + np.add.accumulate(x) * u[0] + np.subtract.outer(x, x)[0]

    return pieces(update, states=n)


@entry
def ewise_extremes_by_hand(n):
    def update(t, x, u, params):
        best = 0
        for i in range(1, n):
            if x[i] > x[best]:
                best = i
        dx = -x
        dx[best] = u[0]
        return dx

    return pieces(update, states=n)


@entry
def rms_and_norms(n):
    def update(t, x, u, params):
        rms = np.sqrt(np.mean(x**2))
        return x / (1e-3 + rms) - math.hypot(*u) + math.dist(u, [0.0, 1.0]) + math.sqrt(x @ x)

    return pieces(update, states=n)


@entry
def convolve_and_correlate(n):
    def update(t, x, u, params):
        return np.convolve(x, [0.25, 0.5, 0.25], mode="same")[:n] + np.correlate(u, u)[0]

    return pieces(update, states=n)


@entry
def unique_and_histogram(n):
    def update(t, x, u, params):
        return -x + np.unique(np.sign(x)).size + np.histogram(x, bins=3, range=(-1, 1))[0][1]

    return pieces(update, states=n)
