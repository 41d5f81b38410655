"""The papers that are reproduced, by name: one module each, with its record."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from ..catalogue import paper_summaries

if TYPE_CHECKING:
    from ..reproductions.paper import Paper

__all__ = ["named_paper", "paper_key", "paper_names"]


def paper_names() -> list[str]:
    """Return the names of all papers.

    Returns
    -------
    list of str
        Each ``author_year``.

    Examples
    --------
    >>> "tabuada_2007" in nlctl.analysis.papers.paper_names()
    True
    """
    return list(paper_summaries())


def paper_key(name: str, kind: str = "paper") -> str:
    """Return the key of a paper that is called ``tabuada_2007`` or ``tabuada-2007``.

    Parameters
    ----------
    name : str
        As somebody writes it.
    kind : str, optional
        What the message calls what is unknown.

    Returns
    -------
    str
        One of `paper_names`.

    Raises
    ------
    UnknownNameError
        If there is no such paper; the nearest is named.

    Examples
    --------
    >>> nlctl.analysis.papers.paper_key("tabuada-2007")
    'tabuada_2007'
    """
    key = name.replace("-", "_")
    if key not in paper_names():
        from nlctl.names import unknown

        raise unknown(kind, name, paper_names())
    return key


def named_paper(name: str) -> Paper:
    """Return the paper of a name.

    Parameters
    ----------
    name : str
        As `paper_key` takes it.

    Returns
    -------
    Paper
        Its record.

    Raises
    ------
    UnknownNameError
        If there is no such paper.

    Examples
    --------
    >>> from nlctl.analysis.papers import named_paper
    >>> [case.key for case in named_paper("tabuada-2007").cases]
    ['1']
    """
    paper: Paper = import_module(f"{__name__}.{paper_key(name)}").REPRODUCTION
    return paper
