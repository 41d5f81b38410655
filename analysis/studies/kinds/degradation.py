"""The probability of a violation against the size of the uncertainty."""

from collections.abc import Iterator
from typing import ClassVar

from pydantic import Field, model_validator

from nlctl.wording import counted

from ... import figures as figures
from ...report.document import Item, Table, captioned
from ...robustness import bound_verdict, independent
from ...robustness.search.degradation import degradation_curve
from ...robustness.statistics.guarantee import design_assumptions, rounded_down, rounded_up
from .. import page as text
from ..file.schema import Confidence, Flag, Size, Varied, Whole
from ..kind import Ground, Kind, finding_of
from ..page import margin_text
from ..result import Finding, Result
from .context import CLOPPER

_CAPTION = (
    "Share of violations with all deviations from nominal scaled by a factor; bars: intervals with "
    "confidence {confidence:g} %, {together}."
)


class AskedDegradation(Varied):
    """The probability of a violation against the size of the uncertainty."""

    factors: tuple[Size, ...] = Field(min_length=1, description="Sizes, as factors of the box.")
    runs: Whole = Field(ge=1, description="Rows at each size.")
    confidence: Confidence = 0.95
    simultaneous: Flag = Field(False, description="Whether all intervals hold together.")
    at: Size = Field(1.0, description="The size that the claim is about, one of the factors.")
    limit: Confidence | None = Field(None, description="Claim: the upper bound at that size.")
    claimed: ClassVar[str] = "a violation has at most probability {limit:g} at the size {at:g}"

    @model_validator(mode="after")
    def _at_is_looked_at(self) -> "AskedDegradation":
        if self.limit is not None and self.at not in self.factors:
            raise ValueError(f"the claim is about size {self.at:g}, which is not among the factors")
        return self


def _run(asked: AskedDegradation, ground: Ground) -> Finding:
    """Bound the probability of a violation at every size."""
    space = ground.space(asked.quantities)
    curve = degradation_curve(
        ground.simulate,
        space,
        asked.factors,
        asked.runs,
        entropy=ground.seed,
        confidence=asked.confidence,
        simultaneous=asked.simultaneous,
    )
    bounds = dict(zip(curve.factors, curve.statements, strict=True))
    counts = "; ".join(
        f"at {factor:g}: {one.violations} of {one.runs} ({rounded_down(one.lower)} to "
        f"{rounded_up(one.upper)})"
        for factor, one in bounds.items()
    )
    together = "together" if asked.simultaneous else "each by itself"
    assumed = "; ".join(design_assumptions(independent(space, asked.runs, ground.seed)))
    limit = asked.limit
    verdict = {} if limit is None else vars(bound_verdict(bounds[asked.at], limit))
    return finding_of(
        asked,
        f"Violations with all deviations scaled: {counts}. The bounds hold with confidence "
        f"{100 * asked.confidence:g} %, {together}. Assumed: "
        f"at each size {assumed}.",
        **verdict,
        runs=sum(one.runs for one in curve.statements),
        numbers={"confidence": asked.confidence, "simultaneous": asked.simultaneous},
        tables={"curve": curve.table},
    )


def _measured(finding: Finding, asked: AskedDegradation) -> dict[str, str]:
    row = finding.tables["curve"].loc[asked.at]
    return {
        "measured": f"{row['violations']:.0f} of {counted(int(row['runs']), 'run')} at size "
        f"{asked.at:g}; {rounded_down(row['lower'])} to {rounded_up(row['upper'])} with "
        f"confidence {100 * asked.confidence:g} %",
        "limit": f"≤ {asked.limit:g}",
        "margin": f"{asked.limit - row['upper']:.3g}",
    }


def _items(finding: Finding, result: Result, asked: AskedDegradation, key: str) -> Iterator[Item]:
    """Yield the probability of a violation against the size of the uncertainty."""
    n, curve = finding.numbers, finding.tables["curve"]
    together = "all together" if n["simultaneous"] else "each by itself"
    caption = _CAPTION.format(confidence=100 * n["confidence"], together=together)
    yield captioned(
        f"{key}-curve",
        caption,
        "; ".join(f"{size:g}: {row['rate']:.4g}" for size, row in curve.iterrows()),
        figures.degradation(curve, asked.at, asked.limit),
    )
    yield Table(
        caption=f"{text.SAME}.",
        folded=True,
        columns=("factor", "violations", "runs", "share", "from", "to", "least margin", "median"),
        rows=[
            (
                size,
                row["violations"],
                row["runs"],
                *(f"{row[column]:.4g}" for column in ("rate", "lower", "upper")),
                *(margin_text(row[column]) for column in ("least_margin", "median_margin")),
            )
            for size, row in curve.to_dict("index").items()
        ],
    )


DEGRADATION = Kind(
    name="degradation",
    schema=AskedDegradation,
    run=_run,
    title="Degradation with the size of the uncertainty",
    answers="probability of a violation against the size of the box",
    claims="the bound at size `at` is at most `limit`",
    method=(
        "The intervals along the degradation curve are exact for independent draws (Clopper and "
        "Pearson 1934); all sizes use the same random numbers."
    ),
    sources=(CLOPPER,),
    quantities=("quantities",),
    runs=lambda asked, setup: len(asked.factors) * asked.runs,
    keeps_rows=False,
    largest=lambda asked, quantities: asked.runs * len(asked.factors),
    measured=_measured,
    items=_items,
)
