"""Model reference adaptive control: its blocks, connected."""

from functools import partial

import control as ct

from ...annotations import as_annotated
from ...diagrams import interconnect
from ...errors import ParameterError
from ...plants import coordinate_names
from ..rbf import AdaptiveWeights, fitting_network
from .laws import ModelReferenceLaw
from .model_error import ModelError
from .reference_model import ReferenceModel, model_state_names
from .regressors import LinearRegressor


@as_annotated
def mrac(
    model: ReferenceModel | None = None,
    *,
    error: object = None,
    basis: object = None,
    weights: object = None,
    law: object = None,
    name: str = "controller",
) -> ct.InterconnectedSystem:
    """Connect model reference adaptive control: model -> error, basis -> weights -> law.

    It takes x1, ..., xn of a plant of class (1) and the command yd; its outputs are e, r, u, W_norm
    and xm1, ..., xmn.

    Parameters
    ----------
    model : ReferenceModel, optional
        Its number of coefficients is the order n.
    error : record or control.InputOutputSystem, optional
        `ModelError` with the gains K = a of the model by default; `ConstrainedError` for
        `ConstrainedLaw`.
    basis : record or control.InputOutputSystem, optional
        The regressor psi: `LinearRegressor` by default, `GaussianBasis` for RBF-MRAC, or a block
        of one's own with outputs ``psi[0]``, ``psi[1]``, ...
    weights : record or control.InputOutputSystem, optional
        `AdaptiveWeights` without modification by default; with sigma_1, `EModifiedWeights` or
        `ProjectedWeights` they stay bounded.
    law : record or control.InputOutputSystem, optional
        `ModelReferenceLaw` by default, `DirectLaw` where the input gain is unknown,
        `ConstrainedLaw` where the actuator saturates too.
    name : str, optional
        Name of the connected controller, in front of its parameters' names.

    Returns
    -------
    control.InterconnectedSystem
        The controller, as one block.

    Raises
    ------
    ParameterError
        If model, error, basis and weights do not fit to each other.
    DiagramError
        If a replaced piece lacks a signal.

    Examples
    --------
    >>> mrac().input_labels
    ['x1', 'x2', 'yd']
    """
    model = ReferenceModel() if model is None else model
    order = len(model.a)
    error = ModelError(K=model.a, Q=(1.0,) * order) if error is None else error
    gains = getattr(error, "plant_order", order)
    if gains != order:
        raise ParameterError(
            f"mrac needs as many K as its model has a, got {gains} of K and {order} of a"
        )
    basis = LinearRegressor(order=order) if basis is None else basis
    regressor, weights = fitting_network(
        "mrac", basis, weights, partial(AdaptiveWeights, sigma_1=0.0)
    )
    pieces = {"model": model, "error": error, "basis": regressor, "weights": weights}
    pieces["law"] = ModelReferenceLaw() if law is None else law
    return interconnect(
        pieces,
        inputs=[*coordinate_names(order), "yd"],
        outputs=["e", "r", "u", "W_norm", *model_state_names(order)],
        name=name,
    )
