"""The table of functions: all that readers of expressions know of each, a row per function.

A row that is added here is traced, compiled, differentiated, enclosed and typeset.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .arithmetic import Arithmetic


@dataclass(frozen=True, kw_only=True)
class RealFunction:
    """One function of real numbers."""

    name: str  # NumPy's name, or that of `scipy.special`
    # its machine code: ``"own"`` for what `nlctl.native.codegen.ir.functions` writes out, in its
    # table ``INLINE`` or ``CALLED``, an intrinsic of LLVM (``"llvm.fabs"``), or the name in the C
    # library (``"log"``)
    code: str
    # partial derivatives with respect to each argument, as functions of all of them.  Where a
    # function has a jump or a kink: that of one side, the one that its value belongs to
    derivative: tuple[Callable[..., Any], ...]
    # the same function of python-flint's ``arb``, for functions of one argument.  Without it balls
    # know only what `nlctl.analysis.intervals` has operators for (absolute, minimum, maximum,
    # power), and refuse the rest
    enclosure: Callable[..., Any] | None
    latex: str  # format string with ``{0}`` and ``{1}`` for the arguments
    math: tuple[str, ...] = ()  # names in Python's `math` module
    # how the Taylor coefficients of f(x(t)) follow from those of x(t).  ``"derivative"``: from y' =
    # f'(x) x', where f' is made of functions that have theirs.  ``"steady"``: f is a constant
    # between its jumps.  A callable writes the function as a choice, whose side is that on which
    # x(t) continues, or in others.  ``"unknown"``: the function is refused where they are needed
    series: str | Callable[..., Any] = "derivative"

    @property
    def count(self) -> int:
        """Number of arguments."""
        return len(self.derivative)


def _zero(*x: Arithmetic) -> Any:
    return 0.0 * x[0]  # NaN stays


def _log_of(base: float, x: Arithmetic) -> Any:
    return np.log(base + 0.0 * x)  # as exact as x: a ball encloses it


def _cube_root(x: Any) -> Any:
    if not x.is_finite():
        return x if x.is_nan() else type(x)(0, "inf")
    ends = x.lower(), x.upper()  # it rises: what it does with the ends is all
    low, high = (-(-e).root(3) if e < 0 else e.root(3) if e > 0 else e for e in ends)
    return low.union(high)


def _by_ends(x: Any, rounded: Callable[[Any], Any]) -> Any:
    if not x.is_finite():
        return x if x.is_nan() else type(x)(0, "inf")
    low, high = rounded(x.lower()), rounded(x.upper())  # it rises
    return low if low.is_exact() and high.is_exact() and low == high else low.union(high)


def _truncated(x: Any) -> Any:
    return _by_ends(x, lambda e: e.floor() if e >= 0 else e.ceil())


def _rounded(x: Any) -> Any:
    def even(e: Any) -> Any:  # of two integers equally far
        below = e.floor()
        odd = (below / 2).floor() * 2 != below
        return below + int(e - below > 0.5 or (e - below == 0.5 and odd))

    return _by_ends(x, even)


def _hyperbolic_tangent(x: Any) -> Any:
    # flint has no number for an argument without bounds, where it lies between -1 and 1
    return x.tanh() if x.is_finite() or x.is_nan() else type(x)(0, 1)


def _row(
    name: str,
    code: str,
    latex: str,
    *derivative: Callable[..., Any],
    ball: Callable[..., Any] | None = None,
    math: str = "",
    series: str | Callable[..., Any] = "derivative",
) -> RealFunction:
    names = tuple((math or name).split()) if math != "-" else ()
    return RealFunction(
        name=name, code=code, derivative=derivative, enclosure=ball, latex=latex, math=names,
        series=series,
    )  # fmt: skip


_ROWS = (
    _row("exp", "own", r"e^{{{0}}}", lambda x: np.exp(x), ball=lambda x: x.exp()),
    _row("sin", "own", r"\sin {0}", lambda x: np.cos(x), ball=lambda x: x.sin()),
    _row("cos", "own", r"\cos {0}", lambda x: -np.sin(x), ball=lambda x: x.cos()),
    _row("tanh", "own", r"\tanh {0}", lambda x: 1.0 - np.tanh(x) ** 2,
         ball=_hyperbolic_tangent),
    _row("sqrt", "llvm.sqrt", r"\sqrt{{{0}}}", lambda x: 0.5 / np.sqrt(x),
         ball=lambda x: x.sqrt()),
    _row("absolute", "llvm.fabs", r"\left|{0}\right|", lambda x: np.where(x < 0.0, -1.0, 1.0),
         math="fabs", series=lambda x: np.where(x < 0.0, -x, x)),
    _row("floor", "llvm.floor", r"\left\lfloor {0} \right\rfloor", _zero,
         ball=lambda x: x.floor(), math="-", series="steady"),
    _row("copysign", "llvm.copysign", r"\left|{0}\right| \operatorname{{sgn}} {1}",
         lambda x, y: np.where(x < 0.0, -1.0, 1.0) * np.copysign(1.0, y), _zero,
         series=lambda x, y: np.where(x < 0.0, -x, x) * np.where(y < 0.0, -1.0, 1.0)),
    _row("sign", "own", r"\operatorname{{sgn}} {0}", _zero, ball=lambda x: x.sgn(), math="-",
         series=lambda x: np.where(x < 0.0, -1.0, 1.0)),
    _row("minimum", "own", r"\min\left({0}, {1}\right)",
         lambda x, y: np.where(x < y, 1.0, 0.0), lambda x, y: np.where(x < y, 0.0, 1.0), math="-",
         series=lambda x, y: np.where(x < y, x, y)),
    _row("maximum", "own", r"\max\left({0}, {1}\right)",
         lambda x, y: np.where(x > y, 1.0, 0.0), lambda x, y: np.where(x > y, 0.0, 1.0), math="-",
         series=lambda x, y: np.where(x > y, x, y)),
    _row("log", "log", r"\ln {0}", lambda x: 1.0 / x, ball=lambda x: x.log()),
    _row("log2", "log2", r"\log_2 {0}", lambda x: 1.0 / (x * _log_of(2.0, x)),
         ball=lambda x: x.log() / type(x)(2).log()),
    _row("log10", "log10", r"\log_{{10}} {0}", lambda x: 1.0 / (x * _log_of(10.0, x)),
         ball=lambda x: x.log() / type(x)(10).log()),
    _row("log1p", "log1p", r"\ln\left(1 + {0}\right)", lambda x: 1.0 / (1.0 + x),
         ball=lambda x: x.log1p()),
    _row("expm1", "expm1", r"\left(e^{{{0}}} - 1\right)", lambda x: np.exp(x),
         ball=lambda x: x.expm1()),
    _row("exp2", "own", r"2^{{{0}}}", lambda x: _log_of(2.0, x) * np.exp2(x),
         ball=lambda x: (x * type(x)(2).log()).exp()),
    _row("tan", "tan", r"\tan {0}", lambda x: 1.0 + np.tan(x) ** 2, ball=lambda x: x.tan()),
    _row("sinh", "sinh", r"\sinh {0}", lambda x: np.cosh(x), ball=lambda x: x.sinh()),
    _row("cosh", "cosh", r"\cosh {0}", lambda x: np.sinh(x), ball=lambda x: x.cosh()),
    _row("arcsin", "asin", r"\arcsin {0}", lambda x: 1.0 / np.sqrt((1.0 - x) * (1.0 + x)),
         ball=lambda x: x.asin(), math="asin"),
    _row("arccos", "acos", r"\arccos {0}", lambda x: -1.0 / np.sqrt((1.0 - x) * (1.0 + x)),
         ball=lambda x: x.acos(), math="acos"),
    _row("arctan", "atan", r"\arctan {0}", lambda x: 1.0 / (1.0 + x * x),
         ball=lambda x: x.atan(), math="atan"),
    _row("arcsinh", "asinh", r"\operatorname{{arsinh}} {0}", lambda x: 1.0 / np.sqrt(1.0 + x * x),
         ball=lambda x: x.asinh(), math="asinh"),
    _row("arccosh", "acosh", r"\operatorname{{arcosh}} {0}",
         lambda x: 1.0 / np.sqrt((x - 1.0) * (x + 1.0)), ball=lambda x: x.acosh(), math="acosh"),
    _row("arctanh", "atanh", r"\operatorname{{artanh}} {0}",
         lambda x: 1.0 / ((1.0 - x) * (1.0 + x)), ball=lambda x: x.atanh(), math="atanh"),
    _row("ceil", "llvm.ceil", r"\left\lceil {0} \right\rceil", _zero,
         ball=lambda x: x.ceil(), math="-", series="steady"),
    _row("trunc", "llvm.trunc", r"\operatorname{{trunc}} {0}", _zero,
         ball=_truncated, math="-", series="steady"),
    _row("rint", "llvm.rint", r"\operatorname{{round}} {0}", _zero, ball=_rounded, math="-",
         series="steady"),
    _row("cbrt", "cbrt", r"\sqrt[3]{{{0}}}", lambda x: 1.0 / (3.0 * np.cbrt(x) ** 2),
         ball=_cube_root),
    _row("erf", "erf", r"\operatorname{{erf}} {0}",
         lambda x: 2.0 / np.sqrt(np.pi) * np.exp(-(x * x)), ball=lambda x: x.erf()),
    _row("erfc", "erfc", r"\operatorname{{erfc}} {0}",
         lambda x: -2.0 / np.sqrt(np.pi) * np.exp(-(x * x)), ball=lambda x: x.erfc()),
    _row("arctan2", "atan2", r"\operatorname{{atan2}}\left({0}, {1}\right)",
         lambda y, x: x / (x * x + y * y), lambda y, x: -y / (x * x + y * y), math="atan2"),
    _row("hypot", "hypot", r"\sqrt{{ {0}^{{2}} + {1}^{{2}} }}",
         lambda x, y: x / np.hypot(x, y), lambda x, y: y / np.hypot(x, y)),
    _row("power", "pow", r"{0}^{{{1}}}",
         lambda x, y: y * np.power(x, y - 1.0),
         lambda x, y: np.where((x == 0.0) & (y > 0.0), 0.0, np.log(x) * np.power(x, y)),
         math="pow", series="unknown"),
    _row("heaviside", "own", r"\operatorname{{H}}_{{{1}}}\left({0}\right)",
         _zero, lambda x, y: np.where(x == 0.0, 1.0, 0.0), math="-",
         series=lambda x, y: np.where(x < 0.0, 0.0, 1.0)),
    _row("logaddexp", "own", r"\ln\left(e^{{{0}}} + e^{{{1}}}\right)",
         lambda x, y: np.exp(x - np.logaddexp(x, y)), lambda x, y: np.exp(y - np.logaddexp(x, y)),
         math="-"),
    _row("remainder", "own", r"{0} \bmod {1}",
         lambda x, y: 1.0 + 0.0 * x, lambda x, y: -np.floor(x / y), math="-",
         series=lambda x, y: x - y * np.floor(x / y)),
    _row("floor_divide", "own", r"\left\lfloor \frac{{{0}}}{{{1}}} \right\rfloor",
         _zero, lambda x, y: 0.0 * y, math="-", series="steady"),
    _row("fmod", "fmod", r"\operatorname{{fmod}}\left({0}, {1}\right)",
         lambda x, y: 1.0 + 0.0 * x, lambda x, y: -np.trunc(x / y),
         series=lambda x, y: x - y * np.trunc(x / y)),
)  # fmt: skip

# every function that expressions know, by NumPy's name
FUNCTIONS = {row.name: row for row in _ROWS}
# those whose values are integers, one between two jumps
COUNTING = tuple(row.name for row in _ROWS if row.series == "steady")
# NumPy's names of the functions of Python's `math`
MATH = {name: row.name for row in _ROWS for name in row.math}
