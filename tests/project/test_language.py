"""Text uses the field's terms: comments, docstrings, messages and pages of the documentation."""

import io
import re
import tokenize

import pytest
from places import ROOT

TERMS = {  # what is not said -> what is
    r"\bdelivers\b(?! : |=)|\bdelivered\b": "outputs, is an output of",
    r"\bwhole numbers?\b": "integer",
    r"\bforeign\b": "third-party",
    r"\bside by side\b": "batched, together",
    r"\bturn(s|ed)? round\b": "reverses",
    r"\bforetold\b": "predicted",
    r"\bheld against\b": "validated against",
    r"\bcontenders?\b": "controllers",
    r"\bgoes on (with|behind|from)\b": "resumes",
    r"\bring of signals\b": "algebraic loop",
    r"\b(blocks?|diagrams?) (is|are) joined\b|\bjoined by dots\b": "connected",
    r"(?<!there )(?<!There )\bis no (?!better|worse|more|longer|calm|news|sharper)\w": "is not a",
}
ALLOWED = (  # names that are kept, and the text of sources that are shipped compiled
    *("is no progress", "is no event", "is no method's", "is no discrete-time"),
)


def told(path):
    """The comments and strings of a module, with their lines; a page's own lines."""
    text = path.read_text(encoding="utf-8")
    if path.suffix != ".py":
        return list(enumerate(text.splitlines(), start=1))
    kinds = {tokenize.COMMENT, tokenize.STRING, getattr(tokenize, "FSTRING_MIDDLE", -1)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return [(token.start[0], token.string) for token in tokens if token.type in kinds]


def texts():
    """All that is read by others than the interpreter."""
    places = [
        p
        for package in ("nlctl", "analysis", "benchmarks", "campaign")
        for p in (ROOT / package).rglob("*.py")
    ]
    places += [*(ROOT / "analysis").rglob("*.html"), *(ROOT / "docs").rglob("*.md")]
    places += [ROOT / "README.md", ROOT / "ARCHITECTURE.md"]  # CONTRIBUTING.md lists bad words
    for path in sorted(places):
        name = path.relative_to(ROOT).as_posix()
        yield from ((f"{name}:{line}", text) for line, text in told(path))


@pytest.fixture(scope="module")
def everything():
    return list(texts())


@pytest.mark.parametrize(("term", "instead"), TERMS.items(), ids=TERMS.values())
def test_the_fields_terms_are_used(everything, term, instead):
    """Each of these words has one that the field uses."""
    found = [
        (place, text)
        for place, text in everything
        if re.search(term, re.sub(r"\{[^}]*\}", "", text))
        and not any(name in text for name in ALLOWED)
    ]
    assert [place for place, _ in found] == [], f"say {instead}: {found}"


def test_there_is_text_to_look_at(everything):
    """Comments, docstrings, messages and pages."""
    whole = "\n".join(text for _, text in everything)
    for part in (
        "# nobody else compiles",
        "Return the outputs",
        "needs an integer for",
        "## The paper",
    ):
        assert part in whole


def test_no_file_has_both_sides_of_a_merge():
    """`git` leaves marks where two changes meet, and pages are read by nobody but readers."""
    marks = tuple(mark * 7 + " " for mark in "<>")
    names = ("nlctl", "analysis", "tests", "docs", "benchmarks", "campaign")
    homes = [ROOT, *(ROOT / name for name in names)]
    kinds = (".md", ".py", ".toml", ".rst", ".js", ".css", ".jinja", ".html", ".csv")
    paths = [p for home in homes for p in (home.glob if home == ROOT else home.rglob)("*")]
    texts = [p for p in paths if p.suffix in kinds and p.is_file()]
    assert ROOT / "CHANGELOG.md" in texts
    split = [p for p in texts if any(s.startswith(marks) for s in p.read_text("utf-8").split("\n"))]
    assert split == []
