"""Dynamic surfaces: backstepping that filters its virtual controls and differentiates none."""

from __future__ import annotations

import numpy as np

from ...equations import equation
from ...errors import ParameterError
from ...params import param, record
from ...plants import coordinate_names

__all__ = ["DynamicSurface"]


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

    c: tuple[float, ...] = param(
        (2.0, 4.0), unit="1/s", meaning="gains c_1, ..., c_n; their number is the order n", above=0
    )
    tau: tuple[float, ...] = param(
        (0.02,), unit="s", meaning="time constants tau_2, ..., tau_n of the filters", above=0
    )

    outputs = ("e", "r", "nu", "nu_e")
    feedthrough = True
    vector = True

    def check(self) -> None:
        """A filter between each two surfaces."""
        if len(self.tau) != len(self.c) - 1:
            raise ParameterError(
                f"DynamicSurface needs one tau less than c, and two of c, got {len(self.tau)} of "
                f"tau and {len(self.c)} of c"
            )

    @property
    def plant_order(self) -> int:
        """Order n of the plants that it is made for."""
        return len(self.c)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names x1, ..., xn, yd, yd1."""
        return (*coordinate_names(len(self.c)), "yd", "yd1")

    @property
    def states(self) -> tuple[str, ...]:
        """Names a2, ..., an."""
        return tuple(f"a{i}" for i in range(2, len(self.c) + 1))

    @staticmethod
    @equation
    def update(t, x, u, p):
        """The filters."""
        return surfaces(x, u, p)[1]

    @staticmethod
    @equation
    def output(t, x, u, p):
        """The tracking error, the last surface, and the wanted x_n' in its two parts."""
        s_n, rates = surfaces(x, u, p)
        return u[0] - u[p.c.size], s_n, rates[-1], -p.c[-1] * s_n
