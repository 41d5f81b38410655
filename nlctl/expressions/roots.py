"""Roots of functions of one number: SciPy's methods in Python, pass by pass as these have them.

A traced function finds these instead of `scipy.optimize`'s.  Where SciPy raises an error, or
needs more passes than are written out, the result is NaN.

Source: `scipy/optimize/Zeros/brentq.c`, `brenth.c`, `bisect.c`, `scipy/optimize/_zeros_py.py`.
Of `fsolve`: J. J. More, B. S. Garbow and K. E. Hillstrom, User Guide for MINPACK-1 (1980), HYBRD.
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
_EPS = 2.220446049250313e-16
_STEP = _EPS**0.5  # of differences, relative to x


@functools.cache
def roots() -> dict[Any, Callable[..., Any]]:
    """Return what stands for functions of SciPy."""
    from scipy import optimize

    return {
        optimize.brentq: brentq, optimize.bisect: bisect, optimize.newton: newton,
        optimize.root_scalar: root_scalar, optimize.fsolve: fsolve, optimize.root: root_by_powell,
        optimize.brenth: brenth, optimize.fixed_point: fixed_point,
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
            change = slope(graph, value.only, place.only) or graph.const(0.0)
            step = scalar(graph, value.only) / scalar(graph, change)
            near = _ROUNDING * op("maximum", 1.0, op("absolute", place))
            return op("select", op("le", op("absolute", step), near), place - step, root)


with_slope = SlopeOfRoot()


class Refusal(Special):
    """Ends a trace with its reason, which errors that a traced function raises do not keep."""

    def __call__(self, reason: str) -> Any:
        raise Untraceable(reason)


refused = Refusal()


class Root:
    """What `root_scalar` and `root` of SciPy return where they have found a root."""

    def __init__(self, **parts: Any) -> None:
        self.__dict__.update(parts)

    def __getattr__(self, name: str) -> Any:
        raise Untraceable(f"{name} of a root: how many passes it has taken")

    def __getitem__(self, name: str) -> Any:
        return getattr(self, name)


def root_scalar(
    f, args=(), method=None, bracket=None, fprime=None, fprime2=None, x0=None, x1=None, xtol=None,
    rtol=None, maxiter=None,
):  # fmt: skip
    """Return a root by the method that is named, or for which there is what it needs."""
    if fprime is True:
        both, f, fprime = f, lambda v, *more: both(v, *more)[0], lambda v, *more: both(v, *more)[1]
    if method is None:
        by_tangents = "newton" if callable(fprime) else "secant" if x1 is not None else None
        by_tangents = "halley" if callable(fprime) and callable(fprime2) else by_tangents
        method = "brentq" if bracket is not None else by_tangents
    named = {"rtol": rtol, "maxiter": maxiter}
    named = {name: value for name, value in named.items() if value is not None}
    bracketed = {"brentq": brentq, "brenth": brenth, "bisect": bisect}
    if method in bracketed and bracket is not None:
        named |= {} if xtol is None else {"xtol": xtol}
        search = bracketed[method]
        return _found(search(f, bracket[0], bracket[1], args, **named), method)
    named |= {} if xtol is None else {"tol": xtol}
    if method == "newton" and callable(fprime):
        return _found(newton(f, x0, fprime, args, **named), method)
    if method == "halley" and callable(fprime) and callable(fprime2):
        return _found(newton(f, x0, fprime, args, fprime2=fprime2, **named), method)
    if method == "secant":
        return _found(newton(f, x0, None, args, x1=x1, **named), method)
    return refused(f"scipy.optimize.root_scalar by {method or 'differences'}")


def _found(root, method):
    return Root(root=root, method=method, converged=True, flag="converged")


def _reported(root, method, full_output, disp):
    """Return a root, and with it what SciPy reports if that is asked for."""
    if not disp:
        return refused(f"scipy.optimize.{method} with disp=False: what comes where it fails")
    return (root, _found(root, method)) if full_output else root


def brentq(
    f, a, b, args=(), xtol=2e-12, rtol=8.881784197001252e-16, maxiter=100, full_output=False,
    disp=True,
):  # fmt: skip
    """Return a root between two places with values of opposite signs, by Brent's method."""
    root = _with_slope_by_brent(f, a, b, args, xtol, rtol, maxiter, _bent)
    return _reported(root, "brentq", full_output, disp)


