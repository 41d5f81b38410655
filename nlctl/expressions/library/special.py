"""Functions of `math` and of SciPy that are formulas of others."""

from __future__ import annotations

import functools
import inspect
import math
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise
from . import integral_functions
from .cells import by_numpy
from .complex_numbers import ComplexPair
from .exponential import expm
from .gamma import betaln, gamma, loggamma_of_size, lower_gamma, upper_gamma
from .integral_functions import bessel, exponential_integral, macdonald, modified_bessel
from .integrals import fixed_quad, quad
from .linear_algebra import (
    NotComputed,
    cholesky_factor,
    lu_factor,
    of_bands,
    of_cholesky,
    of_triangle,
    of_triangles,
)
from .orthogonal import lyapunov, root_of_matrix, scipys_qr, sylvester
from .python import python_integer
from .reductions import prod
from .shapes import by_moving
from .spectra import eigh, eigvals, eigvalsh, guard_finite, pinv, svd
from .table import WRITTEN, Facade, enter, formula, of


@functools.cache
def enter_scipy() -> None:
    """Enter functions of SciPy, as soon as somebody uses one."""
    from scipy import integrate, linalg, special
    from scipy.spatial import distance

    formula(integrate.cumulative_trapezoid)(cumulative_trapezoid)
    enter([integrate.trapezoid], WRITTEN[np.trapezoid])
    formula(distance.euclidean)(_distance)
    formula(distance.cdist)(_distances)
    for name in ("solve", "inv", "det", "cholesky", "norm"):
        enter([getattr(linalg, name)], _of_linalg(name))
    enter([linalg.block_diag], by_moving(linalg.block_diag))
    for name, solution in (("cho_solve", of_cholesky), ("lu_solve", of_triangles)):
        enter([getattr(linalg, name)], solution)
    enter([linalg.solve_triangular], of_triangle)
    enter([linalg.solve_banded], of_bands)
    enter([linalg.expm], expm)
    _enter_matrices(linalg)
    for name, of_gamma in (("gamma", gamma), ("gammaln", loggamma_of_size)):
        formula(getattr(special, name))(of_gamma)
    enter([linalg.cho_factor], cholesky_factor)
    for function in (getattr(linalg, name) for name in linalg.__all__):
        if function in WRITTEN and "check_finite" in inspect.signature(function).parameters:
            enter([function], _of_finite(WRITTEN[function]))
    _enter_integrals(special)
    for name, formula_of in _FORMULAS.items():
        formula(getattr(special, name))(formula_of)
    of(integrate.quad, makes=True)(quad)
    of(integrate.fixed_quad, makes=True)(fixed_quad)
    formula(special.lambertw)(lambertw)
    for name in ("erf", "erfc"):
        enter([getattr(special, name)], functools.partial(_elementwise, name))
    for name in ("log1p", "expm1", "exp2", "cbrt"):
        if getattr(special, name) is not getattr(np, name):
            enter([getattr(special, name)], functools.partial(_elementwise, name))


def _enter_matrices(linalg: Any) -> None:
    """Enter factorizations, and matrices that are made of rows."""
    for name in ("toeplitz", "circulant", "hankel", "companion"):
        enter([getattr(linalg, name)], by_numpy(getattr(linalg, name)))
    enter([linalg.qr], scipys_qr)
    enter([linalg.lu_factor], lu_factor)
    enter([linalg.lstsq], _scipys_lstsq)
    enter([linalg.eigvals], lambda graph, a, check_finite=True: eigvals(graph, a))
    enter([linalg.pinv], _scipys_pinv)
    enter([linalg.svdvals], lambda graph, a: svd(graph, a, compute_uv=False))
    enter(
        [linalg.eigvalsh],
        lambda graph, a, lower=True: eigvalsh(graph, a, "U" if not lower else "L"),
    )
    enter([linalg.eigh], _scipys_eigh)
    enter([linalg.sqrtm], root_of_matrix)
    enter([linalg.solve_continuous_lyapunov, linalg.solve_lyapunov], lyapunov)
    enter([linalg.solve_sylvester], sylvester)
    enter([linalg.solve_discrete_lyapunov], lambda graph, a, q: lyapunov(graph, a, q, True))


