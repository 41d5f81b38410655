"""Formulas over signals, and their margins: signal temporal logic with quantitative semantics.

    in_band:        rho(t) = min(upper - y(t), y(t) - lower) / scale
    ~a:             -rho_a                a & b:   min(rho_a, rho_b)
    a | b:          max(rho_a, rho_b)
    always(a):      min of rho_a over [t + start, t + end]
    eventually(a):  max of rho_a over the same

(Donzé, Maler: Robust satisfaction of temporal logic over real-valued signals, FORMATS 2010).
rho > 0 holds, rho < 0 fails.  Signals are connected by lines between samples, through a curve's
extreme where samples support one; with the breaks of a run known, by curves between them (see
`nlctl.analysis.metrics.curves`).  On these lines the margins are exact, sliding windows included.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import ClassVar, TypeVar

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, text
from nlctl.attributes import with_parameters_of
from nlctl.errors import ParameterError
from nlctl.names import unknown

from .piecewise import Trace, extremes, largest, pointwise_maximum, with_vertices

HOW = 'in_band("y", upper=1.0), always(...), eventually(...), parse_formula("always y <= 1")'


class Formula:
    """What ``&``, ``|`` and ``~`` are defined for."""

    def __and__(self, other: Formula) -> And:
        return And(parts=(self, of_type("'&'", "its right side", other, Formula, HOW)))

    def __or__(self, other: Formula) -> Formula:
        return ~(~self & ~of_type("'|'", "its right side", other, Formula, HOW))

    def __invert__(self) -> Formula:
        return Not(part=self)


@dataclass(frozen=True, kw_only=True)
class Band(Formula):
    """lower <= y <= upper, in multiples of `scale`; see `in_band`."""

    signal: str
    lower: float
    upper: float
    scale: float

    def __str__(self) -> str:
        if self.lower == -self.upper:
            return f"|{self.signal}| <= {self.upper:g}"
        if not np.isfinite(self.lower):
            return f"{self.signal} <= {self.upper:g}"
        if not np.isfinite(self.upper):
            return f"{self.signal} >= {self.lower:g}"
        return f"{self.lower:g} <= {self.signal} <= {self.upper:g}"


@dataclass(frozen=True, kw_only=True)
class Not(Formula):
    """The opposite."""

    part: Formula

    def __invert__(self) -> Formula:
        return self.part

    def __str__(self) -> str:
        if isinstance(self.part, And):
            return _listed([~part for part in self.part.parts], " or ")
        return f"not {self.part}"


@dataclass(frozen=True, kw_only=True)
class And(Formula):
    """All parts."""

    parts: tuple[Formula, ...]

    def __str__(self) -> str:
        return _listed(self.parts, " and ")


@dataclass(frozen=True, kw_only=True)
class Temporal(Formula):
    """A part at the times from t + start to t + end; how often, its kinds say."""

    word: ClassVar[str]
    part: Formula
    start: float
    end: float

    def __str__(self) -> str:
        when = f" from {self.start:g} s on" if self.start else ""
        if np.isfinite(self.end):
            when = f" in [{self.start:g}, {self.end:g}] s"
        return f"{self.word}{when} {self.part}"


class Eventually(Temporal):
    """Once between t + start and t + end."""

    word = "eventually"


class Always(Temporal):
    """All the time from t + start to t + end."""

    word = "always"


def _listed(parts: Sequence[Formula], word: str) -> str:
    """Return parts in brackets; "always" has its own where it might be read as of all of them."""
    apart = not all(map(looks_ahead, parts))
    texts = (f"({part})" if apart and begins_window(part) else str(part) for part in parts)
    return f"({word.join(texts)})"


def looks_ahead(formula: Formula) -> bool:
    """Whether a formula is of other times than the one at which it stands."""
    return any(isinstance(part, Temporal) for part in parts_of(formula))


def begins_window(formula: Formula) -> bool:
    """Whether the text of a formula begins with "always" or "eventually", or with "not" and one."""
    while isinstance(formula, Not) and not isinstance(formula.part, And):
        formula = formula.part
    return isinstance(formula, Temporal)


_T = TypeVar("_T", bound=Temporal)


@as_annotated
def in_band(
    signal: str, *, lower: float = -np.inf, upper: float = np.inf, scale: float | None = None
) -> Band:
    """Require lower <= signal <= upper.

    Parameters
    ----------
    signal : str
        Name of the signal.
    lower, upper : float, optional
        Bounds in the signal's unit; one may be left out.
    scale : float, optional
        The margin is counted in multiples of it, so that requirements with different units can be
        compared.  By default the larger magnitude of the finite bounds, or 1 where that is 0: of
        ``|e| <= 0.15`` a margin of 0.2 means that 20 % of the bound are left.

    Returns
    -------
    Band
        The formula; its margin is the distance to the nearer bound, divided by `scale`.

    Raises
    ------
    ParameterError
        If both bounds are infinite or they are in the wrong order, or the scale is not positive.

    Examples
    --------
    The margin counts in multiples of the bound:

    >>> from nlctl.analysis.robustness import Requirement, in_band, margin
    >>> band = Requirement(key="band", formula=in_band("e", lower=-0.2, upper=0.2), until=0.0)
    >>> margin(band, np.zeros(1), {"e": np.array([0.1])})
    0.5
    """
    text("a band", "signal", signal)
    for name, bound in (("lower", lower), ("upper", upper)):
        if not (isinstance(bound, float) and np.isinf(bound)):
            number(f"a band of '{signal}'", name, bound)
    finite = [abs(bound) for bound in (lower, upper) if np.isfinite(bound)]
    if not finite or not lower <= upper:
        raise ParameterError(
            f"a band of '{signal}' needs lower <= upper with one of them finite, "
            f"got [{lower}, {upper}]"
        )
    scale = (max(finite) or 1.0) if scale is None else scale
    number(f"a band of '{signal}'", "scale", scale, above=0)
    return Band(signal=signal, lower=float(lower), upper=float(upper), scale=float(scale))


@as_annotated
def always(part: Formula, start: float = 0.0, end: float = np.inf) -> Always:
    """Require `part` all the time from start to end, in s from where the formula stands.

    An infinite `end` is as far as the requirement looks, its `until`.

    Parameters
    ----------
    part : Formula
        What is required.
    start, end : float, optional
        Times from where the formula stands (s).

    Returns
    -------
    Always
        The formula; its margin is the least of `part` from start to end.

    Raises
    ------
    ParameterError
        If not 0 <= start <= end, or start is infinite.

    Examples
    --------
    The error stays within 0.1 from 1 s on:

    >>> from nlctl.analysis.robustness import Requirement, always, in_band, margin
    >>> small = always(in_band("e", lower=-0.1, upper=0.1), start=1.0)
    >>> tracks = Requirement(key="tracks", formula=small, until=5.0)
    >>> times = np.linspace(0.0, 5.0, 501)
    >>> round(margin(tracks, times, {"e": np.exp(-3 * times)}), 6)
    0.502129
    >>> print(round((0.1 - np.exp(-3)) / 0.1, 6))
    0.502129
    """
    return _temporal(Always, part, start, end)


@as_annotated
@with_parameters_of(always)
def eventually(part: Formula, start: float = 0.0, end: float = np.inf) -> Eventually:
    """Require `part` once between start and end; arguments and errors as in `always`.

    Returns
    -------
    Eventually
        The formula; its margin is the largest of `part` from start to end.

    Raises
    ------
    ParameterError
        If not 0 <= start <= end, or start is infinite.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Requirement, eventually, in_band, margin
    >>> rises = Requirement(key="rises", formula=eventually(in_band("y", lower=0.9)), until=5.0)
    >>> times = np.linspace(0.0, 5.0, 501)
    >>> margin(rises, times, {"y": np.minimum(times, 1.8)})  # (1.8 - 0.9) / 0.9
    1.0
    """
    return _temporal(Eventually, part, start, end)


def _temporal(kind: type[_T], part: Formula, start: float, end: float) -> _T:
    who = f"'{kind.word}'"
    of_type(who, "part", part, Formula, HOW)
    number(who, "start", start, at_least=0)
    if not (isinstance(end, float) and np.isinf(end)):
        number(who, "end", end)
    if not (0 <= start <= end and np.isfinite(start)):
        raise ParameterError(
            f"{who} needs 0 <= start <= end with a finite start, got [{start}, {end}] s"
        )
    return kind(part=part, start=float(start), end=float(end))


def parts_of(formula: Formula) -> Iterator[Formula]:
    """Yield a formula and all its parts."""
    yield formula
    inner = [formula.part] if isinstance(formula, Not | Temporal) else ()
    for part in formula.parts if isinstance(formula, And) else inner:
        yield from parts_of(part)


@cache
def signals_named(formula: Formula) -> tuple[str, ...]:
    """Return the names of the signals that a formula looks at, in alphabetical order."""
    return tuple(sorted({part.signal for part in parts_of(formula) if isinstance(part, Band)}))


@cache
def horizon(formula: Formula) -> float:
    """Return how far (s) a formula looks ahead at least."""
    if isinstance(formula, Temporal):
        far = formula.end if np.isfinite(formula.end) else formula.start
        return far + horizon(formula.part)
    inner = [horizon(part) for part in parts_of(formula) if part is not formula]
    return max(inner, default=0.0)


@dataclass(frozen=True)
class SampledSignals:
    """Samples by name, all finite."""

    t: np.ndarray  # (m,): increasing times (s)
    samples: Mapping[str, np.ndarray]  # arrays of shape (m,)
    until: float  # time (s) at which windows without an end stop, at most ``t[-1]``
    # (k,): increasing times (s) at which signals may jump or bend; None where that is not known
    breaks: np.ndarray | None = None

    @property
    def apart(self) -> float:
        """How long (s) before and after a break all signals jump, at once."""
        return 1e-12 * float(self.t[-1] - self.t[0])


def margin_trace(formula: Formula, signals: SampledSignals, low: float, high: float) -> Trace:
    """Return the margin of a formula as a function of time in [low, high]."""
    match formula:
        case Band():
            return _band(formula, signals, low, high)
        case Not():
            return -margin_trace(formula.part, signals, low, high)
        case And():
            return -pointwise_maximum(
                [-margin_trace(part, signals, low, high) for part in formula.parts]
            )
        case Always():
            opposite = Eventually(part=~formula.part, start=formula.start, end=formula.end)
            return -margin_trace(opposite, signals, low, high)
        case Eventually():
            start, end = formula.start, formula.end
            last = max(min(high + end, signals.until - horizon(formula.part)), low + start)
            band = getattr(formula.part, "part", None)
            if low == high and isinstance(formula.part, Not) and isinstance(band, Band):
                worst = _worst(band, signals, low + start, last)
                return Trace(np.array([low]), np.array([worst]))
            inner = margin_trace(formula.part, signals, low + start, last)
            return largest(inner, low, high, start, end)
    raise TypeError(f"no formula: {formula!r}")


_AROUND = 6  # samples on each side of a window that its curves go through


def _near(band: Band, signals: SampledSignals, low: float, high: float) -> tuple:
    """Return times, samples and breaks of the band's signal in [low, high] and a little around."""
    if band.signal not in signals.samples:
        raise unknown("signal", band.signal, signals.samples)
    t, breaks = signals.t, signals.breaks
    i, j = np.searchsorted(t, low, "right"), np.searchsorted(t, high, "left")
    near = slice(max(i - _AROUND, 0), j + _AROUND)
    t = t[near]
    if breaks is not None:
        breaks = breaks[(breaks >= t[0]) & (breaks <= t[-1])]
    return t, signals.samples[band.signal][near], breaks


def within_bounds(band: Band, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return how far values lie below the upper bound and above the lower one, in scales."""
    return (band.upper - y) / band.scale, (y - band.lower) / band.scale


def _beyond(band: Band, y: np.ndarray) -> list[np.ndarray]:
    """Return by how much values lie above the upper bound, and below the lower one."""
    sides = zip((band.upper, band.lower), within_bounds(band, y), strict=True)
    return [-within for bound, within in sides if np.isfinite(bound)]


def _band(band: Band, signals: SampledSignals, low: float, high: float) -> Trace:
    t, y, breaks = _near(band, signals, low, high)
    y = with_vertices(t, y, breaks, signals.apart).between(low, high)
    return -pointwise_maximum([Trace(y.t, beyond, y.jump) for beyond in _beyond(band, y.y)])


def _worst(band: Band, signals: SampledSignals, low: float, high: float) -> float:
    """Return the largest violation in [low, high]: an extreme value has it."""
    t, y, breaks = _near(band, signals, low, high)
    values = np.array(extremes(t, y, low, high, breaks, signals.apart))
    return float(np.max(_beyond(band, values)))
