"""The command line, run as a user runs it."""

import multiprocessing
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from command_line import nlctl, nlctl_here
from rows import each_row

from nlctl.cli_report import _other_process


def refused(*arguments, cwd=None):
    """Run it with input that it must refuse; return the one sentence."""
    result = nlctl_here(*arguments, cwd=cwd)
    assert result.returncode == 2, result
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    return result.stderr.strip()


def test_help_lists_the_commands():
    """--help names every command."""
    text = nlctl("--help").stdout
    for command in ("report", "simulate", "check", "list", "diagram"):
        assert command in text


def test_help_imports_nothing_heavy():
    """Help is instant, since nothing that computes is imported for it."""
    code = (
        "import sys\n"
        "from nlctl.cli import main\n"
        "sys.argv = ['nlctl', '--help']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'control', 'numba', 'scipy', 'numpy', 'matplotlib', 'pandas'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stderr.strip() == "[]"


def test_simulate_writes_what_was_asked_for(tmp_path):
    """The table starts from the initial state that was set; the figure is an SVG."""
    result = nlctl_here(
        *("simulate", "example-1", "--until", "0.5", "--plot", "out.svg", "--csv", "out.csv"),
        *("--set", "actuator.b_r=0.6", "--set", "plant.x1(0)=0.8"),
        cwd=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    table = pd.read_csv(tmp_path / "out.csv")
    assert list(table.columns[:5]) == ["time", "y", "yd", "e", "r"]
    assert table["y"][0] == 0.8
    assert table["time"].iloc[-1] == 0.5
    assert (tmp_path / "out.svg").read_text().lstrip().startswith("<?xml")
    assert "max |.|" in result.stdout
    inside = table[(table["u"] > 0.5) & (table["u"] < 0.6)]
    np.testing.assert_array_equal(inside["v"], 0.0)  # b_r = 0.6 has reached the actuator


@each_row(
    ("setting", "message"),
    [
        ("actuator.b_x=1", "unknown parameter 'actuator.b_x'; nearest: 'actuator.b_r'"),
        ("actuator.b_r=-0.1", "DeadZone needs b_r > 0, got -0.1 (block 'actuator')"),
        ("actuator.b_r=wide", "actuator.b_r needs a number, got 'wide'"),
        ("actuator.b_r", "--set needs NAME=VALUE, got 'actuator.b_r'"),
        ("plant.x7(0)=1", "unknown state 'plant.x7'; nearest: 'plant.x2', 'plant.x1'"),
        ("plant.x1(0)=nan", "state 'plant.x1' needs a finite initial value, got nan"),
        ("law.beta=inf", "NussbaumLaw needs a finite beta, got inf (block 'law')"),
        ("filtered_error.lambdas=-1", "FilteredError needs a Hurwitz polynomial"),
    ],
)
def test_bad_settings_are_one_clear_sentence(setting, message, tmp_path):
    """Exit code 2, no traceback, nothing written."""
    said = refused("simulate", "example-1", "--set", setting, "--csv", "out.csv", cwd=tmp_path)
    assert message in said
    assert list(tmp_path.iterdir()) == []


def test_other_bad_input_is_refused_before_anything_runs(tmp_path):
    """Unknown example or block, a figure format, a folder, a horizon."""
    assert "unknown example 'example-3'" in refused("simulate", "example-3")
    assert "nearest: 'DeadZone'" in refused("list", "DeadZon")
    assert ".svg, .png, .pdf" in refused("diagram", "example-1", "-o", "loop.gif")
    assert "needs 0 < step < until" in refused("simulate", "example-1", "--until", "-1")
    blocked = tmp_path / "file"
    blocked.write_text("")
    for command in (["simulate", "example-1", "--csv"], ["diagram", "example-1", "-o"]):
        said = refused(*command, str(blocked / "out.svg"))
        assert f"'{blocked}' is not a folder" in said
    assert "is not a folder" in refused("report", "--out", str(blocked / "report"))


def test_divergence_is_reported_with_its_time(tmp_path):
    """A start at zeta = 30 overflows: exit code 2, and no table of calm numbers."""
    said = refused(
        "simulate", "example-1", "--set", "law.zeta(0)=30", "--csv", "out.csv", cwd=tmp_path
    )
    assert "diverged: no finite state after t = 0 s" in said
    assert list(tmp_path.iterdir()) == []


def test_list_shows_blocks_with_units_and_bounds():
    """Every block record is listed; one can be asked for alone."""
    text = nlctl_here("list").stdout
    for block in ("DeadZone", "Backlash", "ForcedDuffing", "Genesio", "NussbaumLaw", "example-2"):
        assert block in text
    alone = nlctl_here("list", "ForcedDuffing").stdout
    assert "rad/s" in alone
    assert "DeadZone" not in alone


@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_diagram_is_drawn_in_each_format(suffix, tmp_path):
    """The file begins as its format does."""
    path = tmp_path / f"loop.{suffix}"
    assert nlctl_here("diagram", "example-2", "-o", str(path)).returncode == 0
    start = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix]
    assert path.read_bytes().startswith(start)


def test_console_script_points_to_main():
    """pyproject's script is the function that these tests run."""
    text = (Path(__file__).parents[1] / "pyproject.toml").read_text(encoding="utf-8")
    assert 'nlctl = "nlctl.cli:main"' in text


def fail_beside(tasks):
    """Fail while another process sleeps."""
    with _other_process() as pool:
        tasks += [pool.submit(time.sleep, 3600) for _ in range(4)]
        while not tasks[0].running():
            time.sleep(0.01)
        raise ZeroDivisionError


def test_the_other_process_of_a_report_ends_when_this_one_fails():
    """Neither what it is doing nor what is waiting holds up the message."""
    tasks = []
    with pytest.raises(ZeroDivisionError):
        fail_beside(tasks)
    assert not multiprocessing.active_children()
    for task in tasks:
        with pytest.raises((BrokenProcessPool, CancelledError)):
            task.result()
