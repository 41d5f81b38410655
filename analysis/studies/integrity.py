"""What ``nlctl verify`` says: every difference between a run folder and its sealed record."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import UsageError
from nlctl.wording import counted

from .folder import read_through
from .intact import contents


@described_record(made_by="verify")
class Integrity:
    """What `verify` found of a run folder."""

    folder: Path
    files: int  # Number of files that are as they were written.
    rows: dict[str, int]  # Number of rows by part, ``"rows"`` for the main table.
    analyses: tuple[str, ...]  # Keys of the analyses that the study asks for.
    done: tuple[str, ...]  # Those that are done.
    # What is missing, edited or too much, one sentence each; empty if the folder is intact.
    problems: tuple[str, ...]
    others: tuple[str, ...]  # Files that the run has not written, its page aside.
    has_page: bool = False  # Whether the record has a page that was made of the run.

    @property
    def is_intact(self) -> bool:
        """Whether nothing is missing, edited or too much."""
        return not self.problems

    def __str__(self) -> str:
        if self.problems:
            count = counted(len(self.problems), "difference")
            return "\n  ".join([f"'{self.folder}' is not intact, {count}:", *self.problems])
        rows, page = sum(self.rows.values()), ", and its page" if self.has_page else ""
        return (
            f"'{self.folder}' is intact: {counted(self.files, 'file')}, {counted(rows, 'row')}, "
            f"{len(self.done)} of {counted(len(self.analyses), 'analysis', 'analyses')}{page}."
        )


@as_annotated
def verify(folder: str | Path) -> Integrity:
    """Hold every file of a run folder against the record that its run has sealed.

    Nothing is imported, run or drawn.

    Parameters
    ----------
    folder : str or Path
        Where `run` has kept its results.

    Raises
    ------
    RunFolderError
        If it holds no run, or none that has come to an end, or the record itself is damaged.

    Examples
    --------
    A lost analysis is named, and so is everything else that differs:

    >>> import shutil
    >>> import tempfile
    >>> from pathlib import Path
    >>> from nlctl.analysis.studies import read_study, run, verify
    >>> text = '''
    ... loop = "nlctl:block"
    ... options = { spec = { block = "Lag" }, name = "lag" }
    ... study = { title = "A lag", seed = 1 }
    ... space."lag.T" = { uniform = [0.05, 0.4] }
    ... inputs.u = 1.0
    ... spec.rises = "always from 1 s on v >= 0.9"
    ... time = { end = 1.2, step = 0.1 }
    ... runs.size = 20
    ... analysis = [{ kind = "probability", limit = 0.3 }]
    ... '''
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "lag.toml").write_text(text, encoding="utf-8")
    ...     _ = run(read_study(Path(folder, "lag.toml")), Path(folder, "run"))
    ...     before = verify(Path(folder, "run"))
    ...     shutil.rmtree(Path(folder, "run", "probability"))
    ...     after = verify(Path(folder, "run"))
    >>> before.is_intact, before.rows, before.done
    (True, {'rows': 20}, ('probability',))
    >>> after.is_intact, [text[-36:] for text in after.problems]
    (False, ["probability/finding.json' is missing"])
    """
    folder = Path(folder)
    content = contents.sealed_record(folder)
    expected = {contents.CONTENTS, *content["files"], *contents.PAGE_FILES}
    every = (path for path in folder.rglob("*") if contents.is_part(path))
    names = (path.relative_to(folder).as_posix() for path in every)
    in_files = [*contents.problems_in(folder, content)] or [*_contradictions(folder)]
    problems = tuple(dict.fromkeys([*in_files, *contents.page_problems(folder, content)]))
    listed = " ".join(problems)
    return Integrity(
        folder=folder,
        files=len(content["files"]),
        rows=content["rows"],
        analyses=tuple(content["analyses"]),
        done=tuple(content["done"]),
        problems=problems,
        has_page=bool(content["page"]),
        others=tuple(n for n in sorted(names) if n not in expected and f"/{n}'" not in listed),
    )


def _contradictions(folder: Path) -> Iterator[str]:
    """Yield why parts that are as the record says are not those of one run."""
    try:
        read_through(folder)
    except UsageError as error:
        yield str(error)
