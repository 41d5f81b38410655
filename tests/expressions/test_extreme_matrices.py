"""Matrices and data that are not finite, or whose products are not: a choice does not hide it."""

import control as ct
import numpy as np
import pytest
from scipy import signal
from user_function_checks import Plain, Points

import nlctl

WEIGHTS = np.array([[1.0, 1, 1, 1], [1, -1, 1, -1], [0.5, 0.5, -0.5, -0.5]])
SECTIONS = signal.butter(2, 0.3, output="sos")
CLIPPED = {
    "lstsq": (lambda x: np.linalg.lstsq(WEIGHTS, x, rcond=None)[0][:3], 3),
    "lstsq of the state": (
        lambda x: np.linalg.lstsq(np.diag(2.0 + np.tanh(x)), x, rcond=None)[0], 2),
    "sosfilt": (lambda x: signal.sosfilt(SECTIONS, x), 4),
    "lfilter": (lambda x: signal.lfilter([1.0, 0.5], [1.0, -0.2], x), 4),
}  # fmt: skip


def computed(function, x):
    """Return what the traced function and python-control's own make of columns."""
    n = len(x)
    system = ct.nlsys(lambda t, x, u, p: function(x), None, inputs=0, outputs=n, states=n,
                      name="s")  # fmt: skip
    plain = Plain(nlctl.compile(system))
    assert not plain.compiled.equations.calls
    points = x.shape[1]
    found, _ = plain.run(Points(np.zeros(points), x, np.empty((0, points))))
    return found, np.array([own(system, column) for column in x.T]).T


def own(system, x):
    """Return python-control's own value, NaN where it raises an error."""
    try:
        return system.dynamics(0.0, x, [])
    except np.linalg.LinAlgError:
        return np.full(x.size, np.nan)


@pytest.mark.parametrize("bad", [np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("name", CLIPPED)
@pytest.mark.filterwarnings("ignore")
def test_what_is_not_finite_is_not_clipped_away(name, bad):
    """Where python-control has NaN there is no number."""
    function, n = CLIPPED[name]
    x = np.tile(np.linspace(0.3, 0.7, n)[:, None], n + 1)
    x[np.arange(n), np.arange(1, n + 1)] = bad
    found, wanted = computed(lambda x: np.clip(function(x), -0.5, 0.5), x)
    assert found[:, 0] == pytest.approx(wanted[:, 0], rel=1e-12)
    assert np.all(np.isnan(found) | (found == wanted) | np.isclose(found, wanted, rtol=1e-12))


@pytest.mark.parametrize("power", [0, 100, 200, -100, -200])
@pytest.mark.filterwarnings("ignore")
def test_determinants_beyond_the_range_of_numbers(power):
    """Logarithms are exact there; a determinant is the number or NaN, never 0 or infinity."""
    x = np.array([[1.0, 2.0], [3.0, 0.5], [0.25, 4.0]]) * 10.0**power

    def matrix(x, z):
        return np.diag([x[0], x[1], z]) + 0.1 * x[0] * np.triu(np.ones((3, 3)), 1)

    found, wanted = computed(lambda x: np.resize(np.linalg.slogdet(matrix(x, x[2])), 3), x)
    assert found == pytest.approx(wanted, rel=1e-12)
    found, wanted = computed(lambda x: np.linalg.det(matrix(x, 1.0 / x[2])) * np.ones(3), x)
    assert np.all(np.isnan(found) | np.isclose(found, wanted, rtol=1e-11))
    assert abs(power) > 100 or np.isfinite(found).all()
