"""How delays vary in time, as polynomials that machine code evaluates."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from ..errors import ParameterError
from .pieces import PIECE_DEGREE, smooth_pieces

_APART = 1e-9  # of the largest value: what jumps by more over 40 halvings is not continuous


@dataclass(frozen=True, kw_only=True)
class Variation:
    """The variation V(t) of a delay over a run, piece by piece.

    Attributes
    ----------
    starts, lengths : ndarray of shape (pieces,)
        Times (s).
    powers : ndarray of shape (pieces, 6)
        Coefficients (s) of powers of z, from -1 to 1 in each piece.
    kinks : ndarray of shape (kinks,)
        Times (s) at which a derivative of V jumps.
    """

    starts: np.ndarray
    lengths: np.ndarray
    powers: np.ndarray
    kinks: np.ndarray

    def extremes(self, order: int) -> Iterator[tuple[float, float]]:
        """Yield times and values between which V, or its slope, lies in each piece.

        Parameters
        ----------
        order : {0, 1}
            V itself, or its slope.

        Yields
        ------
        tuple of float
            Time (s) and value: of both ends, and of what is stationary between them.
        """
        for start, length, powers in zip(self.starts, self.lengths, self.powers, strict=True):
            own = polynomial.polyder(powers, order) * (2.0 / length) ** order
            roots = polynomial.polyroots(polynomial.polytrim(polynomial.polyder(own)))
            inner = roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) < 1)]
            for z in (-1.0, 1.0, *inner):
                yield float(start + 0.5 * (z + 1) * length), float(polynomial.polyval(z, own))


def variation(spec: Any, begin: float, end: float) -> Variation | None:
    """Return how the delay of a `TransportDelay` varies during a run, None where it does not.

    Parameters
    ----------
    spec : TransportDelay
    begin, end : float
        First and last time of the run (s).

    Raises
    ------
    ParameterError
        If the variation jumps, or falls behind time itself: signals would overtake each other.
    """
    if spec.varying is None:
        return None
    found = list(smooth_pieces(lambda t: np.array([spec.varied(t)]), begin, end, 1))
    powers = np.array([own[0] for _, _, own, _ in found])
    starts, lengths = np.array([(a, h) for a, h, _, _ in found]).T
    rough = np.flatnonzero([jumps for *_, jumps in found])
    for k in rough:  # so short that it is a kink, or a jump
        ends = [spec.varied(starts[k]), spec.varied(starts[k] + lengths[k])]
        if abs(ends[1] - ends[0]) > _APART * (1.0 + np.abs(powers[:, 0]).max()):
            raise ParameterError(
                f"TransportDelay needs a continuous variation, got a jump from {ends[0]:g} s to "
                f"{ends[1]:g} s at t = {starts[k]:g} s"
            )
    short = [k for k in rough if not k or lengths[k] < 1e-9 * (end - begin)]
    for k in short:
        low, high = spec.varied(starts[k]), spec.varied(starts[k] + lengths[k])
        powers[k] = 0.0
        powers[k, :2] = 0.5 * (low + high), 0.5 * (high - low)
    made = Variation(starts=starts, lengths=lengths, powers=powers, kinks=starts[rough])
    steepest = max(made.extremes(1), key=lambda point: point[1])
    if not steepest[1] < 1:
        raise ParameterError(
            "TransportDelay needs a delay that grows by less than 1 s per second, so that signals "
            f"arrive in the order in which they were sent, got {steepest[1]:g} at t = "
            f"{steepest[0]:g} s"
        )
    return made


def checked_variation(
    spec: Any, begin: float, end: float, delays: np.ndarray, path: str
) -> Variation | None:
    """Return how a delay varies during a run, as `variation` does, if it is always positive.

    Parameters
    ----------
    spec : TransportDelay
    begin, end : float
        First and last time of the run (s).
    delays : ndarray of shape (lanes,)
        Constant parts (s).
    path : str
        Name of the block.

    Raises
    ------
    ParameterError
        With the block, the time and the value.
    """
    try:
        made = variation(spec, begin, end)
    except ParameterError as error:
        raise ParameterError(f"{error} (block '{path}')") from None
    if made is not None:
        t, least = min(made.extremes(0), key=lambda point: point[1])
        if not delays.min() + least > 0:
            raise ParameterError(
                f"TransportDelay needs delay + varying(t) > 0, got {delays.min() + least:g} s at "
                f"t = {t:g} s (block '{path}')"
            )
    return made


def variation_table(made: list[Variation | None]) -> dict[str, np.ndarray]:
    """Return the variations of all lines as arrays of an integration.

    Parameters
    ----------
    made : list of Variation or None
        One for each line.

    Returns
    -------
    dict
        ``varied`` (lines,): numbers of pieces, 0 where a delay is constant; ``vary_t`` and
        ``vary_h`` (lines, pieces), ``vary`` (lines, pieces, 6), ``kinks`` (lines, kinks), then inf.
    """
    most = max([1, *(one.starts.size for one in made if one)])
    kinks = max([1, *(one.kinks.size + 1 for one in made if one)])
    table = {
        "varied": np.zeros(len(made), dtype=np.int64),
        "vary_t": np.zeros((len(made), most)),
        "vary_h": np.ones((len(made), most)),
        "vary": np.zeros((len(made), most, PIECE_DEGREE + 1)),
        "kinks": np.full((len(made), kinks), np.inf),
    }
    for i, one in enumerate(made):
        if one is not None:
            n = table["varied"][i] = one.starts.size
            table["vary_t"][i, :n], table["vary_h"][i, :n] = one.starts, one.lengths
            table["vary"][i, :n], table["kinks"][i, : one.kinks.size] = one.powers, one.kinks
    return table
