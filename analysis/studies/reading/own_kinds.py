"""The shape of a study file, with kinds of one's own: what ``kind = "spread.py:spread"`` means."""

import functools
import operator
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from pydantic import ConfigDict, Field, create_model

from nlctl.annotations import as_annotated
from nlctl.errors import ParameterError, UsageError

from ..code.rule import Grant, untrusted
from ..file.errors import Problem
from ..file.schema import Asked, Study
from ..file.toml import KeyPath, read_toml
from ..kind import Ground, Kind, tagged
from ..kinds import KINDS
from ..resolve import named_kind
from ..result import Finding

STAND_IN = "gone"
"""Name of the kinds that stand in for those that are not known."""


@functools.cache
def study_model(kinds: tuple[tuple[str, Kind], ...]) -> type[Study]:
    """Return the shape of study files that may ask for these kinds of analysis."""
    schemas: Any = functools.reduce(operator.or_, (tagged(kind, tag) for tag, kind in kinds))
    one: Any = Annotated[schemas, Field(discriminator="kind")]
    many: Any = tuple[one, ...]
    about = Study.model_fields["analysis"].description
    return create_model(
        "Study",
        __base__=Study,
        __doc__="A study file.",
        __module__=Study.__module__,
        analysis=(many, Field((), description=about)),
    )


def model_of(kinds: Mapping[str, Kind]) -> type[Study]:
    """Return the shape of study files with nlctl's kinds of analysis and some of one's own."""
    return study_model((*((kind.name, kind) for kind in KINDS), *kinds.items()))


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


def own_kinds(data: Mapping[str, Any], grant: Grant) -> tuple[dict[str, Kind], list[Problem]]:
    """Return the kinds that a study file names by their place, and the mistakes among them."""
    # The files and modules that have them are run, see `code.rule`.
    named = list(_named(data))
    problems = untrusted(named, grant)
    refused = {problem.place for problem in problems}
    kinds: dict[str, Kind] = {}
    for place, name in named:
        if place in refused or name in kinds:
            continue
        try:
            kinds[name] = named_kind(name, grant)
        except UsageError as error:
            problems.append(Problem(place=place, message=str(error)))
    return kinds, problems


def _named(data: Mapping[str, Any]) -> Iterator[tuple[KeyPath, str]]:
    """Yield the places of kinds in a file that may be of any shape."""
    listed = data.get("analysis")
    for i, entry in enumerate(listed if isinstance(listed, list) else ()):
        name = entry.get("kind") if isinstance(entry, Mapping) else None
        if isinstance(name, str) and ":" in name:
            yield ("analysis", i, "kind"), name


def stand_ins(data: Mapping[str, Any], known: Mapping[str, Kind]) -> dict[str, Kind]:
    """Return for every kind of one's own that is not known one that takes any table."""
    # With it a run can be read whose kind has gone: its findings keep what they say.
    names = dict.fromkeys(name for _, name in _named(data) if name not in known)
    return {name: _stand_in(name) for name in names}


def _stand_in(name: str) -> Kind:
    def run(asked: object, ground: Ground) -> Finding:
        raise ParameterError(f"the kind of analysis '{name}' has gone: put it back")

    title = name.rpartition(":")[2].replace("_", " ").capitalize()
    return Kind(name=STAND_IN, schema=_AnyTable, run=run, title=title)


class _AnyTable(Asked):
    """A table of a kind that has gone."""

    model_config = ConfigDict(extra="allow", frozen=True)
