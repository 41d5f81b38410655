"""PID controller: the usual baseline."""

from __future__ import annotations

from ..equations import equation
from ..functions import clip
from ..params import param, record

__all__ = ["PID"]


@equation
def unlimited(x, u, p):
    """What the controller would ask for without a limit, and the error."""
    integral, slope = x
    x1, _, yd, _ = u
    e = x1 - yd
    return integral - p.k_p * e - p.k_d * slope, e


@equation
def limited(w, p):
    """The control input that is asked for, within the limit."""
    return clip(w, -p.u_max, p.u_max)


@record
class PID:
    """PID controller of the tracking error, with filtered derivative and anti-windup.

        w  = I - k_p e - k_d D,   e = x1 - yd,   u = min(max(w, -u_max), u_max)
        I' = -k_i e + (u - w) / T_t,   D' = (e' - D) / T_f,   e' = x2 - yd'

    Parallel form; the integral is tracked back while u is at its limit (back-calculation;
    Åström, Hägglund, PID Controllers, 2nd ed. 1995, section 3.5).  The derivative is measured, as
    it is for the paper's controller; the filter starts from D(0) = 0, so that no initial error
    kicks it.  PID assumes an input gain whose sign is known and positive; the adaptive controller
    of the paper assumes neither.

    Examples
    --------
    The outputs are the error and u, here at its limit:

    >>> controller = nlctl.block(nlctl.PID(k_p=10.0, u_max=20.0), "controller")
    >>> print(controller.output(0, [0.0, 0.0], [3.0, 0.0, 0.0, 0.0]))
    [  3. -20.]
    """

    k_p: float = param(10.0, unit="1", meaning="proportional gain", at_least=0)
    k_i: float = param(5.0, unit="1/s", meaning="integral gain", at_least=0)
    k_d: float = param(5.0, unit="s", meaning="derivative gain", at_least=0)
    T_f: float = param(0.02, unit="s", meaning="time constant of the derivative's filter", above=0)
    T_t: float = param(1.0, unit="s", meaning="tracking time of the anti-windup", above=0)
    u_max: float = param(20.0, unit="1", meaning="largest |u|", above=0)

    inputs = ("x1", "x2", "yd", "yd1")
    outputs = ("e", "u")
    states = ("integral", "slope")
    feedthrough = True

    @staticmethod
    @equation
    def update(t, x, u, p):
        """Integral with back-calculation, and the filter of the derivative."""
        _, slope = x
        _, x2, _, yd1 = u
        w, e = unlimited(x, u, p)
        return -p.k_i * e + (limited(w, p) - w) / p.T_t, (x2 - yd1 - slope) / p.T_f

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The tracking error, and the limited control input."""
        w, e = unlimited(x, u, p)
        return e, limited(w, p)

    @staticmethod
    @equation
    def switching(t, x, u, p):
        """Where u meets its limit."""
        w, _ = unlimited(x, u, p)
        return w + p.u_max, w - p.u_max
