"""Results know what they were computed from: another loop, study or file is refused by name."""

import json
import shutil
from contextlib import nullcontext

import pandas as pd
import pytest
from command_line import nlctl_here
from studies_example import HEAD, ROWS, write

from nlctl.analysis.robustness.runs import store as identity
from nlctl.analysis.studies import RunFolderError, load_result, read_study, run
from nlctl.analysis.studies.sealed import read_json, write_json

pytestmark = pytest.mark.slow  # one run, or one compiled function, for all of them

SEARCHES = """
[[analysis]]
kind = "worst case"
runs = 20

[[analysis]]
kind = "radius"
quantities = ["lag.rate"]
largest = 0.9
runs = 20
draws = 20
"""
COMPARED = """
[[analysis]]
kind = "compare"
keyword = "lag"
options = { function = "loop.py:lags" }
requirements = ["decays"]
runs = 20
metrics = { iae = "smaller" }
"""
STUDIES = {"searches": (HEAD, SEARCHES), "rows": (HEAD, ROWS, SEARCHES, COMPARED)}


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """Every study, run to its end in a folder beside its loop."""
    folder = tmp_path_factory.mktemp("done")
    for name, parts in STUDIES.items():
        (folder / name).mkdir()
        path = write(folder / name, *parts)
        run(read_study(path), folder / name / "out", threads=1)
    return folder


@pytest.fixture
def copied(done, tmp_path):
    """A copy of a study with its run, at a path of its own: its loop is read anew."""

    def copy(name, between=True):
        folder = tmp_path / name
        shutil.copytree(done / name, folder)
        if between:  # as a kill between two analyses leaves it
            (folder / "out" / "radius" / "finding.json").unlink()
            (folder / "out" / "results.json").unlink()
        return folder

    return copy


def edit(path, old, new):
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


EDITS = {
    "an equation": ("x[0] ** 3", "x[0] ** 2", "the equations of 'lag'"),
    "an output": ("2 * x[0]", "3 * x[0]", "the equations of 'lag'"),
    "a default": ("gain: float = nlctl.param(0.0", "gain: float = nlctl.param(0.1",
                  "lag.gain was 0.0, now 0.1"),
    "an initial state": ('{"x": 1.0}', '{"x": 1.1}', "lag.x(0) was 1.0, now 1.1"),
    "the wiring": ('outputs=["y", "z"], name', 'outputs=["z", "y"], name',
                   "the wiring of 'diagram'"),
    "a block more": ('{"lag": lag or Lag()}',
                     '{"lag": lag or Lag(), "sines": nlctl.SumOfSines(order=1)}',
                     "'sines' is new"),
}  # fmt: skip
COMMANDS = {
    "resume": ("run", "study.toml", "--resume", "--out", "out"),
    "report": ("report", "out", "--trust"),  # edited code is not what was run
    "replay": ("replay", "out", "0", "--part", "worst-case", "--trust"),
}


@pytest.mark.parted
@pytest.mark.parametrize(
    ("command", "name"),
    [("resume", name) for name in EDITS] + [("report", "an equation"), ("replay", "an equation")],
)
def test_another_loop_is_refused_by_name(copied, name, command):
    """Without [runs], where only the loop itself can tell; nothing in the folder changes."""
    folder = copied("searches", between=command == "resume")
    old, new, words = EDITS[name]
    edit(folder / "loop.py", old, new)
    before = {p: p.read_bytes() for p in (folder / "out").rglob("*.*") if p.is_file()}
    told = nlctl_here(*COMMANDS[command], cwd=folder)
    assert told.returncode == 2, told
    assert words in told.stderr
    assert "was computed from another loop than today's" in told.stderr
    assert len(told.stderr.strip().splitlines()) == 1
    after = {p: p.read_bytes() for p in (folder / "out").rglob("*.*") if p.is_file()}
    assert {p: c for p, c in after.items() if p.name != ".owner"} == {
        p: c for p, c in before.items() if p.name != ".owner"
    }


@pytest.mark.parametrize("command", COMMANDS)
def test_an_option_of_a_comparison_is_part_of_the_loop(copied, command):
    """It is no block of the study's own loop, and its rows stand in the same folder."""
    folder = copied("rows", between=command == "resume")
    edit(folder / "loop.py", '"wild": Lag(gain=0.4)', '"wild": Lag(gain=0.5)')
    told = nlctl_here(*COMMANDS[command], cwd=folder)
    assert (told.returncode, "lag.gain was 0.4, now 0.5" in told.stderr) == (2, True), told


