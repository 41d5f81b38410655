"""Gains by search: margins of requirements raised, or a cost lowered, with derivatives of runs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Protocol

import control as ct
import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import qmc

from ..annotations import as_annotated
from ..arguments import number, one_of, tolerances
from ..diagrams import state_names
from ..errors import ParameterError
from ..names import find_name, in_one_spelling
from ..native import Compiled
from ..native import compile as compile_diagram
from ..native.diagram.checks import sized
from ..native.ensemble import MetricLike
from ..native.floats import float_parameters, with_floats
from ..params import as_numbers, checked_times, integer
from ..responses.arguments import HOLDS, checked_params, state_array, with_aliases
from ..wording import counted
from .climbing import lower_cost, raise_least_margin
from .names import checked_names, declared_bounds
from .tuned import Tuned
from .worth import LOST_MARGIN, Runs, TuningProblem, Worth, checked_samples

_SAMPLES = 4001  # of a run for which nobody asks when
_FINER = 4  # times as many samples: whether margins are those of the run, or of where it is seen
_SAME = 1e-3  # of a margin, or of a cost
_ROUNDING = 1e-12  # of the last time
_BETWEEN = 1e-2  # of a margin: how much lower it may be between samples


class QuantityLike(Protocol):
    """What is asked of a quantity, such as `nlctl.analysis.robustness.Uncertain`."""

    @property
    def name(self) -> str: ...

    @property
    def box(self) -> tuple[float, float]: ...

    @property
    def nominal(self) -> float | None: ...


class SpaceLike(Protocol):
    """What is asked of a space, such as `nlctl.analysis.robustness.Space`."""

    @property
    def quantities(self) -> Sequence[QuantityLike]: ...


class RequirementsLike(Protocol):
    """What is asked of a spec, such as `nlctl.analysis.robustness.Spec`."""

    @property
    def requirements(self) -> Sequence[MetricLike]: ...


@as_annotated
def tune(
    diagram: Any,
    space: Mapping[str, Any] | SpaceLike,
    spec: RequirementsLike | Sequence[MetricLike] | MetricLike,
    budget: float = 200,
    timepts: ArrayLike | None = None,
    inputs: object = 0.0,
    initial_state: Mapping[str, float] | Any = None,
    *,
    cost: MetricLike | None = None,
    samples: Mapping[str, Any] | None = None,
    hold: str = "foh",
    params: Mapping[str, Any] | None = None,
    starts: int = 3,
    seed: int = 0,
    rtol: float = 1e-6,
    atol: float = 1e-8,
    max_steps: int = 100_000,
    **aliases: object,
) -> Tuned:
    """Find gains with which a loop meets its requirements by the largest margin.

    The least of all margins is raised as far as it goes, by SciPy's linear programs in a reach that
    adapts; with a `cost`, that is lowered as far as every margin stays positive, by SLSQP.  Both
    take the derivatives of runs.  The first search starts from the gains as they are, the others
    from the best of a few of Sobol's points.  Where a run has no derivative, differences of runs
    take its place, and a note says so.  What is found is the best of what was tried, on these
    samples: the study kind `tuning` says how it does on fresh ones.

    Parameters
    ----------
    diagram : control.NonlinearIOSystem or Compiled
        A diagram, or what `nlctl.compile` made of it.
    space : mapping or Space
        ``{"law.beta": (low, high)}``, or ``(start, low, high)``: the gains and where they are
        searched; or quantities with their boxes, whose nominal values are the start.  Gains whose
        bounds are positive and lie ten times apart are searched by their logarithms.
    spec : Spec, Requirement or sequence of these
        What is asked, each a number of a run of which larger is better and > 0 holds.
    budget : float, optional
        Runs after which the search ends; one with k derivatives counts as 1 + 0.7 k, which is
        about what it takes (``benchmarks/tune.py``).  To put back what buys nothing, and to
        say what each gain has bought, takes 2 k + 2 runs of each sample or some more.
    timepts : array_like of shape (m,), optional
        Times in s at which signals are sampled; by default 4001 from 0 to the end that
        requirements look at.  Peaks that lie between samples are not seen, so that few samples
        make hills and valleys that the loop does not have; one run at the end, with four times as
        many, says whether there are enough.
    inputs : array_like, list or float, optional
        Inputs over `timepts`.
    initial_state : mapping, array_like or float, optional
        As in `nlctl.input_output_response`.
    cost : Metric, optional
        A number of a run of which smaller is better, such as `nlctl.analysis.metrics.Metric`.
    samples : mapping, optional
        ``{"plant.m": array of shape (n,)}``, also ``"plant.x1(0)"``: each choice of gains is run
        with all n of these.
    hold : {"foh", "zoh"}, optional
        What inputs are between `timepts`, as in `nlctl.input_output_response`.
    params : mapping, optional
        Parameters that are overridden and not tuned.
    starts : int, optional
        How many searches are begun, at most.
    seed : int, optional
        Of Sobol's points.
    rtol, atol : float, optional
        Tolerances of the runs.
    max_steps : int, optional
        Attempted steps after which a run counts as one that does not reach its end.
    **aliases : object
        python-control's short names of times, inputs and initial states: ``T``, ``U``, ``X0``.

    Returns
    -------
    Tuned
        Gains, margins before and after, what each gain has bought, and all that was tried; after
        Ctrl-C as far as it came.

    Raises
    ------
    ParameterError
        If nothing is tuned or asked, bounds are no interval, the start does not lie within them, a
        block does not take them, or samples are not finite numbers of one length.
    UnknownNameError
        If there is no such parameter, state or signal.
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled.
    KeyboardInterrupt
        If Ctrl-C comes before the first run.

    Examples
    --------
    x' = -a x from x = 1 is at exp(-a) at t = 1, where |x| <= 0.5 is asked; the margin is the
    largest with the largest a, 1 - exp(-2) / 0.5:

    >>> from nlctl.analysis.robustness import Requirement, always, in_band
    >>> plant = ct.nlsys(
    ...     lambda t, x, u, params: [-params["a"] * x[0]], lambda t, x, u, params: x, inputs=0,
    ...     outputs=["x"], states=["x"], params={"a": 1.0}, name="plant",
    ... )
    >>> small = always(in_band("x", lower=-0.5, upper=0.5), start=1.0)
    >>> found = nlctl.tune(
    ...     plant, {"plant.a": (0.5, 2.0)}, Requirement(key="small", formula=small, until=1.0),
    ...     initial_state={"plant.x": 1.0},
    ... )
    >>> print(found["plant.a"], round(found.margin, 4), round(1 - np.exp(-2) / 0.5, 4))
    2.0 0.7293 0.7293
    """
    named = {"timepts": timepts, "inputs": inputs, "initial_state": initial_state}
    named = with_aliases(named, aliases, tune, needed=())
    problem, start = _problem(
        diagram, (space, spec, cost, samples), (*named.values(), checked_params(params)),
        {"rtol": rtol, "atol": atol, "max_steps": max_steps, "hold": hold},
    )  # fmt: skip
    number("tune", "budget", budget, above=0)
    starts = integer("tune", "starts", starts, at_least=1)
    runs = Runs(problem)
    message = _searched(runs, problem.cube(start), float(budget), starts, seed)
    return _tuned(runs, start, message)


class _SpentError(Exception):
    """No run is left."""


def _searched(runs: Runs, start: np.ndarray, budget: float, starts: int, seed: int) -> str:
    """Search from one start after the other; return how that ended."""
    points = qmc.Sobol(start.size, rng=np.random.default_rng(seed))
    some = 1 << int(np.ceil(np.log2(2 * start.size + 2)))  # a power of 2 keeps them even
    try:
        _climb(runs, start, budget)
        for _ in range(starts - 1):
            if runs.counted + some * len(runs.problem.samples) >= budget:
                return "the budget is spent"
            drawn = points.random(some)
            worths = runs.at(drawn, "Sobol'")
            _climb(runs, max(zip(drawn, worths, strict=True), key=lambda p: p[1].rank)[0], budget)
    except _SpentError:
        return "the budget is spent"
    except KeyboardInterrupt:
        if not runs.history:
            raise
        return "interrupted"
    return f"{starts} searches have ended" if starts > 1 else "the search has ended"


def _climb(runs: Runs, start: np.ndarray, budget: float) -> None:
    """Search from one start as long as there are runs."""
    cost = runs.problem.cost

    def worth_of(cube: np.ndarray) -> Worth:
        if runs.counted >= budget:
            raise _SpentError
        return runs.with_slopes(cube, "search")

    if cost is None:
        raise_least_margin(worth_of, start)
    else:
        lower_cost(worth_of, start)


def _tuned(runs: Runs, first: np.ndarray, message: str) -> Tuned:
    """Return what was found, with what each gain has bought."""
    problem, k, start = runs.problem, first.size, runs.problem.cube(first)
    best, without = _plainest(runs, start)
    single = [np.where(np.arange(k) == j, best, start) for j in range(k)]
    before, after, *alone = runs.at(np.array([start, best, *single]))
    return Tuned(
        names=problem.names, low=problem.low, high=problem.high, start=first,
        values=np.where(best == start, first, problem.values(best)),
        before=_by_key(problem, before), after=_by_key(problem, after),
        alone=np.array([worth.goal for worth in alone]),
        put_back=np.array([worth.goal for worth in without]),
        cost=problem.cost.key if problem.cost else "", history=_history(runs),
        plain_runs=runs.plain, differentiated_runs=runs.differentiated,
        counted_runs=runs.counted, message=message,
        notes=(*notes(runs, before, best), *_between(problem, best, after)),
    )  # fmt: skip


def _between(problem: TuningProblem, best: np.ndarray, seen: Worth) -> Iterator[str]:
    """Yield which requirements have a lower margin between the samples."""
    if ct.isdtime(problem.diagram.system, strict=True) or not problem.margins:
        return
    denser = problem.with_samples(_FINER)
    lower = _by_key(problem, Runs(denser).at(best[None, :])[0])
    rows = [(m.key, _by_key(problem, seen)[m.key], lower[m.key]) for m in problem.margins]
    for key, margin, below in rows:
        if below < margin - _BETWEEN * (1.0 + abs(margin)):
            samples = counted(denser.times.size, "sample")
            yield (
                f"the margin of '{key}' is {below:.4g} with {samples}, not {margin:.4g}: give "
                f"more timepts than {problem.times.size}"
            )


def _plainest(runs: Runs, start: np.ndarray) -> tuple[np.ndarray, list[Worth]]:
    """Return the best gains, those put back that buy nothing, and what each is worth put back."""
    best, worth = runs.best()
    while True:
        others = np.where(np.eye(start.size, dtype=bool), start, best)
        without = runs.at(others, "put back")
        moved = np.flatnonzero(best != start)
        same = [j for j in moved if without[j].is_as_good_as(worth, _SAME)]
        if not same:
            return best, without
        j = max(same, key=lambda j: without[j].rank)
        best, worth = others[j], max(worth, without[j], key=lambda candidate: candidate.rank)


def _by_key(problem: TuningProblem, worth: Worth) -> dict[str, float]:
    """Return the least margins over the samples, and the mean cost."""
    margins = {m.key: float(worth.table[:, j].min()) for j, m in enumerate(problem.margins)}
    return margins if problem.cost is None else margins | {problem.cost.key: worth.cost}


def _history(runs: Runs) -> Any:
    """Return all that was tried as a table."""
    import pandas as pd

    rows = [
        {"by": by, "runs": count, "margin": worth.least, "cost": worth.cost}
        | dict(zip(runs.problem.names, runs.problem.values(cube), strict=True))
        for by, count, cube, worth in runs.history
    ]
    return pd.DataFrame(rows)


def _problem(
    diagram: ct.NonlinearIOSystem | Compiled,
    what: tuple[Any, ...],
    given: tuple[Any, ...],
    how: dict[str, Any],
) -> tuple[TuningProblem, np.ndarray]:
    """Return what is asked of runs, and the gains to start from."""
    (space, spec, cost, samples), (timepts, inputs, initial_state, params) = what, given
    tolerances("tune", how["rtol"], how["atol"])
    one_of("tune", "hold", how["hold"], HOLDS)
    if not isinstance(diagram, Compiled):
        diagram = compile_diagram(sized(diagram, timepts, inputs, initial_state), params=params)
    diagram = with_floats(diagram, checked_names("space", [name for name, _ in _bounds(space)]))
    margins = _margins(spec, cost)
    params, states = dict(params or {}), state_array(diagram.system, initial_state)
    initial_state = dict(zip(state_names(diagram.system), states, strict=True))
    present = _present_values(diagram, params, initial_state)
    rows = [_row(diagram, name, value, present) for name, value in _bounds(space)]
    start, low, high = np.array([row[1:] for row in rows], dtype=float).T
    problem = TuningProblem(
        diagram=diagram, times=_times(timepts, margins), inputs=inputs, params=params,
        initial_state=initial_state, names=tuple(row[0] for row in rows), low=low, high=high,
        samples=checked_samples(samples or {}, [row[0] for row in rows]), margins=margins,
        cost=cost, how=how,
    )  # fmt: skip
    return problem, start


def _margins(spec: Any, cost: Any) -> tuple[MetricLike, ...]:
    """Return the requirements of a spec, of several, or of one."""
    if isinstance(spec, str):
        raise ParameterError(
            f"tune needs requirements, got the text {spec!r}: from nlctl.analysis.robustness, "
            f'Requirement(key="R1", formula=parse_formula({spec!r}), until=10.0)'
        )
    metrics = getattr(spec, "requirements", spec)
    metrics = tuple(metrics) if isinstance(metrics, Iterable) else (metrics,)
    for metric in metrics if cost is None else (*metrics, cost):
        if not (hasattr(metric, "signals") and hasattr(metric, "function")):
            raise ParameterError(
                "tune needs requirements such as nlctl.analysis.robustness.Requirement and a cost "
                f"such as nlctl.analysis.metrics.Metric, got {metric!r}"
            )
    if not metrics and cost is None:
        raise ParameterError("tune needs at least one requirement or a cost, got neither")
    keys = [metric.key for metric in metrics]
    twice = next((key for key in keys if keys.count(key) > 1), None)
    if twice is not None:
        raise ParameterError(f"two requirements have the key '{twice}': give each one of its own")
    return metrics


def _times(timepts: object, margins: Sequence[Any]) -> np.ndarray:
    """Return when signals are sampled."""
    if timepts is not None:
        times = checked_times(timepts)
        for metric in margins:
            until = getattr(metric, "until", np.nan)
            if until > times[-1] + _ROUNDING * abs(times[-1]):
                raise ParameterError(
                    f"requirement '{metric.key}' looks at signals until {until:g} s, and timepts "
                    f"end at {times[-1]:g} s"
                )
        return times
    ends = [getattr(metric, "until", np.nan) for metric in margins]
    if not ends or not np.isfinite(ends).all() or not max(ends) > 0:
        raise ParameterError("tune needs timepts: what is asked does not say when a run ends")
    return np.linspace(0.0, max(ends), _SAMPLES)


def _bounds(space: Any) -> list[tuple[str, Any]]:
    """Return gains with (low, high) or (start, low, high)."""
    if isinstance(space, Mapping):
        rows = list(space.items())
    elif hasattr(space, "quantities"):
        if getattr(space, "choices", ()):
            raise ParameterError("tune searches numbers: leave choices out of its space")
        rows = [
            (q.name, q.box if q.nominal is None else (q.nominal, *q.box)) for q in space.quantities
        ]
    else:
        raise ParameterError(
            f"tune needs gains with their bounds, {{'law.k': (0.1, 10.0)}}, got {space!r}"
        )
    if not rows:
        raise ParameterError("tune needs at least one gain, {'law.k': (0.1, 10.0)}")
    return rows


def _present_values(diagram: Compiled, params: Any, initial_state: object) -> dict[str, float]:
    """Return what parameters and initial states are before anything is tuned."""
    p = diagram.parameter_vector(params)
    present = {name: float(p[place]) for name, (place, _) in float_parameters(diagram).items()}
    x0 = state_array(diagram.system, initial_state)
    return present | {f"{n}(0)": float(x0[i]) for i, n in enumerate(state_names(diagram.system))}


def _row(
    diagram: Compiled, name: str, value: object, present: Mapping[str, float]
) -> tuple[str, float, float, float]:
    """Return the full name of a gain, where its search starts, and its bounds."""
    full = find_name("parameter", in_one_spelling(name), present)
    row = as_numbers(value)
    if row is None or row.shape not in ((2,), (3,)):
        raise ParameterError(f"'{name}' needs (low, high) or (start, low, high), got {value!r}")
    start, low, high = row if row.size == 3 else (present[full], *row)
    if not (np.isfinite([low, high]).all() and low < high):
        raise ParameterError(f"'{name}' needs finite bounds low < high, got {low:g}, {high:g}")
    if not low <= start <= high:
        raise ParameterError(
            f"'{name}' needs a start within its bounds, got {start:g} in [{low:g}, {high:g}]: "
            "give (start, low, high)"
        )
    owner = float_parameters(diagram).get(full, (0, None))[1]
    lowest, highest = declared_bounds(owner, full) if owner is not None else (-np.inf, np.inf)
    if low < lowest or high > highest:
        raise ParameterError(
            f"'{name}' needs bounds in [{lowest:g}, {highest:g}], as its block declares, got "
            f"{low:g}, {high:g}"
        )
    return full, float(start), float(low), float(high)


_AT_BOUND = 1e-6  # of the box


def notes(runs: Runs, before: Worth, best: np.ndarray) -> tuple[str, ...]:
    """Return all of them."""
    parts = (_start(runs, before), _flat(runs), _idle(runs), _at_bounds(runs, best))
    return (*(note for part in parts for note in part), *_without_derivatives(runs))


def _start(runs: Runs, before: Worth) -> Iterator[str]:
    """Yield what is to be said of the gains to start from."""
    if np.any(before.margins <= LOST_MARGIN) or (before.has_cost and not np.isfinite(before.cost)):
        yield "with the gains to start from a run does not reach its end: other starts were taken"
    for key, names in runs.at_first.items():
        yield (
            f"the start is at a kink of '{key}' by {', '.join(names)}: its derivatives to both "
            "sides differ there"
        )
    if runs.best()[1].rank <= before.rank:
        yield "nothing better than the start was found"


def _flat(runs: Runs) -> Iterator[str]:
    """Yield which requirements none of the gains moves."""
    if _all_lost(runs):
        yield "no run that was tried reaches its end: nothing is known of what is asked"
        return
    tables = np.stack([worth.table for _, _, _, worth in runs.history])
    for j, metric in enumerate(runs.problem.metrics):
        values = tables[:, :, j]
        if runs.slope_of[j] == 0.0 and np.all(np.ptp(values, axis=0) == 0.0):
            yield (
                f"'{metric.key}' is flat: it was {values.min():.4g} at all "
                f"{counted(len(values), 'choice')} of gains, and had no slope"
            )


def _idle(runs: Runs) -> Iterator[str]:
    """Yield which parameters nothing depends on."""
    names = [n for n, most in zip(runs.problem.names, runs.moved, strict=True) if most == 0.0]
    if names and not _all_lost(runs):
        are = "are" if len(names) > 1 else "is"
        yield f"nothing that is asked depends on {', '.join(names)}, which {are} left at the start"


def _all_lost(runs: Runs) -> bool:
    """Return whether no run that was tried reaches its end."""
    worths = [worth for _, _, _, worth in runs.history]
    return all(
        np.all(w.margins <= LOST_MARGIN) and not (w.has_cost and np.isfinite(w.cost))
        for w in worths
    )


def _at_bounds(runs: Runs, cube: np.ndarray) -> Iterator[str]:
    """Yield which gains end at a bound."""
    problem = runs.problem
    ends = ((cube <= _AT_BOUND, problem.low), (cube >= 1.0 - _AT_BOUND, problem.high))
    at_bounds = [
        f"{problem.names[j]} at {bound[j]:g}"
        for is_there, bound in ends
        for j in np.flatnonzero(is_there & (runs.moved > 0.0))
    ]
    if at_bounds:
        yield f"the search ended at a bound, which may be too narrow: {', '.join(at_bounds)}"


def _without_derivatives(runs: Runs) -> Iterator[str]:
    """Yield where differences took the place of derivatives."""
    if runs.why:
        yield f"differences of runs took the place of derivatives: {runs.why}"
    for why, count in runs.lacking.items():
        yield (
            f"differences of runs took the place of derivatives in {counted(count, 'run')}: {why}"
        )
    for key, count in runs.kinked.items():
        yield (
            f"'{key}' had a kink at {counted(count, 'choice')} of gains: the middle of the "
            "derivatives to both sides was taken"
        )