def _enter_integrals(special: Any) -> None:
    """Enter Bessel's functions and others that are integrals."""
    for names, kind in ((("j0", "j1", "jv", "jn"), bessel),
                        (("i0", "i1", "iv"), modified_bessel),
                        (("k0", "k1", "kv", "kn"), macdonald)):  # fmt: skip
        for name in names:
            order = int(name[1]) if name[1].isdigit() else None
            function = kind if order is None else integral_functions.fixed(kind, order)
            enter([getattr(special, name)], function)
    enter([special.exp1], exponential_integral)
    for name, written in _OF_INTEGRALS.items():
        formula(getattr(special, name))(written)


formula(math.lgamma)(loggamma_of_size)
formula(math.gamma)(gamma)


def cumulative_trapezoid(
    np: Facade,
    y: object,
    x: object = None,
    dx: object = 1.0,
    axis: int = -1,
    initial: object = None,
) -> Tracer:
    """Return the integrals from the first place to each."""
    y = traced(np.graph, y)
    if y.ndim != 1 or axis not in (0, -1):
        raise Untraceable("integrals along one axis of several")
    width = dx if x is None else np.diff(traced(np.graph, x))
    sums = np.cumsum(width * (y[1:] + y[:-1]) / 2.0)
    return sums if initial is None else np.concatenate([[initial], sums])


def _distance(np: Facade, u: object, v: object) -> Any:
    apart = np.subtract(u, v)
    return np.sqrt(np.sum(apart * apart))


def _distances(np: Facade, one: object, other: object) -> Any:
    """Return the distances of all points of one list from all of another."""
    a, b = traced(np.graph, one), traced(np.graph, other)
    apart = a[:, None, :] - b[None, :, :]
    return np.sqrt(np.sum(apart * apart, axis=-1))


def _scipys_pinv(graph: Graph, a: object) -> Any:
    size = max(traced(graph, a).shape)
    return pinv(graph, a, size * float(np.finfo(float).eps))


def _scipys_lstsq(graph: Graph, a: object, b: object, check_finite: bool = True) -> Any:
    solution = WRITTEN[np.linalg.lstsq](graph, a, b, float(np.finfo(float).eps))[0]
    rest = NotComputed("residuals, rank or singular values of least squares")
    return solution, rest, rest, rest


def _scipys_eigh(graph: Graph, a: object, *, lower: bool = True, eigvals_only: bool = False) -> Any:
    whole = eigh(graph, a, "L" if lower else "U")
    return whole[0] if eigvals_only else tuple(whole)


def _of_linalg(name: str) -> Any:
    written = WRITTEN[getattr(np.linalg, name)]

    def function(graph: Graph, *arguments: object, **options: object) -> Any:
        if name == "cholesky":
            lower = options.pop("lower", False)
            a = traced(graph, arguments[0])  # SciPy reads the triangle that it returns
            lower = arguments[1] if len(arguments) > 1 else lower
            return written(graph, a) if lower else written(graph, a.T).T
        structure = options.pop("assume_a", None)
        options = {k: v for k, v in options.items() if k not in _HOW}
        if structure not in (None, "gen", "general"):
            return _of_structure(graph, structure, *arguments, **options)
        return written(graph, *arguments, **options)

    return function


_HOW = ("check_finite", "overwrite_a", "overwrite_b")  # how, not what


def _of_structure(graph: Graph, structure: object, a: Any, b: Any) -> Tracer:
    """Return the solution of equations of whose matrix SciPy reads the upper half alone."""
    a = traced(graph, a)
    if structure in ("pos", "positive definite"):
        return of_cholesky(graph, cholesky_factor(graph, a), b)
    if structure not in ("sym", "symmetric", "her", "hermitian"):
        raise Untraceable(f"equations with a matrix that is {structure}")
    whole = elementwise(graph, "select", np.tri(len(a), dtype=bool).T, a, a.T)
    return WRITTEN[np.linalg.solve](graph, whole, b)


def _of_finite(written: Any) -> Any:
    """Return a function that raises an error where not all of its numbers are finite."""

    def function(graph: Graph, *arguments: object, **options: object) -> Any:
        if options.get("check_finite", True):
            for value in arguments[:2]:
                for part in value if isinstance(value, tuple) else (value,):
                    guard_finite(graph, part, ValueError)
        return written(graph, *arguments, **options)

    return function


