r"""A bound for all time: the loop with `nlctl.controllers.KnownSignLaw`, proved by intervals.

With W = 0 in (19), which is as good as any other fixed W, and as long as x stays in a box on which
delta* >= |g + d + G eps_u| and k G >= 1/N_0 hold,

.. math:: V' \le -\alpha_1 V + 0.2785 (\tau \delta^* + b) + \sigma_2 \delta^{*2} / 2, \quad
   \alpha_1 = \min\{2\beta, \sigma_1 \Gamma, \sigma_2 \gamma\},

hence |r| <= C_0 = sqrt(2 max{V(0), alpha_0/alpha_1}), alpha_0 being all that stands behind
-alpha_1 V.  A bound C of |r| gives the box, the box gives delta*, and delta* gives C_0(C).
No Nussbaum function and no Lemma 1 take part.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from flint import arb

from nlctl import controllers
from nlctl.attributes import described_record
from nlctl.references import SumOfSines

from ...intervals.arithmetic import Ball
from ...intervals.branch_and_bound import upper
from ...recheck.integers import text_above
from ..bounds.error_bounds import alpha_0, alpha_1, initial_V
from ..loop.checked import NOTHING_SUPPOSED, Supposed, read_checked
from ..loop.roles import PIECES, Parts, has_law, loop_parts
from ..proofs import filtered
from ..proofs.kind import Closed, ProofKind, Subject, wider, without_end
from ..proofs.result import FROM_STARTS, Content, Row, per_second

_PROVED_FOR = {
    "reference": (SumOfSines,),
    "filtered_error": (controllers.FilteredError,),
    "basis": (controllers.GaussianBasis,),
    "weights": (controllers.AdaptiveWeights, controllers.Zero),
    "robust": (controllers.RobustTerm,),
    "law": (controllers.KnownSignLaw,),
}
_OUTWARD = 1 + arb("1e-14")  # covers what the products of float gains round off
_LIMIT = 1e4  # a bound of |r| beyond which the iteration counts as without end


@dataclass(frozen=True, kw_only=True)
class KnownSignLoop(filtered.FilteredLoop):
    """The records of a loop with `nlctl.controllers.KnownSignLaw`, and where it starts."""

    parts: Parts  # records of the blocks, and the gains
    delta_hat_0: arb
    W_hat_0: tuple[arb, ...]  # initial estimates, of all starts

    @property
    def law(self) -> controllers.KnownSignLaw:
        """The control law."""
        return self.parts.law

    @property
    def nodes(self) -> int:
        """Number of nodes of the network; 0 without one."""
        return len(self.parts.gains.W_hat_0)


@described_record(made_by="certify")
class KnownSignCertificate(filtered.FilteredCertificate):
    """What `certify` proved with `nlctl.controllers.KnownSignLaw`: |r| <= C_0 for all time."""

    alpha_0: float  # The constants of V' <= -alpha_1 V + alpha_0, and V(0).
    alpha_1: float
    V_0: float

    def _rows(self) -> Iterator[Row]:
        split, need, sure, n = self.split, self.region, self._sure, len(self.loop.e0)
        gain, over = self.loop.law.N_0 * split.k_1 * need.G_min, str(need.box)
        rate = "min{2 beta, sigma_1 Gamma, sigma_2 gamma}"
        drive = "0.2785 (tau delta* + b) + sigma_2 delta*^2/2"
        yield from self._of_plant()
        yield "N_0 k_1 G_min", gain, "1", sure, "must be at least 1", over
        yield "alpha_0", self.alpha_0, per_second(2 * n - 1), sure, drive, over
        yield "alpha_1", self.alpha_1, "1/s", "computed", rate, "all t"
        yield "V(0)", self.V_0, per_second(2 * n - 2), sure, "(21) with W = 0", "all starts"
        if self.holds:
            error, how = per_second(n - 1), "sqrt(2 max{V(0), alpha_0/alpha_1})"
            yield "C_0", self.C_0, error, "proved", how, FROM_STARTS
            how = "sqrt(2 alpha_0/alpha_1)"
            yield "limsup |r|", self.ultimate, error, "proved", how, "t -> infinity"
            how = "from V <= C_0^2/2 and the box"
            yield "max |u|", self.u_max, "1", "proved", how, FROM_STARTS

    def _numbers(self) -> tuple[Mapping[str, float], Content]:
        loop = self.loop
        names = sorted(("sigma_1", "sigma_2", "Gamma", "gamma", "beta", "tau", "b"))
        gains = {name: getattr(loop.parts.gains, name) for name in names}
        return gains | {"N_0": loop.law.N_0}, {
            "plant": loop.states("plant"),
            "weights": loop.states("weights") if loop.nodes else [],
            "delta_hat": loop.states("robust")[:1],
        }

    def _bound(self) -> str:
        return f"|r| <= {text_above(self.C_0)} proved for all t"


@dataclass(frozen=True, kw_only=True)
class _BoundOfR:
    """C_0, alpha_0, alpha_1 and V(0) for W = 0 and a bound delta*."""

    level: arb
    drive: arb
    rate: float
    V_0: arb
    doubt: str = field(default="")


def read_known_sign(loop: Any, given: Supposed = NOTHING_SUPPOSED) -> KnownSignLoop:
    """Read a loop that is made of the paper's blocks and `nlctl.controllers.KnownSignLaw`."""
    read = read_checked(loop, PIECES, _PROVED_FOR, given)
    parts = loop_parts(read.given, read.roles)
    weights = read.start("weights") if parts.weights else ()
    return KnownSignLoop(
        **filtered.as_filtered(read),
        parts=parts,
        delta_hat_0=filtered.between(*read.start("robust")[0]),
        W_hat_0=tuple(filtered.between(*ends) for ends in weights),
    )


