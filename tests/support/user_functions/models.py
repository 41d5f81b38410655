"""Whole models as they stand in lectures and examples."""

import numpy as np

from ._entry import entry, pieces


def padded(values, x):
    """Return a vector with the given first values, and lags behind them."""
    dx = -np.asarray(x, dtype=float)
    dx[: len(values)] = values
    return dx


@entry(discrete=True)
def pendulum(n):
    def update(t, x, u, params):
        g, l, b = params.get("g", 9.81), params["l"], params["b"]
        theta, omega = x[0], x[1]
        return padded([omega, -g / l * np.sin(theta) - b * omega + u[0]], x)

    return pieces(update, states=n, l=0.5, b=0.1)


@entry
def van_der_pol(n):
    def update(t, x, u, params):
        mu = params["mu"]
        dx = np.roll(x, 1) * 0.0
        dx[0] = x[1]
        dx[1] = mu * (1 - x[0] ** 2) * x[1] - x[0]
        return dx

    return pieces(update, states=n, mu=1.2)


@entry
def lotka_volterra(n):
    def update(t, x, u, params):
        growth = np.linspace(0.5, 1.5, n)
        return x * (growth - x.sum() / n) + u[0] * np.maximum(x, 0)

    return pieces(update, states=n)


@entry
def kinematic_bicycle(n):
    def update(t, x, u, params):
        v = np.clip(u[0], -params["vmax"], params["vmax"])
        phi = np.clip(u[1], -np.pi / 4, np.pi / 4)
        th = x[1]
        return padded([np.cos(th) * v, v / params["wheelbase"] * np.tan(phi)], x)

    return pieces(update, lambda t, x, u, params: x[:2], states=n, outputs=2, vmax=3.0,
                  wheelbase=2.5)  # fmt: skip


@entry
def cruise_control(n):
    def motor_torque(omega, params):
        Tm, wm, beta = params.get("Tm", 190.0), params.get("wm", 420.0), params.get("beta", 0.4)
        return np.clip(Tm * (1 - beta * (omega / wm - 1) ** 2), 0, None)

    def update(t, x, u, params={}):
        m, g, Cr, rho = params["m"], 9.8, 0.01, 1.3
        v = x[0]
        throttle = np.clip(u[0], 0, 1)
        ratio = (40, 25, 16, 12, 10)[params["gear"] - 1]
        T = motor_torque(ratio * v, params)
        Fg = m * g * np.sin(u[1])
        Fr = m * g * Cr * (v > 0) - m * g * Cr * (v < 0)
        Fa = 0.5 * rho * 0.32 * 2.4 * abs(v) * v
        return padded([(ratio * T * throttle - Fg - Fr - Fa) / m], x)

    return pieces(update, states=n, m=1600.0, gear=4)


@entry
def stirred_tank_reactor(n):
    def update(t, x, u, params):
        ca, temp = abs(x[0]), 300 + 50 * np.tanh(x[1])
        k = params["k0"] * np.exp(-params["E"] / (8.314 * temp))
        return padded([1 - ca - k * ca, 350 - temp + 2 * k * ca + u[0]], x)

    return pieces(update, states=n, k0=7.2e5, E=4e4)


@entry
def coupled_tanks(n):
    def update(t, x, u, params):
        h = np.maximum(x, 0)
        flow = params["a"] * np.sqrt(2 * 9.81 * h)
        dx = -flow
        dx[1:] += flow[:-1]
        dx[0] += max(u[0], 0)
        return dx

    return pieces(update, states=n, a=0.05)


@entry
def masses_and_springs(n):
    half = (n + 1) // 2

    def update(t, x, u, params):
        q = x[:half]
        stretch = np.diff(q, prepend=0.0)
        force = params["k"] * stretch + 0.1 * stretch**3
        a = -force
        a[:-1] += force[1:]
        dx = np.empty_like(x)
        dx[:half] = a
        dx[half:] = q[: n - half] - x[half:]
        dx[half - 1] += u[0]
        return dx

    return pieces(update, states=n, k=3.0)


@entry
def stick_and_slip(n):
    def update(t, x, u, params):
        v = x[1]
        if abs(v) < 1e-3 and abs(u[0]) < params["stick"]:
            friction = u[0]
        else:
            friction = np.sign(v) * (0.3 + 0.2 * np.exp(-abs(v) / 0.1))
        return padded([v, u[0] - friction], x)

    return pieces(update, states=n, stick=0.4)


@entry
def pid_with_anti_windup(n):
    def update(t, z, u, params):
        e = u[0] - u[1]
        v = params["kp"] * e + params["ki"] * z[0]
        windup = abs(v) > params["limit"] and v * e > 0
        return padded([0.0 if windup else e, (e - z[1]) / 0.1], z)

    def output(t, z, u, params):
        e = u[0] - u[1]
        return np.clip(params["kp"] * e + params["ki"] * z[0], -params["limit"], params["limit"])

    return pieces(update, output, states=n, kp=2.0, ki=0.5, limit=1.0)


@entry
def neural_network(n):
    rng = np.random.default_rng(5)
    layers = [(rng.normal(size=(6, n + 2)), rng.normal(size=6)), (rng.normal(size=(n, 6)), 0.1)]

    def update(t, x, u, params):
        z = np.concatenate([x, u])
        for i, (W, b) in enumerate(layers):
            z = W @ z + b
            if i < len(layers) - 1:
                z = np.maximum(z, 0.0) * params["slope"] + np.tanh(z)
        return z

    return pieces(update, states=n, slope=0.8)


@entry
def burgers_equation(n):
    """Upwind differences: the direction depends on the sign of each state."""

    def update(t, x, u, params):
        left = np.r_[u[0], x[:-1]]
        right = np.append(x[1:], u[1])
        slope = np.where(x > 0, x - left, right - x) * n
        return -x * slope + params["nu"] * (left - 2 * x + right) * n**2

    return pieces(update, states=n, nu=0.01)


@entry
def six_degrees_of_freedom(n):
    """Euler's equations of a rigid body, with the inertia's inverse."""
    J = np.array([[2.0, 0.1, 0.0], [0.1, 1.5, 0.2], [0.0, 0.2, 1.0]])

    def update(t, x, u, params):
        w = np.zeros(3)
        w[: min(3, n)] = x[:3]
        torque = np.array([u[0], u[1], 0.0])
        a = np.linalg.inv(J) @ (torque - np.cross(w, J @ w))
        return padded(a[: min(3, n)], x)

    return pieces(update, states=n)


@entry
def adaptive_law(n):
    def update(t, x, u, params):
        e, theta = x[0], x[1:]
        phi = np.sin(np.arange(1, n) * u[0])
        de = -params["am"] * e + phi @ theta - u[1]
        return np.hstack([de, -params["gamma"] * e * phi])

    return pieces(update, states=n, am=2.0, gamma=5.0)
