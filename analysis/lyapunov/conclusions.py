r"""What the paper concludes by Lemma 1, and what of it is true.

Whether the compact set of (19) closes: \|r\| <= C_0 keeps x in a box that C_0 holds on.

A bound C of \|r\| lets x reach a box, the box has constants, and these give C_0: a map of boxes.
It grows with the box.  So every box that it maps into itself holds all that it makes of the point
x(0), one after the other; where these grow beyond any size, no box closes.  They are made here with
less than the true constants, from values that are attained at points of a box, and with Q = 0, so
that what they say of all boxes is right.  A box that does close is found with the proved constants.
"""

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
from nlctl.wording import counted

from ..intervals.box import Box
from .bounds.decomposition import Decomposition
from .bounds.error_bounds import (
    Gains,
    alpha_0,
    alpha_1,
    error_bounds,
    final_bound,
    initial_errors,
    initial_V,
    reference_bounds,
    total_error,
)
from .bounds.sector import plant_terms
from .bounds.weights import Network, network_on_grid
from .constants import Constants, Premises, constants_of, premises
from .inequalities import terms
from .lines import Line
from .loop.roles import Parts
from .loop.simulation import MemberRun
from .nussbaum.energy import drift, drift_margin, safe_horizon
from .nussbaum.property import antiderivative, lobe_around, nussbaum_property
from .nussbaum.slow_drift import SlowDrift, slow_drift

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


SAFE = "zeta cannot cross its lobe before T"
_WINDOW = 4 * np.pi  # s; period of the paper's reference
_LEMMA = (
    "false on [0, inf): with zeta' = c1 c2/(2 + exp(zeta^2)), V = c1 + I and g = 1 its premise "
    "holds and zeta is unbounded"
)
NO_BOUND = (
    "boundedness for all t, (33)-(36) and 'semi-globally uniformly ultimately bounded' do not "
    "follow; what holds is checked over the horizon, and lines (b), (c)."
)


def slow_drift_of(run: MemberRun) -> tuple[SlowDrift | None, str]:
    """Return where the slow drift of zeta leads; None and why, if the run does not show it."""
    length = run.signals.t[-1] - run.signals.t[0]
    if length < 6 * _WINDOW:
        return None, f"{length:g} s show nothing of it: run {np.ceil(6 * _WINDOW):g} s at least"
    try:
        return slow_drift(run.signals, run.parts.law.N, window=_WINDOW), ""
    except ParameterError as error:
        return None, str(error)


def conclusions(loop: ct.InterconnectedSystem, run: MemberRun, constants: Constants) -> list[Line]:
    """Return the lines of (12), Lemma 1, what remains of it, the slow drift and the closure."""
    given = premises(constants, run.gains)
    lines = [_property(given), _lemma(), *_bounded(run, given)]
    if np.isfinite(run.signals["zeta"]).all():
        lines += [*_remains(run, given, constants), _slow_drift_line(run)]
    return [*lines, closure(loop, run, constants)]


def _property(given: Premises) -> Line:
    statement = "(1/s) int_0^s N is unbounded above and below"
    try:
        seen = nussbaum_property(given.N)
    except ParameterError as error:
        return Line(key="(12)", statement=statement, status="undecided", evidence=str(error))
    evidence = f"{counted(len(seen.means), 'lobe')} on [0, {seen.end:.4g}]"
    if not seen.means:
        changes = counted(len(seen.lobes) - 1, "change of sign", "changes of sign")
        evidence = f"{changes} on [0, {seen.end:.4g}], no four lobes"
    return Line(
        key="(12)",
        statement=statement,
        status="checked" if seen.type_a else "violated",
        evidence=f"{evidence}, type B {'seen' if seen.type_b else 'not seen'}",
        follows=""
        if seen.type_a
        else "N is not a Nussbaum function on this range: take another N for the law.",
    )


def _lemma() -> Line:
    return Line(
        key="Lemma 1",
        statement="V, zeta and int k G N dzeta are bounded if (32) holds",
        status="violated",
        evidence=_LEMMA,
        follows=NO_BOUND,
        reading="paper",
    )


