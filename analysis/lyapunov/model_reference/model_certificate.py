"""What was proved of a loop of model reference adaptive control, with every constant."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from nlctl.controllers import ProjectedWeights
from nlctl.controllers.mrac.reference_model import model_state_names
from nlctl.wording import counted

from ..bounds.decomposition import Decomposition
from ..bounds.provenance import FROM_STARTS, Constant, Shown, per_second
from ..certificate.saved import save_certificate
from ..loop.external_inputs import ADDED
from .matching import Matching
from .region import Region
from .saved import model_attempts

__all__ = ["ModelReferenceCertificate"]

_ALPHA_0 = "q D^2/(1 - alpha_1/mu) + lambda sigma |W|^2/(2 - alpha_1/(Gamma sigma))"


@dataclass(frozen=True, kw_only=True)
class ModelReferenceCertificate(Shown):
    """What `certify` proved of model reference adaptive control, with every constant.

    The function is V = E^T P E + lambda |W_hat - W|^2 / Gamma, E = x - xm.  The bounds hold from
    every initial state of `starts`: of the plant, the model, and the weights.

    Attributes
    ----------
    name : str
        Of the loop.
    holds : bool
        True: the bounds hold for all t >= 0 from the starts, proved.
    reason : str
        Why they hold, or why not.
    e : float
        Bound of |e| = |E_1| for all time, from all `starts`; infinite, as all bounds, if nothing is
        proved.
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
    iterations : tuple of float
        Bounds of V: the iteration that closed or was given up.
    region : Region
        The box and its constants at the last step.
    split : Decomposition
        Of the actuator.
    matching : Matching
        What the weights are to learn, and what is left.
    how, end : str
        How V is bounded, and what is known of it in the end.

    Examples
    --------
    See `certify`.
    """

    name: str
    holds: bool
    reason: str
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
    iterations: tuple[float, ...]
    region: Region = field(repr=False)
    split: Decomposition = field(repr=False)
    matching: Matching = field(repr=False)
    how: str
    end: str

    @property
    def W(self) -> tuple[float, ...]:  # noqa: N802
        """The weights that the bounds are about."""
        return tuple(map(float, self.matching.W))

    @property
    def constants(self) -> tuple[Constant, ...]:
        """Every constant of the proof; without the bounds if nothing is proved."""
        rows = [*self._of_loop(), *self._of_box(), *(self._bounds() if self.holds else ())]
        return tuple(
            Constant(symbol=s, value=float(v), unit=per, provenance=p, how=how, over=where)
            for s, v, per, p, how, where in rows
        )

    def _of_loop(self) -> Iterator[tuple[Any, ...]]:
        match, split, n = self.matching, self.split, self.matching.loop.order
        form, over = match.loop.form, "all t"
        k = (split.provenance, split.how, split.over)
        yield "k_1", split.k_1, "1", *k
        yield "k_2", split.k_2, "1", *k
        yield "eps_u*", split.eps_star, "1", *k
        yield "beta", match.beta, per_second(n), "computed", "coefficient of v in x_n'", "all x"
        yield "lambda", match.lam, "1", "computed", "beta k / gain of the law, must be > 0", "all x"
        size = match.W_squared**0.5
        chosen = ("given", "chosen") if match.chosen else ("computed", "elimination, exactly")
        yield "|W|", size, "1", *chosen, "all x"
        yield "mu", form.mu, "1/s", "proved", "Q - mu P > 0, Q = -(A^T P + P A) exactly", "all E"
        q = float(int(form.q.p) / int(form.q.q))
        yield "q", q, "1", "computed", "b^T P Q^-1 P b, rational", "all E"
        if match.loop.disturbance:
            yield "sup |w|", match.loop.disturbance, "1", "given", ADDED, over
        yield "sup |yd|", match.loop.command, "1", "proved", "enclosed", over

    def _of_box(self) -> Iterator[tuple[Any, ...]]:
        need, n = self.region, self.matching.loop.order
        sure = "given" if self.split.provenance == "given" else "proved"
        over, box = f"V <= {need.C:.6g}", need.box
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

    def _bounds(self) -> Iterator[tuple[Any, ...]]:
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

    def _saved(self, file: Any) -> Path:
        attempts = lambda: model_attempts(self.matching, self.split, self.region.C)  # noqa: E731
        return save_certificate(file, "reference model", self.name, attempts)

    @property
    def examined(self) -> Any:
        """The loop as the proof has read it."""
        return self.matching.loop

    @property
    def bound(self) -> str:
        """What is proved, in words."""
        return f"|e| <= {self.e:.6g} proved for all t, {self.ultimate:.6g} in the end,"
