"""Dynamic surface control with a network: its blocks, connected."""

from __future__ import annotations

from typing import Any

import control as ct

from ...annotations import as_annotated
from ...diagrams import as_system, interconnect
from ...plants import coordinate_names
from ..mrac import ModelReferenceLaw
from ..rbf import AdaptiveWeights, GaussianBasis, diagonal_centres, fitting_network
from .dynamic_surface import DynamicSurface


@as_annotated
def dynamic_surface_control(
    surface: DynamicSurface | None = None,
    *,
    basis: Any = None,
    weights: Any = None,
    law: Any = None,
    name: str = "controller",
) -> ct.InterconnectedSystem:
    """Connect dynamic surface control with a network: surface, basis -> weights -> law.

        u = (a_n' - c_n s_n - W_hat^T psi(x)) / gain,   W_hat' = Gamma (s_n psi - sigma_1 W_hat)

    (Wang, Huang, IEEE Transactions on Neural Networks 16, 2005, p. 195, for plants of class (1),
    whose first n - 1 equations are known: one network is enough.)  It takes x1, ..., xn and yd,
    yd1; its outputs are e, r, u, W_norm.

    Parameters
    ----------
    surface : DynamicSurface, optional
        Its number of gains is the order n.
    basis : record or control.InputOutputSystem, optional
        `GaussianBasis` with 27 centres on the diagonal by default.
    weights : record or control.InputOutputSystem, optional
        `AdaptiveWeights` by default; `EModifiedWeights`, `ProjectedWeights`.
    law : record or control.InputOutputSystem, optional
        `ModelReferenceLaw` by default; its gain is what is known of the input gain.
    name : str, optional
        Name of the connected controller, in front of its parameters' names.

    Returns
    -------
    control.InterconnectedSystem
        The controller, as one block.

    Raises
    ------
    ParameterError
        If basis and weights do not fit to each other.
    DiagramError
        If a replaced piece lacks a signal.

    Examples
    --------
    >>> dynamic_surface_control().input_labels
    ['x1', 'x2', 'yd', 'yd1']
    """
    surface = DynamicSurface() if surface is None else surface
    order = len(surface.c)
    basis = GaussianBasis(centres=diagonal_centres(27, order)) if basis is None else basis
    regressor, weights = fitting_network("dynamic_surface_control", basis, weights, AdaptiveWeights)
    pieces = {"surface": surface, "basis": regressor, "weights": weights}
    pieces["law"] = ModelReferenceLaw() if law is None else law
    systems = [as_system(piece, key) for key, piece in pieces.items()]
    return interconnect(
        systems,
        inputs=[*coordinate_names(order), "yd", "yd1"],
        outputs=["e", "r", "u", "W_norm"],
        name=name,
    )
