"""Pages and tables of a run: edited ones are named; with every key right they end in a sentence."""

import shutil

import numpy as np
import pandas as pd
import pytest
from command_line import nlctl_here
from examples import many, some
from hypothesis import given, settings
from hypothesis import strategies as st
from resealed import reseal, write_chunk
from studies_example import HEAD, write

from nlctl.analysis.report import write_gallery
from nlctl.analysis.robustness.runs.store import read_parquet
from nlctl.analysis.studies import RunFolderError, read_study, run, verify
from nlctl.analysis.studies.intact import check_page, recorded_print
from nlctl.analysis.studies.sealed import file_digest, read_json, write_json
from nlctl.errors import UsageError

EVERY_KIND = """
[faults]
"lag.y" = { bias = 0.1, stuck = true }

[runs]
size = 40

[[analysis]]
kind = "probability"
limit = 0.5

[[analysis]]
kind = "worst case"
runs = 20

[[analysis]]
kind = "radius"
quantities = ["lag.rate"]
largest = 0.5
runs = 20
draws = 8

[[analysis]]
kind = "sobol"
size = 4

[[analysis]]
kind = "morris"
trajectories = 4

[[analysis]]
kind = "regional"

[[analysis]]
kind = "degradation"
factors = [0.5, 1.0]
runs = 20

[[analysis]]
kind = "failure map"
x = "lag.rate"
y = "lag.x(0)"
cells = 3
levels = 2

[[analysis]]
kind = "faults"
onset = 0.5

[[analysis]]
kind = "compare"
keyword = "lag"
options = { function = "loop.py:lags" }
requirements = ["decays"]
runs = 4
metrics = { iae = "smaller" }
better = ["calm", "wild"]

[[analysis]]
kind = "tornado"

[[analysis]]
kind = "tuning"
gains = { "lag.scale" = [0.2, 2.0] }
budget = 8
samples = 2
starts = 1
runs = 10
"""
SMALL = '[runs]\nsize = 20\n\n[[analysis]]\nkind = "probability"\nlimit = 0.001\n'


