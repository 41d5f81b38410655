r"""The slow drift of the Nussbaum argument: where it leads, and when.

The law (23), (24) obeys N(zeta) zeta' = r u.  While zeta crosses a lobe in which N has the right
sign (k G N < 0), the loop spends the lobe's budget :math:`\int |N| d\zeta`,

.. math:: \frac{d}{dt} \int |N| \, d\zeta = -r u,

and when the budget is spent the loop has the wrong sign: r grows until zeta has crossed the next
lobe.  The right-hand side has a mean because u must work against the disturbance with a finite
gain, r ~ u / (beta N), and because r follows Y_d, which the gain does not change.  Averaged over
windows it is a balance,

.. math:: \frac{dA}{dt} = p \left\langle \frac1{|N|} \right\rangle - q,

so that the drift stops where |N| = p / q, if the lobe has such a place; otherwise it continues
until the budget is spent.  p and q are fitted to a response.
"""

import itertools
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np
from scipy.integrate import quad, trapezoid

from nlctl import functions
from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number, of_type
from nlctl.attributes import described_record
from nlctl.diagrams import known_system, state_names
from nlctl.diagrams.points import OF_RESPONSES, agree, rates_and_outputs
from nlctl.errors import DiagramError, ParameterError
from nlctl.upstream.systems import SystemResponse

from ...response_of_loop import check_response, check_shape, own_outputs, own_parameters
from ..loop.roles import read_parts
from .energy import Drift, drift
from .property import GainFunction, Lobe, antiderivative, lobe_around, root

_SIGNALS = ("zeta", "r", "u")


def law_of_response(loop: ct.InterconnectedSystem, response: SystemResponse) -> GainFunction:
    """Return the Nussbaum function of the loop that a response is of."""
    # The response is compared with the loop, see `nlctl.analysis.response_of_loop`, and at its
    # samples N(zeta) zeta' with r u, zeta' from the diagram's own right-hand side.
    loop = known_system("slow_drift", loop)
    check_shape(loop, response, _SIGNALS)
    params = own_parameters(loop, response)
    parts = read_parts(loop, params=params)
    check_response(loop, response, params, _SIGNALS)
    if "zeta" not in parts.law.states or not hasattr(parts.law, "N"):
        raise DiagramError(
            f"slow_drift is about laws with a Nussbaum argument, got {type(parts.law).__name__}"
        )
    place = state_names(loop).index(f"{parts.paths['law']}.zeta")
    evaluate = rates_and_outputs(loop, params)
    for i, signals in own_outputs(loop, response, params):
        t, x = float(response.time[i]), np.asarray(response.states)[:, i]
        rate = float(evaluate(t, x, np.zeros(0))[0][place])
        a, b = parts.law.N(signals["zeta"]) * rate, signals["r"] * signals["u"]
        if not agree(a, b, OF_RESPONSES, relative=OF_RESPONSES):
            raise DiagramError(
                f"N(zeta) zeta' and r u of '{loop.name}' differ at t = {t:g} s: {a:.9g} and {b:.9g}"
            )
    return parts.law.N


SAMPLED = 0.1  # mismatch beyond which the samples do not show that N is that of the law
ERRORS, MODEL = 2.0, 0.05  # standard errors, and share of the time left, that the range allows
BLOCKS = 5  # fits that leave one of so many parts out give the range of a prediction


@dataclass(frozen=True, kw_only=True)
class Balance:
    """The fitted law of the drift, A' = p / |N| - q."""

    # fitted to the mean rates over the windows, by least squares
    p: float
    q: float
    residual: float  # root mean square of what the fit leaves, in the unit of the rate (1/s)

    def rate(self, N: float) -> float:
        """Rate A' (1/s) at a value of N."""
        return self.p / abs(N) - self.q

    def __str__(self) -> str:
        return f"A' = {self.p:.4g} / |N| {'+' if self.q < 0 else '-'} {abs(self.q):.4g}"


