"""High-gain observer of a chain of integrators whose end is not known."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from ..arguments import a_function
from ..controllers.filtered_error import is_hurwitz
from ..equations import equation
from ..errors import ParameterError
from ..params import Floats, param, record
from .signals import estimate_names, set_names


@equation
def nothing_known(x, u):
    """The model of a plant of which nothing is known, 0."""
    return 0.0


@record
class HighGainObserver:
    """High-gain observer of x_i' = x_{i+1}, x_n' = phi(x, u), y = x_1.

        x_hat_i' = x_hat_{i+1} + alpha_i / epsilon^i (y - x_hat_1),   i = 1, ..., n-1
        x_hat_n' = phi_0(x_hat, u) + alpha_n / epsilon^n (y - x_hat_1)

    with s^n + alpha_1 s^(n-1) + ... + alpha_n Hurwitz (Khalil, Nonlinear Systems, 3rd ed. 2002,
    section 14.5).  Where phi_0 is not phi, the error is of the order of epsilon behind a transient
    of the order of epsilon, in which x_hat_i has a peak of the order of 1 / epsilon^(i-1) (x_1(0)
    - x_hat_1(0)): what reads it should have a limit, `nlctl.Saturation` for instance.  Noise of y
    is amplified by the same factor.

    Parameters
    ----------
    model : equation, optional
        ``phi_0(x, u) -> float`` with the estimates and the known inputs as arrays; 0 by default.

    Examples
    --------
    >>> record = nlctl.observers.HighGainObserver(alpha=(2.0, 1.0), epsilon=0.1)
    >>> observer = nlctl.block(record, "observer")
    >>> print(observer.dynamics(0, [0.0, 0.0], [1.0]).round(9))
    [ 20. 100.]
    """

    measured: str = "y"  # Name of the output.
    known: tuple[str, ...] = ()  # Names of what phi_0 takes as u.
    model: Callable[[Any, Any], Any] = nothing_known
    alpha: Floats = param(
        (2.0, 1.0), unit="1", meaning="coefficients alpha_1, ..., alpha_n", above=0
    )
    epsilon: float = param(0.1, unit="s", meaning="time scale of the observer", above=0)

    feedthrough = False
    vector = True

    def check(self) -> None:
        """A Hurwitz polynomial, and names for what the model takes."""
        set_names(self, "known", None, at_least=0)
        a_function("HighGainObserver", "model", self.model)
        if not (isinstance(self.measured, str) and self.measured):
            raise ParameterError(
                f"HighGainObserver needs a name for measured, got {self.measured!r}"
            )
        if not is_hurwitz((1.0, *self.alpha)):
            raise ParameterError(
                "HighGainObserver needs a Hurwitz polynomial s^n + alpha_1 s^(n-1) + ... + "
                f"alpha_n, got alpha {self.alpha}"
            )
        if self.known and self.model is nothing_known:
            raise ParameterError(
                f"HighGainObserver needs a model that takes {self.known}, got known inputs without "
                "one"
            )

    inputs = property(lambda self: (*self.known, self.measured))
    states = property(lambda self: estimate_names(len(self.alpha)))
    outputs = states

    def derived(self) -> dict[str, Any]:
        """The gains alpha_i / epsilon^i."""
        i = np.arange(1, len(self.alpha) + 1)
        return {"gains": np.array(self.alpha) / self.epsilon**i}

    @cached_property
    def update(self) -> Callable:
        """The chain of integrators, its last rate by the model."""
        model, m = equation(self.model), len(self.known)

        @equation
        def update(t, x, u, p):
            return np.append(x[1:], model(x, u[:m])) + p.gains * (u[m] - x[0])

        return update

    @equation
    def output(t, x, u, p):
        return x.copy()
