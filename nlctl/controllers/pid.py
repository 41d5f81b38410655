"""PID controllers: of measured states, the usual baseline; and of (ref, y) or of an error."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..arguments import are_names, names_in, number, one_of
from ..equations import equation
from ..errors import ParameterError
from ..functions import clip
from ..params import param, record


@equation
def back_calculation(u, w, p):
    """How fast the integral is led back, (u - w) / T_t, where u is not the w that was asked for."""
    return (u - w) / p.T_t


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

    @equation
    def update(t, x, u, p):
        """Integral with back-calculation, and the filter of the derivative."""
        _, slope = x
        _, x2, _, yd1 = u
        w, e = unlimited(x, u, p)
        return -p.k_i * e + back_calculation(limited(w, p), w, p), (x2 - yd1 - slope) / p.T_f

    @equation
    def output(t, x, u, p):
        """The tracking error, and the limited control input."""
        w, e = unlimited(x, u, p)
        return e, limited(w, p)

    @equation
    def switching(t, x, u, p):
        """Where u meets its limit."""
        w, _ = unlimited(x, u, p)
        return w + p.u_max, w - p.u_max


@equation
def of_two_signals(u, p):
    """The error, and what is amplified and differentiated, of ref and y."""
    ref, y = u[0], u[1]
    return ref - y, p.b * ref - y, p.c * ref - y


@equation
def of_an_error(u, p):
    """The same of an error, which is all three."""
    return u[0], u[0], u[0]


@equation
def wound_up(rate, u, w, p):
    """The rate of an integral without anti-windup."""
    return rate


@equation
def led_back(rate, u, w, p):
    """The rate of an integral with back-calculation."""
    return rate + back_calculation(u, w, p)


@equation
def clamped(rate, u, w, p):
    """The rate of an integral that back-calculation stops at most."""
    back = back_calculation(u, w, p)
    return rate + clip(back, np.minimum(-rate, 0.0), np.maximum(-rate, 0.0))


_ANTI_WINDUP = {"back-calculation": led_back, "clamping": clamped, "none": wound_up}


@record
class PID2:
    """PID controller of (ref, y) in two degrees of freedom, or of an error e.

        w  = k_p (b ref - y) + I + k_d D
        u  = min(max(w, u_min), u_max),   e = ref - y
        I' = k_i e + a,   z' = D = (c ref - y - z) / T_f
        a  = (u - w) / T_t                   (back-calculation)
        a  = the same, until it stops I      (clamping)

    As a transfer function D is s / (T_f s + 1) of c ref - y.  The weights b and c of the set point
    leave the response to loads alone: b = c = 0 is I-PD, b = c = 1 is of the error (Åström,
    Hägglund, PID Controllers, 2nd ed. 1995, sections 3.4 and 3.5).  `standard_pid` takes their K,
    T_i, T_d and N.

    While u is at a limit, back-calculation leads the integral to where w exceeds it by T_t k_i e.
    Clamping (conditional integration) never moves it back: it slows the integration down to a
    stop, in which w exceeds the limit by T_t k_i |e| at most, so that with T_t to 0 it integrates
    only where u is not at the limit that e pushes to.  I is in the unit of u: another k_i or T_t
    during a run makes no jump.

    Parameters
    ----------
    anti_windup : {"back-calculation", "clamping", "none"}, optional
        What keeps the integral from winding up.

    Examples
    --------
    With b = 0 a step of the reference moves the integral alone:

    >>> law = nlctl.block(nlctl.PID2(k_p=2.0, k_i=3.0, k_d=0.0, b=0.0), "law")
    >>> print(law.output(0, [0.0, 0.0], [1.0, 0.0]), law.dynamics(0, [0.0, 0.0], [1.0, 0.0])[0])
    [0.] 3.0

    Of an error, in discrete time with 0.1 s:

    >>> law = nlctl.block(nlctl.PID2(signals=("e",), k_p=2.0, T_f=1.0), "law")
    >>> law = nlctl.sampled(nlctl.discretise(law, 0.1))
    """

    # Names of the reference and of the measured output; one name alone is an error.
    signals: tuple[str, ...] = ("ref", "y")
    # Name of one more input: what the plant gets instead of u, behind an actuator with other
    # limits, or by hand.  The integral then tracks that, so that the change from manual to
    # automatic makes no jump.
    applied: str = ""
    anti_windup: str = "back-calculation"
    k_p: float = param(1.0, unit="1", meaning="proportional gain")
    k_i: float = param(1.0, unit="1/s", meaning="integral gain")
    k_d: float = param(0.1, unit="s", meaning="derivative gain")
    T_f: float = param(0.05, unit="s", meaning="time constant of the derivative's filter", above=0)
    b: float = param(1.0, unit="1", meaning="weight of ref in the proportional part", at_least=0)
    c: float = param(1.0, unit="1", meaning="weight of ref in the derivative part", at_least=0)
    T_t: float = param(1.0, unit="s", meaning="tracking time of the anti-windup", above=0)
    u_min: float = param(-20.0, unit="1", meaning="lower limit of u")
    u_max: float = param(20.0, unit="1", meaning="upper limit of u")

    outputs = ("u",)
    states = ("integral", "filtered")
    vector = True

    def check(self) -> None:
        """Signals that fit, limits in order, and no parameter that nothing reads."""
        names = names_in(self.signals)
        if len(names) not in (1, 2) or not are_names(names):
            raise ParameterError(
                f"PID2 needs signals ('ref', 'y') or ('e',), by names of yours, got {names}"
            )
        object.__setattr__(self, "signals", names)
        one_of("PID2", "anti_windup", self.anti_windup, _ANTI_WINDUP)
        if not isinstance(self.applied, str):
            raise ParameterError(f"PID2 needs a name for applied, got {self.applied!r}")
        if self.applied and self.anti_windup == "none":
            raise ParameterError(
                f"PID2 needs an anti-windup that reads '{self.applied}', got applied="
                f"{self.applied!r} with anti_windup='none'"
            )
        if len(names) == 1 and (self.b, self.c) != (1.0, 1.0):
            raise ParameterError(
                f"PID2 needs b = 1 and c = 1 of an error, got {self.b:g} and {self.c:g}: weights "
                "of the reference need signals=('ref', 'y')"
            )
        if not self.u_min < self.u_max:
            raise ParameterError(f"PID2 needs u_min < u_max, got {self.u_min:g} and {self.u_max:g}")

    inputs = property(lambda self: (*self.signals, *([self.applied] if self.applied else [])))

    @cached_property
    def demand(self) -> Callable:
        """What the controller would ask for without a limit, the error, and the filtered slope."""
        read = of_an_error if len(self.signals) == 1 else of_two_signals

        @equation
        def demand(x, u, p):
            integral, filtered = x[0], x[1]
            e, amplified, differentiated = read(u, p)
            slope = (differentiated - filtered) / p.T_f
            return p.k_p * amplified + integral + p.k_d * slope, e, slope

        return demand

    @cached_property
    def update(self) -> Callable:
        """The integral with anti-windup, and the filter of the derivative."""
        demand, integral_rate = self.demand, _ANTI_WINDUP[self.anti_windup]

        @equation
        def update(t, x, u, p):
            w, e, slope = demand(x, u, p)
            return integral_rate(p.k_i * e, clip(w, p.u_min, p.u_max), w, p), slope

        @equation
        def tracking(t, x, u, p):
            w, e, slope = demand(x, u, p)
            return integral_rate(p.k_i * e, u[-1], w, p), slope

        return tracking if self.applied else update

    @cached_property
    def output(self) -> Callable:
        """The limited control input."""
        demand = self.demand

        @equation
        def output(t, x, u, p):
            return (clip(demand(x, u, p)[0], p.u_min, p.u_max),)

        return output


def standard_pid(
    K: float,
    T_i: float,
    T_d: float = 0.0,
    N: float = 10.0,
    *,
    T_t: float | None = None,
    **others: Any,
) -> PID2:
    """Make a PID controller of its standard form, K (1 + 1 / (T_i s) + T_d s / (1 + s T_d / N)).

    Parameters
    ----------
    K : float
        Gain.
    T_i : float
        Integral time (s).
    T_d : float, optional
        Derivative time (s).
    N : float, optional
        The derivative's filter has the time constant T_d / N.
    T_t : float, optional
        Tracking time (s); by default sqrt(T_i T_d), and T_i without a derivative (Åström,
        Hägglund, PID Controllers, 2nd ed. 1995, section 3.5).
    **others : object
        Other fields of `PID2`: `b`, `c`, `u_max`, `signals` and so on.

    Returns
    -------
    PID2
        With k_p = K, k_i = K / T_i, k_d = K T_d, T_f = T_d / N.

    Raises
    ------
    ParameterError
        If a time or N is not positive, or T_d is negative, or `PID2` refuses a value.
    UnknownNameError
        If `PID2` has no field of a name.

    Examples
    --------
    >>> law = nlctl.controllers.standard_pid(K=2.0, T_i=4.0, T_d=1.0, b=0.5)
    >>> print(law.k_p, law.k_i, law.k_d, law.T_f, law.T_t)
    2.0 0.5 2.0 0.1 2.0
    """
    who = "standard_pid"
    K, T_i = number(who, "K", K), number(who, "T_i", T_i, above=0)
    T_d, N = number(who, "T_d", T_d, at_least=0), number(who, "N", N, above=0)
    if T_t is None:
        T_t = float(np.sqrt(T_i * T_d)) if T_d else T_i
    T_f = (T_d or T_i) / N  # without a derivative any filter will do
    return PID2(k_p=K, k_i=K / T_i, k_d=K * T_d, T_f=T_f, T_t=T_t, **others)
