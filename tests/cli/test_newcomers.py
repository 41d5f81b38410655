"""What three newcomers did, file by file and command by command, in processes of their own."""

import os
import re
import subprocess
import sys
from xml.etree import ElementTree

import pytest
from command_line import NLCTL, nlctl
from places import ROOT

pytestmark = [pytest.mark.ci]

START = (ROOT / "docs" / "how-to" / "start.md").read_text(encoding="utf-8")
QUIET = os.environ | {"MPLBACKEND": "agg"}


def told(*arguments, cwd, codes=(0,)):
    """Run a command, which ends with one of these exit codes; return what it has printed."""
    done = nlctl(*arguments, cwd=cwd)
    assert done.returncode in codes, done.stderr
    assert "Traceback" not in done.stderr
    return done.stdout


def text_of(page):
    return re.sub(r"\s+", " ", re.sub("<[^>]*>", " ", page.read_text(encoding="utf-8")))


@pytest.mark.weekly
def test_the_commands_of_the_guide_run_one_after_the_other(tmp_path):
    """From nothing to a loop, its picture, its page, a study, and a test that passes."""
    (block,) = re.findall(r"```console\n(.*?)```", START, flags=re.DOTALL)
    commands = [line.removeprefix("$ ").split() for line in block.splitlines()]
    for program, *arguments in commands:
        if program == "nlctl":
            told(*arguments, cwd=tmp_path)
            continue
        done = subprocess.run(
            [sys.executable, "-m", program, "-p", "no:cacheprovider", *arguments],
            cwd=tmp_path, capture_output=True, text=True, check=False, timeout=600,
        )  # fmt: skip
        assert done.returncode == 0, done.stdout + done.stderr
        assert "3 passed" in done.stdout
    assert (tmp_path / "my-loop/run.svg").read_text(encoding="utf-8").count("<path") > 20
    shown = text_of(tmp_path / "reports/loop/index.html")
    for part in (
        "plant.mass",
        "The equations of the loop",
        "A run",
        "All 3 checks of the loop hold.",
    ):
        assert part in shown
    suite = ElementTree.parse(tmp_path / "my-loop/claims.xml").getroot()
    assert suite.attrib == {
        "name": "A cart behind a dead zone", "tests": "1", "failures": "0", "errors": "0",
        "skipped": "0",
    }  # fmt: skip
    assert "already" in nlctl("new", "my-loop", cwd=tmp_path).stderr


RESEARCHER = """
import nlctl

def pid():
    return nlctl.paper.example_1(controller=nlctl.PID())
"""


@pytest.mark.weekly
def test_a_researcher_puts_another_controller_into_the_paper(tmp_path):
    """Figure and page of a loop that lacks zeta, and what the proof lacks of it."""
    (tmp_path / "rival.py").write_text(RESEARCHER, encoding="utf-8")
    told("simulate", "rival.py:pid", "--until", "5", "--plot", "out.svg", cwd=tmp_path)
    assert (tmp_path / "out.svg").stat().st_size > 1e4
    told("report", "rival.py:pid", "--until", "5", "--out", "page", cwd=tmp_path)
    shown = text_of(tmp_path / "page/index.html")
    assert "the proof needs a closed loop, a diagram with the output r" in shown
    assert "nlctl report rival.py:pid --until 5" in shown


ENGINEER = '''
"""A motor that a PI law turns at the wanted speed; nothing of it is nlctl's."""
import control as ct
import nlctl

def motor(t, x, u, p):
    return [(u[0] - p["B"] * x[0]) / p["J"]]

def make():
    parameters = {"J": 0.5, "B": 0.1}
    plant = ct.nlsys(motor, None, inputs=["u"], outputs=["w"], states=["w"], name="motor",
                     params=parameters)
    error = ct.summing_junction(["w_ref", "-w"], "e", name="sum")
    law = ct.ss([0], [1], [1], [1], inputs="e", outputs="u", name="law")
    return nlctl.interconnect([plant, law, error], inputs=["w_ref"], outputs=["w", "u", "e"],
                              name="drive")
'''


