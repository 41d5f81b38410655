"""How far boxes may be scaled before a loop refuses a value."""

from __future__ import annotations

from collections.abc import Callable, Collection

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type
from nlctl.names import unknown

from ..runs.experiment import Prepared
from ..uncertainty.binding import refusals


@as_annotated
def largest_scale(
    prepared: Prepared, at_most: float = 4.0, names: Collection[str] | None = None
) -> tuple[float, str]:
    """Return how far the boxes may be scaled before the loop refuses a value, and why.

    A block refuses its own parameters only, but several of them together: a backlash needs
    c_l < c_r.  So the corners of each block's own box are tried.  Where these are admissible,
    everything between them is: the rules of nlctl's blocks are linear, or say that a polynomial is
    Hurwitz (Kharitonov's theorem).  Of a block with more than 10 quantities only each end by
    itself and the corners of each pair are tried, the others nominal: a rule about three may then
    refuse a row later.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    at_most : float, optional
        Larger factors are not tried.
    names : collection of str, optional
        Quantities that are scaled, the others nominal; all by default.

    Returns
    -------
    factor : float
        To 10 digits; nothing that is tried is refused at this factor.
    reason : str
        Of the refusal that ends the sizes; empty if `at_most` is admissible.

    Raises
    ------
    ParameterError
        If `at_most` is not a finite number > 0, or the nominal values themselves are refused.
    UnknownNameError
        If the space has no quantity of such a name.

    Examples
    --------
    A dead zone needs b_r >= 0, so that a box of 0.5 +- 0.2 may grow to 2.5 times its size:

    >>> import numpy as np
    >>> import nlctl
    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, eventually, in_band, largest_scale,
    ...     prepare,
    ... )
    >>> space = Space(quantities=(Uncertain(name="zone.b_r", bounds=(0.3, 0.7)),))
    >>> moves = Requirement(key="moves", formula=eventually(in_band("v", lower=0.01)), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"zone": nlctl.DeadZone(b_r=0.5)}),
    ...     spec=Spec(requirements=(moves,)), timepts=np.linspace(0, 1, 5), inputs=1.0,
    ... )
    >>> factor, reason = largest_scale(prepare(experiment))
    >>> print(round(factor, 6))
    2.5
    """
    of_type("a largest scale", "prepared", prepared, Prepared, "prepare(experiment)")
    factor, why = number("a largest scale", "at_most", at_most, above=0), ""
    space = prepared.experiment.space
    for name in () if names is None else names:
        if name not in space.names:
            raise unknown("quantity", str(name), space.names, "of a largest scale")
    systems = [loop.system for _, loop in prepared.loops]
    tries = list(refusals(space, systems, space.names if names is None else names))
    while (refusal := next((one for one in tries if one(factor)), None)) is not None:
        why = f"since at {factor:.4g} {refusal(factor)}"
        factor = _largest(refusal, factor)
    return factor, why and f"Sizes end at {factor:.4g} {why}"


def _largest(refusal: Callable[[float], str], refused: float) -> float:
    """Return the largest factor below a refused one that is not, by bisection from 0."""
    low, high = 0.0, refused
    while high - low > 1e-10 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if refusal(middle) else (middle, high)
    return low
