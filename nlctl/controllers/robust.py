"""Adaptive robust term (23), (25)."""

from ..equations import equation
from ..functions import smooth_sign
from ..params import param, record


@record
class RobustTerm:
    """Robust term against actuator, approximation and disturbance errors (25).

        delta_hat' = gamma (r tanh(r/tau) - sigma_2 delta_hat),   robust = delta_hat tanh(r/tau)

    Examples
    --------
    At r = tau the term is delta_hat tanh(1):

    >>> term = nlctl.block(nlctl.controllers.RobustTerm(tau=0.2), "robust")
    >>> print(term.output(0, [2.0], [0.2]).round(6), round(2 * np.tanh(1), 6))
    [1.523188 2.      ] 1.523188
    """

    gamma: float = param(1.5, unit="1", meaning="adaptation gain", above=0)
    sigma_2: float = param(0.5, unit="1", meaning="sigma-modification of delta_hat", at_least=0)
    tau: float = param(0.2, unit="1", meaning="width of the smooth sign", above=0)

    inputs = ("r",)
    outputs = ("robust", "delta_hat")
    states = ("delta_hat",)

    @equation
    def update(t, x, u, p):
        """Adaptation law, second line of (25)."""
        (delta_hat,) = x
        (r,) = u
        return (p.gamma * (r * smooth_sign(r, p.tau) - p.sigma_2 * delta_hat),)

    @equation
    def output(t, x, u, p):
        """The term of (23), and the estimate."""
        (delta_hat,) = x
        (r,) = u
        return delta_hat * smooth_sign(r, p.tau), delta_hat
