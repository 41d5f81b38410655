"""The initial states that a certificate is about: a box of all states, or a level set of V."""

import itertools
import re
from collections.abc import Iterator, Mapping
from typing import Any

import control as ct
import numpy as np

from nlctl.attributes import described_record
from nlctl.diagrams import initial_state, state_names
from nlctl.errors import ParameterError
from nlctl.names import find_name
from nlctl.params import as_numbers

from ...intervals.box import Box
from ...recheck.integers import exact_text

LEVEL = "V"
_CORNERS = 12  # of sides that have a width: beyond, corners are drawn
_INDEX = re.compile(r"\[\d+\]$")
Sides = tuple[tuple[float, float], ...]


@described_record
class Starts:
    """A set of initial states of a loop, at t = 0.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import Starts
    >>> print(Starts(names=("plant.x1", "plant.x2"), low=(-1.0, 0.0), high=(1.0, 0.0)))
    plant.x1(0) in [-1, 1], all other states 0, at t = 0
    """

    names: tuple[str, ...]  # All states of the loop, by path.
    low: tuple[float, ...]  # Ends of each; equal where a state starts at one value.
    high: tuple[float, ...]
    # If it is a number: only states with V(0) <= level belong to the set.
    level: float | None = None
    # States of a memory that every run makes consistent with its first input; no bound depends on
    # them.
    kept: tuple[str, ...] = ()

    @property
    def is_point(self) -> bool:
        """Whether it is one initial state."""
        return self.level is None and self.low == self.high

    def names_of(self, place: Any) -> list[str]:
        """Return the names of the states of a block.

        Parameters
        ----------
        place : Place
            Of the block in the loop, see `nlctl.diagrams.leaves`.

        Returns
        -------
        list of str
            In the block's own order.
        """
        return list(self.names[place.state_offset :][: place.system.nstates or 0])

    def sides(self, offset: int, count: int) -> Sides:
        """Return the ends of some states.

        Parameters
        ----------
        offset, count : int
            Number of the first, and how many.

        Returns
        -------
        tuple of pairs of floats
            Both ends of each.
        """
        ends = list(zip(self.low, self.high, strict=True))
        return tuple(ends[offset : offset + count])

    def __getitem__(self, name: str) -> tuple[float, float]:
        i = self.names.index(find_name("state", name, dict.fromkeys(self.names)))
        return self.low[i], self.high[i]

    def points(self, count: int = 12, *, seed: int = 0) -> list[np.ndarray]:
        """Return states of the box: its centre, corners, and some between.

        Parameters
        ----------
        count : int, optional
            Number of corners at most, if there are more, and of states between.
        seed : int, optional
            Of what is drawn.

        Returns
        -------
        list of ndarray of shape (n,)
            Sides without an end are taken at 0.
        """
        low, high = (np.where(np.isfinite(a), a, 0.0) for a in (self.low, self.high))
        wide, rng = np.flatnonzero(high > low), np.random.default_rng(seed)
        if not wide.size:
            return [low]
        few = 2**wide.size <= count if wide.size <= _CORNERS else False
        picks = (
            list(itertools.product((0.0, 1.0), repeat=wide.size))
            if few
            else rng.integers(0, 2, (count, wide.size)).astype(float)
        )
        points = [0.5 * low + 0.5 * high]
        for share in (*picks, *rng.uniform(size=(count, wide.size))):
            x = low.copy()
            x[wide] += np.asarray(share) * (high - low)[wide]
            points.append(np.clip(x, low, high))
        return points

    def __str__(self) -> str:
        sides = [text for group in self._groups() if (text := _side(*group))]
        zeros = [name for name, _, low, high in self._groups() if low == high == 0]
        rest = ["all other states 0" if sides else "all states 0"] if zeros else []
        if self.level is not None:  # what V bounds is not named, and not 0
            sides.insert(0, f"V(0) <= {exact_text(self.level)}")
            rest = [f"{name}(0) = 0" for name in zeros]
        kept = [f"any consistent memory of {', '.join(self.kept)}"] if self.kept else []
        return ", ".join([*sides, *rest, *kept, "at t = 0"])

    def _groups(self) -> Iterator[tuple[str, int, float, float]]:
        """Yield names with their ends; elements of a vector with equal ends together."""
        every = zip(self.names, self.low, self.high, strict=True)
        shown = [row for row in every if row[0] not in self.kept]
        key = lambda row: (_INDEX.sub("", row[0]), row[1], row[2])  # noqa: E731
        for (name, low, high), rows in itertools.groupby(shown, key):
            members = [row[0] for row in rows]
            short = name if len(members) > 1 else members[0]
            yield short, len(members), low, high


