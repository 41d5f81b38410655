"""Loops that end at a tolerance, and roots that are sought: how many passes, the values say."""

import math

import numpy as np
from scipy import optimize

from engineers.entry import engineered


@engineered(2)
def keplers_equation(t, x, u, params):
    mean, e = x[0], min(abs(x[1]), 0.8)
    angle, left = mean, 60
    while True:
        step = (angle - e * math.sin(angle) - mean) / (1 - e * math.cos(angle))
        angle, left = angle - step, left - 1
        if abs(step) < 1e-12 or left == 0:
            break
    return [1 / (1 - e * math.cos(angle)) ** 2, 0.0]


@engineered(1)
def friction_in_itself(t, x, u, params):
    v, count = x[0], 0
    force = v
    while abs(force + 0.3 * math.tanh(force) - v) > 1e-12 and count < 50:
        slope = 1 + 0.3 * (1 - math.tanh(force) ** 2)
        force -= (force + 0.3 * math.tanh(force) - v) / slope
        count += 1
    return [u[0] - force + 0.0 * count]


def friction_factor(reynolds, roughness=1e-4):
    if reynolds < 2300:
        return 64 / max(reynolds, 1.0)
    f = 0.02
    for _ in range(50):
        new = (-2 * math.log10(roughness / 3.7 + 2.51 / (reynolds * math.sqrt(f)))) ** -2
        if abs(new - f) < 1e-10:
            break
        f = new
    return f


@engineered(1)
def flow_in_a_pipe(t, x, u, params):
    flow = x[0]
    return [5 + u[0] - 50 * friction_factor(1e5 * abs(flow)) * flow * abs(flow)]


@engineered(2)
def linkage(t, x, u, params):
    """An array that is written into, and passes that are counted."""
    angles, passes = np.array([0.5, 1.5]), 0
    for _ in range(20):
        closed = 3 * np.array([np.cos(angles[0]), np.sin(angles[0])])
        closed += np.array([np.cos(x[0]) - 3.2, np.sin(x[0])])
        closed -= 2.5 * np.array([np.cos(angles[1]), np.sin(angles[1])])
        if np.linalg.norm(closed) < 1e-12 or not np.isfinite(closed).all():
            break
        slope = np.array([[-3 * np.sin(angles[0]), 2.5 * np.sin(angles[1])],
                          [3 * np.cos(angles[0]), -2.5 * np.cos(angles[1])]])  # fmt: skip
        angles -= np.clip(np.linalg.solve(slope, closed), -0.3, 0.3)
        passes += 1
    return [x[1], -0.5 * np.sin(angles[1]) - 0.1 * x[1] + 1e-3 * passes]


def root_or_error(y):
    guess = y
    for _ in range(25):
        value = guess + 0.5 * math.sin(guess) - y
        if abs(value) < 1e-12:
            return guess
        guess -= value / (1 + 0.5 * math.cos(guess))
    raise RuntimeError(f"no root for {y}")


@engineered(1)
def returned_from_a_loop(t, x, u, params):
    return [-root_or_error(x[0])]


@engineered(2)
def first_that_is_beyond(t, x, u, params):
    """What ends the search is a place in a list, and without one there is another value."""
    levels = (0.5, 1.0, 2.0)
    for place, level in enumerate(levels):
        if x[0] < level:
            gain = 1.0 + place
            break
    else:
        gain = 9.0
    return [-gain * x[0], place - x[1]]


@engineered(2)
def a_loop_in_a_loop(t, x, u, params):
    total = 0.0
    for k in range(3):
        guess = 1.0 + 0.1 * k
        for _ in range(30):
            new = 0.5 * (guess + (1 + abs(x[0])) / guess)
            done = abs(new - guess) < 1e-9
            guess = new
            if done:
                break
        total += guess
        if total > 5.0:
            break
    return [-total, total * x[1]]


@engineered(1)
def beyond_the_end_of_a_list(t, x, u, params):
    """No pass after the last is looked at where the loop ends before."""
    steps, k = [0.5, 1.0, 2.0, 50.0, 1e9], 0
    while abs(x[0]) > steps[k]:
        k += 1
    return [-k * x[0]]


@engineered(1)
def root_by_brents_method(t, x, u, params):
    pressure = 760 * min(max(x[0], 0.2), 3.0)
    vapour = lambda T: 10 ** (8.07131 - 1730.63 / (233.4 + T))  # noqa: E731
    boiling = optimize.brentq(lambda T: vapour(T) - pressure, 20, 180)
    return [0.01 * (100 + u[0] - boiling)]


@engineered(1)
def root_by_newtons_method(t, x, u, params):
    y = optimize.newton(lambda y: y + 0.5 * math.sin(y) - x[0], 0.8 * x[0],
                        fprime=lambda y: 1 + 0.5 * math.cos(y))  # fmt: skip
    return [-y]


@engineered(1)
def root_by_secants(t, x, u, params):
    volume = optimize.newton(lambda v, p: (p + 0.364 / v**2) * (v - 0.04) - 25, 2.0,
                             args=(8.0 + math.tanh(x[0]),))  # fmt: skip
    return [u[0] - volume]


def improve(guess, y):
    guess[0] -= (guess[0] + 0.5 * np.sin(guess[0]) - y) / (1 + 0.5 * np.cos(guess[0]))
    guess[1] += 1.0


@engineered(1)
def written_by_a_function(t, x, u, params):
    guess = np.array([x[0], 0.0])
    for _ in range(6):
        before = guess[0]
        improve(guess, x[0])
        if abs(guess[0] - before) < 1e-3:
            break
    return [-guess[0] - 0.01 * guess[1]]