def _bounded(run: MemberRun, given: Premises) -> list[Line]:
    """Lemma 1's conclusion over the horizon, and the readings of Q."""
    s = run.signals
    zeta, horizon = s["zeta"], f"{s.t[-1]:g} s"
    Q, bar, printed = (float(np.max(s[name])) for name in ("I", "I_bar", "I_printed"))
    i = int(np.argmax(zeta))
    lines = [
        Line(
            key="(33)",
            statement=f"I(t) <= Q = {Q:.5g}; with the bar over all {bar:.5g}, as printed "
            f"{printed:.5g}",
            status="computed" if np.isfinite(Q) else "violated",
            time=float(s.t[int(np.argmax(s["I"]))]),
            evidence=f"integrated with the loop over {horizon}",
        )
    ]
    try:
        lobe = lobe_around(float(zeta[0]), given.N)
        room = lobe.high - zeta[i]
        ends = antiderivative(given.N)(np.array([lobe.low, zeta[-1]]))
        share = abs(float(ends[1] - ends[0])) / lobe.budget
        evidence = f"max zeta = {zeta[i]:.6g}, {100 * share:.3g} % of the lobe's budget spent"
    except ParameterError:
        room, evidence = np.nan, f"max zeta = {zeta[i]:.6g}"
    status = "checked" if room > 0 else "undecided" if np.isnan(room) else "violated"
    lost = "" if run.lost is None else f"; {run.message}"
    lines.append(
        Line(
            key="Lemma 1, horizon",
            statement=f"zeta stays in its lobe, all signals bounded over {horizon}",
            status="violated" if lost else status,
            least=float(room),
            time=float(s.t[i]),
            state=s.at(float(s.t[i])),
            evidence=evidence + lost,
            follows="N has changed its sign, or r bursts." if lost or room <= 0 else "",
        )
    )
    return lines


def _remains(run: MemberRun, given: Premises, constants: Constants) -> list[Line]:
    """Inequality 2.3 (c), and the safe horizon (b)."""
    x = terms(run.signals, given)
    low, high = constants["k_1"] * given.G_min, constants["k_2"] * given.G_max
    names = ("(c)", "(b)")
    if not (0 < low <= high < np.inf and np.isfinite(given.alpha_0)):
        return [Line(key=k, statement="bounds of k G", status="undecided") for k in names]
    moved = drift(run.signals, given.N)
    margin = drift_margin(moved, x.V[0], given.alpha_0, l_min=low, l_max=high, V=x.V)
    c = Line(
        key=margin.equation,
        statement=margin.statement,
        status="checked" if margin.holds else "violated",
        least=margin.least,
        time=margin.at,
        state=run.signals.at(margin.at),
        evidence=f"E+ = {moved.gained[-1]:.5g}, E- = {moved.lost[-1]:.5g}, "
        f"k G in [{low:.4g}, {high:.4g}]",
        follows="" if margin.holds else "k G left its bounds, or N zeta' is not r u.",
    )
    try:
        safe = safe_horizon(
            float(x.V[0]), given.alpha_0, l_min=low, l_max=high, zeta_0=float(moved.zeta[0]),
            N=given.N,
        )  # fmt: skip
    except ParameterError as error:
        return [c, Line(key="(b)", statement=SAFE, status="undecided", evidence=str(error))]
    crossed = bool(np.any(moved.zeta[moved.time - moved.time[0] < safe.time] >= safe.zeta))
    status = "violated" if crossed else "checked"
    evidence = f"T = {safe.time:.4g} s for a monotone zeta or a constant gain"
    b = Line(
        key="(b)",
        statement=SAFE,
        status=status if moved.monotone else "not applicable",
        evidence=evidence + ("" if moved.monotone else "; here zeta falls and k G varies"),
        follows="k G left its bounds." if moved.monotone and crossed else "",
    )
    return [c, b]


def _slow_drift_line(run: MemberRun) -> Line:
    statement = "the drift of zeta ends before N changes its sign"
    slow, reason = slow_drift_of(run)
    if slow is None:
        return Line(key="slow drift", statement=statement, status="undecided", evidence=reason)
    calm = slow.verdict in ("settles", "reversed")
    soon = f"; budget spent by {slow.burst:.4g} s or so, then max |r| = {slow.peak:.4g}"
    return Line(
        key="slow drift",
        statement=statement,
        status="checked" if calm else "undecided",
        least=1 - slow.share,
        time=slow.time,
        evidence=f"{slow.verdict}: {100 * slow.share:.3g} % of the budget spent, "
        f"{slow.recent.mean():.3g} per s" + ("" if calm else soon),
    )
