"""Requirements: named formulas, and the margins that a response leaves.

A formula as the conjunction of many: what the least margin is the least of.

    rho of always(a & b) = min(rho of always(a), rho of always(b))
    rho of always over [s, e] = min of those over the pieces of [s, e]
    rho of lower <= y <= upper = min of those of both bounds

Each of many has fewer kinks than all of them together: which time and which bound decide changes
only within a piece.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from nlctl.annotations import as_annotated
from nlctl.arguments import number, of_type, text, tuple_of
from nlctl.attributes import described_record, with_parameters_of
from nlctl.errors import ParameterError
from nlctl.names import unknown
from nlctl.params import as_numbers
from nlctl.plotting.bands import Limit

from .formula import (
    HOW,
    Always,
    And,
    Band,
    Formula,
    SampledSignals,
    horizon,
    margin_trace,
    signals_named,
)
from .text import parse_formula


def limits_of_requirements(requirements: Sequence[Any]) -> dict[str, list[Limit]]:
    """Return what requirements always ask of each signal; what they ask else is not a line."""
    limits: dict[str, list[Limit]] = {}

    def walk(formula: Formula, start: float, end: float, until: float) -> None:
        if isinstance(formula, And):
            for part in formula.parts:
                walk(part, start, end, until)
        elif isinstance(formula, Always):
            walk(formula.part, start + formula.start, end + formula.end, until)
        elif isinstance(formula, Band) and end > start:
            for value in (formula.lower, formula.upper):
                line = (value, start, min(end, until))
                if np.isfinite(value) and line not in limits.setdefault(formula.signal, []):
                    limits[formula.signal].append(line)

    for requirement in requirements:
        walk(requirement.formula, 0.0, 0.0, requirement.until)
    return limits


def _rows(formula: Formula, until: float, pieces: int) -> Iterator[tuple[Formula, ...]]:
    """Yield formulas whose margins have that of `formula` as the least, at the start."""
    # Windows are cut into `pieces`, up to the time (s) `until` where they have no end; those of the
    # same window follow each other in a row of their own. What is not a conjunction is alone.
    match formula:
        case And():
            for part in formula.parts:
                yield from _rows(part, until, pieces)
        case Band() if np.isfinite([formula.lower, formula.upper]).all():
            yield (replace(formula, lower=-np.inf),)
            yield (replace(formula, upper=np.inf),)
        case Always():
            last = min(formula.end, until - horizon(formula.part))
            cuts = np.linspace(formula.start, last, pieces + 1).tolist()
            windows = list(pairwise(cuts))
            for row in _rows(formula.part, until, 1):
                for part in row:
                    yield tuple(replace(formula, part=part, start=a, end=b) for a, b in windows)
        case _:
            yield (formula,)


# no margin of a run that reached its end is below -FAILED, and none of another run above it
FAILED = 1e6
_PIECES = 16  # of a window, where a requirement is taken apart


@as_annotated
@described_record(made_by="margin")
class Requirement:
    """A named formula that has to hold at the start of a response.

    It is also a metric of `nlctl.ensemble_response`.
    """

    key: str  # Short name for tables and files.
    # See `formula.in_band`, `formula.always`, `formula.eventually` and ``&``, ``|``, ``~``.
    formula: Formula
    # Time (s) that a run has to reach and that windows without an end stop at. A run that ends
    # before has failed.
    until: float
    meaning: str = ""  # In words, for the report.

    start = -np.inf
    end = np.inf
    unit = "1"

    def __post_init__(self) -> None:
        text("a requirement", "key", self.key)
        of_type(f"requirement '{self.key}'", "formula", self.formula, Formula, HOW)
        number(f"requirement '{self.key}'", "until", self.until)
        need = horizon(self.formula)
        if not need <= self.until < np.inf:
            raise ParameterError(
                f"requirement '{self.key}' needs a finite end of the response of at least "
                f"{need:g} s, as far as it looks ahead ({self.formula}), got {self.until:g} s"
            )

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that it looks at."""
        return signals_named(self.formula)

    @property
    def parts(self) -> "tuple[tuple[Requirement, ...], ...]":
        """Requirements whose least margin is that of this one: a row for each bound of a window.

        In a row are pieces of the window: which time decides changes less often in a piece, so
        that margins of parts have fewer kinks.
        """
        rows = _rows(self.formula, self.until, _PIECES)
        return tuple(
            tuple(Requirement(key=f"{self.key}, {part}", formula=part, until=self.until)
                  for part in row)
            for row in rows
        )  # fmt: skip

    def function(
        self, t: np.ndarray, *samples: np.ndarray, breaks: ArrayLike | None = None
    ) -> float:
        """Return the margin, with the samples in the order of `signals`.

        Parameters
        ----------
        t : ndarray of shape (m,)
            Times (s).
        *samples : ndarray of shape (m,)
            Samples of each signal.
        breaks : array_like of shape (k,), optional
            As in `margin`.

        Returns
        -------
        float
            Positive where the requirement holds.
        """
        return margin(self, t, dict(zip(self.signals, samples, strict=True)), breaks=breaks)


