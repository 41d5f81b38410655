"""The commands about study files, run as a user runs them: exit codes, JSON, resuming."""

import json
import re
import resource
import shlex
import signal
import subprocess
import time

import numpy as np
import pandas as pd
import pytest
from command_line import NLCTL, nlctl, nlctl_here
from places import ROOT
from studies_example import HEAD, ROWS, write

from nlctl.analysis.studies import load_result, read_study
from nlctl.analysis.studies import run as run_study

MANY = ROWS.replace("size = 200", "size = 3000")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("cli")


@pytest.mark.slow
def test_a_study_is_validated_run_and_replayed(folder):
    """Exit code 0 throughout, one verdict, and a row again bit for bit with its figure."""
    path = write(folder)
    planned = nlctl_here("validate", path, cwd=folder)
    assert planned.returncode == 0, planned.stderr
    assert "rows: 200 runs" in planned.stdout
    done = nlctl_here("run", path, "--jobs", "1", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "The claim is shown." in done.stdout
    assert "Assumed: rows are independent draws" in done.stdout
    assert (folder / "reports" / "study" / "results.json").exists()
    again = nlctl_here("replay", "reports/study", 17, "--plot", "row.svg", cwd=folder)
    assert again.returncode == 0, again.stderr
    assert "bit for bit" in again.stdout
    assert (folder / "row.svg").read_text(encoding="utf-8").lstrip().startswith("<?xml")


@pytest.mark.slow
def test_a_failing_claim_is_exit_code_1_and_json_is_json(folder):
    """Standard output is one JSON document, whatever the outcome."""
    path = write(folder)
    failing = nlctl_here(
        "run", path, "--set", "analysis.0.limit=0.01", "--out", "fails", "--json", cwd=folder
    )
    assert failing.returncode == 1, failing.stderr
    content = json.loads(failing.stdout)
    assert (content["holds"], content["answer"]) == (False, "refuted")
    assert content["findings"][0]["claim"] == "a violation has at most probability 0.01"
    planned = json.loads(nlctl_here("validate", path, "--json", cwd=folder).stdout)
    assert (planned["valid"], planned["runs"]["rows"]) == (True, 200)
    row = json.loads(nlctl_here("replay", "fails", 0, "--json", cwd=folder).stdout)
    assert row["same"] is True
    few = ("--set", "runs.size=4", "--set", "analysis.0.limit=0.2", "--out", "few")
    told = nlctl_here("run", path, *few, cwd=folder)
    assert told.returncode == 5, told.stderr
    assert re.search(r"not shown yet \(needs at least \d+ more runs", told.stdout)
    assert "FAILS" not in told.stdout
    schema = json.loads(nlctl_here("schema", cwd=folder).stdout)
    assert schema["properties"]["loop"]["type"] == "string"


def test_an_invalid_study_is_exit_code_2_with_every_mistake(folder):
    """As text on standard error, or as JSON on standard output."""
    path = write(folder, HEAD.replace("band", "bnad").replace("|z|", "|zz|"), ROWS, name="bad.toml")
    told = nlctl_here("run", path, cwd=folder)
    assert (told.returncode, told.stdout) == (2, "")
    assert "2 mistakes" not in told.stderr  # band is missing as well
    for words in ("nearest: 'band'", "metrics.band: is missing", "unknown signal 'zz'"):
        assert words in told.stderr
    assert "Traceback" not in told.stderr
    assert not (folder / "reports" / "bad").exists()
    content = json.loads(nlctl_here("validate", path, "--json", cwd=folder).stdout)
    assert content["valid"] is False
    assert {problem["text"] for problem in content["problems"]} == {
        "metrics.bnad",
        "metrics.band",
        "spec.small",
    }


def test_other_bad_input_is_exit_code_2(folder):
    """A missing file, an executor, a folder that holds no run: one sentence each."""
    for arguments, words in (
        (("run", "none.toml"), "none.toml"),
        (("run", write(folder), "--executor", "mainframe", "--out", "x"), "got 'mainframe'"),
        (("replay", ".", "0"), "holds no run of a study"),
    ):
        told = nlctl_here(*arguments, cwd=folder)
        assert told.returncode == 2, told
        assert words in told.stderr
        assert len(told.stderr.strip().splitlines()) == 1


def test_an_error_in_the_users_own_function_is_exit_code_3(folder):
    """With its traceback: it is neither a claim that fails nor a mistake in the file."""
    path = write(folder, HEAD.replace("loop.py:loop", "loop.py:broken"), ROWS, name="broken.toml")
    told = nlctl_here("validate", path, "--json", cwd=folder)
    assert told.returncode == 3
    assert "RuntimeError: no such luck" in told.stderr
    assert json.loads(told.stdout) == {"error": "RuntimeError: no such luck"}


@pytest.mark.weekly
def test_a_full_disk_is_exit_code_4_and_can_be_continued(folder):
    """Files may grow to 20 kB only: the first chunk cannot be written; later it can."""
    path = write(folder, HEAD, MANY, name="many.toml")
    whole = run_study(read_study(path), folder / "whole", threads=1)

    def small_files():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))

    stopped = nlctl("run", path, "--out", "full", cwd=folder, preexec_fn=small_files)
    assert stopped.returncode == 4, stopped.stderr
    assert "cannot write" in stopped.stderr
    command = stopped.stderr.splitlines()[-1].removeprefix("continue with: nlctl ")
    assert command == f"run {path} --resume --out full"
    resumed = nlctl_here(*shlex.split(command), cwd=folder)
    assert resumed.returncode == 0, resumed.stderr
    assert_same(load_result(folder / "full"), whole)


