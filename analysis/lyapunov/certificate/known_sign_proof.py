r"""A bound that holds for all time: the loop with `nlctl.KnownSignLaw`, proved by intervals.

With W = 0 in (19), which is as good as any other fixed W, and as long as x stays in a box on which
delta* >= |g + d + G eps_u| and k G >= 1/N_0 hold,

.. math:: V' \le -\alpha_1 V + 0.2785 (\tau \delta^* + b) + \sigma_2 \delta^{*2} / 2, \quad
   \alpha_1 = \min\{2\beta, \sigma_1 \Gamma, \sigma_2 \gamma\},

hence |r| <= C_0 = sqrt(2 max{V(0), alpha_0/alpha_1}), alpha_0 being all that stands behind
-alpha_1 V.  A bound C of |r| gives the box, the box gives delta*, and delta* gives C_0(C), which
grows with C.  If C_0(C) < C, then |r| never reaches C: up to the first time that it did, x stayed
in the box, and so |r| <= C_0(C).  No Nussbaum function and no Lemma 1 take part.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from flint import arb

from nlctl.wording import counted

from ...intervals.arithmetic import Ball
from ...intervals.branch_and_bound import upper
from ..bounds.decomposition import Decomposition, decompose, only_declared
from ..bounds.final_bound import alpha_0, alpha_1, initial_V
from ..bounds.provenance import FROM_STARTS, Constant, Shown, per_second
from ..loop.external_inputs import disturbed
from .known_sign import KnownSignLoop, read_loop
from .plant_bounds import Demand, demand, feedforward
from .saved import filtered_attempts, save_certificate

__all__ = ["Certificate", "bound_of_r", "certify_known_sign"]

OUTWARD = 1 + arb("1e-14")  # covers what the products of float gains round off
_LIMIT = 1e4  # a bound of |r| beyond which the iteration counts as without end


@dataclass(frozen=True, kw_only=True)
class Certificate(Shown):
    """What `certify` proved, with every constant.

    Attributes
    ----------
    name : str
        Of the loop.
    holds : bool
        True: |r| <= C_0 for all t >= 0 from the starts, proved.
    reason : str
        Why it holds, or why not.
    C_0 : float
        Bound of |r| for all time, from all `starts`; infinite if nothing is proved.
    ultimate : float
        Bound of limsup |r|, sqrt(2 alpha_0 / alpha_1).
    u_max : float
        Bound of |u| for all time: proved, and as a rule far above what happens.
    C, alpha_0, alpha_1, V_0 : float
        The bound that is not reached, the constants of V' <= -alpha_1 V + alpha_0, and V(0).
    iterations : tuple of float
        C, C_0(C), C_0(C_0(C)), ...: the iteration that closed or was given up.
    demand : Demand
        The box and its constants at the last step.
    split : Decomposition
        Of the actuator.
    loop : KnownSignLoop
        The parameters that it is about.

    Examples
    --------
    See `certify`.
    """

    name: str
    holds: bool
    reason: str
    C_0: float
    ultimate: float
    u_max: float
    C: float
    alpha_0: float
    alpha_1: float
    V_0: float
    iterations: tuple[float, ...]
    demand: Demand
    split: Decomposition
    loop: KnownSignLoop

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Every constant of the proof; without the bounds if nothing is proved."""
        need, split, law = self.demand, self.split, self.loop.law
        gain, over, n = law.N_0 * split.k_1 * need.G_min, str(need.box), self.loop.parts.order
        alpha_0 = "0.2785 (tau delta* + b) + sigma_2 delta*^2/2"
        alpha_1 = "min{2 beta, sigma_1 Gamma, sigma_2 gamma}"
        unit, error, energy = per_second(n), per_second(n - 1), per_second(2 * n - 2)
        boxes, k = need.how, (split.provenance, split.how, split.over)
        sure = "given" if split.provenance == "given" else "proved"
        rows: list[tuple[str, float, str, Any, str, str]] = [
            ("G_min", need.G_min, unit, "proved", "F/v", f"all v, {over}"),
            ("G_max", need.G_max, unit, "proved", "F/v", f"all v, {over}"),
            ("k_1", split.k_1, "1", *k),
            ("k_2", split.k_2, "1", *k),
            ("eps_u*", split.eps_star, "1", *k),
            ("N_0 k_1 G_min", gain, "1", sure, "must be at least 1", over),
            ("sup |g + d|", need.matched, unit, "proved", boxes, f"all t, {over}"),
            ("delta*", need.delta_star, unit, sure, "sup |g + d| + G_max eps_u*", over),
            ("alpha_0", self.alpha_0, per_second(2 * n - 1), sure, alpha_0, over),
            ("alpha_1", self.alpha_1, "1/s", "computed", alpha_1, "all t"),
            ("V(0)", self.V_0, energy, sure, "(21) with W = 0", "all starts"),
        ]
        if self.holds:
            bound, ultimate = "sqrt(2 max{V(0), alpha_0/alpha_1})", "sqrt(2 alpha_0/alpha_1)"
            rows += [
                ("C_0", self.C_0, error, "proved", bound, FROM_STARTS),
                ("limsup |r|", self.ultimate, error, "proved", ultimate, "t -> infinity"),
                (
                    "max |u|",
                    self.u_max,
                    "1",
                    "proved",
                    "from V <= C_0^2/2 and the box",
                    FROM_STARTS,
                ),
            ]
        return tuple(
            Constant(symbol=s, value=v, unit=per, provenance=p, how=how, over=where)
            for s, v, per, p, how, where in rows
        )

    @property
    def examined(self) -> Any:
        """The loop as the proof has read it."""
        return self.loop

    def _saved(self, file: Any) -> Path:
        gains, law = self.loop.parts.gains, self.loop.law
        names = {"sigma_1", "sigma_2", "Gamma", "gamma", "beta", "tau", "b"}
        states = {
            "plant": self.loop.states("plant"),
            "weights": self.loop.states("weights") if self.loop.nodes else [],
            "delta_hat": self.loop.states("robust")[:1],
        }
        numbers = {name: getattr(gains, name) for name in sorted(names)} | {"N_0": law.N_0}
        attempts = lambda: filtered_attempts(self.loop, self.demand, self.split, numbers, states)  # noqa: E731
        return save_certificate(file, "known sign", self.name, attempts)

    @property
    def bound(self) -> str:
        """What is proved, in words."""
        return f"|r| <= {self.C_0:.6g} proved for all t"


