"""The report of the paper from Python, as a notebook makes it: in parts, and whole."""

from contextlib import contextmanager

import pytest
from studies_example import write

from nlctl.analysis.paper import CASES
from nlctl.analysis.paper.page.report import paper_sections
from nlctl.analysis.paper.report import clear, compose, robustness
from nlctl.analysis.reproductions.paper import simulate_cases
from nlctl.analysis.studies import RunFolderError, read_study, run


class Watched:
    """Counts what is done of each part of the work."""

    def __init__(self):
        self.done, self.totals = {}, {}

    @contextmanager
    def __call__(self, what, total):
        self.done[what], self.totals[what] = 0, total

        def advance(amount):
            self.done[what] += amount

        yield advance


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study of a cheap loop, run."""
    here = tmp_path_factory.mktemp("paper")
    run(read_study(write(here)), here / "run")
    return here


@pytest.mark.slow
def test_runs_of_any_study_are_a_part(folder):
    """Its verdict, and what each analysis found, without a word of what is missing."""
    told = []
    part, *others = robustness([folder / "run"], notify=told.append)
    assert (part.title, told) == ("Robustness", [])
    assert next(section.title for section in others if section.level == 3) == "A lag"
    (row,) = part.items[1].rows
    assert row[2] == "shown"


def test_what_a_part_lacks_is_told(folder, tmp_path):
    """A loop that has gone costs the fans, and the sentence goes to whoever asks for the part."""
    study = write(tmp_path)
    run(read_study(study), tmp_path / "run")
    (tmp_path / "loop.py").unlink()
    told = []
    assert robustness([tmp_path / "run"], notify=told.append)
    assert len(told) == 1
    assert told[0].startswith("the report has no fans and no diagram: ")


@pytest.mark.slow
def test_only_runs_are_cleared(folder, tmp_path):
    """What holds something else stays, and is named."""
    write(tmp_path)
    run(read_study(tmp_path / "study.toml"), tmp_path / "run")
    clear(tmp_path, ["run", "absent"])
    assert not (tmp_path / "run").exists()
    run(read_study(tmp_path / "study.toml"), tmp_path / "run")
    (tmp_path / "run" / "notes.txt").touch()
    with pytest.raises(RunFolderError, match=r"notes\.txt"):
        clear(tmp_path, ["run"])


@pytest.mark.weekly
def test_the_whole_begins_with_the_reproduction(tmp_path):
    """With a short proof, no far runs and no studies: every step is watched, nothing is written."""
    watched = Watched()
    made = compose(tmp_path, studies=(), horizon=2.0, far=False, watch=watched)
    assert watched.done == watched.totals
    assert watched.totals["simulating"] == len(CASES)
    assert made.passed
    keys = [section.key for section in made.report.sections]
    first = [section.key for section in paper_sections(simulate_cases(CASES))]
    assert keys[: len(first) + 1] == [*first, "proof"]
    assert {key.rpartition("-")[2] for key in keys[len(first) + 1 :]} >= {"1", "2"}
    assert not any(key.startswith("robustness") for key in keys)
    assert list(tmp_path.iterdir()) == []
