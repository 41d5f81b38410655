"""Decrease of a Lyapunov function on a level set, proved or refuted on balls.

The rate V' = dV/dx . f along a direction: exact derivatives of a function that is enclosed.

A `Rate` carries a quantity q and q' through a function, each a `Ball`, so that the derivative is
that of the function itself and of nobody's formula.  At a corner of min, max or abs it encloses
both sides; where the function jumps, or compares what a box leaves open, there is none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from flint import arb, ctx

from nlctl.annotations import as_annotated
from nlctl.arguments import a_function, of_type
from nlctl.errors import ParameterError
from nlctl.expressions.continuity import may_jump
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.functions import FUNCTIONS
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.native.enclosures.boxes import numbers_at
from nlctl.wording import counted

from .agreement import one_number, several_numbers
from .arithmetic import Ball, as_ball, of_unknown_slope
from .box import Box, face_of_box
from .branch_and_bound import Proof, point_text, prove
from .machine import Readable, readable
from .numpy_functions import JUMPS, NumPyFunctions, enclosed_table, of_lifted
from .pairs import FUNCTIONS_OF_TWO
from .paths import Undecided, undecided


def as_rate(x: object) -> Any:
    """Return a number as a quantity that does not change; NotImplemented for what is none."""
    if isinstance(x, Rate):
        return x
    ball = as_ball(x)
    return ball if ball is NotImplemented else Rate(ball, Ball(arb(0)))


class Rate(NumPyFunctions):
    """A quantity and its rate."""

    __slots__ = ("here", "rate")
    rank = 1

    def __init__(self, here: Ball, rate: Ball) -> None:
        self.here = here
        self.rate = rate

    def __neg__(self) -> Rate:
        return Rate(-self.here, -self.rate)

    @of_lifted
    def __add__(self, other: Rate) -> Any:
        return Rate(self.here + other.here, self.rate + other.rate)

    @of_lifted
    def __mul__(self, other: Rate) -> Any:
        if other is self:
            return self**2
        return Rate(self.here * other.here, self.here * other.rate + other.here * self.rate)

    @of_lifted
    def __truediv__(self, other: Rate) -> Any:
        value = self.here / other.here
        return Rate(value, (self.rate - value * other.rate) / other.here)

    def _whole_power(self, n: int) -> Rate:
        slope = n * self.here ** max(n - 1, 0)
        return Rate(self.here**n, slope * self.rate)

    def __abs__(self) -> Rate:
        return self._chosen(-self, abs(self.here))

    def minimum(self, other: Rate) -> Rate:
        """Smaller one; where that is open the rate is one or the other."""
        other = as_rate(other)
        return self._chosen(other, self.here.minimum(other.here))

    def maximum(self, other: Rate) -> Rate:
        """Larger one; where that is open the rate is one or the other."""
        other = as_rate(other)
        return self._chosen(other, self.here.maximum(other.here))

    def _chosen(self, other: Rate, value: Ball) -> Rate:
        for one in (self, other):
            if value is one.here:
                return Rate(value, one.rate)
        a, b = self.rate, other.rate
        n = max(len(a.gradient), len(b.gradient))
        both = (x.gradient or (arb(0),) * n for x in (a, b))
        gradient = tuple(arb(0, "inf") for _ in zip(*both, strict=True))  # it may jump from a to b
        return Rate(value, Ball(a.value.union(b.value), gradient))

    def apply(self, name: str) -> Rate:
        """Return phi of the quantity for the NumPy function of that name."""
        here = self.here.apply(name)
        if name in JUMPS or name == "sinc":
            slope = Ball(self.here.value, (arb(1),)).apply(name).gradient[0]
            return Rate(here, of_unknown_slope(slope, self.here) * self.rate)
        return Rate(here, as_ball(FUNCTIONS[name].derivative[0](self.here)) * self.rate)

    def pair(self, name: str, other: Rate) -> Any:
        """Return phi of this and another quantity for the NumPy function of that name."""
        other = as_rate(other)
        if other is NotImplemented:
            return other
        _, by_self, by_other = FUNCTIONS_OF_TWO[name](self.here.value, other.here.value)
        rate = Ball(arb(0))
        for one, slope in ((self, by_self), (other, by_other)):
            if not one.rate.value.is_zero():
                rate = rate + of_unknown_slope(slope, one.here) * one.rate
        return Rate(self.here.pair(name, other.here), rate)

    def table(self, xp: tuple[float, ...], fp: tuple[float, ...]) -> Rate:
        """Return the linear interpolation of a table."""
        _, slope = enclosed_table(self.here.value, xp, fp)
        return Rate(self.here.table(xp, fp), of_unknown_slope(slope, self.here) * self.rate)

    lifted = staticmethod(as_rate)

    def _compared(self, order: str, other: Rate) -> Any:
        """A choice between formulas may jump: only what the whole box decides is followed."""
        other = as_rate(other)
        if other is NotImplemented:
            return other
        with undecided():
            return self.here._compared(order, other.here)


STRICT = 1e-9  # V' < 0 is proved as V' <= -1e-9
_DIGITS = 400  # binary ones, of V' at a point
_SAME = 1e-9  # relative: between a gradient that is given and the derivatives of V
_FACE = 20_000  # boxes on a face of the box
Scalar = Callable[[tuple[Any, ...]], Any]
Vector = Callable[[tuple[Any, ...]], Sequence[Any]]


@as_annotated
def prove_decrease(
    V: Scalar,
    rhs: Vector,
    box: Box,
    *,
    level: float,
    floor: float,
    gradient: Vector | None = None,
    max_boxes: int = 100_000,
) -> Proof:
    """Prove or refute V' < 0 where floor <= V <= level, V' being the rate of V along the rhs.

    V' is made of exact derivatives of V itself: a gradient need not be given.  Before it is looked
    at, V > level is proved on every face of the box, so that no trajectory of the level set leaves
    it.
    The origin, where V' = 0, must be cut out by `floor`; near it the linearisation decides.

    Parameters
    ----------
    V, rhs : callable
        Of the tuple (x1, ..., xn): the function, and x'.  V has to be continuous: write cases as
        np.minimum, np.maximum or abs.
    box : Box
        Must hold the level set, or the component of it that is meant.  Sides that V does not
        depend on, with the rate 0, are parameters and disturbances: anything between their ends.
    level, floor : float
        The values of V between which V' < 0 is claimed.
    gradient : callable, optional
        Of the same tuple: what is held to be the gradient of V.  It is compared with the
        derivatives of V on every box, and nothing is proved if it is another function.
    max_boxes : int, optional
        Limit of the branch and bound.

    Returns
    -------
    Proof
        Proved is V' <= -1e-9.  If it is refuted, `where` is a point in the set with V' >= 0, and
        `value` is V' there; where V' is between these, it is undecided.

    Raises
    ------
    ParameterError
        If `gradient` is not that of V somewhere in the box; if the box does not hold the level
        set; if V compares, and so may jump; if a function asks what its arguments are, or makes of
        balls what it does not of floats; if not 0 < floor < level.

    Examples
    --------
    V = x1^2 + x2^2 of a focus has V' = -2 V:

    >>> from nlctl.analysis.lyapunov import Box, prove_decrease
    >>> proof = prove_decrease(
    ...     lambda x: x[0] ** 2 + x[1] ** 2,
    ...     rhs=lambda x: (-x[0] + x[1], -x[0] - x[1]),
    ...     box=Box(names=("x1", "x2"), low=(-1.0, -1.0), high=(1.0, 1.0)), level=0.9, floor=0.1,
    ... )
    >>> print(proof.status)
    proved
    """
    of_type("prove_decrease", "box", box, Box, "Box.of(x1=(-1, 1), x2=(-1, 1))")
    for name, function in (("V", V), ("rhs", rhs), ("gradient", gradient or rhs)):
        a_function("prove_decrease", name, function)
    if not 0 < floor < level < np.inf:
        raise ParameterError(f"prove_decrease needs 0 < floor < level, got {floor:g} and {level:g}")
    high, low, given = float(level), float(floor), gradient and _compared("gradient", gradient)
    plain, V, rhs = (V, rhs), _compared("V", V), _compared("rhs", rhs)
    _check_continuous(V, box)
    fixed = _parameters(V, rhs, box)
    open_face = _check_faces(
        readable(V, plain[0]),
        box,
        high,
        [i for i in range(len(fixed)) if not fixed[i]],
    )
    if open_face is not None:
        return open_face

    def along(x: tuple[Any, ...]) -> Rate:
        rates = rhs(x)
        if len(rates) != len(box.names):
            raise ParameterError(f"rhs gives {_of_states(len(rates), 'rate', box)}")
        if given is not None:
            _check_gradient(V, given, x, box)
        return as_rate(V(tuple(map(Rate, map(as_ball, x), map(as_ball, rates)))))

    def least(x: tuple[Any, ...]) -> Any:
        V_x = along(x)
        return np.minimum(V_x.rate + STRICT, np.minimum(high - V_x.here, V_x.here - low))

    # Positive where a point inside the level set has V' > -STRICT, and nowhere else.
    claim: Any = least
    if given is None:
        claim = Readable(of_balls=least, expressions=partial(_conditions, *plain, low, high))
    proof = _with_the_rate(prove(claim, box, high=0.0, max_boxes=max_boxes), along)
    if proof.holds is None and proof.value < 0:  # V' is nearly 0 somewhere; is it above it, too?
        rises = _with_the_rate(prove(claim, box, high=STRICT, max_boxes=max_boxes), along)
        proof = rises if rises.holds is False else proof
    return proof


def _with_the_rate(proof: Proof, along: Callable[[tuple[Any, ...]], Rate]) -> Proof:
    """Return V' with the point that refutes; where it lies between -STRICT and 0, none does."""
    if proof.holds is not False:
        return proof
    with ctx.workprec(_DIGITS):
        x = tuple(Ball(arb(v)) for v in (proof.where or {}).values())
        try:
            rate = as_ball(along(x).rate).value
        except Undecided:
            return replace(proof, value=np.nan)
    if rate < 0:
        return replace(proof, holds=None, undecided=1, value=float(rate.mid()))
    return replace(proof, value=max(float(rate.mid()), 0.0))


