"""Whether a probability is below a limit, decided while the rows come in."""

from functools import partial
from typing import ClassVar

from pydantic import Field

from nlctl.wording import counted

from ...robustness import decide, test_verdict
from ...robustness.runs.progress import until_decided
from ...robustness.statistics.guarantee import rounded_down, rounded_up
from ..file.schema import Asked, Confidence
from ..kind import Ground, Kind, finding_of
from ..page import running_items
from ..result import Finding
from .context import HOWARD, ROBBINS

DECIDES_SEQUENCE = " The verdict rests on the band: it is reached where the limit leaves it."


class Sequential(Asked):
    """Whether the probability of a violation is below a limit; rows stop when it is decided."""

    confidence: Confidence = 0.99
    limit: Confidence = Field(description="Claim: the probability is below this.")
    claimed: ClassVar[str] = "the probability of a violation is below {limit:g}"


def _run(asked: Sequential, ground: Ground) -> Finding:
    design, margins = ground.main
    test = decide(design, margins, asked.limit, asked.confidence)
    return finding_of(
        asked,
        str(test),
        **vars(test_verdict(test)),
        runs=test.statement.runs,
        numbers={"decision": test.decision, **test.statement.plain()},
    )


def _measured(finding: Finding, asked: Sequential) -> dict[str, str]:
    n = finding.numbers
    return {
        "measured": f"{n['violations']} of {counted(n['runs'], 'run')}; "
        f"{rounded_down(n['lower'])} to {rounded_up(n['upper'])} with confidence "
        f"{100 * n['confidence']:g} %",
        "limit": f"< {asked.limit:g}",
        "margin": f"{asked.limit - n['upper']:.3g}",
    }


SEQUENTIAL = Kind(
    name="sequential",
    schema=Sequential,
    run=_run,
    title="Sequential test",
    answers="the same, and rows end as soon as it is decided",
    claims="the probability is below `limit`",
    method=(
        "The sequential test uses a confidence sequence, valid at every number of runs (Robbins "
        "1970; Howard et al. 2021)."
    ),
    sources=(ROBBINS, HOWARD),
    needs_rows=True,
    is_statement=True,
    stop=lambda asked, design: until_decided(design, asked.limit, asked.confidence),
    measured=_measured,
    items=partial(running_items, decides=DECIDES_SEQUENCE),
)
