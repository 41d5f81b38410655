"""What the guide to study files shows is valid, and it leaves nothing out."""

import re
import tomllib
from typing import get_args

import pytest
from places import ROOT
from rows import each_row

from nlctl.analysis.lyapunov.lines import LineStatus
from nlctl.analysis.report.outline import ANSWERS
from nlctl.analysis.robustness.stl.text import parse_formula
from nlctl.analysis.robustness.uncertainty.space import QUANTILES
from nlctl.analysis.studies import StudyError, read_study
from nlctl.analysis.studies.file.schema import Law
from nlctl.analysis.studies.kinds import KINDS
from nlctl.analysis.studies.resolve import uncertain

GUIDE = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", GUIDE, flags=re.DOTALL)


def test_the_whole_study_of_the_guide_is_valid(tmp_path):
    """Its file beside its loop: no mistakes, and two analyses are planned."""
    (tmp_path / "arm.py").write_text(blocks("python")[0], encoding="utf-8")
    (tmp_path / "arm.toml").write_text(blocks("toml")[0], encoding="utf-8")
    file = read_study(tmp_path / "arm.toml")
    assert [asked.kind for asked in file.study.analysis] == ["probability", "worst case"]
    assert file.experiment.space.names == ["law.beta", "plant.x1(0)", "actuator"]


@each_row("text", blocks("text")[0].splitlines())
def test_every_requirement_of_the_guide_reads_back(text):
    """Written out again and read again it is the same formula."""
    formula = parse_formula(text)
    assert parse_formula(str(formula)) == formula


@each_row("text", re.findall(r"^\| `(\{.*\})` \|", GUIDE, flags=re.MULTILINE))
def test_every_law_of_the_guide_is_one(text):
    """Its box is where the law lives, or what lies between the two quantiles of `QUANTILES`."""
    quantity = uncertain("k", Law(**tomllib.loads(f"k = {text}")["k"]))
    low, high = quantity.box
    assert low < high
    assert quantity.law.cdf([low, high]) == pytest.approx(QUANTILES, abs=0.0011)


def test_the_guide_cuts_laws_off_where_the_boxes_end():
    """Its two quantiles are those of the code."""
    assert f"quantiles {QUANTILES[0]:g} and {QUANTILES[1]:g}" in GUIDE


def test_the_kind_of_the_guide_is_one(tmp_path):
    """Beside the study of the guide its claim is read, and a mistake in its table is told."""
    (own,) = (text for text in blocks("python") if "Kind(" in text)
    (asked,) = (text for text in blocks("toml") if "spread.py" in text)
    (tmp_path / "arm.py").write_text(blocks("python")[0], encoding="utf-8")
    (tmp_path / "spread.py").write_text(own, encoding="utf-8")
    path = tmp_path / "arm.toml"
    path.write_text(blocks("toml")[0] + asked, encoding="utf-8")
    assert read_study(path).study.analysis[-1].claim == "the spread is at most 0.5"
    path.write_text(blocks("toml")[0] + asked.replace("limit", "limits"), encoding="utf-8")
    with pytest.raises(StudyError, match="nearest: 'limit'"):
        read_study(path)


def test_the_table_of_kinds_is_that_of_the_list():
    """One line for each kind, in the order of the list, with what it answers and claims."""
    table = GUIDE.partition("## Kinds of analysis")[2].partition("## ")[0]
    lines = [line for line in table.splitlines() if line.startswith("| `")]
    told = [f"| `{k.name}` | {k.answers} | {k.claims}{' ' * bool(k.claims)}|" for k in KINDS]
    assert lines[1:] == told  # below the heading


@each_row("word", [*get_args(LineStatus), *ANSWERS])
def test_the_glossary_explains_every_status(word):
    """What a ledger or a claim may say."""
    glossary = (ROOT / "docs" / "glossary.md").read_text(encoding="utf-8")
    assert re.search(rf"^\| {word} \| \S", glossary, flags=re.MULTILINE)


@pytest.mark.slow
def test_the_guide_to_sampling_runs():
    """Its loop is as good as the continuous one."""
    code = re.findall(
        r"```python\n(.*?)```", (ROOT / "docs" / "sampling.md").read_text(), re.DOTALL
    )
    names = {}
    exec(code[0], names)
    loop, response = names["loop"], names["response"]
    e = response.outputs[loop.output_index["e"], 1000:]
    assert abs(e).max() < 0.13
