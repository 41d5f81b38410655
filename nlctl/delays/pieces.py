"""Functions of time as polynomials, piece by piece: what machine code knows of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.polynomial import chebyshev

PIECE_DEGREE = 5  # of the polynomials
_NODES = chebyshev.chebpts1(PIECE_DEGREE + 1)
_POWERS = np.linalg.inv(np.vander(_NODES, increasing=True))  # values at the nodes -> coefficients
_BETWEEN = 0.5 * (_NODES[1:] + _NODES[:-1])
_MISSED = 1e-13  # of a function's largest value
_HALVINGS = 40


def smooth_pieces(
    values: Callable[[float], np.ndarray], begin: float, end: float, count: int
) -> Iterator[tuple[float, float, np.ndarray, bool]]:
    """Divide functions of time into pieces that polynomials of degree 5 go through.

    A piece is halved until it is a polynomial to rounding; where it never is, something jumps.

    Parameters
    ----------
    values : callable
        ``values(t)`` is an array of shape (count,).
    begin, end : float
        Times (s).
    count : int
        Number of functions.

    Yields
    ------
    tuple
        When a piece begins, its length, coefficients (count, 6) of powers of z, from -1 to 1 in the
        piece, and whether a function or one of its derivatives jumps there.
    """
    scale = np.zeros(count)
    left = [(begin, end, 0)]
    jumps = False
    while left:
        a, b, halvings = left.pop()

        def at(z: np.ndarray, a: float = a, b: float = b) -> np.ndarray:
            return np.array([values(float(t)) for t in 0.5 * ((b - a) * z + (a + b))]).T

        found, between = at(_NODES), at(_BETWEEN)
        powers = found @ _POWERS.T
        guessed = powers @ np.vander(_BETWEEN, PIECE_DEGREE + 1, increasing=True).T
        scale = np.maximum(scale, np.abs(found).max(axis=1))
        fits = np.all(np.abs(guessed - between) <= _MISSED * scale[:, None])
        if not fits and halvings < _HALVINGS:
            middle = 0.5 * (a + b)
            left += [(middle, b, halvings + 1), (a, middle, halvings + 1)]
            continue
        yield a, b - a, powers, jumps or not fits
        jumps = not fits