@pytest.mark.parted
@pytest.mark.parametrize(
    ("name", "command"),
    [("searches", "resume")]
    + [pytest.param("rows", command, marks=pytest.mark.ci) for command in COMMANDS],
)
def test_the_same_loop_goes_on(copied, done, name, command):
    """Comments do not count; the end is that of one run."""
    folder = copied(name, between=command == "resume")
    edit(folder / "loop.py", "import nlctl\n", "# a comment\n\nimport nlctl\n")
    told = nlctl_here(*COMMANDS[command], cwd=folder)
    assert told.returncode == 0, told
    whole, again = (load_result(f / "out") for f in (done / name, folder))
    assert whole.plain() == again.plain()


def test_a_loop_that_has_gone_leaves_what_was_found(copied):
    """A run that was sent without its loop has a page without fans."""
    folder = copied("rows", between=False)
    (folder / "loop.py").unlink()
    told = nlctl_here("report", "out", cwd=folder)
    assert told.returncode == 0, told
    assert "the report has no fans" in told.stderr


def test_loops_of_a_comparison_that_change_during_the_run_are_noticed(tmp_path):
    """They are made when their turn comes: here they read a file that the first analysis edits."""
    path = write(tmp_path, HEAD.replace("seed = 3", "seed = 4"), ROWS, COMPARED)
    reading = '{"calm": Lag(gain=float((Path(__file__).with_name("gain")).read_text()))}'
    with (tmp_path / "loop.py").open("a", encoding="utf-8") as file:
        file.write(f"\n\nfrom pathlib import Path\n\n\ndef lags():\n    return {reading}\n")
    (tmp_path / "gain").write_text("0.1")
    file = read_study(path)

    def watch(title):
        (tmp_path / "gain").write_text("0.2")
        return nullcontext()

    with pytest.raises(RunFolderError, match=r"have changed since .*lag\.gain was 0\.1, now 0\.2"):
        run(file, tmp_path / "out", threads=1, watch=watch)
    (tmp_path / "gain").write_text("0.1")
    assert run(file, tmp_path / "out", resume=True, threads=1).complete


def test_other_versions_are_named(copied, tmp_path, monkeypatch):
    """Nothing is added to a run of another library; what is drawn from it says so."""
    today = identity.versions_of_numbers()
    path = write(tmp_path, *STUDIES["searches"])
    with monkeypatch.context() as patch:
        patch.setattr(identity, "versions_of_numbers", lambda: today | {"numpy": "1.0"})
        run(read_study(path), tmp_path / "out", threads=1)
    words = f"numpy 1.0 then, {today['numpy']} now"
    (tmp_path / "out" / "radius" / "finding.json").unlink()
    resumed = nlctl_here(*COMMANDS["resume"], cwd=tmp_path)
    assert (resumed.returncode, words in resumed.stderr) == (2, True)
    shutil.rmtree(tmp_path / "out")
    with monkeypatch.context() as patch:
        patch.setattr(identity, "versions_of_numbers", lambda: today | {"numpy": "1.0"})
        run(read_study(path), tmp_path / "out", threads=1)
    told = nlctl_here("report", "out", cwd=tmp_path)
    assert (told.returncode, words in told.stderr) == (0, True)
    page = json.loads((tmp_path / "out" / "report.json").read_text(encoding="utf-8"))
    assert page["provenance"]["numpy"] == "1.0"


def test_two_runs_of_different_loops_say_so(copied):
    """The differences of their results are listed as ever."""
    folder = copied("searches", between=False)
    edit(folder / "loop.py", "x[0] ** 3", "x[0] ** 2")
    run(read_study(folder / "study.toml"), folder / "other", threads=1)
    told = nlctl_here("compare", "out", "other", cwd=folder)
    assert "not computed from the same: the equations of 'lag'" in told.stderr
    assert told.stdout == "no difference\n"  # the gain is 0


def table(change):
    def edited(path):
        made = pd.read_parquet(path)
        change(made)
        made.to_parquet(path)

    return edited


def first_number(frame):
    column = frame.select_dtypes("float").columns[0]
    frame.loc[frame.index[0], column] += 1e-9


