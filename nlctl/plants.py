"""The plant class (1), the plants of the two examples, and wing rock.

x_i' = x_{i+1},  i = 1, ..., n-1
x_n' = f(x, v) + d(x, t)                                                   (1)
y    = x_1
"""

from collections.abc import Callable, Mapping
from dataclasses import field
from functools import cached_property
from typing import Any

import numpy as np

from .arguments import a_function
from .equations import equation
from .errors import ParameterError
from .names import unknown
from .params import HIGHEST_ORDER, Floats, param, record, set_integer

__all__ = ["ForcedDuffing", "Genesio", "PureFeedback", "WingRock"]


def integrator_chain(f: Callable, d: Callable) -> Callable:
    """Make the update equation of (1) from the last equation's two terms."""

    @equation
    def update(t, x, u, p):
        (v,) = u
        state = tuple(x)
        return state[1:] + (f(state, v, p) + d(state, t, p),)

    return update


@equation
def measured_state(t, x, u, p):
    """Output of every plant here: y = x_1, and the full state x_1, ..., x_n."""
    state = tuple(x)
    return (state[0],) + state


@equation
def no_disturbance(x, t):
    """The disturbance d(x, t) = 0."""
    return 0.0


def coordinate_names(order: int) -> tuple[str, ...]:
    """Return ("x1", ..., "xn")."""
    return tuple(f"x{i}" for i in range(1, order + 1))


@record
class PureFeedback:
    """Pure-feedback plant (1) of any order, with functions of one's own.

        x_i' = x_{i+1},   x_n' = f(x, v) + d(x, t),   y = x_1

    Parameters
    ----------
    f : equation
        ``f(x, v) -> float`` with `x` the tuple (x_1, ..., x_n) and `v` the actuator's output.
        Assumption 3 wants F(x, v) = f(x, v) - f(x, 0) to lie in a sector.
    d : equation, optional
        ``d(x, t) -> float``, the disturbance; 0 by default.

    Examples
    --------
    >>> @nlctl.equation
    ... def f(x, v):
    ...     x1, x2 = x
    ...     return -np.sin(x1) - 0.1 * x2 + (2 + np.cos(x1)) * v
    >>> plant = nlctl.block(nlctl.PureFeedback(order=2, f=f), "plant")
    """

    order: int  # Order n >= 1.
    f: Callable[[Any, Any], Any]
    d: Callable[[Any, Any], Any] = no_disturbance
    # Initial state, ``{"x1": 0.5}``; the others start from 0.
    initial: Mapping[str, float] = field(default_factory=dict)

    inputs = ("v",)
    feedthrough = False
    output = measured_state

    def check(self) -> None:
        """Refuse an order below 1 and an initial value for a state that does not exist."""
        set_integer(self, "order", at_least=1, at_most=HIGHEST_ORDER)
        a_function("PureFeedback", "f", self.f)
        a_function("PureFeedback", "d", self.d)
        for name, value in self.initial.items():
            if name not in self.states:
                raise unknown("state", name, self.states, "in initial of PureFeedback")
            if not np.isfinite(value):
                raise ParameterError(f"PureFeedback needs a finite initial {name}, got {value}")

    states = property(lambda self: coordinate_names(self.order))
    outputs = property(lambda self: ("y", *self.states))

    @cached_property
    def terms(self) -> tuple[Callable, Callable]:
        """The user's functions as equations ``f(x, v, p)`` and ``d(x, t, p)``."""
        f, d = equation(self.f), equation(self.d)

        @equation
        def f_alone(x, v, p):
            return f(x, v)

        @equation
        def d_alone(x, t, p):
            return d(x, t)

        return f_alone, d_alone

    @cached_property
    def update(self) -> Callable:
        """The update equation, with the user's functions in their places."""
        return integrator_chain(*self.terms)


@equation
def duffing_f(x, v, p):
    """Example 1: f(x, v) = -p1 x1 - p x2 - x1^3 + h(x, v), with p = 0.2 + 0.2 cos(5 x1)."""
    # h(x, v) = (1 + 0.1 cos x1) (1 + 0.2 cos v) v is the non-affine term.
    x1, x2 = x
    damping = p.p_mean + p.p_ripple * np.cos(5 * x1)
    h = (1 + p.gain_x * np.cos(x1)) * (1 + p.gain_v * np.cos(v)) * v
    return -p.p1 * x1 - damping * x2 - x1 * x1 * x1 + h


