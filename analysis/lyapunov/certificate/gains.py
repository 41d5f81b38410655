"""Gains with the smallest proved bound of |r| under a limit of |u|."""

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import minimize

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number
from nlctl.attributes import described_record
from nlctl.errors import DivergedError, ParameterError
from nlctl.native import Compiled
from nlctl.native import compile as compiled_loop
from nlctl.response import input_output_response
from nlctl.upstream.systems import System

from ...metrics import peak
from ..bounds.decomposition import decompose
from ..loop.signals import signals_of
from ..proofs.filtered import Demand, demand
from ..proofs.result import Certificate
from .certify import certify
from .known_sign import KnownSignLoop, bound_of_r, read_known_sign

SLACK = 1.002  # of N_0 over 1 / min k G
_BOUNDS = np.geomspace(0.02, 20, 40)  # of |r|, for which delta* is tabulated


@dataclass(frozen=True, kw_only=True)
class GainCandidate:
    """One set of gains that a search tried, with the bounds that it is judged by."""

    gains: dict[str, float]  # values by qualified name
    C_0: float  # bound of |r|; infinite if there is none
    ultimate: float = np.nan  # bound of limsup |r|; NaN of a search that does not need it
    u: float  # max |u| along the run (sampled): infinite if it diverged, NaN if none was made


def tradeoff(trials: Iterable[GainCandidate], bound: str = "C_0") -> list[GainCandidate]:
    """Return trials than which no other has a smaller bound and a smaller max |u|, by max |u|."""
    front: list[GainCandidate] = []
    closed = [trial for trial in trials if np.isfinite(trial.u + getattr(trial, bound))]
    for trial in sorted(closed, key=lambda trial: (trial.u, getattr(trial, bound))):
        if not front or getattr(trial, bound) < getattr(front[-1], bound):
            front.append(trial)
    return front


@described_record(made_by="design")
class GainDesign:
    """The gains that were found, and the proof for them."""

    gains: dict[str, float]  # Values by qualified name, for ``params=`` of a run.
    certificate: Certificate  # Proved for these gains.
    u: float  # max |u| along the simulation; sampled, not proved.
    u_limit: float  # The limit that was asked for, and the length of the simulation (s).
    horizon: float
    # All gains that the search tried, in order; C_0 from a table of delta* over C, close to what
    # `certify` proves.
    trials: tuple[GainCandidate, ...]

    @property
    def tradeoff(self) -> tuple[GainCandidate, ...]:
        """The trials than which no other has a smaller bound and a smaller max |u|, by max |u|."""
        return tuple(tradeoff(self.trials))

    def __str__(self) -> str:
        gains = ", ".join(f"{name} = {value:.5g}" for name, value in self.gains.items())
        lines = [
            f"{self.certificate.claim}; max |u| = {self.u:.5g} over "
            f"{self.horizon:g} s (sampled; limit {self.u_limit:g})",
            gains,
            "trade-off (max |u|, C_0): "
            + ", ".join(f"({trial.u:.4g}, {trial.C_0:.4g})" for trial in self.tradeoff),
        ]
        return "\n".join(lines)


@as_annotated
def design(
    loop: System,
    *,
    u_limit: float,
    k: tuple[float, float] | None = None,
    u_max: float = 250.0,
    horizon: float = 20.0,
    evaluations: int = 150,
    max_steps: int = 100_000,
) -> GainDesign:
    """Search the gains with the smallest proved bound of |r| whose run keeps |u| below a limit.

    Searched are gamma, tau, b, beta, and the shares of sigma_2 gamma and sigma_1 Gamma in 2 beta
    (beyond 2 beta they do not raise alpha_1); N_0 is the smallest that the proof allows on all
    boxes with |r| <= 20, which are those that the search knows.  It is a local one (Nelder-Mead),
    from gains for which the box closes as a rule.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        As for `certify`.
    u_limit : float
        Limit of max |u| along the simulation from the loop's own initial state.
    k : (k_1, k_2), optional
        Bounds that the actuator's k shall have, see `decompose`.
    u_max : float, optional
        Half the range of u for which the actuator's split is proved.
    horizon : float, optional
        Length of the simulation (s).
    evaluations : int, optional
        Number of gains that are tried.
    max_steps : int, optional
        Steps of the simulation beyond which gains are refused as too stiff.  Without a limit
        the bound could be made as small as one likes: tau and b to 0, gamma to infinity.

    Raises
    ------
    ParameterError
        If no gains were found for which the box closes and |u| keeps its limit, or a network
        has sigma_1 = 0.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import design
    >>> law = nlctl.controllers.KnownSignLaw()
    >>> robust = nlctl.controllers.RobustTerm(sigma_2=1e-4, gamma=1e5)
    >>> no_network = nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))
    >>> controller = nlctl.adaptive_neural(2, law=law, weights=no_network, robust=robust)
    >>> loop = nlctl.paper.example_1(controller=controller)
    >>> found = design(loop, u_limit=100.0, horizon=1.0, evaluations=3)
    >>> print(found.certificate.holds, found.u <= 100.0)
    True True
    """
    u_limit = number("design", "u_limit", u_limit, above=0)
    horizon = number("design", "horizon", horizon, above=0)
    evaluations = integer("design", "evaluations", evaluations, at_least=1)
    max_steps = integer("design", "max_steps", max_steps, at_least=1)
    read = read_known_sign(loop)
    if read.nodes and not read.parts.gains.sigma_1 > 0:
        raise ParameterError("design needs sigma_1 > 0, otherwise alpha_1 = 0; got sigma_1 = 0")
    split = decompose(read.parts.actuator, k=k, u_max=u_max, tol=1e-3)
    table = [demand(read, split, float(C), tol=1e-2) for C in _BOUNDS]
    least_kG = split.k_1 * min(need.G_min for need in table)
    compiled, trials = compiled_loop(loop), []

    def cost(point: np.ndarray) -> float:
        changed, gains = _with_gains(read, least_kG, point)
        C_0, excess = _bound(changed, table)
        u = _largest_input(compiled, gains, horizon, max_steps) if np.isfinite(C_0) else np.nan
        trials.append(GainCandidate(gains=gains, C_0=C_0, u=u))
        if not np.isfinite(C_0):
            return 10 + excess
        over = np.log(u / u_limit)
        return float(np.log(C_0) + 10 * over if over > 0 else np.log(C_0))

    # logarithms of gamma, tau, b, beta, and of the two shares
    start = np.log([1e4, 0.1, 0.1, read.law.beta, 1.0, 1.0])
    simplex = np.vstack([start, start + np.diag([2.0, -0.7, -0.7, 0.3, -0.7, -0.7])])
    options = {"maxfev": evaluations, "initial_simplex": simplex}
    minimize(cost, simplex[0], method="Nelder-Mead", options=options)
    return _proved(loop, trials, u_limit, {"k": k, "u_max": u_max}, horizon)


