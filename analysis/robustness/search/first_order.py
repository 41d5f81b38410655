"""What a requirement's margin may become near a row, by signals that move along their derivatives.

    y(t; z + d) = y(t; z) + D(t) d + ...          z, d in the unit cube of the space

A margin is made of least and largest values of signals.  Where it is to go down, a least value goes
down with any one of its arguments, a largest one with all of them.  So of every least value the
argument that is least now is taken, of every largest one all arguments: a linear program for d (the
convex-concave procedure, Yuille, Rangarajan, Neural Computation 15, 2003), repeated while it gains.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.optimize import linprog

from nlctl.annotations import as_annotated
from nlctl.arguments import of_type
from nlctl.attributes import described_record
from nlctl.errors import AuditError, DivergedError, UsageError
from nlctl.sensitivities import sensitivity_response

from ..runs.experiment import Prepared, loop_of_row
from ..stl.formula import Always, And, Band, Eventually, Formula, Not, within_bounds
from ..stl.spec import Requirement
from ..uncertainty.space import checked_row, ends

_REPEATS = 4  # linear programs at most
_GAIN = 1e-9  # a further one must lower the margin by so much
_NESTED = 60  # arguments of a largest value of windows that are followed
_TIMES = 400  # samples that are examined


@described_record
class FirstOrder:
    """Signals of a row, and their derivatives.

    Examples
    --------
    y = z(t) with z of three pieces; the largest is lowered by lowering all that are largest:

    >>> from nlctl.analysis.robustness import Requirement, eventually, in_band
    >>> from nlctl.analysis.robustness.search.first_order import FirstOrder, lowest_nearby
    >>> high = Requirement(key="high", formula=eventually(in_band("y", lower=1.0)), until=2.0)
    >>> made = FirstOrder(
    ...     t=np.arange(3.0), signals={"y": np.array([0.9, 0.8, 0.2])},
    ...     derivatives={"y": np.eye(3)}, requirements=(high,),
    ... )
    >>> place, margin = lowest_nearby(made, np.array([0.9, 0.8, 0.2]), 0.5)
    >>> print(place[:2].round(6), round(margin, 6))
    [0.4 0.3] -0.6
    """

    t: np.ndarray  # (m,): Times (s).
    signals: Mapping[str, np.ndarray]  # For each name samples of shape (m,).
    # For each name an array of shape (m, d), by the quantities of the space in units of their
    # boxes.
    derivatives: Mapping[str, np.ndarray]
    requirements: tuple[Requirement, ...]
    reason: str = ""  # Why there are none, or none up to the end; empty if there are.


# takes a row; for a loop ``functools.partial(first_order, prepared)``
FirstOrderOf = Callable[[Mapping[str, Any]], FirstOrder]


def lowest_nearby(of: FirstOrder, place: np.ndarray, radius: float) -> tuple[np.ndarray, float]:
    """Return where the first order makes the least margin lowest, and that margin."""
    # No coordinate moves further than `radius`, nor out of the unit cube; the margin is infinite
    # where there is no derivative.
    best, least = place, np.inf
    for requirement in of.requirements:
        lowered = _lowered(of, requirement, place, radius)
        if lowered is not None and lowered[1] < least:
            best, least = lowered
    return best, least


def _lowered(
    of: FirstOrder, requirement: Requirement, place: np.ndarray, radius: float
) -> tuple[np.ndarray, float] | None:
    """Repeat linear programs for one requirement while they gain."""
    names = requirement.signals
    if any(name not in of.derivatives for name in names):
        return None
    stride = -(-of.t.size // _TIMES)
    t = of.t[::stride]
    y = {name: of.signals[name][::stride] for name in names}
    slopes = np.array([of.derivatives[name][::stride] for name in names])
    if not np.isfinite(slopes).all() or not all(np.isfinite(v).all() for v in y.values()):
        return None
    bounds = [(max(-z, -radius), min(1.0 - z, radius)) for z in place]
    change, least = np.zeros(place.size), np.inf
    for _ in range(_REPEATS):
        moved = {name: y[name] + slopes[i] @ change for i, name in enumerate(names)}
        picked = _Picked(t=t, y=moved, names=names)
        atoms = picked.atoms(requirement.formula, 0, raising=False)
        further, margin = _program(atoms, slopes, change, bounds)
        if not margin < least - _GAIN * max(1.0, abs(least) if np.isfinite(least) else 1.0):
            break
        change, least = further, margin
    return place + change, least


@dataclass(frozen=True)
class _Atoms:
    """Numbers offset + factor y[signal](t[k])."""

    signal: np.ndarray
    k: np.ndarray
    factor: np.ndarray
    value: np.ndarray

    @property
    def opposite(self) -> "_Atoms":
        return replace(self, factor=-self.factor, value=-self.value)


def _program(
    atoms: _Atoms, slopes: np.ndarray, change: np.ndarray, bounds: list[tuple[float, float]]
) -> tuple[np.ndarray, float]:
    """Minimise the largest of the atoms over changes within bounds."""
    rows = atoms.factor[:, None] * slopes[atoms.signal, atoms.k]
    offsets = atoms.value - rows @ change
    scale = max(float(np.abs(rows).max(initial=0.0)), 1e-300)
    if scale == 1e-300:
        return change, float(atoms.value.max())
    matrix = np.column_stack([rows / scale, -np.ones(len(rows))])
    goal = np.append(np.zeros(change.size), 1.0)
    solution = linprog(
        goal, A_ub=matrix, b_ub=-offsets / scale, bounds=[*bounds, (None, None)], method="highs"
    )
    if solution.x is None:
        return change, np.inf
    minimizer = np.clip(solution.x[:-1], *np.transpose(bounds))
    return minimizer, float(np.max(offsets + rows @ minimizer))


@dataclass(frozen=True)
class _Picked:
    """Of a formula the numbers that count, by the values that signals have now."""

    t: np.ndarray
    y: Mapping[str, np.ndarray]
    names: tuple[str, ...]
    known: dict[int, np.ndarray] = field(default_factory=dict)

    def margins(self, formula: Formula) -> np.ndarray:
        """Return the margin at every time, of samples."""
        if id(formula) not in self.known:
            self.known[id(formula)] = self._margins(formula)
        return self.known[id(formula)]

    def _margins(self, formula: Any) -> np.ndarray:
        if isinstance(formula, Band):
            return np.minimum(*within_bounds(formula, self.y[formula.signal]))
        if isinstance(formula, Not):
            return -self.margins(formula.part)
        if isinstance(formula, And):
            return np.min([self.margins(part) for part in formula.parts], axis=0)
        inner, (first, last) = self.margins(formula.part), self._window(formula)
        take = np.min if isinstance(formula, Always) else np.max
        return np.array([take(inner[a:b]) for a, b in zip(first, last, strict=True)])

    def _window(self, formula: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return for every time the first sample of its window, and that behind its last."""
        slack = 1e-9 * self.t[-1]
        first = np.searchsorted(self.t, self.t + formula.start - slack)
        last = np.searchsorted(self.t, self.t + formula.end + slack, side="right")
        first = np.minimum(first, self.t.size - 1)
        return first, np.maximum(last, first + 1)

    def atoms(self, formula: Any, k: int, *, raising: bool) -> _Atoms:
        """Return numbers of which the largest is to go down, or the least is to go up."""
        if isinstance(formula, Band):
            return self._band(formula, np.array([k]), every=raising)
        if isinstance(formula, Not):
            return self.atoms(formula.part, k, raising=not raising).opposite
        if isinstance(formula, And):
            if raising:
                return _together([self.atoms(part, k, raising=True) for part in formula.parts])
            least = min(formula.parts, key=lambda part: self.margins(part)[k])
            return self.atoms(least, k, raising=False)
        first, last = self._window(formula)
        times = np.arange(first[k], last[k])
        inner = self.margins(formula.part)[times]
        if isinstance(formula, Eventually) == raising:  # one time decides
            best = np.argmax(inner) if raising else np.argmin(inner)
            return self.atoms(formula.part, int(times[best]), raising=raising)
        order = np.argsort(inner if raising else -inner)
        return self._all(formula.part, times[order], raising=raising)

    def _all(self, part: Formula, times: np.ndarray, *, raising: bool) -> _Atoms:
        """Return the numbers of a part at many times, the most important first."""
        if isinstance(part, Band):
            return self._band(part, times, every=raising)
        if isinstance(part, Not) and isinstance(part.part, Band):
            return self._band(part.part, times, every=not raising).opposite
        return _together([self.atoms(part, int(k), raising=raising) for k in times[:_NESTED]])

    def _band(self, band: Band, k: np.ndarray, *, every: bool) -> _Atoms:
        """Return the distances to the ends of a band: to both, or to the nearer one."""
        above, below = within_bounds(band, self.y[band.signal][k])
        nearer = above <= below
        sides = [(above, -1.0, np.isfinite(band.upper) & (nearer | every)),
                 (below, 1.0, np.isfinite(band.lower) & (~nearer | every))]  # fmt: skip
        signal = np.full(k.size, self.names.index(band.signal))
        return _together([
            _Atoms(signal[kept], k[kept], np.full(int(kept.sum()), sign / band.scale), value[kept])
            for value, sign, kept in sides
        ])  # fmt: skip


