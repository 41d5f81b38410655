"""diffrax: Tsitouras 5(4) with PID step control in JAX, on the CPU in double precision."""

import numpy as np

from .problem import Problem, Solver, UnavailableError


def solvers(problem: Problem) -> list[Solver]:
    """Return diffrax's solver; the ensemble is one vmap."""
    try:
        import diffrax
        import jax
    except ImportError as error:
        raise UnavailableError(f"{error.name} is not installed (pip install diffrax)") from None
    jax.config.update("jax_platforms", "cpu")
    jax.config.update("jax_enable_x64", True)
    rhs = _right_hand_side(problem)

    def solve(x0, rtol, times):
        return diffrax.diffeqsolve(
            diffrax.ODETerm(lambda t, x, _: rhs(t, x)),
            diffrax.Tsit5(),
            0.0,
            20.0,
            None,
            x0,
            saveat=diffrax.SaveAt(ts=times),
            stepsize_controller=diffrax.PIDController(rtol=rtol, atol=rtol * 1e-2),
            max_steps=10**6,
        ).ys

    one, many = jax.jit(solve), jax.jit(jax.vmap(solve, in_axes=(0, None, None)))

    def run(rtol):
        return np.asarray(one(problem.x0, rtol, problem.times)).T

    def ensemble(rtol, x1, threads):
        starts = np.array([problem.start(value) for value in x1])
        states = np.asarray(many(starts, rtol, problem.coarse))
        return states[:, :, : problem.order].transpose(0, 2, 1)

    evaluated = jax.jit(rhs)
    return [
        Solver(
            name="diffrax Tsit5",
            rhs=lambda t, x: np.asarray(evaluated(t, x)),
            run=run,
            ensemble=ensemble,
            cores=1,
        )
    ]


def _right_hand_side(problem: Problem):
    """The loops once more, for JAX."""
    import jax.numpy as jnp

    n, nodes, centres = problem.order, len(problem.centres), problem.centres
    first = problem.example == 1
    beta, sigma_1, gamma, sigma_2, tau = (
        (2.5, 0.5, 1.5, 0.5, 0.2) if first else (5.0, 0.3, 1.2, 0.3, 0.5)
    )
    A = np.array([1.5, 1.0] if first else [1.0, 2.0, 1.0])
    plant = _plant_1 if first else _plant_2

    def rhs(t, x):
        state, W_hat, delta_hat, zeta = x[:n], x[n : n + nodes], x[n + nodes], x[n + nodes + 1]
        s, c, s2, c2 = jnp.sin(t), jnp.cos(t), jnp.sin(0.5 * t), jnp.cos(0.5 * t)
        yd = (0.5 * (s + s2), 0.5 * c + 0.25 * c2, -0.5 * s - 0.125 * s2, -0.5 * c - 0.0625 * c2)
        e = state - jnp.stack(yd[:n])
        r, Y_d = A @ e, -yd[n] + A[:-1] @ e[1:]
        psi = jnp.exp(-0.25 * ((centres - state) ** 2).sum(axis=1))
        robust = jnp.tanh(r / tau)
        eta = beta * r + W_hat @ psi + delta_hat * robust + Y_d
        u = jnp.exp(zeta**2) * jnp.cos(0.5 * jnp.pi * zeta) * eta
        return jnp.concatenate(
            [
                plant(t, state, u, x[-1])[0],
                0.5 * (r * psi - sigma_1 * W_hat),
                jnp.stack([gamma * (r * robust - sigma_2 * delta_hat), r * eta]),
                plant(t, state, u, x[-1])[1],
            ]
        )

    return rhs


def _plant_1(t, x, u, _):
    """Derivatives of the plant, and of the actuator's memory (none)."""
    import jax.numpy as jnp

    x1, x2 = x
    right = jnp.where(u >= 0.5, (1 + 0.3 * jnp.sin(u)) * (u - 0.5), 0.0)
    v = jnp.where(u <= -0.3, (0.8 + 0.2 * jnp.cos(u)) * (u + 0.3), right)
    damping = 0.2 + 0.2 * jnp.cos(5 * x1)
    forcing = (5 + 0.1 * jnp.cos(t)) * jnp.cos((0.5 + 0.1 * jnp.sin(t)) * t)
    h = (1 + 0.1 * jnp.cos(x1)) * (1 + 0.2 * jnp.cos(v)) * v
    d = 0.1 * (x1**2 + x2**2) * jnp.sin(t)
    return jnp.stack([x2, 0.2 * x1 - damping * x2 - x1**3 + forcing + h + d]), jnp.zeros(0)


def _plant_2(t, x, u, memory):
    """Derivatives of the plant, and of the actuator's relaxed memory."""
    import jax.numpy as jnp

    x1, x2, x3 = x
    v = jnp.clip(memory, 1.2 * (u - 0.5), 1.2 * (u + 0.6))
    h = (2 + jnp.cos(x1)) * (1 + 0.2 * jnp.sin(v) ** 2) * v
    last = -6 * x1 - 3 * x2 - 1.6 * x3 + x1**2 + h + jnp.sin(0.1 * t)
    return jnp.stack([x2, x3, last]), jnp.stack([1e3 * (v - memory)])