@equation
def duffing_forcing(t, p):
    """Example 1: q cos(w t) with q = 5 + 0.1 cos t and w = 0.5 + 0.1 sin t."""
    # Read literally, w(t) t is a chirp: its instantaneous frequency grows with t. With
    # ``integrate_w`` the phase is the integral of w from 0 to t, and the frequency stays
    # bounded.
    swing = 1 - np.cos(t) if p.integrate_w else t * np.sin(t)
    return (p.q_mean + p.q_ripple * np.cos(t)) * np.cos(p.w_mean * t + p.w_ripple * swing)


@equation
def duffing_d(x, t, p):
    """Example 1: everything that a static network cannot represent."""
    # The paper's d(x, t) = 0.1 (x1^2 + x2^2) sin t, and the forcing q cos(w t), which is not
    # a function of x and so belongs to the disturbance of (1), not to g(x).
    x1, x2 = x
    return duffing_forcing(t, p) + p.d_amplitude * (x1 * x1 + x2 * x2) * np.sin(t + p.d_phase)


@record
class ForcedDuffing:
    """Plant of Example 1: a forced oscillator with cubic stiffness (Lv et al. 2017).

        x1' = x2
        x2' = -p1 x1 - p x2 - x1^3 + q cos(w t) + h(x, v) + d(x, t)
        y   = x1

    with h(x, v) = (1 + 0.1 cos x1)(1 + 0.2 cos v) v, d = 0.1 (x1^2 + x2^2) sin t,
    q = 5 + 0.1 cos t, p = 0.2 + 0.2 cos(5 x1), w = 0.5 + 0.1 sin t, p1 = -0.2, x(0) = (0.5, 0).

    Examples
    --------
    At rest in the origin only the forcing q cos(w t) drives it, q = 5.1 at t = 0:

    >>> plant = nlctl.block(nlctl.plants.ForcedDuffing(), "plant")
    >>> print(plant.dynamics(0, [0.0, 0.0], [0.0]).round(9))
    [0.  5.1]
    """

    p1: float = param(-0.2, unit="1/s^2", meaning="linear stiffness")
    p_mean: float = param(0.2, unit="1/s", meaning="mean of the damping p")
    p_ripple: float = param(0.2, unit="1/s", meaning="ripple of the damping p over x1")
    q_mean: float = param(5.0, unit="1/s^2", meaning="mean of the forcing amplitude q")
    q_ripple: float = param(0.1, unit="1/s^2", meaning="ripple of q over time")
    w_mean: float = param(0.5, unit="rad/s", meaning="mean of the forcing frequency w")
    w_ripple: float = param(0.1, unit="rad/s", meaning="ripple of w over time")
    gain_x: float = param(
        0.1, unit="1", meaning="ripple of the input gain over x1", above=-1, below=1
    )
    gain_v: float = param(
        0.2, unit="1", meaning="ripple of the input gain over v", above=-1, below=1
    )
    d_amplitude: float = param(0.1, unit="1/s^2", meaning="amplitude of d per |x|^2")
    d_phase: float = param(0.0, unit="rad", meaning="phase of d")
    integrate_w: bool = param(
        False, unit="1", meaning="forcing phase is the integral of w, not w(t) t"
    )

    inputs = ("v",)
    outputs = ("y", "x1", "x2")
    states = ("x1", "x2")
    initial = {"x1": 0.5}
    feedthrough = False

    f = duffing_f
    d = duffing_d
    update = integrator_chain(duffing_f, duffing_d)
    output = measured_state


@equation
def genesio_f(x, v, p):
    """Example 2: f(x, v) = -c x1 - b x2 - a x3 + x1^2 + h(x, v)."""
    # h(x, v) = (2 + cos x1) (1 + 0.2 sin^2 v) v is the non-affine term.
    x1, x2, x3 = x
    sine = np.sin(v)
    h = (p.gain_mean + p.gain_x * np.cos(x1)) * (1 + p.gain_v * sine * sine) * v
    return -p.c * x1 - p.b * x2 - p.a * x3 + x1 * x1 + h


@equation
def genesio_d(x, t, p):
    """Example 2: d(x, t) = sin(0.1 t)."""
    return p.d_amplitude * np.sin(p.d_frequency * t + p.d_phase)


