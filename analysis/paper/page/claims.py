"""The verdict on the paper, and the claims behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...lyapunov.nussbaum.long_run import LongRun
from ...recheck.digits import text_above
from ...report.document import Claim
from ...reproductions.cases import PaperRun
from ...reproductions.paper import FoundNumber, PaperRuns
from .. import BOUND, HORIZON, TAIL
from ..burst import Burst
from ..evidence import Evidence, FarRuns

PAPER = "the paper"
ACTUATED = ("1", "2", "1-backlash", "2-dead-zone")  # cases: both examples, both actuators


def paper_verdict(
    runs: PaperRuns, compared: Sequence[FoundNumber], far: Mapping[str, LongRun]
) -> str:
    """Return the report's first sentence, and how the loops end far beyond 20 s."""
    total = len(compared)
    missed = [c for c in compared if not c.holds]
    if missed:
        apart = [np.nan_to_num(c.error / c.statement.tolerance, nan=np.inf) for c in missed]
        worst = missed[int(np.argmax(apart))]
        are = "is" if len(missed) == 1 else "are"
        return (
            f"Not reproduced: {len(missed)} of {total} numbers {are} off, most of all "
            f"{worst.statement.quantity} of {_titled(worst.statement.part)}, "
            f"{worst.statement.case} ({worst.value:.8g} instead of {worst.statement.printed})."
        )
    reproduced = (
        f"{_tracking(runs)}, and all {total} numbers agree with an independent computation."
    )
    bursts = [
        f"{_titled(run.loop)} loses the sign of its gain at {run.burst:.0f} s" for run in _lost(far)
    ]
    if not bursts:
        return reproduced
    return (
        f"{reproduced} The proof of the theorem is not valid: it depends on Lemma 1, which is "
        f"false. Whether all signals stay bounded for all time is open; {', '.join(bursts)}. If "
        "the law knows the sign of the gain, a bound for all time is proved."
    )


def _tracking(runs: PaperRuns) -> str:
    """Return what the errors of the paper's loops are, behind both actuators."""
    loose = [runs[key] for key in ACTUATED if not _tracks(runs[key])]
    if loose:
        cases = ", ".join(run.case.key for run in loose)
        return f"|e₁| exceeds {BOUND:g} after {TAIL:g} s in {cases}"
    return (
        f"The examples are reproduced: over {HORIZON:g} s the same controller keeps "
        f"|e₁| ≤ {BOUND:g} from {TAIL:g} s on in both, through a dead zone and through backlash"
    )


def paper_claims(runs: PaperRuns) -> list[Claim]:
    """Return what the paper claims and these runs can show, with what was found."""
    asked = (
        ("1", "Example 1: the output tracks the reference despite the dead zone"),
        ("2", "Example 2: the output tracks the reference despite backlash"),
        ("1-backlash", "Example 1: the same controller copes with backlash"),
        ("2-dead-zone", "Example 2: the same controller copes with the dead zone"),
    )
    return [
        Claim(
            text=words,
            # all its digits are among the numbers to reach
            measured=f"max |e₁| = {runs[key].metrics['tail_max_e']:.3f} for t ≥ {TAIL:g} s",
            limit=f"|e₁| ≤ {BOUND:g}",
            holds=_tracks(runs[key]),
            evidence="exchange" if "-" in key else f"example-{key}",
            margin=f"{BOUND - runs[key].metrics['tail_max_e']:.3f}",
            by=PAPER,
        )
        for key, words in asked
    ]


def number_claims(compared: Sequence[FoundNumber]) -> list[Claim]:
    """Return our own claim: that what is found here is what another computation finds."""
    reached = sum(c.holds for c in compared)
    return [
        Claim(
            text="All numbers agree with an independent computation",
            measured=f"{reached} of {len(compared)}",
            limit=f"all {len(compared)}",
            holds=reached == len(compared),
            evidence="example-1-figures",
        )
    ]


def _tracks(run: PaperRun) -> bool:
    return run.metrics["tail_max_e"] <= BOUND


def _lost(far: Mapping[str, LongRun]) -> list[LongRun]:
    return [run for run in far.values() if np.isfinite(run.burst)]


def _titled(name: str) -> str:
    return name.replace("_", " ").replace("-", " ").capitalize()


def theorem_claims(proofs: Mapping[int, Evidence], far: FarRuns) -> list[Claim]:
    """Return what the paper claims for all time."""
    claims = [_theorem()] if proofs else []
    return claims + [_bounded(run, far.burst) for run in _lost(far.runs)]


def proof_claims(proofs: Mapping[int, Evidence]) -> list[Claim]:
    """Return what was found of the proof's steps, and what nlctl proves in its place."""
    claims = []
    for number, one in proofs.items():
        lines, bound = one.ledger, one.certificate.C_0
        claims += [
            Claim(
                text=f"Example {number}: the steps of the proof, corrected where possible, hold "
                f"along a run of {HORIZON:g} s",
                measured=f"lines that hold: {lines.tally}",
                limit="none violated",
                holds=not lines.violated,
                evidence=f"proof-{number}",
                status="violated" if lines.violated else "checked",
            ),
            Claim(
                text=f"Example {number}, with the sign of the gain known: |r| is bounded for all "
                "time from the initial state",
                measured=f"|r| ≤ {text_above(bound, 3)}; a run reaches {one.certified_max_r:.3f}",
                limit="any bound, proved",
                holds=bool(np.isfinite(bound)),
                evidence=f"proof-{number}-bound",
                status="proved" if np.isfinite(bound) else "undecided",
            ),
        ]
    return claims


def _theorem() -> Claim:
    return Claim(
        text="The theorem's proof shows that all signals stay bounded for all time",
        measured="no: Lemma 1 is false, and (33) to (36) depend on it",
        limit="proved for all t",
        holds=False,
        evidence="proof-lemma",
        status="refuted",
        by=PAPER,
    )


def _bounded(run: LongRun, burst: Burst | None) -> Claim:
    carried = ""
    if burst is not None:
        peak, _ = burst.peaks
        carried = f"; averaged, |r| peaks at {peak:.2g} and the loop tracks again at ζ = "
        carried += f"{burst.rest:.2f}"
    return Claim(
        text=f"{_titled(run.loop)}: all signals stay bounded for all time",
        measured=f"the gain loses its sign at {run.burst:.0f} s{carried}",
        limit="bounded for all t",
        holds=False,
        evidence="proof",
        status="undecided",
        by=PAPER,
    )
