"""Regressors of adaptive laws: what the weights are multiplied by."""

import numpy as np

from ...equations import equation
from ...params import record, set_integer
from ...plants import coordinate_names, wing_rock_regressor
from ..rbf import regressor_names


@record
class _StateRegressor:
    """What regressors of the states and one more signal share."""

    order: int = 1  # Order n >= 1 of the plant.

    vector = True

    def check(self) -> None:
        """An order."""
        set_integer(self, "order", at_least=1)

    inputs = property(lambda self: coordinate_names(self.order))
    outputs = property(lambda self: regressor_names(self.order + 1))


@record
class AffineRegressor(_StateRegressor):
    """Regressor of a linear plant with a constant disturbance: its states, and 1.

        psi = (x_1, ..., x_n, 1)

    Examples
    --------
    >>> regressor = nlctl.block(nlctl.controllers.AffineRegressor(order=2), "basis")
    >>> print(regressor.output(0, [], [0.1, 0.2]))
    [0.1 0.2 1. ]
    """

    @equation
    def output(t, x, u, p):
        return np.append(u, 1.0)


@record
class LinearRegressor(_StateRegressor):
    """Regressor of direct MRAC of a linear plant: its states and the command.

        psi = (x_1, ..., x_n, yd)

    Examples
    --------
    >>> regressor = nlctl.block(nlctl.controllers.LinearRegressor(order=2), "basis")
    >>> print(regressor.output(0, [], [0.1, 0.2, 5.0]))
    [0.1 0.2 5. ]
    """

    inputs = property(lambda self: (*coordinate_names(self.order), "yd"))

    @equation
    def output(t, x, u, p):
        return np.copy(u)


@record
class WingRockRegressor:
    """Regressor of wing rock, for a controller that knows its form and not its weights.

        psi = (1, x1, x2, |x1| x2, |x2| x2, x1^3)

    Examples
    --------
    >>> regressor = nlctl.block(nlctl.controllers.WingRockRegressor(), "basis")
    >>> print(regressor.output(0, [], [-2.0, 3.0]))
    [ 1. -2.  3.  6.  9. -8.]
    """

    inputs = ("x1", "x2")
    outputs = regressor_names(6)

    @equation
    def output(t, x, u, p):
        """The functions of `WingRock`."""
        return wing_rock_regressor(u)

    @equation
    def switching(t, x, u, p):
        """The break points of |x1| and |x2|."""
        return u[0], u[1]