def _together(parts: list[_Atoms]) -> _Atoms:
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return _Atoms(*map(np.concatenate, columns))


@as_annotated
def first_order(prepared: Prepared, row: Mapping[str, Any]) -> FirstOrder:
    """Simulate a row with the derivatives of all outputs by all quantities of its space.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    row : mapping
        ``{name: value}``, a number or label for each name of the space.

    Returns
    -------
    FirstOrder
        What `worst_case` asks as ``derivatives=functools.partial(first_order, prepared)``.  Where
        there is no derivative its `reason` says why.

    Raises
    ------
    UnknownNameError, ParameterError
        If the row lacks a quantity, has another one, or a number is not finite.

    Examples
    --------
    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, always, first_order, in_band, prepare
    ... )
    >>> space = Space(quantities=(Uncertain(name="lag.T", bounds=(0.5, 1.5), nominal=1.0),))
    >>> low = Requirement(key="low", formula=always(in_band("v", upper=0.9)), until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"lag": nlctl.Lag()}),
    ...     spec=Spec(requirements=(low,)), timepts=np.linspace(0, 1, 101), inputs=1.0,
    ... )
    >>> made = first_order(prepare(experiment), {"lag.T": 1.0})
    >>> print(round(made.derivatives["v"][-1, 0], 6), round(-np.exp(-1), 6))  # -exp(-1/T)/T^2
    -0.367879 -0.367879
    """
    study = of_type("first_order", "prepared", prepared, Prepared, "prepare(experiment)").experiment
    row = checked_row(study.space, row)
    loop, given = loop_of_row(prepared, row)
    names = [quantity.name for quantity in study.space.quantities]
    try:
        run = sensitivity_response(
            loop, study.timepts, study.inputs, given["initial_state"] or None,
            with_respect_to=names, params=given["params"],
            rtol=study.rtol, atol=study.atol, max_steps=study.max_steps,
            method="auto" if study.method == "taylor" else study.method,  # one that can have them
        )  # fmt: skip
    except AuditError:
        raise
    except (UsageError, DivergedError) as error:
        return FirstOrder(
            t=np.empty(0), signals={}, derivatives={}, requirements=study.spec.requirements,
            reason=str(error),
        )  # fmt: skip
    low, high = ends(study.space).to_numpy()
    return FirstOrder(
        t=run.time,
        signals=dict(zip(run.signals, run.values, strict=True)),
        derivatives={
            signal: (run.derivatives[i] * (high - low)[:, None]).T
            for i, signal in enumerate(run.signals)
        },
        requirements=study.spec.requirements,
        reason=run.message or "",
    )
