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
_CHANGES = (0, 1, 0, 2, 0, 1, 0, 2)  # of the simple signals of each round: they are constant apart
_GENERATIONS = 2  # of CMA-ES in each round
_STEPS = 10  # descents have at most so many steps
_SMALLEST = 1 / 256  # shortest step of a descent, in units of the boxes
_SHORTER = 4  # by what a step is shortened that did not go down
# the next step is twice as long where one gains this part of what the first order says
_TRUSTED = 0.5
_MOST_CONSTANT = 16  # test signals that are constant
_PIECE = re.compile(r"(.*)\[(\d+)\]")


def search_with_derivatives(
    search: Search, rng: np.random.Generator, derivatives: FirstOrderOf
) -> list[str]:
    """Run rows until the budget is spent or the target met; return why derivatives ended."""
    reasons: dict[str, None] = {}
    tests = from_unit_cube(search.space, test_signals(search.space))
    for k in range(len(tests)):  # few are needed, often
        in_batches(search, "test signals", tests.iloc[[k]])
    _descend(search, derivatives, reasons, 0)
    pieces = _pieces(search.space)
    while search.left:
        first = search.margins.size
        if pieces:
            in_batches(search, "simple signals", _simple_signals(search.space, pieces, rng))
            _descend(search, derivatives, reasons, first)
            first = search.margins.size
        for searcher, draw in (("corners", some_corners), ("uniform", uniform)):
            in_batches(search, searcher, draw(search.space, min(_DRAWS, search.left), rng))
        _descend(search, derivatives, reasons, first)
        if search.left >= GENERATION:
            evolve(search, rng, GENERATION, is_first=True, most=_GENERATIONS)
    return list(reasons)


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
    search: Search, derivatives: FirstOrderOf, reasons: dict[str, None], first: int
) -> None:
    """Go down from the worst row since the first one, by linear programs in shrinking boxes."""
    if not search.left or not np.isfinite(search.margins[first:]).any():
        return
    number, radius = first + int(np.argmin(search.margins[first:])), 1.0
    for _ in range(_STEPS):
        if search.left < 2:
            return
        row = search.run_again("derivatives", number)
        model = derivatives(row)
        if model.reason:
            reasons[model.reason] = None
        better = _step(search, model, row, search.margins[number], radius)
        if better is None:
            return
        number, radius = better


def _step(
    search: Search, model: FirstOrder, row: Mapping[str, Any], margin: float, radius: float
) -> tuple[int, float] | None:
    """Run rows that the first order calls lower until one is; return it and the next radius."""
    space = search.space
    place = unit_places(space, pd.DataFrame([row]))[0]
    while radius >= _SMALLEST and search.left:
        lower, predicted = lowest_nearby(model, place, radius)
        if not predicted < margin:
            return None
        unit = np.full(len(space.names), 0.5)
        unit[: lower.size] = np.clip(lower, 0.0, 1.0)
        labels = {choice.name: row[choice.name] for choice in space.choices}
        (new,) = search.run("gradient", from_unit_cube(space, unit[None, :]).assign(**labels))
        if new < margin:
            trusted = margin - new >= _TRUSTED * (margin - predicted)
            return search.margins.size - 1, min(1.0, 2 * radius) if trusted else radius
        radius /= _SHORTER
    return None
