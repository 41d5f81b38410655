"""Tables, splines and polynomials."""

from bisect import bisect_right

import numpy as np
from scipy.interpolate import BSpline, CubicSpline, PchipInterpolator, PPoly, make_interp_spline

from engineers.entry import engineered

SPEED = np.array([0.0, 10.0, 20.0, 40.0, 60.0])
TORQUE = np.array([100.0, 140.0, 150.0, 120.0, 60.0])
PITCH = np.array([0.0, 5.0, 10.0, 20.0])
CP = np.array([[0.1, 0.2, 0.1, 0.0], [0.3, 0.4, 0.2, 0.1], [0.2, 0.3, 0.1, 0.05],
               [0.1, 0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0]])  # fmt: skip
DRAG = CubicSpline(SPEED, TORQUE)
LIFT = PchipInterpolator(SPEED, TORQUE)
ROAD = make_interp_spline(SPEED, TORQUE, k=3)
STEPS = BSpline(np.arange(8.0), np.array([1.0, 2.0, 0.0, 1.0]), 3)
TWO = PPoly(np.array([[1.0, -1.0], [0.0, 1.0]]), [0.0, 1.0, 2.0])


@engineered(2)
def engine_map(t, x, u, params):
    return [x[1], u[0] * np.interp(x[1], SPEED, TORQUE) / 1000 - 0.1 * x[1]]


@engineered(2)
def map_with_limits(t, x, u, params):
    drag = np.interp(x[0], [0.0, 1.0, 2.0], [0.0, 1.0, 4.0], left=-1.0, right=9.0)
    return [u[0] - drag, -x[1] + np.interp(t, [0, 1, 2], [0, 5, 5])]


@engineered(3)
def map_of_all_states(t, x, u, params):
    return u[0] - np.interp(x, SPEED, TORQUE) / 100


@engineered(2, table=np.array([0.0, 1.0, 3.0]))
def map_that_is_a_parameter(t, x, u, params):
    return [x[1], -np.interp(x[0], np.array([-1.0, 0.0, 1.0]), params["table"]) + u[0]]


@engineered(2)
def interval_by_searchsorted(t, x, u, params):
    i = np.clip(np.searchsorted(SPEED, x[0]) - 1, 0, len(SPEED) - 2)
    slope = (TORQUE[i + 1] - TORQUE[i]) / (SPEED[i + 1] - SPEED[i])
    return [u[0] - 0.01 * (TORQUE[i] + slope * (x[0] - SPEED[i])), -x[1]]


@engineered(2)
def bilinear_table(t, x, u, params):
    i = min(max(int(np.searchsorted(SPEED, x[0], side="right")) - 1, 0), 3)
    j = min(max(int(np.searchsorted(PITCH, x[1], side="right")) - 1, 0), 2)
    a = (x[0] - SPEED[i]) / (SPEED[i + 1] - SPEED[i])
    b = (x[1] - PITCH[j]) / (PITCH[j + 1] - PITCH[j])
    low = CP[i, j] * (1 - b) + CP[i, j + 1] * b
    high = CP[i + 1, j] * (1 - b) + CP[i + 1, j + 1] * b
    return [low * (1 - a) + high * a - x[0], u[0] - x[1]]


@engineered(1)
def gear_by_digitize(t, x, u, params):
    ratios = np.array([3.5, 2.1, 1.4, 1.0])
    gear = np.digitize(x[0], [10.0, 20.0, 30.0])
    return [u[0] * ratios[gear] - 0.1 * x[0]]


@engineered(1)
def gear_by_bisect(t, x, u, params):
    gear = bisect_right([10.0, 20.0, 30.0], x[0])
    return [u[0] * (3.5, 2.1, 1.4, 1.0)[gear] - 0.1 * x[0]]


@engineered(2)
def cubic_spline(t, x, u, params):
    return [x[1], u[0] - 0.01 * float(DRAG(x[0])) - x[1]]


@engineered(2)
def slope_of_a_spline(t, x, u, params):
    return [x[1], u[0] - DRAG(x[0], 1) - x[1]]


@engineered(2)
def pchip(t, x, u, params):
    return u[0] - 0.01 * LIFT(x)


@engineered(1)
def b_spline(t, x, u, params):
    return [u[0] - 0.01 * ROAD(x[0])]


@engineered(1)
def b_spline_of_its_knots(t, x, u, params):
    return [u[0] - STEPS(np.clip(x[0], 3.0, 4.0))]


@engineered(1)
def piecewise_polynomial(t, x, u, params):
    return [u[0] - TWO(x[0])]


@engineered(1)
def polynomial_by_polyval(t, x, u, params):
    return [np.polyval([-0.1, 0.0, 1.0, 0.5], x[0]) + u[0]]


@engineered(3)
def polynomial_of_states(t, x, u, params):
    return -np.polyval([0.1, 1.0, 0.0], x) + u[0]


@engineered(1, p=np.array([0.1, 1.0, 0.0]))
def polynomial_with_parameters(t, x, u, params):
    return [u[0] - np.polynomial.polynomial.polyval(x[0], params["p"])]


@engineered(1)
def polynomial_object(t, x, u, params):
    p = np.poly1d([0.1, 0.0, 1.0, 0.0])
    return [u[0] - p(x[0])]


@engineered(2)
def features_by_vander(t, x, u, params):
    return np.vander(x, 3) @ np.array([-0.1, -1.0, 0.2]) + u[0]


@engineered(1)
def look_up_by_rounding(t, x, u, params):
    table = np.linspace(0.0, 1.0, 5) ** 2
    k = int(np.clip(np.round(x[0]), 0, 4))
    return [u[0] - table[k] - 0.1 * x[0]]


@engineered(1)
def look_up_by_floor(t, x, u, params):
    table = np.linspace(0.0, 1.0, 5) ** 2
    k = np.clip(np.floor(x[0]).astype(int), 0, 4)
    return [u[0] - table[k] - 0.1 * x[0]]
