"""The reference model of model reference adaptive control, for plants of class (1)."""

import numpy as np

from ...equations import equation
from ...params import Floats, param, record
from ..filtered_error import check_hurwitz


def model_state_names(order: int) -> tuple[str, ...]:
    """Return ("xm1", ..., "xmn")."""
    return tuple(f"xm{i}" for i in range(1, order + 1))


@equation
def model_rate(x, yd, p):
    """What the model's last state does."""
    return p.b * yd - np.sum(p.a * x)


@record
class ReferenceModel:
    """Reference model: what the plant shall do with the command yd.

        xm_i' = xm_{i+1},   xm_n' = -a_1 xm_1 - ... - a_n xm_n + b yd,   nu = xm_n'

    The polynomial s^n + a_n s^(n-1) + ... + a_1 must be Hurwitz.  A gain b = a_1 makes xm_1
    settle at the command.

    Examples
    --------
    With b = a_1 it settles at the command: there nu = 0.

    >>> model = nlctl.block(nlctl.controllers.ReferenceModel(a=(4.0, 2.0), b=4.0), "model")
    >>> print(model.output(0, [0.5, 0.0], [0.5]))
    [0.5 0.  0. ]
    """

    a: Floats = param(
        (4.0, 2.0), unit="s^-(n+1-i)", meaning="coefficients a_1, ..., a_n; their number is n"
    )
    b: float = param(4.0, unit="s^-n", meaning="gain of the command")

    inputs = ("yd",)
    vector = True

    def check(self) -> None:
        """The roots must lie in the open left half plane."""
        check_hurwitz("ReferenceModel", "a", self.a)

    states = property(lambda self: model_state_names(len(self.a)))
    outputs = property(lambda self: (*self.states, "nu"))

    @equation
    def update(t, x, u, p):
        """The model in controller form."""
        return np.append(x[1:], model_rate(x, u[0], p))

    @equation
    def output(t, x, u, p):
        """Its state, and the derivative of the last one."""
        return np.append(x, model_rate(x, u[0], p))
