"""How delays vary in time, as polynomials that machine code evaluates."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.polynomial import polynomial

from ..errors import ParameterError
from .pieces import PIECE_DEGREE, SmoothPiece, smooth_pieces

_HALVINGS = 52  # of a run, to find a time in it
_APART = 1e-9  # of the largest value: what jumps by more over 40 halvings is not continuous


@dataclass(frozen=True, kw_only=True)
class Variation:
    """The variation V(t) of a delay over a run, piece by piece."""

    # (pieces,): times (s)
    starts: np.ndarray
    lengths: np.ndarray
    powers: np.ndarray  # (pieces, 6): coefficients (s) of powers of z, from -1 to 1 in each piece
    kinks: np.ndarray  # (kinks,): times (s) at which a derivative of V jumps

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return V (s) at times of the run."""
        k = np.maximum(np.searchsorted(self.starts, t, "right") - 1, 0)
        z = np.clip(2.0 * (t - self.starts[k]) / self.lengths[k] - 1.0, -1.0, 1.0)
        return polynomial.polyval(z, self.powers[k].T, tensor=False)

    def extreme(self, order: int, sign: int) -> tuple[float, float]:
        """Return where V, or its slope, is greatest or least, and how large it is there."""
        rows = self.powers
        if order:
            rows = rows[:, 1:] * np.arange(1, rows.shape[1]) * (2.0 / self.lengths)[:, None]
        rows = sign * rows
        ends = np.stack([rows @ np.power(z, np.arange(rows.shape[1])) for z in (-1.0, 1.0)])
        side, k = np.unravel_index(int(ends.argmax()), ends.shape)
        best = (self.starts[k] + side * self.lengths[k], ends[side, k])
        most = rows[:, 0] + np.abs(rows[:, 1:]).sum(axis=1)
        for k in np.flatnonzero(most > best[1]):  # where it may be larger between the ends
            roots = polynomial.polyroots(polynomial.polytrim(polynomial.polyder(rows[k])))
            for z in roots.real[(np.abs(roots.imag) < 1e-9) & (np.abs(roots.real) < 1)]:
                here = self.starts[k] + 0.5 * (z + 1) * self.lengths[k]
                best = max(best, (here, polynomial.polyval(z, rows[k])), key=lambda point: point[1])
        return float(best[0]), float(sign * best[1])


def variation(spec: Any, begin: float, end: float, path: str) -> Variation | None:
    """Return how the delay of a `TransportDelay` varies during a run, None where it does not."""
    if spec.varying is None:
        return None
    try:
        pieces = list(smooth_pieces(lambda t: np.array([spec.varied(t)]), begin, end, 1))
    except ParameterError as error:
        raise ParameterError(f"{error} (block '{path}')") from None
    whole = Variation(
        starts=np.array([piece.start for piece in pieces]),
        lengths=np.array([piece.length for piece in pieces]),
        powers=np.array([_powers(spec, piece) for piece in pieces]),
        kinks=np.array([piece.start for piece in pieces if piece.breaks]),
    )
    _check_continuous(whole, np.array([piece.fits for piece in pieces]), path)
    t, steepest = whole.extreme(1, 1)
    if not steepest < 1:
        raise ParameterError(
            "TransportDelay needs a delay that grows by less than 1 s per second, so that signals "
            f"arrive in the order in which they were sent, got {steepest:g} at t = {t:g} s "
            f"(block '{path}')"
        )
    return whole


def _powers(spec: Any, piece: SmoothPiece) -> np.ndarray:
    """Return the polynomial of a piece: from end to end where none goes through the function."""
    if piece.fits:
        return piece.powers[0]
    low, high = spec.varied(piece.start), spec.varied(piece.start + piece.length)
    return np.array([0.5 * (low + high), 0.5 * (high - low), *np.zeros(PIECE_DEGREE - 1)])


def _check_continuous(whole: Variation, fits: np.ndarray, path: str) -> None:
    """Refuse a jump from piece to piece, or in one that is too short to be halved."""
    low, high = whole.powers @ (-1.0) ** np.arange(PIECE_DEGREE + 1), whole.powers.sum(axis=1)
    inside = np.where(fits, low, high)
    before = np.concatenate((low[:1], high[:-1]))
    for after in (low, inside):
        apart = np.abs(after - before) > _APART * (1.0 + np.abs(whole.powers[:, 0]).max())
        if apart.any():
            k = int(apart.argmax())
            raise ParameterError(
                f"TransportDelay needs a continuous variation, got a jump from {before[k]:g} s to "
                f"{after[k]:g} s at t = {whole.starts[k]:g} s (block '{path}')"
            )


def arrivals(sent: np.ndarray, delay: float, varied: Variation | None) -> np.ndarray:
    """Return when leaves a delay what it is given at times (s); inf behind the run."""
    if varied is None:
        return sent + delay
    begin, end = varied.starts[0], varied.starts[-1] + varied.lengths[-1]
    low, high = np.full(sent.shape, begin), np.full(sent.shape, end)
    for _ in range(_HALVINGS):  # the delay grows by less than 1 s per second
        middle = 0.5 * (low + high)
        later = middle - (delay + varied.at(middle)) < sent
        low, high = np.where(later, middle, low), np.where(later, high, middle)
    return np.where(high < end, high, np.inf)


def history_breaks(spec: Any, earliest: float, begin: float) -> list[float]:
    """Return when signals before a run jump or bend, of those that a `TransportDelay` sees (s)."""
    if spec.history is None:
        return []
    pieces = smooth_pieces(spec.earlier, earliest, begin, len(spec.inputs))
    return [piece.start for piece in pieces if piece.breaks]


def check_positive(whole: Variation | None, delays: np.ndarray, path: str) -> None:
    """Refuse delays that a variation makes 0 or negative."""
    # Shapes: `delays` (lanes,).
    t, least = (0.0, 0.0) if whole is None else whole.extreme(0, -1)
    if not delays.min() + least > 0:
        raise ParameterError(
            f"TransportDelay needs delay + varying(t) > 0, got {delays.min() + least:g} s at "
            f"t = {t:g} s (block '{path}')"
        )


def variations_in(lines: Any) -> list[Variation | None]:
    """Return the variations that arrays of an integration hold, one for each line."""
    return [
        Variation(
            starts=lines.vary_t[:n, i], lengths=lines.vary_h[:n, i], powers=lines.vary[:n, i],
            kinks=lines.kinks[i][np.isfinite(lines.kinks[i])],
        )
        if n
        else None
        for i, n in enumerate(lines.varied.tolist())
    ]  # fmt: skip


def variation_table(variations: list[Variation | None]) -> dict[str, np.ndarray]:
    """Return the variations of all lines as arrays of an integration."""
    most = max([1, *(one.starts.size for one in variations if one)])
    kinks = max([1, *(one.kinks.size + 1 for one in variations if one)])
    table = {
        "varied": np.zeros(len(variations), dtype=np.int64),
        "vary_t": np.zeros((most, len(variations))),
        "vary_h": np.ones((most, len(variations))),
        "vary": np.zeros((most, len(variations), PIECE_DEGREE + 1)),
        "kinks": np.full((len(variations), kinks), np.inf),
    }
    for i, one in enumerate(variations):
        if one is not None:
            n = table["varied"][i] = one.starts.size
            table["vary_t"][:n, i], table["vary_h"][:n, i] = one.starts, one.lengths
            table["vary"][:n, i], table["kinks"][i, : one.kinks.size] = one.powers, one.kinks
    return table
