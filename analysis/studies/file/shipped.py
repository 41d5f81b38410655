"""The study files that come with nlctl."""

from __future__ import annotations

from pathlib import Path

from nlctl.annotations import as_annotated
from nlctl.names import check_known

# a checkout has them in reports/, a wheel carries copies in its package
FOLDERS = (Path(__file__).parents[3] / "reports", Path(__file__).parents[1] / "reports")


@as_annotated
def shipped(name: str) -> Path:
    """Return the study file of this name, such as ``"example-1-quick"``.

    Parameters
    ----------
    name : str
        Without the ending.

    Returns
    -------
    pathlib.Path
        Of the file that is installed.

    Raises
    ------
    UnknownNameError
        If there is none.

    Examples
    --------
    >>> from nlctl.analysis.studies import shipped
    >>> shipped("example-1-quick").name
    'example-1-quick.toml'
    >>> shipped("example-1-quik")
    Traceback (most recent call last):
    nlctl.errors.UnknownNameError: unknown study 'example-1-quik'; nearest: 'example-1-quick', ...
    """
    studies = {path.stem: path for folder in FOLDERS for path in sorted(folder.glob("*.toml"))}
    check_known("study", name, studies)
    return studies[name]
