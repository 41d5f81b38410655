"""The verdict on the paper, and the claims behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...lyapunov.nussbaum.long_run import LongRun
from ...report.document import Claim
from .. import HORIZON, TAIL, CaseRun, Check
from ..evidence import Evidence


def paper_verdict(compared: Sequence[Check], far: Mapping[str, LongRun]) -> str:
    """Return the report's first sentence, and what became of the loops far beyond 20 s."""
    total = len(compared)
    missed = [c for c in compared if not c.passed]
    if missed:
        apart = [np.nan_to_num(c.error / c.expectation.tolerance, nan=np.inf) for c in missed]
        worst = missed[int(np.argmax(apart))]
        are = "is" if len(missed) == 1 else "are"
        return (
            f"Not reproduced: {len(missed)} of {total} numbers {are} missed, most of all "
            f"{worst.metric.meaning} of case {worst.expectation.case} "
            f"({worst.value:.8g} instead of {worst.expectation.printed})."
        )
    reproduced = (
        f"Over {HORIZON:g} s both examples are reproduced: all {total} numbers of an independent "
        "computation are reached, and the same controller follows its reference through a dead "
        "zone and through backlash."
    )
    bursts = [f"{_loop(run)} loses the sign of its gain at {run.burst:.0f} s" for run in _lost(far)]
    if not bursts:
        return reproduced
    return (
        f"{reproduced} Not for all time: {'; '.join(bursts)}, and the lemma that the paper's proof "
        "rests on is false. With a law that knows the sign of the gain a bound is proved."
    )


def paper_claims(runs: Mapping[str, CaseRun], compared: Sequence[Check]) -> list[Claim]:
    """Return what the paper claims and these runs can show, with what was found."""
    found = [
        Claim(
            text=f"Example {n}: does the output follow its reference through {what}?",
            measured=_error(runs[key], compared),
            limit=_limit(key, "tail_max_e", compared),
            holds=_holds(key, "tail_max_e", compared),
            evidence=f"example-{n}",
        )
        for n, key, what in ((1, "1", "the dead zone"), (2, "2", "backlash"))
    ]
    found += [
        Claim(
            text=f"Does Example {n}'s controller, unchanged, drive {what} as well?",
            measured=_error(runs[key], compared),
            limit=_limit(key, "tail_max_e", compared),
            holds=_holds(key, "tail_max_e", compared),
            evidence="exchange",
        )
        for n, key, what in ((1, "1-backlash", "backlash"), (2, "2-dead-zone", "the dead zone"))
    ]
    reached = sum(c.passed for c in compared)
    found.append(
        Claim(
            text="Are all numbers of an independent computation reached?",
            measured=f"{reached} of {len(compared)}",
            limit=f"all {len(compared)}",
            holds=reached == len(compared),
            evidence="example-1-figures",
        )
    )
    return found


def _of(key: str, metric: str, compared: Sequence[Check]) -> Check:
    return next(c for c in compared if c.expectation.case == key and c.expectation.metric == metric)


def _holds(key: str, metric: str, compared: Sequence[Check]) -> bool:
    return _of(key, metric, compared).passed


def _limit(key: str, metric: str, compared: Sequence[Check]) -> str:
    expected = _of(key, metric, compared).expectation
    return f"{expected.printed} ± {expected.tolerance:.0e}"


def _error(run: CaseRun, compared: Sequence[Check]) -> str:
    """Return the largest late error, to a digit beyond its tolerance."""
    tolerance = _of(run.case.key, "tail_max_e", compared).expectation.tolerance
    digits = 1 - int(np.floor(np.log10(tolerance)))
    return f"max |e₁| = {run.metrics['tail_max_e']:.{digits}f} for t ≥ {TAIL:g} s"


def _lost(far: Mapping[str, LongRun]) -> list[LongRun]:
    return [run for run in far.values() if np.isfinite(run.burst)]


def _loop(run: LongRun) -> str:
    return run.loop.replace("_", " ").capitalize()


def proof_claims(proofs: Mapping[int, Evidence], far: Mapping[str, LongRun]) -> list[Claim]:
    """Return what the paper's proof claims, and what nlctl proves in its place."""
    found = [
        Claim(
            text="The paper's theorem: do all signals stay bounded for all time?",
            measured=f"no: {_loop(run)} bursts at {run.burst:.0f} s, and Lemma 1 is false",
            limit="bounded for all t",
            holds=False,
            evidence="proof",
            status="refuted",
            by="the paper",
        )
        for run in _lost(far)
    ]
    for number, one in proofs.items():
        lines, bound = one.ledger, one.certificate.C_0
        checked = [line for line in lines.lines if line.reading == "corrected"]
        found += [
            Claim(
                text=f"Example {number}: do the proof's steps, corrected where they can be, hold "
                f"along a run of {HORIZON:g} s?",
                measured=f"{len(checked) - len(lines.violated)} of {len(checked)} lines",
                limit=f"all {len(checked)}",
                holds=lines.holds,
                evidence=f"proof-{number}",
                status="checked" if lines.holds else "violated",
            ),
            Claim(
                text=f"Example {number} with a law that knows the sign of the gain: is there a "
                "bound for all time?",
                measured=f"|r| ≤ {bound:.3f}; a run reaches {one.certified_max_r:.3f}",
                limit="any bound, proved",
                holds=bool(np.isfinite(bound)),
                evidence=f"proof-{number}-bound",
                status="proved" if np.isfinite(bound) else "undecided",
            ),
        ]
    return found
