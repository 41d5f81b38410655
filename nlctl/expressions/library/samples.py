"""Functions of Python's module `statistics`, and `math.fsum`.

Source: T. Ogita, S. M. Rump and S. Oishi, Accurate sum and dot product, SIAM J. Sci. Comput. 26
(2005) 1955-1988, algorithm Sum2.
"""

from __future__ import annotations

import math
import statistics
from typing import Any

from ..arrays import Tracer, python_number, traced
from ..graph import Untraceable
from .rotated import in_passes
from .table import Facade, formula

__all__: list[str] = []


def _numbers(values: Any, fewest: int) -> Tracer:
    if not isinstance(values, Tracer) or values.ndim != 1 or values.shape[0] < fewest:
        raise Untraceable("statistics of something else than a list of numbers")
    return values


@formula(math.fsum)
def _fsum(np: Facade, values: Any) -> Any:
    """Return a sum, and add what rounding has left out of it."""
    first, *others = [*values] or [0.0]
    whole, rest = traced(np.graph, first) * 1.0, 0.0
    with in_passes(np.graph):
        for v in others:
            longer = whole + v
            added = longer - whole
            rest = rest + ((whole - (longer - added)) + (v - added))
            whole = longer
        return np.where(np.isfinite(whole), whole + rest, whole) if len(others) > 1 else whole


@formula(statistics.fmean)
def _fmean(np: Facade, data: Any) -> Any:
    """Return the mean of numbers, as one of Python's own."""
    return _of_python(_average(np, data))


@formula(statistics.mean)
def _mean(np: Facade, data: Any) -> Any:
    """Return the mean of numbers."""
    return _of_kind(data, _average(np, data))


@formula(statistics.median)
def _median(np: Facade, data: Any) -> Any:
    """Return the median of numbers."""
    return _of_kind(data, np.median(_numbers(data, 1)))


@formula(statistics.pvariance)
def _pvariance(np: Facade, data: Any, mu: Any = None) -> Any:
    """Return the variance of all numbers that there are."""
    return _of_kind(data, _squares(np, _numbers(data, 1), mu) / float(len(data)))


@formula(statistics.variance)
def _variance(np: Facade, data: Any, xbar: Any = None) -> Any:
    """Return the variance that a sample lets expect."""
    return _of_kind(data, _squares(np, _numbers(data, 2), xbar) / float(len(data) - 1))


@formula(statistics.pstdev)
def _pstdev(np: Facade, data: Any, mu: Any = None) -> Any:
    """Return the standard deviation of all numbers that there are."""
    return _of_python(np.sqrt(_pvariance(np, data, mu)))


@formula(statistics.stdev)
def _stdev(np: Facade, data: Any, xbar: Any = None) -> Any:
    """Return the standard deviation that a sample lets expect."""
    return _of_python(np.sqrt(_variance(np, data, xbar)))


def _average(np_: Facade, data: Any) -> Any:
    return _fsum(np_, list(_numbers(data, 1))) / float(len(data))


def _squares(np_: Facade, data: Tracer, middle: Any) -> Any:
    away = data - (np_.mean(data) if middle is None else middle)
    return np_.sum(away * away)


def _of_kind(data: Tracer, result: Tracer) -> Tracer:
    """Return a result as a number of Python's own where the data are such."""
    is_pythons = all(e in result.graph.of_python for e in data.elements().flat)
    return _of_python(result) if is_pythons else result


def _of_python(result: Tracer) -> Tracer:
    return python_number(result.graph, result.only)
