"""What was received runs nothing: trust is this user's, by hash, and no file's own."""

import importlib.util
import marshal
import os
import pickle
import shutil
import struct
import sys
from pathlib import Path

import control as ct
import pytest
from command_line import nlctl_here
from examples import crossed
from studies_example import HEAD, write
from test_studies_trust import (
    PLACES,
    SMALL,
    in_choices,
    in_comparison,
    in_kind,
    in_loop,
    in_metrics,
    in_options,
    nested,
)

from nlctl.analysis.studies import StudyError, load_result, read_study, replay, run
from nlctl.analysis.studies.code.rule import record_file
from nlctl.analysis.studies.sealed import file_digest, read_json, write_json


class Touches:
    """A pickle that leaves a mark when it is loaded."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return (open, (str(self.mark), "w"))


@pytest.fixture
def home(tmp_path):
    folder = tmp_path / "study"
    folder.mkdir()
    write(folder, HEAD, SMALL)
    with (tmp_path / "evil.pkl").open("wb") as file:
        pickle.dump(Touches(tmp_path / "ran"), file)
    return folder


@pytest.fixture(autouse=True)
def own_record(tmp_path, monkeypatch):
    """A record of this user's for each test."""
    monkeypatch.setenv("NLCTL_CONFIG_DIR", str(tmp_path / "config"))


ARGUMENTS = {  # functions of others, with what makes them dangerous
    "pandas:read_pickle": 'filepath_or_buffer = "{0}/evil.pkl"',
    "pandas:read_csv": 'filepath_or_buffer = "{0}/evil.pkl"',
    "pandas.io.pickle:read_pickle": 'filepath_or_buffer = "{0}/evil.pkl"',
    "numpy:load": 'file = "{0}/evil.pkl", allow_pickle = true',
    "numpy:savetxt": 'fname = "{0}/ran", X = [1.0]',
    "numpy:save": 'file = "{0}/ran.npy", arr = [1.0]',
    "matplotlib.pyplot:savefig": 'fname = "{0}/ran"',
    "scipy.io:savemat": 'file_name = "{0}/ran", mdict = 1',
    "pyarrow.parquet:read_table": 'source = "{0}/evil.pkl"',
    "cloudpickle:loads": 'data = "x"',
    "numba.misc.quicksort:make_py_quicksort": "",
    "nlctl.host.files:replace_file": 'path = "{0}/ran", write = 1',
    "nlctl:input_output_response": "sys = 1",
    "nlctl.native.machine.store:stored": 'key = "x"',
    "nlctl.analysis.cli.loops:named_loop": 'name = "{0}/evil.py:loop"',
    "nlctl.analysis.cli.report:write_gallery_of": 'folder = "{0}", open_ = false',
    "nlctl.analysis.studies.resolve:named_function": 'name = "{0}/evil.py:loop", folder = "/"',
    "nlctl.analysis.studies.resolve:option": 'value = 1, folder = "/"',
    "nlctl.analysis.studies.code.loading:load_file": 'path = "{0}/evil.py"',
    "nlctl.analysis.studies.code.rule:remember": "statements = []",
    "nlctl.analysis.studies:read_study": 'path = "{0}/evil.toml", trust = true',
    "nlctl.analysis.studies.folder:remove_run": 'folder = "{0}"',
}
EVIL = "import pathlib\npathlib.Path({mark!r}).touch()\n"


def with_arguments(parts, name, arguments):
    """Give the function of a study its arguments."""
    function = f'{{ function = "{name}"'
    return [
        part.replace(function, f"{function}, {arguments}" if arguments else function)
        for part in parts
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("where", "name"),
    crossed([in_options, in_choices, in_comparison, in_metrics, nested], [*ARGUMENTS]),
)
def test_a_study_alone_calls_nobody_elses_function(home, name, where):
    """Wherever a file names it, with whatever arguments."""
    base = home.parent
    (base / "evil.py").write_text(EVIL.format(mark=str(base / "ran")))
    before = {path: path.stat().st_mtime_ns for path in base.rglob("*")}
    path = write(home, *with_arguments(where(name), name, ARGUMENTS[name].format(base)))
    with pytest.raises(StudyError, match="Trust it with --trust") as told:
        read_study(path)
    assert any(problem.needs_trust for problem in told.value.problems)
    assert not list(base.glob("ran*"))
    after = {path: path.stat().st_mtime_ns for path in base.rglob("*")}
    assert {p for p in after if p not in before or home not in (p, *p.parents)} <= set(before)


@pytest.mark.parametrize(
    "name",
    ["nlctl.analysis.cli.loops:named_loop", "nlctl.analysis.loop_report:loop_report",
     "nlctl.host.workers:process_pool", "pandas:read_pickle"],
)  # fmt: skip
@pytest.mark.parametrize("where", [in_loop, in_kind])
def test_nor_as_its_loop_or_a_kind(home, where, name):
    """`named_loop` uses nlctl, and would import whatever it is told."""
    with pytest.raises(StudyError, match="Trust it with --trust"):
        read_study(write(home, *where(name)))


