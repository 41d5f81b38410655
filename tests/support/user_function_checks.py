"""Judging one entry of the corpus: equal to python-control, refused with a reason, or neither.

The traced program runs as plain Python here, so that hundreds of entries take seconds.
"""

from __future__ import annotations

import contextlib
import functools
import io
import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import user_functions

import nlctl
from nlctl.errors import UsageError
from nlctl.native.equations.blocks import equations
from nlctl.native.lower import lower
from nlctl.native.machine.routine import plain_functions

LANES = 20
SCALES = (0.1, 1.0, 10.0, 100.0)
CLOSE = 1e-12
GOOD = ("equal", "refused")


@dataclass(frozen=True)
class Verdict:
    """What became of an entry: "equal", "refused", or a fault, and in words why."""

    kind: str
    text: str = ""

    @property
    def good(self) -> bool:
        return self.kind in GOOD


@dataclass(frozen=True)
class Points:
    """Times, states and inputs, a column per point."""

    t: np.ndarray
    x: np.ndarray
    u: np.ndarray

    def at(self, lane: int) -> tuple[float, np.ndarray, np.ndarray]:
        """Return copies: some functions change their arguments."""
        return float(self.t[lane]), self.x[:, lane].copy(), self.u[:, lane].copy()

    def only(self, lane: int) -> Points:
        return Points(*(a[..., lane : lane + 1].copy() for a in (self.t, self.x, self.u)))


