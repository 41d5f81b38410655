"""A run folder proves that it is intact: what is lost, added or exchanged, no reader believes."""

import hashlib
import json
import shutil

import pandas as pd
import pytest
from command_line import nlctl_here
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from studies_example import HEAD, write

from nlctl.analysis.robustness.runs import store
from nlctl.analysis.studies import (
    RunFolderError,
    load_result,
    origin_differences,
    read_study,
    replay,
    run,
    run_differences,
    verify,
)
from nlctl.analysis.studies.sealed import file_digest, read_json, write_json
from nlctl.errors import UsageError

STUDY = """
[runs]
size = 300

[[analysis]]
kind = "probability"
limit = 0.001

[[analysis]]
kind = "worst case"
runs = 20
limit = -9.0

[[analysis]]
kind = "compare"
keyword = "lag"
options = { function = "loop.py:lags" }
requirements = ["decays"]
runs = 20
metrics = { iae = "smaller" }
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """A run whose claim is refuted, with its page."""
    folder = tmp_path_factory.mktemp("whole")
    found = run(read_study(write(folder, HEAD, STUDY)), folder / "out", threads=1)
    assert (found.answer, found["worst-case"].answer) == ("refuted", "shown")
    assert nlctl_here("report", "out", cwd=folder).returncode == 1
    return folder / "out"


@pytest.fixture
def copied(done, tmp_path):
    return shutil.copytree(done, tmp_path / "copy")


READERS = {
    "load_result": load_result,
    "run_differences": lambda folder: run_differences(folder, folder),
    "origin_differences": lambda folder: origin_differences(folder, folder),
    "replay": lambda folder: replay(folder, 0),
    "report": ("report", "{}"),
    "compare": ("compare", "{}", "{}"),
    "replay, in a shell": ("replay", "{}", "0"),
}


def parts_of(folder):
    """The files and the folders that a run has written."""
    pages = {"index.html", "report.json", "signals.json"}
    return sorted(
        path.relative_to(folder).as_posix()
        for path in folder.rglob("*")
        if not path.name.startswith(".") and path.name not in pages
    )


def is_refused_everywhere(folder):
    for read in READERS.values():
        if callable(read):
            with pytest.raises(UsageError):
                read(folder)
        else:
            told = nlctl_here(*(part.format(folder) for part in read))
            assert (told.returncode, told.stdout) == (2, ""), told
            assert len(told.stderr.strip().splitlines()) == 1


def test_an_intact_folder_says_so(done):
    """Files, rows and analyses are counted; its page is no part of it."""
    found = verify(done)
    assert (found.is_intact, found.others, found.problems) == (True, (), ())
    assert found.rows == {"rows": 300, "compare": 60}
    assert found.done == found.analyses == ("probability", "worst-case", "compare")
    told = nlctl_here("verify", done)
    assert told.returncode == 0
    assert told.stdout == f"{found}\n"
    assert f"{found.files} files, 360 rows, 3 of 3 analyses" in told.stdout
    assert json.loads(nlctl_here("verify", done, "--json").stdout)["is_intact"] is True


def test_every_part_that_is_lost_is_noticed_by_every_reader(done, tmp_path):
    """Each file and each folder by itself; --resume puts all of it right."""
    names = parts_of(done)
    assert len(names) > 20
    for number, name in enumerate(names):
        folder = shutil.copytree(done, tmp_path / str(number))
        lost = folder / name
        shutil.rmtree(lost) if lost.is_dir() else lost.unlink()
        with pytest.raises(UsageError):
            load_result(folder)
        told = nlctl_here("verify", folder)
        assert told.returncode in (1, 2), (name, told)
        assert told.returncode == 2 or name in told.stdout
        shutil.rmtree(folder)


@pytest.mark.parametrize("name", ["probability", "rows", "rows/chunks", "contents.json"])
def test_no_reader_believes_what_is_left(copied, name):
    """A sync that lost a folder does not turn a refuted claim into a claim that is shown."""
    lost = copied / name
    shutil.rmtree(lost) if lost.is_dir() else lost.unlink()
    is_refused_everywhere(copied)


@settings(max_examples=many(40))
@given(data=st.data())
def test_one_bit_anywhere_is_noticed(done, tmp_path_factory, data):
    """In any file of the run, at any place."""
    names = [name for name in parts_of(done) if (done / name).is_file()]
    name = data.draw(st.sampled_from(names))
    content = bytearray((done / name).read_bytes())
    place = data.draw(st.integers(0, len(content) - 1))
    content[place] ^= 1 << data.draw(st.integers(0, 7))
    folder = shutil.copytree(done, tmp_path_factory.mktemp("bit") / "out")
    (folder / name).write_bytes(content)
    with pytest.raises(UsageError):
        load_result(folder)
    assert nlctl_here("verify", folder).returncode in (1, 2)
    shutil.rmtree(folder)


def chunk_more(folder):
    """A chunk of rows that another run has written."""
    chunks = sorted((folder / "rows" / "chunks").glob("*.parquet"))
    shutil.copy(chunks[0], chunks[0].with_name("000000300-000000363.parquet"))


def swapped(folder):
    one, other = (folder / k / "finding.json" for k in ("probability", "worst-case"))
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)


ADDED = {
    "a chunk": chunk_more,
    "a table": lambda f: shutil.copy(f / "worst-case/rows.parquet", f / "worst-case/x.parquet"),
    "a swap": swapped,
    "a link": lambda f: (f / "rows" / "chunks" / "1-2.parquet").symlink_to("/etc/passwd"),
}  # fmt: skip


@pytest.mark.parametrize("name", ADDED)
def test_what_is_too_much_or_in_another_place_is_noticed(copied, name):
    """It would be read as well."""
    ADDED[name](copied)
    is_refused_everywhere(copied)
    assert nlctl_here("verify", copied).returncode == 1


def test_foreign_files_are_told_and_do_no_harm(copied):
    """A note of the user's beside the results is his."""
    (copied / "notes.txt").write_text("mine")
    assert verify(copied).others == ("notes.txt",)
    assert load_result(copied).complete


