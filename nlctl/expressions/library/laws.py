"""Laws of probability, as `scipy.stats` has them: what surrounds the formula of each family.

The formula itself is SciPy's, `family._pdf(z, ...)`: it is traced like any function of the user's.
Source: `scipy/stats/_distn_infrastructure.py`, `rv_continuous`.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

from ...upstream import scipy_internals
from ..arrays import traced
from ..graph import Graph, Untraceable
from .gamma import loggamma_of_size
from .special import enter_scipy, xlogy
from .table import WRITTEN, Facade, enter, formula

__all__: list[str] = []

# of a method: what it is at the lower end of the support or below, and at the upper or above; None
# if the ends are in the support, and it is as large on both sides
_OUTSIDE = {"pdf": (0.0, None), "logpdf": (-math.inf, None), "cdf": (0.0, 1.0), "sf": (1.0, 0.0),
            "logcdf": (-math.inf, 0.0), "logsf": (0.0, -math.inf)}  # fmt: skip
LAW_METHODS = (*_OUTSIDE, "ppf", "isf")


@functools.cache
def _enter_formulas() -> None:
    """Enter what families' formulas are made of."""
    enter_scipy()
    enter([scipy_internals.apply_where()], _by_condition)
    enter([scipy_internals.lazy_select()], _by_conditions)
    formula(scipy_internals.beta_density())(_density_of_beta)
    WRITTEN.pop(None, None)  # what this SciPy does not have


def _by_condition(
    graph: Graph, condition: Any, given: Any, first: Any, second: Any = None,
    *, fill_value: Any = None, xp: object = None,
) -> Any:  # fmt: skip
    given = given if isinstance(given, tuple) else (given,)
    other = fill_value if second is None else second(*given)
    return Facade(graph).where(condition, first(*given), other)


def _by_conditions(
    graph: Graph, conditions: Any, formulas: Any, given: Any, default: Any = 0.0
) -> Any:
    values = [value(*given) for value in formulas]
    return Facade(graph).select(list(conditions), values, default)


def _density_of_beta(np: Facade, x: Any, a: Any, b: Any) -> Any:
    size = [loggamma_of_size(np, traced(np.graph, v)) for v in (a + b, a, b)]
    powers = xlogy(np, a - 1.0, x) + xlogy(np, b - 1.0, 1.0 - x)
    return np.exp(powers + size[0] - size[1] - size[2])


def is_law(thing: object) -> bool:
    """Whether a thing is a continuous law of SciPy's, or one with its numbers."""
    of_scipy = type(thing).__module__.startswith("scipy.stats")
    return of_scipy and hasattr(getattr(thing, "dist", thing), "_pdf")


class FrozenLaw:
    """A law with its numbers, some of which depend on the state."""

    def __init__(self, graph: Graph, family: Any, numbers: tuple[Any, ...], named: Any) -> None:
        self.graph, self.family, self.numbers, self.named = graph, family, numbers, named

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name not in LAW_METHODS:
            raise Untraceable(f"{name}() of a law of probability")
        return lambda x: of_law(self.graph, self.family, name, x, *self.numbers, **self.named)


def of_law(graph: Graph, family: Any, name: str, x: Any, *numbers: Any, **named: Any) -> Any:
    """Return a function of a law at a place; `family` has SciPy's formulas on expressions."""
    _enter_formulas()
    np = Facade(graph)
    shapes, loc, scale = family.__dict__["_real"]._parse_args(*numbers, **named)
    shapes = [traced(graph, shape) for shape in shapes]
    low, high = family._get_support(*shapes)
    width: Any = traced(graph, scale)
    fits = np.logical_and(family._argcheck(*shapes), width > 0.0)
    place: Any = traced(graph, x)
    formula = getattr(family, f"_{name}")
    if name in ("ppf", "isf"):
        inside = np.logical_and(place > 0.0, place < 1.0)
        value = np.where(inside, formula(place, *shapes) * width + loc, math.nan)
        first, last = (0.0, 1.0) if name == "ppf" else (1.0, 0.0)
        value = np.where(place == first, low * width + loc, value)
        return np.where(fits, np.where(place == last, high * width + loc, value), math.nan)
    z: Any = (place - loc) / width
    below, above = _OUTSIDE[name]
    value = formula(z, *shapes)
    if name == "pdf":
        value = value / width
    elif name == "logpdf":
        value = value - np.log(width)
    if above is None:
        value = np.where(np.logical_or(z < low, z > high), below, value)
    else:
        value = np.where(z >= high, above, np.where(z <= low, below, value))
    return np.where(fits, np.where(z == z, value, math.nan), math.nan)
