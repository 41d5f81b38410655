"""A study as TOML, and back."""

from __future__ import annotations

import tomli_w

from .schema import Study
from .toml import read_toml

__all__ = ["from_toml", "to_toml"]


def to_toml(study: Study) -> str:
    """Return the text of a study file with this study; what is left to defaults is left out."""
    return tomli_w.dumps(study.model_dump(mode="json", exclude_unset=True, exclude_none=True))


def from_toml(text: str) -> Study:
    """Return the study in a text that `to_toml` has written.

    Raises
    ------
    ValueError
        If it is none.
    """
    return Study.model_validate(read_toml(text))