def brenth(
    f, a, b, args=(), xtol=2e-12, rtol=8.881784197001252e-16, maxiter=100, full_output=False,
    disp=True,
):  # fmt: skip
    """Return a root between two places, by Brent's method with hyperbolas."""
    root = _with_slope_by_brent(f, a, b, args, xtol, rtol, maxiter, _hyperbola)
    return _reported(root, "brenth", full_output, disp)


def _bent(fcur, fpre, fblk, dpre, dblk):
    return -fcur * (fblk * dblk - fpre * dpre) / (dblk * dpre * (fblk - fpre))


def _hyperbola(fcur, fpre, fblk, dpre, dblk):
    return -fcur * (fblk - fpre) / (fblk * dpre - fpre * dblk)


def fixed_point(func, x0, args=(), xtol=1e-8, maxiter=500, method="del2"):
    """Return where a function of one number is what it is given, by Steffensen's method."""
    if method != "del2" or np.shape(x0):
        return refused("scipy.optimize.fixed_point of several numbers, or by another method")
    p0 = np.multiply(1.0, x0)
    for _ in range(maxiter):
        p1 = func(p0, *args)
        p2 = func(p1, *args)
        bend = p2 - 2.0 * p1 + p0
        p = np.where(bend != 0, p0 - np.square(p1 - p0) / bend, p2)
        change = np.where(p0 != 0, (p - p0) / p0, p)
        if abs(change) < xtol:
            return p
        p0 = p
    raise RuntimeError("Failed to converge")


def _with_slope_by_brent(f, a, b, args, xtol, rtol, maxiter, bent):
    args = args if isinstance(args, tuple) else (args,)
    return with_slope(f, _by_brent(f, a, b, args, xtol, rtol, maxiter, bent), args)


def _by_brent(f, a, b, args, xtol, rtol, maxiter, bent):
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
        stry = np.where(xpre == xblk, line, bent(fcur, fpre, fblk, dpre, dblk))
        short = 2 * abs(stry) < np.minimum(abs(spre), 3 * abs(sbis) - delta)
        taken = (abs(spre) > delta) & (abs(fcur) < abs(fpre)) & short
        spre, scur = np.where(taken, scur, sbis), np.where(taken, stry, sbis)
        xpre, fpre = xcur, fcur
        xcur = xcur + np.where(abs(scur) > delta, scur, np.where(sbis > 0, delta, -delta))
        fcur = np.multiply(1.0, f(xcur, *args))
    raise RuntimeError("Failed to converge")


def bisect(
    f, a, b, args=(), xtol=2e-12, rtol=8.881784197001252e-16, maxiter=100, full_output=False,
    disp=True,
):  # fmt: skip
    """Return a root between two places with values of opposite signs, by halving."""
    args = args if isinstance(args, tuple) else (args,)
    return _reported(_by_halves(f, a, b, args, xtol, rtol, maxiter), "bisect", full_output, disp)


def _by_halves(f, a, b, args, xtol, rtol, maxiter):
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


def newton(
    func, x0, fprime=None, args=(), tol=1.48e-8, maxiter=50, fprime2=None, x1=None, rtol=0.0,
    full_output=False, disp=True,
):  # fmt: skip
    """Return a root near a place, by Newton's method, Halley's or that of secants."""
    if fprime is None:
        root = _by_secants(func, x0, args, tol, maxiter, rtol, x1)
    else:
        root = _tangents(func, np.multiply(1.0, x0), fprime, fprime2, args, tol, maxiter, rtol)
    return _reported(with_slope(func, root, args), "newton", full_output, disp)


def _by_secants(func, x0, args, tol, maxiter, rtol, x1):
    p0 = np.multiply(1.0, x0)
    if x1 is None:
        p1 = p0 * (1 + 1e-4)
        p1 = np.where(p1 >= 0, p1 + 1e-4, p1 - 1e-4)
    else:
        p1 = np.multiply(1.0, x1)
    return _secants(func, p0, p1, args, tol, maxiter, rtol)