def _conditions(
    V: Scalar, rhs: Vector, low: float, high: float, graph: Graph, sides: tuple[Any, ...]
) -> list[Expr]:
    """Return what is positive at once where V' is not negative in the level set."""
    (value,), rates = (numbers_at(graph, function, sides) for function in (V, rhs))
    if len(rates) != len(sides) or may_jump([value]):
        raise Untraceable("V may jump, or there are not as many rates as sides")
    (rate,) = tangents(graph, [value], lambda leaf: graph.number(rates[leaf.data[1]]))
    rate, op = graph.const(0.0) if rate is None else rate, graph.op
    return [
        op("add", rate, graph.const(STRICT)),
        op("sub", graph.const(high), value),
        op("sub", value, graph.const(low)),
    ]


def _compared(name: str, function: Callable[..., Any]) -> Any:
    """Return a function that is compared with itself on floats."""
    numbers = one_number if name == "V" else several_numbers
    return numbers(
        function, lambda why: ParameterError(f"prove_decrease needs {name} of numbers: {why}")
    )


def _of_states(count: int, what: str, box: Box) -> str:
    return f"{counted(count, what)} for {counted(len(box.names), 'state')}"


def _wide(box: Box) -> tuple[Ball, ...]:
    return tuple(Ball(arb(a).union(arb(b))) for a, b in box.cell)