@as_annotated
@described_record(made_by="margins")
class Spec:
    """Requirements that all have to hold.

    Raises
    ------
    ParameterError
        If there is none, or two have the same key.
    """

    requirements: tuple[Requirement, ...]

    def __post_init__(self) -> None:
        tuple_of("a spec", "requirements", self.requirements, Requirement)
        keys = [requirement.key for requirement in self.requirements]
        if not keys or len(set(keys)) < len(keys) or "spec" in keys:
            raise ParameterError(
                "a spec needs at least one requirement, each with its own key other than 'spec', "
                f"got {keys}"
            )

    @property
    def limits(self) -> dict[str, list[Limit]]:
        """By signal what is always required: values, and from when to when (s); for figures."""
        return limits_of_requirements(self.requirements)


def requirements_of(texts: Sequence[tuple[str, str]], until: float) -> list[Requirement]:
    """Return requirements R1, R2, ... from texts as study files have them, and what they mean."""
    return [
        Requirement(key=f"R{k}", formula=parse_formula(text), meaning=meaning, until=until)
        for k, (text, meaning) in enumerate(texts, start=1)
    ]


def violates(margins: ArrayLike) -> np.ndarray:
    """Return for each margin whether it is a violation: it is none if it is > 0; NaN is one."""
    return ~(np.asarray(margins, dtype=float) > 0)


@as_annotated
def unfinished_margin(time: float, until: float) -> float:
    """Return the margin of a run that ended at `time` (s) before the end `until` (s).

        -FAILED (2 - time / until), time confined to [0, until]

    It lies in [-2 FAILED, -FAILED], the lower the earlier the run ended, and below that of every
    run that reached its end; a time that is NaN counts as 0.

    Parameters
    ----------
    time : float
        When the run ended (s), or NaN.
    until : float
        When it should have (s).

    Returns
    -------
    float
        Dimensionless, negative.

    Examples
    --------
    The earlier a run ended, the lower it counts, here as -1e6 (2 - 1/4) and -1e6 (2 - 3/4):

    >>> from nlctl.analysis.robustness import unfinished_margin
    >>> unfinished_margin(5.0, 20.0), unfinished_margin(15.0, 20.0)
    (-1750000.0, -1250000.0)
    """
    reached = np.clip(np.nan_to_num(time / until), 0.0, 1.0) if until > 0 else 0.0
    return float(-FAILED * (2 - reached))


