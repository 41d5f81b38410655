r"""A bound that holds for all time: sliding mode with a boundary layer, proved by intervals.

With u = -K sat(r / phi) the filtered error obeys r' = F(x, v) + g + d + Y_d, v = k u + eps_u, so
that while x stays in a box

.. math:: r \dot{r} \le |r| \left(M - k_1 G_{min} K \min\{|r| / \varphi, 1\}\right), \quad
   M = \delta^* + \sup |Y_d|,

and |r| falls wherever it is above rho = phi M / (k_1 G_min K), if rho < phi.  A bound C of |r|
gives the box, the box gives M, and M gives rho(C).  If max{|r(0)|, rho(C)} < C, then |r| never
reaches C.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import control as ct
from flint import arb

from nlctl.controllers import FilteredError, SlidingModeLaw
from nlctl.diagrams import leaves
from nlctl.references import SumOfSines
from nlctl.wording import counted

from ...intervals.branch_and_bound import upper
from ..bounds.decomposition import Decomposition, decompose, only_declared
from ..bounds.error_bounds import error_bounds
from ..bounds.provenance import FROM_STARTS, Constant, Shown, per_second
from ..bounds.starts import Starts
from ..loop.checked import read_checked
from ..loop.content import LoopContent
from ..loop.external_inputs import ADDED, disturbed
from ..loop.plant_form import Acceleration, acceleration
from ..loop.roles import Pieces, Roles, record_of
from .known_sign import filtered_error, initial_errors
from .plant_bounds import Demand, demand, feedforward
from .saved import filtered_attempts, save_certificate

__all__ = ["SlidingModeCertificate", "SlidingModeLoop", "certify_sliding_mode", "is_sliding_mode"]

_PIECES: Pieces = {
    "reference": ("yd", ()),
    "plant": ("y", ()),
    "actuator": ("v", ()),
    "filtered_error": ("r", ("lambdas",)),
    "law": ("u", ()),
}
_PROVED_FOR = {
    "reference": (SumOfSines,),
    "filtered_error": (FilteredError,),
    "law": (SlidingModeLaw,),
}


@dataclass(frozen=True, kw_only=True)
class SlidingModeLoop:
    """The records of a loop with `nlctl.SlidingModeLaw`, and where it starts.

    Attributes
    ----------
    roles : Roles
    law : SlidingModeLaw
    reference : SumOfSines
    lambdas : tuple of float
        Of the filtered error.
    starts : Starts
        Initial states.
    e0 : tuple of n arb
        Initial errors e_1(0), ..., e_n(0): of all starts.
    acceleration : callable
        x_n' as ``acceleration(t, x, v)``: the last entry of the plant's own update.
    disturbance : float
        Bound of what external inputs add to the plant's v.
    content : LoopContent
        What the loop consists of.
    """

    roles: Roles = field(repr=False)
    law: SlidingModeLaw
    reference: SumOfSines
    lambdas: tuple[float, ...]
    starts: Starts
    e0: tuple[arb, ...]
    acceleration: Acceleration
    disturbance: float
    content: LoopContent = field(repr=False)

    @property
    def r_0(self) -> arb:
        """r(0) of (14)."""
        return filtered_error(self.lambdas, self.e0)


@dataclass(frozen=True, kw_only=True)
class SlidingModeCertificate(Shown):
    """What `certify` proved of sliding mode with a boundary layer, with every constant.

    Attributes
    ----------
    name : str
        Of the loop.
    holds : bool
        True: the bounds hold for all t >= 0 from the starts, proved.
    reason : str
        Why they hold, or why not.
    C_0 : float
        Bound of |r| for all time, from all `starts`; infinite if nothing is proved, as all bounds.
    errors : tuple of n floats
        Bounds of |e_1|, ..., |e_n| for all time.
    ultimate, ultimate_e : float
        Bounds of limsup |r| and of limsup |e|.
    u_max : float
        Bound of |u|: K.
    M : float
        Proved bound of all that K has to dominate.
    demand : Demand
        The box and its constants at the last step.
    iterations : tuple of float
        Bounds of |r|: the iteration that closed or was given up.
    split : Decomposition
        Of the actuator.
    loop : SlidingModeLoop
        The parameters that it is about.

    Examples
    --------
    The plant of Example 1 behind a linear actuator; |r| is in the layer in the end:

    >>> import nlctl
    >>> from nlctl.analysis.lyapunov import certify
    >>> controller = nlctl.controllers.sliding_mode(law=nlctl.SlidingModeLaw(K=20.0, phi=0.1))
    >>> loop = nlctl.paper.example_1(controller=controller, actuator=nlctl.Gain())
    >>> found = certify(loop)
    >>> print(found.holds, found.ultimate < 0.1, found.u_max)
    True True 20.0
    """

    name: str
    holds: bool
    reason: str
    C_0: float
    errors: tuple[float, ...]
    ultimate: float
    ultimate_e: float
    u_max: float
    M: float
    demand: Demand
    iterations: tuple[float, ...]
    split: Decomposition
    loop: SlidingModeLoop

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Every constant of the proof; without the bounds if nothing is proved."""
        rows = [*self._of_proof(), *(self._bounds() if self.holds else ())]
        return tuple(
            Constant(symbol=s, value=v, unit=per, provenance=p, how=how, over=where)
            for s, v, per, p, how, where in rows
        )

    def _of_proof(self) -> Iterator[tuple[Any, ...]]:
        need, split, law, over = self.demand, self.split, self.loop.law, str(self.demand.box)
        unit, k = per_second(len(self.loop.e0)), (split.provenance, split.how, split.over)
        sure = "given" if split.provenance == "given" else "proved"
        boxes = need.how
        yield "G_min", need.G_min, unit, "proved", "F/v", f"all v, {over}"
        yield "G_max", need.G_max, unit, "proved", "F/v", f"all v, {over}"
        yield "k_1", split.k_1, "1", *k
        yield "eps_u*", split.eps_star, "1", *k
        if self.loop.disturbance:
            yield "sup |w|", self.loop.disturbance, "1", "given", ADDED, "all t"
        yield "sup |g + d|", need.matched, unit, "proved", boxes, f"all t, {over}"
        yield "delta*", need.delta_star, unit, sure, "sup |g + d| + G_max eps_u*", over
        yield "M", self.M, unit, sure, "delta* + sup |Y_d|", over
        least = -upper(-arb(law.K) * split.k_1 * need.G_min)
        yield "K k_1 G_min", least, unit, sure, "must be above M", over

    def _bounds(self) -> Iterator[tuple[Any, ...]]:
        n = len(self.loop.e0)
        how = "max{|r(0)|, phi M/(K k_1 G_min)}"
        yield "C_0", self.C_0, per_second(n - 1), "proved", how, FROM_STARTS
        for i, error in enumerate(self.errors):
            yield f"|e_{i + 1}|", error, per_second(i), "proved", "filters of r", FROM_STARTS
        yield "max |u|", self.u_max, "1", "computed", "K", "all t"
        end = "the second, with M on the box of the end"
        yield "limsup |r|", self.ultimate, per_second(n - 1), "proved", end, "t -> infinity"
        yield "limsup |e|", self.ultimate_e, "1", "proved", "filters of r", "t -> infinity"

    @property
    def examined(self) -> Any:
        """The loop as the proof has read it."""
        return self.loop

    def _saved(self, file: Any) -> Path:
        loop, numbers = self.loop, {"K": self.loop.law.K, "phi": self.loop.law.phi}
        states = {"plant": loop.starts.names_of(loop.roles.places["plant"])}
        attempts = lambda: filtered_attempts(loop, self.demand, self.split, numbers, states)  # noqa: E731
        return save_certificate(file, "sliding mode", self.name, attempts)

    @property
    def bound(self) -> str:
        """What is proved, in words."""
        return f"|r| <= {self.C_0:.6g} proved for all t, {self.ultimate:.6g} in the end,"


