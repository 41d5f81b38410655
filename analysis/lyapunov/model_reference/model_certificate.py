"""What was proved of a loop of model reference adaptive control, with every constant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from nlctl.controllers import ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.wording import counted

from ..loop.external_inputs import ADDED
from ..proofs.result import FROM_STARTS, Certificate, Row, per_second, rows_of_split
from ..proofs.saved import Content
from .matching import Matching
from .saved import model_attempts

_ALPHA_0 = "q D^2/(1 - alpha_1/mu) + lambda sigma |W|^2/(2 - alpha_1/(Gamma sigma))"


@dataclass(frozen=True, kw_only=True)
class ModelReferenceCertificate(Certificate):
    """What `certify` proved of model reference adaptive control, with every constant.

    The function is V = E^T P E + lambda |W_hat - W|^2 / Gamma, E = x - xm.  The bounds hold from
    every initial state of `starts`: of the plant, the model, and the weights.

    Attributes
    ----------
    e : float
        Bound of |e| = |E_1| for all time, from all `starts`.
    errors : tuple of n floats
        Bounds of |E_1|, ..., |E_n| for all time.
    W_error : float
        Bound of |W_hat - W| for all time.
    ultimate : float
        Bound of limsup |e|.
    ultimate_W_error : float
        Bound of limsup |W_hat - W|.
    rms : float
        Bound of the limit superior of the root mean square of e over [0, t]; it does not depend on
        Gamma.
    u_max : float
        Bound of |u| for all time.
    V_max, V_0 : float
        Bound of V for all time, and the largest V(0) of the starts.
    alpha_0, alpha_1 : float
        V' <= -alpha_1 V + alpha_0; NaN where the modification gives no such inequality.
    matching : Matching
        What the weights are to learn, and what is left.
    how, end : str
        How V is bounded, and what is known of it in the end.

    Examples
    --------
    See `certify`.
    """

    e: float
    errors: tuple[float, ...]
    W_error: float
    ultimate: float
    ultimate_W_error: float
    rms: float
    u_max: float
    V_max: float
    V_0: float
    alpha_0: float
    alpha_1: float
    matching: Matching = field(repr=False)
    how: str
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
        return model_attempts(self.matching, self.split, self.C)

    def _bound(self) -> str:
        return f"|e| <= {self.e:.6g} proved for all t, {self.ultimate:.6g} in the end,"
