"""Karason and Annaswamy 1994: adaptive control with a constrained input (doi 10.1109/9.333787).

The numbers are those of a program that reproduces its scalar example: see
``nlctl report karason_1994``.
"""

import control as ct

from ..actuators import Gain
from ..annotations import as_annotated
from ..arguments import one_of
from ..controllers import (
    AdaptiveWeights,
    ConstrainedError,
    ConstrainedLaw,
    ModelError,
    ReferenceModel,
    mrac,
)
from ..diagrams import interconnect
from ..equations import equation
from ..plants import PureFeedback
from ..references import SumOfSines

__all__ = ["INITIAL_STATE", "example_1"]

INITIAL_STATE = {
    "controller.model.xm1": -9.9,
    "controller.weights.W_hat[0]": 2.2,
    "controller.weights.W_hat[1]": -1.1,
}
"""Start of the model and of the gains theta = -W_hat[0], k = -W_hat[1]; the plant is at -9.99."""


@equation
def unstable(x, v):
    """Rate of the plant, a_p = b_p = 1."""
    return x[0] + v


@as_annotated
def example_1(
    *, learns_from: str = "controllable", amplitude: float = 5.0, name: str = "example_1"
) -> ct.InterconnectedSystem:
    """Scalar example: x' = x + u with abs(u) up to 10, after xm' = -xm + r.

    It starts at -9.99; beyond -10 no input of at most 10 brings the plant back.

    Parameters
    ----------
    learns_from : {"controllable", "all"}, optional
        The part of the error that the constraint has not caused, or all of it.
    amplitude : float, optional
        Of the command amplitude sin(0.5 t).
    name : str, optional
        Name of the diagram.

    Returns
    -------
    control.InterconnectedSystem
        Its outputs are x1, xm1, u, the error e, what the gains learn from, r, and the norm of the
        gains.

    Raises
    ------
    ParameterError
        If `learns_from` is another word.

    Examples
    --------
    >>> loop = nlctl.papers.karason_1994.example_1()
    >>> print(loop.output_labels)
    ['x1', 'xm1', 'u', 'e', 'r', 'W_norm']
    """
    errors = {
        "controllable": ConstrainedError(K=(1.0,), Q=(2.0,), gamma_d=1.0),
        "all": ModelError(K=(1.0,), Q=(2.0,)),
    }
    controller = mrac(
        ReferenceModel(a=(1.0,), b=1.0),
        error=errors[one_of("example_1", "learns_from", learns_from, errors)],
        weights=AdaptiveWeights(nodes=2, Gamma=0.1, sigma_1=0.0),
        law=ConstrainedLaw(u_max=10.0),
    )
    blocks = {
        "command": SumOfSines(order=0, amplitudes=(amplitude,), frequencies=(0.5,), phases=(0.0,)),
        "plant": PureFeedback(order=1, f=unstable, initial={"x1": -9.99}),
        "controller": controller,
        "actuator": Gain(),
    }
    return interconnect(blocks, outputs=["x1", "xm1", "u", "e", "r", "W_norm"], name=name)
