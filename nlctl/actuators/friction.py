"""Friction as a force law of velocity, from Coulomb's to LuGre, and Bouc-Wen's hysteresis."""

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..params import param, record
from .memories import Remembering, output_of_state, relaxation

FORCE_LAW = "it is a force law of a velocity, no actuator from u to v"


@equation
def stribeck_level(velocity, p):
    """Steady friction level, F_c + (F_s - F_c) exp(-(velocity / v_s)^2)."""
    return p.F_c + (p.F_s - p.F_c) * np.exp(-((velocity / p.v_s) ** 2))


@equation
def bristle_rate(z, velocity, p):
    """Rate z' at which the bristles of the LuGre model bend."""
    return velocity - p.sigma_0 * np.abs(velocity) * z / stribeck_level(velocity, p)


def check_levels(spec: "LuGre | Stribeck | StickSlip") -> None:
    """Friction at rest is not below that of motion."""
    if not spec.F_c <= spec.F_s:
        raise ParameterError(
            f"{type(spec).__name__} needs F_c <= F_s, got {spec.F_c:g} and {spec.F_s:g}"
        )


@record
class _ForceLaw:
    """What force laws of a velocity share."""

    inputs = ("velocity",)
    outputs = ("force",)
    no_split = FORCE_LAW

    @equation
    def switching(t, x, u, p):
        """Where the velocity changes its sign."""
        return (u[0],)


@record
class Coulomb(_ForceLaw):
    """Coulomb and viscous friction.

        force = F_c sign(velocity) + sigma_2 velocity

    Where it holds a mass at rest a run slides along the sign, if it may, and else ends as
    chattering, see `nlctl.input_output_response`; `StickSlip` and `LuGre` stick by themselves.

    Examples
    --------
    >>> friction = nlctl.block(nlctl.actuators.Coulomb(F_c=1.0, sigma_2=0.5), "friction")
    >>> [float(friction.output(0, [], [velocity])[0]) for velocity in (-2.0, 0.0, 2.0)]
    [-2.0, 0.0, 2.0]
    """

    F_c: float = param(1.0, unit="N", meaning="Coulomb friction", above=0)
    sigma_2: float = param(0.4, unit="N s/m", meaning="viscous friction", at_least=0)

    @equation
    def output(t, x, u, p):
        (velocity,) = u
        return (p.F_c * np.sign(velocity) + p.sigma_2 * velocity,)


@record
class Stribeck(_ForceLaw):
    """Friction that falls from rest to motion (Stribeck effect).

        force = g(velocity) sign(velocity) + sigma_2 velocity
        g(velocity) = F_c + (F_s - F_c) exp(-(velocity / v_s)^2)

    (Armstrong-Hélouvry, Dupont, Canudas de Wit, Automatica 30, 1994, p. 1083.)  With F_s = F_c it
    is `Coulomb`.  The friction that holds a mass at rest is F_s at most.

    Examples
    --------
    Just behind rest it is F_s, far from it F_c and the viscous part:

    >>> friction = nlctl.block(nlctl.actuators.Stribeck(F_c=1.0, F_s=1.5, sigma_2=0.5), "friction")
    >>> [round(float(friction.output(0, [], [velocity])[0]), 6) for velocity in (1e-9, 2.0)]
    [1.5, 2.0]
    """

    F_c: float = param(1.0, unit="N", meaning="Coulomb friction", above=0)
    F_s: float = param(1.5, unit="N", meaning="static friction", above=0)
    v_s: float = param(1e-3, unit="m/s", meaning="Stribeck velocity", above=0)
    sigma_2: float = param(0.4, unit="N s/m", meaning="viscous friction", at_least=0)

    def check(self) -> None:
        """Static friction is not below Coulomb friction."""
        check_levels(self)

    @equation
    def output(t, x, u, p):
        (velocity,) = u
        return (stribeck_level(velocity, p) * np.sign(velocity) + p.sigma_2 * velocity,)


@equation
def stick_mode(velocity, applied, mode, p):
    """1 or -1 while a contact slips in that direction, 0 while it sticks."""
    kept = np.where(mode < -0.5, -1.0, np.where(mode > 0.5, 1.0, 0.0 * mode))  # NaN stays
    onwards = kept * velocity
    pushed = np.where(np.abs(applied) > p.F_s, np.sign(applied), 0.0 * applied)
    released = np.where(np.abs(velocity) > p.v_rest, np.sign(velocity), pushed)
    return np.where(onwards > 0, kept, released + 0.0 * onwards)


