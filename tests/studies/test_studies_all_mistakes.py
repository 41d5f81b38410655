"""Every mistake of a study is told, whatever others stand beside it, and nothing else is."""

import itertools

import pytest

from nlctl.analysis.studies.file.errors import StudyError
from nlctl.analysis.studies.reading.parse import read_study

STUDY = """
loop = "example-1"

[study]
title = "mistakes"
seed = 1

[space]
"plant.p1" = { uniform = [-0.3, -0.1] }
"plant.q_mean" = { uniform = [4.0, 6.0] }

[spec]
tracks = { formula = "always from 2 s on |e| <= 0.15" }
moderate = { formula = "always |u| <= 15" }

[time]
end = 4.0
step = 0.01

[metrics]
band = 0.15
start = 2.0

[runs]
size = 10

[[analysis]]
kind = "probability"
limit = 0.01

[[analysis]]
kind = "morris"
trajectories = 4
of = "tracks"

[[analysis]]
kind = "failure map"
x = "plant.p1"
y = "plant.p1"
"""
MISTAKES = {  # what stands there, what stands there instead, and what is told
    "a table's name": ("[spec]", "[spacs]", {("spacs",), ("spec",)}),
    "a formula": ("always from 2 s on |e| <= 0.15", "|e| <", {("spec", "tracks")}),
    "a signal": ("|u|", "|w|", {("spec", "moderate")}),
    "a law": ("[-0.3, -0.1]", "[-0.3]", {("space", "plant.p1", "uniform", 1)}),
    "a parameter": ("plant.q_mean", "plant.q_meen", {("space", "plant.q_meen")}),
    "the horizon": ("end = 4.0", "end = -4.0", {("time", "end")}),
    "a band": ("band = 0.15", "band = 'x'", {("metrics", "band")}),
    "a number of rows": ("size = 10", "size = 'ten'", {("runs", "size")}),
    "levels of no grid": ("[runs]", "[runs]\nlevels = 3", {("runs", "levels")}),
    "the table of rows": ("[runs]", "[ruins]", {("ruins",)}),
    "a limit": ("limit = 0.01", "limit = 7", {("analysis", 0, "limit")}),
    "a column": ('of = "tracks"', 'of = "tracts"', {("analysis", 1, "of")}),
    "a quantity": ('x = "plant.p1"', 'x = "plant.p2"', {("analysis", 2, "x")}),
    "a seed": ("seed = 1", "seed = 1.5", {("study", "seed")}),
}
NEEDS_ROWS = {("analysis", 0)}  # without any [runs]
UNJUDGED = {  # which mistakes cannot be seen beside which
    frozenset({"a table's name", "a formula"}),  # nobody says that these are formulas
    frozenset({"a table's name", "a signal"}),
    frozenset({"a table's name", "a column"}),  # columns have the names of requirements
    frozenset({"a number of rows", "the table of rows"}),
    frozenset({"levels of no grid", "the table of rows"}),
}
UNSEEN = {"a formula", "a signal", "a column", "a number of rows", "levels of no grid"}


def told(folder, names):
    """Return the places of what is told of a study with these mistakes."""
    text = STUDY
    for name in names:
        before, after, _ = MISTAKES[name]
        text = text.replace(before, after)
    path = folder / "study.toml"
    path.write_text(text)
    with pytest.raises(StudyError) as refused:
        read_study(path)
    return {problem.place for problem in refused.value.problems}


def expected(names):
    """Return the places of these mistakes."""
    unseen = {name for pair in UNJUDGED if pair <= set(names) for name in pair & UNSEEN}
    found = set().union(*(MISTAKES[name][2] for name in set(names) - unseen))
    whole = "the table of rows" in names and "a limit" not in names
    return found | (NEEDS_ROWS if whole else set())


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 2])
def test_each_mistake_is_told_beside_each_other(tmp_path, count):
    for names in itertools.combinations(MISTAKES, count):
        assert told(tmp_path, names) == expected(names), names


def test_all_mistakes_are_told_at_once(tmp_path):
    names = set(MISTAKES) - {"a table's name", "the table of rows"}
    assert told(tmp_path, sorted(names)) == expected(names)


def test_a_study_says_what_it_asks_and_what_it_varies(tmp_path):
    """Empty tables are mistakes beside others."""
    path = tmp_path / "study.toml"
    path.write_text(
        'loop = "example-1"\n[study]\ntitle = ""\nseed = 1\n[space]\n[spec]\n[time]\nend = 1.0\n'
        'step = 0.1\n[metrics]\ny = "z"\n'
    )
    with pytest.raises(StudyError) as refused:
        read_study(path)
    places = {problem.place for problem in refused.value.problems}
    assert {("space",), ("spec",), ("metrics", "y")} <= places
