"""The kinds of analysis that a study file may ask for, each with the claim that it may make."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from ..file.field_types import Confidence, Flag, Names, Number, Pair, Size, Strict, Whole

__all__ = [
    "Analysis",
    "Compare",
    "Degradation",
    "Map",
    "Morris",
    "Probability",
    "Radius",
    "Regional",
    "Sequential",
    "Sobol",
    "WorstCase",
]


class Asked(Strict):
    """What every kind has."""

    key: str = Field(
        "",
        pattern=r"^[a-z0-9-]*$",
        description="Name of its folder: lower-case letters, digits, hyphens; by default the kind.",
    )
    title: str = Field("", description="Its heading in the report.")

    @property
    def claim(self) -> str:
        """What the study claims by asking for it; empty if it asks and claims nothing."""
        return ""


class Probability(Asked):
    """Exact bounds of the probability of a violation, from all rows."""

    kind: Literal["probability"]
    confidence: Confidence = 0.99
    side: Literal["upper", "lower", "both"] = "upper"
    limit: Confidence | None = Field(None, description="Claim: the upper bound is at most this.")

    @model_validator(mode="after")
    def _needs_upper(self) -> Probability:
        if self.side == "lower" and self.limit is not None:
            raise ValueError("a limit needs side = 'upper' or 'both', got 'lower'")
        return self

    @property
    def claim(self) -> str:
        limit = self.limit
        return "" if limit is None else f"a violation has at most probability {limit:g}"


class Sequential(Asked):
    """Whether the probability of a violation is below a limit; rows stop when it is decided."""

    kind: Literal["sequential"]
    confidence: Confidence = 0.99
    limit: Confidence = Field(description="Claim: the probability is below this.")

    @property
    def claim(self) -> str:
        return f"the probability of a violation is below {self.limit:g}"


class Morris(Asked):
    """Screening: how much a step in each quantity changes a response."""

    kind: Literal["morris"]
    trajectories: Whole = Field(20, ge=2)
    levels: Whole = Field(4, ge=2)
    of: str = Field("spec", description="Column: a margin, or a metric that every row has.")


class Sobol(Asked):
    """Shares of the variance of a response, with bootstrap intervals."""

    kind: Literal["sobol"]
    size: Whole = Field(ge=2, description="A power of 2; it takes size (quantities + 2) rows.")
    confidence: Confidence = 0.95
    of: str = Field("spec", description="Column: a margin, or a metric that every row has.")


class Regional(Asked):
    """How far values in failing rows differ from those in passing ones."""

    kind: Literal["regional"]


class WorstCase(Asked):
    """The row with the lowest margin that a search finds; a violation is confirmed and shrunk."""

    kind: Literal["worst case"]
    quantities: Names = Field((), description="What is varied, the rest nominal; all by default.")
    runs: Whole = Field(1000, ge=1, description="The search runs at most so many rows.")
    shrink: Flag = Field(True, description="Whether a violation is reduced to few deviations.")
    python_control: Flag = Field(False, description="Whether python-control confirms it as well.")
    limit: Number | None = Field(None, description="Claim: no margin found is this low.")

    @property
    def claim(self) -> str:
        return "" if self.limit is None else f"no margin of {self.limit:g} or lower is found"


class Degradation(Asked):
    """The probability of a violation against the size of the uncertainty."""

    kind: Literal["degradation"]
    quantities: Names = Field((), description="What is varied, the rest nominal; all by default.")
    factors: tuple[Size, ...] = Field(min_length=1, description="Sizes, as factors of the box.")
    runs: Whole = Field(ge=1, description="Rows at each size.")
    confidence: Confidence = 0.95
    simultaneous: Flag = Field(False, description="Whether all intervals hold together.")
    at: Size = Field(1.0, description="The size that the claim is about, one of the factors.")
    limit: Confidence | None = Field(None, description="Claim: the upper bound at that size.")

    @model_validator(mode="after")
    def _at_is_looked_at(self) -> Degradation:
        if self.limit is not None and self.at not in self.factors:
            raise ValueError(f"the claim is about size {self.at:g}, which is not among the factors")
        return self

    @property
    def claim(self) -> str:
        if self.limit is None:
            return ""
        return f"a violation has at most probability {self.limit:g} at the size {self.at:g}"


class Radius(Asked):
    """The smallest size of the uncertainty at which a violation is found."""

    kind: Literal["radius"]
    quantities: Names = Field((), description="What is varied, the rest nominal; all by default.")
    largest: Size = Field(4.0, gt=0, description="Largest size, as a factor of the box.")
    runs: Whole = Field(500, ge=1, description="Rows of the search at each size, at most.")
    tolerance: Confidence = Field(0.02, description="Relative width at which the search ends.")
    draws: Whole = Field(459, ge=0, description="Independent draws for the statement.")
    confidence: Confidence = 0.99
    limit: Size | None = Field(None, description="Claim: none is found below this size.")

    @property
    def claim(self) -> str:
        return "" if self.limit is None else f"no violation is found below size {self.limit:g}"


class Map(Asked):
    """The margin over the plane of two quantities, refined at the boundary."""

    kind: Literal["failure map"]
    x: str = Field(description="A quantity of [space].")
    y: str = Field(description="Another one.")
    x_bounds: Pair | None = Field(None, description="Range of x; its box by default.")
    y_bounds: Pair | None = Field(None, description="Range of y; its box by default.")
    cells: Whole = Field(8, ge=1, description="Cells along each axis of the first grid.")
    levels: Whole = Field(4, ge=0, le=10, description="How often a cell is divided at most.")
    runs: Whole = Field(4000, ge=1, description="Points at most; the first grid always runs.")


class Compare(Asked):
    """Options of one keyword of the loop on the same samples."""

    kind: Literal["compare"]
    keyword: str = Field(description="Keyword of the loop, such as 'controller'.")
    options: dict[str, Any] = Field(
        min_length=1,
        description="Label -> option, as in choices; or { function = ... } that returns these.",
    )
    only: Names = Field((), description="Labels that are compared; all by default.")
    requirements: Names = Field(
        (), description="Requirements that count, whose signals all options have; all by default."
    )
    runs: Whole = Field(ge=2, description="Samples, each of which is run with every option.")
    metrics: dict[str, Literal["smaller", "larger"]] = Field(
        min_length=1, description="Metric -> which is better; the first one ranks."
    )
    confidence: Confidence = 0.95
    better: tuple[str, str] | None = Field(
        None,
        description="Claim: the first label is better than the second in the first metric, by the "
        "sign test over all pairs.",
    )

    @property
    def claim(self) -> str:
        if self.better is None:
            return ""
        a, b = self.better
        level = f"at the level {1 - self.confidence:.2g}"
        return f"{a} is better than {b} in {next(iter(self.metrics))}, {level}"


Analysis = Annotated[
    Probability
    | Sequential
    | Morris
    | Sobol
    | Regional
    | WorstCase
    | Degradation
    | Radius
    | Map
    | Compare,
    Field(discriminator="kind"),
]
