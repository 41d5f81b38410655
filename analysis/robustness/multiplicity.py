"""Several tests at once."""

from __future__ import annotations

import numpy as np

from nlctl._errors import ParameterError
from nlctl._param import as_numbers

__all__ = ["holm"]


def holm(p_values: np.ndarray) -> np.ndarray:
    """Return p-values adjusted for their number (Holm, Scand. J. Statist. 6, 1979).

        p~_(i) = max over j <= i of min(1, (m - j + 1) p_(j)),    p_(1) <= ... <= p_(m)

    Rejecting what is at most a makes any false rejection at all happen with probability at most a,
    whatever the dependence between the tests.  NaN stays NaN and is not counted.

    Raises
    ------
    ParameterError
        If a value is no number in [0, 1], or they are not in one row.
    """
    p = as_numbers(p_values)
    if p is None or p.ndim != 1 or np.any((p < 0) | (p > 1)):
        raise ParameterError(
            f"Holm's adjustment needs p-values in [0, 1] in one row, got {p_values!r}"
        )
    adjusted = np.full(p.shape, np.nan)
    order = np.argsort(p)[: np.count_nonzero(~np.isnan(p))]  # NaN sorts last
    steps = np.minimum(1.0, np.arange(order.size, 0, -1) * p[order])
    adjusted[order] = np.maximum.accumulate(steps)
    return adjusted
