"""Linear equations of more than six rows: one operation, with derivative, in every reader."""

import control as ct
import numpy as np
import pytest
import scipy.linalg

import nlctl

ROWS = (7, 8, 9, 13, 20)


def dense(n, seed=0):
    """Rates with a dense matrix that depends on the state, and whose rows must be exchanged."""
    rng = np.random.default_rng(100 * n + seed)
    first, second = rng.normal(size=(2, n, n))
    np.fill_diagonal(first, 0.0)

    def update(t, x, u, params):
        matrix = first + params["k"] * np.outer(np.cos(x), x) + second * u[0]
        return np.linalg.solve(matrix, np.sin(x) - u[0]) - x

    return ct.nlsys(update, None, inputs="u", outputs=n, states=n, name="dense", params={"k": 0.3})


def chain(n):
    """Masses that hang one below the other, as links of an arm: the mass matrix moves."""

    def update(t, x, u, params):
        q, v = x[:n], x[n:]
        mass, rest = np.zeros((n, n)), np.zeros(n)
        for i in range(n):
            for j in range(n):
                below = n - max(i, j)
                mass[i, j] = below * np.cos(q[i] - q[j])
                rest[i] += below * np.sin(q[i] - q[j]) * v[j] ** 2
            mass[i, i] += params["inertia"]
            rest[i] += 9.81 * (n - i) * np.sin(q[i]) + 0.2 * v[i]
        torque = np.zeros(n)
        torque[0] = u[0]
        return np.concatenate([v, np.linalg.solve(mass, torque - rest)])

    return ct.nlsys(update, None, inputs="u", outputs=2 * n, states=2 * n, name="chain",
                    params={"inertia": 0.5})  # fmt: skip


def of_inverse(n):
    """Rates with an inverse and a determinant."""
    rng = np.random.default_rng(n)
    first = rng.normal(size=(n, n))

    def update(t, x, u, params):
        matrix = first + np.outer(x, np.cos(x)) + u[0]
        gain = np.linalg.inv(matrix)
        return gain @ x - x + np.tanh(np.linalg.det(matrix)) * gain[0]

    return ct.nlsys(update, None, inputs="u", outputs=n, states=n, name="inverse")


SYSTEMS = {"dense": dense, "inverse": of_inverse}


def points(system, count=3):
    rng = np.random.default_rng(1)
    return [(0.0, rng.normal(size=system.nstates), rng.normal(size=1)) for _ in range(count)]


@pytest.mark.parametrize("n", ROWS)
@pytest.mark.parametrize("kind", SYSTEMS)
def test_rates_are_those_of_numpy(kind, n):
    """Also where rows are exchanged: the diagonal may be 0."""
    system = SYSTEMS[kind](n)
    compiled = nlctl.compile(system)
    assert "Jacobian     exact\n" in str(compiled)
    for point in points(system):
        wanted = system.dynamics(*point)
        np.testing.assert_allclose(
            compiled.dynamics(*point), wanted, rtol=1e-11, atol=1e-11 * np.abs(wanted).max()
        )


def test_accelerations_of_a_chain_are_those_of_python_control():
    """Well conditioned, to the last digits; no condition is located in it."""
    system = chain(8)
    compiled = nlctl.compile(system)
    for point in points(system, 20):
        wanted = system.dynamics(*point)
        np.testing.assert_allclose(compiled.dynamics(*point), wanted, rtol=1e-12, atol=1e-11)
    assert "conditions" not in str(compiled)


def richardson(function, x):
    """Return the Jacobian matrix by central differences, extrapolated to a step of 0."""

    def differences(h):
        return np.stack(
            [(function(x + h * e) - function(x - h * e)) / (2 * h) for e in np.eye(x.size)], axis=1
        )

    return (4 * differences(5e-4) - differences(1e-3)) / 3


@pytest.mark.parametrize("system", [chain(8), dense(7), dense(13), of_inverse(7), of_inverse(9)],
                         ids=lambda s: f"{s.name}{s.nstates}")  # fmt: skip
def test_a_linearization_is_that_of_differences(system):
    x, u = 0.3 * np.cos(np.arange(system.nstates)), np.array([0.2])
    found = nlctl.compile(system).linearize(x, u)
    for matrix, wanted in (
        (found.A, richardson(lambda v: system.dynamics(0.0, v, u), x)),
        (found.B, richardson(lambda v: system.dynamics(0.0, x, v), u)),
    ):
        np.testing.assert_allclose(matrix, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("method", ["dop853", "rodas5p", "taylor"])
def test_every_method_runs_it(method):
    """The energy of the chain without friction and torque is no different at the end."""
    system, times = chain(8), np.linspace(0.0, 0.5, 6)
    start = np.concatenate([0.4 * np.cos(np.arange(8.0)), np.zeros(8)])
    found = nlctl.input_output_response(
        nlctl.compile(system), times, np.sin(times), start, method=method, rtol=1e-10, atol=1e-12
    )
    wanted = ct.input_output_response(
        system, times, np.sin(times), start,
        solve_ivp_method="DOP853", solve_ivp_kwargs={"rtol": 1e-11, "atol": 1e-13},
    )  # fmt: skip
    np.testing.assert_allclose(found.states, wanted.states, rtol=1e-7, atol=1e-8)