@described_record(made_by="slow_drift")
class SlowDrift:
    """Where zeta stands in its lobe at the end of a response, and where it drifts."""

    time: float  # End of the response (s), and zeta there.
    zeta: float
    lobe: Lobe  # The lobe that zeta lies in.
    spent: float  # A = int |N| dzeta from the lobe's lower end.
    window: float  # Length of a window (s).
    rates: tuple[float, ...]  # Mean of A' over each window (1/s), the first windows left out.
    # Forecast of the time (s) at which the budget is spent, infinite where the drift stops or
    # reverses before.
    burst: float
    # The earliest and the latest such time, when mean rate and dependence on 1/|N| are moved by two
    # standard errors each, and the time that is left by 5 % more. The range is meant to
    # hold the burst in nine of ten loops at least, and has done so in simulated ones
    # (tests/lyapunov/test_slow_drift_forecast.py), as long as disturbance and reference continue as
    # they were.
    burst_range: tuple[float, float]
    balance: Balance  # The law fitted to all windows.
    rest: float | None  # zeta at which the balance stops the drift; None if not in this lobe.
    # Its range over fits with a part of the windows left out; None likewise.
    rest_range: tuple[float, float] | None
    peak: float  # max |r| of the burst, sqrt(2 k G |int N|) over the next lobe.
    # Largest distance between int |N| dzeta and -int r u dt over the response, over the largest of
    # them: how well the samples obey N zeta' = r u.
    mismatch: float

    @property
    def share(self) -> float:
        """Share of the lobe's budget that is spent."""
        return self.spent / self.lobe.budget

    @property
    def recent(self) -> np.ndarray:
        """Rates (1/s) of the last windows, from which "the present rate" is taken."""
        return _recent(np.array(self.rates))

    @property
    def verdict(self) -> str:
        """One of "drifts", "settles", "reversed", "undecided".

        "reversed": the mean rate of the last windows is not positive; "settles": it is, and
        in all fits the drift stops in this lobe; "drifts": in none; "undecided" otherwise.
        """
        if not self.recent.mean() > 0:
            return "reversed" if self.recent.mean() <= 0 else "undecided"
        if self.rest is None:
            return "drifts" if self.rest_range is None else "undecided"
        return "settles" if self.rest_range and self.rest_range[1] < self.lobe.high else "undecided"

    def __str__(self) -> str:
        lines = [
            f"at {self.time:.6g} s zeta = {self.zeta:.6g} in ({self.lobe.low:.6g}, "
            f"{self.lobe.high:.6g}): {self.spent:.6g} of {self.lobe.budget:.6g} spent "
            f"({100 * self.share:.3g} %)",
            f"the rate is {self.recent.mean():.4g} 1/s: {self.verdict}",
            f"balance: {self.balance}",
        ]
        if self.rest is not None:
            span = " to ".join(f"{z:.5g}" for z in self.rest_range or ())
            lines.append(f"by the balance the drift stops at zeta = {self.rest:.5g} ({span})")
        else:
            lines.append("by the balance it does not stop in this lobe")
        if np.isfinite(self.burst):
            span = " to ".join(f"{t:.4g}" for t in self.burst_range)
            lines.append(f"the budget lasts until about {self.burst:.4g} s ({span} s)")
        if not self.mismatch <= SAMPLED:
            lines.append(
                f"between the samples int N dzeta and int r u differ by {self.mismatch:.2g} of the "
                "larger: sample more densely, or give the loop, to know that N is that of the law"
            )
        lines.append(f"a burst would reach max |r| = {self.peak:.4g}")
        return "\n".join(lines)


@as_annotated
def burst_peak(lobe: Lobe, kG: float) -> float:
    """Return max |r| = sqrt(2 k G |int N|) of a burst through a lobe of the wrong sign.

    r^2/2 grows by int k G N dzeta, against which disturbances and beta r are small.

    Parameters
    ----------
    lobe : Lobe
        Where N has the wrong sign.
    kG : float
        Product of actuator gain k and input gain G, > 0.

    Returns
    -------
    float
        In the unit of r.

    Raises
    ------
    ParameterError
        If it is not a lobe, or `kG` is not positive.

    Examples
    --------
    Through the lobe of the paper's N from 1 to 3, with a gain of 1:

    >>> from nlctl.analysis.lyapunov import burst_peak, nussbaum_property
    >>> lobe = nussbaum_property().lobes[1]
    >>> print(round(burst_peak(lobe, 1.0), 4), round((2 * abs(lobe.integral)) ** 0.5, 4))
    28.0091 28.0091
    """
    of_type("burst_peak", "lobe", lobe, Lobe, "lobe_around(zeta)")
    number("burst_peak", "kG", kG, above=0)
    return float(np.sqrt(2 * kG * lobe.budget))


