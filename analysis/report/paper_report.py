"""The reproduction of the paper as a report."""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from importlib.metadata import version

import control as ct

from nlctl._diagram import leaves
from nlctl.drawing import draw

from .. import figures
from ..lyapunov.long_run import LongRun
from ..reproduction import CASES, HORIZON, METRICS, TAIL, Check, Run, checks
from . import paper_text as text
from .document import Figure, Paragraph, Report, Section, Table
from .lyapunov_part import Evidence, lyapunov_sections
from .paper_claims import claims, verdict

__all__ = ["paper_report"]

Runs = Mapping[str, Run]
Proofs = Mapping[int, Evidence]
Far = Mapping[str, LongRun]
PACKAGES = ("nlctl", "control", "numpy", "scipy", "matplotlib", "python-flint", "cvxpy")


def paper_report(runs: Runs, proofs: Proofs | None = None, far: Far | None = None) -> Report:
    """Compose the reproduction report from the runs of `analysis.reproduction.CASES`.

    Parameters
    ----------
    runs : mapping
        Result of `analysis.reproduction.run_all`.
    proofs : mapping, optional
        What `analysis.report.lyapunov_part.evidence` found, by number of the example.
    far : mapping, optional
        Runs far beyond 20 s, of `analysis.report.lyapunov_evidence.far_runs_in_background`.

    Returns
    -------
    Report
    """
    compared = checks(runs)
    return Report(
        title="Adaptive neural control with an uncertain actuator: the paper reproduced",
        verdict=verdict(compared),
        claims=claims(runs, compared),
        sections=[
            _model(),
            *_example(1, runs, compared),
            *_example(2, runs, compared),
            _exchange(runs),
            *lyapunov_sections(proofs or {}, far),
            _choices(runs),
            _numerics(),
            _limits(runs),
        ],
        command="nlctl report",
        provenance={"Python": platform.python_version()} | {p: version(p) for p in PACKAGES},
        numbers={key: dict(run.metrics) for key, run in runs.items()},
    )


def _model() -> Section:
    return Section(
        key="model",
        title="Plant class and controller",
        items=[
            Paragraph(text=text.CITATION),
            Paragraph(text="The plant is a chain of integrators with a non-affine last equation:"),
            text.PLANT_CLASS,
            Paragraph(text="The controller, with the paper's equation numbers:"),
            *text.CONTROLLER,
        ],
    )


def _example(number: int, runs: Runs, compared: Sequence[Check]) -> list[Section]:
    run = runs[str(number)]
    diagram = run.case.diagram
    blocks = ", ".join(system.name for system in diagram.syslist)
    key = f"example-{number}"
    return [
        Section(
            key=key,
            title=text.TITLES[number],
            items=[
                *text.PLANTS[number],
                Figure(
                    key=f"{key}-diagram",
                    caption="The closed loop as simulated, and the inside of its controller.",
                    description=f"Block diagram of {diagram.name} with the blocks {blocks}.",
                    figure=draw(diagram, expand=True),
                ),
                *_time_histories(key, run),
            ],
        ),
        Section(
            key=f"{key}-parameters",
            title="Parameters as printed and as used",
            level=3,
            items=[_parameter_table(number, diagram)],
        ),
        Section(
            key=f"{key}-figures",
            title="Figures to reach",
            level=3,
            items=[_check_table(number, compared)],
        ),
    ]


def _time_histories(key: str, run: Run) -> list[Figure]:
    m = run.metrics
    plots = (
        ("tracking", figures.tracking, "Output and reference."),
        (
            "error",
            figures.tracking_error,
            f"Tracking error; the band holds it for t ≥ {TAIL:g} s.",
        ),
        ("states", figures.upper_states, "The other states."),
        ("input", figures.control_input, "Control input, and output of the actuator."),
        ("actuator", figures.actuator_path, "Actuator characteristic actually travelled."),
        ("nussbaum", figures.nussbaum_gain, "Argument and value of the Nussbaum gain."),
        ("adaptation", figures.adaptation, "Norm of the weights, and estimate of the robust term."),
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
            "of an independent event-located integration. All quantities are dimensionless."
        ),
        columns=("case", "figure", "found", "to reach", "difference", "tolerance", "status"),
        rows=rows,
        status="status",
    )


