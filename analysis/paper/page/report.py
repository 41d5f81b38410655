"""The reproduction of the paper as a report: verdict, claims, sections."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from ... import figures
from ...lyapunov.nussbaum.long_run import LongRun
from ...recheck.integers import text_above
from ...report.document import Claim, Figure, Paragraph, Report, Section, captioned
from ...reproductions.page import model_section, part_sections, report_of
from ...reproductions.paper import FoundNumber, PaperRun, PaperRuns
from .. import BOUND, HORIZON, TAIL, checks
from .. import figures as histories
from ..burst import Burst
from ..evidence import NO_FAR_RUNS, Evidence, FarRuns
from . import text as text
from .closing import closing_sections, metric_table, rivals_section, sampling_section
from .proof import lyapunov_sections
from .record import LV_2017

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


NO_PROOFS: Mapping[int, Evidence] = MappingProxyType({})


def paper_report(
    runs: PaperRuns,
    *,
    proofs: Mapping[int, Evidence] = NO_PROOFS,
    far: FarRuns = NO_FAR_RUNS,
    studies: Sequence[Section] = (),
    numerics: pd.DataFrame | None = None,
    sampling: pd.DataFrame | None = None,
    rivals: pd.DataFrame | None = None,
    sections: Sequence[Section] | None = None,
) -> Report:
    """Compose the reproduction report from the runs of `nlctl.analysis.paper.CASES`."""
    compared = checks(runs)
    if sections is None:
        sections = paper_sections(runs, proofs=proofs, far=far)
    return report_of(
        LV_2017,
        verdict=paper_verdict(runs, compared, far.runs),
        lead=_lead(runs, far.runs.get("2")),
        claims=[
            *paper_claims(runs),
            *theorem_claims(proofs, far),
            *number_claims(compared),
            *proof_claims(proofs),
        ],
        sections=[
            *sections,
            *([] if sampling is None else [sampling_section(sampling)]),
            *([] if rivals is None else [rivals_section(rivals)]),
            *studies,
            *closing_sections(runs, numerics),
        ],
        numbers={key: dict(run.metrics) for key, run in runs.items()},
    )


def paper_sections(
    runs: PaperRuns,
    *,
    proofs: Mapping[int, Evidence] = NO_PROOFS,
    far: FarRuns = NO_FAR_RUNS,
) -> list[Section]:
    """Return the sections of `paper_report` up to those on studies; the arguments are the same."""
    return [
        model_section(LV_2017),
        *(
            section
            for part in LV_2017.parts
            for section in part_sections(LV_2017, part, runs, checks(runs))
        ),
        _exchange(runs),
        *lyapunov_sections(proofs, far),
    ]


def _lead(runs: PaperRuns, long: LongRun | None) -> Figure:
    """Return the picture at the top: Example 2 follows its reference, and zeta drifts."""
    run = runs["2"]
    caption = text.LEAD if long is None else f"{text.LEAD} {text.LEAD_DRIFT}"
    if long is not None and np.isfinite(long.burst):
        caption = f"{caption} {text.LEAD_BURST.format(hours=long.burst / 3600)}"
    return captioned(
        "lead",
        caption,
        f"max |e₁| for t ≥ {TAIL:g} s is {run.metrics['tail_max_e']:.5g}.",
        figures.story(run.time, run.signals["y"], run.signals["yd"], long),
    )


def _exchange(runs: PaperRuns) -> Section:
    pairs = (("1", "1-backlash"), ("2", "2-dead-zone"))
    return Section(
        key="exchange",
        title="Both controllers with either actuator",
        items=[
            Paragraph(
                text="The paper's second claim is that the controller need not know which actuator "
                "it drives. Each example is simulated with the actuator of the other one; the "
                "controller and its parameters are unchanged."
            ),
            metric_table(
                "With its own and with the other actuator.",
                [runs[k] for pair in pairs for k in pair],
            ),
            *(
                Figure(
                    key=f"exchange-{n}",
                    caption=f"Example {n}: tracking error with its own and the other actuator.",
                    description=f"Example {n}: max |e₁| for t ≥ {TAIL:g} s is "
                    f"{runs[n].metrics['tail_max_e']:.5g} with its own actuator and "
                    f"{runs[other].metrics['tail_max_e']:.5g} with the other one.",
                    figure=histories.error_comparison(
                        [runs[n], runs[other]], ["own actuator", "other actuator"]
                    ),
                )
                for n, other in pairs
            ),
        ],
    )
