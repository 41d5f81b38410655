r"""What Lemma 1 leaves true: the energy that N(zeta) zeta' = r u moves, and a safe horizon.

With k G in [l_min, l_max], whatever its sign changes and however zeta moves, (31) without its
first term gives

.. math:: V(t) \le V(0) + \alpha_0 t + \zeta(t) - \zeta(0) + l_{max} E_+(t) - l_{min} E_-(t),
   \quad E_\pm(t) = \int_0^t \max(\pm N(\zeta) \zeta', 0) \, d\tau .

In a lobe where N < 0, E_- - E_+ = A is the integral of \|N\| that zeta has crossed, and E_+ = D is
the pumping term: what oscillations of zeta give back, and what a gain that varies with time can
turn into growth of V.  Where zeta never falls, D = 0 there, and V >= 0 bounds the time that a lobe
lasts from below.
"""

from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid

from nlctl import functions
from nlctl.annotations import as_annotated
from nlctl.arguments import number
from nlctl.attributes import described_record
from nlctl.errors import ParameterError

from ..loop.signals import INTEGRATED, Margin, Signals, inequality, signals_of
from .property import GainFunction, antiderivative, lobes


@described_record(made_by="drift")
class Drift:
    """Energies that the Nussbaum term moves along a response."""

    time: np.ndarray  # (m,)
    zeta: np.ndarray
    r: np.ndarray
    # (m,): Integral of N from zeta(0) to zeta(t), which equals the integral of r u over time.
    phi: np.ndarray
    # (m,): E_+ and E_-, from the turning points among the samples: an oscillation of zeta between
    # two samples is not seen.
    gained: np.ndarray
    lost: np.ndarray
    # Largest distance between `phi` and the integral of r u (trapezoidal rule), over the largest
    # |phi|: how well the samples obey N(zeta) zeta' = r u.
    mismatch: float

    @property
    def monotone(self) -> bool:
        """Whether zeta never falls by more than rounding."""
        # Then V >= 0 alone makes the inequality at the top of this module a bound on the time
        # that a lobe lasts.
        fall = np.diff(self.zeta).min(initial=0.0)
        return bool(fall >= -1e-12 * np.max(np.abs(self.zeta)))


def finite_signal(signals: Signals, name: str) -> np.ndarray:
    """Return a signal over time, shape (m,), that is finite all the time."""
    values = signals[name]
    if not np.all(np.isfinite(values)):
        lost = float(signals.t[~np.isfinite(values)][0])
        raise ParameterError(f"{name} is not finite at t = {lost:g} s: end the response before")
    return values


@as_annotated
def drift(response: Any, N: GainFunction = functions.nussbaum) -> Drift:
    """Read the energies of the Nussbaum term off a response.

    Parameters
    ----------
    response : control.TimeResponseData
        With outputs zeta, r and u, of a loop with the law (23), (24); samples dense enough to
        see zeta turn (10 ms in the paper's examples).
    N : callable, optional
        The Nussbaum function of the law.

    Raises
    ------
    UnknownNameError, ParameterError
        If zeta, r or u is missing or not finite.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import drift, drift_margin
    >>> loop = nlctl.paper.example_1()
    >>> run = drift(nlctl.input_output_response(loop, np.linspace(0, 1, 101)))
    >>> margin = drift_margin(run, 1.0, 10.0, l_min=0.7, l_max=1.3)
    >>> print(run.mismatch < 0.01, run.monotone, margin.holds)
    True False True
    """
    if not isinstance(response, Signals) and not hasattr(response, "output_labels"):
        raise ParameterError(
            f"drift needs a response with the outputs zeta, r and u, got {type(response).__name__}"
        )
    signals = signals_of(response)
    zeta, r, u = (finite_signal(signals, name) for name in ("zeta", "r", "u"))
    integral = antiderivative(N)(zeta)
    steps = np.diff(integral, prepend=integral[0])
    phi = integral - integral[0]
    work = cumulative_trapezoid(r * u, signals.t, initial=0)
    largest = np.max(np.abs(phi))
    return Drift(
        time=signals.t,
        zeta=zeta,
        r=r,
        phi=phi,
        gained=np.cumsum(np.maximum(steps, 0)),
        lost=np.cumsum(np.maximum(-steps, 0)),
        mismatch=float(np.max(np.abs(phi - work)) / largest) if largest > 0 else 0.0,
    )


