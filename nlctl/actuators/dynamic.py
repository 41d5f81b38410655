"""Actuators with dynamics: rate limiter, first-order and second-order lag."""

from ..arguments import number
from ..equations import equation
from ..functions import clip
from ..params import param, record
from .memories import FromUToV, output_of_state

LAGS_BEHIND = "its output is a state that follows u later, no function v = k(u, t) u + eps_u of u"


@record
class _Follower(FromUToV):
    """What actuators share whose output is their first state."""

    v0: float = 0.0  # Output at the start.

    states = ("v",)
    feedthrough = False
    no_split = LAGS_BEHIND
    output = output_of_state

    @property
    def initial(self) -> dict[str, float]:
        """The output starts from v0, and at rest."""
        return {"v": float(self.v0)}

    def check(self) -> None:
        """The output starts somewhere."""
        number(type(self).__name__, "v0", self.v0)


@record
class RateLimiter(_Follower):
    """Rate limiter: an output that follows u no faster than it may.

        v' = min(max(K (u - v), fall), rise)

    While |v' | is within the limits, v follows u with the time constant 1/K; an ideal limiter, the
    limit of large K, follows at once (Rundqwist, Stahl-Gunnarsson, Phase compensation of rate
    limiters, CCA 1996).  A ramp slower than the limits is followed u' / K behind it.  The price of
    a large K is a stiff state.

    It does not obey (2): v depends on the past of u.

    Examples
    --------
    A unit step is followed at 2 1/s, so it takes half a second:

    >>> limiter = nlctl.block(nlctl.RateLimiter(rise=2.0), "actuator")
    >>> response = nlctl.input_output_response(limiter, np.array([0.0, 0.25]), 1.0)
    >>> print(round(response.outputs[-1], 6))
    0.5
    """

    rise: float = param(1.0, unit="1/s", meaning="greatest v'", above=0)
    fall: float = param(-1.0, unit="1/s", meaning="least v'", below=0)
    K: float = param(100.0, unit="1/s", meaning="gain that follows u within the limits", above=0)

    @equation
    def update(t, x, u, p):
        """The limited rate."""
        (v,) = x
        return (clip(p.K * (u[0] - v), p.fall, p.rise),)

    @equation
    def switching(t, x, u, p):
        """Where the limits begin and end to count."""
        (v,) = x
        return p.K * (u[0] - v) - p.rise, p.K * (u[0] - v) - p.fall


@record
class Lag(_Follower):
    """First-order lag.

        v' = (k u - v) / T

    It does not obey (2): v depends on the past of u.

    Examples
    --------
    After one time constant 1 - 1/e of a step is there:

    >>> lag = nlctl.block(nlctl.Lag(T=0.05), "actuator")
    >>> response = nlctl.input_output_response(lag, np.array([0.0, 0.05]), 1.0)
    >>> print(round(response.outputs[-1], 6), round(1 - np.exp(-1), 6))
    0.632121 0.632121
    """

    k: float = param(1.0, unit="1", meaning="gain")
    T: float = param(0.05, unit="s", meaning="time constant", above=0)

    @equation
    def update(t, x, u, p):
        (v,) = x
        return ((p.k * u[0] - v) / p.T,)


@record
class SecondOrderLag(_Follower):
    """Second-order lag.

        v'' = omega^2 (k u - v) - 2 zeta omega v'

    zeta < 1 overshoots, by exp(-pi zeta / sqrt(1 - zeta^2)) of a step.  It does not obey (2): v
    depends on the past of u.

    Examples
    --------
    A step overshoots by exp(-pi zeta / sqrt(1 - zeta^2)), half a damped period after it:

    >>> lag = nlctl.block(nlctl.actuators.SecondOrderLag(omega=20.0, zeta=0.6), "actuator")
    >>> top = np.pi / (20.0 * np.sqrt(1 - 0.6**2))
    >>> response = nlctl.input_output_response(lag, np.array([0.0, top]), 1.0)
    >>> print(round(response.outputs[-1], 5), round(1 + np.exp(-np.pi * 0.6 / 0.8), 5))
    1.09478 1.09478
    """

    k: float = param(1.0, unit="1", meaning="gain")
    omega: float = param(20.0, unit="rad/s", meaning="natural frequency", above=0)
    zeta: float = param(0.7, unit="1", meaning="damping ratio", at_least=0)

    states = ("v", "v1")

    @equation
    def update(t, x, u, p):
        """The output's rate, and the oscillator."""
        v, v1 = x
        return v1, p.omega * (p.omega * (p.k * u[0] - v) - 2 * p.zeta * v1)
