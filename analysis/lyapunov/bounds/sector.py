"""Assumption 3: the sector of F(x, v) = f(x, v) - f(x, 0), (4)-(8), proved over a box."""

from collections.abc import Callable
from typing import Any

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import of_type
from nlctl.attributes import described_record
from nlctl.errors import DiagramError, ParameterError
from nlctl.expressions.arrays import Tracer
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.expressions.quotients import difference_quotient
from nlctl.params import equation_arguments
from nlctl.plants import PureFeedback, coordinate_names

from ...intervals.agreement import agreeing
from ...intervals.box import Box
from ...intervals.branch_and_bound import Range, enclose
from ...intervals.machine import Readable
from ...intervals.quotient import slope_in


@described_record(made_by="sector")
class Sector:
    """Sector constants of Assumption 3 over a box.

    The paper prints m1 v <= F <= m2 v for v >= 0 and m3 v <= F <= m4 v for v < 0; dividing by
    v < 0 turns the second pair round, so m4 <= F/v <= m3 there.
    """

    # Proved range of F/v over the box with v >= 0 and with v < 0; at v = 0 it is dF/dv. None where
    # the box has no such v.
    positive: Range | None
    negative: Range | None
    box: Box

    @property
    def m1(self) -> float:
        """Lower bound of F/v for v >= 0."""
        return self.positive.low if self.positive else np.nan

    @property
    def m2(self) -> float:
        """Upper bound of F/v for v >= 0."""
        return self.positive.high if self.positive else np.nan

    @property
    def m3(self) -> float:
        """Upper bound of F/v for v < 0."""
        return self.negative.high if self.negative else np.nan

    @property
    def m4(self) -> float:
        """Lower bound of F/v for v < 0."""
        return self.negative.low if self.negative else np.nan

    @property
    def G_min(self) -> float:  # noqa: N802
        """Lower bound of G = F/v (8); Assumption 3 holds on the box where it is positive."""
        return float(np.nanmin([self.m1, self.m4]))

    @property
    def G_max(self) -> float:  # noqa: N802
        """Upper bound of G = F/v (8)."""
        return float(np.nanmax([self.m2, self.m3]))

    @property
    def boxes(self) -> int:
        """Boxes of the branch and bound."""
        return sum(half.boxes for half in (self.positive, self.negative) if half)

    @property
    def arithmetic(self) -> set[str]:
        """What proved both: "floats", "balls", or one each."""
        return {half.arithmetic for half in (self.positive, self.negative) if half}


def plant_terms(plant: Any) -> tuple[Callable[[Any, Any], Any], Callable[[Any, Any], Any]]:
    """Return f(x, v) and d(x, t) of a plant record of the class (1)."""
    if not (hasattr(plant, "f") and hasattr(plant, "d")):
        raise DiagramError(
            f"{type(plant).__name__} is not a plant of the class (1): it lacks f and d; see "
            "nlctl.PureFeedback"
        )
    f, d = (agreeing(function, _refusal(plant)) for function in (plant.f, plant.d))
    if isinstance(plant, PureFeedback):  # the user's functions, without parameters
        return f, d
    p = equation_arguments(plant)
    return lambda x, v: f(x, v, p), lambda x, t: d(x, t, p)


def _refusal(plant: object) -> Callable[[str], DiagramError]:
    return lambda why: DiagramError(
        f"f and d of {type(plant).__name__} are not what they are of numbers: {why}"
    )


@as_annotated
def sector(plant: Any, box: Box, *, tol: float = 1e-3, max_boxes: int = 50_000) -> Sector:
    """Prove the sector constants m1, ..., m4 and G_max of Assumption 3 over a box.

    Parameters
    ----------
    plant : record
        Plant of the class (1) with f(x, v), for instance `nlctl.plants.ForcedDuffing`.
    box : Box
        Sides x1, ..., xn and v.
    tol : float, optional
        Each constant is at most this far from a value of F/v that is attained.
    max_boxes : int, optional
        Limit for each constant.

    Raises
    ------
    UnknownNameError
        If the box lacks a side.
    ParameterError
        If it is not a box, or `tol` is not positive.

    Examples
    --------
    h(x, v) / v of Example 1 lies in (1 +- 0.1) (1 +- 0.2):

    >>> from nlctl.analysis.lyapunov import Box, sector
    >>> box = Box(names=("x1", "x2", "v"), low=(-1.0, -1.0, 0.0), high=(1.0, 1.0, 5.0))
    >>> found = sector(nlctl.plants.ForcedDuffing(), box).positive
    >>> 0.9 * 0.8 <= found.low and found.high <= 1.1 * 1.2 + 1e-6
    True
    """
    f, _ = plant_terms(plant)
    box = of_type("sector", "box", box, Box, "Box.of(x1=(-1, 1), v=(-5, 5))")
    if not tol > 0:
        raise ParameterError(f"sector needs tol > 0, got {tol}")
    box = box.only(*coordinate_names(len(plant.states)), "v")
    quotient = quotient_function(lambda x, v: f(tuple(x), v))
    return range_of_quotient(quotient, box, tol=tol, max_boxes=max_boxes)


def quotient_function(
    function: Callable[[tuple[Any, ...], Any], Any],
    expression: Callable[[Graph, tuple[Tracer, ...]], Expr] | None = None,
) -> Readable:
    """Return (q(x, v) - q(x, 0)) / v as a function of x and v together."""

    def gain(point: tuple[Any, ...]) -> Any:
        *x, v = point
        return slope_in(lambda v: function(tuple(x), v), v)

    def quotient(graph: Graph, sides: tuple[Tracer, ...]) -> list[Expr]:
        if expression is None:
            raise Untraceable("no expression is known")
        return [difference_quotient(graph, expression(graph, sides), sides[-1].only)]

    return Readable(of_balls=gain, expressions=quotient)


def range_of_quotient(gain: Readable, box: Box, *, tol: float, max_boxes: int) -> Sector:
    """Prove the range of a quotient over a box whose last side is v."""
    (low, high), rest = box["v"], box.only(*box.names[:-1])
    halves: list[Range | None] = []
    for a, b in ((max(low, 0.0), high), (low, min(high, 0.0))):
        part = rest.times("v", a, b) if a < b or (a == b and low == high) else None
        halves.append(enclose(gain, part, tol=tol, max_boxes=max_boxes) if part else None)
    return Sector(positive=halves[0], negative=halves[1], box=box)
