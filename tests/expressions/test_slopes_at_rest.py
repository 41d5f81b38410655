"""Derivatives at the points where engineers linearize: at roots, at rest, behind limits."""

import control as ct
import numpy as np
import pytest
from scipy import optimize
from scipy.spatial.transform import Rotation

import nlctl


def linearized(function, x, states=1):
    """The matrix of dx/dt = f(x) at a point."""
    system = ct.nlsys(lambda t, x, u, p: function(x), None, inputs=0, outputs=states,
                      states=states, name="s")  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    return compiled.linearize(x).A


SEARCHES = {
    "brentq": lambda x: optimize.brentq(lambda z: z**3 + 2 * z - x, -5.0, 5.0),
    "brentq, at an end": lambda x: optimize.brentq(lambda z: z**3 + 2 * z - x, 0.0, 5.0),
    "tangents": lambda x: optimize.newton(lambda z: z**3 + 2 * z - x, 0.0, lambda z: 3 * z * z + 2),
    "secants": lambda x: optimize.newton(lambda z: z**3 + 2 * z - x, 0.0),
    "fsolve": lambda x: optimize.fsolve(lambda z: z**3 + 2 * z - x, 0.0)[0],
    "root": lambda x: optimize.root(lambda z, a: z**3 + 2 * z - a, [0.5], args=(x,)).x[0],
    "far secants": lambda x: optimize.root_scalar(lambda z: z**3 + 2 * z - x, x0=0.0, x1=2.0).root,
}


@pytest.mark.weekly
@pytest.mark.parametrize("x", [0.0, 3.0, 12.0])
@pytest.mark.parametrize("name", SEARCHES)
def test_roots_have_the_slope_of_what_is_zero_there(name, x):
    """dz/dx = 1 / (3 z^2 + 2), also where a search begins at the root and ends at once."""
    z = {0.0: 0.0, 3.0: 1.0, 12.0: 2.0}[x]  # of z^3 + 2 z
    slope = linearized(lambda v: [SEARCHES[name](v[0])], [x])
    assert slope[0, 0] == pytest.approx(1 / (3 * z * z + 2), rel=1e-9)


def test_rotations_have_slopes_at_rest():
    """exp and log of a small rotation are the identity to first order."""
    log = lambda x: Rotation.from_rotvec(x).as_rotvec()  # noqa: E731
    assert linearized(log, np.zeros(3), 3) == pytest.approx(np.eye(3))
    quat = lambda x: Rotation.from_rotvec(x).as_quat()[:3]  # noqa: E731
    assert linearized(quat, np.zeros(3), 3) == pytest.approx(np.eye(3) / 2)
    error = lambda x: (Rotation.from_rotvec(x) * Rotation.from_rotvec(-x)).as_rotvec()  # noqa: E731
    assert linearized(error, np.zeros(3), 3) == pytest.approx(np.zeros((3, 3)))


LIMITED = {
    "maximum": lambda x: [-np.sqrt(2 * 9.81 * np.maximum(x[0], 0.0) / 3.0)],
    "max": lambda x: [-np.sqrt(2 * 9.81 * max(x[0], 0.0) / 3.0)],
    "clip": lambda x: -(np.clip(x, 0.0, None) ** 0.5) * np.sqrt(6.54),
    "where": lambda x: -np.sqrt(6.54 * np.where(x > 0, x, 0.0)),
}


@pytest.mark.parametrize("name", LIMITED)
def test_what_stands_still_behind_a_limit_has_the_slope_0(name):
    """An outflow sqrt(2 g h / 3) of a level below the ground, as steep as the root is at 0."""
    assert linearized(LIMITED[name], [-0.5])[0, 0] == 0.0
    assert linearized(LIMITED[name], [2.0])[0, 0] == pytest.approx(-np.sqrt(6.54) / np.sqrt(8))


def test_a_root_of_what_does_not_move_is_steep_and_not_flat():
    """|x| as sqrt(x^2) has no slope at 0: NaN, not 0."""
    assert np.isnan(linearized(lambda x: [np.sqrt(x[0] ** 2)], [0.0])[0, 0])
