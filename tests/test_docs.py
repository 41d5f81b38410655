"""What the guide to study files shows is valid, and it leaves nothing out."""

import re
import tomllib
import typing
from pathlib import Path

import pytest
from rows import each_row

from analysis.robustness.stl.text import parse_formula
from analysis.robustness.uncertainty.quantity import QUANTILES
from analysis.studies import read_study
from analysis.studies.file.resolve import uncertain
from analysis.studies.file.schema import Law
from analysis.studies.kinds.analyses import Analysis

GUIDE = (Path(__file__).parents[1] / "docs" / "studies.md").read_text(encoding="utf-8")


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


def test_the_guide_has_every_kind_of_analysis_once():
    """Its table lists the kinds that a file may ask for, no more and no fewer."""
    kinds = [
        typing.get_args(kind.model_fields["kind"].annotation)[0]
        for kind in typing.get_args(typing.get_args(Analysis)[0])
    ]
    table = GUIDE.partition("## Kinds of analysis")[2].partition("## ")[0]
    told = re.findall(r"^\| `([a-z ]+)` \| [^|]*\w", table, flags=re.MULTILINE)
    assert sorted(told) == sorted({"kind", *kinds})  # the heading, and each of them
