"""Claims as JUnit XML: what continuous integration counts is what the page says."""

from xml.etree import ElementTree

from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

from nlctl.analysis.report import Claim, Report, junit, render_html
from nlctl.analysis.report.outline import claim_status


def claim(text="|e| <= 0.1", **more):
    return Claim(
        **({"text": text, "measured": "0.2", "limit": "0.1", "holds": True, "evidence": ""} | more)
    )


KINDS = {
    "holds": (claim(), None),
    "proved": (claim(status="proved"), None),
    "fails": (claim(holds=False), "failure"),
    "refuted": (claim(holds=False, status="refuted"), "failure"),
    "open": (claim(holds=False, status="not shown yet"), "error"),
    "undecided": (claim(holds=False, status="undecided"), "error"),
    "of a paper": (claim(holds=False, by="the paper"), "skipped"),
}


@given(st.lists(st.sampled_from(sorted(KINDS)), max_size=8))
@settings(max_examples=many(30, part=4), deadline=None)
def test_every_claim_is_a_test_case_with_its_outcome(names):
    """Counts of the suite are those of its cases, and the page has the same statuses."""
    claims = [KINDS[name][0] for name in names]
    suite = ElementTree.fromstring(junit("Arm", claims))
    outcomes = [
        next((each.tag for each in case if each.tag != "system-out"), None)
        for case in suite.iter("testcase")
    ]
    assert outcomes == [KINDS[name][1] for name in names]
    counts = {"failures": "failure", "errors": "error", "skipped": "skipped"}
    assert suite.get("tests") == str(len(claims))
    for count, what in counts.items():
        assert suite.get(count) == str(outcomes.count(what))
    for case, each in zip(suite.iter("testcase"), claims, strict=True):
        (said,) = case
        assert (said.get("message") or said.text or "").startswith(claim_status(each)[0])


@given(st.text(max_size=30), st.text(max_size=30))
@settings(max_examples=many(50), deadline=None)
def test_any_text_is_text(title, text):
    """Markup and control characters too: it reads back, but for what XML cannot hold."""
    suite = ElementTree.fromstring(junit(title, [claim(text, measured=text, holds=False)]))
    (case,) = suite
    (failure,) = case
    allowed = {character: character.isprintable() and ord(character) < 0xD800 for character in text}
    shown = case.get("name") or ""
    assert len(shown) == len(text)
    assert all(a == b for a, b in zip(text, shown, strict=True) if allowed[a])
    assert (failure.get("message") or "").startswith("fails: measured ")


def test_it_says_no_more_than_the_page():
    """A suite without claims is empty, as the page says that none are made."""
    suite = ElementTree.fromstring(junit("Arm", []))
    assert (suite.get("tests"), list(suite)) == ("0", [])
    page = render_html(Report(title="Arm", verdict="", claims=[], sections=[], command=""))
    assert "No claims are made" in page
