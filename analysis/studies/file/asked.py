"""What the tables of a study file consist of: types of fields, and keys of every analysis."""

from __future__ import annotations

from typing import Annotated, Any, ClassVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

# strict: "0.3" and true are no numbers
Number = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Whole = Annotated[int, Field(strict=True)]
Names = tuple[str, ...]
Id = Annotated[str, Field(pattern=r"^[^\s,;]*$", max_length=60)]
Pair = tuple[Number, Number]
Flag = Annotated[bool, Field(strict=True)]
Confidence = Annotated[float, Field(strict=True, gt=0, lt=1)]
Size = Annotated[float, Field(strict=True, ge=0, allow_inf_nan=False)]


class Strict(BaseModel):
    """A table of the file: unknown keys are refused, nothing changes once it is read."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _listed(value: object) -> Any:
    return (value,) if isinstance(value, str) else value


Ids = Annotated[tuple[Id, ...], BeforeValidator(_listed)]


class Asked(Strict):
    """Keys of every analysis in a study file; the schema of a kind adds its own.

    Examples
    --------
    The keys of a table of one's own, checked as those of nlctl's kinds are:

    >>> from typing import Any, ClassVar
    >>> from pydantic import Field
    >>> from nlctl.analysis.studies import Asked
    >>> class Spread(Asked):
    ...     of: str = Field("spec", description="Column of the main table.")
    ...     limit: float | None = Field(None, gt=0, description="Claim: it is at most this.")
    ...     claimed: ClassVar[str] = "the spread is at most {limit:g}"
    >>> Spread(kind="spread", limit=0.5).claim
    'the spread is at most 0.5'
    >>> Spread(kind="spread", limit=-1.0)
    Traceback (most recent call last):
    pydantic_core._pydantic_core.ValidationError: 1 validation error for Spread
    limit
      Input should be greater than 0 ...
    """

    key: str = Field(
        "",
        pattern=r"^[a-z0-9-]*$",
        description="Name of its folder: lower-case letters, digits, hyphens; by default the kind.",
    )
    title: str = Field("", description="Its heading in the report.")
    id: Ids = Field(
        (), description="Ids of the requirements that its claim answers: one, or a list."
    )
    kind: str
    definition: ClassVar[Any] = None
    """The `Kind` of the table, once a file has named it."""
    claimed: ClassVar[str] = ""
    """What it claims with a key ``limit`` that is given, with keys of the table in braces."""

    @property
    def claim(self) -> str:
        """What the study claims by asking for it; empty if it asks and claims nothing."""
        is_given = getattr(self, "limit", None) is not None
        return self.claimed.format_map(vars(self)) if is_given else ""


class Varied(Asked):
    """An analysis that may vary a part of the quantities.

    Examples
    --------
    >>> from nlctl.analysis.studies import Varied
    >>> class Corners(Varied):
    ...     levels: int = 2
    >>> Corners(kind="corners", quantities=["lag.T"]).quantities
    ('lag.T',)
    >>> Corners(kind="corners").quantities  # all
    ()
    """

    quantities: Names = Field((), description="What is varied, the rest nominal; all by default.")
