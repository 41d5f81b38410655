"""The verdict on a study, and the claims behind it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nlctl.errors import UsageError

from ...report.document import Claim
from ...robustness.statistics.guarantee import check_iid, rounded_down, rounded_up
from .text import DID_NOT_END, margin_text

if TYPE_CHECKING:
    from analysis.studies.result import Finding, Result

__all__ = ["STATEMENTS", "claims", "refusal", "verdict"]

STATEMENTS = ("probability", "sequential")


def verdict(result: Result) -> str:
    """Return the report's first sentences: what is refuted, what is not shown yet, and the
    statement with its assumptions."""
    told = []
    if not result.complete:
        told.append(result.verdict)
    for answer in ("refuted", "not shown yet"):
        these = [finding for finding in result.claims if finding.answer == answer]
        claimed = [f.claim + (f" (needs {f.needs})" if f.needs else "") for f in these]
        if these and result.complete:
            told.append(f"{answer.capitalize()}: {'; '.join(claimed)}.")
    statements = [f.sentence for f in result.findings if f.kind in STATEMENTS]
    if statements:
        told.append(statements[0])
    elif refused := refusal(result):
        told.append(f"There is no statement about a probability: {refused}.")
    else:
        told.append("The study asks for no statement about a probability.")
    return " ".join(told)


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
    """Return what the study claims, with what was found.

    What is shown was sampled, never proved.
    """
    asked = result.asked
    return [
        Claim(
            text=finding.claim,
            holds=bool(finding.holds),
            status=finding.answer,
            evidence=f"{prefix}{finding.key}",
            **(MEASURED[finding.kind] if finding.is_answered else _no_answer)(
                finding, asked[finding.key]
            ),
        )
        for finding in result.claims
    ]


def _no_answer(finding: Finding, asked: Any) -> dict[str, str]:
    return {"measured": finding.sentence, "limit": "an answer"}


def _probability(finding: Finding, asked: Any) -> dict[str, str]:
    n = finding.numbers
    low, high = n["singly"]
    bound = f"at most {rounded_up(high)}" if high < 1 else ""
    if low > 0:
        bound = f"{bound}{', ' * bool(bound)}at least {rounded_down(low)}"
    each = " each" if low > 0 and n["side"] != "both" and high < 1 else ""
    return {
        "measured": f"{n['violations']} of {n['runs']} runs; {bound or 'nothing'} with "
        f"confidence {100 * n['confidence']:g} %{each}{_needs(finding)}",
        "limit": f"≤ {asked.limit:g}",
        "margin": f"{asked.limit - high:.3g}",
    }


def _needs(finding: Finding) -> str:
    return f"; needs {finding.needs}" if finding.needs else ""


def _sequential(finding: Finding, asked: Any) -> dict[str, str]:
    n = finding.numbers
    return {
        "measured": f"{n['violations']} of {n['runs']} runs; {rounded_down(n['lower'])} to "
        f"{rounded_up(n['upper'])} with confidence {100 * n['confidence']:g} %{_needs(finding)}",
        "limit": f"< {asked.limit:g}",
        "margin": f"{asked.limit - n['upper']:.3g}",
    }


def _worst_case(finding: Finding, asked: Any) -> dict[str, str]:
    n = finding.numbers
    ended = margin_text(n["margin"]) == DID_NOT_END
    return {
        "measured": (
            "a run that did not reach its end"
            if ended
            else f"lowest margin found: {margin_text(n['margin'])}"
        )
        + _needs(finding),
        "limit": f"> {asked.limit:g}",
        "margin": "" if ended else f"{n['margin'] - asked.limit:.3g}",
    }


def _radius(finding: Finding, asked: Any) -> dict[str, str]:
    n = finding.numbers
    found = f"violation at size {n['upper']:.4g}"
    if n["upper"] == 0:
        found = f"the nominal values violate, margin {margin_text(n['margin'])}"
    elif n["witness"] is None:
        found = f"no violation found up to size {n['largest']:.4g}"
    return {
        "measured": found + _needs(finding),
        "limit": f"≥ {asked.limit:g}",
        "margin": f"{min(n['upper'], n['largest']) - asked.limit:.3g}",
    }


def _degradation(finding: Finding, asked: Any) -> dict[str, str]:
    row = finding.tables["curve"].loc[asked.at]
    return {
        "measured": f"{row['violations']:.0f} of {row['runs']:.0f} runs at size {asked.at:g}; "
        f"{rounded_down(row['lower'])} to {rounded_up(row['upper'])} with confidence "
        f"{100 * asked.confidence:g} %{_needs(finding)}",
        "limit": f"≤ {asked.limit:g}",
        "margin": f"{asked.limit - row['upper']:.3g}",
    }


def _compare(finding: Finding, asked: Any) -> dict[str, str]:
    a, b = asked.better
    metric = next(iter(asked.metrics))
    pairs = finding.tables["differences"].loc[metric]
    row, text = (
        (pairs.loc[(a, b)], f"{a} − {b}")
        if (a, b) in pairs.index
        else (pairs.loc[(b, a)], f"{b} − {a}")
    )
    level = 1 - asked.confidence
    return {
        "measured": f"median of {text} in {metric}: {row['median']:.4g}, p = {row['p_holm']:.2g}"
        + _needs(finding),
        "limit": f"p ≤ {level:.2g}, {asked.metrics[metric]} is better",
        "margin": f"{level - row['p_holm']:.2g}",
    }


MEASURED: dict[str, Callable[..., dict[str, str]]] = {
    "probability": _probability,
    "sequential": _sequential,
    "worst case": _worst_case,
    "radius": _radius,
    "degradation": _degradation,
    "compare": _compare,
}
