"""``nlctl compare``: what equals itself has no difference, what cannot be compared is named."""

import math
import shutil

import pytest
from command_line import nlctl_here
from studies_example import HEAD, ROWS, write

from nlctl.analysis.robustness.runs.store import differences_of
from nlctl.analysis.studies import read_study, run

SEARCHED = f"""{HEAD}{ROWS}
[[analysis]]
kind = "worst case"
runs = 20
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Run a study twice, each with its report; and two folders that lack something."""
    here = tmp_path_factory.mktemp("compare")
    path = write(here, SEARCHED)
    for name in ("one", "a copy"):
        run(read_study(path), here / name, threads=1)
        assert nlctl_here("report", name, cwd=here).returncode == 0
    shutil.copytree(here / "one", here / "bare")
    for file in ("report.json", "index.html"):
        (here / "bare" / file).unlink()
    shutil.copytree(here / "bare", here / "begun")
    (here / "begun" / "results.json").unlink()
    (here / "empty").mkdir()
    (here / "lone").mkdir()
    shutil.copy(here / "one" / "report.json", here / "lone")
    return here


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(
    ("first", "second", "code", "words"),
    [
        ("one", "one", 0, "no difference"),
        ("one", "a copy", 0, "no difference"),  # the page names its own folder in commands
        ("bare", "bare", 0, "no difference"),
        ("one", "bare", 0, "no difference"),  # both are runs, whatever pages they have
        ("one/report.json", "a copy/report.json", 0, "no difference"),
        ("lone", "bare", 2, "'bare' is a run without a report: make it with 'nlctl report bare'"),
        ("one", "begun", 2, "'begun' is a run that is not done: finish it with 'nlctl run STUDY"),
        ("empty", "one", 2, "'empty' holds neither a report nor a run of a study"),
        ("one", "nowhere", 2, "there is no 'nowhere'"),
    ],
)
def test_two_folders_are_compared_or_refused_in_a_sentence(folder, first, second, code, words):
    """Equal runs have no difference; what lacks results is named with the next step."""
    told = nlctl_here("compare", first, second, cwd=folder)
    assert (told.returncode, words in told.stdout + told.stderr) == (code, True), told
    assert len((told.stdout + told.stderr).strip().splitlines()) == 1
    assert "Errno" not in told.stderr


@pytest.mark.parametrize(
    ("one", "other", "places"),
    [
        ({"a": math.nan}, {"a": math.nan}, []),
        ({"a": [1, math.nan, [math.nan]]}, {"a": [1, math.nan, [math.nan]]}, []),
        ({"a": [{"b": math.nan}]}, {"a": [{"b": math.nan}]}, []),
        ({"a": math.nan}, {"a": 1.0}, ["a"]),
        ({"a": [math.nan]}, {"a": [1.0]}, ["a"]),
        ({"a": [math.nan]}, {"a": [math.nan, math.nan]}, ["a"]),
        ({"a": [{"b": math.nan}]}, {"a": [{"c": math.nan}]}, ["a"]),
    ],
)
def test_not_a_number_equals_itself(one, other, places):
    """Whoever compares a result with itself finds no difference; another number is one."""
    assert [text.split()[0] for text in differences_of(one, other)] == places
    assert [text.split()[0] for text in differences_of(other, one)] == places
