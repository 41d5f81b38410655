"""Commands of the how-to pages print what the pages say, and their code runs."""

import re
import shlex

import pytest
from command_line import nlctl_here
from extras import needed
from places import ROOT

HOW_TO = ROOT / "docs" / "how-to"
COMMANDS = re.compile(r"^\$ nlctl (.*)\n((?:(?!\$ ).+\n)*)", re.MULTILINE)


def blocks(page, kind):
    return re.findall(
        rf"```{kind}\n(.*?)```", (HOW_TO / page).read_text(encoding="utf-8"), re.DOTALL
    )


@pytest.mark.slow
def test_commands_that_export_print_the_files(tmp_path):
    """Each prints the lines behind it, and the files are there."""
    commands = [
        pair for block in blocks("export.md", "console") for pair in COMMANDS.findall(block)
    ]
    assert len(commands) == 3
    for command, printed in commands:
        told = nlctl_here(*shlex.split(command), cwd=tmp_path)
        assert (told.returncode, told.stdout) == (0, printed), told.stderr
        assert all((tmp_path / name).stat().st_size > 1000 for name in printed.split())


@pytest.mark.slow
def test_code_that_exports_runs():
    (code,) = blocks("export.md", "python")
    exec(compile(code, "export.md", "exec"), {})


@pytest.mark.weekly
def test_the_page_on_fmus_says_what_is_so(tmp_path, monkeypatch):
    """Its command writes the file that it says, for all platforms, and its code runs."""
    needed("fmpy", "export")
    needed("ziglang", "export")
    ((command, printed),) = [
        pair for block in blocks("fmi.md", "console") for pair in COMMANDS.findall(block)
    ]
    (tmp_path / "build").mkdir()
    told = nlctl_here(*shlex.split(command), cwd=tmp_path)
    assert (told.returncode, told.stdout) == (0, printed), told.stderr
    assert 100_000 < (tmp_path / printed.strip()).stat().st_size < 300_000
    monkeypatch.chdir(tmp_path)
    namespace = {}
    for code in blocks("fmi.md", "python"):
        exec(compile(code, "fmi.md", "exec"), namespace)


def test_signatures_on_the_page_are_those_of_the_header():
    from nlctl import paper
    from nlctl.export import c_files, export_controller

    controller = export_controller(paper.example_1(), "controller", dt=0.0002, method="euler")
    header = c_files(controller)["controller.h"]
    (declared,) = blocks("export.md", "c")
    assert all(line in header for line in declared.splitlines())


@pytest.mark.ci
def test_code_of_a_page_that_runs_runs():
    needed("ziglang", "export")
    (code,) = blocks("live.md", "python")
    names = {}
    exec(compile(code, "live.md", "exec"), names)
    assert "live" in names["page"].numbers
