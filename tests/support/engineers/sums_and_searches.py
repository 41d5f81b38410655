"""Integrals, roots and special functions of states; polynomials, complex equations, bands."""

import cmath
import math
import warnings

import numpy as np
from numpy.polynomial import chebyshev, legendre
from scipy import integrate, interpolate, linalg, optimize, special

from engineers.entry import engineered


@engineered(2)
def heat_of_a_profile(t, x, u, params):
    heat, error = integrate.quad(lambda s: np.exp(-(s**2)) * np.tanh(x[0]), 0, 1)
    return [-heat, -x[1] + 0 * error]


@engineered(2)
def travel_between_states(t, x, u, params):
    a, b = math.tanh(x[0]), 1 + math.tanh(x[1])
    return [integrate.quad(lambda s, k: math.cos(k * s), a, b, args=(2.0,))[0], -x[1]]


@engineered(1)
def gauss_of_five(t, x, u, params):
    return [-integrate.fixed_quad(lambda s: np.sin(s + x[0]), 0, 1, n=5)[0]]


@engineered(1)
def root_between_brackets(t, x, u, params):
    found = optimize.root_scalar(lambda z: z**3 + z - math.tanh(x[0]), bracket=[-2, 2])
    return [-found.root if found.converged else 0.0]


@engineered(1)
def root_scalar_by_tangents(t, x, u, params):
    slope = lambda z: 1 + 0.5 * math.cos(z)  # noqa: E731
    found = optimize.root_scalar(
        lambda z: z + 0.5 * math.sin(z) - x[0], x0=0.8 * x[0], fprime=slope, method="newton"
    )
    return [-found.root]


@engineered(1)
def diode_with_a_resistor(t, x, u, params):
    w = special.lambertw(1e-6 * np.exp(np.clip(x[0], -1, 1) / 0.026)).real
    return [-0.026 * w]


@engineered(4, 1)
def phasors_of_two_windings(t, x, u, params):
    i = np.array([x[0] + 1j * x[1], x[2] + 1j * x[3]])
    inductances = np.array([[0.3, 0.28 + 0.01j], [0.28, 0.3]])
    change = np.linalg.solve(inductances, u[0] - 0.5 * i)
    return [change[0].real, change[0].imag, change[1].real, change[1].imag]


@engineered(2)
def cubic_by_cardano(t, x, u, params):
    p, q = 1 + abs(x[0]), x[1]
    c = (-q / 2 + cmath.sqrt((q / 2) ** 2 + (p / 3) ** 3)) ** (1 / 3)
    return [-x[0], -(c - p / (3 * c)).real]


@engineered(3)
def rod_by_its_diagonals(t, x, u, params):
    bands = np.array([[0, 1.0, 1.0], [4.0, 4.0 + x[0] ** 2, 4.0], [1.0, 1.0, 0]])
    return -linalg.solve_banded((1, 1), bands, x)


@engineered(2)
def series_of_polynomials(t, x, u, params):
    z = np.tanh(x)
    return [-chebyshev.chebval(z[0], [0, 1, 2, -0.5]), -legendre.legval(z[1], [0.1, 1, 0.3, 0.2])]


@engineered(2)
def stretch_by_singular_values(t, x, u, params):
    large, small = np.linalg.svd(np.array([[1.0, x[0]], [0.3, 2.0]]), compute_uv=False)
    return [-large * x[0], -small * x[1]]


NEAREST, PREVIOUS, NEXT = (
    interpolate.interp1d([0, 1, 2, 4], [0.0, 2.0, 1.0, 4.0], kind=kind, bounds_error=False,
                         fill_value=(-1.0, 9.0))
    for kind in ("nearest", "previous", "next")
)  # fmt: skip


@engineered(3)
def steps_of_a_table(t, x, u, params):
    return [-float(f(value)) for f, value in zip((NEAREST, PREVIOUS, NEXT), x)]


@engineered(3)
def ranks_as_places(t, x, u, params):
    order = np.argsort(x)
    change = np.empty(3)
    change[order] = -np.take(x, order) * np.arange(1, 4)
    return change


@engineered(2, 1)
def without_warnings(t, x, u, params):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        root = np.sqrt(np.abs(x))
    return -root * np.sign(x) + u
