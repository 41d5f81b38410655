"""Where all solutions from a box of initial states are over a time, enclosed."""

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field
from typing import Any, Literal

import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import integer, number, of_type
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.expressions.graph import Untraceable
from nlctl.native.tubes.series import SeriesCode, series_code
from nlctl.native.tubes.tube import LEAVES, MUST_LEAVE, REACHED, STUCK, Tube, tube_from
from nlctl.upstream.systems import System
from nlctl.wording import counted

from ...intervals.box import Box
from ...recheck.integers import exact_text, text_below
from .motion import motion_of

_THREADS = 2
_AT_ONCE = 16  # pieces that are begun before the clock is read
_CELLS = 200  # parts of the time for which there are bounds
_Status = Literal["proved", "refuted", "undecided"]
_NOT_DIVIDED = {  # why a piece is not proved that is too small to be divided
    LEAVES: "bounds of it leave at %s s, by less than they are wide: leave some room in within",
    STUCK: "no step is found beyond %s s: perhaps a solution ends there, or a rate jumps",
}


@described_record(made_by="reachable_set")
class ReachableSet:
    """Boxes that hold all solutions from `start`, over each part of the time."""

    names: tuple[str, ...]  # States.
    start: Box  # Initial states.
    within: Box | None  # Where the states shall stay.
    status: _Status  # Whether all solutions exist up to the horizon, and stay in `within`.
    reason: str  # What is missing, or where a solution leaves.
    times: np.ndarray = field(repr=False)  # (parts + 1,): Ends of the parts (s).
    # (parts, n): Bounds of the states over each part; infinite where nothing is known.
    low: np.ndarray = field(repr=False)
    high: np.ndarray = field(repr=False)
    end_low: np.ndarray = field(repr=False)  # (n,): Bounds at the horizon.
    end_high: np.ndarray = field(repr=False)
    # Initial states from which the solution surely leaves `within`.
    refuted: dict[str, float] | None
    pieces: int  # Into which the initial states were divided, all that were tried.
    steps: int  # Of all pieces.
    seconds: float
    arithmetic: str = "floats rounded outwards"  # What proved it.

    def bounds(self, name: str) -> tuple[float, float]:
        """Return proved bounds of a state over the whole time.

        Parameters
        ----------
        name : str
            A state.

        Returns
        -------
        tuple of float
            The least lower and the largest upper bound.

        Raises
        ------
        ParameterError
            If there is no such state.
        """
        if name not in self.names:
            raise ParameterError(f"bounds needs one of {', '.join(self.names)}, got {name!r}")
        i = self.names.index(name)
        return float(self.low[:, i].min()), float(self.high[:, i].max())

    def __str__(self) -> str:
        how = f"{counted(self.pieces, 'piece')}, {counted(self.steps, 'step')}"
        if self.status == "proved":
            sides = zip(self.within.names, self.within.cell, strict=True) if self.within else ()
            limits = [f"{name} in [{exact_text(a)}, {exact_text(b)}]" for name, (a, b) in sides]
            claim = f"stays in {', '.join(limits)}" if limits else "exists"
            return f"{claim} up to {exact_text(self.times[-1])} s: proved with {how}"
        return f"{self.status}: {self.reason}"


@as_annotated
def reachable_set(
    system: System,
    start: Box,
    horizon: float,
    *,
    within: Box | None = None,
    params: Mapping[str, Any] | None = None,
    max_pieces: int = 1_000,
    max_seconds: float | None = None,
) -> ReachableSet:
    """Enclose all solutions from a box of initial states, and prove that they stay in another one.

    Steps of Taylor's method in interval arithmetic prove that solutions exist and where they are.
    How states depend on initial states is a polynomial of degree four, with proved errors.  Where
    that does not suffice the initial states are divided, along the side that matters most.  A
    parameter that is only known between bounds is a state with the rate 0.

    Parameters
    ----------
    system : control.InputOutputSystem or callable
        A diagram, whose external inputs are 0; or ``function((x1, ..., xn)) -> (x1', ..., xn')``.
        Its rates must be smooth, and must not depend on time.
    start : Box
        Initial states, with a side for every state in their order; a side may be a single number.
    horizon : float
        How long (s).
    within : Box, optional
        Where the states shall stay; states that it does not name may be anywhere, and sides may be
        infinite.
    params : mapping, optional
        Overrides of a diagram.
    max_pieces : int, optional
        Pieces of the initial states that are tried.
    max_seconds : float, optional
        Time (s) after which no more of them are begun; without it `max_pieces` alone ends it.

    Returns
    -------
    ReachableSet
        Proved, refuted by a solution that surely leaves, or undecided: with the share of the
        initial states that is proved.

    Raises
    ------
    ParameterError
        If the rates cannot be read, have cases or kinks, or a box has other sides.
    CompileError
        If the diagram cannot be compiled.

    Examples
    --------
    A pendulum without friction, from around rest and between two speeds, does not turn over:

    >>> from nlctl.analysis.lyapunov import Box, reachable_set
    >>> found = reachable_set(
    ...     lambda x: (x[1], -np.sin(x[0])),
    ...     Box.of(x1=(-0.1, 0.1), x2=(1.0, 1.2)),
    ...     6.0,
    ...     within=Box.of(x1=(-2.0, 2.0)),
    ... )
    >>> print(found.status)
    proved
    """
    who = "reachable_set"
    start = of_type(who, "start", start, Box, "Box.of(x1=(-1, 1))")
    horizon, max_pieces = (
        number(who, "horizon", horizon),
        integer(who, "max_pieces", max_pieces, at_least=1),
    )
    if max_seconds is not None:
        max_seconds = number(who, "max_seconds", max_seconds, above=0)
    if not 0 < horizon < np.inf:
        raise ParameterError(f"reachable_set needs 0 < horizon < inf, got {horizon:g}")
    begun = time.perf_counter()
    motion = motion_of(who, system, start, params)
    try:
        code = series_code(motion.rates)
    except Untraceable as error:
        raise ParameterError(f"reachable_set needs rates that are smooth: {error}") from None
    search = _Search(code, _limits(motion.names, within), horizon)
    search.run(np.array(start.cell, dtype=float), max_pieces, begun + (max_seconds or np.inf))
    where = None
    if search.refuted is not None:
        where = dict(zip(motion.names, map(float, search.refuted), strict=True))
    return ReachableSet(
        names=motion.names, start=start, within=within, status=search.status, reason=search.reason,
        times=np.linspace(0.0, horizon, _CELLS + 1), low=search.low, high=search.high,
        end_low=search.end[:, 0], end_high=search.end[:, 1], refuted=where, pieces=search.pieces,
        steps=search.steps, seconds=time.perf_counter() - begun,
    )  # fmt: skip


