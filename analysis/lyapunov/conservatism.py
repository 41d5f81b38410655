"""How far the proof's bound is from what happens, term by term, and tighter bounds."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.functions import smooth_sign

from ..metrics import over, peak
from .bounds.error_bounds import KAPPA
from .bounds.weights import Network, tightest_weights
from .constants import Constants, Premises, premises
from .examination import Examination, examine
from .inequalities import terms
from .loop.signals import Signals, peak_by_rates
from .nussbaum.property import root

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, kw_only=True)
class Share:
    """One term of C_0^2 / 2."""

    term: str
    formula: str
    value: float
    share: float  # of C_0^2 / 2


@described_record(made_by="observed")
class DirectBound:
    """A bound of |r| on [start, end] by direct comparison, without V and without Lemma 1."""

    start: float  # Interval (s); infinite bounds where k G N is not negative throughout.
    end: float
    rho: float  # Where beta rho + min delta_hat tanh(rho/tau) = sup M.
    bound: float  # max(|r(start)|, rho).
    max_r: float  # max |r| on the interval.

    @property
    def ratio(self) -> float:
        """Bound over max |r|."""
        return self.bound / self.max_r


@described_record(made_by="conservatism")
class Conservatism:
    """C_0 against what happens."""

    C_0: float
    max_r: float
    # sqrt(2 (alpha_0/alpha_1 + sup I)) and max |r| over the second half of the run.
    ultimate: float
    tail_max_r: float
    shares: tuple[Share, ...]  # Terms of C_0^2 / 2.
    delta_shares: tuple[Share, ...]  # Terms of delta*, over delta*.
    C_0_along: float  # C_0 with delta* = sup |G eps_u + d + eps| along the run (sampled), same W.
    C_0_fitted: float  # The same with the weights that make it smallest along the run.
    sqrt_2V: float  # max of sqrt(2 V): what is lost by bounding r by V alone.
    comparisons: tuple[DirectBound, ...]  # From 1 s on, and over the second half of the run.
    # Bound tail max |r| / lambda_{n-1} of limsup |e_1| for real stable roots, and what max |e_1| is
    # over the second half.
    e_1: float
    tail_max_e_1: float

    @property
    def ratio(self) -> float:
        """C_0 over max |r|."""
        return self.C_0 / self.max_r

    def table(self) -> pd.DataFrame:
        """Return the terms of C_0^2 / 2, indexed by term.

        Returns
        -------
        DataFrame
            One row for each term.
        """
        import pandas as pd

        return pd.DataFrame([dataclasses.asdict(s) for s in self.shares]).set_index("term")

    def __str__(self) -> str:
        lines = [f"C_0 = {self.C_0:.5g} for max |r| = {self.max_r:.5g}: {self.ratio:.4g} times"]
        lines += [
            f"  {s.term:<22} {s.value:<10.5g} {100 * s.share:5.1f} %  {s.formula}"
            for s in (*self.shares, *self.delta_shares)
        ]
        lines.append(f"ultimate bound {self.ultimate:.5g} for tail max |r| = {self.tail_max_r:.5g}")
        lines.append(
            f"C_0 with delta* along the run: {self.C_0_along:.5g}; with W fitted to it: "
            f"{self.C_0_fitted:.5g}"
        )
        lines += [
            f"comparison on [{c.start:g}, {c.end:g}] s: |r| <= {c.bound:.5g}, {c.ratio:.4g} times"
            for c in self.comparisons
        ]
        lines.append(
            f"second half: max |r| / lambda = {self.e_1:.5g}, a bound of limsup |e_1| if r "
            f"continues like that, and max |e_1| = {self.tail_max_e_1:.5g}"
        )
        return "\n".join(lines)


@as_annotated
def conservatism(
    loop: ct.InterconnectedSystem | Examination, run: object = 20.0, **settings: Any
) -> Conservatism:
    """Take C_0 of (36) apart and set it against a run.

    Parameters
    ----------
    loop : control.InterconnectedSystem or Examination
        A loop, or what `examine` found.
    run : float, control.TimeResponseData or sequence of them, optional
        Horizon (s), or responses of the loop; of an ensemble the first member counts.
    **settings : object
        box, W, k, start, params, step, max_steps: as for `examine`.

    Raises
    ------
    DiagramError, DecompositionError, ParameterError, UnknownNameError
        As `examine` does.

    Examples
    --------
    C_0^2 / 2 is the sum of its terms:

    >>> from nlctl.analysis.lyapunov import conservatism
    >>> controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    >>> found = conservatism(nlctl.paper.example_1(controller=controller), 0.2)
    >>> print(round(sum(share.share for share in found.shares), 9), found.max_r < found.C_0)
    1.0 True
    """
    study = loop if isinstance(loop, Examination) else examine(loop, run, **settings)
    member, constants = study.runs.first, study.constants
    s, given = member.signals, premises(constants, member.gains)
    x, Q = terms(s, given), float(np.max(s["I"]))
    V_0, half = float(x.V[0]), 0.5 * (s.t[0] + s.t[-1])
    late, r = over(s.t, s["r"], half, np.inf)
    _, e_1 = over(s.t, s["e"], half, np.inf)
    C_0 = given.C_0(V_0, Q)
    along = float(np.max(np.abs(x.rest + x.g - x.W_psi)))
    ends = float(s.t[-1])
    starts = [a for a in (s.t[0] + 1.0, half) if a < ends]
    return Conservatism(
        C_0=C_0,
        max_r=peak_by_rates(s.t, x.r, x.r_rate),
        ultimate=given.C_0(0.0, Q),
        tail_max_r=peak(late, r),
        shares=_shares(given, float(x.r[0]), Q),
        delta_shares=_delta_shares(given, constants),
        C_0_along=_bound_with(given, along, given.W, Q),
        C_0_fitted=_fitted(s, given, Q),
        sqrt_2V=float(np.sqrt(2 * np.max(x.V))),
        comparisons=tuple(comparison(s, given, a, ends) for a in starts),
        e_1=peak(late, r) / given.lambdas[-1],
        tail_max_e_1=peak(late, e_1),
    )


def _shares(given: Premises, r_0: float, Q: float) -> tuple[Share, ...]:
    gains, rate = given.gains, given.alpha_1
    W, error = given.W @ given.W, given.W - np.array(gains.W_hat_0)
    by = rate if rate > 0 else np.nan
    start_delta = (given.delta - gains.delta_hat_0) ** 2 / (2 * gains.gamma)
    start_W = float(error @ error) / (2 * gains.Gamma)
    rows = (
        ("delta* in alpha_0", "sigma_2 delta*^2 / (2 alpha_1)",
         gains.sigma_2 * given.delta**2 / 2 / by),
        ("|W| in alpha_0", "sigma_1 |W|^2 / (2 alpha_1)", gains.sigma_1 * W / 2 / by),
        ("tau in alpha_0", "0.2785 tau delta* / alpha_1", KAPPA * gains.tau * given.delta / by),
        *([("b in alpha_0", "0.2785 b / alpha_1", KAPPA * gains.b / by)] if gains.b else []),
        ("delta* in V(0)", "(delta* - delta_hat(0))^2 / (2 gamma)", start_delta),
        ("|W| in V(0)", "|W - W_hat(0)|^2 / (2 Gamma)", start_W),
        ("r(0) in V(0)", "r(0)^2 / 2", r_0**2 / 2),
        ("Q", "sup I(t)", Q),
    )  # fmt: skip
    return _shares_of(rows, sum(value for _, _, value in rows))


def _delta_shares(given: Premises, constants: Constants) -> tuple[Share, ...]:
    rows = (
        ("actuator in delta*", "G_max eps_u*", given.G_max * given.split.eps_star),
        ("disturbance in delta*", "d*", given.d),
        ("network in delta*", "eps*", given.eps),
    )
    return _shares_of(rows, constants["delta*"])


def _shares_of(rows: Iterable[tuple[str, str, Any]], whole: object) -> tuple[Share, ...]:
    return tuple(
        Share(term=term, formula=formula, value=float(v), share=float(v / whole))
        for term, formula, v in rows
    )


def _bound_with(given: Premises, delta: float, W: np.ndarray, Q: float) -> float:
    changed = dataclasses.replace(given, delta=delta, W=W)
    return changed.C_0(changed.V_0, Q)


def _fitted(s: Signals, given: Premises, Q: float) -> float:
    """C_0 with the weights that are best for the errors along the run."""
    x = terms(s, given)
    target, psi = x.g + x.rest, s.vector("psi")[:, : given.W.size]
    if not given.W.size:
        return _bound_with(given, float(np.max(np.abs(target))), given.W, Q)
    every = slice(None, None, max(1, s.t.size // 1000))
    network = Network(psi=psi[every], g=target[every], points=s.t[every, None])
    W = tightest_weights(network, given.gains, 0.0)
    return _bound_with(given, float(np.max(np.abs(target - psi @ W))), W, Q)


@as_annotated
def comparison(signals: Signals, given: Premises, start: float, end: float) -> DirectBound:
    """Bound |r| on an interval by comparison, from the signals along a run.

    While k G N < 0,  |r|' <= k G |N| (M - beta |r| - delta_hat tanh(|r|/tau)),
    M = |(g + d + G eps_u + Y_d) / (k G N) + W_hat^T psi + Y_d|, hence
    |r| <= max(|r(start)|, rho),  beta rho + min delta_hat tanh(rho/tau) = sup M.
    The suprema are taken over the samples.

    Parameters
    ----------
    signals : Signals
        Of an observed run.
    given : Premises
        Of the loop, see `premises`.
    start, end : float
        In s.

    Returns
    -------
    DirectBound
        With an infinite bound where k G N is not negative on the whole interval.

    Examples
    --------
    See `observed`.
    """
    x, gains = terms(signals, given), given.gains
    inside = (signals.t >= start - 1e-9) & (signals.t <= end + 1e-9)
    t, r, gain = signals.t[inside], x.r[inside], x.kGN[inside]
    with np.errstate(divide="ignore", invalid="ignore"):
        M = np.abs(((x.g + x.rest + x.Y_d) / x.kGN + signals["W_psi"] + x.Y_d)[inside])
    estimate, largest = float(np.min(signals["delta_hat"][inside])), float(np.max(M))
    rho = np.inf
    if np.all(gain < 0) and np.isfinite(largest) and estimate >= 0:
        rho = root(
            lambda z: gains.beta * z + estimate * float(smooth_sign(z, gains.tau)) - largest,
            0.0, largest / gains.beta + 1e-12,
        )  # fmt: skip
    return DirectBound(
        start=float(t[0]),
        end=float(t[-1]),
        rho=rho,
        bound=float(np.maximum(abs(r[0]), rho)),
        max_r=peak(t, r),
    )
