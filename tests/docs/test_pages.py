"""Code of the pages in Markdown runs, and their figures are those that the tests check."""

import ast
import linecache
import re

import numpy as np
import pytest
from places import ROOT
from rows import each_row

import nlctl
from nlctl.analysis.lyapunov.nussbaum.long_run import long_run
from nlctl.analysis.paper import expectations
from nlctl.analysis.paper.evidence import AGREE, read_record

EXPLANATION = ROOT / "docs" / "explanation"
PAGES = sorted(path.name for path in EXPLANATION.glob("*.md"))


def text(page):
    return (EXPLANATION / page).read_text(encoding="utf-8")


def blocks(page):
    return re.findall(r"```python\n(.*?)```", text(page), flags=re.DOTALL)


def ran(page, *, without=()):
    """Run a page's code, leaving out some assignments; return what it has made."""
    names = {}
    for place, code in enumerate(blocks(page), 1):
        file, tree = f"<{page}, block {place}>", ast.parse(code)
        linecache.cache[file] = (len(code), None, code.splitlines(True), file)  # functions are read
        made = [ast.unparse(s.targets[0]) if isinstance(s, ast.Assign) else None for s in tree.body]
        tree.body = [s for s, name in zip(tree.body, made, strict=True) if name not in without]
        exec(compile(tree, file, "exec"), names)
    return names


@pytest.mark.ci
@each_row("page", PAGES)
def test_code_of_the_explanations_runs(page):
    """Each block asserts what the text says; but for the run of 10,000 s, which is weekly."""
    assert all("assert" in code for code in blocks(page))
    ran(page, without=["late"])


def test_the_burst_that_is_told_is_that_of_the_kept_run():
    """And the loop is calm until then, as the page says."""
    page = text("certificates.md")
    record = read_record(long_run(nlctl.paper.example_2(), 20.0))
    assert f"bursts: at {record.burst:.0f} s" in page
    assert record.calm < 0.06
    assert "|e| < 0.06" in page


@pytest.mark.weekly
def test_the_run_of_10000_seconds_bursts():
    """As the block of code says, and where the text says."""
    late = ran("certificates.md")["late"]
    zeta, e = (late.outputs[late.output_labels.index(name)] for name in ("zeta", "e"))
    assert not late.success
    assert zeta[-1] > 2.99
    record = read_record(long_run(nlctl.paper.example_2(), 20.0))
    assert abs(late.time[-1] - record.burst) < AGREE
    assert np.abs(e[(late.time > 100) & (late.time < 9e3)]).max() < 0.06


def test_the_table_of_figures_is_the_table_that_is_checked():
    """Each rounded figure of the page is an expected figure."""
    wanted = {(e.case, e.metric): e.value for e in expectations()}
    for example, other in (("1", "1-backlash"), ("2", "2-dead-zone")):
        pattern = rf"\| Example {example}, .*?\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) "
        row = re.search(pattern, text("paper.md"))
        assert row is not None
        keys = [(example, "tail_max_e"), (example, "max_u"), (other, "tail_max_e")]
        for figure, key in zip(row.groups(), keys, strict=True):
            assert float(figure) == round(wanted[key], len(figure.partition(".")[2]))
    assert f"compares {len(wanted)}" in " ".join(text("paper.md").split())
