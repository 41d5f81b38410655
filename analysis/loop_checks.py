"""What is checked of a loop that nobody has claimed anything of: its run, and where it comes to."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from nlctl import native
from nlctl.arguments import ATOL, RTOL
from nlctl.delays.transport import PAST
from nlctl.diagrams import leaves, supplied_blocks
from nlctl.diagrams.points import rates_and_outputs
from nlctl.errors import DivergedError, InexactWarning, UsageError
from nlctl.native.describe import called
from nlctl.response import input_output_response
from nlctl.sampling.system import clocks_of
from nlctl.wording import counted, some_of

from .lyapunov.ledger import Ledger, ledger
from .report.document import Headline, Section, Table

__all__ = [
    "LoopCheck",
    "checks_of",
    "checks_section",
    "headline",
    "in_sentences",
    "proof_check",
    "proof_of",
]

_REST = 1e-3  # of how far a state has moved, within the time of the run: slower is at rest
_LATE = 0.05  # of the run: its end, whose samples are compared
_TIGHTER = 1e-2  # of the tolerances, for the comparison
_SAME = 1e-4  # of a signal's range


@dataclass(frozen=True, kw_only=True)
class LoopCheck:
    """One thing that was checked.

    Attributes
    ----------
    what, found : str
    status : {"pass", "caution", "fail", "not applicable"}
    """

    what: str
    found: str
    status: str


def checks_of(loop: Any, response: Any, params: Mapping[str, Any]) -> list[LoopCheck]:
    """Return what is checked of a loop and one run of it; a check that has no meaning says why."""
    return [
        *_engine(loop, response, params),
        _tolerance(loop, response, params),
        _rest(loop, response, params),
    ]


def headline(checks: Sequence[LoopCheck]) -> Headline:
    """Return how many of the checks that apply hold."""
    applied = [check.status for check in checks if check.status != "not applicable"]
    held = applied.count("pass")
    look = "fail" if "fail" in applied else "pass" if held == len(applied) else "caution"
    if held == len(applied) > 1:
        return Headline(look=look, text=f"All {counted(held, 'check')} of the loop hold.")
    return Headline(
        look=look,
        text=f"{some_of(held, len(applied), 'check', 'holds', 'hold')}; nothing is claimed.",
    )


def in_sentences(checks: Sequence[LoopCheck]) -> str:
    """Return what was checked in a sentence, first what does not hold or is not known."""
    parts = (
        ("Does not hold", "fail"), ("Not known", "caution"), ("Checked, and it holds", "pass"),
    )  # fmt: skip
    sentences = []
    for words, status in parts:
        these = [c.what[0].lower() + c.what[1:] for c in checks if c.status == status]
        sentences += [f"{words}: {'; '.join(these)}."] * bool(these)
    return " ".join(sentences)


def proof_check(ledger: Ledger) -> LoopCheck:
    """Return whether the proof's statements, corrected where they can be, hold along the run."""
    lines = [line for line in ledger.lines if line.reading == "corrected"]
    kept = f"{len(lines) - len(ledger.violated)} of {len(lines)} hold"
    return LoopCheck(
        what="The lines of the proof, corrected where they can be, hold along the run",
        found=kept,
        status={"violated": "fail", "undecided": "caution"}.get(ledger.answer, "pass"),
    )


def checks_section(checks: Sequence[LoopCheck]) -> Section:
    """Return checks as a section."""
    table = Table(
        caption="What was checked of this loop and of this run.",
        columns=("check", "status", "found"),
        rows=[(check.what, check.status, check.found) for check in checks],
        status="status",
    )
    return Section(key="checks", title="Checks", items=[table])


def proof_of(
    loop: Any, horizon: float, start: Mapping[str, float], params: Mapping[str, Any]
) -> Ledger | LoopCheck:
    """Return the paper's proof line by line for a loop of its kind, else why it does not apply."""
    try:
        return ledger(loop, horizon, start=dict(start), params=dict(params))
    except (UsageError, DivergedError) as error:
        what = "The proof of Lv et al. (2017), line by line"
        return LoopCheck(what=what, found=str(error), status="not applicable")


