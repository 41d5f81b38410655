"""A page about a loop of one's own: what it is, how it runs, what was proved and studied of it.

::

    made = loop_report(loop, title="Pendulum", response=response, author="N. N.", revision="B")
    page = write_report(made, "reports/pendulum")             # of nlctl.analysis.report
    write_pdf(page, "reports/pendulum.pdf")

What is of another loop is refused: a response whose samples are not the loop's outputs or whose
states do not follow from its equations (`nlctl.analysis.response_of_loop` says how closely), a
study, a ledger or a certificate whose record is of other equations, parameters or wires.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import control as ct

from nlctl.annotations import as_annotated
from nlctl.diagrams import leaves
from nlctl.errors import DiagramError, ParameterError
from nlctl.export.web import WebProgram
from nlctl.responses.time_response import as_response
from nlctl.wording import counted

from .loop_record import difference_text, fact_differences, loop_facts
from .lyapunov.ledger import Ledger
from .lyapunov.proofs.result import Certificate
from .pages.diagram import diagram_sections, outputs_of_run, run_section
from .pages.live import behind_figures, live_item, live_numbers, live_program
from .pages.proof import certificate_section, ledger_section, ledger_text
from .pages.study.claims import claims as study_claims
from .pages.study.histories import Histories, loop_again, rows_again
from .pages.study.methods import limits as study_limits
from .pages.study.methods import methods
from .pages.study.report import numbers, study_sections
from .report.document import Claim, Paragraph, Report, Section, versions
from .response_of_loop import check_response, own_parameters
from .robustness.stl.spec import Requirement
from .studies.origin import diagram_differences
from .studies.page import without_assumptions
from .studies.result import Result

__all__ = ["loop_report"]

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
    certificate: Certificate | None = None,
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
    live: bool | Sequence[str] = False,
    requirements: Sequence[Requirement] = (),
    repeat: Sequence[str] = (),
) -> Report:
    """Compose a report about a loop, from what was computed of it.

    Only spans of the response are simulated, to see that it is the loop's, and rows of a study
    that are drawn.  With `live` the page runs the loop itself, in the browser, see
    `docs/how-to/live.md`: True for sliders of a sensible few, or the names of parameters
    (``"plant.a"``, with a range ``"plant.a=0:3"``), initial states (``"plant.x1(0)"``), inputs and
    faults (``"fault_actuator_v"``).  It shows which of the `requirements`, and of those of the
    study, hold, and writes the run that is seen as words after `repeat`, such as ``["nlctl",
    "simulate", "arm.py:make"]``.

    Examples
    --------
    A page of one's own loop, and what of it the page says:

    >>> from nlctl.analysis.loop_report import loop_report
    >>> loop = nlctl.actuators.cascade({"zone": nlctl.DeadZone(), "lag": nlctl.Lag()})
    >>> run = nlctl.input_output_response(loop, np.linspace(0, 1, 101), 1.0)
    >>> report = loop_report(loop, title="A lag behind a dead zone", response=run)
    >>> report.verdict
    "The loop 'actuator' has 2 blocks and 1 state."
    """
    blocks, states = counted(len(list(leaves(loop))), "block"), counted(loop.nstates or 0, "state")
    sentences = [f"The loop '{loop.name}' has {blocks} and {states}."]
    parts = diagram_sections(loop, ("loop", "loop-equations"))
    overrides, histories = {}, None
    if response is not None:
        overrides = own_parameters(loop, response) if params is None else dict(params)
        check_response(loop, response, overrides)
        parts.append(run_section(loop, response, signals, overrides))
    moved = _moved(loop, response, overrides, live)
    parts += sections
    _proved(loop, ledger, certificate, sentences, parts)
    if study is not None:
        _check_study(loop, study)
        sentences.append(without_assumptions(study.verdict))
        of_study, histories, lost = _runs_again(study)
        requirements = (*requirements, *of_study)
        parts += _study_parts(study, histories, lost)
    if moved is not None:
        item = live_item(
            moved, response, () if isinstance(live, bool) else live, signals=signals,
            requirements=requirements, histories=histories, command=repeat, base=overrides,
        )  # fmt: skip
        parts = [behind_figures(part, item) if part.key == "run" else part for part in parts]
    described, sources = ([], []) if study is None else methods(study)
    return Report(
        title=title,
        question=question or ("" if study is None else study.study.study.question),
        verdict=verdict or " ".join(sentences),
        claims=[*claims, *([] if study is None else study_claims(study, "study-"))],
        sections=parts,
        command=command,
        provenance=versions(),
        numbers=_numbers(response, study, moved),
        methods=described,
        limits=[ONE_RUN] if study is None else study_limits(study),
        references=list(dict.fromkeys([*references, *sources])),
        author=author,
        revision=revision,
        date=date,
    )


def _proved(
    loop: ct.InputOutputSystem,
    ledger: Ledger | None,
    certificate: Certificate | None,
    sentences: list[str],
    parts: list[Section],
) -> None:
    """Add what was proved to the sentences and to the parts of the page."""
    if ledger is not None:
        _check_record(loop, "ledger", ledger.loop, ledger.loop_facts)
        sentences.append(ledger_text(ledger))
        parts.append(ledger_section(ledger, "ledger", "The proof line by line"))
    if certificate is not None:
        _check_record(loop, "certificate", certificate.name, certificate.loop_facts)
        sentences.append(f"Certificate: {certificate.verdict}.")
        parts.append(certificate_section(certificate))


def _moved(
    loop: ct.InputOutputSystem, response: Any, params: Mapping[str, Any], live: object
) -> WebProgram | None:
    """Return what runs on the page, if it is to run."""
    if not live:
        return None
    if response is None:
        raise ParameterError("a page that runs begins with a run: give response=")
    return live_program(loop, as_response(response, loop), params)


def _runs_again(result: Result) -> tuple[Sequence[Requirement], Histories | None, list[str]]:
    """Return what a study requires, some of its runs again, and what was lost of that."""
    lost: list[str] = []
    prepared = loop_again(result, notify=lost.append)
    of_study = () if prepared is None else prepared.experiment.spec.requirements
    return of_study, rows_again(result, prepared), lost


def _study_parts(result: Result, kept: Histories | None, lost: Sequence[str]) -> list[Section]:
    """Return a study as the part behind everything else."""
    intro = [result.study.study.question or result.study.study.title, *lost]
    heading = Section(
        key="study",
        title=f"The study: {result.study.study.title}",
        items=[Paragraph(text=words) for words in intro],
    )
    return [heading, *study_sections(result, kept, prefix="study-", level=3, limits=False)]


def _numbers(response: Any, study: Result | None, moved: WebProgram | None) -> dict[str, Any]:
    """Return all numbers for ``report.json``."""
    content: dict[str, Any] = {} if study is None else {"study": numbers(study)}
    if moved is not None:
        content["live"] = live_numbers(moved)
    if response is not None:
        content["run"] = {
            name: {"least": y.min(), "largest": y.max(), "last": y[-1]}
            for name, y in outputs_of_run(response).items()
        }
    return content


def _check_record(
    loop: ct.InputOutputSystem, what: str, name: str, facts: Mapping[str, Mapping[str, str]]
) -> None:
    """Refuse what has a record of another loop."""
    if differing := difference_text([*fact_differences(facts, loop_facts(loop))]):
        raise DiagramError(
            f"the {what} is of another loop '{name}' than '{loop.name}' ({differing}): give the "
            "loop that it was made of"
        )


def _check_study(loop: ct.InputOutputSystem, result: Result) -> None:
    if differing := diagram_differences(result.origin, loop):
        raise DiagramError(
            f"the study in '{result.folder}' is of another loop than '{loop.name}' ({differing}): "
            "give the loop as the study's function makes it"
        )
