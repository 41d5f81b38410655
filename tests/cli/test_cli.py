"""The command line, run as a user runs it."""

import multiprocessing
import re
import subprocess
import sys
import time
from concurrent.futures import CancelledError
from concurrent.futures.process import BrokenProcessPool

import numpy as np
import pandas as pd
import pytest
from command_line import nlctl, nlctl_here
from places import ROOT
from rows import each_row

from nlctl.analysis.catalogue import block_records, block_summaries
from nlctl.analysis.cli.report import _other_process

PROGRESS = re.compile(r".*: (\d+ %|done), \d+ s")  # of what takes more than two seconds


def refused(*arguments, cwd=None):
    """Run it with input that it must refuse; return the one sentence."""
    result = nlctl_here(*arguments, cwd=cwd)
    assert result.returncode == 2, result
    assert "Traceback" not in result.stderr
    lines = result.stderr.strip().splitlines()
    (said,) = (line for line in lines if not PROGRESS.fullmatch(line))
    return said


def test_help_lists_the_commands():
    """--help names every command."""
    text = nlctl("--help").stdout
    for command in ("report", "simulate", "check", "list", "diagram"):
        assert command in text


def test_help_imports_nothing_heavy():
    """Help is instant, since nothing that computes is imported for it."""
    code = (
        "import sys\n"
        "from nlctl.analysis.cli.main import main\n"
        "sys.argv = ['nlctl', '--help']\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'control', 'numba', 'scipy', 'numpy', 'matplotlib', 'pandas'}\n"
        "print(sorted(heavy & set(sys.modules)), file=sys.stderr)\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stderr.strip() == "[]"


def test_small_signals_need_a_small_tolerance(tmp_path):
    """In m and A rather than nm and uA: what `atol` may be all of is named, and no page of it."""
    (tmp_path / "stage.py").write_text(
        "import control as ct\n"
        "import numpy as np\n"
        "def make():\n"
        "    sine = ct.nlsys(None, lambda t, x, u, p: np.sin(5 * t), inputs=0, outputs=['u'])\n"
        "    stage = ct.ss([[0, 1], [-4e4, -8]], [[0], [4e-7]], [[1, 0]], 0, inputs=['u'], "
        "outputs=['y'])\n"
        "    return ct.interconnect([sine, stage], outputs=['y'], name='stage')\n"
    )
    run = ("simulate", "stage.py:make", "--until", "2")
    assert "take a smaller atol" in nlctl_here(*run, cwd=tmp_path).stderr
    fine = nlctl_here(*run, "--atol", "1e-18", "--csv", "out.csv", cwd=tmp_path)
    assert fine.returncode == 0
    assert "atol" not in fine.stderr
    late = pd.read_csv(tmp_path / "out.csv")["y"][100:]
    assert late.abs().max() == pytest.approx(1e-11, rel=1e-2)
    assert "simulate it with smaller tolerances" in refused("report", *run[1:], cwd=tmp_path)
    assert "finite atol > 0" in refused(*run, "--atol", "0", cwd=tmp_path)


@pytest.mark.slow
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
    assert result.stdout.split()[-2:] == ["out.csv", "out.svg"]
    inside = table[(table["u"] > 0.5) & (table["u"] < 0.6)]
    np.testing.assert_array_equal(inside["v"], 0.0)  # b_r = 0.6 has reached the actuator


@each_row(
    ("setting", "message"),
    [
        ("actuator.b_x=1", "unknown parameter 'actuator.b_x'; nearest: 'actuator.b_r'"),
        ("actuator.b_r=-0.1", "DeadZone needs b_r >= 0, got -0.1 (block 'actuator')"),
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


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["svg", "png", "pdf"])
def test_diagram_is_drawn_in_each_format(suffix, tmp_path):
    """The file begins as its format does."""
    path = tmp_path / f"loop.{suffix}"
    assert nlctl_here("diagram", "example-2", "-o", str(path)).returncode == 0
    start = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[suffix]
    assert path.read_bytes().startswith(start)


def test_console_script_points_to_main():
    """pyproject's script is the function that these tests run."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert 'nlctl = "nlctl.__main__:main"' in text


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


OWN_LOOP = """
import control as ct
import nlctl

def example():
    return nlctl.paper.example_1()

def driven():
    return ct.ss([[-1.0]], [[1.0]], [[1.0]], [[0.0]], inputs=["w"], outputs=["y"], name="lag")

def broken():
    return helper(0)

def helper(x):
    return 1 / x

def number():
    return 3
"""


@pytest.fixture
def own(tmp_path):
    (tmp_path / "my.py").write_text(OWN_LOOP, encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_loops_of_ones_own_run_with_inputs(own, engine):
    """y' = -y + w from 0: y = w (1 - exp(-t)), in either engine."""
    result = nlctl_here(
        *("simulate", "my.py:driven", "--until", "2", "--input", "w=3.0", "--csv", "out.csv"),
        *("--engine", engine),
        cwd=own,
    )
    assert result.returncode == 0, result.stderr
    table = pd.read_csv(own / "out.csv")
    np.testing.assert_allclose(table["y"], 3 * (1 - np.exp(-table["time"])), atol=1e-6)


@pytest.mark.slow
def test_loops_of_modules_and_files_are_drawn_and_checked(own):
    """A function of a module, and one of a file."""
    drawn = nlctl_here("diagram", "nlctl.paper:example_2", "-o", "out.svg", cwd=own)
    assert (drawn.returncode, (own / "out.svg").exists()) == (0, True), drawn.stderr
    checked = nlctl_here("check", "my.py:example", "--horizon", "0.5", cwd=own)
    assert checked.returncode in (1, 5), checked.stderr
    assert "lines:" in checked.stdout


@each_row(
    ("arguments", "message"),
    [
        (("simulate", "my.py:gone"), "unknown function 'gone' in 'my.py'"),
        (("simulate", "gone.py:loop"), "there is no file"),
        (("simulate", "my.py:number"), "needs to return a diagram, it returned int"),
        (("simulate", "example-3"), "a loop of your own is path/to/file.py:function"),
        (("simulate", "my.py:driven", "--input", "v=1"), "unknown input 'v' of 'lag'"),
        (("simulate", "my.py:driven", "--input", "w=nan"), "needs a finite input 'w', got nan"),
        (("simulate", "my.py:driven", "--engine", "fast"), "unknown engine 'fast'"),
        (("simulate", "example-1", "--until", "1e12"), "at most 2e+06 samples"),
        (("simulate", "example-1", "--step", "1e-9"), "at most 2e+06 samples"),
        (("simulate", "example-1", "--plot", "gone/x.svg"), "there is no folder 'gone'"),
        (("simulate", "example-1", "--csv", "."), "it is a folder"),
        (("report", "--out", "/proc/foo"), "cannot write to '/proc/foo'"),
    ],
)
def test_what_cannot_be_run_or_written_is_one_sentence(arguments, message, own):
    """Before anything is computed."""
    assert message in refused(*arguments, cwd=own)


def test_an_error_in_a_users_function_shows_his_lines_alone(own):
    """Kind, message and the lines of his files."""
    for command in (("simulate", "my.py:broken"), ("diagram", "my.py:broken", "-o", "x.svg")):
        told = nlctl_here(*command, cwd=own)
        assert told.returncode == 3
        lines = told.stderr.strip().splitlines()
        assert lines[0] == "nlctl: ZeroDivisionError: division by zero"
        files = [line for line in lines if line.strip().startswith("File ")]
        ours = [line for line in files if "my.py" in line]
        assert len(ours) == 2
        assert not [line for line in files if "site-packages" in line or "nlctl/" in line]


def test_the_version_is_the_packages():
    """On the command line, as an attribute, and by `python -m nlctl`."""
    import nlctl as package

    told = subprocess.run(
        [sys.executable, "-m", "nlctl", "--version"], capture_output=True, text=True, check=True
    )
    assert told.stdout.strip() == f"nlctl {package.__version__}"
    assert nlctl_here("--version").stdout.strip() == told.stdout.strip()


def test_the_list_has_one_line_per_block_in_groups():
    """Every block once, below what it is for; the sources say what the records say."""
    lines = nlctl_here("list").stdout.splitlines()
    assert [line for line in lines if line in ("Plants", "Actuators", "References", "Controllers")]
    for name in block_records():
        assert sum(line.split()[:1] == [name] for line in lines) == 1
    told = {name: line for group in block_summaries().values() for name, line in group.items()}
    assert told == {n: (r.__doc__ or "").splitlines()[0] for n, r in block_records().items()}
    assert list(told) == list(block_records())


def test_the_list_imports_no_library_of_numbers():
    """It answers at once."""
    program = (
        "import sys; from nlctl.__main__ import main; sys.argv = ['nlctl', 'list']\n"
        "try: main()\n"
        "except SystemExit as end: assert not end.code\n"
        "heavy = {'numpy', 'scipy', 'numba', 'control', 'matplotlib', 'pandas'}\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", program], check=True, capture_output=True)