@as_annotated
def slow_drift(
    response: Any,
    N: GainFunction = functions.nussbaum,
    *,
    loop: Any = None,
    window: float = 16 * np.pi,
    skip: int = 1,
    kG: float = 1.0,
) -> SlowDrift:
    """Predict from a response how the slow drift of zeta continues.

    The prediction supposes that disturbance and reference stay as they were; a chirp does not.

    Parameters
    ----------
    response : control.TimeResponseData
        Of a loop with the law (23), (24), with outputs zeta, r and u; samples dense enough to
        see zeta turn (10 ms for the paper's examples).
    N : callable, optional
        The Nussbaum function of the law.
    loop : control.InterconnectedSystem or Compiled, optional
        The loop that the response is of: N is then that of its law, and it is checked that the
        loop is one that this is about.
    window : float, optional
        Length of the windows (s) over which rates are averaged; whole periods of the reference,
        of which the default holds four for the paper's.
    skip : int, optional
        Windows at the beginning that are left out, since the loop still settles.
    kG : float, optional
        Input gain for the peak of a burst.

    Raises
    ------
    DiagramError
        If `loop` is not one that this is about.
    ParameterError
        If the response is not one of `loop`, zeta, r or u is not finite, fewer than 5 windows are
        left, or zeta lies in a lobe without end.

    Examples
    --------
    From zeta = 1 with r u = -0.4, where A grows at that rate through the lobe of N up to zeta = 3:

    >>> from nlctl.analysis.lyapunov import slow_drift
    >>> N = nlctl.functions.nussbaum_integral
    >>> zetas, t = np.linspace(1.0, 3.0, 4001), np.linspace(0.0, 100.0, 10001)
    >>> zeta = np.interp(0.4 * t, N(1.0) - N(zetas), zetas)
    >>> outputs = np.array([zeta, np.ones(t.size), np.full(t.size, -0.4)])
    >>> labels = ["zeta", "r", "u"]
    >>> run = ct.TimeResponseData(t, outputs, issiso=False, output_labels=labels)
    >>> found = slow_drift(run, window=5.0)
    >>> bool(abs(found.burst / ((N(1.0) - N(3.0)) / 0.4) - 1) < 0.02)
    True
    """
    N = N if loop is None else law_of_response(loop, response)
    run = drift(response, N)
    number("slow_drift", "window", window, above=0)
    integer("slow_drift", "skip", skip, at_least=0)
    lobe = lobe_around(float(run.zeta[-1]), N)
    rates, inverse = _windows(run, N, lobe, window, skip)
    balance = _fitted(rates, inverse)
    rest, rest_range = _rest(rates, inverse, N, lobe)
    spent = abs(float(np.diff(antiderivative(N)(np.array([lobe.low, run.zeta[-1]])))[0]))
    time = float(run.time[-1])
    stops = rest is not None and rest_range is not None and rest_range[1] < lobe.high
    lasts = _forecast(rates, inverse, N, lobe, float(run.zeta[-1]))
    if stops or not _recent(rates).mean() > 0:
        lasts = (np.inf, lasts[1], np.inf)
    return SlowDrift(
        time=time,
        zeta=float(run.zeta[-1]),
        lobe=lobe,
        spent=spent,
        window=window,
        rates=tuple(map(float, rates)),
        burst=time + lasts[0],
        burst_range=(time + lasts[1], time + lasts[2]),
        balance=balance,
        rest=rest,
        rest_range=rest_range,
        peak=burst_peak(lobe_around(lobe.high, N), kG),
        mismatch=run.mismatch,
    )


