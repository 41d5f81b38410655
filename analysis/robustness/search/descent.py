"""The search for the worst case with derivatives: test signals, descents, draws, CMA-ES."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd

from ..uncertainty.space import Space, from_unit_cube
from .candidates import GENERATION, Search, evolve, in_batches, some_corners, uniform, unit_places
from .first_order import FirstOrder, FirstOrderOf, lowest_nearby

_DRAWS = 4  # corners, and uniform draws, of each round
_CHANGES = (0, 1, 0, 2)  # of the simple signals of each round: they are constant apart
_GENERATIONS = 2  # of CMA-ES in each round
_STEPS = 4  # descents have at most so many steps
_SHORTEST = 1 / 256  # shortest step of a descent, in units of the boxes
_SHORTER = 4  # by what a step is shortened that did not go down
# The next step, also that of the next descent, is twice as long where one gains this part of what
# the first order says, and shorter where it gains less than the second one.
_TRUSTED, _DOUBTED = 0.5, 0.25
_SHORTEST_FIRST = 1 / 16  # descents begin with no shorter step
_RESTARTS = 5  # times that simple signals are drawn in each round
_KINDS = 3  # test signals before anything else, one of each kind: alternating, a step, constant
_MOST_CONSTANT = 16  # test signals that are constant
_STEPS_OF_ROUND = 40  # steps of one signal in each round
_MOST_STEPS = 128  # of these altogether
_APART = np.sqrt(2)  # times of steps differ by this factor, from one piece on
_PIECE = re.compile(r"(.*)\[(\d+)\]")


def search_with_derivatives(
    search: Search, rng: np.random.Generator, derivatives: FirstOrderOf
) -> list[str]:
    """Run rows until the budget is spent or the target met; return why derivatives ended."""
    reasons: dict[str, None] = {}
    tests = from_unit_cube(search.space, test_signals(search.space))
    pieces = _pieces(search.space)
    kinds = _KINDS if pieces else len(tests)
    _one_by_one(search, tests.iloc[:kinds])
    # of a loop that is nearly linear the first order is right in the whole box: few runs show it
    shortest = 1.0 if pieces else _SHORTEST
    radius = _descend(search, derivatives, reasons, 0, 1.0, shortest)
    steps = from_unit_cube(search.space, single_steps(search.space, rng))
    while search.left:
        for _ in range(_RESTARTS if pieces else 0):
            first = search.margins.size
            in_batches(search, "simple signals", _simple_signals(search.space, pieces, rng))
            radius = _descend(search, derivatives, reasons, first, radius)
        first = search.margins.size
        for k in range(0, min(len(steps), _STEPS_OF_ROUND), _DRAWS):
            in_batches(search, "steps", steps.iloc[k : k + _DRAWS])
        steps = steps.iloc[_STEPS_OF_ROUND:]
        _one_by_one(search, tests.iloc[kinds:])
        kinds = len(tests)
        draws = (("corners", some_corners), ("uniform", uniform))
        for searcher, draw in draws[len(pieces) > 0 :]:  # of pieces, steps are the simple corners
            in_batches(search, searcher, draw(search.space, min(_DRAWS, search.left), rng))
        radius = _descend(search, derivatives, reasons, first, radius)
        if search.left >= GENERATION:
            evolve(search, rng, GENERATION, is_first=True, most=_GENERATIONS)
    return list(reasons)


def _one_by_one(search: Search, tests: pd.DataFrame) -> None:
    """Run test signals in turn: few are needed, often."""
    for k in range(len(tests)):
        in_batches(search, "test signals", tests.iloc[[k]])


def test_signals(space: Space) -> np.ndarray:
    """Return points of the unit cube: signals that an engineer tries first."""
    # What has no pieces is in the middle. All signals alternate between their ends; all step up
    # halfway; all are constant at an end, at first at different ones, and from one to the next only
    # one of them changes; all are in the middle; all step down halfway.
    pieces = _pieces(space)
    groups = pieces or [[k] for k in range(len(space.quantities))]
    signals_found = []

    def add(values: Any) -> None:
        row = np.full(len(space.names), 0.5)
        for group, value in zip(groups, values, strict=True):
            row[group] = value
        signals_found.append(row)

    halves = [np.arange(len(group)) >= len(group) // 2 for group in groups]
    if pieces:
        add([1.0 - np.arange(len(group)) % 2 for group in groups])
        add([1.0 * half for half in halves])
    for number in itertools.islice(range(1 << min(len(groups), 30)), _MOST_CONSTANT):
        gray = number ^ (number >> 1)
        add([1.0 - ((gray >> i & 1) + i) % 2 for i in range(len(groups))])
    add([0.5] * len(groups))
    if pieces:
        add([1.0 - half for half in halves])
    return np.array(signals_found)


def single_steps(space: Space, rng: np.random.Generator) -> np.ndarray:
    """Return points of the unit cube, in random order: one signal steps from end to end."""
    # The others stay at an end. Times of steps are in a geometric sequence: what matters of a pulse
    # is its length, of any size.
    pieces = _pieces(space)
    many = 1 << min(max(len(pieces) - 1, 0), 7)  # combinations of the ends of the others
    rows = []
    for stepping, group in enumerate(pieces):
        count = int(np.log(len(group) - 1) / np.log(_APART) + 1e-9) + 1
        times = np.unique(np.rint(_APART ** np.arange(count)).astype(int))
        for at, rises, ends_of_others in itertools.product(times, (0.0, 1.0), range(many)):
            row, others = np.full(len(space.names), 0.5), pieces[:stepping] + pieces[stepping + 1 :]
            row[group] = np.where(np.arange(len(group)) < at, 1.0 - rises, rises)
            for i, other in enumerate(others):
                row[other] = ends_of_others >> i & 1
            rows.append(row)
    order = rng.permutation(len(rows))[:_MOST_STEPS]
    return np.array(rows).reshape(-1, len(space.names))[order]


def _pieces(space: Space) -> list[list[int]]:
    """Return the places of the pieces ``name[0]``, ``name[1]``, ... of each signal."""
    signals: dict[str, list[int]] = {}
    for place, quantity in enumerate(space.quantities):
        if (piece := _PIECE.fullmatch(quantity.name)) is not None:
            signals.setdefault(piece[1], []).append(place)
    return [places for places in signals.values() if len(places) > 1]


def _simple_signals(
    space: Space, pieces: list[list[int]], rng: np.random.Generator
) -> pd.DataFrame:
    """Draw rows whose signals change seldom: means of uniform draws of all pieces are alike."""
    unit = rng.random((len(_CHANGES), len(space.names)))
    for row, changes in zip(unit, _CHANGES, strict=True):
        for places in pieces:
            at = rng.choice(np.arange(1, len(places)), min(changes, len(places) - 1), replace=False)
            begun = (np.arange(len(places))[:, None] >= at).sum(axis=1)
            row[places] = rng.random(changes + 1)[begun]
    return from_unit_cube(space, unit)


def _descend(
    search: Search,
    derivatives: FirstOrderOf,
    reasons: dict[str, None],
    first: int,
    radius: float,
    shortest: float = _SHORTEST,
) -> float:
    """Go down from the worst row since the first one; return the radius that was last trusted."""
    if not search.left or not np.isfinite(search.margins[first:]).any():
        return radius
    number = first + int(np.argmin(search.margins[first:]))
    for _ in range(_STEPS):
        if search.left < 2 or radius < shortest:
            break
        row = search.run_again("derivatives", number)
        model = derivatives(row)
        if model.reason:
            reasons[model.reason] = None
        better = _step(search, model, row, search.margins[number], radius, shortest)
        if better is None:
            break
        number, radius = better
    return radius


def _step(
    search: Search,
    model: FirstOrder,
    row: Mapping[str, Any],
    margin: float,
    radius: float,
    shortest: float,
) -> tuple[int, float] | None:
    """Run rows that the first order calls lower until one is; return it and the next radius."""
    space = search.space
    place = unit_places(space, pd.DataFrame([row]))[0]
    while radius >= shortest and search.left:
        lower, predicted = lowest_nearby(model, place, radius)
        if not predicted < margin:
            return None
        unit = np.full(len(space.names), 0.5)
        unit[: lower.size] = np.clip(lower, 0.0, 1.0)
        labels = {choice.name: row[choice.name] for choice in space.choices}
        (new,) = search.run("gradient", from_unit_cube(space, unit[None, :]).assign(**labels))
        if new < margin:
            return search.margins.size - 1, _next_radius(radius, margin - new, margin - predicted)
        radius /= _SHORTER
    return None


def _next_radius(radius: float, gained: float, predicted: float) -> float:
    """Return how far the first order is followed next, by what it has gained and predicted."""
    if gained >= _TRUSTED * predicted:
        return min(1.0, 2 * radius)
    return radius if gained >= _DOUBTED * predicted else max(radius / _SHORTER, _SHORTEST_FIRST)
