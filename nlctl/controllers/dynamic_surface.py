"""Dynamic surfaces: backstepping that filters its virtual controls and differentiates none."""

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..diagrams import interconnect
from ..equations import equation
from ..errors import ParameterError
from ..params import Floats, param, record
from ..plants import coordinate_names
from .mrac.laws import ModelReferenceLaw
from .rbf import AdaptiveWeights, GaussianBasis, diagonal_centres, fitting_network


@equation
def surfaces(x, u, p):
    """The last surface s_n, and what the filters do: a_2', ..., a_n'."""
    n = p.c.size
    alpha = -p.c[0] * (u[0] - u[n]) + u[n + 1]  # alpha_1
    rates = np.empty(0)
    for i in range(1, n):
        rate = (alpha - x[i - 1]) / p.tau[i - 1]
        alpha = -p.c[i] * (u[i] - x[i - 1]) + rate
        rates = np.append(rates, rate)
    return u[n - 1] - x[n - 2], rates


@record
class DynamicSurface:
    """Surfaces of dynamic surface control, for plants of class (1).

        s_1 = x_1 - yd,    alpha_1 = -c_1 s_1 + yd'
        tau_i a_i' = alpha_{i-1} - a_i,   s_i = x_i - a_i,   alpha_i = -c_i s_i + a_i'
        e = s_1,   r = s_n,   nu = a_n',   nu_e = -c_n s_n

    (Swaroop, Hedrick, Yip, Gerdes, IEEE Transactions on Automatic Control 45, 2000, p. 1893.)
    Backstepping would differentiate alpha_{i-1}; here first-order filters with time constants tau_i
    do, so that one derivative of the reference is enough.  Of order 2, where s_2 = 0, the error has
    tau e'' + e' + c_1 e = -tau yd'': the price is an error of the order of tau.

    Examples
    --------
    On both surfaces, with a reference that stands still, nothing is left to do: e, r, nu, nu_e.

    >>> record = nlctl.controllers.DynamicSurface(c=(2.0, 4.0), tau=(0.02,))
    >>> surfaces = nlctl.block(record, "surfaces")
    >>> print(surfaces.output(0, [0.0], [0.5, 0.0, 0.5, 0.0]) + 0.0)
    [0. 0. 0. 0.]
    >>> print(surfaces.output(0, [0.0], [0.5, 0.1, 0.5, 0.0])[3])  # -c_2 s_2
    -0.4
    """

    c: Floats = param(
        (2.0, 4.0), unit="1/s", meaning="gains c_1, ..., c_n; their number is the order n", above=0
    )
    tau: Floats = param(
        (0.02,), unit="s", meaning="time constants tau_2, ..., tau_n of the filters", above=0
    )

    outputs = ("e", "r", "nu", "nu_e")
    vector = True

    def check(self) -> None:
        """A filter between each two surfaces."""
        if len(self.tau) != len(self.c) - 1:
            raise ParameterError(
                f"DynamicSurface needs one tau less than c, and two of c, got {len(self.tau)} of "
                f"tau and {len(self.c)} of c"
            )

    plant_order = property(lambda self: len(self.c))
    inputs = property(lambda self: (*coordinate_names(len(self.c)), "yd", "yd1"))
    states = property(lambda self: tuple(f"a{i}" for i in range(2, len(self.c) + 1)))

    @equation
    def update(t, x, u, p):
        return surfaces(x, u, p)[1]

    @equation
    def output(t, x, u, p):
        """The tracking error, the last surface, and the wanted x_n' in its two parts."""
        s_n, rates = surfaces(x, u, p)
        return u[0] - u[p.c.size], s_n, rates[-1], -p.c[-1] * s_n


@as_annotated
def dynamic_surface_control(
    surface: DynamicSurface | None = None,
    *,
    basis: object = None,
    weights: object = None,
    law: object = None,
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
    return interconnect(
        pieces,
        inputs=[*coordinate_names(order), "yd", "yd1"],
        outputs=["e", "r", "u", "W_norm"],
        name=name,
    )
