"""When the slow drift of zeta will burst the loop, as a number of a run that ends long before."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from nlctl import functions
from nlctl.errors import ParameterError

from ..loop.signals import Signals
from .property import lobe_around
from .slow_drift import slow_drift


@dataclass(frozen=True, kw_only=True)
class BurstForecast:
    """Time (s) at which zeta will have crossed its lobe, by the balance of its drift.

    A metric of `nlctl.ensemble_response` and of `experiment.Experiment`, for loops with the law
    (23), (24): see `nlctl.analysis.lyapunov.nussbaum.slow_drift`.  Infinite where the drift stops
    or reverses before; the time of the burst itself where it lies within the run.  A forecast, not
    a bound: it supposes that disturbance and reference continue as they were.

    Attributes
    ----------
    key, unit, meaning : str
    window : float
        Length (s) of the windows over which rates are averaged, whole periods of the reference; a
        run needs six at least, sampled every 10 ms.
    N : callable
        The Nussbaum function of the law.
    start, end : float
        Interval of time (s) that counts, from 0 on.

    Examples
    --------
    From zeta = 1 with r u = -0.4, and zeta at its lobe's place for each time, at a constant rate:

    >>> from nlctl.analysis.robustness import BurstForecast
    >>> N = nlctl.functions.nussbaum_integral
    >>> zetas = np.linspace(1.0, 3.0, 4001)  # a lobe of N
    >>> t = np.linspace(0.0, 100.0, 10001)
    >>> zeta = np.interp(0.4 * t, N(1.0) - N(zetas), zetas)
    >>> found = BurstForecast(window=5.0).function(t, zeta, np.ones(t.size), np.full(t.size, -0.4))
    >>> bool(abs(found / ((N(1.0) - N(3.0)) / 0.4) - 1) < 0.02)
    True
    """

    key: str = "burst"
    window: float = 4 * np.pi
    N: Callable[[float], float] = functions.nussbaum
    start: float = 0.0
    end: float = np.inf

    signals = ("zeta", "r", "u")
    unit = "s"
    meaning = "time at which zeta is forecast to leave its lobe"

    def function(self, t: np.ndarray, zeta: np.ndarray, r: np.ndarray, u: np.ndarray) -> float:
        """Return the forecast; NaN where zeta was in no lobe for five windows.

        Parameters
        ----------
        t : ndarray of shape (m,)
            Times (s).
        zeta, r, u : ndarray of shape (m,)
            Nussbaum argument, filtered error and control input.

        Returns
        -------
        float
            Time of the burst (s).
        """
        lobe = lobe_around(float(zeta[0]), self.N)
        beyond = np.flatnonzero(zeta >= lobe.high)
        if beyond.size:
            return float(t[beyond[0]])
        run = Signals(t=t, values={"zeta": zeta, "r": r, "u": u})
        try:
            return float(slow_drift(run, self.N, window=self.window).burst)
        except ParameterError:
            return np.nan
