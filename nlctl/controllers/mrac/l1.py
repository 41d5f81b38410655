"""L1 adaptive control: a state predictor, fast adaptation, and a low-pass filter in the law."""

from functools import partial
from typing import Any

import control as ct
import numpy as np

from ...annotations import as_annotated
from ...diagrams import interconnect
from ...equations import equation
from ...errors import ParameterError
from ...params import Floats, param, record
from ...plants import coordinate_names
from ..filtered_error import check_hurwitz
from ..rbf import fitting_network
from .laws import check_input_gain
from .model_error import ModelError
from .modified_weights import ProjectedWeights
from .reference_model import model_state_names
from .regressors import AffineRegressor


@record
class StatePredictor:
    """State predictor: the plant as the controller believes it to be.

        xm_i' = xm_{i+1},   xm_n' = -a_1 xm_1 - ... - a_n xm_n + gain u + W_hat^T psi

    With x_n' = -a^T x + gain u + W^T psi of the plant the error x - xm is driven by
    (W - W_hat)^T psi alone, whatever u is.

    Examples
    --------
    >>> predictor = nlctl.block(nlctl.controllers.StatePredictor(a=(2.0,), gain=3.0), "predictor")
    >>> print(predictor.dynamics(0, [0.5], [1.0, 0.25]))  # -a xm + gain u + W_psi
    [2.25]
    """

    a: Floats = param(
        (4.0, 2.0), unit="s^-(n+1-i)", meaning="coefficients a_1, ..., a_n; their number is n"
    )
    gain: float = param(1.0, unit="1", meaning="input gain of the plant")

    inputs = ("u", "W_psi")
    feedthrough = False
    vector = True

    def check(self) -> None:
        """The roots must lie in the open left half plane, and the input has an effect."""
        check_hurwitz("StatePredictor", "a", self.a)
        check_input_gain("StatePredictor", self.gain)

    states = property(lambda self: model_state_names(len(self.a)))
    outputs = states

    @equation
    def update(t, x, u, p):
        """The plant with the estimates."""
        return np.append(x[1:], p.gain * u[0] + u[1] - np.sum(p.a * x))

    @equation
    def output(t, x, u, p):
        return x.copy()


@record
class FilteredLaw:
    """Law behind a low-pass filter C(s) = omega / (s + omega): the estimates pass below omega.

        u' = -omega (u - (b yd - W_hat^T psi) / gain)

    Examples
    --------
    It goes to (b yd - W_psi) / gain at the rate omega:

    >>> law = nlctl.block(nlctl.controllers.FilteredLaw(omega=10.0, b=4.0, gain=2.0), "law")
    >>> [float(law.dynamics(0, [u], [1.0, 1.0])[0]) for u in (0.0, 1.0)]
    [15.0, 5.0]
    """

    omega: float = param(10.0, unit="rad/s", meaning="bandwidth of the filter", above=0)
    b: float = param(4.0, unit="s^-n", meaning="gain of the command")
    gain: float = param(1.0, unit="1", meaning="input gain of the plant")

    inputs = ("yd", "W_psi")
    outputs = ("u",)
    states = ("u_f",)
    feedthrough = False

    def check(self) -> None:
        """An input that has an effect."""
        check_input_gain("FilteredLaw", self.gain)

    @equation
    def update(t, x, u, p):
        yd, W_psi = u
        return (-p.omega * (x[0] - (p.b * yd - W_psi) / p.gain),)

    @equation
    def output(t, x, u, p):
        return (x[0],)


@as_annotated
def l1_adaptive(
    predictor: StatePredictor | None = None,
    *,
    error: object = None,
    basis: object = None,
    weights: object = None,
    law: Any = None,
    name: str = "controller",
) -> ct.InterconnectedSystem:
    """Connect L1 adaptive control: predictor -> error, basis -> weights -> law.

        x_n' = -a^T x + gain u + W^T psi,   W_hat' = Gamma Proj(W_hat, r psi),   r = b^T P (x - xm)
        u = C(s) (b yd - W_hat^T psi) / gain

    (Hovakimyan, Cao, L1 Adaptive Control Theory, 2010, section 2.1, with psi = (x, 1).)  While W is
    constant, in the inner ball of the projection, |x - xm|^2 <= |W - W_hat(0)|^2 / (Gamma
    lambda_min(P)) from equal states, whatever the law does; what adaptation does above omega is
    kept from the plant.  They show the loop stable if the L1 norm of (sI - A)^-1 b (1 - C(s)), A
    and b as in `ModelError`, times the largest sum of |W_i| over the weights of the states is below
    1; that is not checked here.

    Parameters
    ----------
    predictor : StatePredictor, optional
        Its number of coefficients is the order n.
    error, basis, weights, law : record or control.InputOutputSystem, optional
        `ModelError` with the gains K = a, `AffineRegressor`, `ProjectedWeights` with Gamma = 1000,
        and `FilteredLaw` by default.
    name : str, optional
        Name of the connected controller, in front of its parameters' names.

    Returns
    -------
    control.InterconnectedSystem
        With inputs x1, ..., xn, yd and outputs e (of the predictor), r, u, W_norm, xm1, ..., xmn.

    Raises
    ------
    ParameterError
        If basis and weights do not fit to each other, or predictor and law differ in the gain.
    DiagramError
        If a replaced piece lacks a signal.

    Examples
    --------
    >>> l1_adaptive().input_labels
    ['x1', 'x2', 'yd']
    """
    predictor = StatePredictor() if predictor is None else predictor
    order = len(predictor.a)
    law = FilteredLaw(b=predictor.a[0], gain=predictor.gain) if law is None else law
    if getattr(law, "gain", predictor.gain) != predictor.gain:
        raise ParameterError(
            f"l1_adaptive needs one gain of predictor and law, got {predictor.gain:g} and "
            f"{law.gain:g}"
        )
    basis = AffineRegressor(order=order) if basis is None else basis
    regressor, weights = fitting_network(
        "l1_adaptive", basis, weights, partial(ProjectedWeights, Gamma=1000.0)
    )
    error = ModelError(K=predictor.a, Q=(1.0,) * order) if error is None else error
    pieces = {"predictor": predictor, "error": error, "basis": regressor, "weights": weights}
    return interconnect(
        {**pieces, "law": law},
        inputs=[*coordinate_names(order), "yd"],
        outputs=["e", "r", "u", "W_norm", *model_state_names(order)],
        name=name,
    )
