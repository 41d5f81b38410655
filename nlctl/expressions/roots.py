"""Roots of functions of one number: SciPy's methods in Python, pass by pass as these have them.

A traced function finds these instead of `scipy.optimize`'s.  Where SciPy raises an error, or
needs more passes than are written out, the result is NaN.

Source: `scipy/optimize/Zeros/brentq.c`, `bisect.c`, `scipy/optimize/_zeros_py.py`.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .arrays import Special, Tracer, scalar, traced
from .derivatives import slope
from .graph import Untraceable
from .library.rotated import in_passes
from .operators import elementwise

_ROUNDING = 1e-15  # relative to the larger of 1 and the root


@functools.cache
def roots() -> dict[Any, Callable[..., Any]]:
    """Return what stands for functions of SciPy."""
    from scipy import optimize

    return {
        optimize.brentq: brentq, optimize.bisect: bisect, optimize.newton: newton,
        optimize.root_scalar: root_scalar,
    }  # fmt: skip


class SlopeOfRoot(Special):
    """Gives a root its slope: that of what is 0 there, not of passes that happen to end early."""

    # A search that begins at the root ends at once: what it returns does not move with f.
    def __call__(self, f: Callable[..., Any], root: Any, args: Sequence[Any]) -> Any:
        if not isinstance(root, Tracer) or root.shape or root.only.op == "const":
            return root
        graph, op = root.graph, functools.partial(elementwise, root.graph)
        # a number of its own, whatever else is equal
        place = scalar(graph, graph.node("add", root.only, graph.const(-0.0)))
        value = traced(graph, f(place, *args))
        if value.shape:
            return root
        with in_passes(graph):
            step = scalar(graph, value.only) / scalar(graph, slope(graph, value.only, place.only))
            near = _ROUNDING * op("maximum", 1.0, op("absolute", place))
            return op("select", op("le", op("absolute", step), near), place - step, root)


with_slope = SlopeOfRoot()


class Root:
    """What `scipy.optimize.root_scalar` returns where it has found a root."""

    def __init__(self, root: Any, method: str) -> None:
        self.root, self.method, self.converged, self.flag = root, method, True, "converged"

    def __getattr__(self, name: str) -> Any:
        raise Untraceable(f"{name} of a root: how many passes it has taken")


def root_scalar(
    f, args=(), method=None, bracket=None, fprime=None, x0=None, x1=None, xtol=None, rtol=None,
    maxiter=None,
):  # fmt: skip
    """Return a root by the method that is named, or for which there is what it needs."""
    if method is None:
        by_tangents = "newton" if callable(fprime) else "secant" if x1 is not None else None
        method = "brentq" if bracket is not None else by_tangents
    named = {"rtol": rtol, "maxiter": maxiter}
    named = {name: value for name, value in named.items() if value is not None}
    if method in ("brentq", "bisect") and bracket is not None:
        named |= {} if xtol is None else {"xtol": xtol}
        search = brentq if method == "brentq" else bisect
        return Root(search(f, bracket[0], bracket[1], args, **named), method)
    named |= {} if xtol is None else {"tol": xtol}
    if method == "newton" and callable(fprime):
        return Root(newton(f, x0, fprime, args, **named), method)
    if method == "secant":
        return Root(newton(f, x0, None, args, x1=x1, **named), method)
    raise Untraceable(f"scipy.optimize.root_scalar by {method or 'differences'}")


def brentq(f, a, b, args=(), xtol=2e-12, rtol=8.881784197001252e-16, maxiter=100):
    """Return a root between two places with values of opposite signs, by Brent's method."""
    return with_slope(f, _by_brent(f, a, b, args, xtol, rtol, maxiter), args)