@record
class StickSlip(Remembering):
    """Coulomb friction that sticks: the force that holds a mass at rest, up to a limit.

        force = applied                              it sticks
                F_c s + sigma_2 velocity             it slips in the direction s = +-1

    It sticks from where its velocity becomes 0 while |applied| <= F_s, and slips from where
    |applied| exceeds F_s (Karnopp, Journal of Dynamic Systems, Measurement, and Control 107, 1985,
    p. 100), or the velocity is beyond what counts as rest.  ``applied`` is the sum of all other
    forces on the mass.  It must not depend on this force: that would be an algebraic loop.

    The mode s is a memory, and both changes are located as events: nothing chatters, and the
    velocity at rest is 0 but for what is left of it where the event is located.  In plain
    `control.input_output_response` the mode relaxes with 1000/s, and friction is 0.7 ms late.

    Parameters
    ----------
    v0 : float, optional
        Mode at the start, 0, 1 or -1: the initial value of the state ``mode``.

    Examples
    --------
    At rest it takes up what is applied, up to F_s:

    >>> friction = nlctl.block(nlctl.actuators.StickSlip(F_c=1.0, F_s=1.5), "friction")
    >>> [float(friction.output(0, [0.0], [0.0, applied])[0]) for applied in (0.7, -1.4, 1.6)]
    [0.7, -1.4, 1.0]
    """

    F_c: float = param(1.0, unit="N", meaning="Coulomb friction", above=0)
    F_s: float = param(1.5, unit="N", meaning="static friction", above=0)
    sigma_2: float = param(0.4, unit="N s/m", meaning="viscous friction", at_least=0)
    v_rest: float = param(1e-6, unit="m/s", meaning="velocity up to which it is at rest", above=0)

    inputs = ("velocity", "applied")
    outputs = ("force",)
    states = ("mode",)
    no_split = FORCE_LAW

    def check(self) -> None:
        """Static friction is not below Coulomb friction; one of three modes at the start."""
        super().check()
        check_levels(self)
        if self.v0 not in (-1, 0, 1):
            raise ParameterError(f"StickSlip needs v0 to be 0, 1 or -1, got {self.v0:g}")

    @equation
    def output(t, x, u, p):
        """The force that holds, or slips."""
        (mode,) = x
        velocity, applied = u
        now = stick_mode(velocity, applied, mode, p)
        slipping = p.F_c * now + p.sigma_2 * velocity
        return (np.where(now == 0, applied, slipping),)

    @equation
    def commit(t, x, u, p):
        (mode,) = x
        return (stick_mode(u[0], u[1], mode, p),)

    update = relaxation(commit)

    @equation
    def switching(t, x, u, p):
        """Where the mass comes to rest, and where it may break away."""
        velocity, applied = u
        forces = applied - p.F_s, applied + p.F_s
        return (velocity, velocity - p.v_rest, velocity + p.v_rest) + forces


@record
class Dahl(_ForceLaw):
    """Dahl's model of friction before sliding.

        force' = sigma_0 (velocity - |velocity| force / F_c)

    that is d force / d position = sigma_0 (1 - sign(velocity) force / F_c) (Dahl, AIAA Journal 14,
    1976, p. 1675, with the exponent 1).  |force| <= F_c if it is so at the start.  The force is a
    function of the path alone: it is rate-independent.

    Examples
    --------
    Along a path in one direction the force tends to F_c as 1 - exp(-sigma_0 x / F_c):

    >>> friction = nlctl.block(nlctl.actuators.Dahl(sigma_0=2.0, F_c=1.0), "friction")
    >>> response = nlctl.input_output_response(friction, np.array([0.0, 1.0]), 1.0)
    >>> print(round(response.outputs[-1], 6), round(1 - np.exp(-2), 6))
    0.864665 0.864665
    """

    sigma_0: float = param(1e5, unit="N/m", meaning="stiffness before sliding", above=0)
    F_c: float = param(1.0, unit="N", meaning="Coulomb friction", above=0)

    states = ("force",)
    feedthrough = False
    output = output_of_state

    @equation
    def update(t, x, u, p):
        """The force along the path."""
        (force,) = x
        (velocity,) = u
        return (p.sigma_0 * (velocity - np.abs(velocity) * force / p.F_c),)