def cut(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def inside(old, new):
    return lambda path: edit(path, old, new)


def resealed(path):
    """A finding of another run, whose own seal is right."""
    content = read_json(path)
    write_json(path, content | {"origin": "0" * 64})


DAMAGE = [
    ("study.toml", cut, "is damaged, or cut off"),
    ("study.toml", lambda p: p.write_bytes(b"\0" * 40), "is damaged, or cut off"),
    ("study.toml", lambda p: p.write_bytes(b""), "is damaged, or cut off"),
    ("study.toml", inside('title = "A lag"', 'title = "A leg"'), "is not the study that was run"),
    ("study.toml", lambda p: p.unlink(), "holds no run of a study"),
    ("run.json", cut, "is damaged (it is not JSON)"),
    ("run.json", inside('"study_folder": ".."', '"study_folder": "."'), "not as it was written"),
    ("run.json", lambda p: p.unlink(), "there is no 'run.json'"),
    ("results.json", cut, "is damaged (it is not JSON)"),
    ("results.json", inside('"title": "A lag"', '"title": "A leg"'), "not as it was written"),
    ("results.json", lambda p: p.unlink(), "no 'results.json'|is a run that is not done"),
    ("worst-case/finding.json", cut, "is damaged (it is not JSON)"),
    ("worst-case/finding.json", inside('"kind": "worst case"', '"kind": "best case"'),
     "not as it was written"),
    ("worst-case/finding.json", resealed, "was computed from another loop than the rest"),
    ("worst-case/rows.parquet", table(first_number), "not as it was written"),
    ("worst-case/rows.parquet", cut, "not as it was written"),
    ("worst-case/best.parquet", table(first_number), "not as it was written"),
    ("worst-case/best.parquet", lambda p: p.unlink(), "cannot be read"),
    ("radius/steps.parquet", table(first_number), "not as it was written"),
    ("compare/ranking.parquet", table(first_number), "not as it was written"),
    ("rows/study.json", cut, "is not a study of a sweep"),
]  # fmt: skip


@pytest.mark.parametrize("number", range(len(DAMAGE)))
def test_what_was_edited_or_cut_off_is_refused_in_a_sentence(copied, number):
    """Page and comparison show nothing of it; the message names the file."""
    file, change, words = DAMAGE[number]
    folder = copied("rows", between=False)
    change(folder / "out" / file)
    for command in (("report", "out"), ("compare", "out", "out")):
        told = nlctl_here(*command, cwd=folder)
        assert (told.returncode, told.stdout) == (2, ""), (command, told)
        assert any(part in told.stderr for part in words.split("|")), told.stderr
        assert len(told.stderr.strip().splitlines()) == 1, told.stderr


@pytest.mark.parted
@pytest.mark.parametrize("by", ["pandas", "bytes"])
def test_edited_rows_are_refused_and_run_again(copied, done, by):
    """Whatever wrote them: a table without its seal is none of this run."""
    folder = copied("rows", between=False)
    chunk = sorted((folder / "out" / "rows" / "chunks").glob("*.parquet"))[0]
    if by == "pandas":
        table(first_number)(chunk)
    else:
        content = bytearray(chunk.read_bytes())
        content[len(content) // 3] ^= 1
        chunk.write_bytes(content)
    told = nlctl_here("replay", "out", 0, cwd=folder)
    assert (told.returncode, "cannot read the chunks" in told.stderr) == (2, True)
    again = nlctl_here(*COMMANDS["resume"], cwd=folder)
    assert again.returncode == 0, again.stderr
    assert "run again" in again.stderr
    whole, made = (load_result(f / "out") for f in (done / "rows", folder))
    columns = [c for c in whole.rows.table if c != "wall_time"]
    pd.testing.assert_frame_equal(made.rows.table[columns], whole.rows.table[columns])


@pytest.mark.weekly
def test_what_no_key_can_see_is_told_when_it_runs_and_on_the_page(tmp_path):
    """Here a function that NumPy has made of another one."""
    path = write(tmp_path, HEAD, SEARCHES)
    edit(tmp_path / "loop.py", "x[0] ** 3", "x[0] ** 3 + 0.0 * HIDDEN(x[0])")
    edit(tmp_path / "loop.py", "import nlctl\n", "import nlctl\n" + HIDDEN)
    words = "What 'lag' computes depends on what no key can see"
    told = nlctl_here("run", path, "--out", "out", cwd=tmp_path)
    assert (told.returncode, words in told.stderr) == (0, True), told
    assert nlctl_here("report", "out", cwd=tmp_path).returncode == 0
    assert words.replace("'", "&#39;") in (tmp_path / "out" / "index.html").read_text()


HIDDEN = "import numpy as np\n\nHIDDEN = np.frompyfunc(lambda v: 2.0 * v, 1, 1)\n"