def _elementwise(name: str, graph: Graph, x: object) -> Tracer:
    return elementwise(graph, name, x)


_NEAR_TURN = -0.36  # of the function that w e^w is, at -1/e


def lambertw(np: Facade, z: Any, k: object = 0, tol: object = 1e-8) -> ComplexPair:
    """w with w e^w = z, of real z, by Halley's method; near -1/e and below it is called.

    Source: R. M. Corless et al., On the Lambert W function, Adv. Comput. Math. 5 (1996) 329-359.
    """
    if k != 0 or isinstance(z, ComplexPair):
        raise Untraceable("another branch of the Lambert W function, or of complex numbers")
    z = traced(np.graph, z)
    for place in z.elements().flat:
        np.graph.limited(np.graph.op("gt", place, np.graph.const(_NEAR_TURN)))
    bounded = np.clip(z, _NEAR_TURN, 1.5)
    turn = np.sqrt(2.0 * (math.e * bounded + 1.0))
    near = -1.0 + turn * (1.0 + turn * (-1.0 / 3.0 + turn * (11.0 / 72.0)))
    large = np.log(np.maximum(z, 1.5))
    far = np.where(z > 3.0, large - np.log(np.maximum(large, 1.0)), np.log1p(np.maximum(z, 0.0)))
    w = np.where(z < 0.0, near, far)
    for _ in range(6):
        e = np.exp(-1.0 * w)  # not e^w, which may be infinite
        rest = w - z * e
        w = w - rest / (w + 1.0 - (w + 2.0) * rest / (2.0 * w + 2.0))
    w = np.where(z == math.inf, math.inf, w)
    return ComplexPair(np.graph, w, w * 0.0)


def softmax(np: Facade, x: object, axis: object = None) -> Any:
    """e^x, divided by the sum of all."""
    e = np.exp(x - np.max(x, axis=axis, keepdims=True))
    return e / np.sum(e, axis=axis, keepdims=True)


def logsumexp(np: Facade, a: object, axis: object = None) -> Any:
    """ln of the sum of e^a."""
    top = np.max(a, axis=axis, keepdims=True)
    top = np.where(np.isfinite(top), top, 0.0)
    logarithm = np.log(np.sum(np.exp(a - top), axis=axis))
    return logarithm + (np.sum(top) if axis is None else np.squeeze(top, axis=axis))


def huber(np: Facade, delta: Any, r: Arithmetic) -> Any:
    """r^2 / 2 up to |r| = delta, linear beyond."""
    size = np.abs(r)
    near = np.where(size <= delta, 0.5 * r * r, delta * (size - 0.5 * delta))
    return np.where(delta < 0.0, math.inf, near)


def pseudo_huber(np: Facade, delta: Any, r: object) -> Any:
    """As huber, and smooth."""
    share = r / np.where(delta == 0.0, 1.0, delta)
    height = np.expm1(0.5 * np.log1p(share * share))
    smooth = np.where((delta == 0.0) | np.equal(r, 0.0), 0.0, delta * delta * height)
    return np.where(delta < 0.0, math.inf, smooth)


def _relative_exponential(np: Facade, x: Any) -> Any:
    """(e^x - 1) / x."""
    return np.where(x == 0.0, 1.0, np.expm1(x) / np.where(x == 0.0, 1.0, x))


_OF_INTEGRALS = {
    **{name: getattr(integral_functions, name) for name in ("ellipk", "ellipe", "erfinv",
                                                            "erfcinv", "ndtri", "digamma")},
    "betaln": betaln,
    "beta": lambda np, a, b: np.exp(betaln(np, a, b)),
    "exprel": _relative_exponential,
    "entr": lambda np, x: np.where(x > 0.0, -x * np.log(np.where(x > 0.0, x, 1.0)),
                                   np.where(x == 0.0, 0.0, np.where(x < 0.0, -math.inf, x))),
    "log_softmax": lambda np, x, axis=None: _log_softmax(np, x, axis),
}  # fmt: skip