def _recent(rates: np.ndarray) -> np.ndarray:
    """Return the last fifth of the windows, two at least."""
    return rates[-max(2, rates.size // BLOCKS) :]


def _windows(
    run: Drift, N: GainFunction, lobe: Lobe, window: float, skip: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean of A' and of 1/|N| over each window that zeta spends in the lobe."""
    start = run.time[0] + skip * window
    count = int(np.floor((run.time[-1] - start) / window * (1 + 1e-12)))
    edges = run.time[-1] - window * np.arange(max(count, 0), -1, -1)
    at = np.searchsorted(run.time, edges - 1e-9 * window)
    values = np.abs(np.vectorize(N)(run.zeta))
    rates, inverse = [], []
    for a, b in itertools.pairwise(at):
        if np.all((run.zeta[a : b + 1] > lobe.low) & (run.zeta[a : b + 1] < lobe.high)):
            length = run.time[b] - run.time[a]
            rates.append(lobe.sign * (run.phi[b] - run.phi[a]) / length)
            inverse.append(trapezoid(1 / values[a : b + 1], run.time[a : b + 1]) / length)
    if len(rates) < BLOCKS:
        raise ParameterError(
            f"slow_drift needs {BLOCKS} windows of {window:g} s within a lobe, got {len(rates)} in "
            f"[{run.time[0]:g}, {run.time[-1]:g}] s: take a longer response or shorter windows"
        )
    return np.array(rates), np.array(inverse)


def _fitted(rates: np.ndarray, inverse: np.ndarray) -> Balance:
    """Fit A' = p <1/|N|> - q by least squares."""
    columns = np.column_stack([inverse, -np.ones_like(inverse)])
    (p, q), *_ = np.linalg.lstsq(columns, rates, rcond=None)
    left = rates - columns @ (p, q)
    return Balance(p=float(p), q=float(q), residual=float(np.sqrt(np.mean(left**2))))


def _partial_fits(rates: np.ndarray, inverse: np.ndarray) -> list[Balance]:
    """Return fits that leave a part of the windows out, one after the other."""
    parts = np.array_split(np.arange(rates.size), BLOCKS)
    return [_fitted(np.delete(rates, part), np.delete(inverse, part)) for part in parts]


def _rest_of(balance: Balance, N: GainFunction, lobe: Lobe) -> float | None:
    """Return the zeta of the lobe, below its extremum, at which the balance stops the drift."""
    # Beyond the extremum |N| falls again, and the same |N| is passed on the way to the burst.
    if not (balance.p > 0 and balance.q > 0):
        return None
    gain = balance.p / balance.q
    if gain >= abs(lobe.extremum):
        return None
    return root(lambda z: abs(N(z)) - gain, lobe.low, lobe.place)


def _rest(
    rates: np.ndarray, inverse: np.ndarray, N: GainFunction, lobe: Lobe
) -> tuple[float | None, tuple[float, float] | None]:
    """Return the resting zeta, and its range over fits that leave a part of the windows out."""
    # A fit in which the drift does not stop counts as the lobe's upper end.
    partial = [_rest_of(balance, N, lobe) for balance in _partial_fits(rates, inverse)]
    rests = [lobe.high if rest is None else rest for rest in partial]
    rest = _rest_of(_fitted(rates, inverse), N, lobe)
    if rest is None and min(rests) == lobe.high:
        return None, None
    return rest, (min(rests), max(rests))


def _forecast(
    rates: np.ndarray, inverse: np.ndarray, N: GainFunction, lobe: Lobe, zeta: float
) -> tuple[float, float, float]:
    """Return how long the budget lasts, and the shortest and the longest time that it may."""
    # The rate is taken as <A'> + p (1/|N| - <1/|N|>), p >= 0. Windows that saw little of the lobe
    # say little about p: it is shrunk by p^2 / (p^2 + its variance), towards a constant rate.
    mean, centre = float(rates.mean()), float(inverse.mean())
    slope, of_slope, of_mean = _slope(rates, inverse)
    p = max(slope, 0.0) ** 3 / (slope**2 + of_slope**2) if slope else 0.0

    def lasts(rate: float, slope: float) -> float:
        balance = Balance(p=slope, q=slope * centre - rate, residual=0.0)
        if balance.rate(lobe.extremum) <= 0 and zeta < lobe.place:
            return np.inf
        slowest = balance.rate(N(zeta) if zeta > lobe.place else lobe.extremum)
        if not slowest > 0:
            return np.inf
        return quad(lambda z: abs(N(z)) / balance.rate(N(z)), zeta, lobe.high, limit=200)[0]

    slopes = {max(p - ERRORS * of_slope, 0.0), p, max(slope + ERRORS * of_slope, 0.0)}
    moved = [lasts(mean + s * of_mean, q) for s in (-ERRORS, ERRORS) for q in slopes]
    return lasts(mean, p), min(moved) * (1 - MODEL), max(moved) * (1 + MODEL)


def _slope(rates: np.ndarray, inverse: np.ndarray) -> tuple[float, float, float]:
    """Return p of the balance, and the standard errors of p (jackknife) and of the mean rate."""
    fit, slopes = _fitted(rates, inverse), [one.p for one in _partial_fits(rates, inverse)]
    of_slope = np.sqrt((BLOCKS - 1) * np.var(slopes))
    freedom = max(rates.size - 2, 1)
    return fit.p, float(of_slope), fit.residual / float(np.sqrt(freedom))
