"""The gamma function and its logarithm: Stirling's series, far enough to the right.

Sources: DLMF 5.5.1 (recurrence), 5.5.3 (reflection), 5.11.1 (series).
"""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

from .table import Facade

_STEPS = 8  # z + 8 >= 8.5: what the series leaves out is below 3e-16
# B_2k / (2k (2k - 1)) of Bernoulli's numbers
_SERIES = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188, -691 / 360360, 1 / 156)


def loggamma_of_size(np: Facade, x: Any) -> Any:
    """ln |gamma(x)|."""
    left = x < 0.5
    z = np.where(left, 1.0 - x, x)
    value = _stirling(np, z) - np.log(_product(z))
    return np.where(left, np.log(math.pi / np.abs(_sine(np, x))) - value, value)


def gamma(np: Facade, x: Any) -> Any:
    """The gamma function: (x - 1)! of integers."""
    left = x < 0.5
    z = np.where(left, 1.0 - x, x)
    value = np.exp(_stirling(np, z)) / _product(z)
    return np.where(left, math.pi / (_sine(np, x) * value), value)


def _sine(np: Facade, x: Any) -> Any:
    """sin(pi x), 0 at integers."""
    nearest = np.rint(x)
    half = 0.5 * nearest
    odd = half - np.floor(half)
    return (1.0 - 4.0 * odd) * np.sin(math.pi * (x - nearest))


def _product(z: Any) -> Any:
    """z (z + 1) ... (z + 7), by which gamma(z + 8) is larger."""
    return reduce(lambda a, b: a * b, (z + k for k in range(1, _STEPS)), z)


def _stirling(np: Facade, z: Any) -> Any:
    """ln gamma(z + 8)."""
    far = z + _STEPS
    square = 1.0 / (far * far)
    series = reduce(lambda total, c: total * square + c, reversed(_SERIES))
    return (far - 0.5) * np.log(far) - far + 0.5 * math.log(2 * math.pi) + series / far