def _limits(names: Sequence[str], within: object) -> np.ndarray:
    """Return where each state shall stay, shape (n, 2)."""
    limits = np.array([[-np.inf, np.inf]] * len(names))
    if within is None:
        return limits
    within = of_type("reachable_set", "within", within, Box, "Box.of(x1=(-1, 1))")
    for name, (low, high) in zip(within.names, within.cell, strict=True):
        if name not in names:
            raise ParameterError(
                f"reachable_set needs within with sides of {', '.join(names)}, got '{name}'"
            )
        limits[names.index(name)] = low, high
    return limits


class _Search:
    """Pieces of the initial states, divided until each is proved, one is refuted, or enough."""

    def __init__(self, code: SeriesCode, limits: np.ndarray, horizon: float) -> None:
        n = code.order
        self.code, self.limits, self.horizon = code, limits, horizon
        self.low, self.high = np.full((_CELLS, n), np.inf), np.full((_CELLS, n), -np.inf)
        self.end = np.stack([np.full(n, np.inf), np.full(n, -np.inf)], axis=1)
        self.pieces, self.steps, self.reason = 0, 0, ""
        self.proved = 0.0  # share of the initial states
        self.status: _Status = "proved"
        self.refuted: np.ndarray | None = None

    def run(self, box: np.ndarray, most: int, until: float) -> None:
        """Divide a box, a level after the other, up to a number of pieces and a time."""
        waiting = [(box, 1.0)]
        with ThreadPoolExecutor(_THREADS) as pool:
            while waiting and self.status == "proved":
                count = min(most - self.pieces, _AT_ONCE) if time.perf_counter() < until else 0
                now, waiting = waiting[:count], waiting[count:]
                if not now:
                    return self._give_up([piece for piece, _ in waiting])
                self.pieces += len(now)
                tubes = pool.map(self._tube, [piece for piece, _ in now])
                for (piece, share), tube in zip(now, tubes, strict=True):
                    if self.status == "refuted":
                        break
                    self.steps += tube.steps
                    halves = self._halves(piece, tube)
                    self.proved += 0.0 if halves else share
                    waiting += [(half, 0.5 * share) for half in halves]

    def _tube(self, box: np.ndarray) -> Tube:
        return tube_from(self.code, box, self.horizon, self.limits, cells=_CELLS)

    def _halves(self, piece: np.ndarray, tube: Tube) -> list[np.ndarray]:
        """Take a piece that is proved; return the halves of one that is not."""
        if tube.status == REACHED:
            self.low, self.high = np.minimum(self.low, tube.low), np.maximum(self.high, tube.high)
            self.end[:, 0] = np.minimum(self.end[:, 0], tube.end[:, 0])
            self.end[:, 1] = np.maximum(self.end[:, 1], tube.end[:, 1])
            return []
        middle = 0.5 * piece[:, 0] + 0.5 * piece[:, 1]
        one = self._tube(np.stack([middle, middle], axis=1)) if tube.status == LEAVES else tube
        if one.status == MUST_LEAVE:
            self.refuted, self.status = middle, "refuted"
            self.reason = f"a solution leaves at t <= {one.time:.6g} s"
            self._know_nothing()
            return []
        weight = np.where(np.isfinite(tube.weight), tube.weight, 0.0)
        weight = weight if weight.any() else piece[:, 1] - piece[:, 0]
        side = int(np.argmax(np.where(piece[:, 0] < piece[:, 1], weight + 1e-300, -1.0)))
        if not piece[side, 0] < middle[side] < piece[side, 1]:
            self._give_up([piece], _NOT_DIVIDED[tube.status] % f"{tube.time:.6g}")
            return []
        first, second = piece.copy(), piece.copy()
        first[side, 1] = second[side, 0] = middle[side]
        return [first, second]

    def _give_up(self, left: list[np.ndarray], why: str = "") -> None:
        """Say what is not proved: what would be divided further, or cannot be."""
        around = ", ".join(f"[{a:.6g}, {b:.6g}]" for a, b in left[0])
        share = text_below(100 * self.proved)
        further = (
            f"{share} % of the initial states are, the rest is divided further: raise max_pieces "
            "or max_seconds, or start from less"
        )
        after = counted(self.pieces, "piece")
        self.status = "undecided"
        self.reason = f"not proved from {around} after {after}; {why or further}"
        self._know_nothing()

    def _know_nothing(self) -> None:
        """Leave no bounds where not all pieces have any."""
        self.low[:], self.high[:] = -np.inf, np.inf
        self.end[:, 0], self.end[:, 1] = -np.inf, np.inf
