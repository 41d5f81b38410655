"""Control laws of model reference adaptive control."""

from ...equations import equation
from ...errors import ParameterError
from ...params import param, record


def check_input_gain(who: str, gain: float) -> None:
    """Refuse an input without an effect."""
    if gain == 0:
        raise ParameterError(f"{who} needs a gain other than 0, got 0.0")


@record
class ModelReferenceLaw:
    """Control law for a matched uncertainty: the model's derivative, feedback, minus the network.

        u = (nu + nu_e - W_hat^T psi) / gain

    For x_n' = gain u + W^T psi(x) the error obeys E' = A E - b (W_hat - W)^T psi, A of
    `ModelError`.  With K = a of the model it is -a^T x + b yd - W_hat^T psi, the model's own
    feedback.  The gain is known, of either sign.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.ModelReferenceLaw(gain=2.0), "law")
    >>> print(law.output(0, [], [1.0, -3.0, 4.0]))  # (nu + nu_e - W_psi) / gain
    [-3.]
    """

    gain: float = param(1.0, unit="1", meaning="input gain of the plant")

    inputs = ("nu", "nu_e", "W_psi")
    outputs = ("u",)

    def check(self) -> None:
        """An input that has an effect."""
        check_input_gain("ModelReferenceLaw", self.gain)

    @equation
    def output(t, x, u, p):
        nu, nu_e, W_psi = u
        return ((nu + nu_e - W_psi) / p.gain,)


@record
class DirectLaw:
    """Control law of direct MRAC: all gains are estimated; the input gain is positive, no more.

        u = -W_hat^T psi

    For x_n' = -a^T x + b yd + lambda (u + W^T psi) with any lambda > 0 and the a of `ModelError`
    as K, (W_hat - W)^T psi is all that drives the error (Narendra, Annaswamy, Stable Adaptive
    Systems, 1989, section 3.3).

    Examples
    --------
    >>> print(nlctl.block(nlctl.controllers.DirectLaw(), "law").output(0, [], [4.0]))
    [-4.]
    """

    inputs = ("W_psi",)
    outputs = ("u",)

    @equation
    def output(t, x, u, p):
        return (-u[0],)
