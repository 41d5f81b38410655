"""Functions of Python's module `statistics`."""

from __future__ import annotations

import statistics
from typing import Any

import numpy as np

from ..arrays import Tracer
from ..graph import Untraceable
from .table import Facade, formula

__all__: list[str] = []


def _numbers(values: Any, fewest: int) -> Tracer:
    if not isinstance(values, Tracer) or values.ndim != 1 or values.shape[0] < fewest:
        raise Untraceable("statistics of something else than a list of numbers")
    return values


@formula(statistics.mean, statistics.fmean)
def mean(np: Facade, data: Any) -> Any:
    """Return the mean of numbers."""
    return np.mean(_numbers(data, 1))


@formula(statistics.median)
def median(np: Facade, data: Any) -> Any:
    """Return the median of numbers."""
    return np.median(_numbers(data, 1))


@formula(statistics.pvariance)
def pvariance(np: Facade, data: Any, mu: Any = None) -> Any:
    """Return the variance of all numbers that there are."""
    return _squares(np, _numbers(data, 1), mu) / float(len(data))


@formula(statistics.variance)
def variance(np: Facade, data: Any, xbar: Any = None) -> Any:
    """Return the variance that a sample lets expect."""
    return _squares(np, _numbers(data, 2), xbar) / float(len(data) - 1)


@formula(statistics.pstdev)
def pstdev(np: Facade, data: Any, mu: Any = None) -> Any:
    """Return the standard deviation of all numbers that there are."""
    return np.sqrt(pvariance(np, data, mu))


@formula(statistics.stdev)
def stdev(np: Facade, data: Any, xbar: Any = None) -> Any:
    """Return the standard deviation that a sample lets expect."""
    return np.sqrt(variance(np, data, xbar))


def _squares(np_: Facade, data: Tracer, middle: Any) -> Any:
    away = data - (np_.mean(data) if middle is None else middle)
    return np_.sum(away * away)