def bound_of_r(loop: KnownSignLoop, delta_star: float) -> tuple[arb, arb, float, arb]:
    """Return C_0, alpha_0, alpha_1 and V(0) for W = 0 and a bound delta*."""
    gains, delta = loop.parts.gains, Ball(arb(delta_star))
    rate = alpha_1(gains)
    drive = alpha_0(gains, delta, 0.0).value * OUTWARD
    start = dataclasses.replace(gains, r_0=Ball(loop.r_0), delta_hat_0=Ball(loop.delta_hat_0))
    squares: Any = sum((Ball(w) ** 2 for w in loop.W_hat_0), Ball(arb(0)))
    V_0 = arb(upper(initial_V(start, delta, squares).value * OUTWARD))
    return (2 * V_0.max(drive / rate * OUTWARD)).sqrt(), drive, rate, V_0


def certify_known_sign(
    loop: Any,
    *,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
    starts: Any = None,
    k: tuple[float, float] | None = None,
    u_max: float = 250.0,
    tol: float = 1e-3,
    max_iterations: int = 60,
) -> Certificate:
    """Prove a bound of a loop with `nlctl.KnownSignLaw`; see `certify`."""
    read = read_loop(loop, params, inputs, starts)
    split = disturbed(decompose(read.parts.actuator, k=k, u_max=u_max, tol=tol), read.disturbance)
    C = upper(abs(read.r_0))
    iterations = [C]
    for _ in range(max_iterations):
        need = demand(read, split, C * (1 + tol) + tol * tol, tol=tol)
        C_0, drive, rate, V_0 = bound_of_r(read, need.delta_star)
        closed = bool(arb(need.C) > C_0)
        iterations.append(upper(C_0))
        reason = _refusal(read, split, need, iterations)
        if closed or reason:
            break
        C = upper(C_0)
    else:
        reason = (
            f"C_0 still grows after {counted(max_iterations, 'iteration')}: {iterations[-1]:.6g}"
        )
    u = _bound_of_u(read, need, C_0)
    reason = reason or _doubt(read, split, u, u_max, iterations[-1])
    proved = f"the box closes: |r| < {need.C:.6g} implies |r| <= {iterations[-1]:.6g}"
    return Certificate(
        name=str(loop.name),
        holds=not reason,
        reason=reason or proved,
        C_0=np.inf if reason else iterations[-1],
        ultimate=np.inf if reason else upper((2 * drive / rate * OUTWARD).sqrt()),
        u_max=np.inf if reason else u,
        C=need.C,
        alpha_0=upper(drive),
        alpha_1=rate,
        V_0=upper(V_0),
        iterations=tuple(iterations),
        demand=need,
        split=split,
        loop=read,
    )


def _doubt(read: KnownSignLoop, split: Decomposition, u: float, u_max: float, C_0: float) -> str:
    """Say why a box that closes proves nothing; nothing if it does."""
    if split.provenance == "given":
        return only_declared(f"|r| <= {C_0:.6g}", read.parts.actuator)
    if split.provenance == "proved" and u > 2 * u_max:
        return (
            f"|u| may reach {u:.4g}, the actuator's split is proved to {2 * u_max:g}: raise u_max"
        )
    return ""


def _refusal(
    loop: KnownSignLoop, split: Decomposition, need: Demand, iterations: list[float]
) -> str:
    """Say why the iteration must end without a bound; nothing if it need not."""
    if not np.isfinite(iterations[-1]) or not iterations[-1] < _LIMIT:
        shown = ", ".join(f"{C:.4g}" for C in iterations)
        return f"the box does not close: C -> C_0(C) gives {shown} and so on without end"
    if not arb(loop.law.N_0) * split.k_1 * need.G_min >= 1:
        least = split.k_1 * need.G_min
        return (
            f"N_0 = {loop.law.N_0:g} is below 1/(k_1 G_min) = {1 / least:.6g}"
            if least > 0
            else f"k G may be {least:.4g} on {need.box}: Assumption 3 fails there"
        )
    return ""


def _bound_of_u(loop: KnownSignLoop, need: Demand, C_0: arb) -> float:
    """Bound |u| <= N_0 (beta |r| + |W_hat^T psi| + |delta_hat| + |Y_d|) from V <= C_0^2 / 2."""
    s: arb = (
        feedforward(loop, need) + arb(need.delta_star) + C_0 * arb(loop.parts.gains.gamma).sqrt()
    )
    s = s + C_0 * (arb(loop.parts.gains.Gamma) * loop.nodes).sqrt()
    return upper(loop.law.N_0 * (loop.law.beta * C_0 + s))
