"""One driver: simulate to the next stop, jump, go on."""

import bisect
import math
import warnings
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from typing import Any

import numpy as np
from scipy.integrate import RK45, OdeSolver

from ..errors import ChatteringError, DivergedError
from ..sampling.system import happening
from ..supplied import supplying
from ..upstream.control_internals import outputs_now, parts_now, rates_now
from ..upstream.systems import System
from .crossings import Event, first_event
from .jumps import Jumps
from .looks import FEW_PLACES, STEP_PLACES
from .past import Past
from .rough import MOST_STEPS, ROUGH, next_to, rough_state
from .solved import solves
from .still import Across, Still
from .stops import TIME_ROUNDING, Stops
from .switches import Switches

_STANDSTILL = 200  # steps in a row that do not advance the time
_ASIDE = 1e-3  # part of a run: how far behind its end what leaves a delay there is read
_PLACES = 1024  # of a run: a loop at rest is looked at in as many
_SHORT = 0.25  # of the longest step so far: an integrator that has begun again
_WIDER = 16.0  # than the bound of steps: where they may be so long it begins again
_FIRST = 1e-9  # of a run: the first step of an explicit method where another one has failed
_ROUNDED, _ULPS = 1.0 + 1e-9, 4.0  # times a step, and of its time: what is as long
_ACROSS = 1e-13  # of a run, and of its time: what is crossed by rounding
_SHORTEST = 1e-7  # of a run: shorter steps are taken whatever they lead through
_STUCK, _SAMES = 1e-5, 40  # part of a run: shorter steps, so many of which are alike
_LOOKED_AT = 2000  # steps, after each of which it is asked whether rates are noise
_MOST_OF, _PARTED = 0.5, 0.1  # of a flow: a step that is looked at; of that: what follows if wrong
_REVERSES = 0.01  # part of the tolerance: a memory that goes back by less does not reverse


def diverged(system: System, time: float) -> DivergedError:
    """Return the error of a run that has no finite state from a time on."""
    return DivergedError(
        f"'{system.name}' diverged: no finite state after t = {time:.6g} s; "
        "simulate up to then to see how",
        float(time),
    )


