"""What was proved of a loop of model reference adaptive control, with every constant."""

from collections.abc import Iterator
from dataclasses import field
from typing import Any

import numpy as np
from flint import arb

from nlctl.attributes import described_record
from nlctl.controllers import AdaptiveWeights, ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.plants import coordinate_names
from nlctl.wording import counted

from ...intervals.normal_form import exact
from ...intervals.written import operations
from ...recheck.integers import text_above
from ..bounds.decomposition import Decomposition
from ..loop.checked import ADDED
from ..proofs.result import (
    FROM_STARTS,
    Certificate,
    Content,
    Row,
    equation_content,
    per_second,
    rows_of_split,
    split_content,
    starts_content,
    texts,
)
from .decrease import Decrease, decrease, region, sigma_of
from .matching import Matching
from .quadratic_form import QuadraticForm

_ALPHA_0 = "q D^2/(1 - alpha_1/mu) + lambda sigma |W|^2/(2 - alpha_1/(Gamma sigma))"


@described_record(made_by="certify")
class ModelReferenceCertificate(Certificate):
    """What `certify` proved of model reference adaptive control, with every constant.

    The function is V = E^T P E + lambda |W_hat - W|^2 / Gamma, E = x - xm.  The bounds hold from
    every initial state of `starts`: of the plant, the model, and the weights.
    """

    e: float  # Bound of |e| = |E_1| for all time, from all `starts`.
    errors: tuple[float, ...]  # Bounds of |E_1|, ..., |E_n| for all time.
    W_error: float  # Bound of |W_hat - W| for all time.
    ultimate: float  # Bound of limsup |e|.
    ultimate_W_error: float  # Bound of limsup |W_hat - W|.
    # Bound of the limit superior of the root mean square of e over [0, t]; it does not depend on
    # Gamma.
    rms: float
    u_max: float  # Bound of |u| for all time.
    V_max: float  # Bound of V for all time, and the largest V(0) of the starts.
    V_0: float
    # V' <= -alpha_1 V + alpha_0; NaN where the modification gives no such inequality.
    alpha_0: float
    alpha_1: float
    matching: Matching = field(repr=False)  # What the weights are to learn, and what is left.
    how: str  # How V is bounded, and what is known of it in the end.
    end: str

    @property
    def W(self) -> tuple[float, ...]:  # noqa: N802
        """The weights that the bounds are about."""
        return tuple(map(float, self.matching.W))

    def _rows(self) -> Iterator[Row]:
        yield from self._of_loop()
        yield from self._of_box()
        if self.holds:
            yield from self._bounds()

    def _of_loop(self) -> Iterator[Row]:
        match, n = self.matching, self.matching.loop.order
        form, over = match.loop.form, "all t"
        yield from rows_of_split(self.split)
        yield "beta", match.beta, per_second(n), "computed", "coefficient of v in x_n'", "all x"
        yield "lambda", match.lam, "1", "computed", "beta k / gain of the law, must be > 0", "all x"
        size = match.W_squared**0.5
        if match.chosen:
            yield "|W|", size, "1", "given", "chosen", "all x"
        else:
            yield "|W|", size, "1", "computed", "elimination, exactly", "all x"
        yield "mu", form.mu, "1/s", "proved", "Q - mu P > 0, Q = -(A^T P + P A) exactly", "all E"
        q = float(int(form.q.p) / int(form.q.q))
        yield "q", q, "1", "computed", "b^T P Q^-1 P b, rational", "all E"
        if self.disturbance:
            yield "sup |w|", self.disturbance, "1", "given", ADDED, over
        yield "sup |yd|", match.loop.command, "1", "proved", "enclosed", over

    def _of_box(self) -> Iterator[Row]:
        need, n = self.region, self.matching.loop.order
        over, box, sure = f"V <= {need.C:.6g}", need.box, self._sure
        for i, name in enumerate(model_state_names(n)):
            how = "E^T P E of the model, driven by yd"
            yield f"sup |{name}|", box[name][1], per_second(i), "proved", how, FROM_STARTS
        yield "sup |psi|", need.psi, "1", "proved", "one box", over
        what = counted(need.boxes, "box", "boxes") if need.boxes else "all of it has cancelled"
        rest = (per_second(n), "proved", f"{what}; disturbance, and what psi does not span", over)
        yield "sup |rest|", need.rest, *rest
        delta = "sup |rest| + |beta| (eps_u* + (k_2 - k_1)|u|/2)"
        yield "D", need.D, per_second(n), sure, delta, over
        yield "V(0)", self.V_0, "1", "computed", "rational", "all starts"
        if np.isfinite(self.alpha_1):
            rate = "V' <= -alpha_1 V + alpha_0: chosen between 0 and min{mu, 2 Gamma sigma}"
            yield "alpha_1", self.alpha_1, "1/s", "computed", rate, over
            yield "alpha_0", self.alpha_0, "1/s", sure, _ALPHA_0, over

    def _bounds(self) -> Iterator[Row]:
        always = FROM_STARTS
        yield "V", self.V_max, "1", "proved", self.how, always
        for i, error in enumerate(self.errors):
            yield f"|E_{i + 1}|", error, per_second(i), "proved", "sqrt(V (P^-1)_ii)", always
        yield "|W_hat - W|", self.W_error, "1", "proved", "sqrt(V Gamma/lambda)", always
        yield "|W_hat|", self.region.W_hat, "1", "proved", self._weights, always
        yield "max |u|", self.u_max, "1", "proved", "from V and the box", always
        yield "limsup |e|", self.ultimate, "1", "proved", self.end, "t -> infinity"
        weights = self.ultimate_W_error
        yield "limsup |W_hat-W|", weights, "1", "proved", self.end, "t -> infinity"
        mean = "mean of E^T Q E: V' <= -s^2 + 2 a s + b, s^2 = E^T Q E, and V is bounded"
        yield "limsup RMS e", self.rms, "1", "proved", mean, "over [0, t], t -> infinity"

    @property
    def _weights(self) -> str:
        projected = isinstance(self.matching.loop.spec("weights"), ProjectedWeights)
        ball = "; the ball of the projection is invariant" if projected else ""
        return f"|W| + |W_hat - W|{ball}"

    def _attempts(self) -> Iterator[Content]:
        premises = _premises(self.matching, self.split)
        for raised in _RAISED:
            proof = _proof(self.matching, self.split, self.C * (1 + raised))
            yield {"premises": premises, "proof": proof}

    def _bound(self) -> str:
        end = text_above(self.ultimate)
        return f"|e| <= {text_above(self.e)} proved for all t, {end} in the end,"


