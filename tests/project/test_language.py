"""Text uses the field's terms: comments, docstrings, messages and pages of the documentation."""

import ast
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
PLAIN = {  # the same, in the rooms of which each word was weighed
    r"\b(told|tells?)\b": "reported, printed, stated, shown",
    r"\bbeside\b": "next to",
    r"\bin the place of\b": "instead of, as",
    r"\bas (it|they) stands?\b": "unchanged, as written",
    r"\bdear(er|ly)?\b": "costly",
    r"\bgo(es)? on\b": "continues",
    r"\b(becomes?|became) of\b": "how it changes, how it ended",
    r"\blooked (at|between|through|into)\b": "reads, examines, tries",
    r"\bturned\b": "reversed, inverted",
    r"\bcarr(y|ies|ied) (it |them )?along\b": "driven, pushed",
    r"\bwhoever\b": "a function that, readers",
    r"\bon (its|their) way\b": "running, in transit",
    r"\banew\b": "again",
    r"\bh(old|olds|eld) (\w+ ){0,6}against\b": "compares with",
    r"\bAsked:": "settings",
}
ROOMS = (  # where these hold; and in what no room has, such as nlctl/blocks.py and README.md
    *(f"analysis/{name}" for name in ("cli", "figures", "intervals", "lyapunov", "metrics")),
    *(f"analysis/{name}" for name in ("pages", "paper", "papers", "recheck", "report")),
    *("analysis/reproductions", "analysis/robustness", "analysis/studies", "benchmarks"),
    *(f"nlctl/{name}" for name in ("actuators", "diagrams", "drawing", "export", "expressions")),
    *(f"nlctl/{name}" for name in ("controllers", "faults", "host", "observers", "papers")),
    *(f"nlctl/native/{name}" for name in ("codegen", "diagram", "enclosures", "equations")),
    *(f"nlctl/native/{name}" for name in ("machine", "opaque", "purity", "rounding", "stepping")),
    *("campaign", "docs", "nlctl/native/tubes", "nlctl/plotting", "nlctl/sensitivities"),
    *(f"nlctl/{name}" for name in ("delays", "sampling", "sliding", "native/taylor", "upstream")),
)
VAGUE = {"each", "found", "made", "own", "told", "wanted"}  # a variable names the thing
OFFERED = {  # keywords of functions that users call
    ("boundary", "made"),
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
    places += (ROOT / "analysis").rglob("*.html")
    pages = [p for p in (ROOT / "docs").rglob("*") if p.suffix in (".md", ".py", ".rst")]
    places += [p for p in pages if "auto" not in p.parts]  # what Sphinx makes of scripts
    names = ("README", "ARCHITECTURE", "AGENTS", "RELEASING", "SECURITY")
    places += [ROOT / f"{name}.md" for name in names]  # CONTRIBUTING.md lists bad words
    for path in sorted(places):
        name = path.relative_to(ROOT).as_posix()
        yield from ((f"{name}:{line}", text) for line, text in told(path))


@pytest.fixture(scope="module")
def everything():
    return list(texts())


@pytest.fixture(scope="module")
def without_values(everything):
    """All texts without what is formatted into them."""
    return [(place, re.sub(r"\{[^}]*\}", "", text), text) for place, text in everything]


@pytest.fixture(scope="module")
def without_code(everything):
    """The texts that were weighed, without code."""
    code = re.compile(r"\{[^}]*\}|``?[^`]*``?|>>>.*")
    return [(place, code.sub("", text), text) for place, text in everything if is_weighed(place)]


@pytest.mark.parametrize(("term", "instead"), TERMS.items(), ids=TERMS.values())
def test_the_fields_terms_are_used(without_values, term, instead):
    """Each of these words has one that the field uses."""
    found = [
        (place, text)
        for place, words, text in without_values
        if re.search(term, words) and not any(name in text for name in ALLOWED)
    ]
    assert [place for place, _ in found] == [], f"say {instead}: {found}"


@pytest.mark.parametrize(("term", "instead"), PLAIN.items(), ids=PLAIN.values())
def test_plain_words_are_used(without_code, term, instead):
    """Each of these words stops a native reader of the field."""
    found = [(place, text) for place, words, text in without_code if re.search(term, words)]
    assert [place for place, _ in found] == [], f"say {instead}: {found}"


def is_weighed(place):
    """Whether each word of a file was weighed: those of rooms, and those above all rooms."""
    return place.count("/") < 2 or place.startswith(tuple(f"{room}/" for room in ROOMS))


def vague_names(tree, function=None):
    """Yield the vague names that functions bind, each with its function and line."""
    for node in ast.iter_child_nodes(tree):
        inside = node if isinstance(node, ast.FunctionDef | ast.Lambda) else function
        bound = None
        if isinstance(node, ast.arg):
            bound = node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            bound = node.id
        if function is not None and bound in VAGUE:
            yield getattr(function, "name", "lambda"), bound, node.lineno
        yield from vague_names(node, inside)


def test_variables_name_the_thing():
    """One cannot search for `found`: nearly every function would have one."""
    packages = [ROOT / package for package in ("nlctl", "analysis", "benchmarks", "campaign")]
    paths = sorted(path for package in packages for path in package.rglob("*.py"))
    assert len(paths) > 300
    vague = [
        f"{name}:{line}: {bound}"
        for path in paths
        if is_weighed(name := path.relative_to(ROOT).as_posix())
        for function, bound, line in vague_names(ast.parse(path.read_text(encoding="utf-8")))
        if (function, bound) not in OFFERED
    ]
    assert vague == []


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
