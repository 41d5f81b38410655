"""Ids of requirements: from the study file to the claim, the page, JUnit and the gallery."""

import json
from xml.etree import ElementTree

import pytest
from rows import each_row

from nlctl.analysis.pages.study.claims import claims
from nlctl.analysis.pages.study.report import study_report
from nlctl.analysis.report import junit, render_html, write_report
from nlctl.analysis.studies import StudyError, read_study, run

STUDY = """
loop = "nlctl:block"
options = { spec = { block = "Lag" }, name = "lag" }
study = { title = "A lag", seed = 1 }
space."lag.T" = { bounds = [0.05, 0.4] }
inputs.u = 1.0
time = { end = 1.2, step = 0.1 }
runs.size = 20

[spec]
rises = { formula = "always from 1 s on v >= 0.5", id = "REQ-12" }
bounded = { formula = "always v <= 1.1", id = "REQ-13" }
calm = { formula = "always v >= -1", id = "REQ-14" }
plain = "always v <= 2"

[[analysis]]
kind = "probability"
limit = 0.5
id = ["REQ-12", "REQ-13"]

[[analysis]]
kind = "worst case"
limit = 0.0
runs = 20
id = "REQ-12"

[[analysis]]
kind = "worst case"
key = "of-nothing"
limit = 0.9
runs = 20
"""


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """The study, run."""
    folder = tmp_path_factory.mktemp("ids")
    path = folder / "lag.toml"
    path.write_text(STUDY, encoding="utf-8")
    return run(read_study(path), folder / "run")


def table(content):
    """The traceability table of a report.json."""
    (item,) = content["sections"]["study_traceability"]["items"]
    return item


def test_ids_reach_claims_page_json_and_junit(result, tmp_path):
    """One id is answered by two claims, one claim answers two; what has none says so."""
    made = study_report(result)
    assert [tuple(c.ids) for c in made.claims] == [("REQ-12", "REQ-13"), ("REQ-12",), ()]
    page = write_report(made, tmp_path / "page")
    content = json.loads(page.with_name("report.json").read_text(encoding="utf-8"))
    assert [c.get("ids", []) for c in content["claims"]] == [["REQ-12", "REQ-13"], ["REQ-12"], []]
    rows = table(content)["rows"]
    assert [(r[0], r[1], r[4], r[5]) for r in rows] == [
        ("REQ-12", "rises", result["probability"].answer, "probability"),
        ("REQ-12", "rises", result["worst-case"].answer, "worst-case"),
        ("REQ-13", "bounded", result["probability"].answer, "probability"),
        ("REQ-14", "calm", "no claim", ""),
        ("", "plain", "no claim", ""),
        ("", "", result["of-nothing"].answer, "of-nothing"),
    ]
    html = page.read_text(encoding="utf-8")
    assert html.count('<a href="#worst-case" aria-label="show worst-case">show</a>') == 1
    suite = ElementTree.fromstring(junit("A lag", made.claims))
    named = [
        (case.get("name", "").partition(":")[0], [p.get("value") for p in case.iter("property")])
        for case in suite.iter("testcase")
    ]
    assert named[:2] == [("REQ-12, REQ-13", ["REQ-12", "REQ-13"]), ("REQ-12", ["REQ-12"])]
    assert named[2][1] == []


def test_without_ids_nothing_speaks_of_them(tmp_path):
    """Neither page nor report.json has a column or a key for them."""
    lines = [line for line in STUDY.splitlines() if not line.startswith("id = ")]
    text = "\n".join(lines)
    for name in ("12", "13", "14"):
        text = text.replace(f', id = "REQ-{name}"', "")
    path = tmp_path / "lag.toml"
    path.write_text(text, encoding="utf-8")
    plain = run(read_study(path), tmp_path / "run")
    assert all(claim.ids == () for claim in claims(plain))
    made = study_report(plain)
    assert "study_traceability" not in {section.key for section in made.sections}
    assert '<th scope="col">id</th>' not in render_html(made)


@each_row(
    ("old", "new", "place", "message"),
    [
        ('id = "REQ-13"', 'id = "REQ-12"', "spec.bounded.id", "'REQ-12' is that of 'rises'"),
        ('id = "REQ-12"\n', 'id = "REQ-21"\n', "analysis[1].id", "unknown requirement id 'REQ-21'"),
        ('"REQ-12", "REQ-13"', '"REQ-12", "REQ-12"', "analysis[0].id", "got 'REQ-12' again"),
        ('"REQ-12", "REQ-13"', '"REQ-12", ""', "analysis[0].id", "got an empty one"),
        ("limit = 0.5\n", "", "analysis[0].id", "'probability' claims nothing that could answer"),
        ('id = "REQ-14"', 'id = "REQ 14"', "spec.calm.id", "should match pattern"),
    ],
)
def test_wrong_ids_are_refused_in_words(old, new, place, message, tmp_path):
    """Each where it stands, with what would be right."""
    path = tmp_path / "lag.toml"
    path.write_text(STUDY.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(StudyError) as refused:
        read_study(path)
    found = {p.plain()["text"]: p.message for p in refused.value.problems}
    assert message in found.get(place, f"not at {place}: {found}")