_RAISED = (0.0, 0.01, 0.05, 0.2, 0.5)  # relative: how far C is above the one that closed
_WIDER, _FINE = 1e-3, 1e-3  # relative: room of bounds of the rest, and how sharply it is bounded
_STAGES, _LESS = 40, 0.99  # of the bound in the end: each is to be less by that


def _premises(match: Matching, split: Decomposition) -> Content:
    loop, places = match.loop, match.loop.roles.places
    x, xm = coordinate_names(loop.order), model_state_names(loop.order)
    model, level = loop.spec("model"), loop.starts.level
    signals = ("t", *x, *xm, "yd")
    parts = {"plant": "plant", "model": "model", "W_hat": "weights"}
    return {
        "equation": equation_content(loop.acceleration, loop.order),
        "regressor": [
            operations(signals, lambda s, i=i: loop.regressor(s)[i]) for i in range(len(match.W))
        ],
        "K": texts(loop.form.K),
        "P_b": _entries(loop.form)[-loop.order :],
        "a": texts(model.a),
        "b": str(exact(model.b)),
        "command": str(exact(loop.command)),
        "gain": str(loop.gain) if loop.own_feedback else None,
        "weights": _law(loop.spec("weights")),
        "actuator": split_content(split),
        "level": None if level is None else str(exact(level)),
        "starts": starts_content(loop.starts),
        **{part: loop.starts.names_of(places[role]) for part, role in parts.items()},
    }


def _law(weights: Any) -> Content:
    """Return how the weights learn, and what keeps them bounded."""
    if isinstance(weights, ProjectedWeights):
        kind, names = "projection", {"W_max": weights.W_max, "width": weights.width}
    else:  # without sigma both are the gradient law
        names = {"sigma": sigma_of(weights)}
        by_e = names["sigma"] and not isinstance(weights, AdaptiveWeights)
        kind = "e-modification" if by_e else "sigma-modification"
    numbers = {name: str(exact(value)) for name, value in names.items()}
    return {"kind": kind, "Gamma": str(exact(weights.Gamma)), **numbers}


def _entries(form: QuadraticForm) -> list[str]:
    return [str(v) for row in form.P.tolist() for v in row]


def _proof(match: Matching, split: Decomposition, C: float) -> Content:
    """Return P, the weights, and stages: the box that closes, and smaller ones of the end."""
    loop, stages = match.loop, []
    for _ in range(_STAGES):
        need = region(match, split, arb(C), tol=_FINE)
        rest = exact(need.rest) * (1 + exact(_WIDER))
        bound = decrease(match, arb(need.D) + arb(need.rest) * _WIDER, arb(0))
        stages.append({"C": str(exact(need.C)), "rest": str(rest), **_fall(bound)})
        smaller = float(bound.error.upper()) * (1 + 1e-6)
        if not bound.falls or not 0 < smaller < C * _LESS:
            break
        C = smaller
    return {
        "error": {"P": _entries(loop.form), "mu": str(exact(loop.form.mu))},
        "model": {"P": _entries(loop.model_form), "mu": str(exact(loop.model_form.mu))},
        "beta": str(match.beta),
        "W": texts(match.W),
        "stages": stages,
    }


def _fall(bound: Decrease) -> Content:
    """Return the numbers by which V falls, as far as its modification has such."""
    if np.isfinite(bound.alpha_1):
        return {"alpha_1": str(exact(bound.alpha_1))}
    return {"V_e": str(exact(float(bound.error.upper())) * (1 + exact(_WIDER)))}