@record
class Genesio:
    """Plant of Example 2: the Genesio system with a non-affine input (Lv et al. 2017).

        x1' = x2,   x2' = x3
        x3' = -c x1 - b x2 - a x3 + x1^2 + h(x, v) + d(x, t)
        y   = x1

    with h(x, v) = (2 + cos x1)(1 + 0.2 sin^2 v) v, d = sin(0.1 t), a = 1.6, b = 3, c = 6,
    x(0) = (1, 0, 0).

    Examples
    --------
    >>> plant = nlctl.block(nlctl.plants.Genesio(), "plant")
    >>> print(plant.dynamics(0, [1.0, 0.0, 0.0], [0.0]))  # -c x1 + x1^2
    [ 0.  0. -5.]
    """

    a: float = param(1.6, unit="1/s", meaning="coefficient of x3")
    b: float = param(3.0, unit="1/s^2", meaning="coefficient of x2")
    c: float = param(6.0, unit="1/s^3", meaning="coefficient of x1")
    gain_mean: float = param(2.0, unit="1", meaning="mean of the input gain", above=0)
    gain_x: float = param(1.0, unit="1", meaning="ripple of the input gain over x1")
    gain_v: float = param(0.2, unit="1", meaning="ripple of the input gain over v", above=-1)
    d_amplitude: float = param(1.0, unit="1/s^3", meaning="amplitude of d")
    d_frequency: float = param(0.1, unit="rad/s", meaning="frequency of d")
    d_phase: float = param(0.0, unit="rad", meaning="phase of d")

    inputs = ("v",)
    outputs = ("y", "x1", "x2", "x3")
    states = ("x1", "x2", "x3")
    initial = {"x1": 1.0}
    feedthrough = False

    f = genesio_f
    d = genesio_d
    update = integrator_chain(genesio_f, genesio_d)
    output = measured_state


@equation
def wing_rock_regressor(x):
    """Regressor of wing rock: (1, x1, x2, |x1| x2, |x2| x2, x1^3)."""
    x1, x2 = x
    return 1.0, x1, x2, np.absolute(x1) * x2, np.absolute(x2) * x2, x1 * x1 * x1


@equation
def wing_rock_f(x, v, p):
    """Roll acceleration f(x, v) = w^T psi(x) + L v."""
    psi, acceleration = wing_rock_regressor(x), p.L * v
    for i in range(6):
        acceleration = acceleration + p.w[i] * psi[i]
    return acceleration


@equation
def wing_rock_d(x, t, p):
    """No disturbance."""
    return 0.0


@equation
def wing_rock_output(t, x, u, p):
    """Roll angle, state, and the roll acceleration that a sensor measures."""
    x1, x2 = x
    return x1, x1, x2, wing_rock_f((x1, x2), u[0], p)


@record
class WingRock:
    """Wing rock of a delta wing at a high angle of attack: roll angle x1 and roll rate x2.

        x1' = x2
        x2' = w_0 + w_1 x1 + w_2 x2 + w_3 |x1| x2 + w_4 |x2| x2 + w_5 x1^3 + L v
        y   = x1

    The benchmark of Chowdhary and Johnson (49th IEEE CDC, 2010, p. 3674), with the numbers of
    MathWorks' example "Model Reference Adaptive Control of Aircraft Undergoing Wing Rock".  The
    output x2_dot is the roll acceleration.

    Examples
    --------
    The wing's bias alone, and with ailerons that half cancel it:

    >>> wing = nlctl.block(nlctl.plants.WingRock(), "wing")
    >>> [float(wing.dynamics(0, [0.0, 0.0], [v])[1].round(9)) for v in (0.0, -0.4 / 3)]
    [0.8, 0.4]
    """

    w: Floats = param(
        (0.8, 0.2314, 0.6918, -0.6245, 0.0095, 0.0214), unit="s^-2", meaning="weights w_0, ..., w_5"
    )
    L: float = param(3.0, unit="1/s^2", meaning="effect of the ailerons")

    inputs = ("v",)
    outputs = ("y", "x1", "x2", "x2_dot")
    states = ("x1", "x2")
    initial = {"x1": 1.2, "x2": 1.0}

    f = wing_rock_f
    d = wing_rock_d
    update = integrator_chain(wing_rock_f, wing_rock_d)
    output = wing_rock_output

    def check(self) -> None:
        """Six weights."""
        if len(self.w) != 6:
            raise ParameterError(f"WingRock needs 6 weights w, got {len(self.w)}")

    @equation
    def switching(t, x, u, p):
        """The break points of |x1| and |x2|."""
        return x[0], x[1]
