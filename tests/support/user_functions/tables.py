"""Lookup tables, interpolation, schedules, polynomials, and nonlinear characteristics."""

import bisect

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator, RegularGridInterpolator, interp1d
from scipy.signal import square

from ._entry import entry, pieces


@entry(discrete=True)
def interpolated_table(n):
    speed = np.array([-2.0, -0.5, 0.0, 1.0, 4.0])
    torque = np.array([0.0, 3.0, 5.0, 4.0, 1.0])

    def update(t, x, u, params):
        return np.interp(x, speed, torque) - np.interp(u[0], speed, torque, left=-1.0, right=9.0)

    return pieces(update, states=n)


@entry
def interpolated_periodic(n):
    def update(t, x, u, params):
        return np.interp(x, [0, 90, 180, 270], [1.0, 2.0, 4.0, 2.0], period=360)

    return pieces(update, states=n)


@entry
def table_of_lists(n):
    table = [[0.0, 1.0], [0.5, 2.0], [1.0, 0.5], [5.0, 0.1]]

    def gain(v):
        for (a, ga), (b, gb) in zip(table, table[1:]):
            if a <= v < b:
                return ga + (gb - ga) * (v - a) / (b - a)
        return table[-1][1]

    def update(t, x, u, params):
        return -gain(abs(u[0])) * x

    return pieces(update, states=n)


@entry
def bisected_table(n):
    edges, gains = [0.0, 0.5, 2.0], [1.0, 2.0, 4.0, 8.0]

    def update(t, x, u, params):
        return -x * gains[bisect.bisect(edges, u[0])]

    return pieces(update, states=n)


@entry
def table_by_rounded_index(n):
    gains = np.array([0.1, 0.5, 1.0, 2.0])

    def update(t, x, u, params):
        i = int(np.clip(np.floor(u[0]), 0, 3))
        j = min(max(round(x[0]), 0), len(gains) - 1)
        return -gains[i] * x + gains[j]

    return pieces(update, states=n)


@entry
def table_as_parameter(n):
    def update(t, x, u, params):
        return -x + np.interp(u[0], params["at"], params["values"])

    return pieces(update, states=n, at=[-1.0, 0.0, 2.0], values=np.array([3.0, 1.0, 2.0]))


@entry
def dictionary_of_gears(n):
    ratios = {1: 3.5, 2: 2.0, 3: 1.2}

    def update(t, x, u, params):
        gear = 1 if u[0] < 0 else 2 if u[0] < 1 else 3
        return -ratios[gear] * x + ratios.get(4, 0.3)

    return pieces(update, states=n)


@entry
def linear_interpolator(n):
    f = interp1d([-1e4, -1.0, 0.0, 1.0, 1e4], [0.0, 1.0, 4.0, 2.0, 0.5])

    def update(t, x, u, params):
        return -x + f(u[0])

    return pieces(update, states=n)


@entry
def cubic_spline(n):
    f = CubicSpline([-1.0, 0.0, 1.0, 2.0], [0.0, 1.0, 0.0, 2.0])

    def update(t, x, u, params):
        return -x + f(np.clip(u[0], -1, 2))

    return pieces(update, states=n)


@entry
def monotone_spline_of_all_states(n):
    f = PchipInterpolator([-1e4, -1.0, 0.0, 1.0, 1e4], [-9.0, -2.0, 0.0, 1.0, 7.0])

    def update(t, x, u, params):
        return -f(x)

    return pieces(update, states=n)


@entry
def table_in_two_dimensions(n):
    f = RegularGridInterpolator(([0.0, 1.0, 2.0], [0.0, 1.0]), np.arange(6.0).reshape(3, 2))

    def update(t, x, u, params):
        return -x + f(np.clip(u, 0, 1))[0]

    return pieces(update, states=n)


