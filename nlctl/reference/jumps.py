"""What jumps in a diagram: sampled blocks at clocks, memories, and blocks with guards."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..accumulation import PACE, jumps_end, limit_of
from ..blocks import Block, equation_now, memory_states
from ..diagrams import leaves
from ..errors import BlockError, DivergedError, ZenoError
from ..responses.watched import Watched, nan_error
from ..sampling.system import Happening, Sampled, happening
from ..upstream.control_internals import parts_now, rates_now
from ..wording import counted, numbered
from .known import Known

_MOST = 100  # jumps without progress of time
_STILL = 1e-11  # of a time: less is no progress
_AHEAD = 1e-9  # of a time: over which is seen whether a guard rises
_NOTHING = np.zeros(0)


class _Part(NamedTuple):
    """A block of the diagram, where it stands among them, and its states' places."""

    number: int
    path: str
    block: Any
    rows: np.ndarray


class Jumps:
    """The jumps of a diagram."""

    def __init__(
        self,
        system: Any,
        inputs: Callable[[float], Any],  # those of the diagram at a time
        conditions: Known,  # what changes its sign where conditions of the equations change
        watched: tuple[tuple[Watched, ...], Any],  # functions, and the overrides that they get
        leaving: Callable[[float], np.ndarray],  # what leaves transport delays at a time
    ) -> None:
        self.watched, self._overrides = watched
        self.system, self.inputs, self.conditions = system, inputs, conditions
        self.crossings, self._leaving = conditions.crossings, leaving
        self.happened: list[tuple[float, str, str, str]] = []
        parts, self.sampled = [], {}  # the sampled block of a state, by the state's place
        for number, leaf in enumerate(leaves(system)):
            rows = leaf.state_offset + np.arange(leaf.system.nstates or 0)
            if isinstance(leaf.system, Sampled):
                self.sampled.update(dict.fromkeys(rows.tolist(), leaf.system))
            elif isinstance(leaf.system, Block):
                path = leaf.path or leaf.system.name
                parts.append(_Part(number, path, leaf.system, rows))
        self._guarded = [one for one in parts if hasattr(one.block.spec, "guard")]
        self._remembering = [one for one in parts if memory_states(one.block.spec)]
        self._blocks = {
            "guard": self._guarded,
            "switching": [one for one in parts if hasattr(one.block.spec, "switching")],
            "commit": self._remembering,
        }
        places = [_memory_rows(one) for one in self._remembering]
        # places of the states that are memories, and of all that no equation moves
        self.memories = np.concatenate([np.zeros(0, dtype=int), *places])
        self.still = np.concatenate([self.memories, np.array(list(self.sampled), dtype=int)])
        self.kinds: tuple[int, int] = (0, 0)
        self.span = 0.0  # of the run
        self.switching = slice(0, 0)  # rows that blocks declare, of what `look` returns
        self.labels: list[tuple[str, str]] | None = None
        self._own = any(self._blocks.values())
        self.any = self._own or bool(self.watched or self.crossings)
        self._taken: dict[int, list[float]] = {}
        self._paces: dict[int, np.ndarray] = {}
        self._rising: dict[int, float] = {}

    def look(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return guards, switching functions and crossings, and what memories would become."""
        u, seen = self.inputs(t), [_NOTHING]
        values = dict.fromkeys(self._blocks, ())
        if self._own:
            parts = list(parts_now(self.system, t, x, u))
            values = {
                equation: _values(equation, own, t, parts) for equation, own in self._blocks.items()
            }
            seen = [row for equation in ("guard", "switching") for _, row in values[equation]]
        if self.crossings is not None:
            arriving = np.concatenate([u, self._leaving(t)])
            seen.append(np.asarray(self.crossings(t, x, arriving), dtype=float).reshape(-1))
        become = np.concatenate([_NOTHING, *(row for _, row in values["commit"])])
        if self.watched and become.size:
            x = x.copy()
            x[self.memories] = become
        seen.append(self.watched_at(t, x))
        if self.labels is None:
            self._label(values, sum(row.size for row in seen))
        return np.concatenate([*seen, become])

    def followed(self, t: np.ndarray, state: Callable[[float], np.ndarray]) -> float:
        """Return up to which part of a step functions that are flat elsewhere are followed.

        Shapes: `t` (k,): times from the begin to the end of the step.
        """
        if self.conditions.followed is None:
            return 1.0
        given = [np.concatenate([self.inputs(s), self._leaving(s)]) for s in t.tolist()]
        states = [state(s) for s in t.tolist()]
        places = (t - t[0]) / (t[-1] - t[0])
        return self.conditions.followed(places, t, np.array(states).T, np.array(given).T)

    def watched_at(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return the functions that the run watches; memories are what they have become."""
        u = self.inputs(t) if self.watched else _NOTHING
        return np.array([one.value(t, x, u, self._overrides) for one in self.watched])

    def _label(self, found: Mapping[str, Sequence[tuple[str, np.ndarray]]], signed: int) -> None:
        """Say whose is what `look` returns; its first `signed` rows change their signs."""
        own = {
            kind: [(path, name) for path, row in rows for name in numbered(kind, row.size)]
            for kind, rows in found.items()
        }
        watched = [("", one.name) for one in self.watched]
        before = [*own["guard"], *own["switching"]]
        conditions = self.conditions.labels or [("", "condition")] * (
            signed - len(before) - len(watched)
        )
        self.labels = [*before, *conditions, *watched, *own["commit"]]
        self.kinds = (len(own["guard"]), signed - len(own["guard"]))
        self.switching = slice(len(own["guard"]), len(before))

    def state_label(self, i: int) -> tuple[str, str]:
        """Return block and name of a state of the diagram."""
        owner = [leaf for leaf in leaves(self.system) if leaf.state_offset <= i][-1]
        name = str(owner.path or owner.system.name)
        return name, owner.system.state_labels[i - owner.state_offset]

    def label(self, number: int) -> tuple[str, str]:
        """Return block and name of a row of what `look` returns."""
        return self.labels[number] if self.labels else ("", "")

    def check_watched(self, t: float, seen: np.ndarray) -> None:
        """End a run in which a function that it watches is NaN."""
        signed = sum(self.kinds)
        for one, value in zip(self.watched, seen[signed - len(self.watched) : signed], strict=True):
            if np.isnan(value):
                raise nan_error(one.name, t)

    def ends(self, number: int, rises: bool) -> bool:
        """Whether a change of sign of a row ends the run."""
        one = self._watched(number)
        return one is not None and one.ends and one.counts(rises)

    def rises(self, number: int, positive: bool, seen: np.ndarray) -> bool:
        """Whether what switches rises where its function becomes positive, or negative."""
        k = number - self.switching.stop
        partners = self.conditions.partners
        partner = partners[k] if 0 <= k < len(partners) else 0
        return positive != (partner != 0 and partner * seen[number + partner] > 0.0)

    def counts(self, number: int, rises: bool) -> bool:
        """Whether a change of sign of a row is an event."""
        one = self._watched(number)
        return one is None or one.counts(rises)

    def _watched(self, number: int) -> Watched | None:
        k = number - (sum(self.kinds) - len(self.watched))
        return self.watched[k] if 0 <= k < len(self.watched) else None

    def committed(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return a state whose memories are what they become at an instant."""
        if self.memories.size:
            x = x.copy()
            x[self.memories] = self.look(t, x)[sum(self.kinds) :]
        return x

    def at(
        self, t: float, x: np.ndarray, what: Happening, sides: object
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the state after all that happens at an instant, and what guards are >= 0 then.

        Clocks first, then memories; then all guards that have fallen jump, from the values before,
        and so on until none falls.

        Shapes: `x` (nstates,).
        """
        if what:
            with happening(what):
                after = rates_now(self.system, t, x, self.inputs(t))
            rows = [i for i, block in self.sampled.items() if block.acts(what)]
            x = x.copy()
            x[rows] = after[rows]
        for _ in range(_MOST + 1):
            for _ in range(self.memories.size + 1):  # one that commits may move the next
                before, x = x, self.committed(t, x)
                if np.array_equal(before, x, equal_nan=True):
                    break
            now = self._sides(t, x)
            fallen = np.zeros(now.size, dtype=bool) if sides is None else sides & ~now
            sides = now
            if not fallen.any():
                return x, sides
            x = self._reset(t, x, fallen)
        raise self._zeno(int(np.argmax(fallen)), t)

    def _sides(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return which guards are >= 0."""
        if not self._guarded:
            return np.zeros(0, dtype=bool)
        values = self.look(t, x)[: self.kinds[0]]
        for i in np.flatnonzero(np.isnan(values))[:1]:
            raise DivergedError(
                f"block '{self.label(i)[0]}' has a guard that is NaN at t = {t:.6g} s", float(t)
            )
        return values >= 0.0

    def _reset(self, t: float, x: np.ndarray, fallen: np.ndarray) -> np.ndarray:
        """Return the state after the resets of all blocks with a guard that has fallen."""
        parts = list(parts_now(self.system, t, x, self.inputs(t)))
        after, first = x.copy(), 0
        for one in self._guarded:
            count = sum(self.label(i)[0] == one.path for i in range(self.kinds[0]))
            if fallen[first : first + count].any():
                (_, row), *_ = _values("reset", [one], t, parts)
                if row.size != one.rows.size:
                    raise BlockError(
                        f"{type(one.block.spec).__name__} (block '{one.path}') returns "
                        f"{counted(row.size, 'value')} from reset, needs {one.rows.size}: all "
                        f"states after the jump, {', '.join(one.block.state_labels)}"
                    )
                after[one.rows] = row
            first += count
        for i in np.flatnonzero(fallen).tolist():
            self.happened.append((float(t), *self.label(i), "falling"))
            self._taken.setdefault(i, []).append(t)
            self._check_progress(i, t)
        self._rising = self._rises(t, after, fallen)
        return after

    def _rises(self, t: float, x: np.ndarray, fallen: np.ndarray) -> dict[int, float]:
        """Return guards that have fallen and rise behind the jump, and their values there."""
        now, ahead = self.look(t, x), max(abs(t) * _AHEAD, _AHEAD)
        rates = rates_now(self.system, t, x, self.inputs(t))
        rates[self.still] = 0.0
        later = self.look(t + ahead, x + ahead * rates)
        up = fallen & (now[: fallen.size] < 0.0) & (later[: fallen.size] > now[: fallen.size])
        return {int(i): float(now[i]) for i in np.flatnonzero(up)}

    def check_resolved(self, t: float, seen: np.ndarray) -> None:
        """Refuse a guard that should have risen behind its jump and has not: it is Zeno's end.

        Jumps have followed each other faster than the tolerance can tell them apart.
        """
        for i, start in list(self._rising.items()):
            if seen[i] >= start:
                del self._rising[i]
            else:
                raise self._zeno(i, t)

    def _check_progress(self, i: int, t: float) -> None:
        """End a run whose jumps accumulate, or are without progress of time."""
        times = self._taken[i]
        still = _STILL * max(abs(t), self.span)
        if len(times) > _MOST and t - times[-_MOST - 1] <= still:
            raise self._zeno(i, t)
        if jumps_end(self._paces.setdefault(i, np.zeros(PACE)), t):
            raise self._zeno(i, t)

    def _zeno(self, i: int, t: float) -> ZenoError:
        """Return the error of jumps that accumulate, with the time at which they do."""
        return ZenoError.of(self.label(i)[0], limit_of(self._taken.get(i, [t]), t))


def _memory_rows(one: _Part) -> np.ndarray:
    """Return the places of a block's memories among all states."""
    names = list(one.block.spec.states)
    return one.rows[[names.index(name) for name in memory_states(one.block.spec)]]


def _values(
    what: str, parts: list[_Part], t: float, signals: list[Any]
) -> list[tuple[str, np.ndarray]]:
    """Return what an equation of each block says, with the block's path."""
    found = []
    for one in parts:
        _, x, u = signals[one.number]
        found.append((one.path, equation_now(one.block, what, t, x, u)))
    return found