def is_sliding_mode(loop: Any) -> bool:
    """Whether a diagram has a `nlctl.SlidingModeLaw`."""
    return isinstance(loop, ct.InterconnectedSystem) and any(
        isinstance(record_of(place), SlidingModeLaw) for place in leaves(loop)
    )


def read_sliding_mode(
    loop: Any,
    params: Mapping[str, Any] | None,
    inputs: Mapping[str, float] | None,
    starts: Any = None,
) -> SlidingModeLoop:
    """Read a loop with `nlctl.SlidingModeLaw`; raises as `read_checked` does."""
    read = read_checked(loop, _PIECES, _PROVED_FOR, params, inputs, starts)
    roles = read.roles
    return SlidingModeLoop(
        roles=roles,
        law=roles.spec("law"),
        reference=roles.spec("reference"),
        lambdas=roles.spec("filtered_error").lambdas,
        starts=read.starts,
        e0=initial_errors(roles, read.start("plant")),
        acceleration=acceleration(roles.places["plant"]),
        disturbance=read.disturbance,
        content=read.content,
    )


def certify_sliding_mode(
    loop: Any,
    *,
    params: Mapping[str, Any] | None = None,
    inputs: Mapping[str, float] | None = None,
    starts: Any = None,
    k: tuple[float, float] | None = None,
    tol: float = 1e-3,
    max_iterations: int = 60,
) -> SlidingModeCertificate:
    """Prove a bound of a loop with `nlctl.SlidingModeLaw`; see `certify`."""
    read = read_sliding_mode(loop, params, inputs, starts)
    actuator = read.roles.spec("actuator")
    split = disturbed(decompose(actuator, k=k, u_max=read.law.K, tol=tol), read.disturbance)
    start = abs(read.r_0)
    C, iterations, reason = start, [upper(start)], ""
    for _ in range(max_iterations):
        need = demand(read, split, upper(C * (1 + tol) + tol * tol), tol=tol)
        M, rho, reason = _layer(read, split, need)
        level = start.max(rho)
        iterations.append(upper(level))
        if reason or level < arb(need.C):
            break
        C = level
    else:
        reason = f"|r| still grows after {counted(max_iterations, 'iteration')}"
    if split.provenance == "given" and not reason:
        reason = only_declared(f"|r| <= {iterations[-1]:.6g}", actuator)
    end = _in_the_end(read, split, rho, tol) if not reason else rho
    inf, closed = float("inf"), f"the box closes: |r| < {need.C:.6g} implies |r| <= "
    limit = error_bounds(read.lambdas, (arb(0),) * len(read.e0), end)[0] if not reason else end
    return SlidingModeCertificate(
        name=str(loop.name),
        holds=not reason,
        reason=reason or f"{closed}{iterations[-1]:.6g}",
        C_0=inf if reason else iterations[-1],
        errors=(inf,) * len(read.e0) if reason else need.errors,
        ultimate=inf if reason else upper(end),
        ultimate_e=inf if reason else upper(limit),
        u_max=inf if reason else read.law.K,
        M=upper(M),
        demand=need,
        iterations=tuple(iterations),
        split=split,
        loop=read,
    )


def _layer(loop: SlidingModeLoop, split: Decomposition, need: Demand) -> tuple[arb, arb, str]:
    """Return M, the |r| above which it falls, and why there is none."""
    M = arb(need.delta_star) + feedforward(loop, need)
    least = arb(loop.law.K) * split.k_1 * need.G_min
    if not bool(least > M):
        return M, arb("inf"), (
            f"K k_1 G_min = {float(least):.4g} does not dominate delta* + sup |Y_d| = "
            f"{upper(M):.4g} on {need.box}: raise K"
        )  # fmt: skip
    return M, loop.law.phi * M / least, ""


def _in_the_end(loop: SlidingModeLoop, split: Decomposition, rho: arb, tol: float) -> arb:
    """Return a bound of limsup |r|: on the box that the errors end in, M is smaller."""
    settled = dataclasses.replace(loop, e0=(arb(0),) * len(loop.e0))
    while True:
        need = demand(settled, split, upper(rho * (1 + tol) + tol * tol), tol=tol)
        again = _layer(loop, split, need)[1]
        if not again < rho * (1 - tol):
            return rho
        rho = again
