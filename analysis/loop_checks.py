"""What is checked of a loop that nobody has claimed anything of: its run, and where it comes to."""

import warnings
from collections.abc import Mapping, Sequence
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
from nlctl.upstream.systems import System
from nlctl.wording import counted, some_of

from .lyapunov.ledger import Ledger, ledger
from .report.document import Headline, Section, Table

_REST = 1e-3  # of how far a state has moved, within the time of the run: slower is at rest
_LATE = 0.05  # of the run: its end, whose samples are compared
_TIGHTER = 1e-2  # of the tolerances, for the comparison
_SAME = 1e-4  # of a signal's range


@dataclass(frozen=True, kw_only=True)
class LoopCheck:
    """One thing that was checked."""

    what: str
    found: str
    status: str  # pass, caution, fail, or not applicable


def checks_of(loop: object, response: object, params: Mapping[str, Any]) -> list[LoopCheck]:
    """Return what is checked of a loop and one run of it; a check that has no meaning says why."""
    answers = {what: answer(loop, response, dict(params)) for what, answer in _CHECKS.items()}
    return [
        LoopCheck(what=what, found=answer[0], status=answer[1])
        for what, answer in answers.items()
        if answer is not None
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
    return LoopCheck(
        what="The lines of the proof, corrected where they can be, hold along the run",
        found=f"lines that hold: {ledger.tally}",
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
    loop: ct.InterconnectedSystem,
    horizon: float,
    start: Mapping[str, float],
    params: Mapping[str, Any],
) -> Ledger | LoopCheck:
    """Return the paper's proof line by line for a loop of its kind, else why it does not apply."""
    try:
        return ledger(loop, horizon, start=dict(start), params=dict(params))
    except (UsageError, DivergedError) as error:
        what = "The proof of Lv et al. (2017), line by line"
        return LoopCheck(what=what, found=str(error), status="not applicable")


_Answer = tuple[str, str]  # what was found, and its status


def _engine(loop: System, response: Any, params: dict[str, Any]) -> _Answer:
    """Return who has computed the run."""
    run = response.statistics
    if run is None:
        return "python-control ran them itself", "pass"
    steps = f"{counted(run.accepted, 'step')}, {counted(run.events, 'event')}"
    return f"machine code was compared with them along the run, which took {steps}", "pass"


def _switching(loop: System, response: Any, params: dict[str, Any]) -> _Answer | None:
    """Return what is known of the conditions of a run, unless python-control ran it."""
    if response.statistics is None:
        return None
    reading = native.compile(loop, params=params)
    if opaque := list(called(reading)):
        return f"not known of: {'; '.join(opaque)}", "caution"
    numbers = {
        "of the equations": response.statistics.conditions,
        "of blocks": reading.program.switching,
    }
    if along := response.statistics.along:
        return f"located; it slides along {along}: a real switch has a delay, and wears", "pass"
    located = [f"{counted(n, 'condition')} {whose}" for whose, n in numbers.items() if n]
    return f"{' and '.join(located)} located" if located else "nothing switches", "pass"


def _tolerance(loop: Any, response: Any, params: dict[str, Any]) -> _Answer:
    """Compare a run with one of tighter tolerances."""
    if not ct.isctime(loop):
        return "discrete time has none", "not applicable"
    run = response.statistics
    rtol, atol = (RTOL, ATOL) if run is None else (run.rtol, run.atol)
    try:
        again = input_output_response(
            loop, response.time, response.u, response.x[:, 0], params=params,
            rtol=_TIGHTER * rtol, atol=_TIGHTER * atol,
        )  # fmt: skip
    except DivergedError as error:
        return f"with tighter ones {error}", "fail"
    scale = np.maximum(np.ptp(response.y, axis=1), np.finfo(float).tiny)
    off = np.max(np.abs(again.y - response.y), axis=1) / scale
    worst = int(np.argmax(off))
    finding = (
        f"at rtol {_TIGHTER * rtol:.0e} {response.output_labels[worst]} differs most, by "
        f"{off[worst]:.1e} of its range"
    )
    return finding, "pass" if off[worst] <= _SAME else "caution"


def _rest(loop: Any, response: Any, params: dict[str, Any]) -> _Answer:
    """Say whether the loop is at rest at the end, and what its linearisation there says."""
    if not (ct.isctime(loop) and loop.nstates):
        return "the loop has no rates", "not applicable"
    delayed = supplied_blocks(loop, PAST)
    if delayed:
        finding = (
            f"'{delayed[0].name}' delays its signals, and what is on the way is not a state; "
            "nlctl.frequency_response is exact with delays, and so are margins of it"
        )
        return finding, "not applicable"
    if response.statistics is not None and response.statistics.slides:
        return (
            "it slides along a condition, where neither side's equations say it",
            "not applicable",
        )
    t, x, u = float(response.time[-1]), response.x[:, -1], response.u[:, -1]
    share = _still_moves(loop, response, params)
    if not np.max(share) <= _REST:
        name = response.state_names[int(np.argmax(share))]
        return f"{name} still moves at the end", "not applicable"
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", InexactWarning)  # that is said in another line
            linear = native.compile(loop, params=params).linearize(x, u, t, params)
    except UsageError as error:
        return str(error), "not applicable"
    poles, per_period = np.linalg.eigvals(linear.A), not linear.isctime()
    size = "absolute value" if per_period else "real part"
    slowest = float(np.max(np.abs(poles) if per_period else poles.real))
    finding = f"the largest {size} of an eigenvalue of its linearisation is {slowest:.4g}"
    finding += f", per {linear.dt:g} s" if per_period else " 1/s"
    return finding, "pass" if slowest < float(per_period) else "caution"


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


_CHECKS = {
    "The equations of the run are python-control's": _engine,
    "Steps end where equations switch": _switching,
    "The run does not depend on its tolerances": _tolerance,
    "The state at the end is a stable equilibrium": _rest,
}
