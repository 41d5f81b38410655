"""Numbers: powers, remainders, roundings, functions at and beyond their domain."""

import cmath
import math
from math import atan2, copysign, pi, sqrt

import numpy as np

from ._entry import entry, pieces


@entry
def powers(n):
    def update(t, x, u, params):
        return x**2 - x**3 + abs(x) ** 0.5 + (x**2 + 1) ** -1 + (x**2 + 1) ** (-1.5) + 2.0 ** u[0]

    return pieces(update, states=n)


@entry
def fractional_power_of_a_negative(n):
    """NaN of a NumPy number, complex of a float."""

    def update(t, x, u, params):
        return -x + x[0] ** 0.5 + u[0] ** 2.5

    return pieces(update, states=n)


@entry
def power_of_the_state(n):
    def update(t, x, u, params):
        return (1 + x**2) ** u[0] + np.power(np.abs(x), params["n"]) + pow(u[1], 2)

    return pieces(update, states=n, n=1.7)


@entry
def modular_power(n):
    def update(t, x, u, params):
        return -x + pow(3, 4, 5) + 2**n % 7 + (-7) // 2 + (-7) % 3

    return pieces(update, states=n)


@entry(discrete=True)
def floor_division(n):
    def update(t, x, u, params):
        return x // 0.3 - x % 0.3 + u[0] // 1 - (-u[1]) % params["m"]

    return pieces(update, states=n, m=0.7)


@entry
def floor_division_by_negative(n):
    def update(t, x, u, params):
        return x % -0.4 + x // -0.4 + np.mod(x, -2.0) + np.fmod(x, -2.0) + np.remainder(u[0], 2)

    return pieces(update, states=n)


@entry
def divmod_of_angles(n):
    def update(t, x, u, params):
        turns, angle = divmod(x[0], 2 * pi)
        q, r = np.divmod(x, 1.5)
        return q - r + turns * 0.1 + angle

    return pieces(update, states=n)


@entry
def division_by_zero(n):
    """Infinite or NaN of NumPy numbers."""

    def update(t, x, u, params):
        return x / (x - x) + 1 / u[0]

    return pieces(update, states=n)


@entry
def division_by_a_python_zero(n):
    """float() of an input that may be 0: Python raises, so nothing may come out in silence."""

    def update(t, x, u, params):
        return -x + 1.0 / float(u[0])

    return pieces(update, states=n)


@entry
def root_of_a_negative(n):
    """math.sqrt raises where np.sqrt gives NaN."""

    def update(t, x, u, params):
        return np.sqrt(x) + sqrt(u[0])

    return pieces(update, states=n)


@entry
def logarithms(n):
    def update(t, x, u, params):
        a = abs(u[0]) + 0.1
        return -x + math.log(a) + math.log(a, 3) + math.log10(a) + math.log2(a) + math.log1p(a)

    return pieces(update, states=n)


@entry
def logarithm_beyond_its_domain(n):
    def update(t, x, u, params):
        return np.log(x) + math.log(u[0])

    return pieces(update, states=n)


@entry
def arc_sine_beyond_its_domain(n):
    def update(t, x, u, params):
        return np.arcsin(x) + math.acos(u[1])

    return pieces(update, states=n)


@entry
def exponential_overflow(n):
    """np.exp gives inf, math.exp raises OverflowError."""

    def update(t, x, u, params):
        return np.exp(x) - math.exp(u[0])

    return pieces(update, states=n)


@entry
def trigonometry(n):
    def update(t, x, u, params):
        a = np.sin(x) * np.cos(u[0]) + np.tan(0.1 * x) + np.arctan2(x, u[1])
        return a + atan2(u[0], u[1]) + math.radians(u[0]) + np.deg2rad(x) + np.sinc(x)

    return pieces(update, states=n)


@entry
def hyperbolic(n):
    def update(t, x, u, params):
        s = np.clip(x, -5, 5)
        return np.tanh(x) + np.sinh(s) - np.cosh(s) + np.arcsinh(x) + math.tanh(u[0])

    return pieces(update, states=n)


