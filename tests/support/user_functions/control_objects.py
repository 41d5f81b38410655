"""python-control's own objects within functions."""

import control as ct
import numpy as np

from ._entry import entry, pieces


def linear(n):
    """Return a linear system with n states and two inputs."""
    A = -np.eye(n) + 0.3 * np.eye(n, k=1)
    return ct.ss(A, np.ones((n, 2)), np.eye(1, n), np.zeros((1, 2)), name="inner")


@entry(discrete=True)
def matrices_of_a_system(n):
    sys = linear(n)

    def update(t, x, u, params):
        return sys.A @ x + sys.B @ u

    def output(t, x, u, params):
        return sys.C @ x + sys.D @ u

    return pieces(update, output, states=n)


@entry
def dynamics_of_a_linear_system(n):
    sys = linear(n)

    def update(t, x, u, params):
        return sys.dynamics(t, x, u) * 2

    def output(t, x, u, params):
        return sys.output(t, x, u)

    return pieces(update, output, states=n)


@entry
def dynamics_of_a_nonlinear_system(n):
    inner = ct.nlsys(
        lambda t, x, u, params: -params["k"] * x**3 + u[0],
        lambda t, x, u, params: x[0] ** 2,
        inputs=1,
        outputs=1,
        states=n,
        params={"k": 0.5},
        name="inner",
    )

    def update(t, x, u, params):
        return inner.dynamics(t, x, u[:1]) + inner.output(t, x, [0.0])

    return pieces(update, states=n)


@entry
def dynamics_with_parameters_passed_on(n):
    inner = ct.nlsys(
        lambda t, x, u, params: -params["k"] * x, None, inputs=0, states=n, params={"k": 0.5}
    )

    def update(t, x, u, params):
        return inner.dynamics(t, x, [], params) + inner.dynamics(t, x, [], {"k": 3.0})

    return pieces(update, states=n, k=1.4)


@entry
def update_function_of_a_system(n):
    inner = ct.nlsys(lambda t, x, u, params: -x + u[0], None, inputs=1, states=n)

    def update(t, x, u, params):
        return inner.updfcn(t, x, u, params) * inner.nstates + inner.ninputs

    return pieces(update, states=n)


@entry
def state_feedback_with_lqr(n):
    sys = linear(n)
    K, _, _ = ct.lqr(sys, np.eye(n), np.eye(2))

    def update(t, x, u, params):
        v = np.clip(u - K @ x, -1, 1)
        return sys.A @ x + sys.B @ v

    return pieces(update, states=n)


@entry
def observer_by_hand(n):
    sys = linear(n)
    L = np.ones((n, 1)) * 0.5

    def update(t, xhat, u, params):
        y = np.array([u[1]])
        return sys.A @ xhat + sys.B[:, [0]] @ u[[0]] + L @ (y - sys.C @ xhat)

    return pieces(update, states=n)


@entry
def frequency_response_at_a_constant(n):
    sys = linear(n)

    def update(t, x, u, params):
        return -x * abs(sys(1j)[0, 0]) + sys.dcgain()[0, 0]

    return pieces(update, states=n)


@entry
def a_linear_system_as_a_nonlinear_one(n):
    sys = linear(n)
    return pieces(
        lambda t, x, u, params: sys._rhs(t, x, u), lambda t, x, u, params: sys._out(t, x, u),
        states=n)  # fmt: skip


@entry
def linearised_within(n):
    sys = ct.nlsys(lambda t, x, u, params: np.sin(x) - u[0], None, inputs=1, states=n)

    def update(t, x, u, params):
        return ct.linearize(sys, np.zeros(n), [0.0]).A @ x + u[0]

    return pieces(update, states=n)
