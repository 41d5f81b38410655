"""Fixed points, further root searches and filters; branches whose later lines read earlier ones."""

import math

import numpy as np
from scipy import signal
from scipy.optimize import brenth, fixed_point, root_scalar

from engineers.entry import engineered

SECTIONS = signal.butter(3, 0.3, output="sos")


@engineered(1)
def a_fixed_point(t, x, u, params):
    y = fixed_point(lambda y: np.cos(0.5 * y) + 0.1 * np.tanh(u[0]), 0.5)
    return [float(y) - x[0]]


@engineered(1)
def a_fixed_point_near_the_state(t, x, u, params):
    return [fixed_point(lambda y, c: np.sqrt(1 + c + y), 1.0, args=(x[0] ** 2,)) - u[0]]


@engineered(2)
def by_hyperbolas(t, x, u, params):
    one = brenth(lambda z: math.exp(z) - 2 - math.tanh(x[1]), -5, 5)
    level = np.clip(x[0], -3, 3)
    two = root_scalar(lambda z: z + 0.3 * np.sin(z) - level, bracket=[-4, 4], method="brenth")
    return [one - x[0], two.root - x[1]]


@engineered(4)
def sections_of_a_filter(t, x, u, params):
    return signal.sosfilt(SECTIONS, np.r_[x, u])[-4:] - x


@engineered(6)
def lines_of_a_branch(t, x, u, params):
    out = []
    for v in x:
        a, b = v, 0.0
        if a > 0:
            s = np.sqrt(a)
            r = s * s + 1
            s = s + r
            b += r
            b *= 2
        elif a < -2:
            a, b = b, a
            a = a + b
            r = b
            s = -a
        else:
            r, s = 1.0, a
        if s > r and a > b:
            a = s
            b = a * r
            a = b - a
        out.append(a + b * r - s)
    return np.array(out)


@engineered(4)
def a_sorting_network(t, x, u, params):
    a, b, c, d = x
    if a > b:
        kept = a
        a = b
        b = kept
    if c > d:
        kept = c
        c = d
        d = kept
    if a > c:
        kept = a
        a = c
        c = kept
    if b > d:
        kept = b
        b = d
        d = kept
    if b > c:
        kept = b
        b = c
        c = kept
    return [a - x[0], b - x[1], c - x[2], d + u[0]]


@engineered(3)
def lines_that_use_something_up(t, x, u, params):
    levels, total = iter(range(40)), 0.0
    for j in range(9):
        if x[j % 3] > total - j:
            n = next(levels)
            n = n * 2
            total += n
        else:
            total = total - 1
            total = total * 0.5
    return x * total