def _log_softmax(np: Facade, x: Any, axis: object) -> Any:
    below = x - np.max(x, axis=axis, keepdims=True)
    return below - np.log(np.sum(np.exp(below), axis=axis, keepdims=True))


def xlogy(np: Facade, x: Any, y: Any) -> Any:
    """x ln y, 0 where x is."""
    return np.where(np.logical_and(x == 0.0, y == y), 0.0, x * np.log(y))


def log_ndtr(np: Facade, x: Any) -> Any:
    """ln of the normal distribution function; far to the left by its series (DLMF 7.12.1)."""
    root = math.sqrt(0.5)
    right = np.log1p(-0.5 * _elementwise("erfc", np.graph, root * x))
    left = np.log(0.5 * _elementwise("erfc", np.graph, -root * np.maximum(x, -30.0)))
    far = np.minimum(x, -20.0)
    square = 1.0 / (far * far)
    series = functools.reduce(lambda total, k: 1.0 - k * square * total, (11, 9, 7, 5, 3, 1), 1.0)
    tail = -0.5 * far * far - np.log(-far) - 0.5 * math.log(2.0 * math.pi) + np.log(series)
    return np.where(x > -1.0, right, np.where(x > -20.0, left, np.where(x == x, tail, x)))


_FORMULAS = {
    "log_ndtr": log_ndtr,
    "chdtr": lambda np, v, x: lower_gamma(np, 0.5 * v, 0.5 * x),
    "chdtrc": lambda np, v, x: upper_gamma(np, 0.5 * v, 0.5 * x),
    "gammainc": lower_gamma,
    "gammaincc": upper_gamma,
    "exp10": lambda np, x: np.power(10.0, x),
    "ndtr": lambda np, x: 0.5 * _elementwise("erfc", np.graph, -1.0 * math.sqrt(0.5) * x),
    "huber": huber,
    "pseudo_huber": pseudo_huber,
    "expit": lambda np, x: 1.0 / (1.0 + np.exp(-1.0 * x)),
    "logit": lambda np, x: np.log(x / (1.0 - x)),
    "log_expit": lambda np, x: -1.0 * np.logaddexp(0.0, -1.0 * x),
    "xlogy": xlogy,
    "xlog1py": lambda np, x, y: np.where(np.logical_and(x == 0.0, y == y), 0.0, x * np.log1p(y)),
    "softmax": softmax,
    "logsumexp": logsumexp,
}


# -- math ------------------------------------------------------------------------------------------


def _whole(name: str) -> Any:
    def written(graph: Graph, x: object) -> Any:
        value = traced(graph, x)
        if value.shape:
            raise Untraceable("a function of math of an array")
        return python_integer(graph, name, value)

    return written


of(math.floor)(_whole("floor"))
of(math.ceil)(_whole("ceil"))
of(math.trunc)(_whole("trunc"))


@formula(math.dist)
def dist(np: Facade, p: object, q: object) -> Tracer:
    """Return the distance of two points."""
    apart = np.subtract(traced(np.graph, p), traced(np.graph, q))
    return functools.reduce(np.hypot, list(apart), 0.0)


of(math.prod)(
    lambda graph, values, *, start=1: elementwise(graph, "mul", start, prod(graph, list(values)))
)


@formula(math.remainder)
def ieee_remainder(np: Facade, x: object, y: object) -> Tracer:
    """Return what the nearest multiple of y leaves of x; of two equally far the even one."""
    size = np.abs(y)
    rest, half = np.fmod(x, size), 0.5 * size
    odd = np.fmod(x, 2.0 * size) != rest
    remainder = np.where((rest > half) | ((rest == half) & odd), rest - size, rest)
    remainder = np.where((rest < -half) | ((rest == -half) & odd), rest + size, remainder)
    return np.where(size == math.inf, x, remainder)


@formula(math.isclose)
def _isclose(
    np: Facade, a: object, b: object, *, rel_tol: float = 1e-9, abs_tol: float = 0.0
) -> Any:
    """Return whether a is next to b."""
    scale = np.maximum(np.abs(a), np.abs(b))
    near = np.abs(np.subtract(a, b)) <= np.maximum(rel_tol * scale, abs_tol)
    return (near & (scale < math.inf)) | np.equal(a, b)
