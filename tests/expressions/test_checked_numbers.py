"""What libraries check of their numbers: where they raise an error there is NaN, and not a number.

Equal elements have no order of their own: where NumPy mixes them, a function is called.
"""

import itertools

import control as ct
import numpy as np
import pytest
from scipy import interpolate, linalg
from user_function_checks import Plain, Points

import nlctl

NEAR = interpolate.NearestNDInterpolator(np.array([[0.0, 0], [1, 1], [0, 1]]), [1.0, 2.0, 3.0])


def upper(a):
    return np.array([[3.0, a], [0.0, 2.0]])


CHECKED = {
    "eigvals": lambda x: np.linalg.eigvals(upper(x[0])).real,
    "solve_triangular": lambda x: linalg.solve_triangular(upper(x[0]), np.ones(2))[1] * np.ones(2),
    "cholesky": lambda x: linalg.cholesky(np.array([[4.0, 1.0], [x[0], 9.0]]))[1],
    "qr": lambda x: linalg.qr(upper(x[0]))[1][0, 0] * np.ones(2),
    "cho_solve": lambda x: linalg.cho_solve(linalg.cho_factor(np.eye(2)), [1.0, x[0]])[:1] + x * 0,
    "lu_solve": lambda x: linalg.lu_solve(linalg.lu_factor(np.eye(2)), np.array([1.0, x[0]])),
    "nearest": lambda x: NEAR(x) * np.ones(2),
}


def loop(function, states=2):
    return ct.nlsys(lambda t, x, u, p: function(x), None, inputs=0, outputs=states, states=states,
                    name="s")  # fmt: skip


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("name", CHECKED)
@pytest.mark.filterwarnings("ignore")
def test_numbers_that_are_not_finite_stay_so(name, bad):
    """Both libraries raise an error, of which the traced function makes NaN."""
    system = loop(lambda x: CHECKED[name](np.where(x > 0.8, bad, x)))
    plain, fine = Plain(nlctl.compile(system)), np.array([0.3, 0.7])
    assert not plain.compiled.equations.calls
    at = Points(np.zeros(2), np.array([fine, [0.9, 0.7]]).T, np.empty((0, 2)))
    found, _ = plain.run(at)
    assert found[:, 0] == pytest.approx(system.dynamics(0.0, fine, []), rel=1e-12)
    with pytest.raises((ValueError, np.linalg.LinAlgError)):
        system.dynamics(0.0, [0.9, 0.7], [])
    assert not np.isfinite(found[:, 1]).all()


@pytest.mark.parametrize("structure", ["pos", "sym"])
def test_half_of_a_matrix_is_read_where_it_is_said_to_be_symmetric(structure):
    def function(x):
        return linalg.solve(np.array([[3.0, x[0]], [0.5, 2.0]]), x[::-1] + 1.0, assume_a=structure)

    system, x = loop(function), np.array([0.3, 0.7])
    found = nlctl.compile(system).dynamics(0.0, x)
    assert found == pytest.approx(system.dynamics(0.0, x, []), rel=1e-12)
    whole = np.array([[3.0, 0.3], [0.3, 2.0]])  # by its upper half
    assert whole @ found == pytest.approx(x[::-1] + 1.0)


@pytest.mark.parametrize("kind", [None, "stable"])
def test_equal_elements_are_where_numpy_has_them_or_not_a_number(kind):
    system = loop(lambda x: np.argsort(x, kind=kind) + 0.0 * x, states=4)
    compiled = nlctl.compile(system)
    for x in itertools.product([0.0, 1.0, 2.0], repeat=4):
        found, wanted = compiled.dynamics(0.0, x), system.dynamics(0.0, x, [])
        is_limited = kind is None and len(set(x)) < len(x) and np.isnan(found).all()
        assert is_limited or np.array_equal(found, wanted)


def test_a_long_integer_is_no_endless_recursion():
    compiled = nlctl.compile(loop(lambda x: [x[0] + 2**70, x[1] * 10**25]))
    assert "object" in next(iter(compiled.equations.calls.values())).reason
