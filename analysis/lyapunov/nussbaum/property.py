r"""Property (12) of Nussbaum functions, checked over a finite range.

.. math:: \limsup_{s \to \infty} \frac1s \int_0^s N = +\infty, \quad
          \liminf_{s \to \infty} \frac1s \int_0^s N = -\infty              \qquad (12)

No finite range can prove a limit: what is reported here as a type is *checked*.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicHermiteSpline
from scipy.optimize import brentq, minimize_scalar

from nlctl import functions
from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError

GainFunction = Callable[[float], float]
Antiderivative = Callable[[np.ndarray], np.ndarray]
DENSE = 4096
RANGES = tuple(9.0 * 2**i for i in range(8))  # ends of ranges that are tried for four lobes
GROWTH = 1.5  # what a quantity must gain from the middle of the range to its end to count


@dataclass(frozen=True, kw_only=True)
class Lobe:
    """The stretch between two neighbouring zeros of N."""

    # its ends: zeros of N, or ends of the range that was searched
    low: float
    high: float
    integral: float  # integral of N from `low` to `high`
    # where |N| is largest, and the value of N there
    place: float
    extremum: float

    @property
    def budget(self) -> float:
        """|int N| over the lobe: what V can lose or gain while zeta crosses it, per unit of k G."""
        return abs(self.integral)

    @property
    def sign(self) -> float:
        """Sign of N in the lobe."""
        return float(np.sign(self.extremum))


@described_record
class NussbaumProperty:
    """What a finite range shows of property (12)."""

    end: float  # The range is [0, end].
    lobes: tuple[Lobe, ...]  # In order from 0; the last one is cut off by `end`.
    # (1/s) int_0^s N at the end s of every whole lobe, where the mean is extreme or nearly so.
    means: tuple[float, ...]
    ratios: tuple[float, ...]  # Budget of each whole lobe over that of the one before.
    type_a: bool  # Checked: the means of both signs grow, as (12) wants.
    # Checked: so do the integrals of max(N, 0) and max(-N, 0), and at the end of each lobe the
    # integral of its sign over that of the other one. Gains that vary with time need this stronger
    # type (Z. Chen, Automatica 2019).
    type_b: bool

    def __str__(self) -> str:
        lines = [f"property (12), checked on [0, {self.end:g}]:"]
        for lobe, mean in zip(self.lobes, self.means, strict=False):
            lines.append(
                f"  lobe [{lobe.low:.6g}, {lobe.high:.6g}]: int N = {lobe.integral:.6g}, extremum "
                f"{lobe.extremum:.6g} at {lobe.place:.6g}, mean at its end {mean:.6g}"
            )
        for name, holds in (("A", self.type_a), ("B", self.type_b)):
            lines.append(f"  type {name}: {'checked' if holds else 'not seen on this range'}")
        return "\n".join(lines)


def antiderivative(N: GainFunction) -> Antiderivative:
    """Return int_0^s N as a function of arrays."""
    # The closed form for the paper's function, otherwise adaptive quadrature (scipy.integrate.quad)
    # between neighbouring arguments; of more than 4096 of them, between 4096 nodes, with N as the
    # slope of the interpolation.
    if N is functions.nussbaum:
        return functions.nussbaum_integral

    def integral(s: np.ndarray) -> np.ndarray:
        upper_ends = np.asarray(s, dtype=float)
        if upper_ends.size <= DENSE:
            points, place = np.unique(np.append(upper_ends, 0.0), return_inverse=True)
            return _cumulated(N, points)[place[:-1]].reshape(upper_ends.shape)
        nodes = np.union1d(np.linspace(upper_ends.min(), upper_ends.max(), DENSE), 0.0)
        slopes = np.array([float(N(z)) for z in nodes])
        return CubicHermiteSpline(nodes, _cumulated(N, nodes), slopes)(upper_ends)

    return integral


def _cumulated(N: GainFunction, points: np.ndarray) -> np.ndarray:
    """Return int_0^s N at increasing points, of which 0 is one."""
    pieces = [_quadrature(N, a, b) for a, b in itertools.pairwise(points)]
    total = np.concatenate([[0.0], np.cumsum(pieces)])
    return total - total[np.searchsorted(points, 0.0)]


def _quadrature(N: GainFunction, low: float, high: float) -> float:
    # The default absolute tolerance would be the whole integral of a small lobe, and a relative
    # one alone cannot be met where positive and negative parts cancel.
    size = (high - low) * max(abs(N(low + share * (high - low))) for share in (0.0, 0.3, 0.5, 1.0))
    return quad(N, low, high, epsabs=1e-12 * size, epsrel=1e-10, limit=200)[0]


def lobes(
    N: GainFunction = functions.nussbaum, low: float = 0.0, high: float = 9.0, *, step: float = 0.01
) -> tuple[Lobe, ...]:
    """Return the lobes of N on [low, high], with their budgets and extrema."""
    if not low < high:
        raise ParameterError(f"lobes needs low < high, got {low:g} and {high:g}")
    grid = np.linspace(low, high, max(int(np.ceil((high - low) / step)), 2) + 1)
    with np.errstate(over="ignore", invalid="ignore"):
        values = np.array([float(N(z)) for z in grid])
    if not np.all(np.isfinite(values)):
        raise ParameterError(
            f"the Nussbaum function is not finite at zeta = {grid[~np.isfinite(values)][0]:g}: "
            "choose a shorter range"
        )
    zeros = [
        root(N, a, b)
        for (a, b), (p, q) in zip(itertools.pairwise(grid), itertools.pairwise(values), strict=True)
        if np.sign(p) * np.sign(q) < 0
    ]
    zeros += [float(z) for z, v in zip(grid, values, strict=True) if v == 0]
    inner = [float(z) for z in np.sort(zeros) if low + 1e-9 < z < high - 1e-9]
    ends = [float(low), *inner, float(high)]
    return tuple(_lobe(N, a, b) for a, b in itertools.pairwise(ends))


def root(function: GainFunction, low: float, high: float) -> float:
    """Return the zero of a function between two points where its signs differ."""
    zero: Any = brentq(function, low, high, xtol=1e-14)
    return float(zero)


def _lobe(N: GainFunction, low: float, high: float) -> Lobe:
    grid = np.linspace(low, high, 65)
    i = int(np.argmax([abs(N(z)) for z in grid]))
    around = grid[max(i - 1, 0)], grid[min(i + 1, 64)]
    minimum: Any = minimize_scalar(
        lambda z: -abs(N(z)), bounds=around, method="bounded", options={"xatol": 1e-10}
    )
    place = max((float(minimum.x), float(grid[i])), key=lambda z: abs(N(z)))
    below, above = antiderivative(N)(np.array([low, high]))
    return Lobe(
        low=low, high=high, integral=float(above - below), place=place, extremum=float(N(place))
    )


def lobe_around(zeta: float, N: GainFunction = functions.nussbaum, *, reach: float = 4.0) -> Lobe:
    """Return the whole lobe that zeta lies in, searched within `reach` on both sides."""
    # At a zero of N it is the lobe above.
    near = lobes(N, zeta - reach, zeta + reach)
    inside = [lobe for lobe in near if lobe.low <= zeta + 1e-9 and zeta + 1e-9 < lobe.high]
    if not inside or inside[0] in (near[0], near[-1]):
        raise ParameterError(
            f"the Nussbaum function has no zeros on both sides of zeta = {zeta:g} within {reach:g}"
        )
    return inside[0]


@as_annotated
def nussbaum_property(
    N: GainFunction = functions.nussbaum, end: float | None = None
) -> NussbaumProperty:
    """Check property (12) on [0, end].

    A quantity counts as growing if it gains a factor of 1.5 from the middle lobe of its sign to
    the last one: means that stay bounded tend to a factor of 1, means that grow as s does to 2.

    Parameters
    ----------
    N : callable, optional
        Function of one number; the paper's by default.
    end : float, optional
        End of the range; it must hold four lobes at least.  By default [0, 9], and twice as long
        again and again until it holds four lobes or N is no longer finite, 1152 at most.  A
        function that has fewer zeros up to there has neither property on it.

    Raises
    ------
    ParameterError
        If a range is given that holds fewer than four lobes or on which N is not finite, or if N is
        not finite at 0.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import nussbaum_property
    >>> found = nussbaum_property()
    >>> [(lobe.low, lobe.high) for lobe in found.lobes[:3]]  # cos(pi zeta / 2) changes its sign
    [(0.0, 1.0), (1.0, 3.0), (3.0, 5.0)]
    """
    end, all_lobes, whole = _with_lobes(N) if end is None else _lobes_until(N, end)
    if len(whole) < 4:
        return NussbaumProperty(
            end=end, lobes=all_lobes, means=(), ratios=(), type_a=False, type_b=False
        )
    integrals = np.array([lobe.integral for lobe in whole])
    ends = np.array([lobe.high for lobe in whole])
    means = np.cumsum(integrals) / ends
    up, down = (np.cumsum(np.maximum(s * integrals, 0)) for s in (1, -1))
    rising, falling = integrals > 0, integrals < 0
    type_a = bool(_grows(means[rising]) and _grows(-means[falling]))
    with np.errstate(divide="ignore"):
        shares = (up / down)[rising], (down / up)[falling]
    parts = (up / ends)[rising], (down / ends)[falling]
    return NussbaumProperty(
        end=end,
        lobes=all_lobes,
        means=tuple(map(float, means)),
        ratios=tuple(map(float, np.abs(integrals[1:] / integrals[:-1]))),
        type_a=type_a,
        type_b=bool(type_a and all(_grows(part[np.isfinite(part)]) for part in (*shares, *parts))),
    )


def _lobes_until(N: GainFunction, end: float) -> tuple[float, tuple[Lobe, ...], tuple[Lobe, ...]]:
    """Return the end, the lobes on [0, end], and those that it does not cut off."""
    all_lobes, whole = _whole_lobes(N, end)
    if len(whole) < 4:
        raise ParameterError(
            f"property (12) needs four lobes of N at least, [0, {end:g}] holds {len(whole)}: "
            "choose a longer range"
        )
    return end, all_lobes, whole


def _with_lobes(N: GainFunction) -> tuple[float, tuple[Lobe, ...], tuple[Lobe, ...]]:
    """Return the same for a range that holds four lobes, or the longest on which N is finite."""
    end = RANGES[0]
    best = end, *_whole_lobes(N, _finite_until(N, end))
    for end in RANGES[1:]:
        if len(best[2]) >= 4 or _finite_until(N, best[0]) < best[0]:
            break
        best = end, *_whole_lobes(N, _finite_until(N, end))
    return best[1][-1].high, best[1], best[2]


def _finite_until(N: GainFunction, end: float) -> float:
    """Return the largest of `end`, 0.99 end, ... at which N is finite."""
    for share in np.linspace(1.0, 0.01, 100):
        with np.errstate(all="ignore"):
            if np.isfinite(N(share * end)):
                return float(share * end)
    raise ParameterError(f"the Nussbaum function is not finite at zeta = {0.01 * end:g}")


def _whole_lobes(N: GainFunction, end: float) -> tuple[tuple[Lobe, ...], tuple[Lobe, ...]]:
    all_lobes = lobes(N, 0.0, end, step=max(0.01, end / 4000))
    last = abs(N(end)) <= 1e-9 * abs(all_lobes[-1].extremum)
    return all_lobes, all_lobes if last else all_lobes[:-1]


def _grows(values: np.ndarray) -> bool:
    """Whether the last value is GROWTH times the middle one at least, and the latter positive."""
    if values.size < 2:
        return False
    middle = values[(values.size - 1) // 2]
    return bool(middle > 0 and values[-1] >= GROWTH * middle)
