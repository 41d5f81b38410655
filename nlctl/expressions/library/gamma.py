"""The gamma function and its logarithm: Stirling's series, far enough to the right.

Sources: DLMF 5.5.1 (recurrence), 5.5.3 (reflection), 5.11.1 (series); of the incomplete ones
8.4.6 and 8.4.9 to 8.4.14 (integers and halves), 8.7.1 (series).
"""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

from ..arrays import traced
from ..graph import Untraceable
from ..operators import elementwise
from .rotated import in_passes
from .table import Facade, known_numbers

_STEPS = 8  # z + 8 >= 8.5: what the series leaves out is below 3e-16
# B_2k / (2k (2k - 1)) of Bernoulli's numbers
_SERIES = (1 / 12, -1 / 360, 1 / 1260, -1 / 1680, 1 / 1188, -691 / 360360, 1 / 156)


def loggamma_of_size(np: Facade, x: Any) -> Any:
    """ln |gamma(x)|."""
    left = x < 0.5
    z = np.where(left, 1.0 - x, x)
    value = _stirling(np, z) - np.log(_product(np, z))
    return np.where(left, math.log(math.pi) - np.log(np.abs(_sine(np, x))) - value, value)


def betaln(np: Facade, a: Any, b: Any) -> Any:
    """ln of the beta function of positive numbers; of a large one by differences of the series."""
    for v in (a, b):
        for e in traced(np.graph, v).elements().flat:
            np.graph.limited(np.graph.op("gt", e, np.graph.const(0.0)))
    with in_passes(np.graph):
        s, z = np.minimum(a, b), np.maximum(a, b)
        far, farther = z + _STEPS, z + s + _STEPS
        ratio = reduce(lambda p, k: p * (1.0 + s / (z + k)), range(1, _STEPS), 1.0 + s / z)
        rest = _series(farther) - _series(far) + (far - 0.5) * np.log1p(s / far)
        return loggamma_of_size(np, s) - rest + s - s * np.log(farther) + np.log(ratio)


def gamma(np: Facade, x: Any) -> Any:
    """The gamma function: (x - 1)! of integers."""
    left = x < 0.5
    z = np.where(left, 1.0 - x, x)
    root = np.exp(0.5 * _stirling(np, z))  # gamma(z + 8) is too large before gamma(z) is
    value = root / _product(np, z) * root
    value = np.where(left, math.pi / (_sine(np, x) * value), value)
    pole = np.where(x == 0.0, np.copysign(math.inf, x), math.nan)
    return np.where((x <= 0.0) & (x == np.rint(x)), pole, value)


def _sine(np: Facade, x: Any) -> Any:
    """sin(pi x), 0 at integers."""
    nearest = np.rint(x)
    half = 0.5 * nearest
    odd = half - np.floor(half)
    return (1.0 - 4.0 * odd) * np.sin(math.pi * (x - nearest))


def _product(np: Facade, z: Any) -> Any:
    """z (z + 1) ... (z + 7), by which gamma(z + 8) is larger, as long as 8 counts."""
    z = np.minimum(z, 1e30)
    return reduce(lambda a, b: a * b, (z + k for k in range(1, _STEPS)), z)


def _stirling(np: Facade, z: Any) -> Any:
    """ln gamma(z + 8)."""
    far = z + _STEPS
    return (far - 0.5) * np.log(far) - far + 0.5 * math.log(2 * math.pi) + _series(far)


def _series(far: Any) -> Any:
    """What Stirling's formula leaves out."""
    square = 1.0 / (far * far)
    return reduce(lambda total, c: total * square + c, reversed(_SERIES)) / far


_MOST = 40.0  # the largest exponent whose terms are written out


def _exponent(a: Any) -> float:
    """Return the exponent of an incomplete gamma function, an integer or a half one."""
    number = known_numbers(a, "exponents of the incomplete gamma function")
    if number.size != 1 or not 0.0 < number.item() <= _MOST or number.item() % 0.5:
        raise Untraceable("the incomplete gamma function of an exponent that is not a half integer")
    return float(number.item())


def upper_gamma(np: Facade, a: Any, x: Any) -> Any:
    """The part of the gamma function's integral beyond x, by a sum of a few terms."""
    exponent = _exponent(a)
    near = np.minimum(x, 1e3)  # beyond, exp(-x) is 0
    begin = exponent % 1.0
    value = elementwise(np.graph, "erfc", np.sqrt(near)) if begin else 0.0
    term = np.exp(-near) * (np.sqrt(near) / math.gamma(1.5) if begin else 1.0)
    for k in range(int(exponent)):
        value = value + term
        term = term * near / (k + 1.0 + begin)
    return np.where(x < 0.0, math.nan, value)


def lower_gamma(np: Facade, a: Any, x: Any) -> Any:
    """The part up to x: by a series where that is the smaller one."""
    exponent, total = _exponent(a), 1.0
    near = np.minimum(np.maximum(x, 0.0), exponent + 1.0)
    for k in range(int(40 + 2 * exponent), 0, -1):
        total = 1.0 + near / (exponent + k) * total
    small = np.power(near, exponent) * np.exp(-near) / math.gamma(exponent + 1.0) * total
    beyond = upper_gamma(np, exponent, x)
    return np.where(x < exponent + 1.0, np.where(x < 0.0, math.nan, small), 1.0 - beyond)
