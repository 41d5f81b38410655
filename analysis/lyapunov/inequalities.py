"""Each numbered step of the proof, (9)-(36), as a margin along a response.

The forms are the corrected ones.  V' is the gradient of V times the right-hand side of the
diagram: the rates come from the blocks' own equations, see
`nlctl.analysis.lyapunov.loop.instrumented`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.functions import smooth_sign
from nlctl.plants import coordinate_names

from .bounds.error_bounds import KAPPA
from .constants import Premises
from .loop.signals import INTEGRATED, Margin, Signals, equality, inequality


@dataclass(frozen=True, kw_only=True)
class Terms:
    """The terms that the inequalities are made of, each of shape (m,)."""

    # r, and its derivative along the diagram
    r: np.ndarray
    r_rate: np.ndarray
    # (21), and its derivative along the diagram
    V: np.ndarray
    V_rate: np.ndarray
    # g(x), W^T psi for the chosen W, and Y_d
    g: np.ndarray
    W_psi: np.ndarray
    Y_d: np.ndarray
    # k G u, and G eps_u + d
    kGu: np.ndarray
    rest: np.ndarray
    kGN: np.ndarray  # k G N(zeta)
    zeta_rate: np.ndarray
    smooth: np.ndarray  # r tanh(r / tau)
    # W~^T Gamma^-1 W_hat' and delta~ delta_hat' / gamma
    adaptation_W: np.ndarray
    adaptation_delta: np.ndarray
    # W~^T W_hat and delta~ delta_hat
    W_W_hat: np.ndarray
    delta_delta_hat: np.ndarray
    # |W~|^2 and delta~
    W_error: np.ndarray
    delta_error: np.ndarray
    W_network: np.ndarray  # W~^T psi

    @property
    def size(self) -> float:
        """Largest sum of the terms of V', which rounding is measured by."""
        parts = (self.r * self.kGu, self.r * self.rest, self.r * self.Y_d, self.r * self.g)
        parts += (self.adaptation_W, self.adaptation_delta, self.zeta_rate)
        return float(np.max(sum(np.abs(part) for part in parts)))


def terms(signals: Signals, given: Premises) -> Terms:
    """Evaluate the terms along a response of an observed loop."""
    n, gains = len(given.lambdas) + 1, given.gains
    c = (*reversed(given.lambdas), 1.0)
    r, forcing = signals["r"], given.forcing(signals.t)
    r_rate = sum(c[i] * (signals[f"rate_x{i + 1}"] - signals[f"yd{i + 1}"]) for i in range(n))
    W_hat, rate_W, psi = (signals.vector(s) for s in ("W_hat", "rate_W_hat", "psi"))
    psi = psi[:, : given.W.size]  # without a network nobody takes psi
    W_error, delta_error = given.W - W_hat, given.delta - signals["delta_hat"]
    adaptation_W = np.sum(W_error * rate_W, axis=1) / gains.Gamma
    adaptation_delta = delta_error * signals["rate_delta_hat"] / gains.gamma
    k, G = given.split.gain(signals["u"], signals["v"]), signals["G"]
    eps_u = given.split.eps_u(signals["u"], signals["v"])
    V = 0.5 * r**2 + 0.5 * np.sum(W_error**2, axis=1) / gains.Gamma
    V = V + 0.5 * delta_error**2 / gains.gamma
    return Terms(
        r=r,
        r_rate=np.asarray(r_rate),
        V=V,
        V_rate=r * r_rate - adaptation_W - adaptation_delta,
        g=signals["g"] + forcing,
        W_psi=psi @ given.W,
        Y_d=signals["Y_d"],
        kGu=G * given.split.part(signals["u"], signals["v"]),
        rest=G * eps_u + signals["d"] - forcing,
        kGN=k * G * np.vectorize(given.N, otypes=[float])(signals["zeta"]),
        zeta_rate=signals["rate_zeta"],
        smooth=r * smooth_sign(r, gains.tau),
        adaptation_W=adaptation_W,
        adaptation_delta=adaptation_delta,
        W_W_hat=np.sum(W_error * W_hat, axis=1),
        delta_delta_hat=delta_error * signals["delta_hat"],
        W_error=np.sum(W_error**2, axis=1),
        delta_error=delta_error,
        W_network=np.sum(W_error * psi, axis=1),
    )