def _engine(loop: Any, response: Any, params: Mapping[str, Any]) -> Iterator[LoopCheck]:
    """Yield who has computed the run, and what is known of its conditions."""
    run, what = response.statistics, "The equations of the run are python-control's"
    if run is None:
        yield LoopCheck(what=what, found="python-control ran them itself", status="pass")
        return
    steps = f"{counted(run.accepted, 'step')}, {counted(run.events, 'event')}"
    finding = f"machine code was compared with them along the run, which took {steps}"
    yield LoopCheck(what=what, found=finding, status="pass")
    reading = native.compile(loop, params=dict(params))
    what = "Steps end where equations switch"
    opaque = list(called(reading))
    if opaque:
        yield LoopCheck(what=what, found=f"not known of: {'; '.join(opaque)}", status="caution")
    else:
        numbers = {"of the equations": run.conditions, "of blocks": reading.program.switching}
        located = [f"{counted(n, 'condition')} {whose}" for whose, n in numbers.items() if n]
        finding = f"{' and '.join(located)} located" if located else "nothing switches"
        yield LoopCheck(what=what, found=finding, status="pass")


def _tolerance(loop: Any, response: Any, params: Mapping[str, Any]) -> LoopCheck:
    """Compare a run with one of tighter tolerances."""
    what = "The run does not depend on its tolerances"
    if not ct.isctime(loop):
        return LoopCheck(what=what, found="discrete time has none", status="not applicable")
    try:
        again = input_output_response(
            loop, response.time, response.u, response.x[:, 0], params=params,
            rtol=_TIGHTER * RTOL, atol=_TIGHTER * ATOL,
        )  # fmt: skip
    except DivergedError as error:
        return LoopCheck(what=what, found=f"with tighter ones {error}", status="fail")
    scale = np.maximum(np.ptp(response.y, axis=1), np.finfo(float).tiny)
    off = np.max(np.abs(again.y - response.y), axis=1) / scale
    worst = int(np.argmax(off))
    finding = (
        f"at rtol {_TIGHTER * RTOL:.0e} {response.output_labels[worst]} differs most, by "
        f"{off[worst]:.1e} of its range"
    )
    return LoopCheck(what=what, found=finding, status="pass" if off[worst] <= _SAME else "caution")


def _rest(loop: Any, response: Any, params: Mapping[str, Any]) -> LoopCheck:
    """Say whether the loop is at rest at the end, and what its linearisation there says."""
    what = "The state at the end is a stable equilibrium"
    if not (ct.isctime(loop) and loop.nstates):
        return LoopCheck(what=what, found="the loop has no rates", status="not applicable")
    delayed = supplied_blocks(loop, PAST)
    if delayed:
        finding = (
            f"'{delayed[0].name}' delays its signals, and what is on the way is not a state; "
            "nlctl.frequency_response is exact with delays, and so are margins of it"
        )
        return LoopCheck(what=what, found=finding, status="not applicable")
    t, x, u = float(response.time[-1]), response.x[:, -1], response.u[:, -1]
    share = _still_moves(loop, response, params)
    if not np.max(share) <= _REST:
        name = response.state_names[int(np.argmax(share))]
        return LoopCheck(what=what, found=f"{name} still moves at the end", status="not applicable")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InexactWarning)  # that is said in another line
            linear = native.compile(loop, params=dict(params)).linearize(x, u, t, dict(params))
    except UsageError as error:
        return LoopCheck(what=what, found=str(error), status="not applicable")
    poles, per_period = np.linalg.eigvals(linear.A), not linear.isctime()
    size = "absolute value" if per_period else "real part"
    slowest = float(np.max(np.abs(poles) if per_period else poles.real))
    finding = f"the largest {size} of an eigenvalue of its linearisation is {slowest:.4g}"
    finding += f", per {linear.dt:g} s" if per_period else " 1/s"
    return LoopCheck(
        what=what, found=finding, status="pass" if slowest < float(per_period) else "caution"
    )


def _still_moves(loop: Any, response: Any, params: Mapping[str, Any]) -> np.ndarray:
    """Return how far states would move in the time of the run, as they do at its end."""
    # as a share of how far they have moved; what samples and slides has no rates that say it
    t, x = np.asarray(response.time), response.x
    span, eps, tiny = float(t[-1] - t[0]), np.finfo(float).eps, np.finfo(float).tiny
    moved = np.maximum(np.ptp(x, axis=1) + eps * np.max(np.abs(x), axis=1), tiny)
    if supplied_blocks(loop) or clocks_of(leaf.system for leaf in leaves(loop)):
        late = x[:, t >= t[-1] - _LATE * span]
        return np.ptp(late, axis=1) / _LATE / moved
    rates, _ = rates_and_outputs(loop, dict(params))(float(t[-1]), x[:, -1], response.u[:, -1])
    return np.abs(rates) * span / moved
