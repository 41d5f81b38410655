"""Canudas de Wit, Olsson, Åström and Lischinsky 1995: the LuGre model (doi 10.1109/9.376053).

The numbers are those of a program that reconstructs its figures: see
``nlctl report canudas_de_wit_1995``.
"""

import control as ct
import numpy as np

from ..actuators import LuGre
from ..annotations import as_annotated
from ..attributes import with_parameters_of
from ..blocks import block
from ..diagrams import interconnect
from ..equations import equation
from ..params import param, record
from ..references import FunctionReference, SumOfSines

__all__ = ["PositionControl", "example_1", "example_2", "example_3", "example_4"]


@equation
def pulled(t):
    """The end of the spring, at 0.1 m/s."""
    return (0.1 * t,)


@equation
def step(t):
    """The position that is wanted, 1 m."""
    return (1.0 + 0.0 * t,)


@record
class PositionControl:
    """PID control of a position, with the velocity as its derivative.

        applied = -K_v velocity - K_p (position - wanted) - K_i integral
        integral' = position - wanted

    Examples
    --------
    >>> control = nlctl.block(nlctl.papers.canudas_de_wit_1995.PositionControl(), "control")
    >>> print(control.output(0, [0.5], [1.0, 0.0, 1.0]))
    [-2.]
    """

    K_v: float = param(6.0, unit="N s/m", meaning="gain of the velocity", at_least=0)
    K_p: float = param(3.0, unit="N/m", meaning="gain of the error", at_least=0)
    K_i: float = param(4.0, unit="N/(m s)", meaning="gain of the integral", at_least=0)

    inputs = ("position", "velocity", "wanted")
    outputs = ("applied",)
    states = ("integral",)

    @equation
    def update(t, x, u, p):
        """The integral of the error."""
        position, _, desired = u
        return (position - desired,)

    @equation
    def output(t, x, u, p):
        """The force."""
        (integral,) = x
        position, velocity, desired = u
        return (-p.K_v * velocity - p.K_p * (position - desired) - p.K_i * integral,)


def _mass() -> ct.InputOutputSystem:
    """Return a mass of 1 kg with an applied force and friction."""
    return ct.ss(
        [[0, 1], [0, 0]], [[0, 0], [1, -1]], np.eye(2), 0, name="mass",
        inputs=["applied", "force"], outputs=["position", "velocity"],
    )  # fmt: skip


_OUTPUTS = ["position", "velocity", "force"]


@as_annotated
@with_parameters_of(interconnect)
def example_1(*, name: str = "example_1") -> ct.InterconnectedSystem:
    """A mass of 1 kg on friction, pushed: presliding, and the force at which it breaks away.

    Returns
    -------
    control.InterconnectedSystem
        Its input is the applied force (N); outputs are position, velocity and friction.

    Examples
    --------
    Pushed slowly to 1 N it moves by 15 ln 3 micrometres, and does not slide:

    >>> loop = nlctl.papers.canudas_de_wit_1995.example_1()
    >>> run = nlctl.input_output_response(loop, [0, 100], [0.0, 1.0], rtol=1e-8, atol=1e-13)
    >>> print((1e6 * run.outputs[0, -1]).round(1), round(15 * float(np.log(3)), 1))
    16.5 16.5
    """
    parts = [_mass(), block(LuGre(), "friction")]
    return interconnect(parts, inputs=["applied"], outputs=_OUTPUTS, name=name)


@as_annotated
@with_parameters_of(interconnect)
def example_2(*, omega: float = 1.0, name: str = "example_2") -> ct.InterconnectedSystem:
    """Friction at a velocity 1 mm/s (1.5 + cos(omega t)): it lags behind.

    Parameters
    ----------
    omega : float, optional
        Frequency (rad/s); printed are 1, 10 and 25.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are velocity and friction.

    Raises
    ------
    ParameterError
        If omega is not finite.

    Examples
    --------
    >>> nlctl.papers.canudas_de_wit_1995.example_2(omega=10.0).output_labels
    ['velocity', 'force']
    """
    motion = SumOfSines(
        order=0, amplitudes=(1.5e-3, 1e-3), frequencies=(0.0, omega), phases=(np.pi / 2, np.pi / 2)
    )
    parts = [block(motion, "motion", outputs=["velocity"]), block(LuGre(), "friction")]
    return interconnect(parts, outputs=["velocity", "force"], name=name)


@as_annotated
@with_parameters_of(interconnect)
def example_3(*, name: str = "example_3") -> ct.InterconnectedSystem:
    """The mass, pulled at 0.1 m/s by the end of a spring of 2 N/m: it sticks and slips.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are position, velocity, friction and the force of the spring.

    Examples
    --------
    >>> nlctl.papers.canudas_de_wit_1995.example_3().output_labels
    ['position', 'velocity', 'force', 'applied']
    """
    spring = ct.ss(
        [], [], [], [[2.0, -2.0]], inputs=["end", "position"], outputs="applied", name="spring"
    )
    end = block(FunctionReference(order=0, function=pulled), "end", outputs=["end"])
    parts = [end, spring, _mass(), block(LuGre(), "friction")]
    return interconnect(parts, outputs=[*_OUTPUTS, "applied"], name=name)


@as_annotated
@with_parameters_of(interconnect)
def example_4(*, name: str = "example_4") -> ct.InterconnectedSystem:
    """The mass under PID control to a position of 1 m: friction makes it hunt.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are position, velocity, friction and the force of the controller.

    Examples
    --------
    >>> nlctl.papers.canudas_de_wit_1995.example_4().output_labels
    ['position', 'velocity', 'force', 'applied']
    """
    steps = block(FunctionReference(order=0, function=step), "reference", outputs=["wanted"])
    parts = [steps, block(PositionControl(), "control"), _mass(), block(LuGre(), "friction")]
    return interconnect(parts, outputs=[*_OUTPUTS, "applied"], name=name)