def _side(name: str, count: int, low: float, high: float) -> str:
    """Say where a state starts; nothing for 0, and for what the level bounds."""
    if low == high:
        return "" if low == 0 else f"{name}(0) = {exact_text(low)}"
    if not np.isfinite(high - low):
        return ""
    return f"{name}(0) in [{exact_text(low)}, {exact_text(high)}]" + (
        f"^{count}" if count > 1 else ""
    )


def read_starts(
    loop: ct.InterconnectedSystem,
    starts: object,
    *,
    free: tuple[str, ...] = (),
    kept: tuple[str, ...] = (),
) -> Starts:
    """Return the set of initial states that `certify` was asked for."""
    names, x0 = tuple(state_names(loop)), initial_state(loop)
    ends = {name: (float(x), float(x)) for name, x in zip(names, x0, strict=True)}
    given = dict(zip(starts.names, starts.cell, strict=True)) if isinstance(starts, Box) else starts
    if not isinstance(given, Mapping | None):
        raise ParameterError(
            "certify needs starts by state, {'plant.x1': (-1, 1)}, or a Box, got "
            f"{type(starts).__name__}"
        )
    named = dict(given or {})
    level = _level(named.pop(LEVEL), free) if LEVEL in named else None
    if level is not None:
        ends |= dict.fromkeys(free, (-np.inf, np.inf))
    for name, value in named.items():
        members, side = _members(name, names), _ends(name, value)
        ends |= dict.fromkeys(members, side)
    low, high = (tuple(ends[name][i] for name in names) for i in (0, 1))
    unnamed = tuple(k for k in kept if not any(k in _members(name, names) for name in named))
    return Starts(names=names, low=low, high=high, level=level, kept=unnamed)


def _level(value: object, free: tuple[str, ...]) -> float:
    if not free:
        raise ParameterError(
            "certify takes a level of V for loops with a reference model only: here V depends on "
            "constants that are proved with it; give the states, starts={'plant.x1': (-1, 1)}"
        )
    number = as_numbers(value)
    if number is None or number.ndim or not 0 <= number < np.inf:
        raise ParameterError(f"certify needs a finite level of V >= 0 in starts, got {value!r}")
    return float(number)


def _members(name: object, names: tuple[str, ...]) -> list[str]:
    """Return the state of that name, or all of a vector."""
    bases = dict.fromkeys(_INDEX.sub("", state) for state in names)
    choices = dict.fromkeys(names) | bases
    full = find_name("state", str(name), choices)
    return [full] if full in names else [s for s in names if _INDEX.sub("", s) == full]


def _ends(name: object, value: object) -> tuple[float, float]:
    numbers = as_numbers(value)
    size = None if numbers is None else numbers.size
    if numbers is None or size not in (1, 2) or not np.all(np.isfinite(numbers)):
        raise ParameterError(
            f"certify needs a finite number or (low, high) for '{name}' in starts, got {value!r}"
        )
    low, high = float(numbers.flat[0]), float(numbers.flat[-1])
    if not low <= high:
        raise ParameterError(f"certify needs low <= high for '{name}' in starts, got {value!r}")
    return low, high
