"""Closed-loop equations of Lv et al. (2017), transcribed once more as a test oracle.

Source: M. Lv, Y. Wang, S. Baldi, Z. Liu, C. Shi, C. Fu, X. Meng, Y. Qi, "Adaptive Neural Control
for Pure Feedback Nonlinear Systems with Uncertain Actuator Nonlinearity", ICONIP 2017, LNCS 10639,
pp. 201-211, doi 10.1007/978-3-319-70136-3_22.  Numbers in brackets are the paper's equations.

This file shares no code with nlctl and imports nothing from it: plain NumPy and explicit sums, to
be read next to the paper.  Where the paper is misprinted or silent, the reading taken here is

* (14) with A = [lambda_{n-1}, ..., lambda_1]: r = lambda_{n-1} e_1 + ... + lambda_1 e_{n-1} + e_n,
  so r = e_1 + 2 e_2 + e_3 in Example 2;
* psi_i(x) = exp(-|x - mu_i|^2 / v_i^2) with the width v_i, no factor 2 in the exponent;
* Example 1 has the phase w(t) t as printed (`phase="product"`); `phase="integral"` takes
  int_0^t w instead;
* the backlash is the play operator (phi(u) = v(t-)): the last output clipped into a moving band.

Initial values of the paper: x(0) = (0.5, 0) in Example 1 and (1, 0, 0) in Example 2, W_hat(0) = 0,
delta_hat(0) = 0, zeta(0) = 1; the memory of the backlash is not given (0 lies in its band).
"""

import itertools

import numpy as np

EXAMPLE_1 = {
    # plant
    "p1": -0.2,
    "p_mean": 0.2,
    "p_ripple": 0.2,
    "q_mean": 5.0,
    "q_ripple": 0.1,
    "w_mean": 0.5,
    "w_ripple": 0.1,
    "gain_x": 0.1,
    "gain_v": 0.2,
    "d_amplitude": 0.1,
    # controller; lambdas are lambda_1, ..., lambda_{n-1}
    "lambdas": (1.5,),
    "beta": 2.5,
    "sigma_1": 0.5,
    "sigma_2": 0.5,
    "Gamma": 0.5,
    "gamma": 1.5,
    "tau": 0.2,
    "widths": np.full(27, 2.0),
}

EXAMPLE_2 = {
    # plant
    "a": 1.6,
    "b": 3.0,
    "c": 6.0,
    "gain_mean": 2.0,
    "gain_x": 1.0,
    "gain_v": 0.2,
    "d_amplitude": 1.0,
    "d_frequency": 0.1,
    # controller; lambdas are lambda_1, ..., lambda_{n-1}
    "lambdas": (2.0, 1.0),
    "beta": 5.0,
    "sigma_1": 0.3,
    "sigma_2": 0.3,
    "Gamma": 0.5,
    "gamma": 1.2,
    "tau": 0.5,
    "widths": np.full(27, 2.0),
}


def reference(t, n):
    """Array yd, yd', ..., yd^(n) at time t of yd = 0.5 (sin t + sin 0.5 t), for n up to 3."""
    if n not in (0, 1, 2, 3):
        raise ValueError(f"derivatives are written out up to order 3, not {n}")
    yd = 0.5 * (np.sin(t) + np.sin(0.5 * t))
    yd_1 = 0.5 * np.cos(t) + 0.25 * np.cos(0.5 * t)
    yd_2 = -0.5 * np.sin(t) - 0.125 * np.sin(0.5 * t)
    yd_3 = -0.5 * np.cos(t) - 0.0625 * np.cos(0.5 * t)
    return np.array([yd, yd_1, yd_2, yd_3][: n + 1])


def diagonal_centres(l, n, low=-10, high=10):  # noqa: E741 (the paper's l)
    """The l centres (s, ..., s) in R^n with s evenly spaced from low to high; shape (l, n)."""
    centres = np.zeros((l, n))
    for i in range(l):
        for j in range(n):
            centres[i, j] = low + (high - low) * i / (l - 1)
    return centres


def grid_centres(counts, low=-10, high=10):
    """Full grid, counts[j] centres along axis j, last axis fastest; shape (product, n)."""
    axes = [np.linspace(low, high, count) for count in counts]
    return np.array(list(itertools.product(*axes)))


def dead_zone(u, *, slope_r=1.0, ripple_r=0.3, slope_l=0.8, ripple_l=0.2, b_r=0.5, b_l=-0.3):
    """Dead zone of Example 1: zero on [b_l, b_r], a rippled slope on either side."""
    if u >= b_r:
        return (slope_r + ripple_r * np.sin(u)) * (u - b_r)
    if u <= b_l:
        return (slope_l + ripple_l * np.cos(u)) * (u - b_l)
    return 0.0


def play(u, memory, *, m_r=1.2, m_l=1.2, c_r=0.5, c_l=-0.6):
    """Backlash of Example 2: the memory (last output) clipped between the lines of slopes m_r, m_l.

    The output rises along m_r (u - c_r), falls along m_l (u - c_l) and is held in between.
    """
    lower, upper = sorted([m_r * (u - c_r), m_l * (u - c_l)])
    if memory < lower:
        return lower
    if memory > upper:
        return upper
    return memory