def _tangents(func, p0, fprime, fprime2, args, tol, maxiter, rtol):
    for _ in range(maxiter):
        value = func(p0, *args)
        if value == 0:
            return p0
        slope = fprime(p0, *args)
        step = value / slope
        if fprime2 is not None:  # Halley's method, where it is not far from Newton's
            bend = step * fprime2(p0, *args) / slope / 2
            step = np.where(abs(bend) < 1, step / (1.0 - bend), step)
        p = p0 - step
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


def root_by_powell(fun, x0, args=(), method="hybr", jac=None, tol=None):
    """Return a root of one function of one number by MINPACK's method, as `fsolve` does."""
    if method != "hybr" or jac:
        return refused(f"scipy.optimize.root by {method}, or with derivatives")
    x = fsolve(fun, x0, args) if tol is None else fsolve(fun, x0, args, xtol=tol)
    return Root(x=x, success=True, status=1, method=method)


def fsolve(func, x0, args=(), fprime=None, full_output=0, *, xtol=1.49012e-8, factor=100):
    """Return a root of one function of one number, in an array, by Powell's hybrid method."""
    start = np.reshape(np.multiply(1.0, x0), -1)
    if fprime is not None or full_output or len(start) > 1:
        return refused("scipy.optimize.fsolve of several numbers, or with derivatives")
    args = args if isinstance(args, tuple) else (args,)
    only = lambda v, *more: np.reshape(func(np.array([v]), *more), -1)[0]  # noqa: E731
    return np.array([with_slope(only, _by_powell(only, start[0], args, xtol, factor), args)])


def _by_powell(f, x, args, xtol, factor):
    value, renews, is_first, is_stuck = f(x, *args), True, True, False
    slope, scale, reach, good, bad, slow, slow_anew = [0.0 * x] * 7
    for _ in range(200):
        h = _STEP * np.where(x == 0, 1.0, abs(x))
        measured = (f(x + h, *args) - value) / h
        slope = np.where(renews, measured, slope)
        if is_first:
            scale = np.where(measured == 0, 1.0, abs(measured))
            reach = np.where(x == 0, factor, factor * abs(scale * x))
        scale = np.where(renews, np.maximum(scale, abs(measured)), scale)
        step = -value / np.where(slope == 0, _EPS, slope)
        length = abs(scale * step)
        step = np.where(length > reach, np.copysign(reach / scale, step), step)
        length = np.minimum(length, reach)
        reach = np.minimum(reach, length) if is_first else reach
        ahead, model = f(x + step, *args), value + slope * step
        gain = np.where(abs(ahead) < abs(value), 1 - (ahead / value) ** 2, -1.0)
        hope = np.where(abs(model) < abs(value), 1 - (model / value) ** 2, 0.0)
        ratio = np.where(hope > 0, gain / hope, 0.0)
        fails = ratio < 0.1
        good, bad = np.where(fails, 0.0, good + 1), np.where(fails, bad + 1, 0.0)
        longer = np.where((ratio >= 0.5) | (good > 1), np.maximum(reach, 2 * length), reach)
        longer = np.where(abs(ratio - 1) <= 0.1, 2 * length, longer)
        reach = np.where(fails, 0.5 * reach, longer)
        slow = np.where(gain >= 1e-3, 0.0, slow + 1)
        slow_anew = np.where(gain >= 0.1, 0.0, slow_anew + np.where(renews, 1.0, 0.0))
        slope = slope + (ahead - model) / step
        x, value = np.where(ratio >= 1e-4, x + step, x), np.where(ratio >= 1e-4, ahead, value)
        is_near = (reach <= xtol * abs(scale * x)) | (value == 0)
        if is_near & np.logical_not(is_stuck):
            return x
        is_stuck = is_stuck | (slow >= 10) | (slow_anew >= 5)  # where it stops without a root
        renews, is_first = bad == 2, False
    raise RuntimeError("Failed to converge")