@entry
def bilinear_by_hand(n):
    table = np.arange(12.0).reshape(3, 4) ** 2

    def update(t, x, u, params):
        a, b = np.clip(u[0], 0, 1.999), np.clip(u[1], 0, 2.999)
        i, j = int(a), int(b)
        f, g = a - i, b - j
        low = table[i, j] * (1 - g) + table[i, j + 1] * g
        high = table[i + 1, j] * (1 - g) + table[i + 1, j + 1] * g
        return -x + low * (1 - f) + high * f

    return pieces(update, states=n)


@entry
def polynomial(n):
    c = [0.1, -0.5, 1.0, 2.0]
    p = np.poly1d([1.0, 0.0, -1.0])

    def update(t, x, u, params):
        horner = 0.0
        for k in c:
            horner = horner * u[0] + k
        return np.polyval(c, x) - horner + p(u[1]) + np.polynomial.polynomial.polyval(x, c)

    return pieces(update, states=n)


@entry
def where_select_piecewise(n):
    def update(t, x, u, params):
        a = np.where(x > 0, x, 0.1 * x)
        b = np.select([x < -1, x < 1], [-1.0, x], default=1.0)
        c = np.piecewise(x, [x < 0, x >= 0], [lambda v: -v, 2.0])
        return a + b - c * u[0]

    return pieces(update, states=n)


@entry
def choose_and_clip(n):
    def update(t, x, u, params):
        k = np.choose((x > 0).astype(int), [np.full(n, -1.0), x])
        return k + np.clip(x, params["lo"], params["hi"]) + x.clip(0, 1) + x.clip(max=0.5)

    return pieces(update, states=n, lo=-0.4, hi=0.9)


@entry
def clip_with_crossed_limits(n):
    def update(t, x, u, params):
        return np.clip(x, 1.0, -1.0) + np.clip(u[0], None, 0.3) + np.minimum(np.maximum(x, 2), 1)

    return pieces(update, states=n)


@entry(discrete=True)
def saturation_and_dead_zone(n):
    def saturation(v, limit):
        return max(-limit, min(v, limit))

    def dead_zone(v, width):
        if abs(v) <= width:
            return 0
        return v - width if v > 0 else v + width

    def update(t, x, u, params):
        return -x + saturation(u[0], params["limit"]) + dead_zone(u[1], params["width"])

    return pieces(update, states=n, limit=0.7, width=0.2)


@entry
def relay_and_quantiser(n):
    def update(t, x, u, params):
        relay = params["level"] if u[0] > 0 else -params["level"]
        steps = params["step"] * np.round(u[1] / params["step"])
        return -x + relay + steps

    return pieces(update, states=n, level=1.5, step=0.25)


@entry
def hysteresis_by_a_state(n):
    """A relay whose position is a state, as it should be."""

    def update(t, x, u, params):
        on = x[-1] > 0.5
        want = 1.0 if u[0] > (0.2 if on else 0.8) else 0.0
        dx = -x * (1 + on)
        dx[-1] = 50 * (want - x[-1])
        return dx

    return pieces(update, states=n)


@entry
def gain_schedule(n):
    points = np.linspace(-1, 1, 5)
    gains = np.random.default_rng(4).normal(size=(5, n))

    def update(t, x, u, params):
        i = np.argmin(np.abs(points - u[0]))
        K = gains[i]
        blend = np.array([np.interp(u[0], points, gains[:, j]) for j in range(n)])
        return -x + (K @ x) / n + blend

    return pieces(update, states=n)


@entry
def signals_of_time(n):
    def update(t, x, u, params):
        ramp = np.clip((t - 1) / 2, 0, 1)
        pulse = 1.0 if (t % 2.0) < 0.5 else 0.0
        step = np.where(t >= 1.5, 1.0, 0.0)
        return -x + ramp + pulse + step + square(t)

    return pieces(update, states=n)


@entry
def recorded_signal(n):
    times = np.linspace(0, 5, 51)
    signal = np.sin(times)

    def update(t, x, u, params):
        held = signal[np.searchsorted(times, t, side="right") - 1]
        return -x + np.interp(t, times, signal) + held

    return pieces(update, states=n)
