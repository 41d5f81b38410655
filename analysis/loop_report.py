"""A page about a loop of one's own: what it is, how it runs, what was proved and studied of it.

::

    made = loop_report(loop, title="Pendulum", response=response, author="N. N.", revision="B")
    page = write_report(made, "reports/pendulum")             # of analysis.report
    write_pdf(page, "reports/pendulum.pdf")

What is seen to be of another loop is refused: a response whose samples are not the loop's outputs
of its states, a study whose record is of other equations, parameters or wires, a ledger or a
certificate of another name.  That a response's states follow from the loop's equations, and that a
ledger or a certificate is of this very loop and not of a namesake, is not checked.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import control as ct
import numpy as np

from nlctl.diagrams import leaves
from nlctl.errors import DiagramError, ParameterError
from nlctl.names import unknown
from nlctl.wording import counted

from .figures.axes import BLUE, stacked_axes
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
_POINTS = 8  # samples at which a response is compared with the loop's outputs
_EQUAL = 1e-6  # relative to the largest sample of a signal
ONE_RUN = "Runs are samples of the model: nothing follows for other values, or for later times."


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
    """Compose a report about a loop, from what was computed of it; nothing is simulated.

    But for a study: some of its rows are simulated again to be drawn.

    Parameters
    ----------
    loop : control.InputOutputSystem
        A diagram, of nlctl's blocks or others; or a single system.
    title : str
    response : control.TimeResponseData, optional
        A run of the loop.
    signals : sequence of str, optional
        Outputs that are drawn; by default the first six.
    params : mapping, optional
        The parameters that the run was made with.
    ledger : Ledger, optional
        Of `analysis.lyapunov.ledger`.
    certificate : Certificate, ModelReferenceCertificate or SlidingModeCertificate, optional
        Of `analysis.lyapunov.certify`.
    study : Result, optional
        Of `analysis.studies.run` or `analysis.studies.load_result`.
    sections : sequence of Section, optional
        One's own, of `analysis.report`; they stand behind the run.
    claims : sequence of Claim, optional
        One's own; those of the study follow.
    question, verdict : str, optional
        What was asked, and what was found; by default what the study, the ledger and the
        certificate say.
    author, revision, date : str, optional
        For the title page.
    references : sequence of str, optional
    command : str, optional
        Command that makes the page again.

    Returns
    -------
    Report
        For `analysis.report.write_report`, and `analysis.report.framed` in a notebook.

    Raises
    ------
    DiagramError
        If the response, the ledger, the certificate or the study is seen to be of another loop.
    UnknownNameError
        If the loop has no output that `signals` names.

    Examples
    --------
    A page of one's own loop, and what of it the page says:

    >>> import numpy as np
    >>> import nlctl
    >>> from analysis.loop_report import loop_report
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
        _check_response(loop, response, params)
        parts.append(_run(loop, response, signals))
    parts += sections
    if ledger is not None:
        _check_name(loop, ledger.loop, "ledger")
        found.append(ledger_text(ledger))
        parts.append(_proof(ledger))
    if certificate is not None:
        _check_name(loop, certificate.name, "certificate")
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


def _run(loop: ct.InputOutputSystem, response: Any, signals: Sequence[str]) -> Section:
    """Return one run: its signals over time, and their ranges."""
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
        Figure(key="run-signals", caption=caption, description=told, figure=figure),
        history,
        Table(
            caption="The outputs of this run: least and largest sample, and the last one.",
            columns=("output", "least", "largest", "at the end"),
            rows=ranges,
        ),
    ]
    return Section(key="run", title="A run", items=items)


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
    items: list[Item] = [Paragraph(text=f"{certificate.verdict}."), table]
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


def _check_response(
    loop: ct.InputOutputSystem, response: Any, params: Mapping[str, Any] | None
) -> None:
    """Refuse a response whose samples are not the loop's own outputs of its states."""
    curves = _signals(response)
    if list(curves) != list(loop.output_labels) or np.shape(response.x)[0] != loop.nstates:
        raise DiagramError(
            f"the response is not of '{loop.name}', whose outputs are "
            f"{', '.join(loop.output_labels)} and which has "
            f"{counted(loop.nstates or 0, 'state')}: it has {', '.join(curves)} and "
            f"{np.shape(response.x)[0]}"
        )
    for place, values in _own_outputs(loop, response, params):
        for (name, y), own in zip(curves.items(), values, strict=True):
            scale = float(np.nanmax(np.abs(y), initial=1.0))
            if np.isfinite(y[place]) and not abs(y[place] - own) <= _EQUAL * scale:
                raise DiagramError(
                    f"the response is not of '{loop.name}': {name} is {y[place]:.6g} at "
                    f"t = {response.time[place]:g} s, and the loop says {own:.6g}; give the "
                    "parameters that it was run with as params={...}"
                )


def _own_outputs(
    loop: Any, response: Any, params: Mapping[str, Any] | None
) -> Iterator[tuple[int, np.ndarray]]:
    """Yield the loop's outputs at some samples, as python-control evaluates them."""
    u = np.zeros((loop.ninputs or 0, len(response.time)))
    u = u if response.u is None else np.asarray(response.u, dtype=float).reshape(u.shape)
    x = np.asarray(response.x, dtype=float)
    for place in np.unique(np.linspace(0, len(response.time) - 1, _POINTS).astype(int)):
        with np.errstate(all="ignore"):
            own = loop.output(response.time[place], x[:, place], u[:, place], dict(params or {}))
        yield int(place), np.atleast_1d(np.asarray(own, dtype=float))


def _check_name(loop: ct.InputOutputSystem, name: str, what: str) -> None:
    if name != loop.name:
        raise DiagramError(f"the {what} is of '{name}', the report of '{loop.name}'")


def _check_study(loop: ct.InputOutputSystem, result: Result) -> None:
    if told := diagram_differences(result.origin, loop):
        raise DiagramError(
            f"the study in '{result.folder}' is of another loop than '{loop.name}' ({told}): give "
            "the loop as the study's function makes it"
        )
