"""Functions that are formulas of others, element by element."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..masked import MaskedPlaces
from ..operators import elementwise, floor_quotient
from .complex_numbers import ComplexPair
from .table import ARRAY_METHODS, Facade, formula, of

__all__: list[str] = []


@formula(np.square)
def square(np: Facade, x: Any) -> Any:
    """x^2."""
    return x * x


@formula(np.reciprocal)
def reciprocal(np: Facade, x: Any) -> Any:
    """1 / x."""
    return 1.0 / x


@formula(np.deg2rad, np.radians, math.radians)
def radians(np: Facade, x: Any) -> Any:
    """Degrees in radians."""
    return x * (np.pi / 180.0)


@formula(np.rad2deg, np.degrees, math.degrees)
def degrees(np: Facade, x: Any) -> Any:
    """Radians in degrees."""
    return x * (180.0 / np.pi)


@formula(np.sinc)
def sinc(np: Facade, x: Any) -> Any:
    """sin(pi x) / (pi x)."""
    y = np.pi * np.where(x == 0.0, 1.0e-20, x)
    return np.sin(y) / y


@formula(np.float_power)
def float_power(np: Facade, x: Any, y: Any) -> Any:
    """x^y of floats."""
    return np.power(x * 1.0, y)


@formula(np.positive, np.real)
def positive(np: Facade, x: Any) -> Any:
    """x."""
    return x.real if isinstance(x, ComplexPair) else x


@formula(np.conj)
def conjugate(np: Facade, x: Any) -> Any:
    """The conjugate complex number."""
    return x.conjugate() if isinstance(x, ComplexPair) else x


@formula(np.imag)
def imaginary(np: Facade, x: Any) -> Any:
    """The imaginary part."""
    return x.imag if isinstance(x, ComplexPair) else 0.0 * x


@formula(np.angle)
def angle(np: Facade, x: Any, deg: bool = False) -> Any:
    """The angle of a complex number."""
    phase = np.arctan2(x.imag, x.real) if isinstance(x, ComplexPair) else np.arctan2(0.0 * x, x)
    return phase * (180.0 / np.pi) if deg else phase


@formula(np.isnan, math.isnan)
def isnan(np: Facade, x: Any) -> Any:
    """Whether x is NaN."""
    return x != x


@formula(np.isfinite, math.isfinite)
def isfinite(np: Facade, x: Any) -> Any:
    """Whether x is a number."""
    return np.abs(x) < math.inf


@formula(np.isinf, math.isinf)
def isinf(np: Facade, x: Any) -> Any:
    """Whether x is infinite."""
    return np.abs(x) == math.inf


@formula(np.signbit)
def signbit(np: Facade, x: Any) -> Any:
    """Whether the sign of x is a minus."""
    return np.copysign(1.0, x) < 0.0


@formula(np.remainder, np.mod)
def remainder(np: Facade, x: Any, y: Any) -> Any:
    """What is left of x by y, with the sign of y."""
    return x % y


@of(np.floor_divide)
def floor_divide(graph: Graph, x: Any, y: Any) -> Tracer:
    """How often y fits into x."""
    return floor_quotient(graph, x, y)


@of(np.divmod)
def both_of_division(graph: Graph, x: Any, y: Any) -> tuple[Tracer, Tracer]:
    """How often y fits into x, and what is left."""
    return floor_quotient(graph, x, y), elementwise(graph, "remainder", x, y)


@formula(np.modf)
def parts_of_number(np: Facade, x: Any) -> Any:
    """What is behind the point, and what is before it."""
    whole = np.trunc(x)
    rest = np.where(np.isinf(x), 0.0, x - whole)
    return rest, whole


@formula(np.logaddexp2)
def logaddexp2(np: Facade, x: Any, y: Any) -> Any:
    """log2(2^x + 2^y)."""
    two = math.log(2.0)
    return np.logaddexp(x * two, y * two) / two


@formula(np.ldexp)
def ldexp(np: Facade, x: Any, n: Any) -> Any:
    """x 2^n."""
    return x * 2.0**n


def _of_two(name: str) -> Any:
    def written(graph: Graph, a: Any, b: Any) -> Tracer:
        a, b = traced(graph, a), traced(graph, b)
        both = elementwise(graph, name, a, b)
        without_nan_in_a = elementwise(graph, "select", elementwise(graph, "ne", a, a), b, both)
        return elementwise(graph, "select", elementwise(graph, "ne", b, b), a, without_nan_in_a)

    return written


of(np.fmax)(_of_two("maximum"))
of(np.fmin)(_of_two("minimum"))


@formula(np.round, np.around)
def _rounded(np: Facade, x: Any, decimals: int = 0) -> Any:
    """x with so many decimals, as NumPy rounds: by a power of ten there and back."""
    if decimals == 0:
        return np.rint(x)
    ten = 10.0 ** abs(decimals)
    if decimals < 0:
        return np.rint(x / ten) * ten
    return np.rint(x * ten) / ten


@formula(np.fix)
def fix(np: Facade, x: Any) -> Any:
    """The integer next to x on the way to 0."""
    return np.trunc(x)


@formula(np.unwrap)
def unwrap(np: Facade, x: Any) -> Any:
    """Angles without jumps by 2 pi."""
    d = np.diff(x)
    full = 2 * np.pi
    kept = (d + np.pi) % full - np.pi
    kept = np.where(np.logical_and(kept == -np.pi, d > 0), np.pi, kept)
    change = np.where(np.abs(d) < np.pi, 0.0, kept - d)
    return np.concatenate([x[:1], x[1:] + np.cumsum(change)])


# -- choices ---------------------------------------------------------------------------------------


@of(np.where)
def where(graph: Graph, condition: Any, *values: Any) -> Any:
    """Return one or the other."""
    if not values:
        return (flatnonzero(graph, condition),)
    return elementwise(graph, "select", condition, *values)


@of(np.nonzero)
def nonzero(graph: Graph, condition: Any) -> tuple[MaskedPlaces]:
    """Return where a condition holds."""
    return (flatnonzero(graph, condition),)


@of(np.flatnonzero)
def flatnonzero(graph: Graph, condition: Any) -> MaskedPlaces:
    """Return where a condition holds."""
    mask = elementwise(graph, "ne", traced(graph, condition), 0.0)
    if mask.ndim != 1:
        raise Untraceable("the places in a matrix where a condition holds")
    return MaskedPlaces(mask)


@of(np.clip)
def _clip(
    graph: Graph, values: Any, low: Any = None, high: Any = None, *, min: Any = None,  # noqa: A002
    max: Any = None, out: Any = None,  # noqa: A002
) -> Any:  # fmt: skip
    """Return values between bounds."""
    low, high = low if low is not None else min, high if high is not None else max
    clipped = traced(graph, values)
    if low is not None:
        clipped = elementwise(graph, "maximum", clipped, low)
    if high is not None:
        clipped = elementwise(graph, "minimum", clipped, high)
    if out is not None:
        out[...] = clipped
    return clipped


@of(np.select)
def select(graph: Graph, conditions: Any, choices: Any, default: Any = 0) -> Any:
    """Return the first choice whose condition holds."""
    chosen = traced(graph, default)
    for condition, choice in reversed(list(zip(conditions, choices, strict=True))):
        chosen = elementwise(graph, "select", condition, choice, chosen)
    return _as_floats(graph, chosen)


def _as_floats(graph: Graph, array: Tracer) -> Tracer:
    return elementwise(graph, "add", array, 0.0)


@of(np.piecewise)
def piecewise(
    graph: Graph, x: Any, conditions: Any, functions: Any, *given: Any, **named: Any
) -> Any:
    """Return what the function of the last condition that holds makes of x."""
    x = traced(graph, x)
    if isinstance(conditions, Tracer):
        conditions = [conditions] if conditions.ndim == x.ndim else list(conditions)
    conditions, functions = list(conditions), list(functions)
    result = traced(graph, np.zeros(x.shape))
    values = [f(x, *given, **named) if callable(f) else f for f in functions]
    if len(values) == len(conditions) + 1:
        result = elementwise(graph, "add", result, values.pop())
    for condition, value in zip(conditions, values, strict=True):
        result = elementwise(graph, "select", condition, value, result)
    return _as_floats(graph, result)


@formula(np.nan_to_num)
def nan_to_num(
    np: Facade, x: Any, copy: bool = True, nan: Any = 0.0, posinf: Any = None, neginf: Any = None
) -> Any:
    """x with numbers for what is none."""
    largest = 1.7976931348623157e308
    high = largest if posinf is None else posinf
    low = -largest if neginf is None else neginf
    finite = np.where(x != x, nan, np.where(x == math.inf, high, np.where(x == -math.inf, low, x)))
    if not copy:
        raise Untraceable("nan_to_num in place")
    return finite


@formula(np.isclose)
def _isclose(np: Facade, a: Any, b: Any, rtol: Any = 1e-05, atol: Any = 1e-08) -> Any:
    """Whether a is next to b."""
    near = np.logical_and(np.abs(a - b) <= atol + rtol * np.abs(b), np.isfinite(b + 0.0 * a))
    return np.logical_or(near, np.equal(a, b))


@formula(np.allclose)
def allclose(np: Facade, a: Any, b: Any, rtol: Any = 1e-05, atol: Any = 1e-08) -> Any:
    """Whether all of a are next to b."""
    return np.all(np.isclose(a, b, rtol, atol))


@formula(np.array_equal)
def array_equal(np: Facade, a: Any, b: Any) -> Any:
    """Whether all elements are equal."""
    return np.all(np.equal(a, b))


def conj(graph: Graph, values: Tracer) -> Tracer:
    """Return an array of real numbers as it is."""
    return values


ARRAY_METHODS.update(clip=_clip, round=np.round, conj=conj, conjugate=conj)
