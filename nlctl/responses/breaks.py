"""When the signals of a run may jump or bend: the times of its events, and samples in between."""

import functools
import inspect
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike

from ..errors import ParameterError
from ..upstream.systems import SystemResponse

_ENOUGH = 9  # samples between two breaks: a curve goes through so many
_IN_SERIES = 3  # delays through which jumps are followed
_SAME = 5e-3  # of the time between them: samples that are no further apart are one
_AT_ONCE = 1e-9  # of the time covered: breaks that are no further apart are one


def breaks_of(response: SystemResponse) -> np.ndarray | None:
    """Return the times of the events of a response, in order and each once.

    Ticks of clocks, at which held signals jump, and jumps that come out of delays are among them
    where there are samples in between.

    Parameters
    ----------
    response : ct.TimeResponseData
        Its ``events``, if it has any, are a table with a column ``time`` (s), its ``jump_times``
        an array (s).

    Returns
    -------
    ndarray of shape (m,), or None
        None where nothing is known of events: then samples alone say where a signal is smooth.

    Raises
    ------
    ParameterError
        If the response has no sample between two of its events: nothing is known of signals there.
        `sampled_between` returns the times of one that has.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> import pandas as pd
    >>> from nlctl.analysis.metrics import breaks_of
    >>> breaks_of(SimpleNamespace(events=pd.DataFrame({"time": [2.0, 0.5, 2.0]})))
    array([0.5, 2. ])
    """
    events = getattr(response, "events", None)
    if events is None or "time" not in getattr(events, "columns", ()):
        return None
    breaks = np.unique(np.asarray(events["time"], dtype=float))
    times = np.asarray(getattr(response, "time", breaks[:0]), dtype=float)
    for begin, end in unsampled(times, breaks)[:1]:
        raise ParameterError(
            f"breaks_of needs samples between all events, got none in the {end - begin:.3g} s from "
            f"t = {begin:.6g} s on: simulate again with evaluation_times=nlctl.analysis.metrics."
            "sampled_between(times, response.events['time'])"
        )
    return with_jumps(breaks, getattr(response, "jump_times", breaks[:0]), times)


def jump_times(
    jumps: np.ndarray, leaving: Sequence[Callable[[np.ndarray], np.ndarray]]
) -> np.ndarray:
    """Return the times of jumps and when they come out of delays, also out of one behind another.

    ``leaving(t)`` of a delay says when that comes out of it that jumps at times t.
    """
    fresh = jumps
    for _ in range(min(len(leaving), _IN_SERIES)):
        fresh = np.unique([of_delay(fresh) for of_delay in leaving])
        jumps = np.union1d(jumps, fresh)
    return jumps