@record
class LuGre(_ForceLaw):
    """LuGre model of friction: bristles that bend, and slip.

        z'    = velocity - sigma_0 |velocity| z / g(velocity)
        force = sigma_0 z + sigma_1 z' + sigma_2 velocity
        g(velocity) = F_c + (F_s - F_c) exp(-(velocity / v_s)^2)

    (Canudas de Wit, Olsson, Åström, Lischinsky, IEEE Transactions on Automatic Control 40, 1995,
    p. 419; defaults from their table 1.)  |z| <= F_s / sigma_0 if it is so at the start.  At a
    constant velocity the force tends to that of `Stribeck`.

    Examples
    --------
    At a constant velocity the force tends to that of `Stribeck`:

    >>> friction = nlctl.block(nlctl.actuators.LuGre(), "friction")
    >>> response = nlctl.input_output_response(friction, np.array([0.0, 0.1]), 0.01)
    >>> steady = nlctl.block(nlctl.actuators.Stribeck(), "steady").output(0, [], [0.01])
    >>> print(round(response.outputs[-1], 6), steady.round(6))
    1.004 [1.004]
    """

    sigma_0: float = param(1e5, unit="N/m", meaning="stiffness of the bristles", above=0)
    sigma_1: float = param(
        float(np.sqrt(1e5)), unit="N s/m", meaning="damping of the bristles", at_least=0
    )
    sigma_2: float = param(0.4, unit="N s/m", meaning="viscous friction", at_least=0)
    F_c: float = param(1.0, unit="N", meaning="Coulomb friction", above=0)
    F_s: float = param(1.5, unit="N", meaning="static friction", above=0)
    v_s: float = param(1e-3, unit="m/s", meaning="Stribeck velocity", above=0)

    states = ("z",)

    def check(self) -> None:
        """Static friction is not below Coulomb friction."""
        check_levels(self)

    @equation
    def update(t, x, u, p):
        """The mean deflection of the bristles."""
        (z,) = x
        (velocity,) = u
        return (bristle_rate(z, velocity, p),)

    @equation
    def output(t, x, u, p):
        """The force of bent bristles and of viscosity."""
        (z,) = x
        (velocity,) = u
        damping = p.sigma_1 * bristle_rate(z, velocity, p)
        return (p.sigma_0 * z + damping + p.sigma_2 * velocity,)


@record
class BoucWen(_ForceLaw):
    """Bouc-Wen model of a hysteretic restoring force.

        z' = alpha velocity - beta (gamma |velocity| |z|^(nu - 1) z + delta velocity |z|^nu)
        force = z

    in the form of the benchmark of Noël and Schoukens (Workshop on Nonlinear System Identification
    Benchmarks, 2016), whose values are the defaults; its mass, damper and spring are 2 kg,
    10 N s/m and 5e4 N/m.  z is a function of the path alone: it is rate-independent.

    If gamma + delta > 0 and gamma >= delta, |z| <= (alpha / (beta (gamma + delta)))^(1 / nu) if it
    is so at the start (Ikhouane, Rodellar, Systems with Hysteresis, 2007, chapter 2).  With the
    benchmark's values gamma + delta < 0: along a path in one direction z grows without bound, by
    exp(-beta (gamma + delta)) for each metre if nu = 1.  These are values for a path of about a
    millimetre; after 0.14 m in one direction the force is 3e20 N, and no run of a loop continues.

    Examples
    --------
    Where gamma + delta > 0 the force tends to a bound:

    >>> record = nlctl.actuators.BoucWen(alpha=2.0, beta=1.0, gamma=0.5, delta=0.5)
    >>> force = nlctl.block(record, "spring")
    >>> response = nlctl.input_output_response(force, np.array([0.0, 1.0]), 1.0)
    >>> print(record.z_max, round(response.outputs[-1], 6), round(2 * (1 - np.exp(-1)), 6))
    2.0 1.264241 1.264241
    """

    alpha: float = param(5e4, unit="N/m", meaning="stiffness at z = 0", above=0)
    beta: float = param(1e3, unit="1/m", meaning="strength of the hysteresis", above=0)
    gamma: float = param(0.8, unit="N^(1-nu)", meaning="part that opposes z")
    delta: float = param(-1.1, unit="N^(1-nu)", meaning="part that opposes the velocity")
    nu: float = param(1.0, unit="1", meaning="sharpness of the transition", at_least=1)

    states = ("z",)
    feedthrough = False
    output = output_of_state

    @property
    def z_max(self) -> float:
        """Bound of |z|; infinite where there is none."""
        sum_, difference = self.gamma + self.delta, self.gamma - self.delta
        if not (sum_ > 0 and difference >= 0):
            return float("inf")
        return float((self.alpha / (self.beta * sum_)) ** (1 / self.nu))

    @equation
    def update(t, x, u, p):
        """The hysteretic force along the path."""
        (z,) = x
        (velocity,) = u
        size = np.abs(z) ** p.nu
        opposing = p.gamma * np.abs(velocity) * np.sign(z) * size + p.delta * velocity * size
        return (p.alpha * velocity - p.beta * opposing,)

    @equation
    def switching(t, x, u, p):
        """Where the velocity or z changes its sign."""
        return u[0], x[0]
