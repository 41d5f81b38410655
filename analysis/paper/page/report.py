"""The reproduction of the paper as a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
import pandas as pd

from ... import figures
from ...lyapunov.nussbaum.long_run import LongRun
from ...report.document import Figure, Paragraph, Report, Section, captioned
from ...reproductions.page import report_of
from ...reproductions.paper import PaperRuns
from ...reproductions.sections import model_section, part_sections
from .. import TAIL, checks
from .. import figures as histories
from ..evidence import NO_FAR_RUNS, Evidence, FarRuns
from . import text as text
from .claims import number_claims, paper_claims, paper_verdict, proof_claims, theorem_claims
from .closing import closing_sections, metric_table
from .proof import lyapunov_sections
from .record import LV_2017
from .rivals import rivals_section
from .sampling import sampling_section

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
