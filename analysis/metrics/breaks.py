"""When the signals of a run may jump or bend: the times of its events."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable

import numpy as np

from nlctl.upstream.systems import SystemResponse


def breaks_of(response: SystemResponse) -> np.ndarray | None:
    """Return the times of the events of a response, in order and each once.

    Parameters
    ----------
    response : ct.TimeResponseData
        Its ``events``, if it has any, are a table with a column ``time`` (s).

    Returns
    -------
    ndarray of shape (m,), or None
        None where nothing is known of events: then samples alone say where a signal is smooth.

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
    return np.unique(np.asarray(events["time"], dtype=float))


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

    >>> import numpy as np
    >>> from nlctl.analysis.metrics import peak, with_breaks
    >>> t = np.array([0.0, 0.3, 0.6, 0.9, 1.2, 1.5])
    >>> round(with_breaks(peak, np.array([1.0]))(t, t % 1), 9), float(peak(t, t % 1))
    (1.0, 0.9)
    """
    if breaks is None:
        return function
    plain = getattr(function, "py_func", function)
    inner = plain.func if isinstance(plain, functools.partial) else plain
    inner = getattr(inner, "py_func", inner)
    try:
        takes = "breaks" in inspect.signature(inner).parameters
    except (TypeError, ValueError):
        return function
    return functools.partial(function, breaks=breaks) if takes else function
