"""Arrays whose every operation is rounded in another way, for functions that are called."""

from __future__ import annotations

from typing import Any

import numpy as np

_PLACES = 16  # units in the last place by which an operation is nudged; libraries differ by four


def unit() -> float:
    """Return the relative change of a nudge."""
    return _PLACES * float(np.finfo(float).eps)


class Shaken(np.ndarray):
    """An array of which NumPy's functions make arrays with other last digits.

    Attributes
    ----------
    drawn : numpy.random.Generator or None
        Where the directions are from; None for no change.
    """

    drawn: np.random.Generator | None

    @classmethod
    def of(cls, values: Any, drawn: np.random.Generator | None) -> Shaken:
        """Return values as such an array."""
        made = np.array(values, dtype=float).view(cls)
        made.drawn = drawn
        return made

    def __array_finalize__(self, other: object) -> None:
        self.drawn = getattr(other, "drawn", None)

    def __getitem__(self, key: Any) -> Any:
        found = super().__getitem__(key)
        return found if isinstance(found, np.ndarray) else self._like(found)

    def __iter__(self) -> Any:
        return (self[i] for i in range(len(self)))

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        out = kwargs.pop("out", None)
        found = getattr(ufunc, method)(*_plain(inputs), **_plain(kwargs))
        made = self._rounded(found)
        if out is None:
            return made
        np.copyto(out[0].view(np.ndarray), np.asarray(made))
        return out[0]

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        return self._rounded(function(*_plain(args), **_plain(kwargs)))

    def _rounded(self, found: object) -> Any:
        """Return a result with other last digits; anything else as it is."""
        if isinstance(found, tuple | list):
            return type(found)(map(self._rounded, found)) if type(found) in (tuple, list) else found
        if not (isinstance(found, np.ndarray | np.floating) and found.dtype == float):
            return found
        if self.drawn is None:
            return self._like(found)
        ways = self.drawn.choice((-1.0, 1.0), size=np.shape(found))
        return self._like(found * (1.0 + unit() * ways))

    def _like(self, values: Any) -> Any:
        if not (isinstance(values, np.ndarray | np.floating) and values.dtype == float):
            return values
        return Shaken.of(values, self.drawn)


def _plain(given: Any) -> Any:
    """Return arguments with plain arrays in them."""
    if isinstance(given, Shaken):
        return given.view(np.ndarray)[()] if given.ndim == 0 else given.view(np.ndarray)
    if type(given) in (tuple, list):
        return type(given)(map(_plain, given))
    if type(given) is dict:
        return {name: _plain(value) for name, value in given.items()}
    return given
