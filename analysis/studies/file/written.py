"""A study as TOML, and back."""

from __future__ import annotations

from collections.abc import Mapping

import tomli_w

from ..kind import Kind
from .own_kinds import model_of
from .schema import Study
from .toml import read_toml

__all__ = ["from_toml", "to_toml"]


def to_toml(study: Study) -> str:
    """Return the text of a study file with this study; what is left to defaults is left out.

    Parameters
    ----------
    study : Study

    Returns
    -------
    str
        TOML.
    """
    return tomli_w.dumps(study.model_dump(mode="json", exclude_unset=True, exclude_none=True))


def from_toml(text: str, own: Mapping[str, Kind] | None = None) -> Study:
    """Return the study in a text that `to_toml` has written.

    Parameters
    ----------
    text : str
    own : mapping of str to Kind, optional
        Kinds of analysis of one's own, as the text calls them.

    Returns
    -------
    Study

    Raises
    ------
    ValueError
        If it is not a study.
    """
    return model_of(own or {}).model_validate(read_toml(text))
