"""The functions of Taylor's method in plain Python, where there is no machine code."""

from collections.abc import Callable, Sequence

import numpy as np

from ..codegen.interpret import interpreted_function
from ..integrate.methods.crossings import FOLLOWED
from ..lower import Lowered
from .folds import SeriesLayout
from .recurrences import Fold, Recurrences
from .steps import GROWN

_Array = np.ndarray  # with a column for each member


def plain_series(
    lowered: Lowered, recurrence: Recurrences, compared: Sequence[int], layout: SeriesLayout
) -> tuple[Callable[..., None], ...]:
    """Return `prepare` and the functions of a step, as `steps` and `folds` have them in IR."""
    prepare, first, following, last = (
        interpreted_function(f, lowered.lanes, {}) for f in lowered.functions.values()
    )

    def taylor(t: float, x: _Array, u: _Array, v: _Array, c: _Array, k: _Array) -> None:
        w, o, a, q = (c[layout.at[name] : layout.at[name] + lowered.rows[name]] for name in "woaq")
        first(t, x, u, c, o, k[0])
        highest = len(k) - 1
        for order in range(1, highest):
            w[:] = np.array([[order], [1.0 / order], [float(order == 1)]])
            for fold in recurrence.folds:
                _summed(fold, order, k, {"a": a, "q": q}[fold.array])
            following(t, x, u, c, v, w, o, k[order - 1], a, q, k[order])
        w[:] = np.array([[highest], [1.0 / highest], [0.0]])
        last(w, k[highest - 1], k[highest])

    def tolerance(size: _Array, c: _Array) -> _Array:
        return 1.0 / (c[layout.at["atol"]] + c[layout.at["rtol"]] * size)

    def growth(x: _Array, c: _Array, k: _Array, largest: _Array) -> None:
        scale, n, highest = tolerance(np.abs(x), c), len(x), len(k) - 1
        for i in range(GROWN):
            largest[i] = np.max(np.abs(k[highest - i, :n]) * scale, axis=0)

    def step(h: float, c: _Array, k: _Array, x: _Array, slope: _Array) -> None:
        x[:], slope[:] = _polynomial(k[:, : len(x)], h)

    def judge(
        h: float, x: _Array, x_new: _Array, slope: _Array, dx: _Array, c: _Array, k: _Array,
        largest: _Array,
    ) -> None:  # fmt: skip
        scale = tolerance(np.maximum(np.abs(x), np.abs(x_new)), c)
        largest[0] = np.max(np.abs(h * (dx - slope)) * scale + 0.0 * x_new, axis=0)
        largest[1] = np.max(np.abs(h ** (len(k) - 1) * k[-1, : len(x)]) * scale, axis=0)
        largest[2] = -1.0
        for row in compared:
            parts = np.abs(k[:-1, row]) * h ** np.arange(len(k) - 1)[:, None]
            doubt = parts[-2:].sum(axis=0) - FOLLOWED * parts.sum(axis=0)
            doubt = np.fmax(doubt, parts.sum(axis=0) - 2.0 * parts[0])
            largest[2] = np.fmax(largest[2], doubt)

    def values(h: float, c: _Array, k: _Array, g: _Array) -> None:
        n = lowered.rows["x"]
        g[:] = _polynomial(k[:-1, n : n + len(g)], h)[0]

    return prepare, taylor, growth, step, judge, values


def _summed(fold: Fold, order: int, k: _Array, sums: _Array) -> None:
    rows = np.arange(fold.size)
    left, right = fold.left + fold.steps[0] * rows, fold.right + fold.steps[1] * rows
    sums[fold.row : fold.row + fold.size] = sum(
        (k[j, left] * k[order - j, right] for j in range(1, order)), np.zeros(1)
    )


def _polynomial(k: _Array, h: float) -> tuple[_Array, _Array]:
    value, slope = k[-1], np.zeros_like(k[-1])
    for below in k[-2::-1]:
        value, slope = value * h + below, slope * h + value
    return value, slope
