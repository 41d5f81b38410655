"""`nlctl list`: signals and arguments as they are, whatever the case of a name."""

import importlib
import inspect
import io

import pytest
from command_line import nlctl_here
from rows import each_row

import nlctl
from nlctl.analysis.catalogue import block_records, function_summaries, making_function

FUNCTIONS = [name for lines in function_summaries().values() for name in lines]


@each_row("name", ["DeadZone", "PID", "SumOfSines", "Backlash"])
def test_signals_of_a_block_are_those_of_its_record(name):
    """Inputs, outputs and states as the block with its own parameters has them."""
    block = nlctl.block(block_records()[name](), "block")
    signals = nlctl_here("list", name).stdout.splitlines()[1].strip()
    told = f"({', '.join(block.input_labels)}) -> ({', '.join(block.output_labels)})"
    assert signals.partition("; states ")[0] == told
    assert signals.partition("; states ")[2] == ", ".join(block.state_labels)


@each_row("name", FUNCTIONS)
def test_functions_are_found_with_all_of_their_arguments(name):
    """Those that make blocks or parts of them, by the lines of their sources."""
    made = making_function(name)
    shown = nlctl_here("list", name).stdout
    assert shown.startswith(f"{name}()")
    assert inspect.getdoc(made).splitlines()[0][:60] in shown
    for argument in inspect.signature(made).parameters:
        assert argument in shown


def test_a_controller_that_a_function_connects_has_signals():
    """`adaptive_neural` and `mrac`, as they are made."""
    for name in ("adaptive_neural", "mrac"):
        made = getattr(nlctl, name)()
        told = f"({', '.join(made.input_labels)}) -> ({', '.join(made.output_labels)})"
        assert told in nlctl_here("list", name).stdout


def test_functions_are_those_of_the_rooms():
    """Every public function of the rooms of blocks, sampling and faults."""
    for room, lines in function_summaries().items():
        module = importlib.import_module(f"nlctl.{room}")
        public = [n for n in module.__all__ if inspect.isfunction(getattr(module, n))]
        assert list(lines) == public
    assert {"mrac", "adaptive_neural", "sampled"} <= set(FUNCTIONS)


@each_row(("typed", "found"), [("pid", "PID"), ("deadzone", "DeadZone"), ("MRAC", "mrac()")])
def test_the_case_of_a_name_does_not_matter(typed, found):
    """Nor do brackets behind a function."""
    assert nlctl_here("list", typed).stdout.split()[0] == found
    assert nlctl_here("list", "mrac()").stdout == nlctl_here("list", "mrac").stdout


def test_what_is_not_there_has_the_nearest_name():
    """Of blocks and of functions."""
    done = nlctl_here("list", "mra")
    assert (done.returncode, "nearest: 'mrac'" in done.stderr) == (2, True)


def test_lines_are_not_cut_where_they_are_read_by_something_else():
    """Every line ends as the docstring does."""
    shown = nlctl_here("list").stdout
    assert "…" not in shown
    for name, record in block_records().items():
        assert f"{name} " in shown
        assert (record.__doc__ or "").splitlines()[0] in shown


def test_brackets_of_a_description_are_shown():
    """`[space]` of a kind of analysis is no markup."""
    assert "A quantity of [space]." in nlctl_here("list", "failure map").stdout


def test_a_new_folder_needs_a_name(tmp_path):
    """Names that cannot be a file's, and folders that hold something, are refused."""
    for name in ("my loop", "x/ä", "a.b"):
        done = nlctl_here("new", "--", name, cwd=tmp_path)
        assert (done.returncode, "needs a name" in done.stderr) == (2, True)
    (tmp_path / "full").mkdir()
    (tmp_path / "full/file").write_text("mine")
    done = nlctl_here("new", "full", cwd=tmp_path)
    assert (done.returncode, "exists already" in done.stderr) == (2, True)
    assert [path.name for path in (tmp_path / "full").iterdir()] == ["file"]


def test_an_option_of_a_loop_is_refused_for_a_study(tmp_path):
    """And a file of claims that cannot be written, before anything runs."""
    done = nlctl_here("report", "study.toml", "--until", "3", cwd=tmp_path)
    assert (done.returncode, "are of a loop" in done.stderr) == (2, True)
    done = nlctl_here("report", "loop.py:make", "--junit", "none/claims.xml", cwd=tmp_path)
    assert (done.returncode, "no folder 'none'" in done.stderr) == (2, True)


def test_a_terminal_has_a_bar_and_a_file_has_lines(monkeypatch):
    """What is quick leaves nothing in a file."""
    from nlctl.analysis.cli.progress import progress_bar

    written = io.StringIO()
    monkeypatch.setattr("sys.stderr", written)
    with progress_bar("quick", 2.0) as advance:
        advance(2.0)
    assert written.getvalue() == ""


@pytest.mark.slow
def test_checks_of_a_loop_name_what_is_not_so(tmp_path):
    """An unstable equilibrium, a loop that still moves, and a function that hides its switches."""
    (tmp_path / "loops.py").write_text(
        "import control as ct\nimport nlctl\n\n"
        "def upright():\n"
        "    return ct.nlsys(lambda t, x, u, p: [x[1], x[0] - x[0] ** 3], None,\n"
        "                    inputs=0, outputs=['x', 'w'], states=['x', 'w'], name='upright')\n\n"
        "def moving():\n"
        "    return nlctl.paper.example_1(controller=nlctl.PID())\n",
        encoding="utf-8",
    )
    done = nlctl_here("report", "loops.py:upright", "--until", "2", cwd=tmp_path)
    assert (done.returncode, "the state at the end is a stable" in done.stdout) == (0, True)
    done = nlctl_here("report", "loops.py:moving", "--until", "2", cwd=tmp_path)
    page = (tmp_path / "reports/loops-moving/index.html").read_text(encoding="utf-8")
    assert (done.returncode, "still moves at the end" in page) == (0, True)