@as_annotated
def margin(
    requirement: Requirement,
    t: np.ndarray,
    signals: Mapping[str, np.ndarray],
    *,
    breaks: ArrayLike | None = None,
) -> float:
    """Return by how much a response meets a requirement; > 0 holds.

    Dimensionless, see `formula.in_band`.  A response that ends before ``requirement.until``, or
    has a sample that is not finite before in a signal that counts, gets `unfinished_margin` of the
    last time that was good.

    Parameters
    ----------
    requirement : Requirement
        What is asked of the response.
    t : ndarray of shape (m,)
        Increasing times (s).
    signals : mapping
        Samples of shape (m,) by name.
    breaks : array_like of shape (k,), optional
        Increasing times (s) at which signals may jump or bend, such as those of the events of a
        run.  Between them signals are smooth curves, and their limits there count; by default,
        samples alone say where a signal is smooth.

    Returns
    -------
    float
        Dimensionless.

    Raises
    ------
    ParameterError
        If the response starts after t = 0, or breaks are not increasing numbers.
    UnknownNameError
        If a signal is missing.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Requirement, always, in_band, margin
    >>> low = Requirement(key="low", formula=always(in_band("u", upper=10.0)), until=1.0)
    >>> times = np.linspace(0.0, 1.0, 11)
    >>> margin(low, times, {"u": 12.0 * times})  # 2 beyond the bound of 10
    -0.2
    """
    until = requirement.until
    of_type("a margin", "signals", signals, Mapping, "{name: samples}")
    for name in requirement.signals:
        if name not in signals:
            raise unknown("signal", name, signals, f"in requirement '{requirement.key}'")
    rows = _samples(requirement, t, signals)
    good = np.all(np.isfinite(rows), axis=0)
    t, *samples = rows if good.all() else rows[:, : np.argmin(good)]
    if t.size and t[0] > 0:
        raise ParameterError(
            f"requirement '{requirement.key}' counts time from 0, the response starts at {t[0]:g} s"
        )
    if t.size == 0 or t[-1] < until * (1 - 1e-12):
        return unfinished_margin(t[-1] if t.size else 0.0, until)
    named = dict(zip(requirement.signals, samples, strict=True))
    finite = SampledSignals(t, named, until, checked_breaks(breaks))
    with np.errstate(over="ignore", invalid="ignore"):  # samples near the largest number
        value = margin_trace(requirement.formula, finite, 0.0, 0.0).y[0]
    return float(np.fmax(value, -FAILED))  # NaN becomes -FAILED


def checked_breaks(breaks: ArrayLike | None) -> np.ndarray | None:
    """Return times of breaks as an array, None where none are known."""
    if breaks is None:
        return None
    times = as_numbers(breaks)
    if times is None or times.ndim != 1 or not np.all(np.isfinite(times)):
        raise ParameterError(f"breaks need finite times (s) in one row, got {breaks!r}")
    if np.any(np.diff(times) < 0):
        raise ParameterError(f"breaks need increasing times (s), got {breaks!r}")
    return np.unique(times)


def _samples(requirement: Requirement, t: object, signals: Mapping[str, Any]) -> np.ndarray:
    """Return the times and the signals that count as rows of one array."""
    given = {"t": t} | {f"signal '{name}'": signals[name] for name in requirement.signals}
    rows = {name: as_numbers(values) for name, values in given.items()}
    times = rows["t"]
    size = (0,) if times is None else times.shape
    for name, row in rows.items():
        if row is None or row.shape != size or row.ndim != 1:
            what = "no numbers" if row is None else f"shape {row.shape}"
            raise ParameterError(
                f"requirement '{requirement.key}' needs numbers of shape {size} for {name}, as "
                f"many as there are times, got {what}"
            )
    good = times[np.isfinite(times)] if times is not None else np.empty(0)
    if np.any(np.diff(good) <= 0):
        raise ParameterError(f"requirement '{requirement.key}' needs increasing times")
    return np.array([*rows.values()], dtype=float)


