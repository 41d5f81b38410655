"""A page about a loop of one's own: what it is, how it runs, what was proved and studied of it.

::

    made = loop_report(loop, title="Pendulum", response=response, author="N. N.", revision="B")
    page = write_report(made, "reports/pendulum")             # of nlctl.analysis.report
    write_pdf(page, "reports/pendulum.pdf")

What is of another loop is refused: a response whose samples are not the loop's outputs or whose
states do not follow from its equations (`nlctl.analysis.response_of_loop` says how closely), a
study, a ledger or a certificate whose record is of other equations, parameters or wires.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.diagrams import leaves
from nlctl.errors import DiagramError, ParameterError
from nlctl.names import unknown
from nlctl.upstream.systems import SystemResponse
from nlctl.wording import counted

from .figures.axes import BLUE, stacked_axes
from .loop_record import difference_text, fact_differences, loop_facts
from .lyapunov.certificate.certify import AnyCertificate
from .lyapunov.ledger import Ledger
from .paper.page.proof import ledger_tables
from .paper.page.proof_text import ledger_text
from .report.document import (
    Claim,
    Figure,
    History,
    Item,
    Paragraph,
    Report,
    Section,
    Table,
    versions,
)
from .response_of_loop import check_response, own_parameters
from .studies.origin import diagram_differences
from .studies.page.claims import claims as study_claims
from .studies.page.loop import diagram_figures, equation_items, parameter_tables
from .studies.page.methods import limits as study_limits
from .studies.page.methods import methods
from .studies.page.redrawn import loop_again, rows_again
from .studies.page.report import numbers, study_sections
from .studies.page.text import without_assumptions
from .studies.result import Result

__all__ = ["loop_report"]

_SHOWN = 6  # signals that are drawn by default
ONE_RUN = "Runs are samples of the model: nothing follows for other values, or for later times."


@as_annotated
def loop_report(
    loop: ct.InputOutputSystem,
    *,
    title: str,
    response: ct.TimeResponseData | None = None,
    signals: Sequence[str] = (),
    params: Mapping[str, Any] | None = None,
    ledger: Ledger | None = None,
    certificate: AnyCertificate | None = None,
    study: Result | None = None,
    sections: Sequence[Section] = (),
    claims: Sequence[Claim] = (),
    question: str = "",
    verdict: str = "",
    author: str = "",
    revision: str = "",
    date: str = "",
    references: Sequence[str] = (),
    command: str = "",
) -> Report:
    """Compose a report about a loop, from what was computed of it.

    Only spans of the response are simulated, to see that it is the loop's, and rows of a study
    that are drawn.

    Examples
    --------
    A page of one's own loop, and what of it the page says:

    >>> import numpy as np
    >>> import nlctl
    >>> from nlctl.analysis.loop_report import loop_report
    >>> loop = nlctl.actuators.cascade({"zone": nlctl.DeadZone(), "lag": nlctl.Lag()})
    >>> run = nlctl.input_output_response(loop, np.linspace(0, 1, 101), 1.0)
    >>> report = loop_report(loop, title="A lag behind a dead zone", response=run)
    >>> report.verdict
    "The loop 'actuator' has 2 blocks and 1 state."
    """
    blocks, states = counted(len(list(leaves(loop))), "block"), counted(loop.nstates or 0, "state")
    found = [f"The loop '{loop.name}' has {blocks} and {states}."]
    parts = _model(loop)
    if response is not None:
        given = own_parameters(loop, response) if params is None else dict(params)
        check_response(loop, response, given)
        parts.append(_run(loop, response, signals, given))
    parts += sections
    if ledger is not None:
        _check_record(loop, "ledger", ledger.loop, ledger.loop_facts)
        found.append(ledger_text(ledger))
        parts.append(_proof(ledger))
    if certificate is not None:
        _check_record(loop, "certificate", certificate.name, certificate.loop_facts)
        found.append(f"Certificate: {certificate.verdict}.")
        parts.append(_certified(certificate))
    if study is not None:
        _check_study(loop, study)
        found.append(without_assumptions(study.verdict))
        parts += _studied(study)
    described, sources = ([], []) if study is None else methods(study)
    return Report(
        title=title,
        question=question or ("" if study is None else study.study.study.question),
        verdict=verdict or " ".join(found),
        claims=[*claims, *([] if study is None else study_claims(study, "study-"))],
        sections=parts,
        command=command,
        provenance=versions(),
        numbers=_numbers(response, study),
        methods=described,
        limits=[ONE_RUN] if study is None else study_limits(study),
        references=list(dict.fromkeys([*references, *sources])),
        author=author,
        revision=revision,
        date=date,
    )


def _model(loop: ct.InputOutputSystem) -> list[Section]:
    """Return what the loop is: diagram, parameters, equations."""
    shown = [*diagram_figures(loop), *parameter_tables(loop)]
    equations = [*equation_items(loop)]
    return [
        Section(key="loop", title="The loop", items=shown),
        Section(
            key="loop-equations",
            title="The equations of the loop",
            items=equations,
            level=3,
            folded=True,
        ),
    ]


def _run(
    loop: ct.InputOutputSystem,
    response: SystemResponse,
    signals: Sequence[str],
    params: Mapping[str, Any],
) -> Section:
    """Return one run: its own parameters, its signals over time, and their ranges."""
    curves = _signals(response)
    for name in signals:
        if name not in curves:
            raise unknown("output", name, curves, f"of '{loop.name}'")
    shown = {name: curves[name] for name in [*signals] or [*curves][:_SHOWN]}
    t = np.asarray(response.time, dtype=float)
    figure, axes = stacked_axes(rows=len(shown), height=1.5 if len(shown) > 1 else 2.4)
    for ax, (name, samples) in zip(axes, shown.items(), strict=True):
        ax.plot(t, samples, color=BLUE, linewidth=1.3)
        ax.set_ylabel(name, parse_math=False)
    axes[-1].set_xlabel("time t (s)")
    caption = f"{', '.join(shown)} over {t[-1]:g} s."
    ranges = [
        (n, *(float(f(y)) for f in (np.min, np.max)), float(y[-1])) for n, y in curves.items()
    ]
    told = "; ".join(f"{n} between {low:.4g} and {high:.4g}" for n, low, high, _ in ranges)
    history = History(
        key="run-history", caption=caption, description=told, time=t, signals=curves,
        shown=tuple(shown),
    )  # fmt: skip
    items: list[Item] = [
        *_own_values("This run", params),
        Figure(key="run-signals", caption=caption, description=told, figure=figure),
        history,
        Table(
            caption="The outputs of this run: least and largest sample, and the last one.",
            columns=("output", "least", "largest", "at the end"),
            rows=ranges,
        ),
    ]
    return Section(key="run", title="A run", items=items)


def _own_values(what: str, params: Mapping[str, Any]) -> list[Item]:
    """Return a paragraph with the values that are not those of the loop as it stands."""
    values = ", ".join(f"{name} = {value}" for name, value in params.items())
    return [Paragraph(text=f"{what} has values of its own: {values}.")] if params else []


def _signals(response: Any) -> dict[str, np.ndarray]:
    """Return the outputs of a run by name."""
    y = np.asarray(response.y, dtype=float)
    if y.ndim != 2:
        raise ParameterError(
            f"the response has outputs of shape {y.shape}: a report shows one run, give one trace"
        )
    return dict(zip(response.output_labels, y, strict=True))


def _proof(found: Ledger) -> Section:
    """Return a ledger: a sentence, then its lines."""
    items: list[Item] = [Paragraph(text=ledger_text(found)), *ledger_tables(found.lines)]
    return Section(key="ledger", title="The proof line by line", items=items, folded=True)


def _certified(certificate: AnyCertificate) -> Section:
    """Return a certificate: what is proved, then every constant with where it comes from."""
    table = Table(
        caption="The constants of the certificate, and the bounds that follow from them.",
        columns=("symbol", "value", "unit", "status", "how", "for"),
        rows=[
            (c.symbol, f"{c.value:.6g}", c.unit, c.provenance, c.how, c.over)
            for c in certificate.constants
        ],
        status="status",
    )
    own = _own_values("The loop of the proof", certificate.params)
    items: list[Item] = [Paragraph(text=f"{certificate.verdict}."), *own, table]
    return Section(key="certificate", title="A bound for all time", items=items)


def _studied(result: Result) -> list[Section]:
    """Return a study as the part behind everything else."""
    lost: list[str] = []
    kept = rows_again(result, loop_again(result, tell=lost.append))
    intro = [result.study.study.question or result.study.study.title, *lost]
    heading = Section(
        key="study",
        title=f"The study: {result.study.study.title}",
        items=[Paragraph(text=words) for words in intro],
    )
    return [heading, *study_sections(result, kept, prefix="study-", level=3, limits=False)]


def _numbers(response: Any, study: Result | None) -> dict[str, Any]:
    """Return all numbers for ``report.json``."""
    told: dict[str, Any] = {} if study is None else {"study": numbers(study)}
    if response is not None:
        told["run"] = {
            name: {"least": y.min(), "largest": y.max(), "last": y[-1]}
            for name, y in _signals(response).items()
        }
    return told


def _check_record(
    loop: ct.InputOutputSystem, what: str, name: str, facts: Mapping[str, Mapping[str, str]]
) -> None:
    """Refuse what has a record of another loop."""
    if told := difference_text([*fact_differences(facts, loop_facts(loop))]):
        raise DiagramError(
            f"the {what} is of another loop '{name}' than '{loop.name}' ({told}): give the loop "
            "that it was made of"
        )


def _check_study(loop: ct.InputOutputSystem, result: Result) -> None:
    if told := diagram_differences(result.origin, loop):
        raise DiagramError(
            f"the study in '{result.folder}' is of another loop than '{loop.name}' ({told}): give "
            "the loop as the study's function makes it"
        )
