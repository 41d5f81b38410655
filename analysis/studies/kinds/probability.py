"""Exact bounds of the probability of a violation."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pydantic import Field, model_validator

from nlctl.wording import counted

from ...report.document import Item
from ...robustness import bound_verdict, violation_probability
from ...robustness.statistics.guarantee import rounded_down, rounded_up
from ..file.schema import Asked, Confidence
from ..kind import Ground, Kind, finding_of
from ..page import running_items
from ..result import Finding, Result
from .context import CLOPPER, HOWARD, ROBBINS

DECIDES_FIXED = (
    " The verdict rests on the exact bounds at the end alone, drawn as a bar: their number of runs "
    "was fixed in advance. The band shows how the estimate settled; it is wider because it allows "
    "for looking after every run, and decides nothing."
)


class Probability(Asked):
    """Exact bounds of the probability of a violation, from all rows."""

    confidence: Confidence = 0.99
    side: Literal["upper", "lower", "both"] = "upper"
    limit: Confidence | None = Field(None, description="Claim: the upper bound is at most this.")
    claimed: ClassVar[str] = "a violation has at most probability {limit:g}"

    @model_validator(mode="after")
    def _needs_upper(self) -> "Probability":
        if self.side == "lower" and self.limit is not None:
            raise ValueError("a limit needs side = 'upper' or 'both', got 'lower'")
        return self


def _run(asked: Probability, ground: Ground) -> Finding:
    design, margins = ground.main
    violation = violation_probability(design, margins, asked.confidence, asked.side)
    verdict = {} if asked.limit is None else vars(bound_verdict(violation, asked.limit))
    return finding_of(
        asked, str(violation), **verdict, runs=violation.runs, numbers=violation.plain()
    )


def _measured(finding: Finding, asked: Probability) -> dict[str, str]:
    n = finding.numbers
    low, high = n["singly"]
    bound = f"at most {rounded_up(high)}" if high < 1 else ""
    if low > 0:
        bound = f"{bound}{', ' * bool(bound)}at least {rounded_down(low)}"
    singly = " each" if low > 0 and n["side"] != "both" and high < 1 else ""
    return {
        "measured": f"{n['violations']} of {counted(n['runs'], 'run')}; {bound or 'nothing'} with "
        f"confidence {100 * n['confidence']:g} %{singly}",
        "limit": f"≤ {asked.limit:g}",
        "margin": f"{asked.limit - high:.3g}",
    }


def _items(finding: Finding, result: Result, asked: Probability, key: str) -> Iterator[Item]:
    """Yield the estimate while the rows came in, with the exact bounds at the end."""
    low, high = finding.numbers["singly"]
    fixed = (float(low), float(high))
    yield from running_items(finding, result, asked, key, decides=DECIDES_FIXED, fixed=fixed)


PROBABILITY = Kind(
    name="probability",
    schema=Probability,
    run=_run,
    title="Probability of a violation",
    answers="exact bounds of the probability of a violation, from the main table",
    claims="the upper bound is at most `limit`",
    method=(
        "The bounds of the probability of a violation are exact for independent draws (Clopper and "
        "Pearson 1934). The running estimate is drawn with a confidence sequence, valid at every "
        "number of runs (Robbins 1970; Howard et al. 2021)."
    ),
    sources=(CLOPPER, ROBBINS, HOWARD),
    needs_rows=True,
    is_statement=True,
    measured=_measured,
    items=_items,
)
