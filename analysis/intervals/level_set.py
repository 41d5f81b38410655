"""Decrease of a Lyapunov function on a level set, proved or refuted on balls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from flint import arb

from nlctl.errors import ParameterError

from .arithmetic import Ball, as_ball
from .box import Box
from .branch_and_bound import Proof, prove

__all__ = ["prove_decrease"]

STRICT = 1e-9  # V' < 0 is proved as V' <= -1e-9
Scalar = Callable[[tuple[Any, ...]], Any]
Vector = Callable[[tuple[Any, ...]], Sequence[Any]]


def prove_decrease(
    V: Scalar,
    gradient: Vector,
    rhs: Vector,
    box: Box,
    *,
    level: float,
    floor: float,
    max_boxes: int = 100_000,
) -> Proof:
    """Prove or refute V' < 0 where floor <= V <= level, V' being the gradient times the rhs.

    The origin, where V' = 0, must be cut out by `floor`; near it the linearisation decides.

    Parameters
    ----------
    V, gradient, rhs : callable
        Of the tuple (x1, ..., xn): the function, its gradient, and x'.
    box : Box
        Must hold the level set.
    level, floor : float
        The values of V between which V' < 0 is claimed.
    max_boxes : int, optional
        Limit of the branch and bound.

    Returns
    -------
    Proof
        If it is refuted, `where` is a point in the set with V' > -1e-9.

    Raises
    ------
    ParameterError
        If `gradient` is not that of V at the centre of the box's upper quarter, or not
        0 < floor < level.

    Examples
    --------
    V = x1^2 + x2^2 of a focus has V' = -2 V:

    >>> from analysis.lyapunov import Box, prove_decrease
    >>> proof = prove_decrease(
    ...     lambda x: x[0] ** 2 + x[1] ** 2,
    ...     lambda x: (2 * x[0], 2 * x[1]),
    ...     lambda x: (-x[0] + x[1], -x[0] - x[1]),
    ...     Box(names=("x1", "x2"), low=(-1.0, -1.0), high=(1.0, 1.0)), level=0.9, floor=0.1,
    ... )
    >>> proof.holds
    True
    """
    if not 0 < floor < level:
        raise ParameterError(f"prove_decrease needs 0 < floor < level, got {floor:g} and {level:g}")
    _check_gradient(V, gradient, box)
    high, low = float(level), float(floor)

    def least(x: tuple[Any, ...]) -> Any:
        V_x = V(x)
        slope = sum(g * f for g, f in zip(gradient(x), rhs(x), strict=True))
        return np.minimum(slope + STRICT, np.minimum(high - V_x, V_x - low))

    # Positive where a point inside the level set has V' > -STRICT, and nowhere else.
    return prove(least, box, high=0.0, max_boxes=max_boxes)


def _check_gradient(V: Scalar, gradient: Vector, box: Box) -> None:
    n = len(box.names)
    point = [arb(0.25 * a + 0.75 * b) for a, b in box.cell]
    unit = np.eye(n, dtype=int)
    x = tuple(Ball(p, tuple(arb(int(e)) for e in row)) for p, row in zip(point, unit, strict=True))
    told = [as_ball(g).value for g in gradient(tuple(map(Ball, point)))]
    for name, true, given in zip(box.names, as_ball(V(x)).gradient, told, strict=True):
        if not abs(true - given) < 1e-9 * (1 + abs(true)):
            raise ParameterError(
                f"gradient gives dV/d{name} = {given} at {point}, the derivative of V is {true}"
            )
