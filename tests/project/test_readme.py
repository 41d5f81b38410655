"""The README's code runs, its figures are the tests' figures, and its example fits a screen."""

import ast
import re
import subprocess
import sys

import numpy as np
import pytest
from places import ROOT

import nlctl
from analysis.lyapunov.nussbaum.long_run import long_run
from analysis.paper import expectations
from analysis.paper.reference_run import AGREE, read_record
from nlctl.native import Status

README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_loop_of_ones_own_runs_in_at_most_30_lines(tmp_path):
    """The first block of Python prints the tracking error that its comment says."""
    code = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)[0]
    assert len(code.splitlines()) <= 30
    script = tmp_path / "loop.py"
    script.write_text(code, encoding="utf-8")
    result = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=True, timeout=300
    )
    said = re.search(r"# ([\d.]+) after 10 s", code)
    assert said is not None
    digits = len(said[1].partition(".")[2])
    assert abs(float(result.stdout) - float(said[1])) <= 0.51 * 10**-digits


def ran(*, without=()):
    """Run the other blocks of Python, leaving out some assignments; return what they have made."""
    later = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)[1:]
    assert len(later) == 4
    names = {"nlctl": nlctl, "np": np}
    for code in later:
        tree = ast.parse(code)
        made = [s.targets[0].id if isinstance(s, ast.Assign) else None for s in tree.body]
        tree.body = [s for s, name in zip(tree.body, made, strict=True) if name not in without]
        exec(compile(tree, "README.md", "exec"), names)
    return names


def test_the_other_blocks_of_code_run():
    """They do what is said of them: machine code, an ensemble, the paper's examples.

    But for the run of 10,000 s; the kept record of it has the burst that is told.
    """
    names = ran(without=["late"])
    assert "late" not in names
    assert names["response"].statistics.status is Status.OK
    assert len(names["many"].table) == 1000
    assert (names["many"].table["status"] == "OK").all()
    assert names["loop"].output_labels[:2] == ["y", "yd"]
    assert round(names["certificate"].C_0, 3) == 0.477
    rows = names["rows"]
    found = names["rb"].violation_probability(rows.design, rows.table["spec"])
    assert found.violations == 0
    assert round(found.upper, 3) == 0.009
    assert names["prediction"].burst == pytest.approx(9.4e3, rel=0.02)
    record = read_record(long_run(nlctl.paper.example_2(), 20.0))
    assert f"bursts: at {record.burst:.0f} s" in README
    assert record.calm < 0.06


@pytest.mark.weekly
def test_the_run_of_10000_seconds_bursts():
    """As the block of code says, and where the text says."""
    late = ran()["late"]
    zeta, e = (late.outputs[late.output_labels.index(name)] for name in ("zeta", "e"))
    assert not late.success
    assert zeta[-1] > 2.99
    record = read_record(long_run(nlctl.paper.example_2(), 20.0))
    assert abs(late.time[-1] - record.burst) < AGREE
    assert np.abs(e[(late.time > 100) & (late.time < 9e3)]).max() < 0.06


def test_the_table_of_figures_is_the_table_that_is_checked():
    """Each rounded figure of the README is an expected figure."""
    wanted = {(e.case, e.metric): e.value for e in expectations()}
    for example, other in (("1", "1-backlash"), ("2", "2-dead-zone")):
        row = re.search(rf"\| Example {example}, .*?\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) ", README)
        assert row is not None
        keys = [(example, "tail_max_e"), (example, "max_u"), (other, "tail_max_e")]
        for text, key in zip(row.groups(), keys, strict=True):
            assert float(text) == round(wanted[key], len(text.partition(".")[2]))
    assert f"compares {len(wanted)} numbers" in README


def test_commands_and_names_in_the_readme_exist():
    """Every `nlctl.<name>` is public."""
    for name in re.findall(r"nlctl\.([A-Za-z_]+)", re.sub(r"nlctl\.toml|`pip.*", "", README)):
        assert hasattr(nlctl, name), name
