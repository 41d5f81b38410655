"""Choices: by masks, by pieces, by limits."""

import numpy as np

from engineers.entry import engineered


@engineered(3)
def read_by_a_mask(t, x, u, params):
    return -x + x[x > 0].sum() * 0.1 + u[0]


@engineered(4)
def written_by_a_mask(t, x, u, params):
    dx = -x + u[0]
    dx[np.abs(x) > 2.0] = 0.0
    return dx


@engineered(4)
def scaled_by_a_mask(t, x, u, params):
    dx = u[0] - x
    dx[x < 0] *= 2.0
    return dx


@engineered(4)
def written_by_a_mask_with_values(t, x, u, params):
    y = x.copy()
    outside = (x > 1) | (x < -1)
    y[outside] = np.sign(x[outside])
    return u[0] - y


@engineered(12)
def many_by_a_mask(t, x, u, params):
    dx = -x
    dx[x > 1.0] = -2.0
    return dx + u[0]


@engineered(2)
def selected(t, x, u, params):
    force = np.select([x[0] < -1, x[0] > 1], [x[0] + 1, x[0] - 1], default=0.0)
    return [x[1], -force - 0.1 * x[1] + u[0]]


@engineered(3)
def selected_arrays(t, x, u, params):
    return -np.select([x < -1, x < 1], [x * 2, x], x**2) + u[0]


@engineered(2)
def piecewise_of_functions(t, x, u, params):
    f = np.piecewise(x[0], [x[0] < 0, x[0] >= 0], [lambda z: -(z**2), lambda z: z**2])
    return [x[1], -f - x[1] + u[0]]


@engineered(2)
def piecewise_of_constants(t, x, u, params):
    friction = np.piecewise(x, [x < 0, x > 0], [-1.0, 1.0])
    return u[0] - x - 0.3 * friction


@engineered(2)
def clipped_by_method(t, x, u, params):
    v = np.clip(u[0], -1, 1)
    return [x[1], v - x.clip(-2, 2)[0]]


@engineered(3)
def clipped_by_arrays(t, x, u, params):
    low, high = np.array([-1, -2, -3.0]), np.array([1, 2, 3.0])
    return -np.clip(x, low, high) + np.clip(u, None, 1.0)


@engineered(2)
def dead_zone_by_where(t, x, u, params):
    v = np.where(np.abs(u[0]) < 0.5, 0.0, u[0] - 0.5 * np.sign(u[0]))
    return [x[1], v - x[0]]


@engineered(2)
def guarded_against_nan(t, x, u, params):
    ratio = np.nan_to_num(x[0] / np.abs(x[0]))
    return [x[1] - ratio, u[0] - x[1]]


@engineered(3)
def nan_to_num_of_arrays(t, x, u, params):
    with np.errstate(all="ignore"):
        inverse = np.nan_to_num(1.0 / x, nan=0.0, posinf=10.0, neginf=-10.0)
    return u[0] - x - np.clip(inverse, -1, 1)


@engineered(2)
def larger_by_fmax(t, x, u, params):
    return [np.fmax(x[0], 0.0) - x[1], np.fmin(x[1], u[0]) - x[0]]


@engineered(2)
def divided_where_allowed(t, x, u, params):
    safe = np.divide(x[0], x[1], out=np.zeros(1), where=np.array([abs(x[1]) > 1e-3]))
    return [safe[0] - x[0], u[0] - x[1]]


@engineered(2, a=2.0)
def logical_functions(t, x, u, params):
    inside = np.logical_and(x[0] > -params["a"], np.logical_not(x[0] > params["a"]))
    return [x[1], np.where(inside, -x[0], -5 * x[0]) + u[0]]


@engineered(2)
def raises_for_what_cannot_be(t, x, u, params):
    if np.isnan(x).any():
        raise ValueError("diverged")
    return [x[1], -x[0] + u[0]]


@engineered(2)
def asserts_that_states_are_finite(t, x, u, params):
    assert np.all(np.isfinite(x)), "diverged"
    return [x[1], -np.sin(x[0]) + u[0]]


@engineered(2)
def close_to_zero(t, x, u, params):
    if np.isclose(x[1], 0.0, atol=1e-3):
        return [0.0, u[0] - x[0]]
    return [x[1], u[0] - x[0] - np.sign(x[1])]


@engineered(2)
def compared_in_a_chain(t, x, u, params):
    force = 0.0 if -0.5 <= x[0] <= 0.5 else x[0]
    return [x[1], -force + u[0]]


@engineered(2)
def put_by_index_functions(t, x, u, params):
    dx = np.zeros(2)
    np.put(dx, [0, 1], [x[1], u[0] - x[0]])
    return dx


@engineered(3)
def copied_to_by_a_mask(t, x, u, params):
    dx = -x
    np.copyto(dx, u[0] - x, where=x > 0)
    return dx


@engineered(3)
def chosen_with_where_of_arrays(t, x, u, params):
    return np.where(x > 0, -x, np.where(x < -1, -2 * x, 0.0)) + u[0]


@engineered(1)
def switch_statement(t, x, u, params):
    match int(x[0] > 0) + int(x[0] > 1):
        case 0:
            return [u[0]]
        case 1:
            return [u[0] - x[0]]
        case _:
            return [-2 * x[0]]