@as_annotated
def drift_margin(
    run: Drift,
    V_0: float,
    alpha_0: float,
    *,
    l_min: float,
    l_max: float,
    V: np.ndarray | None = None,
) -> Margin:
    """Return the margin of V(t) <= V(0) + alpha_0 t + zeta - zeta(0) + l_max E_+ - l_min E_-.

    Parameters
    ----------
    run : Drift
        The energies of a run, see `drift`.
    V_0, alpha_0 : float
        V(0), and the constant of (31) per second.
    l_min, l_max : float
        Bounds of k G, 0 < l_min <= l_max.
    V : ndarray of shape (m,), optional
        V of (21) over time; by default r^2 / 2, which is less.

    Returns
    -------
    Margin
        Right side less left side at each sample.

    Raises
    ------
    ParameterError
        If the bounds are not 0 < l_min <= l_max.

    Examples
    --------
    See `drift`.
    """
    _check_gain(l_min, l_max)
    V = run.r**2 / 2 if V is None else np.asarray(V)
    travelled = run.zeta - run.zeta[0]
    bound = V_0 + alpha_0 * (run.time - run.time[0]) + travelled
    return inequality(
        "(c)",
        "V <= V(0) + alpha_0 t + zeta - zeta(0) + l+ E+ - l- E-",
        run.time,
        V,
        bound + l_max * run.gained - l_min * run.lost,
        scale=float(np.max(V)),
        tolerance=INTEGRATED,
    )


@described_record
class SafeHorizon:
    """Time before which zeta cannot have left its lobe."""

    time: float  # Seconds; 0 if the inequality excludes nothing.
    zeta: float  # End of the lobe, which zeta does not reach before.


@as_annotated
def safe_horizon(
    V_0: float,
    alpha_0: float,
    *,
    l_min: float,
    l_max: float,
    zeta_0: float = 1.0,
    N: GainFunction = functions.nussbaum,
) -> SafeHorizon:
    """Return the time that zeta needs at least to cross the first lobe in which N < 0.

        T = [l_min int_{N<0} |N| - l_max int_{N>0} N - (zeta_1 - zeta_0) - V(0)] / alpha_0

    with the integrals from zeta_0 to the lobe's upper end zeta_1.  It holds for k G > 0 in
    [l_min, l_max] and a **monotone** zeta, as `MonotoneNussbaumLaw` has; for the paper's law only
    if zeta happens to be monotone.  For a constant gain l_min = l_max it holds for any zeta.

    Parameters
    ----------
    V_0, alpha_0 : float
        V(0), and the constant of (31), > 0.
    l_min, l_max : float
        Bounds of k G.
    zeta_0 : float, optional
        zeta(0).
    N : callable, optional
        Nussbaum function.

    Raises
    ------
    ParameterError
        If a bound is refused, or N has no whole lobe with N < 0 within 8 above zeta_0.

    Examples
    --------
    With a constant gain and no V(0) it is what the lobe holds, over alpha_0:

    >>> from nlctl.analysis.lyapunov import nussbaum_property, safe_horizon
    >>> lobe = nussbaum_property().lobes[1]
    >>> found = safe_horizon(0.0, 0.1, l_min=1.0, l_max=1.0)
    >>> print(round(found.time, 3), round((abs(lobe.integral) - (lobe.high - lobe.low)) / 0.1, 3))
    3902.555 3902.555
    """
    _check_gain(l_min, l_max)
    number("safe_horizon", "V_0", V_0, at_least=0)
    number("safe_horizon", "zeta_0", zeta_0)
    number("safe_horizon", "alpha_0", alpha_0, above=0)
    crossed = lobes(N, zeta_0, zeta_0 + 8.0)
    falling = [i for i, lobe in enumerate(crossed[:-1]) if lobe.sign < 0]
    if not falling:
        raise ParameterError(f"N has no whole lobe with N < 0 in [{zeta_0:g}, {zeta_0 + 8:g}]")
    way = crossed[: falling[0] + 1]
    kept = sum(l_min * lobe.budget if lobe.sign < 0 else -l_max * lobe.budget for lobe in way)
    zeta_1 = way[-1].high
    return SafeHorizon(time=max((kept - (zeta_1 - zeta_0) - V_0) / alpha_0, 0.0), zeta=zeta_1)


def _check_gain(l_min: float, l_max: float) -> None:
    if not 0 < l_min <= l_max:
        raise ParameterError(f"k G needs 0 < l_min <= l_max, got {l_min:g} and {l_max:g}")
