"""Chowdhary and Johnson 2010: concurrent learning (49th IEEE CDC, p. 3674).

The numbers are those of the first author's program for it: see ``nlctl report chowdhary_2010``.
"""

import control as ct
import numpy as np

from .. import controllers
from ..actuators import Gain
from ..annotations import as_annotated
from ..controllers.rbf import regressor_names
from ..diagrams import interconnect
from ..equations import equation
from ..params import param, record
from ..plants import integrator_chain, no_disturbance
from ..references import FunctionReference
from ..sampling import sampled

__all__ = ["INITIAL_STATE", "Pendulum", "PendulumRegressor", "example_1"]

INITIAL_STATE = {"model.xm1": 1.0, "model.xm2": 1.0}
"""Start of the reference model, which is that of the plant."""


@equation
def regressor(x):
    """Regressor of the uncertainty: (sin(pi x1), |x2| x2, exp(-x1 x2))."""
    x1, x2 = x
    return np.sin(np.pi * x1), np.absolute(x2) * x2, np.exp(-x1 * x2)


@equation
def pendulum_acceleration(x, v, p):
    """Angular acceleration v + W^T psi(x)."""
    psi, rate = regressor(x), 1.0 * v
    for i in range(3):
        rate = rate + p.W[i] * psi[i]
    return rate


@equation
def still(x, t, p):
    """No disturbance."""
    return no_disturbance(x, t)


@equation
def pulse(t):
    """The command: 1 from 20 s to 25 s."""
    return (1.0 if 20.0 <= t < 25.0 else 0.0 * t,)


@record
class Pendulum:
    """Plant like an inverted pendulum, with an uncertainty of known form.

        x1' = x2
        x2' = v + W_0 sin(pi x1) + W_1 |x2| x2 + W_2 exp(-x1 x2)
        y   = x1

    The output x2_dot is the acceleration.

    Examples
    --------
    >>> plant = nlctl.block(nlctl.papers.chowdhary_2010.Pendulum(), "plant")
    >>> print(plant.dynamics(0, [0.5, 0.0], [2.0]))
    [0.  1.5]
    """

    W: tuple[float, ...] = param((-1.0, 1.0, 0.5), unit="1/s^2", meaning="weights W_0, W_1, W_2")

    inputs = ("v",)
    outputs = ("y", "x1", "x2", "x2_dot")
    states = ("x1", "x2")
    initial = {"x1": 1.0, "x2": 1.0}

    f = staticmethod(pendulum_acceleration)
    d = staticmethod(still)
    update = staticmethod(integrator_chain(pendulum_acceleration, still))

    @equation
    def output(t, x, u, p):
        """The angle, the state, and the acceleration."""
        x1, x2 = x
        return x1, x1, x2, pendulum_acceleration((x1, x2), u[0], p)

    @equation
    def switching(t, x, u, p):
        """The break point of |x2|."""
        return (x[1],)


@record
class PendulumRegressor:
    """Regressor of `Pendulum`, for a controller that knows its form and not its weights.

        psi = (sin(pi x1), |x2| x2, exp(-x1 x2))

    Examples
    --------
    >>> basis = nlctl.block(nlctl.papers.chowdhary_2010.PendulumRegressor(), "basis")
    >>> print(basis.output(0, [], [0.5, 0.0]))
    [1. 0. 1.]
    """

    inputs = ("x1", "x2")
    outputs = regressor_names(3)

    @equation
    def output(t, x, u, p):
        """The functions of `Pendulum`."""
        return regressor(u)

    @equation
    def switching(t, x, u, p):
        """The break point of |x2|."""
        return (u[1],)


@as_annotated
def example_1(
    *, concurrent: bool = True, points: int = 5, name: str = "example_1"
) -> ct.InterconnectedSystem:
    """Uncertain pendulum under model reference adaptive control, with and without a record.

    Model x_m'' = r - 2 x_m' - x_m, gains 1.5 and 1.3, adaptation gain 3.5 for the present and for
    the recorded error; a sample every 10 ms is recorded if it differs by more than 0.2 |psi| from
    the last one.

    Parameters
    ----------
    concurrent : bool, optional
        Whether recorded points are learned from.
    points : int, optional
        How many are recorded; the program stops by a rule of rank and determinant, at 5.
    name : str, optional
        Name of the diagram.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are y, xm1, e, u and the norm of the weights.

    Raises
    ------
    ParameterError
        If `points` is not a positive integer.

    Examples
    --------
    >>> loop = nlctl.papers.chowdhary_2010.example_1(concurrent=False)
    >>> print(loop.nstates)  # of plant, model and weights
    7
    """
    weights, record_ = controllers.AdaptiveWeights(nodes=3, Gamma=3.5, sigma_1=0.0), {}
    if concurrent:
        weights = controllers.ConcurrentWeights(nodes=3, Gamma=3.5)
        stack = controllers.HistoryStack(nodes=3, points=points, novelty=0.2)
        record_ = {"stack": sampled(stack, 0.01)}
    blocks = {
        "command": FunctionReference(order=0, function=pulse),
        "plant": Pendulum(),
        "actuator": Gain(),
        "model": controllers.ReferenceModel(a=(1.0, 2.0), b=1.0),
        "error": controllers.ModelError(K=(1.5, 1.3), Q=(1.0, 1.0)),
        "basis": PendulumRegressor(),
        "weights": weights,
        "law": controllers.ModelReferenceLaw(gain=1.0),
        **record_,
    }
    return interconnect(blocks, outputs=["y", "xm1", "e", "u", "W_norm"], name=name)
