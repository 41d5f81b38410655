"""Sliding mode with a boundary layer: the usual robust baseline."""

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..diagrams import as_system, interconnect
from ..equations import equation
from ..functions import clip
from ..params import param, record
from .filtered_error import FilteredError


@record
class SlidingModeLaw:
    """Switching law with a boundary layer, and nothing known of the plant but the sign.

        u = -K sat(r / phi),   sat(y) = min(max(y, -1), 1)

    (Slotine, Li, Applied Nonlinear Control, 1991, section 7.2, with the filtered error r of (14)
    as the sliding variable s and no model in the equivalent control.)  Outside of the layer |u| = K
    drives r inwards if K dominates the disturbance, within it the law is a proportional gain
    K / phi.  It assumes an input gain whose sign is known and positive.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.SlidingModeLaw(K=12.0, phi=0.1), "law")
    >>> [round(float(law.output(0, [], [r])[0]), 6) for r in (-1.0, 0.05, 1.0)]
    [12.0, -6.0, -12.0]
    """

    K: float = param(12.0, unit="1", meaning="control input outside of the layer", above=0)
    phi: float = param(0.1, unit="1", meaning="half width of the boundary layer of r", above=0)

    inputs = ("r",)
    outputs = ("u",)

    @equation
    def output(t, x, u, p):
        (r,) = u
        return (-p.K * clip(r / p.phi, -1.0, 1.0),)

    @equation
    def switching(t, x, u, p):
        (r,) = u
        return r + p.phi, r - p.phi


@as_annotated
def sliding_mode(
    filtered_error: object = None, law: object = None, *, name: str = "controller"
) -> ct.InterconnectedSystem:
    """Connect a sliding-mode controller: filtered error (14) -> law.

    It takes x1, ..., xn and yd, yd1, ..., ydn as the paper's controller does; its outputs
    are e, r, u.

    Parameters
    ----------
    filtered_error : FilteredError, optional
        Its lambdas are the slope of the sliding surface, and their number gives the order.
    law : record, optional
        `SlidingModeLaw` by default; `SuperTwistingLaw` where u is to be continuous.
    name : str, optional
        Name of the connected controller, in front of its parameters' names.

    Returns
    -------
    control.InterconnectedSystem
        The controller, as one block.

    Raises
    ------
    DiagramError
        If a replaced piece lacks a signal.

    Examples
    --------
    >>> sliding_mode().output_labels
    ['e', 'r', 'u']
    """
    first = as_system(
        FilteredError() if filtered_error is None else filtered_error, "filtered_error"
    )
    blocks = {"filtered_error": first, "law": SlidingModeLaw() if law is None else law}
    return interconnect(blocks, inputs=first.input_labels, outputs=["e", "r", "u"], name=name)


@record
class SuperTwistingLaw:
    """Super-twisting law with a boundary layer, instead of `SlidingModeLaw`.

        u = -k_1 |r|^(1/2) sign(r) + w,   w' = -k_2 sign(r)          |r| >= phi
        u = -k_1 r / phi^(1/2) + w,       w' = -k_2 r / phi          |r| <= phi

    (Levant, International Journal of Control 58, 1993, p. 1247, here without the bounds of u; the
    layer is ours.)  For r' = u + d with |d'| <= L it reaches r = 0 in finite time, without the
    layer, if for instance k_1 = 1.5 sqrt(L), k_2 = 1.1 L, and u is continuous; d itself may be of
    any size.  Where d' is constant, |r| ends at phi |d'| / k_2.  Crossings of r = 0 without a layer
    accumulate, no step size would follow them; within it the law is linear.  It assumes an input
    gain whose sign is known and positive.

    Examples
    --------
    >>> law = nlctl.block(nlctl.controllers.SuperTwistingLaw(k_1=6.0, k_2=8.0), "law")
    >>> print(law.output(0, [1.5], [0.25]), law.dynamics(0, [1.5], [0.25]))  # w - k_1 sqrt(r), -k_2
    [-1.5] [-8.]
    """

    k_1: float = param(6.0, unit="1", meaning="gain of the square root of r", above=0)
    k_2: float = param(8.0, unit="1/s", meaning="rate of w outside of the layer", above=0)
    phi: float = param(0.01, unit="1", meaning="half width of the boundary layer of r", above=0)

    inputs = ("r",)
    outputs = ("u",)
    states = ("w",)

    @equation
    def update(t, x, u, p):
        """The integral of the sign."""
        (r,) = u
        return (-p.k_2 * r / np.maximum(np.absolute(r), p.phi),)

    @equation
    def output(t, x, u, p):
        (w,) = x
        (r,) = u
        return (w - p.k_1 * r / np.sqrt(np.maximum(np.absolute(r), p.phi)),)

    @equation
    def switching(t, x, u, p):
        (r,) = u
        return r + p.phi, r - p.phi
