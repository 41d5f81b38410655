r"""A bound that holds for all time: sliding mode with a boundary layer, proved by intervals.

With u = -K sat(r / phi) the filtered error obeys r' = F(x, v) + g + d + Y_d, v = k u + eps_u, so
that while x stays in a box

.. math:: r \dot{r} \le |r| \left(M - k_1 G_{min} K \min\{|r| / \varphi, 1\}\right), \quad
   M = \delta^* + \sup |Y_d|,

and |r| falls wherever it is above rho = phi M / (k_1 G_min K), if rho < phi.  A bound C of |r|
gives the box, the box gives M, and M gives max{|r(0)|, rho(C)}.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from flint import arb

from nlctl.attributes import described_record
from nlctl.controllers import FilteredError, SlidingModeLaw
from nlctl.references import SumOfSines

from ...intervals.branch_and_bound import upper
from ...recheck.integers import text_above
from ..bounds.error_bounds import error_bounds
from ..loop.checked import read_checked
from ..loop.roles import Pieces, has_law
from ..proofs import filtered
from ..proofs.kind import Closed, ProofKind, ProofOptions, Subject, wider
from ..proofs.result import FROM_STARTS, Content, Row, per_second

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


@described_record
class SlidingModeCertificate(filtered.FilteredCertificate):
    """What `certify` proved of sliding mode with a boundary layer: |r| <= C_0, in the end less.

    Examples
    --------
    The plant of Example 1 behind a linear actuator; |r| is in the layer in the end:

    >>> from nlctl.analysis.lyapunov import certify
    >>> controller = nlctl.sliding_mode(law=nlctl.controllers.SlidingModeLaw(K=20.0, phi=0.1))
    >>> loop = nlctl.paper.example_1(controller=controller, actuator=nlctl.Gain())
    >>> found = certify(loop)
    >>> print(found.holds, found.ultimate < 0.1, found.u_max)
    True True 20.0
    """

    errors: tuple[float, ...]  # Bounds of |e_1|, ..., |e_n| for all time.
    ultimate_e: float  # Bound of limsup |e|.
    M: float  # Proved bound of all that K has to dominate.

    def _rows(self) -> Iterator[Row]:
        n, over, sure = len(self.loop.e0), str(self.region.box), self._sure
        yield from self._of_plant()
        yield "M", self.M, per_second(n), sure, "delta* + sup |Y_d|", over
        least = -upper(-arb(self.loop.law.K) * self.split.k_1 * self.region.G_min)
        yield "K k_1 G_min", least, per_second(n), sure, "must be above M", over
        if self.holds:
            how = "max{|r(0)|, phi M/(K k_1 G_min)}"
            yield "C_0", self.C_0, per_second(n - 1), "proved", how, FROM_STARTS
            for i, error in enumerate(self.errors):
                yield f"|e_{i + 1}|", error, per_second(i), "proved", "filters of r", FROM_STARTS
            yield "max |u|", self.u_max, "1", "computed", "K", "all t"
            end = "the second, with M on the box of the end"
            yield "limsup |r|", self.ultimate, per_second(n - 1), "proved", end, "t -> infinity"
            yield "limsup |e|", self.ultimate_e, "1", "proved", "filters of r", "t -> infinity"

    def _numbers(self) -> tuple[Mapping[str, float], Content]:
        law = self.loop.law
        return {"K": law.K, "phi": law.phi}, {"plant": self.loop.states("plant")}

    def _bound(self) -> str:
        end = text_above(self.ultimate)
        return f"|r| <= {text_above(self.C_0)} proved for all t, {end} in the end,"


@dataclass(frozen=True, kw_only=True)
class _Layer:
    """The |r| above which it falls, or where it starts, and M; why there is no such |r|."""

    level: arb
    rho: arb
    M: arb
    doubt: str


def _begin(loop: Any, options: ProofOptions) -> Subject:
    read = read_checked(loop, _PIECES, _PROVED_FOR, options)
    with_r = filtered.FilteredLoop(**filtered.as_filtered(read))
    return filtered.subject_of(with_r, options, with_r.law.K)


def _region(subject: Subject, level: arb) -> filtered.Demand:
    tol = subject.tol
    return filtered.demand(subject.loop, subject.split, upper(wider(level, tol)), tol=tol)


def _layer(subject: Subject, need: filtered.Demand) -> _Layer:
    """Compare what K does with what it has to dominate."""
    law, start = subject.loop.law, subject.start
    M = arb(need.delta_star) + filtered.feedforward(subject.loop, need)
    least = arb(law.K) * subject.split.k_1 * need.G_min
    if not bool(least > M):
        endless = arb("inf")
        return _Layer(level=start.max(endless), rho=endless, M=M, doubt=(
            f"K k_1 G_min = {float(least):.4g} does not dominate delta* + sup |Y_d| = "
            f"{upper(M):.4g} on {need.box}: raise K"
        ))  # fmt: skip
    rho = law.phi * M / least
    return _Layer(level=start.max(rho), rho=rho, M=M, doubt="")


def _fields(subject: Subject, closed: Closed) -> dict[str, Any]:
    loop, C_0 = subject.loop, closed.bound.level
    rest = (arb(0),) * len(loop.e0)
    end = _in_the_end(subject, closed.bound.rho) if closed.holds else C_0
    end_e = error_bounds(loop.lambdas, rest, end)[0] if closed.holds else C_0
    return {
        "C_0": closed.proved(upper(C_0)),
        "errors": tuple(map(closed.proved, closed.region.errors)),
        "ultimate": closed.proved(upper(end)),
        "ultimate_e": closed.proved(upper(end_e)),
        "u_max": closed.proved(closed.u),
        "M": upper(closed.bound.M),
        "loop": loop,
    }


def _in_the_end(subject: Subject, rho: arb) -> arb:
    """Return a bound of limsup |r|: on the box that the errors end in, M is smaller."""
    loop = subject.loop
    loop = dataclasses.replace(loop, e0=(arb(0),) * len(loop.e0))
    settled = dataclasses.replace(subject, loop=loop)
    while True:
        again = _layer(settled, _region(settled, rho)).rho
        if not again < rho * (1 - subject.tol):
            return rho
        rho = again


SLIDING_MODE = ProofKind(
    name="sliding mode",
    about="a SlidingModeLaw",
    result=SlidingModeCertificate,
    fits=lambda loop: has_law(loop, SlidingModeLaw),
    bounded="|r|",
    begin=_begin,
    region=_region,
    bound=_layer,
    largest_input=lambda subject, need, bound: subject.u_max,
    fields=_fields,
)