def _check_continuous(V: Scalar, box: Box) -> None:
    """Refuse V that compares: its pieces need not fit."""
    try:
        V(tuple(Rate(x, Ball(arb(0))) for x in _wide(box)))
    except Undecided as error:
        raise ParameterError(
            f"prove_decrease needs a V that is continuous, and cannot see it of cases ({error}): "
            "write them as np.minimum, np.maximum or abs"
        ) from None


def _parameters(V: Scalar, rhs: Vector, box: Box) -> list[bool]:
    """Return which sides are parameters: V does not depend on them, and their rates are 0."""
    n, wide = len(box.names), _wide(box)
    unit = [tuple(arb(int(i == j)) for i in range(n)) for j in range(n)]
    inner = tuple(Ball(x.value, row) for x, row in zip(wide, unit, strict=True))
    slopes = as_ball(V(inner)).gradient or (arb(0),) * n
    try:
        rates = [as_ball(rate).value for rate in rhs(wide)]
    except Undecided:
        return [False] * n
    return [bool(s.is_zero() and r.is_zero()) for s, r in zip(slopes, rates, strict=False)]


def _check_faces(V: Scalar, box: Box, level: float, sides: Sequence[int]) -> Proof | None:
    """Prove V > level on faces of a box; return the proof of one that stays open."""
    if not np.all(np.isfinite(box.cell)):
        raise ParameterError(f"prove_decrease needs a finite box, got {box}")
    for i in sides:
        name = box.names[i]
        for end in box.cell[i]:
            above = float(np.nextafter(level, np.inf))
            proof = prove(V, face_of_box(box, i, end), low=above, max_boxes=_FACE)
            if proof.holds is False:
                raise ParameterError(
                    f"the box does not hold the level set: V = {proof.value:.6g} <= {level:g} at "
                    f"{point_text(proof.where)}, on its face {name} = {end:g}: take a larger box, "
                    "or a lower level"
                )
            if proof.holds is None:
                return proof
    return None


def _check_gradient(V: Scalar, gradient: Vector, x: tuple[Any, ...], box: Box) -> None:
    """Compare what is given with the derivatives of V: on a box, and at a point without width."""
    n = len(box.names)
    unit = [tuple(arb(int(i == j)) for i in range(n)) for j in range(n)]
    values = [as_ball(one).value for one in x]
    inner = tuple(map(Ball, values, unit))
    true = as_ball(V(inner)).gradient or (arb(0),) * n
    given = [as_ball(g).value for g in gradient(tuple(map(Ball, values)))]
    if len(given) != n:
        raise ParameterError(f"gradient gives {_of_states(len(given), 'derivative', box)}")
    for name, one, other in zip(box.names, true, given, strict=True):
        if one.is_finite() and other.is_finite():
            room = _SAME * (1 + float(abs(one).upper()))
            if not (one + arb(0, room)).overlaps(other):
                middle = (float(v.mid()) for v in values)
                at = point_text(dict(zip(box.names, middle, strict=True)))
                raise ParameterError(
                    f"gradient gives dV/d{name} = {other} around {at}, the derivative of V is {one}"
                )
