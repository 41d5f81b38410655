"""Filtered tracking error (14) and the known part Y_d of its derivative (18)."""

from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from ..equations import equation
from ..errors import ParameterError
from ..params import Floats, param, record
from ..plants import coordinate_names
from ..references import derivative_names


def binomial_lambdas(order: int) -> tuple[float, ...]:
    """Return lambda_1, ..., lambda_{n-1} of (s + 1)^(n-1); (2, 1) for order 3.

    Parameters
    ----------
    order : int
        n, of the plant.

    Returns
    -------
    tuple of float
        n - 1 numbers.

    Examples
    --------
    >>> nlctl.controllers.binomial_lambdas(3)
    (2.0, 1.0)
    """
    return tuple(float(c) for c in np.atleast_1d(np.poly(-np.ones(order - 1)))[1:])


def is_hurwitz(coefficients: Sequence[float]) -> bool:
    """Whether all roots of a polynomial lie in the open left half plane."""
    # By the Routh array in exact fractions: roots on the axis, which rounding moves, are found out.
    numbers = [Fraction(c) for c in coefficients]
    above, row = numbers[::2], numbers[1::2]
    while row:
        if row[0] <= 0:
            return False
        ratio = above[0] / row[0]
        below = [*row[1:], Fraction(0)]
        above, row = row, [a - ratio * b for a, b in zip(above[1:], below, strict=False)]
    return True


def check_hurwitz(who: str, letter: str, coefficients: tuple[float, ...]) -> None:
    """Refuse s^n + a_n s^(n-1) + ... + a_1 with a root that is not in the open left half plane."""
    if not is_hurwitz((1.0, *coefficients[::-1])):
        raise ParameterError(
            f"{who} needs a Hurwitz polynomial s^n + {letter}_n s^(n-1) + ... + {letter}_1, "
            f"got {letter} {coefficients}"
        )


@record
class FilteredError:
    """Filtered tracking error of a plant of order n (14).

        e   = x - x_d,    x_d = (yd, yd', ..., yd^(n-1))
        r   = lambda_{n-1} e_1 + ... + lambda_1 e_{n-1} + e_n
        Y_d = -yd^(n) + lambda_{n-1} e_2 + ... + lambda_1 e_n

    The polynomial s^(n-1) + lambda_1 s^(n-2) + ... + lambda_{n-1} must be Hurwitz.  Of a plant of
    order 1 there are no lambdas, and r = e_1.

    Examples
    --------
    For lambda_1 = 1.5, e_1 = 2 and e_2 = 1 the outputs are e, r = 1.5 e_1 + e_2 and Y_d:

    >>> error = nlctl.block(nlctl.controllers.FilteredError(lambdas=(1.5,)), "error")
    >>> print(error.output(0, [], [2.0, 1.0, 0.0, 0.0, 0.5]))
    [2. 4. 1.]
    """

    lambdas: Floats = param(
        (1.5,),
        unit="s^-i",
        meaning="lambda_1, ..., lambda_{n-1}; the order is their number + 1",
        may_be_empty=True,
    )

    vector = True

    def check(self) -> None:
        """The roots must lie in the open left half plane."""
        if not is_hurwitz((1.0, *self.lambdas)):
            roots = np.roots([1.0, *self.lambdas])
            worst = roots[np.argmax(roots.real)]
            raise ParameterError(
                "FilteredError needs a Hurwitz polynomial s^(n-1) + lambda_1 s^(n-2) + ... (14), "
                f"got lambdas {self.lambdas} with a root at {worst:.3g}"
            )

    @property
    def order(self) -> int:
        """Order n of the plant."""
        return len(self.lambdas) + 1

    plant_order = property(lambda self: self.order)
    inputs = property(lambda self: (*coordinate_names(self.order), *derivative_names(self.order)))
    outputs = ("e", "r", "Y_d")

    @equation
    def output(t, x, u, p):
        """Equations (14) and (18); e is the tracking error e_1."""
        n = p.lambdas.size + 1
        e = u[:n] - u[n : 2 * n]
        A = p.lambdas[::-1]
        r = np.sum(A * e[:-1]) + e[-1]
        Y_d = -u[2 * n] + np.sum(A * e[1:])
        return e[0], r, Y_d
