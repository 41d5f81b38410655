"""Functions of time as polynomials, piece by piece: what machine code knows of them."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import chebyshev

PIECE_DEGREE = 5  # of the polynomials
PLACES = 1000  # places at which a function is evaluated, at least: a pulse between two is not seen
_NODES = chebyshev.chebpts1(PIECE_DEGREE + 1)
_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))  # values at the nodes -> coefficients
_BETWEEN = np.array([-1.0, *0.5 * (_NODES[1:] + _NODES[:-1]), 1.0])
_MISSED = 1e-13  # of a function's largest value
_JUMPED = 1e-10  # of it: polynomials that go through one function meet more closely
_BENT = 1e-8  # and so do their slopes, times the length of the shorter piece
_HALVINGS, _SHARP = 40, 24  # smooth functions that were seen at 1000 places need fewer


@dataclass(frozen=True, kw_only=True)
class SmoothPiece:
    """Polynomials that functions are for a while."""

    # time (s)
    start: float
    length: float
    powers: np.ndarray  # (count, 6): coefficients of powers of z, from -1 to 1 in the piece
    # whether they go through the functions: a piece too short to be halved has a jump in it
    fits: bool = True
    breaks: bool = False  # whether a function, or its slope, jumps in it or where it begins


def smooth_pieces(
    values: Callable[[float], np.ndarray], begin: float, end: float, count: int
) -> Iterator[SmoothPiece]:
    """Divide functions of time into pieces that polynomials of degree 5 go through."""
    # A piece is halved until it is a polynomial to rounding, also at those of 1000 places
    # that lie in it.
    if not count:
        yield SmoothPiece(start=begin, length=end - begin, powers=np.zeros((0, PIECE_DEGREE + 1)))
        return
    places = begin + (end - begin) * (np.arange(PLACES) + 0.5) / PLACES
    looks = np.array([values(float(t)) for t in places]).T
    scale = np.abs(looks).max(axis=1)
    left, before, sharp = [(begin, end, 0)], None, np.inf
    while left:
        a, b, halvings = left.pop()

        def at(z: np.ndarray, a: float = a, b: float = b) -> np.ndarray:
            return np.array([values(float(t)) for t in 0.5 * ((b - a) * z + (a + b))]).T

        at_nodes, between = at(_NODES), at(_BETWEEN)
        powers, scale = at_nodes @ _POWERS.T, np.maximum(scale, np.abs(at_nodes).max(axis=1))
        inside = slice(*np.searchsorted(places, (a, b)))
        z = np.concatenate((_BETWEEN, 2.0 * (places[inside] - a) / (b - a) - 1.0))
        guessed = powers @ np.vander(z, PIECE_DEGREE + 1, increasing=True).T
        missed = np.abs(guessed - np.concatenate((between, looks[:, inside]), axis=1))
        fits = bool(np.all(missed <= _MISSED * scale[:, None]))
        if not fits and halvings < _HALVINGS:
            middle = 0.5 * (a + b)
            sharp = middle if halvings > _SHARP else sharp
            left += [(middle, b, halvings + 1), (a, middle, halvings + 1)]
            continue
        piece = SmoothPiece(start=a, length=b - a, powers=powers, fits=fits)
        before = replace(
            piece,
            breaks=not fits or a == sharp or (before is not None and _apart(before, piece, scale)),
        )
        yield before


def _apart(one: SmoothPiece, other: SmoothPiece, scale: np.ndarray) -> bool:
    """Whether a function, or its slope, jumps from one piece to the next."""
    n = np.arange(PIECE_DEGREE + 1)
    jump = one.powers.sum(axis=1) - other.powers @ (-1.0) ** n
    slopes = one.powers @ n / one.length, other.powers @ (n * (-1.0) ** (n + 1)) / other.length
    bend = 2.0 * (slopes[0] - slopes[1]) * min(one.length, other.length)
    apart = (np.abs(jump) > _JUMPED * scale) | (np.abs(bend) > _BENT * scale)
    return not one.fits or bool(np.any(apart))
