"""The verdict on a study, the claims behind it, and which requirement each of them answers."""

from collections.abc import Iterator
from typing import Any

from nlctl.errors import UsageError

from ...report.document import Claim, Section, Table
from ...robustness.statistics.guarantee import check_iid
from ...studies.file.schema import Asked, keyed
from ...studies.page import without_assumptions
from ...studies.result import Finding, Result

AT_ONCE = 2
"""So many findings are in the verdict where nothing is claimed."""


def verdict(result: Result) -> str:
    """Return the report's first sentences: what is refuted, what is not shown yet, and the
    statement with its assumptions."""
    sentences = []
    if not result.complete:
        sentences.append(result.verdict)
    for answer in ("refuted", "not shown yet"):
        these = [finding for finding in result.claims if finding.answer == answer]
        claimed = [f.claim + (f" (needs {f.needs})" if f.needs else "") for f in these]
        if these and result.complete:
            sentences.append(f"{answer.capitalize()}: {'; '.join(claimed)}.")
    asked = result.asked
    statements = [f.sentence for f in result.findings if asked[f.key].definition.is_statement]
    if statements:
        sentences.append(statements[0])
    elif refused := refusal(result):
        sentences.append(f"There is no statement about a probability: {refused}.")
    elif not result.claims and (answered := [f for f in result.findings if f.is_answered]):
        sentences += [without_assumptions(finding.sentence) for finding in answered[:AT_ONCE]]
    else:
        sentences.append("The study asks for no statement about a probability.")
    return " ".join(sentences)


def refusal(result: Result) -> str:
    """Return why the rows of the main table support no guarantee; empty if they may."""
    if result.rows is None or result.rows.design is None:
        return ""
    try:
        check_iid(result.rows.design)
    except UsageError as refused:
        return str(refused)
    return ""


def claims(result: Result, prefix: str = "") -> list[Claim]:
    """Return what the study claims, with what was found."""
    # What is shown was sampled, never proved.
    asked = result.asked
    return [
        Claim(
            text=finding.claim,
            holds=bool(finding.holds),
            status=finding.answer,
            evidence=f"{prefix}{finding.key}",
            ids=asked[finding.key].id,
            **_measured(finding, asked[finding.key]),
        )
        for finding in result.claims
    ]


def _measured(finding: Finding, asked: Asked) -> dict[str, str]:
    """Return what was measured of a claim, its limit, and the margin between the two."""
    if not finding.is_answered:
        return {"measured": finding.sentence, "limit": "an answer"}
    measured = asked.definition.measured
    if measured is None:
        cells = {"measured": without_assumptions(finding.sentence), "limit": ""}
    else:
        cells = dict(measured(finding, asked))
    needs = f"; needs {finding.needs}" if finding.needs else ""
    return cells | {"measured": cells["measured"] + needs}


CAPTION = (
    "From requirement to evidence. No claim: no analysis answers the requirement; without an id: "
    "the claim names no requirement."
)


def has_ids(result: Result) -> bool:
    """Whether a study gives any requirement an id."""
    return any(rule.id for rule in result.study.spec.values())


def traceability(result: Result, prefix: str = "") -> Iterator[Section]:
    """Yield the table of requirements with their claims; nothing where there are no ids."""
    if has_ids(result):
        table = Table(
            caption=CAPTION,
            columns=("id", "requirement", "formula", "claim", "verdict", "evidence"),
            rows=[*_requirement_rows(result, prefix), *_other_rows(result, prefix)],
            status="verdict",
            links="evidence",
        )
        yield Section(key="study_traceability", title="Requirements and evidence", items=[table])


def _requirement_rows(result: Result, prefix: str) -> Iterator[tuple[str, ...]]:
    """Yield the rows of each requirement, one for each claim that answers it."""
    every = keyed(result.study)
    for name, rule in result.study.spec.items():
        answering = {key: asked for key, asked in every.items() if rule.id and rule.id in asked.id}
        for key, asked in answering.items():
            yield (rule.id, name, rule.formula, *_claim_cells(result, key, asked, prefix))
        if not answering:
            yield rule.id, name, rule.formula, "", "no claim", ""


def _other_rows(result: Result, prefix: str) -> Iterator[tuple[str, ...]]:
    """Yield the claims that name no requirement."""
    for key, asked in keyed(result.study).items():
        if asked.claim and not asked.id:
            yield "", "", "", *_claim_cells(result, key, asked, prefix)


def _claim_cells(result: Result, key: str, asked: Any, prefix: str) -> tuple[str, str, str]:
    """Return the claim of an analysis, its verdict, and the key of its evidence."""
    answered = {finding.key: finding for finding in result.findings}.get(key)
    if answered is None:
        return asked.claim, "not run yet", ""
    return answered.claim, answered.answer, f"{prefix}{key}"