@entry
def unwrapped_angle(n):
    def update(t, x, u, params):
        e = (x - u[0] + math.pi) % (2 * math.pi) - math.pi
        return -e + math.atan2(math.sin(x[0]), math.cos(x[0])) + np.unwrap(np.tanh(x))

    return pieces(update, states=n)


@entry
def roundings(n):
    def update(t, x, u, params):
        a = np.floor(x) + np.ceil(x) + np.round(x, 1) + np.rint(x) + np.trunc(x) + np.fix(x)
        return a + round(u[0]) + round(u[1], 2) + math.floor(u[0]) + math.ceil(u[1]) + int(u[0])

    return pieces(update, states=n)


@entry
def round_half_to_even(n):
    def update(t, x, u, params):
        return -x + round(u[0] * 2) / 2 + np.round(x * 2) / 2 + math.trunc(u[1])

    return pieces(update, states=n)


@entry
def signs(n):
    def update(t, x, u, params):
        a = np.sign(x) + np.copysign(1.0, x) + np.heaviside(x, 0.5) + np.signbit(x)
        return a + copysign(2.0, u[0]) + math.fabs(u[1]) + np.abs(u).sum()

    return pieces(update, states=n)


@entry
def sign_by_comparison(n):
    def update(t, x, u, params):
        v = float(u[0])
        s = (v > 0) - (v < 0)
        return -params["k"] * s * np.ones(n) + ((x > 0) * 1 - (x < 0) * 1)

    return pieces(update, states=n, k=0.5)


@entry
def special_values(n):
    def update(t, x, u, params):
        return np.where(x > 0, math.inf, x) * math.e - math.tau + np.pi + np.euler_gamma

    return pieces(update, states=n)


@entry
def error_functions(n):
    def update(t, x, u, params):
        return -x + math.erf(u[0]) + math.erfc(u[1]) + math.gamma(2.5) + math.lgamma(3.5)

    return pieces(update, states=n)


@entry
def gaussians_and_logistics(n):
    def update(t, x, u, params):
        g = np.exp(-(((x - params["c"]) / params["w"]) ** 2))
        s = 1 / (1 + np.exp(-u[0]))
        return g * s + np.expm1(-np.abs(x)) + np.logaddexp(x, 0.0)

    return pieces(update, states=n, c=0.2, w=1.5)


@entry
def complex_square_root(n):
    def update(t, x, u, params):
        z = cmath.sqrt(x[0])
        return -x + z.real - z.imag + abs(complex(u[0], u[1]))

    return pieces(update, states=n)


@entry
def integer_functions(n):
    def update(t, x, u, params):
        return -x + math.factorial(4) + math.comb(5, 2) + math.gcd(12, 18) + (n << 1) + (5 & 3)

    return pieces(update, states=n)


@entry
def cube_root_and_friends(n):
    def update(t, x, u, params):
        return np.cbrt(x) + np.square(x) + np.reciprocal(1 + x**2) + np.hypot(x, u[0]) + +x - -x

    return pieces(update, states=n)


@entry
def float_methods(n):
    def update(t, x, u, params):
        whole = float(n).is_integer()
        return -x + x[0].real + x[0].imag + whole + x[1].conjugate() + abs(float(u[0]))

    return pieces(update, states=n)


@entry
def frexp_and_modf(n):
    def update(t, x, u, params):
        fraction, whole = math.modf(u[0])
        m, e = math.frexp(u[1])
        parts = np.modf(x)
        return parts[0] - parts[1] + fraction - whole + math.ldexp(m, e)

    return pieces(update, states=n)


@entry
def subtle_cancellation(n):
    """(a + b) - a is not b: no formula may be rearranged."""

    def update(t, x, u, params):
        return ((x + 1e8) - 1e8) * u[0] + (0.1 + 0.2) - 0.3 + (x * 3) / 3 - x

    return pieces(update, states=n)


@entry
def negative_zero(n):
    def update(t, x, u, params):
        z = u[0] * 0.0
        return x + math.atan2(z, -1.0) + np.arctan2(-0.0 * x, -1.0)

    return pieces(update, states=n)
