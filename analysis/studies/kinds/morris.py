"""Screening: how much a step in each quantity changes a response."""

from collections.abc import Iterator

from pydantic import Field

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, captioned
from ...robustness import Design, Space, elementary_effects, morris
from .. import page as text
from ..file.schema import Asked, Whole
from ..kind import Ground, Kind, finding_of
from ..page import column_in_words, result_table
from ..result import Finding, Result
from .context import response

MORRIS_CAPTION = (
    "Elementary effects on '{of}': μ* is the mean magnitude, with its bootstrap interval; a σ far "
    "from 0 shows that a quantity does not act linearly, or not on its own."
)
MORRIS_1991 = (
    "M. Morris: Factorial sampling plans for preliminary computational experiments. Technometrics "
    "33 (1991) 161–174. doi 10.1080/00401706.1991.10484804."
)


class Morris(Asked):
    """Screening: how much a step in each quantity changes a response."""

    trajectories: Whole = Field(20, ge=2)
    levels: Whole = Field(4, ge=2)
    of: str = Field("spec", description="Column: a margin, or a metric that every row has.")


def _design(asked: Morris, space: Space, seed: int) -> Design:
    return morris(space, asked.trajectories, asked.levels, seed)


def _run(asked: Morris, ground: Ground) -> Finding | None:
    design = _design(asked, ground.prepared.experiment.space, ground.seed)
    done = ground.run_design(design)
    if not done.complete:
        return None
    values, failed, numbers = response(asked.of, ground, done)
    table = elementary_effects(design, values)
    order = ", ".join(table.nlargest(3, "mu_star").index)
    return finding_of(
        asked,
        f"Largest mean effects on '{asked.of}': {order} ({counted(done.done, 'run')} of a Morris "
        f"design, which screens and proves nothing).{failed}",
        runs=done.done,
        numbers={"of": asked.of, "trajectories": asked.trajectories, **numbers},
        tables={"effects": table},
    )


def _items(finding: Finding, result: Result, asked: Morris, key: str) -> Iterator[Item]:
    """Yield the elementary effects."""
    table = finding.tables["effects"]
    caption = MORRIS_CAPTION.format(of=finding.numbers["of"])
    yield captioned(
        f"{key}-effects",
        caption,
        f"μ*: {column_in_words(table['mu_star'])}.",
        figures.screening(table),
    )
    yield result_table(
        table.sort_values("mu_star", ascending=False, kind="stable"),
        f"{text.SAME}; μ: mean effect with its sign.",
        {"mu": "μ", "mu_star": "μ*", "low": "from", "high": "to", "sigma": "σ"},
    )


MORRIS = Kind(
    name="morris",
    schema=Morris,
    run=_run,
    title="Sensitivity: screening",
    answers="screening: which quantity matters at all",
    method=("Screening walks through the box, one quantity a step (Morris 1991)."),
    sources=(MORRIS_1991,),
    columns=("of",),
    design=_design,
    largest=lambda asked, quantities: max(asked.levels, asked.trajectories * (quantities + 2)),
    items=_items,
)