def with_jumps(breaks: np.ndarray, jumps: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Return breaks with the jumps on both sides of which `times` has samples."""
    # A clock that is faster than the samples says nothing of signals between them.
    inside = (jumps > times[0]) & (jumps < times[-1]) if times.size else np.zeros_like(jumps, bool)
    every = np.union1d(breaks, jumps[inside])
    silent = unsampled(times, every)
    return every[~np.isin(every, silent) | np.isin(every, breaks)]


def sampled_between(times: ArrayLike, breaks: ArrayLike) -> np.ndarray:
    """Return times of samples with so many between all breaks that curves go through them.

    What a signal is between two events of a run, such as a pulse, is then seen by numbers of its
    response, however short that is: down to 1e-9 of the time covered.

    Parameters
    ----------
    times : array_like of shape (n,)
        Increasing times (s) of samples.
    breaks : array_like of shape (m,)
        Times (s) at which signals may jump or bend, in any order.

    Returns
    -------
    ndarray of shape (k,)
        `times`, and more of them between breaks that have fewer than nine in between.

    Examples
    --------
    A pulse of 0.02 s between two samples:

    >>> from nlctl.analysis.metrics import breaks_of, highest, sampled_between
    >>> kicked = ct.nlsys(
    ...     lambda t, x, u, params: [9.0 * (1.23 <= t < 1.25) - x[0]], None,
    ...     inputs=0, outputs=1, states=1, name="kicked",
    ... )
    >>> times = np.linspace(0, 2, 21)
    >>> first = nlctl.input_output_response(kicked, times)
    >>> finer = sampled_between(times, first.events["time"])
    >>> run = nlctl.input_output_response(kicked, times, evaluation_times=finer)
    >>> y = run.outputs.ravel()
    >>> print(round(highest(run.time, y, breaks_of(run)), 6), round(9 - 9 * np.exp(-0.02), 6))
    0.178212 0.178212
    """
    t = np.asarray(times, dtype=float)
    begin, end, count = _between(t, np.unique(np.asarray(breaks, dtype=float)))
    few = count < _ENOUGH
    share = 0.5 - 0.5 * np.cos(np.pi * (np.arange(_ENOUGH) + 0.5) / _ENOUGH)
    long = (end - begin)[few, None]
    more = begin[few, None] + share * long
    if not more.size:
        return t
    # two at nearly one time would tell curves nothing but rounding
    place = np.clip(np.searchsorted(t, more), 1, max(t.size - 1, 1))
    near = np.minimum(np.abs(more - t[place - 1]), np.abs(more - t[np.minimum(place, t.size - 1)]))
    return np.union1d(t, more[near > _SAME * long])


def unsampled(times: ArrayLike, breaks: np.ndarray) -> np.ndarray:
    """Return from when to when (s) there are breaks with no sample in between, a row each."""
    begin, end, count = _between(np.asarray(times, dtype=float), breaks)
    return np.column_stack([begin, end])[count == 0]


def _between(t: np.ndarray, breaks: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the pieces between breaks: begin and end (s), and their number of samples."""
    breaks = breaks[(breaks > t[0]) & (breaks < t[-1])] if t.size else breaks[:0]
    if not breaks.size:  # samples alone
        return breaks, breaks, breaks
    ends = np.concatenate([t[:1], breaks, t[-1:]])
    near = _AT_ONCE * (t[-1] - t[0])
    long = np.diff(ends) > near
    first = np.searchsorted(t, ends[:-1] + near / t.size, "right")
    last = np.searchsorted(t, ends[1:] - near / t.size, "left")  # at a break they are of no piece
    first[0], last[-1] = 0, t.size
    return ends[:-1][long], ends[1:][long], (last - first)[long]


def with_breaks(function: Callable[..., float], breaks: np.ndarray | None) -> Callable[..., float]:
    """Return a function of samples with `breaks` given, if it takes such an argument.

    Parameters
    ----------
    function : callable
        Of times and samples: one of `nlctl.analysis.metrics`, of a `Metric` or of a requirement.
    breaks : ndarray of shape (m,), or None
        Increasing times (s).

    Returns
    -------
    callable
        `function` itself where it takes no breaks, or there is nothing known of them.

    Examples
    --------
    A ramp that jumps back at 1 s has its peak between samples:

    >>> from nlctl.analysis.metrics import peak, with_breaks
    >>> t = np.array([0.0, 0.3, 0.6, 0.9, 1.2, 1.5])
    >>> round(with_breaks(peak, np.array([1.0]))(t, t % 1), 9), float(peak(t, t % 1))
    (1.0, 0.9)
    """
    if breaks is None or not takes_breaks(function):
        return function
    return functools.partial(function, breaks=breaks)


def takes_breaks(function: Callable[..., float]) -> bool:
    """Whether a function of times and samples has an argument `breaks`."""
    plain = getattr(function, "py_func", function)
    inner = plain.func if isinstance(plain, functools.partial) else plain
    inner = getattr(inner, "py_func", inner)
    try:
        return "breaks" in inspect.signature(inner).parameters
    except (TypeError, ValueError):
        return False