@contextlib.contextmanager
def quiet():
    """Users' functions divide by zero and warn; only numbers are judged here."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        yield


def points(made: user_functions.Pieces, lanes: int = LANES, seed: int = 0) -> Points:
    """Random points of several scales; then all zero, all equal, whole and half numbers."""
    rng = np.random.default_rng(seed)
    scale = np.resize(SCALES, lanes)
    x = rng.normal(size=(made.states, lanes)) * scale
    u = rng.normal(size=(made.inputs, lanes)) * np.roll(scale, 1)
    t = rng.uniform(0, 5, lanes)
    if lanes >= LANES:
        t[-4], x[:, -4], u[:, -4] = 0.0, 0.0, 0.0
        x[:, -3], u[:, -3] = 1.0, 1.0
        x[:, -2], u[:, -2] = np.round(2 * x[:, -2]), np.round(u[:, -2])
        x[:, -1], u[:, -1] = np.resize([-0.5, 1.5, 2.5], made.states), -1.0
    return Points(t, x, u)


def called(function: Any, size: int, *args: Any) -> np.ndarray | None:
    """Return what python-control gives, or None where it fails or gives another size."""
    try:
        found = np.array(function(*args), dtype=float)
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException:  # also what a compiler left behind in the user's objects
        return None
    return found if found.shape == (size,) else None


def expected(system: Any, at: tuple, params: Any = None) -> tuple[np.ndarray | None, ...]:
    """Return (dx, y) of python-control; each is None where it fails."""
    t, x, u = at
    return (
        called(system.dynamics, system.nstates or 0, t, x.copy(), u.copy(), params)
        if system.nstates
        else np.empty(0),
        called(system.output, system.noutputs or 0, t, x.copy(), u.copy(), params),
    )


def agrees(found: np.ndarray, wanted: np.ndarray | None) -> bool:
    """Whether both are equal to 1e-12 of the largest number, or of 0.1: sums have their orders.

    NaN and infinity are in the same places.

    Where python-control fails, no finite numbers may come out.
    """
    if wanted is None:
        return not np.isfinite(found).all()
    finite = np.isfinite(wanted)
    if not np.array_equal(found[~finite], wanted[~finite], equal_nan=True):
        return False
    scale = np.max(np.abs(wanted[finite]), initial=0.1)
    return bool(np.all(np.abs(found[finite] - wanted[finite]) <= CLOSE * scale))


def shown(name: str, found: np.ndarray, wanted: np.ndarray | None) -> str:
    """Name the place with both numbers."""
    if wanted is None:
        return f"{name} = {found[:3]}, python-control fails"
    apart = ~np.isclose(found, wanted, rtol=CLOSE, atol=0.0, equal_nan=True)
    i = int(np.argmax(apart))
    return f"{name}[{i}] = {found[i]!r}, python-control {wanted[i]!r}"


class Plain:
    """The lowered program of a diagram, run as plain Python."""

    def __init__(self, compiled: nlctl.native.Compiled) -> None:
        self.compiled, self.system = compiled, compiled.system
        self.programs: dict[int, Any] = {}

    def lowered(self, lanes: int) -> Any:
        if lanes not in self.programs:
            made = self.compiled  # its equations have been read already
            self.programs[lanes] = lower(made.schedule, made.program, lanes, made.equations)
        return self.programs[lanes]

    def run(self, at: Points, params: Any = None) -> tuple[np.ndarray, np.ndarray]:
        """Return dx and y at all points, a column each."""
        lanes = at.t.size
        lowered = self.lowered(lanes)
        p = np.repeat(self.compiled.parameter_vector(params)[:, None], lanes, axis=1)
        if not lowered.holds_for(p):  # an integer has changed: the functions are read again
            read = self.compiled.schedule
            found = equations(read, self.compiled.program.layout, p[:, 0])
            lowered = lower(read, self.compiled.program, lanes, found)
        prepare, rhs, out, *_ = plain_functions(lowered)
        rows = {**lowered.rows, "c": lowered.size, "y": self.system.noutputs or 0}
        c, dx, g, m, y = (np.full((rows[k], lanes), np.nan) for k in ("c", "dx", "g", "m", "y"))
        prepare(p, c)
        rhs(at.t.copy(), at.x.copy(), at.u.copy(), c, dx, g, m)
        out(at.t.copy(), at.x.copy(), at.u.copy(), c, y)
        return dx, y


def difference(plain: Plain, system: Any, at: Points, params: Any = None) -> str:
    """Return where the program and python-control are apart, or nothing."""
    wanted = [expected(system, at.at(lane), params) for lane in range(at.t.size)]
    try:
        dx, y = plain.run(at, params)
    except UsageError:
        raise
    except Exception as error:
        return _difference_one_by_one(plain, at, params, wanted, error)
    for lane, pair in enumerate(wanted):
        for name, found, want in zip(("dx", "y"), (dx[:, lane], y[:, lane]), pair, strict=True):
            if not agrees(found, want):
                return f"point {lane}: {shown(name, found, want)}"
    return ""


def _difference_one_by_one(plain, at, params, wanted, error) -> str:
    """As `difference` where the program raised: it may, where python-control does."""
    if at.t.size == 1:
        raised = any(one is None for one in wanted[0])
        return "" if raised else f"program raises {type(error).__name__}: {error}"
    for lane in range(at.t.size):
        found = difference(plain, plain.system, at.only(lane), params)
        if found:
            return f"point {lane} alone: {found}"
    return ""


@functools.cache
def judged(entry: user_functions.Entry, n: int, dt: float = 0) -> Verdict:
    """Return what becomes of one entry with n states."""
    told = io.StringIO()
    with quiet(), contextlib.redirect_stdout(told):
        made = entry.make(n)
        system = user_functions.system(made, "b", dt)
        try:
            found = _pure(system, made) if entry.pure else _impure(system)
        except UsageError as error:
            found = Verdict("refused" if str(error) else "refused without a reason", str(error))
        except Exception as error:
            found = Verdict("error", f"{type(error).__name__}: {error}")
        if entry.repeatable and found.kind not in ("different", "raises"):
            changed = _changed(system, lambda: user_functions.system(entry.make(n), "b", dt),
                               points(made, 6, seed=1))  # fmt: skip
            found = Verdict("memory changed", f"{changed} ({found.kind})") if changed else found
    if told.getvalue():
        return Verdict("printed", f"{told.getvalue()[:100]!r} ({found.kind})")
    return found


def _changed(system: Any, fresh: Any, at: Points) -> str:
    """Compare python-control's results with those of a fresh instance, bit for bit.

    It is made after the first has run: factories set globals and seeds anew.
    """
    kept = [expected(system, at.at(lane)) for lane in range(at.t.size)]
    other = fresh()
    for lane, before in enumerate(kept):
        for name, one, two in zip(("dx", "y"), before, expected(other, at.at(lane)), strict=True):
            if one is None and two is None:
                continue
            if one is None or two is None:
                return f"call {lane}: {name} fails with {'the first' if one is None else 'a fresh'}"
            if not np.array_equal(one, two, equal_nan=True):
                i = int(np.argmax(one != two))
                return f"call {lane}: {name}[{i}] = {one[i]!r}, with a fresh instance {two[i]!r}"
    return ""


def _pure(system: Any, made: user_functions.Pieces) -> Verdict:
    """Compare at many points, with the parameters as they are and with others."""
    plain = Plain(nlctl.compile(system))
    plain.lowered(LANES)
    at = points(made)
    apart = difference(plain, system, at)
    if not apart and made.changed:
        apart = difference(plain, system, at, made.changed)
        apart = apart and f"parameters changed to {made.changed}, {apart}"
    if apart:
        return Verdict("raises" if "program raises" in apart else "different", apart)
    return Verdict("equal", "; ".join(plain.lowered(LANES).opaque.values()))


def _impure(system: Any) -> Verdict:
    """Try to compile; what is called as it stands must be refused by the compiler at the latest."""
    compiled = nlctl.compile(system)
    if compiled.lowered.opaque:
        _ = compiled.native
    return Verdict("accepted", "traced" if not compiled.lowered.opaque else "machine code")
