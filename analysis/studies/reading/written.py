"""A study as TOML, and back."""

from __future__ import annotations

from collections.abc import Mapping

import tomli_w

from nlctl.annotations import as_annotated

from ..file.schema import Study, study_data
from ..file.toml import read_toml
from ..kind import Kind
from .own_kinds import model_of


@as_annotated
def to_toml(study: Study) -> str:
    """Return the text of a study file with this study; what is left to defaults is left out.

    Parameters
    ----------
    study : Study
        What is written.

    Returns
    -------
    str
        TOML.

    Examples
    --------
    >>> from nlctl.analysis.studies import from_toml, shipped, to_toml
    >>> study = from_toml(shipped("example-1-quick").read_text(encoding="utf-8"))
    >>> text = to_toml(study)
    >>> from_toml(text) == study
    True
    >>> print(text[text.index("[time]"):].split("[metrics]")[0].strip())
    [time]
    end = 20.0
    step = 0.01
    """
    return tomli_w.dumps(study_data(study))


@as_annotated
def from_toml(text: str, kinds: Mapping[str, Kind] | None = None) -> Study:
    """Return the study in a text that `to_toml` has written.

    Parameters
    ----------
    text : str
        In TOML.
    kinds : mapping of str to Kind, optional
        Kinds of analysis of one's own, as the text calls them.

    Returns
    -------
    Study
        Equal to the one that was written.

    Raises
    ------
    ValueError
        If it is not a study.

    Examples
    --------
    >>> from nlctl.analysis.studies import from_toml
    >>> study = from_toml('''
    ... loop = "example-1"
    ... study = { title = "Does it track?", seed = 1 }
    ... space."actuator.b_r".uniform = [0.3, 0.7]
    ... spec.tracks = "always from 10 s on |e| <= 0.15"
    ... time = { end = 20.0, step = 0.01 }
    ... ''')
    >>> study.space["actuator.b_r"].uniform, study.spec["tracks"].formula
    ((0.3, 0.7), 'always from 10 s on |e| <= 0.15')
    >>> study.solver.rtol  # the default
    1e-08
    """
    return model_of(kinds or {}).model_validate(read_toml(text))
