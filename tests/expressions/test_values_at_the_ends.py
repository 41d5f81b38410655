"""Functions next to zeros, at signs of zeros and at numbers that are very large: as called."""

import cmath
import math
import statistics

import control as ct
import numpy as np
import pytest
import scipy.fft
import scipy.interpolate
import scipy.linalg
import scipy.optimize
from scipy import special

import nlctl

PLACES = [0.0, -0.0, 1.0, -1.0, 0.5, -2.5, 3.0, 20.0, 1e-12, 1e8, -1e8, 1e16, 1e154, -1e155, 1e300,
          -1e300, 170.5, 709.5, 710.0, np.inf, -np.inf, np.nan]  # fmt: skip
TURNS = np.linspace(0.0, 1.0, 5)
CLOSED = scipy.interpolate.CubicSpline(TURNS, [0.0, 1.0, 3.0, -1.0, 0.0], bc_type="periodic")
COILED = scipy.interpolate.make_interp_spline(TURNS, [0.0, 1.0, 3.0, -1.0, 0.0], bc_type="periodic")
HALF = np.vectorize(lambda v, width=2.0: math.copysign(width, v) + v, otypes=[float])
ONE = {
    "angle of a real number": lambda a, b: np.angle(a),
    "angle of an imaginary number": lambda a, b: np.angle(1j * a),
    "angle turned backwards": lambda a, b: np.angle(-1j * a),
    "angle of a sum": lambda a, b: np.angle(a + 1j * b),
    "Python's phase": lambda a, b: cmath.phase(1j * complex(a)),
    "imaginary part": lambda a, b: np.copysign(1.0, np.imag(a)),
    "root on its cut": lambda a, b: np.sqrt(a + 1j * b).imag,
    "root of a real number": lambda a, b: np.sqrt(a + 0j).imag,
    "logarithm on its cut": lambda a, b: np.log(a + 1j * b).imag,
    "quotient": lambda a, b: ((a + 1j) / (b + 2j)).real,
    "quotient by an imaginary number": lambda a, b: ((a + 1j * b) / (b * 1j + 3.0)).imag,
    "inverse": lambda a, b: (1.0 / (a + 1j * b)).imag,
    "inverse square": lambda a, b: ((np.tanh(a) + 1j) ** -2).real,
    "inverse root": lambda a, b: ((a + 3j) ** -0.5).imag,
    "exponential of what is large": lambda a, b: np.exp(a + 1j * b).real,
    "waves of complex numbers": lambda a, b: (np.sin(a + 2j) * np.cosh(1.0 + 1j * b)).imag,
    "other waves": lambda a, b: (np.cos(a + 2j) * np.sinh(1.0 + 1j * b)).real,
    "saturation of complex numbers": lambda a, b: np.tanh(a + 1j * b).imag,
    "gamma": lambda a, b: special.gamma(a),
    "Python's gamma": lambda a, b: math.gamma(a),
    "gammaln": lambda a, b: special.gammaln(a),
    "lgamma": lambda a, b: math.lgamma(a),
    "betaln": lambda a, b: special.betaln(a, b),
    "beta": lambda a, b: special.beta(a, 2.5),
    "eigenvalues far apart": lambda a, b: np.linalg.eigvalsh([[a, 1.0], [1.0, b]])[0],
    "singular values far apart": lambda a, b: np.linalg.svd([[a, 0.0], [0.0, b]])[1][1],
    "smooth Huber": lambda a, b: special.pseudo_huber(a, b),
    "elliptic integral": lambda a, b: special.ellipe(a),
    "distance": lambda a, b: math.dist([a, 1.0], [b, 2.0]),
    "exact sum": lambda a, b: math.fsum([a, 1.0, b, -a, 0.1]),
    "mean of what cancels": lambda a, b: statistics.mean([a, 1.0, -a]),
    "quick mean of what cancels": lambda a, b: statistics.fmean([a, b, -a]),
    "a table with a period": lambda a, b: np.interp(a, [-1.0, 0.5, 4.0], [1.0, 2.0, b], period=6.0),
}  # fmt: skip
ROWS = {
    "a norm of its own": lambda x: np.linalg.norm(x, 3),
    "how many are not 0": lambda x: np.linalg.norm(x, 0),
    "spread without NaN": lambda x: np.nanstd(np.where(x > 1.0, np.nan, x)),
    "spread of what is chosen": lambda x: x[x > 0].std() if np.any(x > 0) else 0.0,
    "extreme of what is chosen": lambda x: np.max(x, where=x < 1.0, initial=-1.0),
    "a closed spline": lambda x: CLOSED(x[0]) + CLOSED(x[1], 1),
    "a coiled spline": lambda x: COILED(x[0]) - COILED(x[1]),
    "names of a vectorized function": lambda x: np.sum(HALF(x) + HALF(x[0], width=x)),
    "a cosine transform": lambda x: scipy.fft.dct(x, norm="ortho")[1] + scipy.fft.idst(x)[0],
    "a power below 0": lambda x: np.linalg.matrix_power(_regular(x), -3)[0, 1],
    "eigenvalues by SciPy": lambda x: scipy.linalg.eigvals(_regular(x)).real.sum(),
    "factors": lambda x: scipy.linalg.lu_solve(scipy.linalg.lu_factor(_regular(x)), x[:2])[0],
    "factors turned": lambda x: scipy.linalg.lu_solve(
        scipy.linalg.lu_factor(_regular(x)), x[:2], trans=1)[1],
    "least squares by SciPy": lambda x: scipy.linalg.lstsq(_tall(x), x)[0][0],
    "Halley's method": lambda x: scipy.optimize.newton(
        lambda y: y**3 + 2 * y - x[0], 0.0, fprime=lambda y: 3 * y**2 + 2, fprime2=lambda y: 6 * y),
    "a root with its report": lambda x: scipy.optimize.brentq(
        lambda y, k: y + k * y**3 - np.tanh(x[0]), -2.0, 2.0, args=2.0, full_output=True)[0],
    "value and slope at once": lambda x: scipy.optimize.root_scalar(
        lambda y: (y + np.exp(y) - np.tanh(x[0]), 1.0 + np.exp(y)), x0=0.0, fprime=True).root,
    "Halley's method by name": lambda x: scipy.optimize.root_scalar(
        lambda y: y + y**3 - x[1], x0=0.5, fprime=lambda y: 1 + 3 * y**2,
        fprime2=lambda y: 6 * y)["root"],
}  # fmt: skip


