"""Types of the fields of a study file."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

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
