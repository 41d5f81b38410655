"""``np.matrix`` in equations: at points, what NumPy itself computes, or called as it stands."""

import control as ct
import numpy as np
import pytest

import nlctl

pytestmark = pytest.mark.filterwarnings("ignore::PendingDeprecationWarning")  # NumPy's advice
A, B = np.matrix([[0.0, 1.0], [-2.0, -3.0]]), np.matrix("0.0; 1.0")
POINTS = np.array([[0.0, 0.0], [1.0, -1.0], [0.3, 2.5], [np.nan, 1.0]])


def manipulator(x):
    m = np.matrix([[3 + 2 * np.cos(x[1]), 1 + np.cos(x[1])], [1 + np.cos(x[1]), 1.0]])
    return m.I * np.matrix(x).T


def written_into(x):
    m = np.asmatrix(np.eye(2))
    m[0, 1], m[:, 0] = x[0], np.matrix([[x[1]], [2.0]])
    return m


FUNCTIONS = {
    "products": lambda x: A * np.matrix(x).T + B * x[0] - 0.1 * np.matrix(x).T / 2,
    "powers": lambda x: (A**2) * np.asmatrix(x).T + (A @ np.matrix(x).T),
    "an array first": lambda x: np.array(x) * np.matrix([[1.0, 2.0], [3.0, 4.0]]),
    "a list first": lambda x: [1.0, 2.0] * np.matrix(x).T * np.matrix([1.0, 3.0]),
    "inverse": manipulator,
    "solve": lambda x: np.linalg.solve(A, np.matrix(x).T) + A.H * np.matrix(x).T,
    "parts": lambda x: np.hstack([written_into(x)[:, 0], written_into(x)[1].T]),
    "element by element": lambda x: np.multiply(written_into(x), A) + np.sin(written_into(x)),
    "stacked": lambda x: np.vstack([np.matrix(x), A]).sum(axis=0) - np.matrix(x).reshape(1, 2),
    "rows": lambda x: sum(row * B for row in written_into(x)) * B.T,
    "numbers": lambda x: [written_into(x)[0, 1] + np.linalg.det(written_into(x)),
                          (np.matrix(x) * np.matrix(x).T).item() + written_into(x).A1[2]],
    "shapes": lambda x: [len(A) * x[0], float(written_into(x).shape[1] * A.ndim)],
}  # fmt: skip


@pytest.mark.parted
@pytest.mark.parametrize("name", FUNCTIONS)
def test_matrices_are_those_of_numpy(name):
    function = FUNCTIONS[name]
    system = ct.nlsys(lambda t, x, u, p: np.ravel(np.asarray(function(x)))[:2], None, inputs=0,
                      outputs=2, states=2, name="s")  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    for x in POINTS:
        with np.errstate(invalid="ignore"):
            expected = np.ravel(np.asarray(function(x)))[:2]
        assert compiled.dynamics(0.0, x) == pytest.approx(expected, rel=1e-14, nan_ok=True)


def test_a_matrix_may_be_what_a_function_returns():
    """As ``return A * X + B * u`` does; python-control takes its entries in order."""
    system = ct.nlsys(lambda t, x, u, p: A * np.matrix(x).T + B * u[0], None, inputs=1, outputs=2,
                      states=2, name="s")  # fmt: skip
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    assert compiled.dynamics(0.0, [1.0, 2.0], [3.0]) == pytest.approx([2.0, -5.0], rel=1e-14)


@pytest.mark.parametrize(
    "function",
    [
        lambda x: [np.asmatrix(x).max(), x[0]],
        lambda x: np.maximum(np.matrix(x), 0.5).A1,
        lambda x: np.sort(np.matrix(x)).A1,
    ],
)
def test_what_is_not_known_of_matrices_is_called(function):
    """Python's own order of objects would lose NaN."""
    system = ct.nlsys(lambda t, x, u, p: function(x), None, inputs=0, outputs=2, states=2, name="s")
    assert nlctl.compile(system).equations.calls