@pytest.mark.weekly
def test_an_engineer_has_a_page_of_a_loop_of_python_controls(tmp_path):
    """J w' = u - B w with u = e + integral of e: s^2 + 2.2 s + 2, so that -1.1 is the real part."""
    (tmp_path / "drive.py").write_text(ENGINEER, encoding="utf-8")
    step = ("drive.py:make", "--input", "w_ref=1")
    told("simulate", *step, "--plot", "out.png", cwd=tmp_path)
    told("report", *step, "--set", "motor.B=0.1", "--junit", "j.xml", cwd=tmp_path)
    shown = text_of(tmp_path / "reports/drive/index.html")
    assert "an eigenvalue of its linearisation is −1.1 1/s" in shown
    assert ElementTree.parse(tmp_path / "j.xml").getroot().get("tests") == "0"
    wrong = nlctl("report", "drive.py:make", "--set", "motor.Bee=1", cwd=tmp_path)
    assert (wrong.returncode, "nearest: 'motor.B'" in wrong.stderr) == (2, True)
    other = nlctl("report", "reports/drive", "--until", "3", cwd=tmp_path)
    assert (other.returncode, "are of a loop" in other.stderr) == (2, True)


VETERAN = """
import control as ct
import numpy as np
import nlctl

t = np.linspace(0, 5, 501)
lag = lambda t, x, u, p: [(u[0] - x[0]) / p["tau"]]
fast, slow = (
    ct.nlsys(lag, None, inputs=["u"], outputs=["x"], states=["x"], params={"tau": 1.0}, name=name)
    for name in ("fast", "slow")
)
pair = nlctl.interconnect(
    [fast, slow], [["slow.u", "fast.x"]], ["fast.u"], ["slow.x"], {"fast.tau": 0.1, "slow.tau": 2.0}
)
run = nlctl.input_output_response(pair, T=t, U=1.0, X0=[0.0, 0.5])
exact = ct.tf([1], np.polymul([0.1, 1], [2, 1]))
forced = ct.forced_response(ct.ss(exact), t, 1.0).outputs
free = 0.5 * np.exp(-t / 2.0)
assert np.abs(run.outputs - forced - free).max() < 1e-6
assert np.array_equal(run.states["slow.x"], run.states["slow_x"])
assert nlctl.parameters(pair)["value"].to_dict() == {"fast.tau": 0.1, "slow.tau": 2.0}
many = nlctl.ensemble_response(pair, T=t, U=1.0, X0=[[0.0, 0.5], [0.0, 0.0]], keep=["y[0]"])
assert np.allclose(many.signals["y[0]"][0], np.ravel(run.outputs), atol=1e-7)
assert many.plot(members=[0]).axes.shape == (1, 1)
assert np.allclose(ct.describing_function(nlctl.block(nlctl.Saturation(limit=1), "s"), [0.5]), 1)
print("done")
"""


@pytest.mark.weekly
def test_a_veteran_finds_python_controls_habits(tmp_path):
    """Positional lists, short names, arrays of states, labels of states, describing functions."""
    script = tmp_path / "veteran.py"
    script.write_text(VETERAN, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-W", "error", str(script)], capture_output=True, text=True, env=QUIET,
        check=False, timeout=300,
    )  # fmt: skip
    assert done.stdout.split() == ["done"], done.stderr


def test_progress_is_on_stderr_where_it_is_redirected():
    """Lines after two seconds and then every ten, with what is done; none of what is quick."""
    code = (
        "import time\nfrom nlctl.analysis.cli import progress as lines\n"
        "lines.FIRST_LINE, lines.NEXT_LINE = 0.05, 0.1\n"
        "from nlctl.analysis.cli.progress import progress_bar\n"
        "with progress_bar('long', 4) as advance:\n"
        "    advance(1)\n    time.sleep(0.3)\n"
        "with progress_bar('short', 4) as advance:\n    advance(4)\n"
    )
    assert NLCTL[0] == sys.executable
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=100
    )
    first, *_, last = done.stderr.splitlines()
    assert re.fullmatch(r"long: 25 %, \d+ s", first)
    assert re.fullmatch(r"long: done, \d+ s", last)
    assert done.stdout == ""
