"""How far boxes may be scaled before a loop refuses a value."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nlctl._errors import ParameterError, UsageError

from .experiment import Prepared
from .quantity import Uncertain
from .resolve import resolved
from .space import nominal

__all__ = ["largest_scale"]


def largest_scale(prepared: Prepared, at_most: float = 4.0) -> tuple[float, str]:
    """Return how far the boxes may be scaled before the loop refuses a value, and why.

    Parameters
    ----------
    prepared : Prepared
    at_most : float, optional
        Larger factors are not tried.

    Returns
    -------
    factor : float
        To 10 digits; every value of the scaled boxes is taken.
    reason : str
        Of the first refusal at `at_most`; empty if that is admissible.

    Raises
    ------
    ParameterError
        If `at_most` is no finite number > 0.
    """
    if not 0 < at_most < np.inf:
        raise ParameterError(f"a largest scale needs a finite at_most > 0, got {at_most}")
    reason = _refusal(prepared, at_most)
    if not reason:
        return float(at_most), ""
    low, high = 0.0, float(at_most)
    while high - low > 1e-10 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if _refusal(prepared, middle) else (middle, high)
    return low, f"Sizes end at {low:.4g} since at {at_most:.4g} {reason}"


def _refusal(prepared: Prepared, factor: float) -> str:
    """Return why a loop refuses an end of the scaled boxes, or nothing."""
    space = prepared.experiment.space
    factor *= space.scale

    def ends(quantity: Uncertain, middle: float) -> tuple[float, float]:
        low, high = quantity.box
        return middle + factor * (low - middle), middle + factor * (high - middle)

    middle = nominal(space)
    quantities = tuple(replace(q, bounds=ends(q, middle[q.name])) for q in space.quantities)
    try:
        for _, loop in prepared.loops:
            resolved(replace(space, quantities=quantities, scale=1.0), loop)
    except UsageError as error:
        return str(error)
    return ""
