"""Functions of SciPy that are linear in their data: what they make of unit vectors is a matrix."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from .table import enter, known_numbers

__all__: list[str] = []

_MOST = 64  # elements of the data
_OF_GRIDS = ("convolve", "correlate", "laplace", "gaussian_filter", "uniform_filter",
             "convolve2d", "correlate2d")  # fmt: skip


@functools.cache
def enter_linear_maps() -> None:
    """Enter them; the data are the first argument, the second or third one of a filter."""
    from scipy import fft, integrate, ndimage, signal

    for function in (integrate.simpson, signal.savgol_filter, signal.detrend,
                     ndimage.gaussian_filter1d, ndimage.uniform_filter1d, fft.dct, fft.idct,
                     fft.dst, fft.idst, ndimage.convolve, ndimage.correlate, ndimage.laplace,
                     ndimage.gaussian_filter, ndimage.uniform_filter, signal.convolve2d,
                     signal.correlate2d):  # fmt: skip
        enter([function], _by_matrix(function, 0))
    places = {signal.lfilter: 2, signal.filtfilt: 2, signal.sosfilt: 1, signal.sosfiltfilt: 1,
              ndimage.correlate1d: 0, ndimage.convolve1d: 0}  # fmt: skip
    for function, place in places.items():
        enter([function], _by_matrix(function, place))


def _by_matrix(function: Callable[..., Any], place: int) -> Callable[..., Any]:
    def written(graph: Graph, *arguments: Any, **options: Any) -> Any:
        what = f"options of {function.__name__}"
        given = [v if k == place or v is None or isinstance(v, str) else known_numbers(v, what)
                 for k, v in enumerate(arguments)]  # fmt: skip
        named = {k: v if v is None or isinstance(v, str) else known_numbers(v, what)[()]
                 for k, v in options.items() if k != "axis"}  # fmt: skip
        if len(given) <= place:
            raise Untraceable(f"{function.__name__} with its data by name")
        data = traced(graph, given[place]).short()
        of_rows = options.get("axis", -1) not in (-1, 0) or function.__name__ not in _OF_GRIDS
        if data.size > _MOST or (data.ndim != 1 and of_rows):
            raise Untraceable(f"{function.__name__} of something else than a short row")
        shape, data = data.shape, data.reshape(-1)

        def of(values: np.ndarray) -> np.ndarray:
            whole = [v if k == place or v is None or isinstance(v, str) else v[()]
                     for k, v in enumerate(given)]  # fmt: skip
            values = values.reshape(shape)
            return np.asarray(function(*whole[:place], values, *whole[place + 1 :], **named))

        if np.any(of(np.zeros(data.size))):
            raise Untraceable(f"{function.__name__}, which adds something here")
        columns = np.array([of(unit) for unit in np.eye(data.size)])
        spread = functools.reduce(lambda a, b: a + b, [data[k] * 0.0 for k in range(data.size)])
        data = data - spread  # what is not finite is in all results
        if not columns[0].shape:
            return _weighed(data, columns)
        cells = [_weighed(data, row) for row in columns.reshape(data.size, -1).T]
        return traced(graph, cells).reshape(columns.shape[1:])

    return written


def _weighed(data: Tracer, weights: np.ndarray) -> Any:
    """Return a weighted sum: zeros, too, hand NaN on."""
    parts = [data[k] * float(w) for k, w in enumerate(weights)]
    return functools.reduce(lambda a, b: a + b, parts)