IMPORTED = """
import functools
import pandas
import pandas as table
from pandas import read_pickle
from numpy import load as opened
from nlctl.analysis.studies.resolve import named_function

partial = functools.partial(read_pickle)
cached = functools.lru_cache(read_pickle)
frame = pandas.DataFrame
"""


@pytest.mark.parametrize(
    "name", ["read_pickle", "opened", "partial", "cached", "frame", "named_function"]
)
def test_a_name_that_a_file_has_imported_is_not_its_own(home, name):
    """Where a function was defined counts."""
    base = home.parent
    path = write(home, *with_arguments(
        in_options(f"loop.py:{name}"), f"loop.py:{name}", f'filepath_or_buffer = "{base}/evil.pkl"'
    ))  # fmt: skip
    with (home / "loop.py").open("a", encoding="utf-8") as file:
        file.write(IMPORTED)
    with pytest.raises(StudyError, match=r"is a function of .* Trust it with --trust"):
        read_study(path)
    assert not (base / "ran").exists()


@pytest.mark.parted
@pytest.mark.parametrize(
    "name",
    ["control:set_defaults", "control:reset_defaults", "control:use_fbs_defaults",
     "control.config:use_legacy_defaults", "control:bode_plot", "control.sisotool:sisotool",
     "control.matlab:bode", "control:ControlPlot"],
)  # fmt: skip
def test_what_makes_no_system_of_python_control_is_not_called(home, name):
    """It may change what every later run of the process computes."""
    before = dict(ct.config.defaults)
    with pytest.raises(StudyError, match="Trust it with --trust"):
        read_study(write(home, *in_options(name)))
    assert dict(ct.config.defaults) == before


@pytest.mark.parametrize("name", ["control:ss", "control:tf", "control:rss", "control.nlsys:nlsys"])
def test_what_makes_systems_is_asked_for_nothing(home, name):
    """Other mistakes are told of it: not that it needs trust."""
    with pytest.raises(StudyError) as told:
        read_study(write(home, *in_options(name)))
    assert "--trust" not in str(told.value)


def test_packages_within_the_folder_are_no_files_of_the_study(home):
    """A virtual environment beside a study does not make its packages the study's."""
    site = home / ".venv" / "lib" / "site-packages" / "other"
    site.mkdir(parents=True)
    (site / "maker.py").write_text(EVIL.format(mark=str(home.parent / "ran")))
    path = write(home, *in_options(".venv/lib/site-packages/other/maker.py:make"))
    with pytest.raises(StudyError, match="Trust it with --trust"):
        read_study(path)
    assert not (home.parent / "ran").exists()


def forget():
    """Modules of study folders are read anew, as in another process."""
    for name in [name for name in sys.modules if name.startswith(("loop_", "kind_", "helper_"))]:
        del sys.modules[name]


def evil_kind(mark):
    return f"import pathlib\npathlib.Path({str(mark)!r}).touch()\nspread = 1\n"


def evil_loop(home, mark):
    text = (home / "loop.py").read_text(encoding="utf-8")
    return f"import pathlib\npathlib.Path({str(mark)!r}).touch()\n{text}"


def sent(home, base, place):
    """A run folder as somebody may send it: every key right, the code where he wants it."""
    run(read_study(home / "study.toml"), base / "theirs", threads=1)
    folder = base / "received" / "out"
    shutil.copytree(base / "theirs", folder)
    content = read_json(folder / "run.json")
    write_json(folder / "run.json", content | {"study_folder": place})
    record = read_json(folder / "contents.json")
    record["files"]["run.json"] = file_digest(folder / "run.json")
    write_json(folder / "contents.json", record)
    return folder


FOLDERS = [".", "..", "/", "../..", "code", "{absolute}"]


@pytest.mark.parted
@pytest.mark.parametrize("place", FOLDERS)
def test_a_received_folder_executes_nothing(home, tmp_path, place):
    """Wherever it says that its code is; a page is made of its data, and what runs code refuses."""
    mark = tmp_path / "ran"
    place = place.format(absolute=tmp_path / "code")
    folder = sent(home, tmp_path, place)
    os.remove(record_file())  # of another user
    there = (folder / place).resolve()
    if there == there.parent:
        there = folder.parent  # nobody writes to /
    there.mkdir(exist_ok=True, parents=True)
    (there / "loop.py").write_text(evil_loop(home, mark))
    forget()
    told = nlctl_here("report", folder)
    assert (told.returncode, "no fans" in told.stderr) == (0, True), told
    assert (folder / "index.html").exists()
    assert nlctl_here("replay", folder, 1).returncode == 2
    assert nlctl_here("compare", folder, folder).returncode == 0
    assert nlctl_here("verify", folder).returncode == 0
    assert load_result(folder).complete
    assert not mark.exists()


KIND = '''
from nlctl.analysis.studies import Asked, Kind, finding_of


class Rows(Asked):
    """How many rows there are."""


def run(asked, ground):
    return finding_of(asked, "There are rows.", numbers={"rows": len(ground.rows.table)})


rows = Kind(name="rows", schema=Rows, run=run, title="Rows", needs_rows=True)
'''


