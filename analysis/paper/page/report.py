"""The reproduction of the paper as a report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import control as ct
import numpy as np
import pandas as pd

from nlctl.diagrams import leaves

from ... import figures
from ...lyapunov.nussbaum.long_run import LongRun
from ...pages.diagram import diagram_figure
from ...report.document import Figure, History, Item, Paragraph, Report, Section, Table, versions
from ...report.equations import equations_of
from .. import CASES, HORIZON, TAIL, CaseRun, Check, checks
from .. import figures as histories
from ..burst import Burst
from . import text as text
from .claims import number_claims, paper_claims, paper_verdict, proof_claims, theorem_claims
from .closing import closing_sections, metric_table
from .proof import Evidence, lyapunov_sections
from .rivals import rivals_section
from .sampling import sampling_section

__all__ = ["paper_report", "paper_sections"]

_Runs = Mapping[str, CaseRun]


def paper_report(
    runs: _Runs,
    *,
    proofs: Mapping[int, Evidence] | None = None,
    far: Mapping[str, LongRun] | None = None,
    burst: Burst | None = None,
    studies: Sequence[Section] = (),
    numerics: pd.DataFrame | None = None,
    sampling: pd.DataFrame | None = None,
    rivals: pd.DataFrame | None = None,
    sections: Sequence[Section] | None = None,
) -> Report:
    """Compose the reproduction report from the runs of `nlctl.analysis.paper.CASES`."""
    compared = checks(runs)
    if sections is None:
        sections = paper_sections(runs, proofs=proofs, far=far, burst=burst)
    return Report(
        title="Adaptive neural control with an uncertain actuator, reproduced",
        question=text.QUESTION,
        verdict=paper_verdict(runs, compared, far or {}),
        lead=_lead(runs, (far or {}).get("2")),
        claims=[
            *paper_claims(runs),
            *theorem_claims(proofs or {}, far or {}, burst),
            *number_claims(compared),
            *proof_claims(proofs or {}),
        ],
        sections=[
            *sections,
            *([] if sampling is None else [sampling_section(sampling)]),
            *([] if rivals is None else [rivals_section(rivals)]),
            *studies,
            *closing_sections(runs, numerics),
        ],
        command="nlctl report",
        provenance=versions("python-flint", "clarabel", "cma"),
        numbers={key: dict(run.metrics) for key, run in runs.items()},
        methods=text.METHODS_TEXT,
        references=text.REFERENCES,
    )


def paper_sections(
    runs: _Runs,
    *,
    proofs: Mapping[int, Evidence] | None = None,
    far: Mapping[str, LongRun] | None = None,
    burst: Burst | None = None,
) -> list[Section]:
    """Return the sections of `paper_report` up to those on studies; the arguments are the same."""
    compared = checks(runs)
    return [
        _model(),
        *_example(1, runs, compared),
        *_example(2, runs, compared),
        _exchange(runs),
        *lyapunov_sections(proofs or {}, far, burst),
    ]


def _lead(runs: _Runs, long: LongRun | None) -> Figure:
    """Return the picture at the top: Example 2 follows its reference, and zeta drifts."""
    run = runs["2"]
    told = text.LEAD if long is None else f"{text.LEAD} {text.LEAD_DRIFT}"
    if long is not None and np.isfinite(long.burst):
        told = f"{told} {text.LEAD_BURST.format(hours=long.burst / 3600)}"
    return Figure(
        key="lead",
        caption=told,
        description=f"{told} max |e₁| for t ≥ {TAIL:g} s is {run.metrics['tail_max_e']:.5g}.",
        figure=figures.story(run.time, run.signals["y"], run.signals["yd"], long),
    )


def _model() -> Section:
    return Section(
        key="model",
        title="Plant class and controller",
        folded=True,
        items=[
            Paragraph(text=f"The paper: {text.CITATION}"),
            Paragraph(text="The plant is a chain of integrators with a non-affine last equation:"),
            text.PLANT_CLASS,
            *text.CONTROLLER_PART,
        ],
    )


def _example(number: int, runs: _Runs, compared: Sequence[Check]) -> list[Section]:
    run = runs[str(number)]
    diagram = run.case.diagram
    key = f"example-{number}"
    tracking, control, *others = _time_histories(key, run)
    caption = "The closed loop as simulated, and the inside of its controller."
    picture = diagram_figure(diagram, f"{key}-diagram", caption)
    equations = equations_of(diagram, ("plant", "actuator"), f"Ex. {number}")
    shown = [*equations, picture, tracking, control, _interactive(number, run)]
    folded: tuple[tuple[str, str, list[Item]], ...] = (
        ("signals", "The other signals over time, and the actuator's characteristic", [*others]),
        ("parameters", "Parameters as printed and as used", [_parameter_table(number, diagram)]),
        (
            "figures",
            f"The {_count(number, compared)} numbers to reach",
            [_check_table(number, compared)],
        ),
    )
    return [
        Section(key=key, title=text.TITLES[number], items=shown),
        *(
            Section(key=f"{key}-{name}", title=title, level=3, folded=True, items=items)
            for name, title, items in folded
        ),
    ]


def _count(number: int, compared: Sequence[Check]) -> int:
    own = {case.key for case in CASES if case.example == number}
    return sum(check.expectation.case in own for check in compared)


def _time_histories(key: str, run: CaseRun) -> list[Figure]:
    m = run.metrics
    plots = (
        ("tracking", histories.tracking, r"Output \(y\) and reference \(y_d\)."),
        (
            "input",
            histories.control_input,
            r"Control input \(u\), and output \(v\) of the actuator.",
        ),
        (
            "error",
            histories.tracking_error,
            r"Tracking error \(e_1\); the band holds it for "
            f"t ≥ {TAIL:g} s.",
        ),
        ("states", histories.upper_states, "The other states of the plant."),
        ("actuator", histories.actuator_path, "The part of the actuator's characteristic in use."),
        (
            "nussbaum",
            histories.nussbaum_gain,
            r"Argument \(\zeta\) and value \(N(\zeta)\) of the Nussbaum gain.",
        ),
        (
            "adaptation",
            histories.adaptation,
            r"Norm of the weights \(\hat W\), and estimate \(\hat\delta\) of the robust term.",
        ),
    )
    summary = (
        f"max |e₁| for t ≥ {TAIL:g} s is {m['tail_max_e']:.5g}, max |u| {m['max_u']:.5g}, "
        f"zeta ends at {m['zeta_end']:.5g}, max norm of W_hat {m['max_W']:.3g}."
    )
    return [
        Figure(
            key=f"{key}-{name}",
            caption=caption,
            description=f"{caption} Over {HORIZON:g} s: {summary}",
            figure=draw_figure(run),
        )
        for name, draw_figure, caption in plots
    ]


def _interactive(number: int, run: CaseRun) -> History:
    names = ("y", "yd", "e", "u", "v", "zeta")
    return History(
        key=f"example-{number}-history",
        caption=f"{text.TITLES[number]}: output y, reference yd, tracking error e, control input "
        "u, output of the actuator v, argument of the Nussbaum gain zeta.",
        description=f"Chart of {', '.join(names)} over {HORIZON:g} s; the figures above show the "
        "same signals, the slider below tells their values.",
        time=run.time,
        signals={name: run.signals[name] for name in names},
        shown=("y", "yd", "e", "zeta"),
    )


def _parameter_table(number: int, diagram: ct.InterconnectedSystem) -> Table:
    specs = {leaf.system.name: getattr(leaf.system, "spec", None) for leaf in leaves(diagram)}
    return Table(
        caption="The paper's values, the values in use (read from the blocks), and open points.",
        columns=("parameter", "as printed", "as used", "remark"),
        rows=[
            (name, printed, used.format(**specs).replace("-", "−"), remark)
            for name, printed, used, remark in text.PRINTED[number]
        ],
    )


def _check_table(number: int, compared: Sequence[Check]) -> Table:
    titles = {case.key: case.title for case in CASES if case.example == number}
    rows = [
        (
            titles[c.expectation.case],
            c.metric.meaning,
            f"{c.value:.10f}",
            c.expectation.printed,
            f"{c.error:.1e}",
            f"{c.expectation.tolerance:.0e}",
            "pass" if c.passed else "fail",
        )
        for c in compared
        if c.expectation.case in titles
    ]
    return Table(
        caption=(
            "Found by nlctl's engine from the python-control diagrams; to reach: converged digits "
            "of an independent event-located integration."
        ),
        columns=("case", "quantity", "found", "to reach", "difference", "tolerance", "status"),
        rows=rows,
        status="status",
    )


def _exchange(runs: _Runs) -> Section:
    pairs = (("1", "1-backlash"), ("2", "2-dead-zone"))
    return Section(
        key="exchange",
        title="Exchange of actuators",
        items=[
            Paragraph(
                text="The paper's second claim: the controller need not know which actuator it "
                "drives. Each example runs with the other one's actuator; the controller and its "
                "parameters stay the same."
            ),
            metric_table(
                "With its own and with the other actuator.",
                [runs[k] for pair in pairs for k in pair],
            ),
            *(
                Figure(
                    key=f"exchange-{own}",
                    caption=f"Example {own}: tracking error with its own and the other actuator.",
                    description=f"Example {own}: max |e₁| for t ≥ {TAIL:g} s is "
                    f"{runs[own].metrics['tail_max_e']:.5g} with its own actuator and "
                    f"{runs[other].metrics['tail_max_e']:.5g} with the other one.",
                    figure=histories.error_comparison(
                        [runs[own], runs[other]], ["own actuator", "other actuator"]
                    ),
                )
                for own, other in pairs
            ),
        ],
    )
