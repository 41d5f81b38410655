"""Commands replace what they have made, and ask before they replace anything else."""

import pytest
from command_line import nlctl_here
from studies_example import HEAD, ROWS, write

from nlctl.analysis.studies import RunFolderError, read_study, run
from nlctl.analysis.studies.folder import remove_run

pytestmark = pytest.mark.ci

SMALL = ROWS.replace("size = 200", "size = 20")
MINE = "<!DOCTYPE html><title>My own page</title>"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study, its run and the page of it."""
    here = tmp_path_factory.mktemp("replaced")
    run(read_study(write(here, HEAD, SMALL)), here / "out", threads=1)
    assert nlctl_here("report", "out", cwd=here).returncode == 0
    return here


def files_in(folder):
    """What is in a folder, but for locks and what Python keeps of imported modules."""
    ours = (".lock", ".owner", "__pycache__")
    return sorted(p for p in folder.rglob("*") if not {*p.parts} & {*ours})


def in_the_way(folder, tmp_path, command, file, content):
    """Write a study and a file where a command would write; return the command and the file."""
    write(tmp_path, HEAD, SMALL)
    command = [str(folder / "out") if word == "out" else word for word in command]
    if command[0] == "gallery":
        assert nlctl_here("report", folder / "out", "--out", "one", cwd=tmp_path).returncode == 0
    path = tmp_path / file
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content, encoding="utf-8")
    return command, path


@pytest.mark.parted
@pytest.mark.parametrize(
    ("command", "file", "content"),
    [
        (("report", "out", "--out", "page"), "page/index.html", MINE),
        (("report", "out", "--out", "page"), "page/index.html", ""),
        (("report", "out", "--out", "page"), "page/report.json", '{"rows": 3}'),
        (("report", "out", "--out", "page"), "page/report.json", "[" * 100_000),
        (("report", "out", "--out", "page"), "page/report.pdf", "%PDF-1.7 my own"),
        (("gallery", "."), "index.html", MINE),
        (("run", "study.toml", "--out", "page"), "page/notes.txt", "mine"),
        (("run", "study.toml", "--out", "page"), "page/.git/config", "mine"),
        (("run", "study.toml", "--out", "page"), "page/results.json", "{}"),
        (("run", "study.toml", "--out", "page", "--resume"), "page/rows/study.json", "{}"),
    ],
)
def test_what_others_have_made_stays(folder, tmp_path, command, file, content):
    """One sentence names it and --force; the file is untouched, and no file has come."""
    command, path = in_the_way(folder, tmp_path, command, file, content)
    before = files_in(tmp_path)
    told = nlctl_here(*command, cwd=tmp_path)
    assert (told.returncode, told.stdout) == (2, ""), told
    assert {*file.split("/")} & {
        *told.stderr.replace("'", " ").replace("/", " ").replace("(", " ").replace(")", " ").split()
    }
    assert "--force" in told.stderr
    assert len(told.stderr.strip().splitlines()) == 1
    assert path.read_text(encoding="utf-8") == content
    after = files_in(tmp_path)
    assert after == before


@pytest.mark.parted
@pytest.mark.parametrize(
    ("command", "file"),
    [
        (("report", "out", "--out", "page"), "page/index.html"),
        (("gallery", "."), "index.html"),
        (("run", "study.toml", "--out", "page"), "page/notes.txt"),
    ],
)
def test_force_goes_on(folder, tmp_path, command, file):
    """Pages are replaced, a run is kept beside what was there; the second time nothing is asked."""
    command, path = in_the_way(folder, tmp_path, command, file, MINE)
    told = nlctl_here(*command, "--force", cwd=tmp_path)
    assert told.returncode == 0, told
    assert (path.read_text(encoding="utf-8") == MINE) == (command[0] == "run")
    again = nlctl_here(*command, *(["--resume"] if command[0] == "run" else []), cwd=tmp_path)
    assert again.returncode == 0, again


@pytest.mark.weekly
def test_a_gallery_does_not_replace_the_page_of_a_report(folder, tmp_path):
    """The paper's report has the runs of its studies below it."""
    for out in ("paper", "paper/study"):
        assert nlctl_here("report", folder / "out", "--out", out, cwd=tmp_path).returncode == 0
    page = tmp_path / "paper" / "index.html"
    before = page.read_bytes()
    told = nlctl_here("gallery", "paper", cwd=tmp_path)
    assert (told.returncode, "this command has not made it" in told.stderr) == (2, True)
    assert page.read_bytes() == before


@pytest.mark.parametrize("name", ["", "notes.txt"])
def test_a_run_is_removed_and_nothing_else(folder, tmp_path, name):
    """The paper's report makes its quick studies anew; what else lies there stays."""
    made = run(read_study(folder / "study.toml"), tmp_path / "out", threads=1).folder
    if name:
        (made / name).write_text("mine")
        with pytest.raises(RunFolderError, match=r"what no run has made \(notes\.txt\)"):
            remove_run(made)
        assert (made / name).read_text() == "mine"
        remove_run(made, force=True)
    if made.exists():
        remove_run(made)
    assert not made.exists()
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "run.json").write_text("{}")
    with pytest.raises(RunFolderError, match=r"\(run\.json\)"):
        remove_run(tmp_path / "other")