def _by_brent(f, a, b, args, xtol, rtol, maxiter):
    xpre, xcur = np.multiply(1.0, a), np.multiply(1.0, b)  # in C nothing raises errors
    fpre, fcur = f(xpre, *args), f(xcur, *args)
    if fpre * fcur > 0:
        raise ValueError("f(a) and f(b) must have different signs")
    fpre, fcur = np.multiply(1.0, fpre), np.multiply(1.0, fcur)
    xblk, fblk, spre, scur = xpre, fpre, xcur - xpre, xcur - xpre
    stop = (fpre == 0) | (fcur == 0)
    xcur = np.where(fpre == 0, xpre, xcur)
    for _ in range(maxiter):
        if stop:
            return xcur
        if fpre * fcur < 0:
            xblk, fblk, spre, scur = xpre, fpre, xcur - xpre, xcur - xpre
        if abs(fblk) < abs(fcur):
            xpre, xcur, xblk, fpre, fcur, fblk = xcur, xblk, xcur, fcur, fblk, fcur
        delta = (xtol + rtol * abs(xcur)) / 2
        sbis = (xblk - xcur) / 2
        if fcur == 0 or abs(sbis) < delta:
            return xcur
        line = -fcur * (xcur - xpre) / (fcur - fpre)
        dpre, dblk = (fpre - fcur) / (xpre - xcur), (fblk - fcur) / (xblk - xcur)
        bent = -fcur * (fblk * dblk - fpre * dpre) / (dblk * dpre * (fblk - fpre))
        stry = np.where(xpre == xblk, line, bent)
        short = 2 * abs(stry) < np.minimum(abs(spre), 3 * abs(sbis) - delta)
        taken = (abs(spre) > delta) & (abs(fcur) < abs(fpre)) & short
        spre, scur = np.where(taken, scur, sbis), np.where(taken, stry, sbis)
        xpre, fpre = xcur, fcur
        xcur = xcur + np.where(abs(scur) > delta, scur, np.where(sbis > 0, delta, -delta))
        fcur = np.multiply(1.0, f(xcur, *args))
    raise RuntimeError("Failed to converge")


def bisect(f, a, b, args=(), xtol=2e-12, rtol=8.881784197001252e-16, maxiter=100):
    """Return a root between two places with values of opposite signs, by halving."""
    left, right = np.multiply(1.0, a), np.multiply(1.0, b)
    width, first, last = right - left, f(left, *args), f(right, *args)
    if first * last > 0:
        raise ValueError("f(a) and f(b) must have different signs")
    is_root, root = (first == 0) | (last == 0), np.where(first == 0, left, right)
    for _ in range(maxiter):
        if is_root:
            return root
        width = 0.5 * width
        root = 0.5 * (left + right)  # between both, so that it is known for what it is
        value = f(root, *args)
        left, right = (np.where(value * first > 0, root, left),
                       np.where(value * first > 0, right, root))  # fmt: skip
        if value == 0 or abs(width) < xtol + rtol * abs(root):
            return root
    raise RuntimeError("Failed to converge")


def newton(func, x0, fprime=None, args=(), tol=1.48e-8, maxiter=50, rtol=0.0, x1=None):
    """Return a root near a place, by Newton's method or that of secants."""
    if fprime is not None:
        root = _tangents(func, np.multiply(1.0, x0), fprime, args, tol, maxiter, rtol)
        return with_slope(func, root, args)
    p0 = np.multiply(1.0, x0)
    if x1 is None:
        p1 = p0 * (1 + 1e-4)
        p1 = np.where(p1 >= 0, p1 + 1e-4, p1 - 1e-4)
    else:
        p1 = np.multiply(1.0, x1)
    return with_slope(func, _secants(func, p0, p1, args, tol, maxiter, rtol), args)


def _tangents(func, p0, fprime, args, tol, maxiter, rtol):
    for _ in range(maxiter):
        value = func(p0, *args)
        if value == 0:
            return p0
        p = p0 - value / fprime(p0, *args)
        if abs(p - p0) <= tol + rtol * abs(p0):
            return p
        p0 = p
    raise RuntimeError("Failed to converge")


def _secants(func, p0, p1, args, tol, maxiter, rtol):
    q0, q1 = func(p0, *args), func(p1, *args)
    swaps = abs(q1) < abs(q0)
    p0, p1, q0, q1 = (np.where(swaps, p1, p0), np.where(swaps, p0, p1),
                      np.where(swaps, q1, q0), np.where(swaps, q0, q1))  # fmt: skip
    for _ in range(maxiter):
        if q1 == q0:
            return np.where(p1 == p0, (p1 + p0) / 2.0, np.nan)
        one = (-q0 / q1 * p1 + p0) / (1 - q0 / q1)
        other = (-q1 / q0 * p0 + p1) / (1 - q1 / q0)
        p = np.where(abs(q1) > abs(q0), one, other)
        if abs(p - p1) <= tol + rtol * abs(p1):
            return p
        p0, q0 = p1, q1
        p1 = p
        q1 = func(p1, *args)
    raise RuntimeError("Failed to converge")