@pytest.fixture(scope="module")
def every_kind(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    run(read_study(write(folder, HEAD, EVERY_KIND)), folder / "out", threads=1)
    return folder / "out"


@pytest.fixture(scope="module")
def paged(tmp_path_factory):
    """A small run with its page."""
    folder = tmp_path_factory.mktemp("paged")
    run(read_study(write(folder, HEAD, SMALL)), folder / "out", threads=1)
    assert nlctl_here("report", folder / "out").returncode == 1
    return folder / "out"


@pytest.fixture
def copied(paged, tmp_path):
    return shutil.copytree(paged, tmp_path / "copy")


# -- pages ---------------------------------------------------------------------------------------

PAGES = {
    "a word of the page": lambda f: edit(f / "index.html", b"refuted", b"shown  "),
    "a word of its numbers": lambda f: edit(f / "report.json", b"refuted", b"shown  "),
    "a number": lambda f: edit(f / "report.json", b'"runs": 20', b'"runs": 21'),
    "a byte at the end": lambda f: edit(f / "index.html", b"</html>", b"</html> "),
    "the page lost": lambda f: (f / "index.html").unlink(),
    "its numbers lost": lambda f: (f / "report.json").unlink(),
    "a folder in its place": lambda f: ((f / "index.html").unlink(), (f / "index.html").mkdir()),
    "a print that nobody has made": lambda f: (f / "report.pdf").write_bytes(b"%PDF"),
    "another run's page": lambda f: (f / "index.html").write_bytes(b"<html></html>"),
}


def edit(path, old, new):
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


@pytest.mark.parted
@pytest.mark.parametrize("name", PAGES)
def test_an_edited_page_is_named_and_made_again(copied, name):
    """By verify, compare and the gallery; the data are as they were, so that it can be remade."""
    PAGES[name](copied)
    found = verify(copied)
    assert len(found.problems) == 1, found
    assert f"make it again with 'nlctl report {copied}'" in found.problems[0]
    assert nlctl_here("verify", copied).returncode == 1
    with pytest.raises(RunFolderError, match="make it again"):
        check_page(copied)
    if (copied / "report.json").exists():
        for path in (copied, copied / "report.json"):
            told = nlctl_here("compare", path, copied)
            assert (told.returncode, told.stdout) == (2, "")
        nlctl_here("gallery", copied.parent)
        page = (copied.parent / "index.html").read_text(encoding="utf-8")
        assert "Cannot be read." in page
        assert "is refuted" not in page
    if (copied / "index.html").is_dir():
        return
    assert nlctl_here("report", copied, "--force").returncode == 1
    (copied / "report.pdf").unlink(missing_ok=True)
    assert verify(copied).is_intact


def test_a_page_stays_that_of_a_run_as_long_as_nothing_changes(copied, paged):
    """Taken up again without anything to do; of a run that was changed it is none."""
    assert verify(copied).has_page
    study = read_study(paged.parent / "study.toml")
    run(study, copied, resume=True, threads=1)
    assert verify(copied).is_intact
    assert verify(copied).has_page
    shutil.rmtree(copied / "rows")  # run again: other wall times, another state of the folder
    run(study, copied, resume=True, threads=1)
    assert not verify(copied).has_page
    assert len(verify(copied).problems) == 3  # page, numbers, signals


@pytest.mark.weekly
def test_a_page_elsewhere_is_not_in_the_record(copied, tmp_path):
    """Also where that is the folder of another run: whose page it then is not."""
    other = shutil.copytree(copied, tmp_path / "other")
    assert nlctl_here("report", copied, "--out", tmp_path / "elsewhere").returncode == 1
    assert verify(copied).is_intact
    assert not (tmp_path / "elsewhere" / "contents.json").exists()
    assert nlctl_here("report", copied, "--out", other).returncode == 1
    assert not verify(other).is_intact


@pytest.mark.weekly
def test_a_print_belongs_to_its_page(copied):
    """It is recorded with the page that it shows, and not with the next one."""
    nlctl_here("report", copied)  # the command on it names the folder
    with recorded_print(copied):
        (copied / "report.pdf").write_bytes(b"%PDF of this page")
    assert verify(copied).is_intact
    assert nlctl_here("report", copied).returncode == 1  # the same page
    assert verify(copied).is_intact
    assert nlctl_here("report", copied, "--interactive").returncode == 1
    (problem,) = verify(copied).problems
    assert "report.pdf" in problem
    elsewhere = copied.parent / "elsewhere"
    elsewhere.mkdir()
    with recorded_print(elsewhere):
        (elsewhere / "report.pdf").write_bytes(b"%PDF")
    assert [path.name for path in elsewhere.iterdir()] == ["report.pdf"]


def test_a_gallery_believes_what_it_is_told_to(copied):
    """Reports that are in no run's folder are listed as they are."""
    edit(copied / "report.json", b"refuted", b"shown  ")
    write_gallery(copied.parent)
    assert "Cannot be read." not in (copied.parent / "index.html").read_text(encoding="utf-8")


def test_no_page_is_recorded_of_a_folder_that_is_not_whole(copied):
    """What was lost is not covered up by a page."""
    shutil.rmtree(copied / "probability")
    before = (copied / "contents.json").read_bytes()
    assert nlctl_here("report", copied).returncode == 2
    assert (copied / "contents.json").read_bytes() == before


def test_a_page_of_data_alone_says_the_same(copied, paged, tmp_path, monkeypatch):
    """Who received the folder without its code finds no difference to the sender's page."""
    monkeypatch.setenv("NLCTL_CONFIG_DIR", str(tmp_path / "another user"))
    assert "no fans" in nlctl_here("report", copied).stderr
    assert verify(copied).is_intact
    told = nlctl_here("compare", copied, paged)
    assert (told.returncode, told.stdout) == (0, "no difference\n")


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("validate", "copy"), "a study is a file (.toml): look at that run with 'nlctl report"),
        (("run", "copy"), "a study is a file (.toml): look at that run with 'nlctl report"),
        (("validate", "."), "is a folder, and a study is a file (.toml)"),
        (("verify", "copy/study.toml"), "is a file, and a run is a folder: name 'copy'"),
        (("report", "copy/index.html"), "is a file, and a run is a folder: name 'copy'"),
        (("replay", "copy/run.json", 1), "is a file, and a run is a folder: name 'copy'"),
    ],
)
def test_a_file_and_a_folder_in_the_places_of_each_other(copied, command, words):
    """One sentence, with what was meant."""
    told = nlctl_here(*command, cwd=copied.parent)
    assert told.returncode == 2
    assert words in told.stderr
    assert len(told.stderr.splitlines()) == 1


