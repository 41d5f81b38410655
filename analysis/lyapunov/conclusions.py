"""What the paper concludes by Lemma 1, and what of it is true."""

from __future__ import annotations

import control as ct
import numpy as np

from nlctl.errors import ParameterError
from nlctl.wording import counted

from .closure import closure
from .constants import Constants
from .inequalities import terms
from .lines import Line
from .loop.simulation import MemberRun
from .nussbaum.energy import drift, drift_margin, safe_horizon
from .nussbaum.property import antiderivative, lobe_around, nussbaum_property
from .nussbaum.slow_drift import SlowDrift, slow_drift
from .premises import Premises, premises

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