def resealed(folder, name, change):
    """Change a file of a folder, and make every key fit again: what another version would write."""
    content = read_json(folder / name)
    change(content)
    write_json(folder / name, content)
    files = read_json(folder / "contents.json")
    files["files"][name] = file_digest(folder / name)
    write_json(folder / "contents.json", files)


def without_analysis(folder):
    """A refuted analysis taken out everywhere but in the study."""
    shutil.rmtree(folder / "probability")

    def change(content):
        content["findings"] = [f for f in content["findings"] if f["key"] != "probability"]
        content.update(holds=True, answer="shown", verdict="The claim is shown.")

    resealed(folder, "results.json", change)
    record = read_json(folder / "contents.json")
    record["files"] = {k: v for k, v in record["files"].items() if not k.startswith("probability")}
    record["done"] = record["analyses"] = ["worst-case", "compare"]
    write_json(folder / "contents.json", record)


def without_rows(folder):
    """A chunk taken out, and out of the record."""
    lost = sorted((folder / "rows" / "chunks").glob("*.parquet"))[-1]
    count = len(pd.read_parquet(lost))
    lost.unlink()
    record = read_json(folder / "contents.json")
    del record["files"][lost.relative_to(folder).as_posix()]
    record["rows"]["rows"] -= count
    write_json(folder / "contents.json", record)
    resealed(folder, "results.json", lambda c: c["rows"].update(done=300 - count))


def without_claim(folder):
    """A finding that no longer says what it claims."""
    resealed(folder, "probability/finding.json", lambda c: c.update(claim="", answer=""))

    def change(content):
        content["findings"][0].update(claim="", answer="")
        content.update(holds=True, answer="shown", verdict="The claim is shown.")

    resealed(folder, "results.json", change)


def other_verdict(folder):
    """Results that say something else than the findings."""
    resealed(
        folder, "results.json", lambda c: c.update(holds=True, verdict="All claims are shown.")
    )


@pytest.mark.parametrize("change", [without_analysis, without_rows, without_claim, other_verdict])
def test_parts_that_contradict_each_other_are_refused(copied, change):
    """Though every key is right: the study still asks for what is gone."""
    change(copied)
    with pytest.raises(RunFolderError):
        load_result(copied)
    assert nlctl_here("report", copied).returncode == 2
    assert nlctl_here("compare", copied, copied).returncode == 2


FILES = ["run.json", "results.json", "contents.json", "probability/finding.json",
         "worst-case/finding.json", "compare/finding.json", "rows/study.json"]  # fmt: skip
STRANGE = st.one_of(
    st.none(), st.booleans(), st.integers(-2, 10**30), st.floats(), st.text(max_size=5),
    st.just([]), st.just({}), st.just([[]]), st.just({"a": {"b": []}}), st.just("../../etc/passwd"),
    st.just("/"), st.just("\x00"), st.just("\x1b[2J"), st.just("nan"), st.just("<U3"),
)  # fmt: skip


def leaves_of(content, place=()):
    """The places of all values in data."""
    yield place
    parts = content.items() if isinstance(content, dict) else enumerate(content)
    for key, part in parts if isinstance(content, dict | list) else ():
        yield from (
            leaves_of(part, (*place, key)) if isinstance(part, dict | list) else [(*place, key)]
        )