def _metric_table(caption: str, cases: Sequence[Run]) -> Table:
    keys = ("tail_max_e", "tail_rms_e", "max_u", "max_r", "zeta_end", "max_W", "max_delta_hat")
    by_key = {m.key: m for m in METRICS}
    return Table(
        caption=caption,
        columns=("example", "variant", *(by_key[k].meaning for k in keys)),
        rows=[
            (str(run.case.example), run.case.title, *(float(run.metrics[k]) for k in keys))
            for run in cases
        ],
    )


def _exchange(runs: Runs) -> Section:
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
            _metric_table(
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
                    figure=figures.error_comparison(
                        [runs[own], runs[other]], ["own actuator", "other actuator"]
                    ),
                )
                for own, other in pairs
            ),
        ],
    )


def _choices(runs: Runs) -> Section:
    shown = [r for r in runs.values() if r.case.group in ("published", "choice")]
    return Section(
        key="choices",
        title="What the paper leaves open",
        items=[
            Paragraph(
                text="Each row changes one reading of the paper and leaves the rest as it is. "
                f"{'None' if _same_verdict(shown) else 'At least one'} raises max |e₁| "
                f"(t ≥ {TAIL:g} s) by more than a quarter."
            ),
            _metric_table(
                "One row per reading; the first row of each example is the default.",
                sorted(shown, key=lambda r: (r.case.example, r.case.group != "published")),
            ),
        ],
    )


def _same_verdict(shown: Sequence[Run]) -> bool:
    """Whether every reading tracks as well as the default, to a quarter of its error."""
    base = {r.case.example: r.metrics["tail_max_e"] for r in shown if r.case.group == "published"}
    return all(r.metrics["tail_max_e"] <= 1.25 * base[r.case.example] for r in shown)


def _numerics() -> Section:
    return Section(
        key="numerics",
        title="Numerics",
        items=[
            Paragraph(
                text="All runs are machine code of the python-control diagrams, compiled by nlctl: "
                "an explicit Runge-Kutta pair of orders 5(4) at relative tolerance 1e-9; steps "
                "end at the corners of the dead zone. Peaks between samples are those of a "
                "parabola. The tests repeat published cases in plain python-control."
            ),
            Paragraph(
                text="The backlash is the play operator itself: within a step its memory stands "
                "still or is carried along, and a step ends where it turns round or touches. (In "
                "plain python-control, which has no hook for accepted steps, its memory relaxes "
                "onto the play at 1000 1/s; the figures then hold to 5e-5.)"
            ),
        ],
    )


def _limits(runs: Runs) -> Section:
    drift = {n: _drift(runs[str(n)]) for n in (1, 2)}
    return Section(
        key="limits",
        title="What this does not show",
        items=[
            Paragraph(
                text=f"The runs end at {HORIZON:g} s, as the paper's do. They show that all "
                "signals stay bounded up to then; they do not show boundedness for all time. ζ "
                f"still moves: from t = {TAIL:g} s to the end it changes by {drift[1]:+.3g} in "
                f"Example 1 and by {drift[2]:+.3g} in Example 2, and N(ζ) changes its sign at 3."
            ),
            Paragraph(
                text="The tracking error does not tend to zero in these runs: it stays at about "
                f"{runs['1'].metrics['tail_max_e']:.2g} and {runs['2'].metrics['tail_max_e']:.2g} "
                "for a reference of amplitude 1."
            ),
        ],
    )


def _drift(run: Run) -> float:
    return float(run.signals["zeta"][-1] - run.signals["zeta"][run.time >= TAIL][0])