def _with_gains(
    loop: KnownSignLoop, least_kG: float, point: np.ndarray
) -> tuple[KnownSignLoop, dict[str, float]]:
    """Return the loop with the gains of a point of the search, and these by name."""
    gamma, tau, b, beta, share_robust, share_weights = map(float, np.exp(point))
    parts, paths = loop.parts, loop.parts.paths
    law = {"beta": beta, "b": b, "N_0": SLACK / least_kG}
    robust = {"gamma": gamma, "tau": tau, "sigma_2": 2 * beta * share_robust / gamma}
    weights = {"Gamma": 2 * beta * share_weights / parts.gains.sigma_1} if loop.nodes else {}
    changed = dataclasses.replace(
        parts,
        law=dataclasses.replace(parts.law, **law),
        gains=dataclasses.replace(parts.gains, beta=beta, b=b, **robust, **weights),
    )
    pieces = {"law": law, "robust": robust, "weights": weights}
    gains = {f"{paths[n]}.{key}": v for n, values in pieces.items() for key, v in values.items()}
    return dataclasses.replace(loop, parts=changed), gains


def _bound(loop: KnownSignLoop, table: list[Demand]) -> tuple[float, float]:
    """Return the least C_0 for which a box of the table closes, and how far it is from closing."""
    # Between two boxes of the table delta* is interpolated in C.
    excess = [float(bound_of_r(loop, need.delta_star).level) / need.C for need in table]
    closing = int(np.argmax(np.array(excess) < 1)) if min(excess) < 1 else None
    if closing is None:
        return np.inf, float(np.log(min(excess)))
    if closing == 0:
        return excess[0] * table[0].C, 0.0
    below, above = table[closing - 1], table[closing]
    C = above.C
    for _ in range(60):
        share = (C - below.C) / (above.C - below.C)
        delta = (1 - share) * below.delta_star + share * above.delta_star
        C = float(bound_of_r(loop, delta).level)
    return C, 0.0


def _largest_input(
    compiled: Compiled, gains: dict[str, float], horizon: float, max_steps: int
) -> float:
    times = np.linspace(0.0, horizon, round(horizon / 1e-3) + 1)
    try:
        run = input_output_response(
            compiled, times, params=gains, max_steps=max_steps, rtol=1e-6, atol=1e-8
        )
    except DivergedError:  # or too stiff to be worth a look
        return np.inf
    signals = signals_of(run)
    return peak(signals.t, signals["u"])


def _proved(
    loop: System, trials: list[GainCandidate], u_limit: float, how: dict[str, Any], horizon: float
) -> GainDesign:
    """Prove the best trial that keeps the limit; if that fails, the next one."""
    allowed = [t for t in trials if np.isfinite(t.C_0) and t.u <= u_limit]
    for trial in sorted(allowed, key=lambda t: t.C_0)[:5]:
        certificate = certify(loop, params=trial.gains, **how)
        if certificate.holds:
            return GainDesign(
                gains=trial.gains,
                certificate=certificate,
                u=trial.u,
                u_limit=u_limit,
                horizon=horizon,
                trials=tuple(trials),
            )
    closed = [t.u for t in trials if np.isfinite(t.C_0)]
    least = f"the least max |u| among {len(closed)} with a bound is {min(closed):.4g}"
    raise ParameterError(
        f"no gains among {len(trials)} keep max |u| <= {u_limit:g} with a proved bound: "
        + (f"{least}, raise u_limit" if closed else "the box closed for none of them")
    )
