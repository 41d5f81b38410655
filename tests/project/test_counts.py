"""A number agrees with its noun: text that counts does it with nlctl.wording."""

import ast
import itertools
import re

import pytest
from test_layers import MODULES

from nlctl.wording import counted, some_of


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (counted(0, "state"), "0 states"),
        (counted(1, "state"), "1 state"),
        (counted(2, "analysis", "analyses"), "2 analyses"),
        (counted(1, "analysis", "analyses"), "1 analysis"),
        (some_of(0, 3, "run", "violates", "violate"), "0 of 3 runs violate"),
        (some_of(1, 3, "run", "violates", "violate"), "1 of 3 runs violates"),
        (some_of(3, 3, "run", "violates", "violate"), "3 of 3 runs violate"),
        (some_of(1, 1, "claim", "fails", "fail"), "1 of 1 claim fails"),
        (some_of(0, 1, "claim", "fails", "fail"), "0 of 1 claim fails"),
    ],
)
def test_a_number_agrees_with_noun_and_verb(text, expected):
    assert text == expected


def nouns(calls):
    """The nouns that the modules count, in the plural."""
    for call in calls:
        words = [one.value for one in call.args if isinstance(one, ast.Constant)]
        match getattr(call.func, "id", ""), words:
            case "counted", [_, many]:
                yield many.split()[0]
            case ("counted", [one]) | ("some_of", [one, _, _]):
                yield f"{one.split()[-1]}s"


def counts(text, plural):
    """Yield line and value, where a text has a value before one of these words."""
    for value, rest in itertools.pairwise(text.values):
        is_of_value = isinstance(value, ast.FormattedValue)
        if is_of_value and isinstance(rest, ast.Constant) and plural.match(rest.value):
            yield text.lineno, ast.unparse(value.value)


SEVERAL = {  # never one: of a fixed size, or another text is written for one
    ("nlctl.analysis.paper.page.report", "total"),
    ("nlctl.analysis.paper.page.closing", "rows['samples'].iloc[0]"),
    ("nlctl.analysis.report.outline", "total"),
    ("nlctl.analysis.robustness.uncertainty.design", "rows"),
    ("nlctl.analysis.robustness.uncertainty.design", "columns"),
    ("nlctl.analysis.robustness.uncertainty.design", "MOST_HELD // columns"),
    ("nlctl.analysis.pages.study.rows", "len(worst)"),
    ("nlctl.analysis.studies.replay", "count"),
    ("nlctl.analysis.studies.result", "count"),
    ("nlctl.native.integrate.methods.tableau", "stages - 1"),
    ("nlctl.native.integrate.methods.tableau", "stages"),
}
NO_COUNT = re.compile(r"^_?[A-Z_]+$|shape|\.ratio$")  # a constant, "3 x 2 values", "2.5 times"


def test_what_is_counted_is_counted_in_one_way():
    """No text writes a number before a plural that others count."""
    nodes = [
        (name, node)
        for name, tree in MODULES.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call | ast.JoinedStr)
    ]
    counted_nouns = nouns(node for _, node in nodes if isinstance(node, ast.Call))
    plural = re.compile(rf" (?:{'|'.join(sorted(set(counted_nouns)))})\b")
    found = {
        (name, value): line
        for name, text in nodes
        if isinstance(text, ast.JoinedStr)
        for line, value in counts(text, plural)
        if not NO_COUNT.search(value)
    }
    assert {place: line for place, line in found.items() if place not in SEVERAL} == {}
    assert found.keys() == SEVERAL, "named here and not there any more"