class Driver:
    """A run in python-control's equations and one of SciPy's integrators."""

    def __init__(
        self,
        system: System,  # in continuous time, with the parameters of the run
        inputs: Callable[[float], np.ndarray],  # ``inputs(t)``: those of the diagram
        wanted: np.ndarray | None,  # times of the response (s); None for the integrator's own steps
        *, stops: Stops, jumps: Jumps, known: Past,
        method: type,  # a `scipy.integrate.OdeSolver`
        settings: Mapping[str, Any],  # its arguments: rtol, atol, max_step and so on
        progress: Callable[[float], object] | None = None,  # of t, after every accepted step
    ) -> None:  # fmt: skip
        self.system, self.inputs, self.wanted = system, inputs, wanted
        self.stops, self.jumps, self.known = stops, jumps, known
        self.method = method if system.nstates else Still
        self.settings, self.progress = settings, progress
        # of each time of the response that was reached: time, outputs, states
        self.rows: list[tuple[float, np.ndarray, np.ndarray]] = []
        self._held, self.tried = np.zeros(0), None  # for which time and states rates were asked
        self.happened = jumps.happened  # time (s), block, which and direction of each event

    def run(self, begin: float, end: float, x: np.ndarray) -> None:
        """Go from the first time to the last; `rows` grow on the way."""
        self.reached, self._span = begin, end - begin  # the time of the last accepted step (s)
        self.jumps.span = self._span
        self._looked_at, self._end = begin, end
        tolerances = self.settings["rtol"], self.settings["atol"]
        self._switches = Switches(self.system.name, self.jumps.label, (begin, end), tolerances)
        t, sides, what = begin, None, self.stops.due.get(begin, frozenset())
        with ExitStack() as stack:
            stack.enter_context(supplying(self.known.lines))
            stack.enter_context(happening())
            stack.enter_context(warnings.catch_warnings())
            warnings.filterwarnings("ignore", "lsoda: ", UserWarning)  # a step says so as well
            while True:
                stop = (
                    self.known.after(t, self.stops.after(t))
                    if t < end
                    else t + _ASIDE * (t - begin)
                )
                self.known.step = (t, stop)
                resumes = self.jumps.committed(t, x) if t >= end and what else None
                x, sides = self.jumps.at(t, x, what, sides)
                self._note_jumps(t, x)
                self._record(t, x, ends=self._ended)
                if self._ended:
                    return
                if t >= end:
                    if resumes is not None:  # a run that resumes there takes the sample
                        self.rows[-1] = (*self.rows[-1][:2], resumes)
                    return
                begun = t
                t, x, sides, pieces, event = self._flow(t, x, stop, sides)
                if self._ended:
                    self._record(t, x, ends=True)
                    return
                if t in self.stops.changes:
                    self.happened += self.stops.switched(t)
                self._keep((begun, t), pieces, event)
                what = self.stops.due.get(t, frozenset())

    def _flow(self, t: float, x: np.ndarray, stop: float, sides: np.ndarray) -> Any:
        """Integrate to a stop, or to where something happens before it."""
        self._begun, self._held, self._last = t, x, self.stops.before(stop)
        rounding = TIME_ROUNDING * max(abs(t), abs(stop), self._span)
        if stop - t <= rounding:  # only that sets them apart
            self._record_within(stop, lambda _: x, closes=True)
            return stop, x + (stop - t) * self._rates(t, x), sides, [(t, lambda _: x)], None
        seen = self._first_seen(t, x)
        self.jumps.check_watched(t, seen)
        return self._integrated(stop, sides, seen)

    def _integrated(self, stop: float, sides: np.ndarray, seen: np.ndarray) -> Any:
        """Integrate from where a flow has begun, step by step, each of which is right."""
        limits, pieces = self._bounded(self._begun, stop), []
        solver: Any = self._rounded(self._begun, stop)
        if not self._leaves(solver):
            solver = self.method(self._rates, self._begun, self._held, stop, **limits)
        while True:
            solver, limits, state, event = self._right_step(solver, stop, limits, seen)
            if event:
                self._note(event, seen, state)
            until = event.time if event else float(solver.t)
            closes = event is not None or until >= stop
            self._watch(until, state(until))
            self._record_within(until, state, closes)
            pieces.append((float(solver.t_old), state))
            x = self._held = self.jumps.committed(min(until, self._last), state(until))
            if event:
                seen = self.jumps.look(event.before, state(event.before))
            elif self.jumps.any:
                seen = self.jumps.look(min(until, self._last), x)
            if sides.size:
                sides = seen[: sides.size] >= 0.0
                self.jumps.check_resolved(until, seen)
            if closes:
                own = self.jumps.switching
                self._came[own] = 0.0 if event else np.sign(seen[own])
                return until, x, sides, pieces, event
            if solver.status == "finished":
                solver = self.method(self._rates, until, x, stop, **limits)

    def _right_step(self, solver: Any, stop: float, limits: Any, seen: np.ndarray) -> Any:
        """Make the next step, again until it is right; return the event in it as well."""
        while True:
            message = solver.step()
            if message is not None or self._is_stuck(solver):
                solver = self._begun_again(solver, stop, limits, message)
                continue
            if solver.t == solver.t_old:  # rates may jump by too much for any step that meets that
                over = self._rounded(float(solver.t), stop)
                solver = over if over and self._event(over, self._solution(over), seen) else solver
            state, event = self._solution(solver), None
            allowed = self._allowed(solver, state, limits["max_step"], stop)
            if not allowed:
                event = self._event(solver, state, seen)
                # What is measured may have a kink there: it is smooth up to that.
                allowed = self._led(solver.t_old, event.before, state) if event else 0.0
            if allowed:
                limits = limits | {"max_step": allowed}
                short = self._shortened(solver, stop, limits)
                solver = self.method(self._rates, solver.t_old, self._held, stop, **short)
                continue
            self._note_left(float(solver.t_old), float(solver.t), state)
            if event and not self._is_solution(float(solver.t_old), event.before, state):
                solver = self.method(self._rates, solver.t_old, self._held, event.before, **limits)
                continue
            return solver, limits, state, event

    def _is_solution(self, begin: float, end: float, state: Callable[..., Any]) -> bool:
        """Whether a step's polynomial solves the equations up to an event in it, or its end."""
        if not end - begin > _SHORTEST * self._span:
            return True
        moves = np.ones(self._held.size, dtype=bool)
        moves[self.jumps.still] = False
        tolerances = self.settings["rtol"], self.settings["atol"]
        return solves(self._rates, (begin, self._held), (end, state), moves, tolerances)

    def _begun_again(self, solver: Any, stop: float, bounded: Any, message: str | None) -> Any:
        """Return an integrator that begins where one has failed, explicit where that fails too.

        Without a message, at the last step of one that is stuck.
        """
        if message is None:
            return self.method(self._rates, solver.t_old, self._held, stop, **bounded)
        t, failed = float(solver.t), self._failed
        if isinstance(solver, RK45) or not np.all(np.isfinite(self._rates(t, self._held))):
            raise RuntimeError(f"solve_ivp failed: {message}")
        self._failed = t
        if t != failed:
            return self.method(self._rates, t, self._held, stop, **bounded)
        own = {name: bounded[name] for name in ("rtol", "atol", "max_step")}
        first = min(_FIRST * self._span, own["max_step"], stop - t)
        return RK45(self._rates, t, self._held, stop, first_step=first, **own)

    def _rounded(self, t: float, stop: float) -> Across | None:
        """Return a step over what is within rounding of a time, None where a stop is so near."""
        end = t + _ACROSS * max(abs(t), self._span)
        if not self.jumps.any or not end < stop:
            return None
        return Across(t, self._held, self._rates(t, self._held), end)

    def _leaves(self, over: Across | None) -> bool:
        """Whether a step by rounding leaves an equal place, to where no step has come from."""
        # On the other one, where an integrator may go back to, rates may lead away as well.
        if over is None or not (waits := self._came == 0.0).any():
            return False
        waits[self.jumps.switching] = False
        return bool(np.any(waits & (self._signs(self._looked(over.t, over.y)) != 0.0)))

    def _is_stuck(self, solver: Any) -> bool:
        """Whether an integrator takes the same short step over and over again.

        LSODA does, where it has seen a jump in its first step: it keeps the slope of that jump for
        that of the rates.  Begun again it knows nothing of it.
        """
        length = float(solver.t - solver.t_old)
        is_same = length < _STUCK * self._span and abs(length - self._same) < 1e-9 * length
        self._same, self._sames = length, (self._sames + 1) if is_same else 0
        if self._sames < _SAMES:
            return False
        self._sames = 0
        return True

    def _shortened(self, solver: Any, stop: float, bounded: dict[str, Any]) -> dict[str, Any]:
        """Return the arguments of an integrator that begins a step again, which was too long."""
        begin = float(solver.t_old)
        if begin != self._narrow or not isinstance(solver, OdeSolver):
            return bounded
        return bounded | {"first_step": min(bounded["max_step"], stop - begin)}

    def _first_seen(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return what is seen where a flow begins; what is exactly 0 has the side it comes from."""
        seen = self.jumps.look(t, x) if self.jumps.any else np.zeros(0)
        sides = self._signs(seen)
        came = self._came if self._came.size else np.zeros(sides.size)
        self._came = np.where(sides == 0.0, came, sides)
        own = seen[: sides.size]
        own[:] = np.where(own == 0.0, came * np.finfo(float).tiny, own)
        return seen

    def _allowed(self, solver: Any, state: Callable[..., Any], bound: float, stop: float) -> float:
        """Return how long the step just made should have been, 0 if it is right.

        One from which a function of t alone moves soon is shorter; behind that they grow again.
        """
        longest = self._longest_step(float(solver.t_old), stop)
        length = float(solver.t - solver.t_old)
        may_grow = longest > _WIDER * bound and bound != self._span / _PLACES
        may_grow &= solver.t_old != self._narrow  # a longer step from there has been refused
        rounded = _ROUNDED * longest + _ULPS * np.spacing(abs(float(solver.t)))
        if length > rounded:
            self._narrow = float(solver.t_old)
            return longest
        if may_grow and length > 0.5 * bound:
            return longest
        if led := self._led(solver.t_old, solver.t, state):
            return led
        if self._slept(solver, state):
            return self._span / _PLACES
        # One that is most of the way from stop to stop has been seen at its ends alone.
        if length > _MOST_OF * (stop - self._begun) and not self._is_solution(
            float(solver.t_old), float(solver.t), state
        ):
            self._narrow = float(solver.t_old)
            return _PARTED * length
        return 0.0

    def _led(self, begin: float, end: float, state: Callable[..., Any]) -> float:
        """Return how long a step should have been by what it leads through, 0 if it is right."""
        length, shortest = float(end - begin), _SHORTEST * self._span
        if not length > shortest:
            return 0.0
        part = self.jumps.followed(begin + STEP_PLACES.at * length, state)
        if part == 1.0 or not part * length > shortest:
            return 0.0
        self._narrow = float(begin)
        return part * length

    def _slept(self, solver: Any, state: Callable[[float], np.ndarray]) -> bool:
        """Whether the step just made, from rest, has passed something that moves the state."""
        begin, end, space = float(solver.t_old), float(solver.t), self._span / _PLACES
        allowed = self.settings["atol"] + self.settings["rtol"] * np.abs(solver.y)
        if end - begin <= 1.01 * space or np.any(np.abs(state(end) - self._held) > allowed):
            return False
        places = np.linspace(begin, end, math.ceil((end - begin) / space) + 1)[1:-1].tolist()
        return any(np.any(space * np.abs(self._rates(t, state(t))) > allowed) for t in places)

    def _rates(self, t: float, y: np.ndarray) -> np.ndarray:
        """Return derivatives: of the side of the next stop that the run comes from."""
        x = np.array(y, dtype=float)
        x[self.jumps.still] = self._held[self.jumps.still]
        t = min(float(t), self._last)
        self.tried = (t, x)
        dx = np.broadcast_to(rates_now(self.system, t, x, self.inputs(t)), x.shape).astype(float)
        dx[self.jumps.memories] = 0.0
        return dx

    def _bounded(self, t: float, stop: float) -> dict[str, Any]:
        """Return the integrator's arguments between two stops."""
        found = {**self.settings, "max_step": self._longest_step(t, stop)}
        if found.get("first_step"):
            found["first_step"] = min(found["first_step"], stop - t)
        return found

    def _longest_step(self, t: float, stop: float) -> float:
        """Return how long a step from a time on may be, by samples, functions of t and delays."""
        known = self.known.longest_step(t)
        return min(self.settings["max_step"], self.stops.space(t), known)

    def _solution(self, solver: Any) -> Callable[[float], np.ndarray]:
        """Return the state within the step just made, with what stands still as it is held."""
        found, held, still = solver.dense_output(), self._held, self.jumps.still
        begin, end, last = float(solver.t_old), float(solver.t), np.array(solver.y, dtype=float)

        def state(t: float) -> np.ndarray:
            if t == begin:  # exactly the state, not its interpolant
                return held.copy()
            x = last.copy() if t == end else np.array(found(t), dtype=float)
            x[still] = held[still]
            return x

        return state

    def _event(self, solver: Any, state: Any, seen: np.ndarray) -> Event | None:
        """Return what happens first within the step just made, if anything does."""
        if not self.jumps.any or not solver.t > solver.t_old:
            return None
        rtol, atol = np.max(self.settings["rtol"]), np.min(self.settings["atol"])
        length = solver.t - solver.t_old
        self._longest = max(self._longest, length)
        return first_event(
            lambda t, rounded=1.0: self._looked(t, rounded * state(t)),
            (float(solver.t_old), float(solver.t)),
            seen,
            self.jumps.kinds,
            lambda size: _REVERSES * (atol + rtol * size),
            FEW_PLACES if length < _SHORT * self._longest else STEP_PLACES,
        )

    def _looked(self, t: float, x: np.ndarray) -> np.ndarray:
        """Return what is seen, on the side of the next stop that the run comes from."""
        return self.jumps.look(min(t, self._last), x)

    def _note(self, event: Event, seen: np.ndarray, state: Callable[..., Any]) -> None:
        """Note what happens, and all switching functions and conditions that change their signs."""
        x = state(event.time)
        if event.number >= self.jumps.kinds[0]:  # jumps of guards have a test of their own
            self._switches.note(event.number, event.time)
        after = self._looked(event.time, x)
        self.jumps.check_watched(event.time, after)
        came, sides, own = self._came, self._signs(after), self.jumps.switching
        came[own] = np.sign(seen[own])  # 0 as long as a memory is carried along
        reached = (sides == 0.0) & (np.arange(sides.size) == event.number)  # by rounding
        reached[own] = sides[own] == 0.0
        sides = np.where(reached, -came, sides)
        for i in np.flatnonzero(came * sides < 0.0).tolist():
            self._note_change(i, event.time, bool(sides[i] > 0.0), x)
        self._came = np.where(sides == 0.0, came, sides)

    def _signs(self, seen: np.ndarray) -> np.ndarray:
        """Return the sides of switching functions, conditions and what the run watches."""
        guards, others = self.jumps.kinds
        sides = np.nan_to_num(np.sign(seen[: guards + others]))
        sides[:guards] = 1.0
        return sides

    def _note_left(self, t: float, until: float, state: Callable[..., Any]) -> None:
        """Note what leaves the 0 at which it has been since the run began; no run ends by that."""
        waits = self._came == 0.0
        waits[self.jumps.switching] = False
        if not waits.any():
            return
        rounded = _ACROSS * max(abs(t), self._span)
        s = min(t + max(STEP_PLACES.at[1] * (until - t), rounded), until)
        sides, x = self._signs(self._looked(s, state(s))), state(t)
        for i in np.flatnonzero(waits & (sides != 0.0)).tolist():
            self._note_first(i, t, bool(sides[i] > 0.0), x)
            self._came[i] = sides[i]

    def _note_first(self, i: int, t: float, rises: bool, x: np.ndarray) -> None:
        """Note what leaves the 0 at which it has been since the run began, which ends no run."""
        if not self.jumps.ends(i, rises):
            self._note_change(i, t, rises, x)

    def _note_jumps(self, t: float, x: np.ndarray) -> None:
        """Note the functions that the run watches whose signs have jumped at an instant.

        One that has jumped to 0 is noted where it leaves that for the other side.
        """
        if not self.jumps.watched or not self._came.size:
            return
        right = self.jumps.watched_at(t, x)
        first = self._came.size - right.size
        came = self._came[first:]
        leaves = (came * np.sign(right) < 0.0) | ((came == 0.0) & (np.abs(right) > 0.0))
        for k in np.flatnonzero(leaves).tolist():
            notes = self._note_first if came[k] == 0.0 else self._note_change
            notes(first + k, t, bool(right[k] > 0.0), x)
            came[k] = np.sign(right[k])

    def _note_change(self, i: int, t: float, rises: bool, x: np.ndarray) -> None:
        """Note a change of sign, whether it ends the run, and whether there is an end of them."""
        if self.jumps.counts(i, rises):
            way = "rising" if self.jumps.rises(i, rises, self._looked(t, x)) else "falling"
            self.happened.append((float(t), *self.jumps.label(i), way))
            self._ended |= self.jumps.ends(i, rises)
        self._switches.switched(i, t, lambda t, x: self._looked(t, x)[i], x, self._rates(t, x))

    def _watch(self, t: float, x: np.ndarray) -> None:
        """End a run whose state is not finite, or whose time stands still.

        At a finite escape time LSODA repeats a vanishing step for ever.
        """
        self._repeated = self._repeated + 1 if t == self.reached else 0
        if self._repeated > _STANDSTILL or not np.all(np.isfinite(x)):
            raise diverged(self.system, self.reached)
        self.reached = float(t)
        self._steps += 1
        if self._steps % _LOOKED_AT == 0:
            self._check_noise(t, x)
        if self.progress is not None:
            self.progress(self.reached)

    def _check_noise(self, t: float, x: np.ndarray) -> None:
        """End a run that makes no way because its rates change with the rounding of states."""
        length, self._looked_at = (t - self._looked_at) / _LOOKED_AT, t
        if self._end - t <= MOST_STEPS * length:
            return
        scale = self.settings["atol"] + self.settings["rtol"] * np.abs(x)
        i = rough_state(self._rates, [(t, next_to(x, 64.0 * k)) for k in range(5)], length, scale)
        if i is not None:
            block, label = self.jumps.state_label(i)
            raise ChatteringError(
                f"'{self.system.name}' is chattering at t = {t:.6g} s: '{label}'' of block "
                f"'{block}' jumps {ROUGH}",
                t,
            )

    _repeated, _longest, _ended, _failed, _narrow = 0, 0.0, False, np.nan, np.nan
    _same, _sames, _steps = 0.0, 0, 0
    _came = np.zeros(0)  # the last sides of what `_signs` returns, 0 where there was none yet

    def _record_within(self, until: float, state: Any, closes: bool) -> None:
        """Record the times of the response that a step has passed, but not what is to jump."""
        if self.wanted is None:
            if not closes:
                self._record(until, self.jumps.committed(until, state(until)))
            return
        last = min(float(np.nextafter(until, -np.inf)), self._last) if closes else until
        passed = bisect.bisect_right(self.wanted, last)
        for t in self.wanted[len(self.rows) : passed].tolist():
            self._record(t, self.jumps.committed(t, state(t)))

    def _record(self, t: float, x: np.ndarray, ends: bool = False) -> None:
        """Record outputs and states, if they are wanted at this time or the run ends there.

        Also for times right before it, at which rounding decides whether something has switched.
        """
        times = [t]
        if self.wanted is not None:
            times = self.wanted[len(self.rows) : bisect.bisect_right(self.wanted, t)].tolist()
        times = times or [t] * ends
        if times:
            y = outputs_now(self.system, t, x, self.inputs(t)) if self.system.noutputs else []
            self.rows += [(s, np.asarray(y, dtype=float), x.copy()) for s in times]

    def _keep(self, span: tuple[float, float], pieces: list[Any], event: Event | None) -> None:
        """Keep what has arrived at transport delays between the last two stops.

        Of the side of an event that the run came from: what is kept has no jump in it.
        """
        begun, t = span
        begins, last = [a for a, _ in pieces], event.before if event else t

        def arriving(s: float) -> list[np.ndarray]:
            k = max(bisect.bisect_left(begins, s) - 1, 0)
            return self._arriving(min(s, last), pieces[k][1])

        self.known.keep([begun, *begins[1:], t], arriving)

    def _arriving(self, t: float, state: Callable[[float], np.ndarray]) -> list[np.ndarray]:
        """Return what arrives at each transport delay, at a time between the last two stops."""
        t = min(t, self._last)
        found = {id(part): u for part, _, u in parts_now(self.system, t, state(t), self.inputs(t))}
        return [np.array(found[id(made)]) for made in self.known.lines]
