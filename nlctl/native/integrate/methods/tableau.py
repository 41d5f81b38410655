"""Explicit Runge-Kutta pairs as data: the coefficients of a method, checked."""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ....errors import ParameterError
from ..memory import Places1, Places2, Reals1, Reals2, with_table
from . import rodas5p
from .quartic import following_nodes

_Rows = tuple[tuple[float, ...], ...]


class ExplicitPair(NamedTuple):
    """An explicit pair as `explicit` and `excursions` take it."""

    order: float
    stable: float  # h |lambda| up to which its steps are
    A: Reals2  # (stages, stages), or wider: its written-out sums read six numbers of a row
    B: Reals2  # (stages, powers): the dense output
    C: Reals1
    E: Reals1
    inside: Reals2  # three parts of a step at which event functions are kept, and what follows
    # from them: of this pair, 0 if it has no such stages, of the stiff method, and of neither
    kept: Places1  # which of these parts a stage belongs to, 3 for none
    table: Places2


@dataclass(frozen=True, kw_only=True)
class Tableau:
    """Butcher tableau of an explicit pair whose last stage is the derivative at the end of a step.

        k_s = f(t + c_s h, x + h sum_{i<s} a_si k_i),    x(t + h) = x + h sum_i a_mi k_i

    The last row of `a` is that of the solution, so that the last stage is the first of the next
    step.  A method without this property gets its weights as one more row, with the error weight
    0; that costs nothing, for the next step begins with it.

    Attributes
    ----------
    name : str
    order : int
        Of the solution; the error is that of one order less.
    a : tuple of tuple of float
        Rows of the stages behind the first: 1, 2, ... numbers.
    c : tuple of float
        Nodes of all stages, the first 0 and the last 1.
    error : tuple of float
        Weights of all stages in the difference of both solutions.
    stable : float
        |h lambda| on the negative real axis up to which a step is stable, or a little less.
    dense : tuple of tuple of float
        The solution inside a step, x + h sum_i b_i(theta) k_i: coefficients of theta, theta^2, ...
        for each stage.  Without any, the cubic polynomial with both ends' values and slopes.

    Raises
    ------
    ParameterError
        If these are not the coefficients of such a pair.

    Examples
    --------
    >>> bogacki_shampine = Tableau(
    ...     name="bs3", order=3, a=((1 / 2,), (0.0, 3 / 4), (2 / 9, 1 / 3, 4 / 9)),
    ...     c=(0.0, 1 / 2, 3 / 4, 1.0), error=(-5 / 72, 1 / 12, 1 / 9, -1 / 8), stable=2.5)
    >>> bogacki_shampine.stages
    4
    """

    name: str
    order: int
    a: _Rows
    c: tuple[float, ...]
    error: tuple[float, ...]
    stable: float
    dense: _Rows = ()

    def __post_init__(self) -> None:
        stages, rows = self.stages, [len(row) for row in self.a]
        self._need(stages >= 3, "at least 3 stages", stages)
        self._need(rows == list(range(1, stages)), f"rows of 1 to {stages - 1} numbers in a", rows)
        self._need(len(self.error) == stages, f"{stages} numbers in error", len(self.error))
        self._need(self.order >= 1, "order >= 1", self.order)
        self._need(self.stable > 0, "stable > 0", self.stable)
        self._need(self.c[0] == 0.0 and self.c[-1] == 1.0, "c from 0 to 1", self.c)
        sums = [sum(row) for row in self.a]
        self._need(np.allclose(sums, self.c[1:], rtol=0, atol=1e-12), "c as row sums of a", sums)
        off = abs(sum(self.error))
        self._need(off < 1e-12, "error weights with the sum 0", off)
        if self.dense:
            sizes = {len(row) for row in self.dense}
            self._need(len(self.dense) == stages and len(sizes) == 1, "dense by stages", sizes)
            ends = np.sum(self.dense, axis=1)
            fits = np.allclose(ends, [*self.a[-1], 0.0], rtol=0, atol=1e-12)
            self._need(fits, "dense to end at the solution", ends)

    def _need(self, holds: bool, rule: str, value: object) -> None:
        if not holds:
            raise ParameterError(f"Tableau '{self.name}' needs {rule}, got {value}")

    @property
    def stages(self) -> int:
        """Number of stages, the one at the end of the step included."""
        return len(self.c)

    def pair(self) -> ExplicitPair:
        """Return the arrays that steps are made with.

        Returns
        -------
        ExplicitPair
            For the integrators.
        """
        A = np.zeros((self.stages, max(self.stages, 6)))
        for s, row in enumerate(self.a, start=1):
            A[s, :s] = row
        parts = self._parts()
        kept = np.array([parts.index(c) if c in parts else 3 for c in self.c], dtype=np.int64)
        rows = (parts or (0.0, 0.0, 0.0), rodas5p.INSIDE, (0.25, 0.5, 0.75))
        return with_table(
            ExplicitPair,
            order=float(self.order),
            stable=float(self.stable),
            A=A,
            B=np.array(self.dense) if self.dense else self._cubic(),
            C=np.array(self.c),
            E=np.array(self.error),
            inside=np.array([following_nodes(row) for row in rows]),
            kept=kept,
        )

    def _parts(self) -> tuple[float, ...]:
        """Return three parts of a step at which there are stages, as far apart as there are."""

        def gap(parts: tuple[float, ...]) -> float:
            return float(np.min(np.diff([0.0, *parts, 1.0])))

        inner = sorted({c for c in self.c if 0.0 < c < 1.0})
        return max(itertools.combinations(inner, 3), key=gap, default=())

    def _cubic(self) -> np.ndarray:
        """Hermite's polynomial: 3 theta^2 - 2 theta^3 of the step, and a part of both slopes."""
        B = np.outer([*self.a[-1], 0.0], [0.0, 3.0, -2.0])
        B[0] += [1.0, -2.0, 1.0]
        B[-1] += [0.0, -1.0, 1.0]
        return B


@functools.cache
def pair_of(tableau: Tableau) -> ExplicitPair:
    """Return the arrays that steps are made with, laid out once."""
    return tableau.pair()