def test_a_kind_of_a_received_folder_is_not_imported(home, tmp_path):
    """Whatever reads the folder: its finding is told without figures."""
    (home / "kind.py").write_text(KIND)
    path = write(home, *in_kind("kind.py:rows"))
    result = run(read_study(path), home / "out", threads=1)
    assert load_result(home / "out").notes == ()
    received = shutil.copytree(home, tmp_path / "received") / "out"
    (tmp_path / "received" / "kind.py").write_text(evil_kind(tmp_path / "ran") + KIND)
    again = load_result(received)
    assert again["rows-2"].plain() == result["rows-2"].plain()
    assert any("neither run nor trusted" in note for note in again.notes)
    assert nlctl_here("report", received).returncode == 0
    assert nlctl_here("compare", received, home / "out").returncode == 0
    assert not (tmp_path / "ran").exists()


def test_what_this_user_has_run_is_his_wherever_it_lies(home, tmp_path):
    """The same study with the same code: moved or copied, it is redrawn without a question."""
    run(read_study(home / "study.toml"), home / "out", threads=1)
    moved = shutil.move(home, tmp_path / "moved")
    assert replay(moved / "out", 1).differences == ()
    told = nlctl_here("report", moved / "out")
    assert (told.returncode, told.stderr) == (0, "")
    (moved / "loop.py").write_text("# edited\n" + (moved / "loop.py").read_text())
    with pytest.raises(StudyError, match=r"'loop\.py' is code that this user has neither run nor"):
        replay(moved / "out", 1)
    forget()
    assert replay(moved / "out", 1, trust=True).differences == ()
    assert replay(moved / "out", 1).differences == ()  # trusted once, as it is


def test_a_neighbour_is_trusted_by_its_own_content(home, tmp_path):
    """A file that was run imports what came with the folder: that was not run."""
    text = (home / "loop.py").read_text()
    asks = "try:\n    import more\nexcept ImportError:\n    more = None\n"
    (home / "loop.py").write_text(f"import helper\n{asks}{text}")
    (home / "helper.py").write_text("GAIN = 1.0\n")
    run(read_study(home / "study.toml"), home / "out", threads=1)
    for name, content in (("helper", "GAIN = 1.0\n"), ("more", "")):
        folder = tmp_path / f"received with {name}"
        shutil.copytree(home, folder)
        (folder / f"{name}.py").write_text(content + EVIL.format(mark=str(tmp_path / "ran")))
        assert nlctl_here("replay", folder / "out", 1).returncode == 2
        assert nlctl_here("report", folder / "out").returncode == 0
        assert not (tmp_path / "ran").exists()


def test_another_study_does_not_inherit_trust(home, tmp_path):
    """What was trusted is this code of this study: another one may call it with other arguments."""
    (tmp_path / "other.py").write_text((home / "loop.py").read_text())
    path = write(home, *in_loop("../other.py:loop"))
    read_study(path, trust=True)
    assert read_study(path).experiment.space.names
    path.write_text(path.read_text().replace("seed = 3", "seed = 4"))
    with pytest.raises(StudyError, match="Trust it with --trust"):
        read_study(path)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="modes of files are POSIX's")
def test_a_record_that_others_may_write_is_none(home, tmp_path):
    """Nor one that is damaged; a run does not fail for it."""
    run(read_study(home / "study.toml"), home / "out", threads=1)
    assert record_file().stat().st_mode & 0o077 == 0
    for spoil in (lambda p: p.chmod(0o666), lambda p: p.write_text("[1, 2"), lambda p: p.unlink()):
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv(
                "NLCTL_CONFIG_DIR", str(shutil.copytree(record_file().parent, tmp_path / "c"))
            )
            assert replay(home / "out", 1).differences == ()
            spoil(record_file())
            with pytest.raises(StudyError, match="neither run nor trusted"):
                replay(home / "out", 1)
        shutil.rmtree(tmp_path / "c")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("NLCTL_CONFIG_DIR", "/proc/nowhere")
        assert run(read_study(home / "study.toml"), home / "other", threads=1).complete


def test_compiled_code_beside_a_file_is_not_run(home, tmp_path):
    """``__pycache__`` says what a file was compiled to, and may come from anybody."""
    loop = home / "loop.py"
    source = loop.read_bytes()
    header = importlib.util.MAGIC_NUMBER + struct.pack(
        "<LLL", 0, int(loop.stat().st_mtime), len(source)
    )
    planted = compile(evil_loop(home, tmp_path / "ran"), str(loop), "exec")
    cached = Path(importlib.util.cache_from_source(str(loop)))
    cached.parent.mkdir()
    cached.write_bytes(header + marshal.dumps(planted))
    assert read_study(home / "study.toml").experiment.space.names
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("where", PLACES)
def test_each_place_is_looked_at(home, where):
    """No place of a file lets a name through that another one does not."""
    (home.parent / "evil.py").write_text(EVIL.format(mark=str(home.parent / "ran")))
    for name in ("../evil.py:make", "../nowhere/../evil.py:make", f"{home.parent}/evil.py:make"):
        with pytest.raises(StudyError, match="Trust it with --trust"):
            read_study(write(home, *where(name)))
    assert not (home.parent / "ran").exists()
