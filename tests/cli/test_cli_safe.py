"""What a terminal and other users get to see: no orders, no more rights than the umask gives."""

import json
import os
import resource
import shutil
import subprocess
import sys

import pytest
from command_line import nlctl, nlctl_here
from examples import some
from studies_example import HEAD, write

from nlctl.analysis.cli.printing import in_json, printable
from nlctl.analysis.studies import read_study, run
from nlctl.analysis.studies.sealed import file_digest, read_json, write_json
from nlctl.host.files import replace_file

SMALL = '[runs]\nsize = 8\n\n[[analysis]]\nkind = "probability"\nlimit = 0.9\n'
ORDERS = ["\x1b]0;owned\x07", "\x1b[2J", "\x9b31m", "\x08\x08", "\x7f", "\r", "\u202e", "\u2028"]


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("safe")
    run(read_study(write(folder, HEAD, SMALL)), folder / "out", threads=1)
    return folder / "out"


def ordered(done, folder, text):
    """A received folder with orders to a terminal in whatever it says, every key right."""
    shutil.copytree(done, folder)
    for name in ("probability/finding.json", "results.json"):
        content = read_json(folder / name)
        for part in content.get("findings", [content]):
            part["sentence"] += text
            part["title"] += text
        if "notes" in content:
            content["notes"] = [f"note {text}"]
        write_json(folder / name, content)
        record = read_json(folder / "contents.json")
        record["files"][name] = file_digest(folder / name)
        write_json(folder / "contents.json", record)
    return folder


@pytest.mark.weekly
@pytest.mark.parametrize(
    "text", ["".join(ORDERS), *(pytest.param(one, marks=pytest.mark.weekly) for one in ORDERS)]
)
def test_received_folders_give_no_orders_to_a_terminal(done, tmp_path, text):
    """Whatever reads them: report, compare, verify, in words and in JSON."""
    folder = ordered(done, tmp_path / "out", text)
    for command in some([
        ("report", folder), ("compare", folder, done), ("replay", folder, 1),
        ("compare", folder, done, "--json"), ("verify", folder), ("report", f"{folder}{text}"),
    ]):  # fmt: skip
        told = nlctl_here(*command)
        assert "Traceback" not in told.stderr
        for out in (told.stdout, told.stderr):
            assert out.replace("\n", "").replace("\t", "").isprintable(), (command, out)
        if "--json" in command:
            assert json.loads(told.stdout)


@pytest.mark.parametrize("text", ORDERS)
def test_orders_are_spelt_out(text):
    """What is printed says what stood there; JSON stays what it is."""
    assert printable(f"a{text}b\n").replace("\n", "").isprintable()
    assert printable("über\n\tx") == "über\n\tx"
    assert json.loads(in_json({text: [text]})) == {text: [text]}
    assert in_json({text: [text]}).replace("\n", "").isprintable()


@pytest.mark.parted
@pytest.mark.skipif(os.name != "posix", reason="modes of files are POSIX's")
@pytest.mark.parametrize("mask", [0o077, 0o027, 0o002, 0o000])
def test_files_obey_the_umask(tmp_path, mask):
    """Of a run, its lock, its page, and whatever else is written in one step."""
    before = os.umask(mask)
    try:
        (tmp_path / "asked").touch()
        replace_file(tmp_path / "one", lambda file: file.write(b"1"))
        path = write(tmp_path, HEAD, SMALL)
        assert nlctl_here("run", path, "--out", tmp_path / "out").returncode == 0
        assert nlctl_here("report", tmp_path / "out").returncode == 0
    finally:
        os.umask(before)
    wanted = (tmp_path / "asked").stat().st_mode & 0o777
    assert wanted == 0o666 & ~mask
    made = [path for path in (tmp_path / "out").rglob("*") if path.is_file()]
    assert len(made) > 8
    modes = {path.name: path.stat().st_mode & 0o777 for path in [*made, tmp_path / "one"]}
    assert {name: mode for name, mode in modes.items() if mode != wanted} == {}


@pytest.mark.skipif(sys.platform != "linux", reason="address space is limited on Linux")
@pytest.mark.parametrize("size", [300, 700, 1000, pytest.param(1150, marks=pytest.mark.ci)])
@pytest.mark.parametrize("command", ["run", pytest.param("validate", marks=pytest.mark.ci)])
def test_under_a_memory_limit_a_run_ends_with_a_message(tmp_path, command, size):
    """In MB of address space: neither a trace nor a wait, and the line that goes on."""
    path = write(tmp_path, HEAD, SMALL)

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (size * 10**6, size * 10**6))

    told = nlctl(command, path, cwd=tmp_path, preexec_fn=limited)
    assert told.returncode == (4 if command == "run" else 2), told
    assert "nlctl: this needs more memory than there is" in told.stderr
    assert "Traceback" not in told.stderr
    assert ("begin with: nlctl run" in told.stderr) == (command == "run")


@pytest.mark.skipif(sys.platform != "linux", reason="address space is limited on Linux")
@pytest.mark.weekly
@pytest.mark.parametrize("size", [1300, 1380, 1450, 1600, 2000, 2600])
def test_with_some_more_memory_it_runs_or_says_so(tmp_path, size):
    """Around what it takes: no wait, no abort of a library, whatever was begun when it ran out."""
    path = write(tmp_path, HEAD, SMALL)

    def limited():
        resource.setrlimit(resource.RLIMIT_AS, (size * 10**6, size * 10**6))

    told = nlctl("run", path, "--out", tmp_path / "out", cwd=tmp_path, preexec_fn=limited)
    assert told.returncode in ((0,) if size >= 1600 else (0, 4)), told
    assert (told.returncode == 4) == ("this needs more memory than there is" in told.stderr)
    assert "Traceback" not in told.stderr


@pytest.mark.weekly
def test_few_threads_of_others_read_a_folder(done):
    """Those of pyarrow wait for ever where no memory is left to begin more."""
    script = (
        "import sys, threading, pathlib\n"
        "from nlctl.analysis.studies import load_result\n"
        "from nlctl.analysis.robustness.runs.store import read_parquet\n"
        "import pyarrow.parquet, pandas\n"
        "count = lambda: len(list(pathlib.Path('/proc/self/task').iterdir()))\n"
        "before = count()\n"
        "result = load_result(pathlib.Path(sys.argv[1]))\n"
        "assert len(result.rows.table) == 8\n"
        "print(count() - before)\n"
    )
    if not os.path.exists("/proc/self/task"):
        pytest.skip("threads are counted on Linux")
    told = subprocess.run(
        [sys.executable, "-c", script, str(done)], capture_output=True, text=True, check=True
    )
    assert int(told.stdout) <= 2
