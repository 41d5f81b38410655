"""Gains, weights and set with the smallest bound of the same proof, under a limit of |u|."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np
from scipy.optimize import minimize

from nlctl import native
from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number
from nlctl.attributes import described_record
from nlctl.errors import DivergedError, ParameterError
from nlctl.names import check_known
from nlctl.plants import coordinate_names
from nlctl.response import input_output_response
from nlctl.wording import counted

from ..intervals.box import Box, visited_box
from ..metrics import peak
from .bounds.decomposition import Decomposition, decompose
from .bounds.error_bounds import Gains, alpha_0, alpha_1, final_bound, initial_V, total_error
from .bounds.sector import sector
from .bounds.weights import approximation_error, network_on_grid, tightest_weights
from .certificate.gains import GainCandidate, tradeoff
from .constants import disturbance
from .examination import U_MAX, Examination, examine
from .loop.instrumented import observed, sharpest
from .loop.roles import Parts, read_parts
from .loop.signals import signals_of
from .loop.simulation import SAMPLING_INTERVAL

if TYPE_CHECKING:
    import pandas as pd

_BOUNDS = ("C_0", "ultimate")
_TOLERANCE = 1e-2  # of the branch and bounds in the search
# gains by part; the last two are those of a network
_SEARCHED = (("law", "beta"), ("robust", "tau"), ("robust", "gamma"), ("robust", "sigma_2"),
             ("weights", "Gamma"), ("weights", "sigma_1"))  # fmt: skip
OVER = 10.0  # weight of log(|u| / limit) in the cost


@described_record(made_by="tighten")
class Tightened:
    """The gains that were found, and the constants of the proof for them."""

    gains: dict[str, float]  # Values by qualified name, for ``params=`` of a run.
    # The run with these gains and the constants on its set, by branch and bound; a ledger can be
    # made of it.
    examination: Examination
    C_0: float  # From those constants, with Q along the run.
    ultimate: float
    u: float  # max |u| along the run, its limit, and the length of the runs (s).
    u_limit: float
    horizon: float
    # All gains that the search tried, in order: with bounds of the proof with the tightest W on the
    # set that the run visits, eps* on a grid.
    trials: tuple[GainCandidate, ...]

    @as_annotated
    def table(self, bound: str = "C_0") -> pd.DataFrame:
        """Return the trade-off curve: trials that no other beats in max |u| and in the bound.

        Parameters
        ----------
        bound : {"C_0", "ultimate"}, optional
            The bound that is meant.

        Returns
        -------
        pandas.DataFrame
            Sorted by u; columns u, C_0, ultimate and one per gain.
        """
        import pandas as pd

        best = tradeoff(self.trials, bound)
        rows = [{"u": t.u, "C_0": t.C_0, "ultimate": t.ultimate, **t.gains} for t in best]
        return pd.DataFrame(rows)


@dataclass(frozen=True, kw_only=True)
class _Search:
    loop: ct.InterconnectedSystem
    compiled: Any
    parts: Parts
    split: Decomposition
    times: np.ndarray
    max_steps: int


@as_annotated
def tighten(
    loop: ct.InterconnectedSystem,
    *,
    u_limit: float,
    bound: str = "C_0",
    horizon: float = 20.0,
    k: tuple[float, float] | None = None,
    evaluations: int = 60,
    max_steps: int = 100_000,
) -> Tightened:
    """Search W, the set and the gains for the smallest bound of the paper's proof.

    Searched are beta, tau, gamma, sigma_2, Gamma and sigma_1, by Nelder-Mead on their logarithms
    from the loop's own values; each trial is run, its set is what the run visits and a tenth,
    and W is the best one on that set.  The bound is as valid as the proof: over the horizon,
    with Q along the run.

    Parameters
    ----------
    loop : control.InterconnectedSystem
        As for `nlctl.analysis.lyapunov.ledger`.
    u_limit : float
        Limit of max |u| along the run.
    bound : {"C_0", "ultimate"}, optional
        What is to be small: C_0 of (36), or the ultimate bound sqrt(2 (alpha_0/alpha_1 + Q)).
    horizon : float, optional
        Length of the runs (s).
    k : (k_1, k_2), optional
        Bounds of the actuator's gain, see `decompose`.
    evaluations : int, optional
        Number of gains that are tried.
    max_steps : int, optional
        Steps of a run beyond which gains count as too stiff.

    Raises
    ------
    ParameterError
        If no gains that were tried keep the limit, or it is not positive.
    UnknownNameError
        If there is no such `bound`.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import tighten
    >>> controller = nlctl.controllers.ablations(nlctl.adaptive_neural(2))["no network"]
    >>> loop = nlctl.paper.example_1(controller=controller)
    >>> found = tighten(loop, u_limit=20.0, horizon=0.5, evaluations=4)
    >>> print(found.u <= 20.0, sorted(found.gains)[0])
    True controller.law.beta
    """
    check_known("bound", bound, _BOUNDS)
    u_limit = number("tighten", "u_limit", u_limit, above=0)
    horizon = number("tighten", "horizon", horizon, above=0)
    evaluations = integer("tighten", "evaluations", evaluations, at_least=1)
    parts = read_parts(loop)
    split = sharpest(decompose(parts.actuator, k=k, u_max=U_MAX))
    search = _Search(
        loop=loop,
        compiled=native.compile(observed(loop, parts, split, alpha_1(parts.gains))),
        parts=parts,
        split=split,
        times=np.linspace(0.0, horizon, round(horizon / SAMPLING_INTERVAL) + 1),
        max_steps=max_steps,
    )
    trials: list[GainCandidate] = []

    def cost(point: np.ndarray) -> float:
        trial = _trial(search, _gains(parts, point))
        trials.append(trial)
        value = getattr(trial, bound)
        if not np.isfinite(value + trial.u):
            return 1e3
        return float(np.log(value) + OVER * max(np.log(trial.u / u_limit), 0.0))

    first = _point(parts)
    simplex = np.vstack([first, first + np.diag(np.full(first.size, 0.7))])
    options = {"maxfev": evaluations, "initial_simplex": simplex, "adaptive": True}
    minimize(cost, first, method="Nelder-Mead", options=options)
    return _best(search, trials, bound, u_limit, k)


def _best(
    search: _Search, trials: list[GainCandidate], bound: str, u_limit: float, k: Any
) -> Tightened:
    """Examine the best trial that keeps the limit."""
    allowed = [t for t in trials if t.u <= u_limit and np.isfinite(getattr(t, bound))]
    if not allowed:
        raise ParameterError(
            f"of {counted(len(trials), 'set')} of gains none keeps max |u| <= {u_limit:g}: the "
            f"least is {min(t.u for t in trials):.4g}; raise u_limit or evaluations"
        )
    best, horizon = min(allowed, key=lambda t: getattr(t, bound)), float(search.times[-1])
    study = examine(search.loop, horizon, k=k, params=best.gains)
    Q = float(np.max(study.runs.first.signals["I"]))
    return Tightened(
        gains=best.gains,
        examination=study,
        C_0=study.constants.C_0(Q),
        ultimate=study.constants.ultimate(Q),
        u=best.u,
        u_limit=u_limit,
        horizon=horizon,
        trials=tuple(trials),
    )


def _point(parts: Parts) -> np.ndarray:
    searched = _SEARCHED if parts.gains.W_hat_0 else _SEARCHED[:4]
    values = [getattr(parts.gains, name) for _, name in searched]
    if not min(values) > 0:
        raise ParameterError(f"tighten starts from gains > 0, got {values}: choose other gains")
    return np.log(values)


def _gains(parts: Parts, point: np.ndarray) -> dict[str, float]:
    """Return the gains of a point of the search by qualified name."""
    values = zip(_SEARCHED, map(float, np.exp(point)), strict=False)
    return {f"{parts.paths[part]}.{name}": value for (part, name), value in values}


def _trial(search: _Search, gains: dict[str, float]) -> GainCandidate:
    """Run a set of gains, and bound r on the set that the run visits."""
    named = {name.rpartition(".")[2]: value for name, value in gains.items()}
    changed = dataclasses.replace(search.parts.gains, **named)
    params = {**gains, "integral.alpha_1": alpha_1(changed)}
    try:
        response = input_output_response(
            search.compiled, search.times, params=params, max_steps=search.max_steps
        )
    except DivergedError:
        return GainCandidate(gains=gains, C_0=np.inf, ultimate=np.inf, u=np.inf)
    signals = signals_of(response)
    Q = float(np.max(signals["I"]))
    C_0, ultimate = _bounds(search, changed, visited_box(response), Q)
    return GainCandidate(gains=gains, C_0=C_0, ultimate=ultimate, u=peak(signals.t, signals["u"]))


def _bounds(search: _Search, gains: Gains, box: Box, Q: float) -> tuple[float, float]:
    """C_0 and the ultimate bound with the tightest W on a box, eps* on a grid."""
    parts, n = search.parts, search.parts.order
    states = box.only(*coordinate_names(n))
    G_max = sector(parts.plant, box.only(*states.names, "v"), tol=_TOLERANCE).G_max
    d = disturbance(parts.plant, states, (0.0, np.inf), tol=_TOLERANCE).magnitude
    rest = float(total_error(G_max, search.split.eps_star, d, 0.0))
    if not np.isfinite(rest):
        return np.inf, np.inf
    W, eps = _weights(parts, gains, states, rest)
    delta, error = rest + eps, W - np.array(gains.W_hat_0)
    drive, rate = float(alpha_0(gains, delta, float(W @ W))), alpha_1(gains)
    V_0 = float(initial_V(gains, delta, float(error @ error)))
    return float(final_bound(drive, rate, V_0, Q)), float(final_bound(drive, rate, 0.0, Q))


def _weights(parts: Parts, gains: Gains, box: Box, rest: float) -> tuple[np.ndarray, float]:
    """Return the tightest weights on a coarse grid, and eps* there."""
    if not gains.W_hat_0:
        return np.zeros(0), approximation_error(
            parts.plant, None, (), box, tol=_TOLERANCE
        ).magnitude
    network = network_on_grid(parts.plant, parts.basis, box, per_side=max(7, 43 // parts.order))
    W = tightest_weights(network, gains, rest)
    return W, network.error(W)