@as_annotated
def inequalities(signals: Signals, given: Premises) -> tuple[Margin, ...]:
    """Evaluate every numbered step of the proof along a response.

    Parameters
    ----------
    signals : Signals
        Of a run of `nlctl.analysis.lyapunov.loop.instrumented`, from the start of the loop.
    given : Premises
        The constants that the steps suppose.

    Returns
    -------
    tuple of Margin
        (1), (9), (14), (15), (18), (20), (22), (26)-(32), (34), (36), in this order.

    Examples
    --------
    See `observed`.
    """
    x = terms(signals, given)
    return (
        *_equations(signals, given, x),
        *_energy(signals.t, given, x),
        *_adaptation(signals.t, given, x),
        *_decay(signals.t, given, x),
        *_bounds(signals, given, x),
    )


def _equations(signals: Signals, given: Premises, x: Terms) -> tuple[Margin, ...]:
    """The loop is of the form that the proof starts from: (9), (14), (15)."""
    t, n = signals.t, len(given.lambdas) + 1
    names = coordinate_names(n)
    e = [signals[f"x{i + 1}"] - signals["yd" if i == 0 else f"yd{i}"] for i in range(n)]
    filtered = sum(c * e_i for c, e_i in zip((*reversed(given.lambdas), 1.0), e, strict=True))
    parts = x.g + x.kGu + x.rest
    filter_signals = [x.r], [np.asarray(filtered)]
    if "e" in signals.values:
        filter_signals = [x.r, signals["e"]], [np.asarray(filtered), e[0]]
    outputs = [signals[name] for name in ("y", *names)]
    outputs += [signals[f"rate_{name}"] for name in names[:-1]]
    states = [signals[f"state_{name}"] for name in (names[0], *names, *names[1:])]
    return (
        equality(
            "(1)",
            "x_i' = x_{i+1}, y = x_1, and the outputs are the states",
            t,
            *_farthest(outputs, states),
        ),
        equality("(9)", "x_n' = g + k G u + G eps_u + d", t, signals[f"rate_x{n}"], parts),
        equality("(14)", "r = [A^T 1] e, e = e_1", t, *_farthest(*filter_signals)),
        equality("(15)", "r' = g + k G u + G eps_u + d + Y_d", t, x.r_rate, parts + x.Y_d),
    )