def _regular(x):
    return np.array([[2.0 + x[0] ** 2, 0.5], [np.tanh(x[1]), 3.0]])


def _tall(x):
    return np.array([[1.0, x[0]], [1.0, x[1]], [2.0, 2.5]])


def _compared(function, states, points):
    """Assert that a traced function gives what Python does, or NaN where that is an error."""
    rest = np.zeros(states - 1)
    system = ct.nlsys(lambda t, x, u, p: np.append(function(x), rest), None,
                      states=states, inputs=1, outputs=states)  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    for x in np.array(points, dtype=float):
        computed = compiled.dynamics(0.0, x, [0.0])[0]
        try:
            expected = function(x)
        except (ArithmeticError, ValueError):
            assert not np.isfinite(computed), x
            continue
        if not (np.isnan(computed) and not np.isfinite([*x, expected]).all()):
            np.testing.assert_allclose(computed, expected, rtol=1e-12, atol=1e-13, err_msg=f"{x}")


@pytest.mark.parted
@pytest.mark.parametrize("name", ONE)
@pytest.mark.filterwarnings("ignore")
def test_numbers_at_the_ends(name):
    function = ONE[name]
    _compared(lambda x: function(x[0], x[1]), 2, [(a, b) for a in PLACES for b in PLACES[:9]])


@pytest.mark.parted
@pytest.mark.parametrize("name", ROWS)
@pytest.mark.filterwarnings("ignore")
def test_rows(name):
    rows = np.random.default_rng(3).normal(size=(12, 3))
    _compared(ROWS[name], 3, [*rows, np.ones(3), 2.0 * np.ones(3)])
