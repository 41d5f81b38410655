"""Elementary functions, special functions, complex numbers."""

import cmath
import math

import numpy as np
from scipy import special
from scipy.special import erf, expit

from engineers.entry import engineered


@engineered(2)
def angles_in_degrees(t, x, u, params):
    return [x[1], -np.sin(np.deg2rad(x[0])) + np.rad2deg(0.01 * u[0])]


@engineered(2)
def radians_and_degrees(t, x, u, params):
    return [np.radians(x[1]), -np.degrees(np.sin(x[0])) + math.radians(u[0]) + math.degrees(x[0])]


@engineered(1)
def sinc(t, x, u, params):
    return [np.sinc(x[0]) - 0.1 * x[0] + u[0]]


@engineered(3)
def reciprocals(t, x, u, params):
    return np.reciprocal(1.0 + x**2) - x + np.square(u[0])


@engineered(1)
def rounded_to_decimals(t, x, u, params):
    return [-np.round(x[0], 2) + np.around(u[0], 1)]


@engineered(3)
def rounded_by_method(t, x, u, params):
    return u[0] - x.round(1)


@engineered(1)
def quantised(t, x, u, params):
    q = 0.25
    return [q * np.round(u[0] / q) - q * np.floor(x[0] / q + 0.5)]


@engineered(2)
def wrapped_angle(t, x, u, params):
    e = (x[0] + np.pi) % (2 * np.pi) - np.pi
    return [x[1], -e - x[1] + u[0]]


@engineered(2)
def divmod_of_angles(t, x, u, params):
    turns, rest = np.divmod(x[0], 2 * np.pi)
    return [x[1], -rest - x[1] + 0.0 * turns]


@engineered(2)
def floor_division(t, x, u, params):
    return [x[1], u[0] - x[0] // 0.5]


@engineered(1)
def sigmoid_by_expit(t, x, u, params):
    return [expit(u[0] * 4) - x[0]]


@engineered(1)
def gaussian_by_erf(t, x, u, params):
    return [erf(u[0]) - x[0]]


@engineered(1)
def erf_of_math(t, x, u, params):
    return [math.erf(x[0]) * -1 + math.erfc(u[0])]


@engineered(2)
def other_special_functions(t, x, u, params):
    return [special.xlogy(x[0] ** 2, 1 + x[1] ** 2) - x[0], special.log1p(x[0] ** 2) - x[1] + u[0]]


@engineered(3)
def softmax(t, x, u, params):
    return special.softmax(x) - x + u[0]


@engineered(3)
def log_of_a_sum(t, x, u, params):
    return u[0] - x * special.logsumexp(x)


@engineered(2)
def float_powers(t, x, u, params):
    return [np.float_power(np.abs(x[0]), 1.5) - x[1], np.power(x[1], 3) * -1 + u[0]]


@engineered(2)
def functions_of_math(t, x, u, params):
    a = math.hypot(x[0], x[1]) + math.fabs(u[0])
    return [math.copysign(a, x[0]) - x[0], math.tanh(x[1]) - math.pow(x[1], 3)]


@engineered(2)
def floors_of_math(t, x, u, params):
    return [math.floor(x[0]) - x[0], math.ceil(x[1]) - math.trunc(u[0]) - x[1]]


@engineered(2)
def distances_of_math(t, x, u, params):
    d = math.dist([x[0], x[1]], [1.0, 2.0])
    return [-x[0] / (1 + d), -x[1] + math.prod([u[0], 2.0]) + math.fsum([x[0], x[1]])]


@engineered(1)
def period_by_fmod(t, x, u, params):
    phase = math.fmod(t, 0.5)
    return [1.0 - x[0] if phase < 0.25 else -x[0]]


@engineered(1)
def remainder_of_math(t, x, u, params):
    return [math.remainder(x[0], 2 * math.pi) * -1 + u[0]]


@engineered(2)
def complex_amplitude(t, x, u, params):
    z = x[0] + 1j * x[1]
    dz = (0.5 + 2j) * z - z * abs(z) ** 2
    return [dz.real, dz.imag]


@engineered(2)
def stuart_landau(t, x, u, params):
    z = complex(x[0], x[1])
    dz = z * (1 - z * z.conjugate()) + u[0]
    return np.array([dz.real, dz.imag])


@engineered(2)
def phasor_by_exponential(t, x, u, params):
    v = np.exp(1j * (x[0] - 0.5)) - np.exp(-1j * x[1])
    return [np.real(v) - x[0], np.imag(v) + u[0]]


@engineered(2)
def angle_of_a_complex_number(t, x, u, params):
    z = x[0] + 1j * x[1]
    return [np.abs(z) - x[0], np.angle(z) - x[1] + u[0]]


@engineered(2)
def polar_by_cmath(t, x, u, params):
    z = cmath.rect(1.0, x[0]) * complex(1.0, u[0])
    return [z.imag, z.real - x[1]]


@engineered(3)
def park_transformation(t, x, u, params):
    abc = np.array([u[0], u[0] * np.exp(-2j * np.pi / 3), u[0] * np.exp(2j * np.pi / 3)])
    dq = (abc * np.exp(-1j * x[2])).mean()
    return [dq.real - x[0], dq.imag - x[1], 1.0]


@engineered(2)
def heavisides(t, x, u, params):
    return [np.heaviside(x[1], 0.5) - x[0], np.sign(u[0]) - x[1]]


@engineered(2)
def signed_square_root(t, x, u, params):
    dh = x[0] - x[1]
    flow = np.sign(dh) * np.sqrt(2 * 9.81 * np.abs(dh))
    return [u[0] - flow, flow - 0.5 * np.sqrt(max(x[1], 0.0))]


@engineered(1)
def maximum_of_several(t, x, u, params):
    return [np.maximum.reduce([x[0], u[0], -1.0]) * -1 + np.add.reduce(x)]