def _farthest(
    one: Sequence[np.ndarray], other: Sequence[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return of several pairs of signals the pair that is farthest apart, at every time."""
    a, b = np.stack(one), np.stack(other)
    with np.errstate(invalid="ignore"):
        far = np.abs(a - b)
    worst = np.argmax(np.where(np.isnan(far), np.inf, far), axis=0)[None]
    return tuple(np.take_along_axis(side, worst, axis=0)[0] for side in (a, b))  # type: ignore[return-value]


def _energy(t: np.ndarray, given: Premises, x: Terms) -> tuple[Margin, ...]:
    """V_r' and V' before the control law is put in: (18), (20), (22)."""
    V_r = x.r * x.r_rate
    rest = given.G_max * given.split.eps_star + given.d
    before = x.r * (x.kGu + x.Y_d)
    network = x.r * x.W_psi + np.abs(x.r) * given.delta + before
    adaptation = x.adaptation_W + x.adaptation_delta
    high = x.r * x.g + np.abs(x.r) * rest + before
    return (
        inequality(
            "(18)", "V_r' <= r g + r k G u + |r| (G_max eps_u* + d*) + r Y_d", t, V_r, high, x.size
        ),
        inequality(
            "(20)", "V_r' <= r W^T psi + |r| delta* + r k G u + r Y_d", t, V_r, network, x.size
        ),
        inequality(
            "(22)", "V' <= (20) - W~^T Gamma^-1 W_hat' - delta~ delta_hat'/gamma", t,
            x.V_rate, network - adaptation, x.size,
        ),
    )  # fmt: skip


def _adaptation(t: np.ndarray, given: Premises, x: Terms) -> tuple[Margin, ...]:
    """The control law (23), (24) and the adaptation laws (25) put in: (26)-(28)."""
    gains, forced = given.gains, x.kGN * x.zeta_rate
    adaptation = x.adaptation_W + x.adaptation_delta
    network = x.r * x.W_psi + np.abs(x.r) * given.delta + x.r * x.Y_d
    rhs_22 = network + x.r * x.kGu - adaptation
    rhs_26 = network + forced - adaptation
    slack = given.delta * (np.abs(x.r) - x.smooth)
    damped = -gains.beta * x.r**2 + x.zeta_rate
    rhs_27 = (
        forced + slack + damped + KAPPA * gains.b
        - (x.adaptation_W - x.r * x.W_network)
        - (x.adaptation_delta - x.delta_error * x.smooth)
    )  # fmt: skip
    leak = gains.sigma_1 * x.W_W_hat + gains.sigma_2 * x.delta_delta_hat
    rhs_28 = forced + slack + damped + KAPPA * gains.b + leak
    into_27 = (
        inequality("(27)", "(26) <= (27) with zeta' = r eta of a damped base, "
                   "r (beta r + s) <= r eta + 0.2785 b", t, rhs_26, rhs_27, x.size)
        if gains.b
        else equality("(27)", "= (26) with (24)", t, rhs_26, rhs_27, x.size)
    )  # fmt: skip
    return (
        equality("(26)", "= (22) with (23), (24): r u = N zeta'", t, rhs_22, rhs_26, x.size),
        into_27,
        equality("(28)", "= (27) with (25)", t, rhs_27, rhs_28, x.size),
    )


def _decay(t: np.ndarray, given: Premises, x: Terms) -> tuple[Margin, ...]:
    """From (28) to the comparison system: (29)-(31)."""
    gains = given.gains
    leak_W, leak_delta = gains.sigma_1 * x.W_W_hat, gains.sigma_2 * x.delta_delta_hat
    driven = (x.kGN + 1) * x.zeta_rate
    slack = KAPPA * (gains.tau * given.delta + gains.b)
    rhs_30 = -gains.beta * x.r**2 + driven + leak_W + leak_delta + slack
    W, delta = gains.sigma_1 / 2 * (given.W @ given.W), gains.sigma_2 / 2 * given.delta**2
    rhs_31 = -given.alpha_1 * x.V + driven + given.alpha_0
    return (
        inequality(
            "(29)", "|r| - r tanh(r/tau) <= 0.2785 tau", t, np.abs(x.r) - x.smooth,
            KAPPA * gains.tau,
        ),
        inequality(
            "(30)", "V' <= -beta r^2 + [k G N + 1] zeta' + sigma_1 W~^T W_hat "
            "+ sigma_2 delta~ delta_hat + 0.2785 tau delta*", t, x.V_rate, rhs_30, x.size,
        ),
        inequality(
            "Young", "2 W~^T W_hat <= |W|^2 - |W~|^2, and so for delta", t,
            leak_W + leak_delta,
            W + delta - gains.sigma_1 / 2 * x.W_error - gains.sigma_2 / 2 * x.delta_error**2,
        ),
        inequality(
            "(31)", "V' <= -alpha_1 V + [k G N + 1] zeta' + alpha_0", t, x.V_rate, rhs_31, x.size
        ),
    )  # fmt: skip


def _bounds(signals: Signals, given: Premises, x: Terms) -> tuple[Margin, ...]:
    """The comparison system solved: (32), (34), (36)."""
    t, I, V_0, rate = signals.t, signals["I"], x.V[0], given.alpha_1  # noqa: E741
    Q = float(np.max(I))
    level = given.alpha_0 / rate if rate > 0 else np.inf
    with np.errstate(invalid="ignore"):
        decaying = level + (V_0 - level) * np.exp(-rate * (t - t[0])) + I
    size = float(np.max(x.V + np.abs(I)))
    rest: tuple[float, float] = (size, INTEGRATED)
    C_0 = given.C_0(float(V_0), Q)
    return (
        inequality(
            "(32)", "V <= alpha_0/alpha_1 + (V(0) - alpha_0/alpha_1) e^(-alpha_1 t) + I", t,
            x.V, decaying, *rest,
        ),
        inequality(
            "(32b)", "V <= alpha_0/alpha_1 + V(0) + I", t, x.V, level + V_0 + I, *rest
        ),
        inequality(
            "(34)", "V <= alpha_0/alpha_1 + V(0) + Q, Q = sup I", t, x.V, level + V_0 + Q, *rest
        ),
        inequality("(36)", "|r| <= C_0", t, np.abs(x.r), C_0, None, INTEGRATED),
        inequality(
            "(36b)", "|r| <= sqrt(2 B), B the right-hand side of (32)", t, np.abs(x.r),
            np.sqrt(2 * np.maximum(decaying, 0)), None, INTEGRATED,
        ),
    )  # fmt: skip
