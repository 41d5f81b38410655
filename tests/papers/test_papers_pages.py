"""Pages of papers: every number, printed or required, and what a record must have."""

import math

import pytest
from command_line import nlctl_here
from places import ROOT

import nlctl
from nlctl.analysis.papers import named_paper, paper_names
from nlctl.analysis.reproductions.page import compose_paper, found_numbers, paper_page
from nlctl.analysis.reproductions.paper import FoundNumber, Statement, simulate_cases

SIBLINGS = [name for name in paper_names() if name != "lv_2017"]
REFUTED = {  # what is read somewhere and does not hold
    "tabuada_2007": {"least b, 2 |PBK|"},
    "karason_1994": {"the error comes to 0 at (s)"},
}


@pytest.fixture(scope="module")
def runs():
    """Runs of each paper, made when they are first asked for."""
    made = {}

    def of(name):
        if name not in made:
            made[name] = simulate_cases(named_paper(name).cases)
        return made[name]

    return of


@pytest.mark.slow
@pytest.mark.parametrize("name", SIBLINGS)
def test_every_number_is_reached_but_those_that_are_refuted(name, runs):
    """And what is refuted says whose statement it is, and stands under what does not reproduce."""
    paper = named_paper(name)
    found = found_numbers(paper.statements, runs(name))
    missed = {f.statement.quantity for f in found if not f.holds}
    assert missed == REFUTED.get(name, set())
    assert all(f.statement.by for f in found if not f.holds)
    assert len(found) >= 8


@pytest.mark.slow
@pytest.mark.parametrize("name", SIBLINGS)
def test_the_page_has_the_evidence_that_its_claims_name(name, runs):
    """Keys of sections; the question, the verdict and what is open are on it."""
    paper = named_paper(name)
    report = paper_page(paper, runs(name))
    keys = {section.key for section in report.sections}
    assert {claim.evidence for claim in report.claims} <= keys
    assert {"model", "open", "sources"} <= keys
    assert paper.not_reproduced in report.verdict
    assert report.command == f"nlctl report {name}"


@pytest.mark.parametrize("name", paper_names())
def test_a_record_names_what_it_has(name):
    """Statements are of its parts and of its sources, and a number is a number."""
    paper = named_paper(name)
    parts, sources = {p.key for p in paper.parts}, {s.key for s in paper.sources}
    statements = paper.statements
    assert paper.key == name
    assert {s.part for s in statements} <= parts
    assert {s.read for s in statements} - {""} <= sources
    assert all(math.isfinite(float(s.printed)) for s in statements)
    assert {s.relation for s in statements} <= {"=", "≤", "≥"}
    assert paper.citation in paper.references


@pytest.mark.parametrize("name", SIBLINGS)
def test_what_could_not_be_read_is_said(name):
    """No article was read: each page says so, and where its numbers were."""
    paper = named_paper(name)
    assert "could not be read" in " ".join(paper.open_points)
    assert {s.read for s in paper.statements} & {source.key for source in paper.sources}


def test_what_is_found_of_a_bound():
    """Within is no error; NaN holds nothing."""

    def error(relation, value):
        line = Statement(
            claim="", part="", case="", quantity="", printed="2", relation=relation,
            value=lambda runs: value,
        )  # fmt: skip
        found = FoundNumber(statement=line, value=value)
        return found.error, found.holds

    assert error("≤", 1.0) == error("≥", 3.0) == (0.0, True)
    assert error("≤", 2.5) == error("≥", 1.5) == error("=", 1.5) == (0.5, False)
    assert [error(relation, math.nan)[1] for relation in "=≤≥"] == [False, False, False]


def test_a_name_with_hyphens_is_the_same_paper_and_an_unknown_one_is_told():
    """The nearest one is named."""
    assert named_paper("tabuada-2007") is named_paper("tabuada_2007")
    with pytest.raises(nlctl.errors.UnknownNameError, match="nearest: 'tabuada_2007'"):
        named_paper("tabuada_2008")
    refused = nlctl_here("report", "karason_1995")
    assert refused.returncode == 2
    assert "unknown file, folder or paper 'karason_1995'; nearest: 'karason_1994'" in refused.stderr


def test_far_runs_are_of_papers_that_have_some(tmp_path):
    """A sentence, before anything is run."""
    with pytest.raises(
        nlctl.errors.UsageError, match="karason_1994 has no runs beyond its examples"
    ):
        compose_paper(named_paper("karason_1994"), tmp_path, whole=True)


def test_papers_are_listed_with_their_examples():
    """`nlctl list` and `nlctl list NAME`."""
    shown = nlctl_here("list").stdout
    assert all(name in shown for name in paper_names())
    assert "nlctl.papers.karason_1994.example_1()" in nlctl_here("list", "karason_1994").stdout


def test_the_page_of_papers_has_a_row_for_each():
    """With what is reproduced and what is not, as the record says."""
    text = (ROOT / "docs" / "explanation" / "papers.md").read_text(encoding="utf-8")
    for name in paper_names():
        paper = named_paper(name)
        (row,) = [line for line in text.splitlines() if line.startswith(f"| `{name}`")]
        assert paper.reproduced in row
        assert paper.not_reproduced in row


@pytest.mark.weekly
@pytest.mark.ci
def test_the_command_writes_a_page(tmp_path):
    """Exit code 0, although a statement of others is refuted."""
    done = nlctl_here("report", "karason_1994", cwd=tmp_path)
    assert "10 of 11 statements hold" in done.stdout
    assert (tmp_path / "reports" / "karason_1994" / "index.html").exists()
