"""Sums, means, extremes, orders."""

import numpy as np

from engineers.entry import engineered


@engineered(5, 0)
def consensus_by_mean(t, x, u, params):
    return np.mean(x) - x


@engineered(5, 0, K=2.0)
def kuramoto(t, x, u, params):
    omega = np.linspace(-1, 1, 5)
    return omega + params["K"] * np.mean(np.sin(x[:, None] - x[None, :]), axis=0) * -1


@engineered(4)
def method_mean(t, x, u, params):
    return u[0] - x + 0.1 * x.mean()


@engineered(3)
def normalised(t, x, u, params):
    return -(x - x.mean()) / (1.0 + x.std()) + u[0]


@engineered(4)
def variances(t, x, u, params):
    return -x * np.var(x) + np.std(x[:2], ddof=1)


@engineered(3)
def limited_by_largest(t, x, u, params):
    return -x / max(1.0, np.max(np.abs(x))) + u[0]


@engineered(3)
def method_max_and_min(t, x, u, params):
    return np.array([x.max() - x[0], x.min() - x[1], u.sum() - x[2]])


@engineered(6)
def extremes_by_axis(t, x, u, params):
    m = x.reshape(2, 3)
    return np.concatenate([m.max(axis=0), m.min(axis=0)]) - x


@engineered(3)
def amax_and_amin(t, x, u, params):
    return (np.amax(x) - np.amin(x)) * -x + u[0]


@engineered(3)
def peak_to_peak(t, x, u, params):
    return -np.ptp(x) * x


@engineered(3)
def products(t, x, u, params):
    return np.prod(x) * 0.1 - x + np.prod([u[0], 2.0])


@engineered(4)
def cumulative(t, x, u, params):
    return np.cumsum(x)[::-1] * -0.1 + np.cumprod(x) * 0.01


@engineered(12, 0)
def long_cumulative(t, x, u, params):
    return -np.cumsum(x) / 12


@engineered(3)
def in_order(t, x, u, params):
    low, middle, high = np.sort(x)
    return [middle - x[0], low - x[1], high - x[2] + u[0]]


@engineered(5)
def median_filter(t, x, u, params):
    return np.r_[u[0], x[:-1]] - np.median(x)


@engineered(4)
def largest_decides(t, x, u, params):
    dx = -x
    dx[np.argmax(np.abs(x))] -= 1.0
    return dx


@engineered(3)
def index_of_smallest(t, x, u, params):
    i = int(np.argmin(x))
    gains = [0.5, 1.0, 2.0]
    return -gains[i] * x + u[0]


@engineered(4)
def any_is_out_of_range(t, x, u, params):
    if np.any(np.abs(x) > 5.0):
        return -10.0 * x
    return -x + u[0]


@engineered(4)
def all_in_range(t, x, u, params):
    ok = np.all(x > -1) and (x < 1).all()
    return -x if ok else -2.0 * x


@engineered(4)
def count_of_positive(t, x, u, params):
    return -x * np.count_nonzero(x > 0)


@engineered(4)
def share_above(t, x, u, params):
    return u[0] - x * (1 + (x > 0.5).mean())


@engineered(4)
def sum_of_a_mask(t, x, u, params):
    return -x + 0.1 * np.sum(x > 0) + u[0]


@engineered(6)
def sums_by_axis(t, x, u, params):
    m = x.reshape(3, 2)
    return (m - m.sum(axis=1)[:, None] / 2 - m.mean(axis=0)).ravel() * -1


@engineered(4)
def average_with_weights(t, x, u, params):
    return np.average(x, weights=[1, 2, 3, 4]) - x


@engineered(16, 0)
def statistics_of_many(t, x, u, params):
    return (x.mean() - x) / (0.1 + x.std()) - 0.01 * np.max(x) * x


@engineered(11)
def largest_of_many(t, x, u, params):
    return -x / (1 + np.abs(x).max()) + u[0] * x.min()


@engineered(4)
def area_under(t, x, u, params):
    return -0.1 * x * np.trapezoid(x, dx=0.25) + u[0]


@engineered(4)
def largest_finite(t, x, u, params):
    return -x / (1.0 + np.nanmax(np.abs(x)))


@engineered(4)
def as_builtins(t, x, u, params):
    top, bottom = max(x), min(x)
    return [sum(x) / len(x) - x[0], top - x[1], bottom - x[2], abs(x[3]) * -1 + u[0]]


@engineered(3)
def largest_by_key(t, x, u, params):
    worst = max(x, key=abs)
    return [-worst + u[0], x[0] - x[1], x[1] - x[2]]


@engineered(3)
def python_sorted(t, x, u, params):
    a, b, c = sorted(x)
    return [b - x[0], c - x[1], a - x[2] + u[0]]


@engineered(3)
def any_and_all_builtins(t, x, u, params):
    if any(v > 2.0 for v in x) or all(v < -1.0 for v in x):
        return [-2 * v for v in x]
    return [-v + u[0] for v in x]