def interrupted(arguments, is_time, cwd):
    """Run the command line and press Ctrl-C when it is time; return code, output and errors."""
    process = subprocess.Popen(
        [*NLCTL, *arguments], cwd=cwd, stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    while process.poll() is None and not is_time():
        time.sleep(0.005)
    process.send_signal(signal.SIGINT)
    out, told = process.communicate(timeout=300)
    return process.returncode, out, told


@pytest.mark.weekly
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_is_exit_code_130_and_prints_how_to_go_on(folder):
    """The chunk in hand is kept; the printed command ends with the uninterrupted table."""
    path = write(folder, HEAD, MANY, name="long.toml")
    chunks = folder / "long" / "rows" / "chunks"
    arguments = ("run", "long.toml", "--out", "long", "--jobs", "1")
    code, out, told = interrupted(arguments, lambda: list(chunks.glob("*.parquet")), folder)
    assert code == 130, (out, told)
    kept = load_result(folder / "long")
    assert 0 < kept.rows.done < 3000
    assert not kept.complete
    command = told.strip().splitlines()[-1].removeprefix("continue with: ")
    assert command == "nlctl run long.toml --resume --out long --jobs 1"
    resumed = nlctl_here(*shlex.split(command)[1:], cwd=folder)
    assert resumed.returncode == 0, resumed.stderr
    assert_same(load_result(folder / "long"), run_study(read_study(path), folder / "straight"))


WAITING = """

def waiting(name="loop"):
    import pathlib, time

    here = pathlib.Path(__file__).parent
    if (here / {kept!r}).exists() and not (here / "waits").exists():
        (here / "waits").touch()
        time.sleep(600)
    return loop(name=name)
"""


@pytest.mark.parametrize(
    ("kept", "command"),
    [
        pytest.param(
            *("study.toml", "begin with: nlctl run study.toml --out out --jobs 1"),
            marks=pytest.mark.weekly,
        ),
        pytest.param(
            *("out/study.toml", "continue with: nlctl run study.toml --resume --out out --jobs 1"),
            marks=pytest.mark.ci,
        ),
    ],
)
@pytest.mark.usefixtures("ctrl_c")
def test_ctrl_c_before_the_first_row_says_how_to_go_on(tmp_path, kept, command):
    """While the file is checked nothing is kept; while diagrams are compiled the study is.

    The loop waits where it is built, until SIGINT comes; the printed command then does it all.
    """
    write(tmp_path, HEAD.replace("loop.py:loop", "loop.py:waiting"), ROWS)
    with (tmp_path / "loop.py").open("a", encoding="utf-8") as file:
        file.write(WAITING.format(kept=kept))
    code, out, told = interrupted(
        ("run", "study.toml", "--out", "out", "--jobs", "1"), (tmp_path / "waits").exists, tmp_path
    )
    assert (code, out) == (130, "")
    assert told.splitlines() == ["nlctl: interrupted", command]
    assert (tmp_path / "out").exists() == command.startswith("continue")
    again = command.partition(": nlctl ")[2]
    done = nlctl_here(*shlex.split(again), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert load_result(tmp_path / "out").complete


def assert_same(one, other):
    """Compare two results: every number, every row to the last bit."""
    assert one.plain() == other.plain()
    first, second = (made.rows.table.drop(columns="wall_time") for made in (one, other))
    pd.testing.assert_frame_equal(first, second)
    np.testing.assert_array_equal(first.index, range(3000))


@pytest.mark.weekly
def test_processes_give_the_same_rows(folder):
    """The user's loop from a file travels to other processes."""
    path = write(folder)
    there = nlctl(
        *("run", path, "--executor", "processes", "--jobs", "1", "--out", "processes"), cwd=folder
    )
    assert there.returncode == 0, there.stderr
    here = run_study(read_study(path), folder / "here", threads=1)
    one, other = (
        r.rows.table.drop(columns="wall_time") for r in (load_result(folder / "processes"), here)
    )
    pd.testing.assert_frame_equal(one, other)


REPORTS = ROOT / "reports"


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("path", sorted(REPORTS.glob("*.toml")), ids=lambda p: p.stem)
def test_the_committed_studies_are_valid(path):
    """Every name in them exists in the loops of today."""
    file = read_study(path)
    assert file.study.study.title
    assert file.study.analysis