@as_annotated
@with_parameters_of(margin)
def margins(
    spec: Spec, t: np.ndarray, signals: Mapping[str, np.ndarray], *, breaks: ArrayLike | None = None
) -> dict[str, float]:
    """Return the margin of every requirement by key, and the least of them as ``"spec"``.

    Arguments and errors as in `margin`.

    Parameters
    ----------
    spec : Spec
        The requirements.

    Returns
    -------
    dict of str to float
        Dimensionless.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Requirement, Spec, in_band, margins
    >>> low = Requirement(key="low", formula=in_band("u", upper=10.0), until=0.0)
    >>> high = Requirement(key="high", formula=in_band("u", lower=-10.0), until=0.0)
    >>> margins(Spec(requirements=(low, high)), np.zeros(1), {"u": np.array([5.0])})
    {'low': 0.5, 'high': 1.5, 'spec': 0.5}
    """
    values = {r.key: margin(r, t, signals, breaks=breaks) for r in spec.requirements}
    return values | {"spec": float(min(values.values()))}


@dataclass(frozen=True, kw_only=True)
class ViolationTime:
    """The time to the violation of a requirement, as a metric of a run that reached its end."""

    requirement: Requirement

    start = -np.inf
    end = np.inf
    unit = "s"

    @property
    def key(self) -> str:
        """Name of its column."""
        return f"{self.requirement.key} violated at"

    @property
    def meaning(self) -> str:
        """In words, for the report."""
        return f"time at which '{self.requirement.key}' is violated, inf where it is not"

    @property
    def signals(self) -> tuple[str, ...]:
        """Names of the signals that it looks at."""
        return self.requirement.signals

    def function(
        self, t: np.ndarray, *samples: np.ndarray, breaks: ArrayLike | None = None
    ) -> float:
        """Return the time, with the samples in the order of `signals`."""
        named = dict(zip(self.signals, samples, strict=True))
        return violation_time(self.requirement, t, named, breaks=breaks)


def violation_time(
    requirement: Requirement,
    t: np.ndarray,
    signals: Mapping[str, np.ndarray],
    *,
    breaks: ArrayLike | None = None,
) -> float:
    """Return the first time in s at which a response violates a requirement; inf if it does not."""
    # Of ``always`` it is the first time at which what should hold does not, with the signals linear
    # between their samples; of what is asked once, ``eventually``, the time ``until`` which the
    # requirement looks. A response that ended before is violated at its last good time, if it was
    # not earlier.
    # Shapes: `t` (m,), `breaks` (k,).
    rows = np.array([t, *(signals[name] for name in requirement.signals)], dtype=float)
    good = np.all(np.isfinite(rows), axis=0)
    count = rows.shape[1] if good.all() else int(np.argmin(good))
    if count < 2:
        return 0.0
    t, *samples = rows[:, :count]
    sampled = dict(zip(requirement.signals, samples, strict=True))
    until = min(requirement.until, float(t[-1]))
    is_short = until < requirement.until * (1 - 1e-12)
    first = _first(requirement.formula, SampledSignals(t, sampled, until, checked_breaks(breaks)))
    if not is_short and margin(requirement, t, sampled, breaks=breaks) > 0:
        return np.inf
    return min(first, until)


def _first(formula: Formula, signals: SampledSignals) -> float:
    """Return when something that should always hold does not, inf where nothing says so."""
    if isinstance(formula, And):
        return min(_first(part, signals) for part in formula.parts)
    if not isinstance(formula, Always):
        return np.inf
    last = min(formula.end, signals.until - horizon(formula.part))
    if last < formula.start:
        return np.inf
    inner = margin_trace(formula.part, signals, formula.start, last)
    bad = np.flatnonzero(~(inner.y > 0))
    if not bad.size:
        return np.inf
    i = int(bad[0])
    if i == 0:
        return float(inner.t[0])
    before, after = inner.y[i - 1], inner.y[i]
    return float(inner.t[i - 1] + (inner.t[i] - inner.t[i - 1]) * before / (before - after))
