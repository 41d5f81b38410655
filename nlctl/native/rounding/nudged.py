"""Values of expressions whose every operation is rounded in another way.

Two programs that say the same differ by what each operation rounds, and where large terms cancel
that is all that is left.  So each intermediate value is nudged, by some units in its last place
and in random directions, and the results show what such rounding may do: a running error analysis
by sampling (Parker, Pierce, Eggert 2000, Monte Carlo arithmetic).
"""

from collections.abc import Callable, Collection, Iterable, Mapping
from typing import Any

import numpy as np

from ...expressions.evaluate import value_of
from ...expressions.functions import COUNTING
from ...expressions.graph import COMPARISONS, LOGIC, Expr, needed

_PLACES = 16  # units in the last place by which an operation is nudged; libraries differ by four


def unit() -> float:
    """Return the relative change of a nudge."""
    return _PLACES * float(np.finfo(float).eps)


class Shaken(np.ndarray):
    """An array of which NumPy's functions make arrays with other last digits."""

    drawn: np.random.Generator | None  # where the directions are from; None for no change

    @classmethod
    def of(cls, values: object, drawn: np.random.Generator | None) -> "Shaken":
        """Return values as such an array."""
        shaken = np.array(values, dtype=float).view(cls)
        shaken.drawn = drawn
        return shaken

    def __array_finalize__(self, other: object) -> None:
        self.drawn = getattr(other, "drawn", None)

    def __getitem__(self, key: Any) -> Any:
        item = super().__getitem__(key)
        return item if isinstance(item, np.ndarray) else self._like(item)

    def __iter__(self) -> Any:
        return (self[i] for i in range(len(self)))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        out = kwargs.pop("out", None)
        result = getattr(ufunc, method)(*_plain(inputs), **_plain(kwargs))
        shaken = self._rounded(result)
        if out is None:
            return shaken
        np.copyto(out[0].view(np.ndarray), np.asarray(shaken))
        return out[0]

    def __array_function__(
        self, function: Callable[..., Any], types: object, args: Any, kwargs: Any
    ) -> Any:
        return self._rounded(function(*_plain(args), **_plain(kwargs)))

    def _rounded(self, value: Any) -> Any:
        """Return a result with other last digits; anything else as it is."""
        if type(value) in (tuple, list):
            return type(value)(map(self._rounded, value))
        if self.drawn is not None and _is_of_floats(value):
            value = value * (1.0 + unit() * self.drawn.choice((-1.0, 1.0), size=np.shape(value)))
        return self._like(value)

    def _like(self, values: object) -> Any:
        return Shaken.of(values, self.drawn) if _is_of_floats(values) else values


def _is_of_floats(value: object) -> bool:
    return isinstance(value, np.ndarray | np.floating) and value.dtype == float


def _plain(argument: Any) -> Any:
    """Return arguments with plain arrays in them."""
    if isinstance(argument, Shaken):
        return argument.view(np.ndarray)[()] if argument.ndim == 0 else argument.view(np.ndarray)
    if type(argument) in (tuple, list):
        return type(argument)(map(_plain, argument))
    if type(argument) is dict:
        return {name: _plain(value) for name, value in argument.items()}
    return argument


ROUNDINGS = 24  # ways of rounding that are tried; the first is none
_EXACT = {"leaf", "item", "slice", "concat", "select", "neg", "absolute", "sign", "copysign",
          "minimum", "maximum", *COUNTING, "lu", "lu_regular",
          *COMPARISONS, *LOGIC}  # fmt: skip
Functions = Mapping[str, Callable[[np.ndarray], np.ndarray]]


def nudged_values(
    results: Iterable[Expr],
    arrays: Mapping[str, np.ndarray],
    searches: Functions,
    calls: Functions,
    fixed_points: Mapping[str, list[Expr]],
) -> list[np.ndarray]:
    """Return the values of expressions at one point, in `ROUNDINGS` ways of rounding."""
    results = list(results)
    given = {name: np.repeat(array, ROUNDINGS, axis=1) for name, array in arrays.items()}
    reader = _Reader(given, searches, calls)
    if fixed_points:  # a search is as exact as what it compares
        again = [expr for exprs in fixed_points.values() for expr in exprs]
        values = iter(reader.read(again))
        ends = {name: [next(values) for _ in exprs] for name, exprs in fixed_points.items()}
        reader = _Reader(given, {k: _moved(v, ends.get(k, ())) for k, v in searches.items()}, calls)
    return reader.read(results)