def actuate(u, state, actuator, actuator_params):
    """Actuator output v and the derivative of its memory (None for the dead zone, which has none).

    The memory of the backlash chases the output, memory' = rate (v - memory), where the output is
    the clipped memory.  The play operator is the limit of an infinite rate.
    """
    options = dict(actuator_params or {})
    if actuator == "dead_zone":
        return dead_zone(u, **options), None
    if actuator == "backlash":
        rate = options.pop("rate", 1000.0)
        v = play(u, state["memory"], **options)
        return v, rate * (v - state["memory"])
    raise ValueError(f"unknown actuator {actuator!r}")


def controller(t, state, centres, params):
    """Control law and adaptation (14), (23)-(25) at one instant: derivatives and signals."""
    x = state["x"]
    W_hat = state["W_hat"]
    delta_hat = state["delta_hat"]
    zeta = state["zeta"]
    n = len(x)
    nodes = len(centres)

    # tracking error e = x - x_d, x_d = (yd, ..., yd^(n-1))
    yd = reference(t, n)
    e = np.zeros(n)
    for i in range(n):
        e[i] = x[i] - yd[i]

    # (14): A = (lambda_{n-1}, ..., lambda_1), r = A^T (e_1, ..., e_{n-1}) + e_n
    A = list(params["lambdas"])[::-1]
    r = e[n - 1]
    for i in range(n - 1):
        r = r + A[i] * e[i]

    # below (18): Y_d = -yd^(n) + [0 A^T] e
    Y_d = -yd[n]
    for i in range(n - 1):
        Y_d = Y_d + A[i] * e[i + 1]

    # Gaussian basis functions
    psi = np.zeros(nodes)
    for i in range(nodes):
        distance_2 = 0.0
        for j in range(n):
            distance_2 = distance_2 + (x[j] - centres[i][j]) ** 2
        psi[i] = np.exp(-distance_2 / params["widths"][i] ** 2)
    network = 0.0
    for i in range(nodes):
        network = network + W_hat[i] * psi[i]

    # (23)
    robust = np.tanh(r / params["tau"])
    N = np.exp(zeta**2) * np.cos(np.pi * zeta / 2)
    u = N * (params["beta"] * r + network + delta_hat * robust + Y_d)

    # (24)
    zeta_dot = params["beta"] * r**2 + r * network + delta_hat * r * robust + r * Y_d

    # (25)
    W_hat_dot = np.zeros(nodes)
    for i in range(nodes):
        W_hat_dot[i] = params["Gamma"] * (r * psi[i] - params["sigma_1"] * W_hat[i])
    delta_hat_dot = params["gamma"] * (r * robust - params["sigma_2"] * delta_hat)

    derivatives = {"W_hat": W_hat_dot, "delta_hat": delta_hat_dot, "zeta": zeta_dot}
    signals = {
        "y": x[0],
        "yd": yd[0],
        "e": e[0],
        "r": r,
        "u": u,
        "zeta": zeta,
        "delta_hat": delta_hat,
        "W_norm": np.sqrt(np.sum(np.asarray(W_hat) ** 2)),
    }
    return derivatives, signals


def example_1_rhs(
    t, state, centres, params, *, actuator="dead_zone", actuator_params=None, phase="product"
):
    """Example 1 (second order, published with the dead zone): derivatives and signals at time t.

    `state` holds x, W_hat, delta_hat, zeta and, with `actuator="backlash"`, memory; the derivatives
    have the same keys.  Signal e is the scalar tracking error e_1 = y - yd.
    `actuator_params` overrides the constants of the actuator (and `rate`, see `actuate`).
    """
    derivatives, signals = controller(t, state, centres, params)
    v, memory_dot = actuate(signals["u"], state, actuator, actuator_params)
    x1, x2 = state["x"]

    p = params["p_mean"] + params["p_ripple"] * np.cos(5 * x1)
    q = params["q_mean"] + params["q_ripple"] * np.cos(t)
    if phase == "product":
        wt = (params["w_mean"] + params["w_ripple"] * np.sin(t)) * t
    elif phase == "integral":
        wt = params["w_mean"] * t + params["w_ripple"] * (1 - np.cos(t))
    else:
        raise ValueError(f"unknown phase {phase!r}")
    h = (1 + params["gain_x"] * np.cos(x1)) * (1 + params["gain_v"] * np.cos(v)) * v
    d = params["d_amplitude"] * (x1**2 + x2**2) * np.sin(t)

    x1_dot = x2
    x2_dot = -params["p1"] * x1 - p * x2 - x1**3 + q * np.cos(wt) + h + d

    derivatives["x"] = np.array([x1_dot, x2_dot])
    if memory_dot is not None:
        derivatives["memory"] = memory_dot
    signals["v"] = v
    return derivatives, signals


def example_2_rhs(t, state, centres, params, *, actuator="backlash", actuator_params=None):
    """Example 2 (Genesio system, published with the backlash): derivatives and signals at time t.

    Arguments and results as in `example_1_rhs`.
    """
    derivatives, signals = controller(t, state, centres, params)
    v, memory_dot = actuate(signals["u"], state, actuator, actuator_params)
    x1, x2, x3 = state["x"]

    gain = params["gain_mean"] + params["gain_x"] * np.cos(x1)
    h = gain * (1 + params["gain_v"] * np.sin(v) ** 2) * v
    d = params["d_amplitude"] * np.sin(params["d_frequency"] * t)

    x1_dot = x2
    x2_dot = x3
    x3_dot = -params["c"] * x1 - params["b"] * x2 - params["a"] * x3 + x1**2 + h + d

    derivatives["x"] = np.array([x1_dot, x2_dot, x3_dot])
    if memory_dot is not None:
        derivatives["memory"] = memory_dot
    signals["v"] = v
    return derivatives, signals