def changed(content, place, how, value):
    *way, last = place
    for key in way:
        content = content[key]
    if how == "drop":
        del content[last]
    elif how == "add" and isinstance(content, dict):
        content["another"] = value
    else:
        content[last] = value


def any_sealed(folder, name, content):
    """Write a file with the key that fits, of JSON or of a sweep's."""
    if name == "rows/study.json":
        content.pop("sha256", None)
        content["sha256"] = store._key(content)
        (folder / name).write_text(json.dumps(content))
    else:
        write_json(folder / name, content)
    if name != "contents.json":
        record = read_json(folder / "contents.json")
        record["files"][name] = file_digest(folder / name)
        write_json(folder / "contents.json", record)


def nonsense_ends_in_a_sentence(done, folder, data):
    shutil.copytree(done, folder)
    name = data.draw(st.sampled_from(FILES))
    content = json.loads((folder / name).read_text())
    for key in ("sha256", "format") if name != "rows/study.json" else ():
        content.pop(key)
    places = [place for place in leaves_of(content) if place]
    change = (data.draw(st.sampled_from(["drop", "set", "add"])), data.draw(STRANGE))
    try:
        changed(content, data.draw(st.sampled_from(places)), *change)
        any_sealed(folder, name, content)
    except (ValueError, TypeError):  # JSON does not hold it
        return
    for command in (("verify", folder), ("report", folder), ("compare", folder, done)):
        told = nlctl_here(*command)
        assert told.returncode in (0, 1, 2, 5), (name, change, told)
        assert "Traceback" not in told.stderr


@settings(max_examples=many(25))
@given(data=st.data())
def test_resealed_nonsense_ends_in_a_sentence(done, tmp_path_factory, data):
    """Any value of any file dropped, exchanged or added, every key right: no trace, no exit 3."""
    folder = tmp_path_factory.mktemp("nonsense") / "out"
    nonsense_ends_in_a_sentence(done, folder, data)
    shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.weekly
@settings(max_examples=many(1500))
@given(data=st.data())
def test_much_resealed_nonsense_ends_in_a_sentence(done, tmp_path_factory, data):
    """The same, longer."""
    folder = tmp_path_factory.mktemp("nonsense") / "out"
    nonsense_ends_in_a_sentence(done, folder, data)
    shutil.rmtree(folder, ignore_errors=True)


@pytest.mark.parametrize(
    "name",
    ["run.json", "results.json", "contents.json", "probability/finding.json", "rows/study.json"],
)
@pytest.mark.parametrize("version", [1, 2, 4, "99", None, 3.5])
def test_other_formats_are_refused_by_name(copied, name, version):
    """Of the past and of the future, whatever their keys."""
    path = copied / name
    content = json.loads(path.read_text())
    known = content["format"]
    if version == known:
        return
    content |= {"format": version, "something": "new"}
    path.write_text(json.dumps(content))
    record = json.loads((copied / "contents.json").read_text())
    if name != "contents.json":  # as its run would have sealed it
        record["files"][name] = hashlib.sha256(path.read_bytes()).hexdigest()
        del record["sha256"], record["format"]
        write_json(copied / "contents.json", record)
    with pytest.raises(UsageError, match=f"has the format .*and this nlctl reads {known}"):
        load_result(copied)


@pytest.mark.weekly
def test_a_run_that_continues_is_not_taken_for_intact(copied, done):
    """While it runs, or after a kill, the record is gone; --resume ends with the same one.

    Nothing then says that the page is of these results: it is made again.
    """
    (copied / "contents.json").unlink()
    with pytest.raises(RunFolderError, match=r"has not come to an end.*continue it with --resume"):
        load_result(copied)
    again = run(read_study(done.parent / "study.toml"), copied, resume=True, threads=1)
    assert again.plain() == load_result(done).plain()
    now, before = (read_json(folder / "contents.json") for folder in (copied, done))
    assert now == before | {"page": {}}
    assert [text[-3:] for text in verify(copied).problems] == [
        "py'"
    ] * 3  # index.html, report.json, signals.json
    assert nlctl_here("report", copied).returncode == 1
    assert verify(copied).has_page
    assert verify(copied).is_intact


def test_runs_are_compared_table_by_table(copied, done, tmp_path):
    """Not only what results.json says: numbers of tables and rows, too."""
    assert run_differences(done, copied) == []
    other = tmp_path / "other"
    path = write(tmp_path, HEAD.replace("seed = 3", "seed = 4"), STUDY)
    run(read_study(path), other, threads=1)
    told = run_differences(done, other)
    assert any("of 'lag.rate' in the table rows, the first in line 0: was" in text for text in told)
    assert any("in the table worst-case.rows" in text for text in told)
    assert not any("wall_time" in text for text in told)