def nudged_columns(
    results: Iterable[Expr], arrays: Mapping[str, np.ndarray], columns: int,
    alike: Collection[Expr],
) -> list[np.ndarray]:  # fmt: skip
    """Return the values of expressions at many points, each rounded in one way but for `alike`."""
    return _Reader(arrays, {}, {}, columns, alike).read(list(results))


def _moved(search: Any, values: Iterable[np.ndarray]) -> Any:
    """Return a search whose results are moved as far as their fixed points were."""
    far = [np.broadcast_to(v, (ROUNDINGS,)) - np.broadcast_to(v, (ROUNDINGS,))[0] for v in values]

    def search_with_rounding(given: np.ndarray) -> np.ndarray:
        results = np.broadcast_to(search(given), (len(far), ROUNDINGS)).copy()
        return results + np.nan_to_num(np.array(far))

    return search_with_rounding


class _Reader:
    """Goes through expressions; a value is rounded again by each that uses it."""

    # Of two that use it one may have been computed in another way, as powers are by products.

    def __init__(
        self, arrays: Mapping[str, np.ndarray], searches: Functions, calls: Functions,
        columns: int = ROUNDINGS, alike: Collection[Expr] = (),
    ) -> None:  # fmt: skip
        self.arrays, self.columns, self.alike = arrays, columns, alike
        self.drawn = np.random.default_rng(2017)  # the same directions in every comparison
        shaken = {name: _columns(function, self.drawn) for name, function in calls.items()}
        self.functions = {**searches, **shaken}

    def read(self, results: list[Expr]) -> list[np.ndarray]:
        """Return the values of results."""
        values: dict[Expr, np.ndarray] = {}
        with np.errstate(all="ignore"):
            for node in needed(results):
                # of a matrix every entry: its elimination is that of one nearby
                nudge = self.nudged if node.op == "lu" else self.rounded
                parts = [nudge(arg, values[arg]) for arg in node.args]
                values[node] = value_of(node, parts, self.arrays, self.functions)
                if node.op == "sum":  # relative to its terms: their order is not said
                    scale = np.broadcast_to(np.abs(parts[0]).sum(axis=0), (self.columns,))
                    values[node] = values[node] + scale * self.ways(None)
            return [self.rounded(expr, values[expr]) for expr in results]

    def rounded(self, node: Expr, value: np.ndarray) -> np.ndarray:
        """Return a value with other last digits behind its first column."""
        is_whole = node.op in ("const", "table") and np.all(value == np.trunc(value))
        if node.op in _EXACT or node.kind != "f" or is_whole or node in self.alike:
            return value
        return self.nudged(node, value)

    def nudged(self, node: Expr, value: np.ndarray) -> np.ndarray:
        """Return a value with other last digits behind its first column, whatever it is."""
        return value * (1.0 + self.ways(node.size))

    def ways(self, size: int | None) -> np.ndarray:
        """Return relative changes."""
        shape = (size, self.columns) if size else (self.columns,)
        directions = unit() * self.drawn.choice((-1.0, 1.0), size=shape)
        directions[..., 0] = 0.0
        return directions


def _columns(
    function: Callable[[np.ndarray], np.ndarray], drawn: np.random.Generator
) -> Callable[[np.ndarray], np.ndarray]:
    """Return an opaque function of columns: what it computes inside is rounded in other ways."""
    # Where it does not take arrays that round otherwise, it is called with plain ones.

    def called(given: np.ndarray) -> np.ndarray:
        given = np.broadcast_to(given, (given.shape[0], ROUNDINGS))
        plain = np.asarray(function(given[:, 0].copy()))
        follows = _same(function, Shaken.of(given[:, 0], None), plain)
        columns = [plain]
        for column in given.T[1:]:
            way = Shaken.of(column, drawn) if follows else column.copy()
            columns.append(np.asarray(function(way)))
        return np.stack([np.asarray(values, dtype=float) for values in columns], axis=1)

    return called


def _same(function: Callable[[np.ndarray], np.ndarray], given: Shaken, plain: np.ndarray) -> bool:
    """Whether a function takes these arrays for what they are."""
    try:
        return np.array_equal(np.asarray(function(given)), plain, equal_nan=True)
    except Exception:  # whatever a function of others raises for a type that it does not know
        return False