def _region(subject: Subject, level: arb) -> filtered.Demand:
    C = wider(upper(level), subject.tol)
    return filtered.demand(subject.loop, subject.split, C, tol=subject.tol)


def bound_of_r(loop: KnownSignLoop, delta_star: float) -> _BoundOfR:
    """Return what follows from a bound delta*."""
    gains, delta = loop.parts.gains, Ball(arb(delta_star))
    rate = alpha_1(gains)
    drive = alpha_0(gains, delta, 0.0).value * _OUTWARD
    start = dataclasses.replace(gains, r_0=Ball(loop.r_0), delta_hat_0=Ball(loop.delta_hat_0))
    squares: Any = sum((Ball(w) ** 2 for w in loop.W_hat_0), Ball(arb(0)))
    V_0 = arb(upper(initial_V(start, delta, squares).value * _OUTWARD))
    level = (2 * V_0.max(drive / rate * _OUTWARD)).sqrt()
    return _BoundOfR(level=level, drive=drive, rate=rate, V_0=V_0)


def _bound(subject: Subject, need: filtered.Demand) -> _BoundOfR:
    bound = bound_of_r(subject.loop, need.delta_star)
    least, N_0 = subject.split.k_1 * need.G_min, subject.loop.law.N_0
    if not upper(bound.level) < _LIMIT or arb(N_0) * subject.split.k_1 * need.G_min >= 1:
        return bound
    doubt = f"k G may be {least:.4g} on {need.box}: Assumption 3 fails there"
    if least > 0:
        doubt = f"N_0 = {N_0:g} is below 1/(k_1 G_min) = {1 / least:.6g}"
    return dataclasses.replace(bound, doubt=doubt)


def _largest_input(subject: Subject, need: filtered.Demand, bound: _BoundOfR) -> float:
    """Bound |u| <= N_0 (beta |r| + |W_hat^T psi| + |delta_hat| + |Y_d|) from V <= C_0^2 / 2."""
    loop, C_0, gains = subject.loop, bound.level, subject.loop.parts.gains
    s = filtered.feedforward(loop, need) + arb(need.delta_star) + C_0 * arb(gains.gamma).sqrt()
    s = s + C_0 * (arb(gains.Gamma) * loop.nodes).sqrt()
    return upper(loop.law.N_0 * (loop.law.beta * C_0 + s))


def _fields(subject: Subject, closed: Closed) -> dict[str, Any]:
    bound = closed.bound
    return {
        "C_0": closed.proved(upper(bound.level)),
        "ultimate": closed.proved(upper((2 * bound.drive / bound.rate * _OUTWARD).sqrt())),
        "u_max": closed.proved(closed.u),
        "alpha_0": upper(bound.drive),
        "alpha_1": bound.rate,
        "V_0": upper(bound.V_0),
        "loop": subject.loop,
    }


KNOWN_SIGN = ProofKind(
    name="known sign",
    about="a KnownSignLaw",
    result=KnownSignCertificate,
    fits=lambda loop: has_law(loop, controllers.KnownSignLaw),
    bounded="|r|",
    begin=lambda loop, options: filtered.subject_of(
        read_known_sign(loop, options), options, options.u_max
    ),
    region=_region,
    bound=_bound,
    endless=lambda need, iterations: (
        "" if iterations[-1] < _LIMIT else without_end("C_0(C)", iterations)
    ),
    largest_input=_largest_input,
    fields=_fields,
)
