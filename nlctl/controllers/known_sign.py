"""Control law for an input gain of known sign: no Nussbaum function, and a proof for all time."""

from ..equations import equation
from ..functions import smooth_sign
from ..params import param, record


@equation
def damped_base(u, p):
    """A base whose product with r is never negative: eta = beta r + s tanh(r s / b)."""
    # s = W_hat^T psi + delta_hat tanh(r/tau) + Y_d is what (23) adds to beta r. By (29), r s <= r s
    # tanh(r s / b) + 0.2785 b, so that r (beta r + s) <= r eta + 0.2785 b.
    r, W_psi, robust, Y_d = u
    s = W_psi + robust + Y_d
    return p.beta * r + s * smooth_sign(r * s, p.b)


@record
class KnownSignLaw:
    """Control law for a positive input gain k G >= l_min > 0, to be used with N_0 >= 1 / l_min.

        u = -N_0 [beta r + s tanh(r s / b)],   s = W_hat^T psi + delta_hat tanh(r/tau) + Y_d

    With the adaptation laws (25) as they are, V of (21) obeys V' <= -alpha_1 V + alpha_0 +
    0.2785 b, alpha_0 and alpha_1 those of (31), also where k G varies with time: r u <= 0 and
    N_0 k G >= 1 give r k G u <= -r eta, and r (beta r + s) <= r eta + 0.2785 b.  No Nussbaum
    function and no Lemma 1 take part, so that V stays bounded for all time as long as the state
    stays in the set that delta* of (20) was computed on.

    It has the inputs of `NussbaumLaw` and stands in its place in `adaptive_neural`; it has no
    state, and no output ``zeta``.  The sign is that of the paper's plants; for a negative gain
    reverse the actuator's sign.

    Examples
    --------
    Without a network's output its bracket is beta r, as r s = 0:

    >>> law = nlctl.block(nlctl.controllers.KnownSignLaw(beta=2.5, N_0=2.0), "law")
    >>> print(law.output(0, [], [0.2, 0.0, 0.0, 0.0]))
    [-1.]
    """

    beta: float = param(2.5, unit="1", meaning="gain of the filtered error", above=0)
    N_0: float = param(2.4, unit="1", meaning="control gain, at least 1 / min k G", above=0)
    b: float = param(0.1, unit="1", meaning="width of the smooth sign of r s", above=0)

    inputs = ("r", "W_psi", "robust", "Y_d")
    outputs = ("u",)

    @equation
    def output(t, x, u, p):
        """The law; r u = -N_0 r eta is never positive."""
        return (-p.N_0 * damped_base(u, p),)
