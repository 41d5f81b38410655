r"""Whether the compact set of (19) closes: \|r\| <= C_0 keeps x in a box that C_0 holds on.

A bound C of \|r\| lets x reach a box, the box has constants, and these give C_0: a map of boxes.
It grows with the box.  So every box that it maps into itself holds all that it makes of the point
x(0), one after the other; where these grow beyond any size, no box closes.  They are made here with
less than the true constants, from values that are attained at points of a box, and with Q = 0, so
that what they say of all boxes is right.  A box that does close is found with the proved constants.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import control as ct
import numpy as np
from flint import arb
from scipy.optimize import minimize_scalar

from nlctl.errors import ParameterError
from nlctl.plants import coordinate_names
from nlctl.references import SumOfSines

from ..intervals.box import Box
from .bounds.decomposition import Decomposition
from .bounds.error_bounds import error_bounds, initial_errors, reference_bounds
from .bounds.final_bound import Gains, alpha_0, alpha_1, final_bound, initial_V, total_error
from .bounds.sector import plant_terms
from .bounds.weights import Network, network_on_grid
from .constants import Constants, constants_of
from .inequalities import terms
from .lines import Line
from .loop.roles import Parts
from .loop.simulation import MemberRun
from .premises import Premises, premises

FARTHEST = 1_000.0  # of |x_i|: boxes that are larger are not tried
STATEMENT = "|r| <= C_0 keeps x in a box that C_0 holds on"
NOT_CLOSED = (
    "that x stays in Omega, which (19) needs, is assumed and not shown: (36) holds only as far as "
    "the runs were seen in the box."
)
_GROWTH = 1e-3  # relative; less than that, and the boxes do not grow any more
_ROOM = (1.001, 1.01, 1.05, 1.2)  # by so much the least box is enlarged, to find one that closes
_STEPS = 200
_V = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)  # of |v|, where the box has no end
_TIMES = np.linspace(0.0, 200.0, 97)


@dataclass(frozen=True, kw_only=True)
class StateReach:
    r"""How far x gets while \|r\| keeps a bound."""

    lambdas: tuple[float, ...]  # of the filtered error (14)
    e0: tuple[arb, ...]  # initial errors
    reference: SumOfSines  # what the plant shall follow

    def __call__(self, C: float) -> tuple[float, ...]:
        r"""Return bounds of \|x1\|, ..., \|xn\| for \|r\| <= C."""
        errors = error_bounds(self.lambdas, self.e0, arb(C))
        commands = reference_bounds(self.reference)
        return tuple(float(e.upper()) + y for e, y in zip(errors, commands, strict=False))


@dataclass(frozen=True, kw_only=True)
class Closure:
    """What is known of boxes that close."""

    status: Literal["closes", "none closes", "undecided"]
    # bounds of \\|x1\\|, ..., \\|xn\\|: of the box that closes; otherwise of the largest box found
    # that is a part of every one that does
    box: tuple[float, ...]
    C_0: float  # the bound on that box; where none closes, less than it
    # least distance between the box and what its C_0 lets x reach; negative if none closes
    room: float


def closure(loop: ct.InterconnectedSystem, run: MemberRun, constants: Constants) -> Line:
    """Return the line on whether \\|r\\| <= C_0 keeps the state in a box."""
    given = premises(constants, run.gains)
    C_0 = given.C_0(float(terms(run.signals, given).V[0]), float(np.max(run.signals["I"])))
    reach = _reach(run, given)
    if reach is None or not np.isfinite(C_0):
        why = "C_0 is infinite" if not np.isfinite(C_0) else "no bound of the reference is known"
        return Line(key="closure", statement=STATEMENT, status="undecided", evidence=why)
    try:
        bounds = reach(C_0)
    except ParameterError as error:
        return Line(key="closure", statement=STATEMENT, status="undecided", evidence=str(error))
    names = coordinate_names(len(bounds))
    sides = [constants.box[x] for x in names]
    room = min(min(high, -low) - a for (low, high), a in zip(sides, bounds, strict=True))
    here = f"C_0 = {C_0:.5g} gives {_sides_text(bounds)}"
    if room >= 0:
        return _line("computed", room, f"on this box {here}")
    other = closed_set(constants, run.gains, reach, Q=float(np.max(run.signals["I"])))
    if other.status == "closes":
        v = "v in [{:.4g}, {:.4g}]".format(*constants.box["v"])
        evidence = (
            f"not on this box, where {here}, but on {_sides_text(other.box)}, {v}, where C_0 = "
        )
        return _line("computed", other.room, f"{evidence}{other.C_0:.5g}")
    if other.status == "none closes":
        weights = " and W" * (_given(constants) is None)
        evidence = (
            f"none up to |x_i| <= {FARTHEST:g} closes, whatever Q{weights}: each would "
            f"hold {_sides_text(other.box)}, where C_0 is {other.C_0:.4g} at least; "
            f"on this box {here}"
        )
        return _line("violated", other.room, evidence)
    return _line("undecided", room, f"does not close on this box: {here}; of others it is open")


def _line(status: Any, room: float, evidence: str) -> Line:
    return Line(
        key="closure",
        statement=STATEMENT,
        status=status,
        least=room,
        evidence=evidence,
        follows="" if status == "computed" else NOT_CLOSED,
        reading="paper",
    )


def _sides_text(reach: Sequence[float]) -> str:
    names = coordinate_names(len(reach))
    return ", ".join(f"|{x}| <= {a:.4g}" for x, a in zip(names, reach, strict=True))


def _given(constants: Constants) -> Any:
    """Return the weights, if they were asked for and not chosen for the box."""
    chosen = next(entry for entry in constants.entries if entry.symbol == "|W|")
    return constants.W if chosen.provenance == "given" else None


def _reach(run: MemberRun, given: Premises) -> StateReach | None:
    """Return how far the loop's state gets; None where the reference has no bound."""
    spec: Any = run.parts.roles.spec("reference")
    if not isinstance(spec, SumOfSines):
        return None
    s, names = run.signals, coordinate_names(len(given.lambdas) + 1)
    e0 = initial_errors(spec, [arb(float(s[x][0])) for x in names], float(s.t[0]))
    return StateReach(lambdas=given.lambdas, e0=e0, reference=spec)


