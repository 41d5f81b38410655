"""The paper's controller: its blocks, connected."""

from typing import Any

import control as ct

from ..annotations import as_annotated
from ..diagrams import as_system, interconnect
from ..equations import equation
from ..errors import ParameterError
from ..params import HIGHEST_ORDER, integer, record
from ..plants import coordinate_names
from ..references import derivative_names
from ..wording import counted
from .filtered_error import FilteredError, binomial_lambdas
from .nussbaum import NussbaumLaw
from .rbf import AdaptiveWeights, GaussianBasis, diagonal_centres, fitting_network
from .robust import RobustTerm


@record
class Zero:
    """A block whose output is 0: put it instead of a piece that is to be left out.

    Examples
    --------
    >>> no_network = nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))
    >>> print(nlctl.block(no_network, "weights").output(0, [], []))
    [0. 0.]
    """

    # The signals that are 0, for instance ``("W_psi", "W_norm")`` for no network.
    outputs: tuple[str, ...]

    inputs = ()
    feedthrough = False

    @property
    def output(self) -> Any:
        """As many zeros as there are outputs."""
        zeros = (0.0,) * len(self.outputs)

        @equation
        def output(t, x, u, p):
            return zeros

        return output


@as_annotated
def adaptive_neural(
    order: int = 2,
    *,
    filtered_error: object = None,
    basis: object = None,
    weights: object = None,
    robust: object = None,
    law: object = None,
    name: str = "controller",
) -> ct.InterconnectedSystem:
    """Connect the adaptive neural controller of the paper, (14) and (23)-(25).

        filtered_error -> basis -> weights, robust -> law

    It takes x1, ..., xn and yd, yd1, ..., ydn; its outputs are e, r, u, zeta, delta_hat, W_norm;
    no zeta where the law has none.
    It knows neither the plant nor the actuator: the same controller drives a dead zone and
    backlash.

    Parameters
    ----------
    order : int, optional
        Order n >= 2 of the plant.
    filtered_error, basis, weights, robust, law : record or control.InputOutputSystem, optional
        The pieces: `FilteredError`, `GaussianBasis`, `AdaptiveWeights`, `RobustTerm`,
        `NussbaumLaw` with the values of Example 1 (lambdas of (s+1)^(n-1) for n > 2).  Replace
        any by a block with the same signals, or by `Zero` to leave it out.
    name : str, optional
        Name of the connected controller; parameters are then ``"controller.law.beta"`` or, where
        that is unambiguous, ``"law.beta"``.

    Returns
    -------
    control.InterconnectedSystem
        The controller, as one block.

    Raises
    ------
    ParameterError
        If `order` is below 1 or does not fit to the filter or the basis.
    DiagramError
        If a replaced piece lacks a signal.

    Examples
    --------
    >>> controller = adaptive_neural(order=2, law=nlctl.controllers.NussbaumLaw(beta=3.0))
    >>> controller.input_labels
    ['x1', 'x2', 'yd', 'yd1', 'yd2']
    """
    order = integer("adaptive_neural", "an order", order, at_least=1, at_most=HIGHEST_ORDER)
    if filtered_error is None:
        lambdas = FilteredError.lambdas if order == 2 else binomial_lambdas(order)
        filtered_error = FilteredError(lambdas=lambdas)
    basis = GaussianBasis(centres=diagonal_centres(27, order)) if basis is None else basis
    if isinstance(filtered_error, FilteredError) and filtered_error.order != order:
        raise ParameterError(
            f"adaptive_neural of order {order} needs {counted(order - 1, 'lambda')}, got "
            f"{len(filtered_error.lambdas)} ({filtered_error.lambdas})"
        )
    if isinstance(basis, GaussianBasis) and len(basis.inputs) > order:
        raise ParameterError(
            f"adaptive_neural of order {order} needs centres with at most {order} coordinates, "
            f"got {len(basis.inputs)}"
        )
    regressor, weights = fitting_network("adaptive_neural", basis, weights, AdaptiveWeights)
    law = as_system(NussbaumLaw() if law is None else law, "law")
    argument = ["zeta"] if "zeta" in law.output_labels else []  # KnownSignLaw has none
    pieces = {
        "filtered_error": filtered_error,
        "basis": regressor,
        "weights": weights,
        "robust": RobustTerm() if robust is None else robust,
        "law": law,
    }
    return interconnect(
        pieces,
        inputs=[*coordinate_names(order), *derivative_names(order)],
        outputs=["e", "r", "u", *argument, "delta_hat", "W_norm"],
        name=name,
    )
