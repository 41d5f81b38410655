"""Functions of a run whose changes of sign are its events, or its end."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import DivergedError, ParameterError

EventFunction = Callable[..., Any]  # (t, x, u, params) -> a number
WatchedEvents = EventFunction | Sequence[EventFunction] | Mapping[str, EventFunction]

STOP = "stop_when"
_IS_NAN = " is NaN"


@dataclass(frozen=True, kw_only=True)
class Watched:
    """A function that is watched in a run."""

    name: str  # what a row of `Response.events` calls it
    # ``function(t, x, u, params)``, a number: of the time, the states, the inputs and the
    # overrides of the run
    function: Callable[..., Any]
    # which changes of its sign count: 1 rising, -1 falling, 0 both, as in SciPy
    direction: int = 0
    ends: bool = False  # whether the run ends there

    def counts(self, rises: bool) -> bool:
        """Whether a change of sign counts that rises, or falls."""
        return self.direction == 0 or (self.direction > 0) == rises

    def value(
        self, t: float, x: np.ndarray, u: np.ndarray, params: Mapping[str, Any] | None
    ) -> float:
        """Return its value."""
        with np.errstate(all="ignore"):  # what is NaN is reported
            found = np.asarray(self.function(t, x, u, dict(params or {})))
        if found.size != 1 or found.dtype.kind not in "bfiu":
            got = found.size if found.size != 1 else repr(found.reshape(-1)[0])
            raise ParameterError(f"event function '{self.name}' must return one number, got {got}")
        return float(found.reshape(-1)[0])


def nan_error(name: str, time: float) -> DivergedError:
    """Return the error of an event function that is NaN at a time (s)."""
    return DivergedError(f"event function '{name}' is NaN at t = {time:.6g} s", float(time))


def watched_functions(
    stop_when: EventFunction | None, events: WatchedEvents | None
) -> tuple[Watched, ...]:
    """Return what is watched in a run."""
    given: list[tuple[str, Any]] = [] if stop_when is None else [(STOP, stop_when)]
    if isinstance(events, Mapping):
        given += [(str(name), function) for name, function in events.items()]
    elif isinstance(events, Sequence):
        given += [(_name(f, k), f) for k, f in enumerate(events)]
    elif events is not None:
        given.append((_name(events, 0), events))
    for name, function in given:
        if not callable(function):
            raise ParameterError(
                f"event '{name}' must be a function (t, x, u, params), got {function!r}"
            )
    names = [name for name, _ in given]
    for name in names:
        if names.count(name) > 1:
            raise ParameterError(
                f"two events are called '{name}': give them by name, events={{'first': ...}}"
            )
    return tuple(_watched(name, function) for name, function in given)


def check_numbers(watched: Sequence[Watched], begin: Any, params: Any) -> None:
    """End a run before it begins whose functions are NaN at its start."""
    for one in watched:
        t, x, u = begin
        if np.isnan(one.value(t, x, u, params)):
            raise nan_error(one.name, begin[0])


def nan_watchers(watched: Sequence[Watched]) -> tuple[Watched, ...]:
    """Return functions that fall through 0, and end a run, where those of a run become NaN."""

    def sides(each: Watched) -> Callable[..., Any]:
        def side(t: object, x: object, u: object, params: object) -> Any:
            value = each.function(t, x, u, params)
            return np.where(value > 0.0, 1.0, np.where(value <= 0.0, 1.0, -1.0))

        return side

    return tuple(
        replace(each, name=each.name + _IS_NAN, function=sides(each), direction=-1, ends=True)
        for each in watched
    )


def watches_nan(name: str) -> bool:
    """Whether a function of that name is one of `nan_watchers`."""
    return name.endswith(_IS_NAN)


def not_a_number(happened: Iterable[tuple[float, str, str, str]]) -> DivergedError | None:
    """Return the error of a run that one of the `numbers` has ended, None if none has."""
    for time, block, which, _ in happened:
        if not block and watches_nan(which):
            return nan_error(which.removesuffix(_IS_NAN), time)
    return None


def check_moves(watched: Sequence[Watched], run: Any, params: Any) -> None:
    """Refuse functions that are 0 all the time."""
    parts = [np.atleast_1d(np.asarray(part, dtype=float)) for part in run]
    between = [0.5 * (part[..., 1:] + part[..., :-1]) for part in parts]
    for one in watched:
        values = (
            one.value(float(t), x, u, params)
            for t, x, u in (*_points(*parts), *_points(*between))
        )  # fmt: skip
        if all(value == 0.0 for value in values):
            raise ParameterError(
                f"event function '{one.name}' is 0 at all times of the run: an event is a change "
                "of its sign"
            )


def _points(times: np.ndarray, states: np.ndarray, inputs: np.ndarray) -> Iterator[tuple]:
    return zip(times, states.T, inputs.T, strict=True)


def _watched(name: str, function: Callable[..., Any]) -> Watched:
    terminal = getattr(function, "terminal", False)
    if not isinstance(terminal, (bool, np.bool_)) and terminal != 1:
        raise ParameterError(
            f"event '{name}' needs terminal = True or False, got {terminal!r}: a run ends at its "
            "first event, or does not end there"
        )
    ends = name == STOP or bool(terminal)
    direction = int(np.sign(getattr(function, "direction", 0)))
    return Watched(name=name, function=function, direction=direction, ends=ends)


def _name(function: object, k: int) -> str:
    name = getattr(function, "__name__", "")
    return name if name.isidentifier() else f"event {k + 1}"