def closed_set(constants: Constants, gains: Gains, reach: StateReach, *, Q: float = 0.0) -> Closure:
    """Look for a box that closes, and for a reason why none does."""
    W = _given(constants)
    least, C_0, sides = 0.0, abs(float(gains.r_0)), reach(abs(float(gains.r_0)))
    for _ in range(_STEPS):
        C_0 = max(
            least_bound(constants.parts, constants.split, gains, sides, constants.box["v"], W), C_0
        )
        wider = reach(C_0)
        least = min(a - b for a, b in zip(sides, wider, strict=True))
        if not max(wider) <= FARTHEST:
            return Closure(status="none closes", box=sides, C_0=C_0, room=least)
        grown = max(b / a if a > 0 else np.inf for a, b in zip(sides, wider, strict=True))
        sides = wider
        if grown <= 1 + _GROWTH:
            break
    for candidate in _candidates(sides, constants, gains, reach, W, Q):
        if candidate.room >= 0:
            return candidate
    return Closure(status="undecided", box=sides, C_0=C_0, room=least)


def _candidates(
    sides: tuple[float, ...],
    constants: Constants,
    gains: Gains,
    reach: StateReach,
    W: object,
    Q: float,
) -> Iterator[Closure]:
    """Yield boxes around the least one that could close, with their proved constants."""
    names = coordinate_names(len(sides))
    for factor in _ROOM:
        ends = tuple(factor * a for a in sides)
        box = Box(names=names, low=tuple(-a for a in ends), high=ends, how="closure")
        on_it = _constants(constants, box.times("v", *constants.box["v"]), W)
        given = premises(on_it, gains)
        C_0 = given.C_0(given.V_0, Q)
        bounds = reach(C_0) if np.isfinite(C_0) else (np.inf,) * len(ends)
        room = min(a - b for a, b in zip(ends, bounds, strict=True))
        yield Closure(status="closes", box=ends, C_0=C_0, room=room)


def _constants(constants: Constants, box: Box, W: object) -> Constants:
    """Return the constants on a box, with the weights that suit it or, where none are found, 0."""
    try:
        return constants_of(constants.parts, constants.split, box, W)
    except ParameterError:
        return constants_of(constants.parts, constants.split, box, np.zeros(len(constants.W)))


def least_bound(
    parts: Parts,
    split: Decomposition,
    gains: Gains,
    sides: Sequence[float],
    v: tuple[float, float],
    W: object = None,
) -> float:
    r"""Return what C_0 of (36) is at least on a box, for Q = 0."""
    # G_max, d* and g are taken at points of the box. Without `W` it is so for every W: by \|W^T
    # psi\| <= \|W\| \|psi\| the error at a point is at least \|g\| - \|psi\| \|W\|; the least value
    # of a convex function of \|W\| is left.
    # Shapes: `W` (l,).
    network = _at_points(parts, sides)
    f, d = plant_terms(parts.plant)
    corners = [
        x for x in network.points if all(abs(a) in (0.0, b) for a, b in zip(x, sides, strict=True))
    ]
    d_star = max(abs(float(d(x, t))) for x in corners for t in _TIMES)
    gain = max((float(f(x, b)) - float(f(x, 0.0))) / b for x in corners for b in _some(v))
    rest = total_error(gain, split.eps_star, d_star, 0.0)
    weights, start = np.asarray(() if W is None else W), np.array(gains.W_hat_0)

    def bound(norm: float, error: float, distance: float) -> float:
        delta = rest + error
        V_0 = initial_V(gains, max(delta, gains.delta_hat_0), distance**2)
        return float(final_bound(alpha_0(gains, delta, norm**2), alpha_1(gains), V_0, 0.0))

    if W is not None or not start.size:
        apart = float(np.linalg.norm(weights - start))
        return bound(float(np.linalg.norm(weights)), network.error(weights), apart)
    size, from_0 = np.linalg.norm(network.psi, axis=1), float(np.linalg.norm(start))

    def of_norm(w: float) -> float:
        error = max(float(np.max(np.abs(network.g) - size * w)), 0.0)
        return bound(w, error, max(w - from_0, 0.0))

    far = of_norm(0.0) * np.sqrt(alpha_1(gains) / gains.sigma_1)  # |W| alone makes it larger beyond
    minimum: Any = minimize_scalar(
        of_norm, bounds=(0.0, far), method="bounded", options={"xatol": 1e-9}
    )
    return min(float(minimum.fun), of_norm(0.0)) * (1 - 1e-6)


def _at_points(parts: Parts, sides: Sequence[float]) -> Network:
    """Return g and psi at points of a box, its corners and centre among them."""
    names, ends = coordinate_names(len(sides)), tuple(sides)
    box = Box(names=names, low=tuple(-a for a in ends), high=ends)
    return network_on_grid(parts.plant, parts.basis, box, {1: 41, 2: 9}.get(len(ends), 5))


def _some(v: tuple[float, float]) -> list[float]:
    """Return some v other than 0 of an interval."""
    low, high = v
    ends = [b for b in (low, high) if np.isfinite(b)]
    inside = [s * b for b in _V for s in (-1.0, 1.0) if low <= s * b <= high]
    return [b for b in (*ends, *inside) if b != 0] or [1e-3]