# -- tables --------------------------------------------------------------------------------------


def tables_in(folder, in_chunks):
    """Names of the tables of findings, or of those that rows are kept in."""
    return [
        path.relative_to(folder).as_posix()
        for path in sorted(folder.rglob("*.parquet"))
        if (path.parent.name == "chunks") == in_chunks
    ]


CHANGES = {
    "a column less": lambda t, c: t.drop(columns=c),
    "another name": lambda t, c: t.rename(columns={c: "other"}),
    "a column more": lambda t, c: t.assign(other=1.0),
    "half of the rows": lambda t, c: t.iloc[: len(t) // 2],
    "every row twice": lambda t, c: pd.concat([t, t]),
    "no rows": lambda t, c: t.iloc[:0],
    "text": lambda t, c: t.assign(**{c: "x"}),
    "a number": lambda t, c: t.assign(**{c: np.arange(len(t))}),
    "not a number": lambda t, c: t.assign(**{c: np.nan}),
    "infinite": lambda t, c: t.assign(**{c: np.inf}),
    "nothing": lambda t, c: t.assign(**{c: None}),
    "without its index": lambda t, c: t.reset_index(drop=True),
    "its index as columns": lambda t, c: t.reset_index(),
    "from behind": lambda t, c: t.iloc[::-1],
    "no columns": lambda t, c: t[[]],
}
SHAPES = ["a column less", "another name", "a column more", "half of the rows", "every row twice",
          "no rows", "no columns"]  # fmt: skip
COMMANDS = ("verify", "report", "compare")


def with_change(folder, name, how, place):
    """Change a table in a folder; False if there is nothing to be changed."""
    path = folder / name
    is_chunk = path.parent.name == "chunks"
    before = read_parquet(path).set_index("row") if is_chunk else pd.read_parquet(path)
    column = list(before.columns)[place % len(before.columns)]
    now = CHANGES[how](before, column)
    write = write_chunk if is_chunk else lambda path, table: table.to_parquet(path)
    try:
        write(path, now)
    except (ValueError, TypeError):  # Parquet does not hold it
        return False
    return True


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("how", SHAPES)
@pytest.mark.parametrize("in_chunks", [False, True])
def test_a_table_of_another_shape_is_not_what_the_record_says(every_kind, tmp_path, how, in_chunks):
    """Even if the keys of its file are right wherever they stand."""
    names = tables_in(every_kind, in_chunks)
    for number, name in some(enumerate(names), first=list(SHAPES).index(how)):
        folder = shutil.copytree(every_kind, tmp_path / str(number))
        tables = read_json(folder / "contents.json")["tables"]
        if not with_change(folder, name, how, 0):
            continue
        reseal(folder, name)
        record = read_json(folder / "contents.json")
        if record["tables"] == tables:  # it has neither rows nor columns to lose
            continue
        write_json(folder / "contents.json", record | {"tables": tables})
        problems = verify(folder).problems
        assert any(name in text and ", and it has " in text for text in problems), problems


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("how", ["half of the rows", "every row twice", "no rows", "a column less"])
def test_rows_that_are_not_those_of_the_design_are_refused(every_kind, tmp_path, how):
    """With every key right, and the counts: their files are named by the rows that they hold."""
    for number, name in enumerate(tables_in(every_kind, True)):
        folder = shutil.copytree(every_kind, tmp_path / str(number))
        if with_change(folder, name, how, 0):
            reseal(folder, name)
            (problem,) = verify(folder).problems
            assert "\n" not in problem


@pytest.fixture(scope="module")
def run_of(tmp_path_factory):
    """Return the run of one kind of analysis, each made once."""
    made = {}

    def run_of(kind):
        if kind not in made:
            folder = tmp_path_factory.mktemp("kind")
            head, *analyses = EVERY_KIND.split("[[analysis]]")
            (asked,) = (text for text in analyses if f'kind = "{kind}"' in text)
            path = write(folder, HEAD, f"{head}[[analysis]]{asked}")
            run(read_study(path), folder / "out", threads=1)
            made[kind] = folder / "out"
        return made[kind]

    return run_of


def any_change_ends_in_a_sentence(whole, folder, data):
    in_chunks = data.draw(st.booleans()) or not tables_in(whole, in_chunks=False)
    name = data.draw(st.sampled_from(tables_in(whole, in_chunks)))
    how, place = data.draw(st.sampled_from(sorted(CHANGES))), data.draw(st.integers(0, 40))
    shutil.copytree(whole, folder)
    if with_change(folder, name, how, place):
        reseal(folder, name)
        for command in COMMANDS:
            told = nlctl_here(command, folder, *[whole] * (command == "compare"))
            assert told.returncode in (0, 1, 2, 5), (name, how, place, command, told.stderr)
            assert "Traceback" not in told.stderr
    shutil.rmtree(folder, ignore_errors=True)


KINDS_ASKED = [line[8:-1] for line in EVERY_KIND.splitlines() if line.startswith("kind = ")]


@pytest.mark.ci
@settings(max_examples=many(4, part=2))
@given(data=st.data())
@pytest.mark.parted
@pytest.mark.parametrize("kind", KINDS_ASKED)
def test_resealed_tables_end_in_a_sentence(run_of, tmp_path_factory, kind, data):
    """Any table of any kind of analysis, every key right: no trace, no exit 3."""
    any_change_ends_in_a_sentence(run_of(kind), tmp_path_factory.mktemp("any") / "out", data)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("how", CHANGES)
def test_every_column_of_kept_rows_may_be_anything(run_of, tmp_path, how):
    """Labels that are none and numbers in the place of text among them: a problem in words."""
    whole = run_of("probability")
    (name,) = tables_in(whole, in_chunks=True)
    columns = range(len(read_parquet(whole / name).columns) - 1)
    for place in some(columns, first=list(CHANGES).index(how)):  # another third for each change
        folder = shutil.copytree(whole, tmp_path / str(place))
        if with_change(folder, name, how, place):
            reseal(folder, name)
            assert all("\n" not in problem for problem in verify(folder).problems)
            column = read_parquet(whole / name).set_index("row").columns[place]
            if column == "status" and how in ("text", "a number", "not a number", "infinite"):
                assert "no label of it" in " ".join(verify(folder).problems)


@pytest.mark.weekly
@settings(max_examples=many(80))
@given(data=st.data())
@pytest.mark.parametrize("kind", KINDS_ASKED)
def test_many_resealed_tables_end_in_a_sentence(run_of, tmp_path_factory, kind, data):
    """The same, longer."""
    any_change_ends_in_a_sentence(run_of(kind), tmp_path_factory.mktemp("any") / "out", data)


def test_rows_count_when_runs_with_pages_are_compared(paged, tmp_path):
    """The main table is on no page, and yet one number of it is a difference."""
    one, other = (shutil.copytree(paged, tmp_path / name) for name in ("one", "other"))
    assert nlctl_here("compare", one, other).stdout == "no difference\n"
    (name,) = tables_in(other, in_chunks=True)
    frame = read_parquet(other / name).set_index("row")
    frame.loc[3, "spec"] *= 1 + 1e-9
    write_chunk(other / name, frame)
    reseal(other, name)
    told = nlctl_here("compare", one, other)
    assert told.returncode == 1
    assert "1 value of 'spec' in the table rows, the first in line 3" in told.stdout
    assert nlctl_here("compare", one, other, "--rtol", "1e-6").returncode == 0


def test_the_record_counts_every_table(every_kind):
    """Rows and columns, as pandas reads them."""
    record = read_json(every_kind / "contents.json")
    assert sorted(record["tables"]) == sorted(
        tables_in(every_kind, True) + tables_in(every_kind, False)
    )
    for name, told in record["tables"].items():
        assert record["files"][name] == file_digest(every_kind / name)
        assert told["rows"] == len(pd.read_parquet(every_kind / name))


def test_a_record_with_a_page_of_another_name_is_refused(copied):
    """Names that lead out of the folder, too."""
    record = read_json(copied / "contents.json")
    write_json(copied / "contents.json", record | {"page": {"../x": "0" * 64}})
    with pytest.raises(UsageError, match="holds what no run writes"):
        verify(copied)
