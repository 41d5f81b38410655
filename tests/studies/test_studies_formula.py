"""Requirements as text: what is printed can be read, and nothing else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

from nlctl.analysis.robustness.stl.formula import (
    And,
    SampledSignals,
    always,
    eventually,
    horizon,
    in_band,
    margin_trace,
)
from nlctl.analysis.robustness.stl.text import parse_formula
from nlctl.errors import ParameterError

numbers = st.integers(-400, 400).map(lambda n: n / 8)
names = st.sampled_from(["e", "u", "x1", "plant.x2", "y[0]", "W_norm", "s_1", "inner"])


@st.composite
def bands(draw):
    signal, one, other = draw(names), draw(numbers), draw(numbers)
    low, high = sorted((one, other))
    kind = draw(st.sampled_from(["both", "low", "high", "size"]))
    if kind == "size":
        return in_band(signal, lower=-abs(one), upper=abs(one))
    return in_band(
        signal,
        lower=-np.inf if kind == "high" else low,
        upper=np.inf if kind == "low" else high,
    )


def larger(parts):
    windows = st.tuples(st.integers(0, 8), st.integers(0, 8) | st.just(np.inf))
    times = windows.map(lambda w: (w[0] / 4, w[0] / 4 + w[1] / 4))
    several = st.lists(parts, min_size=2, max_size=3)
    return st.one_of(
        parts.map(lambda part: ~part),
        st.tuples(parts, times).map(lambda a: always(a[0], *a[1])),
        st.tuples(parts, times).map(lambda a: eventually(a[0], *a[1])),
        several.map(lambda ps: And(parts=tuple(ps))),
        several.map(lambda ps: ~And(parts=tuple(~p for p in ps))),
    )


formulas = st.recursive(bands(), larger, max_leaves=8)


@given(formulas)
def test_what_a_formula_prints_is_read_back_as_the_same_text(formula):
    """str is the grammar: reports show what a study file may hold."""
    text = str(formula)
    assert str(parse_formula(text)) == text


@given(formulas, st.integers(0, 2**32 - 1))
def test_what_is_read_back_has_the_same_margin(formula, seed):
    """The two agree on random signals, not only in print."""
    rng = np.random.default_rng(seed)
    again = parse_formula(str(formula))
    until = horizon(formula) + 1.0
    t = np.linspace(0, until, 9)
    known = ["e", "u", "x1", "plant.x2", "y[0]", "W_norm", "s_1", "inner"]
    signals = SampledSignals(t, {name: rng.normal(size=t.size) * 20 for name in known}, until)
    values = [margin_trace(f, signals, 0.0, 0.0).y[0] for f in (formula, again)]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-12, atol=1e-12)


def test_and_binds_tighter_than_or_and_prefixes_tighter_than_both():
    """As in every logic; what "always" reaches over is in brackets."""
    assert str(parse_formula("a <= 1 or b <= 2 and c <= 3")) == "(a <= 1 or (b <= 2 and c <= 3))"
    text = "((always a <= 1) and b <= 2)"
    assert str(parse_formula("(always a <= 1) and b <= 2")) == text
    assert str(parse_formula("always a <= 1 and always b <= 2")) == (
        "(always a <= 1 and always b <= 2)"
    )
    assert str(parse_formula("not a <= 1 and b <= 2")) == "(not a <= 1 and b <= 2)"


@given(st.floats(-100, 100), st.floats(0.001, 100))
def test_a_band_around_a_number(middle, half):
    """|y - 1| <= 0.5 is 0.5 <= y <= 1.5, with the sign next to either."""
    sign = "-" if middle >= 0 else "+"
    for text in (f"|y {sign} {abs(middle)!r}| <= {half!r}", f"|y {sign}{abs(middle)!r}| <= {half}"):
        band = parse_formula(text)
        assert (band.lower, band.upper) == (middle - half, middle + half)


@each_row(
    ("text", "message"),
    [
        ("", "needs a band such as |e| <= 0.15, found the end"),
        ("|e| < 0.15", "needs '<=', found '<' at character 5"),
        ("|y - r| <= 1", "needs a number behind '-' (a difference of two signals is an output of"),
        ("|y -| <= 1", "needs a number, found '|' at character 5"),
        ("y - 1 <= 2", "needs '<=' or '>=', found '-' at character 3"),
        ("e <= 1 u <= 2", "needs 'and', 'or' or the end, found 'u' at character 8"),
        ("always in [3, 1] s e <= 1", "'always' needs 0 <= start <= end"),
        ("always in [1, 2] e <= 1", "needs 's', found 'e' at character 18"),
        ("|e| <= -1", "a band of 'e' needs lower <= upper"),
        ("(e <= 1", "needs ')', found the end"),
        ("and <= 1", "needs a band such as |e| <= 0.15, found 'and' at character 1"),
        ("|always| <= 1", "needs the name of a signal, found 'always'"),
        ("allways |e| <= 1", "needs '<=' or '>=' (is 'allways' meant to be 'always'?), found '|'"),
        ("__import__('os') <= 1", "needs '<=' or '>=', found '('"),
        ("e <= nan", "needs a number, found 'nan'"),
        ("(" * 10_000 + "e <= 1", "at most 50 levels"),
        ("not " * 10_000 + "e <= 1", "at most 50 levels"),
    ],
)
def test_other_text_is_refused_with_its_place(text, message):
    """One sentence: what was expected, what stands there and where."""
    with pytest.raises(ParameterError) as caught:
        parse_formula(text)
    assert message in str(caught.value)


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused(text):
    """Nothing else comes out of it, and nothing is executed."""
    try:
        formula = parse_formula(text)
    except ParameterError:
        return
    assert str(parse_formula(str(formula))) == str(formula)


WINDOWS = ["always", "eventually", "always from 1 s on", "eventually in [0, 2] s", "not always",
           "always eventually", "always not eventually in [1, 2] s"]  # fmt: skip


@given(st.sampled_from(WINDOWS), bands(), bands(), st.sampled_from(["and", "or"]), st.booleans())
def test_a_band_next_to_a_window_needs_brackets(window, one, other, word, is_first):
    """`always |e| <= 0.6 and |u| <= 0.5` would look at u at t = 0 only, in whatever order."""
    parts = [f"{window} {one}", str(other)]
    text = f" {word} ".join(parts if is_first else reversed(parts))
    for whole in (text, f"always ({text})", f"not ({text})", f"(a <= 1 and ({text}))"):
        with pytest.raises(ParameterError, match=r"at one time only.*write 'always \("):
            parse_formula(whole)
    apart = f" {word} ".join([f"({parts[0]})", parts[1]])
    assert str(parse_formula(str(parse_formula(apart)))) == str(parse_formula(apart))
    both = parse_formula(f"{window} ({one} {word} {other})")
    assert str(parse_formula(str(both))) == str(both)


@given(st.sampled_from(WINDOWS), bands(), bands(), bands(), st.booleans(), st.booleans())
def test_windows_that_stand_together_need_brackets_next_to_a_band(
    window, one, two, other, is_first, in_brackets
):
    """`always a and eventually b or c` would look at c at t = 0 only."""
    first = f"({window} {one})" if in_brackets else f"{window} {one}"
    parts = [f"{first} and eventually {two}", str(other)]
    text = " or ".join(parts if is_first else reversed(parts))
    with pytest.raises(ParameterError, match="at one time only") as told:
        parse_formula(text)
    meant = str(told.value).partition("or '")[2].partition("' where")[0]
    assert str(parse_formula(meant)) == str(parse_formula(f"({parts[0]}) or {parts[1]}"))


def test_the_message_has_what_is_meant_and_what_is_written():
    """Both ways to go on can be read by the parser."""
    with pytest.raises(ParameterError) as told:
        parse_formula("always |e| <= 0.6 and |u| <= 0.5")
    assert "looks at '|u| <= 0.5' at one time only" in str(told.value)
    assert "'(always |e| <= 0.6) and |u| <= 0.5' where that is meant" in str(told.value)
    parse_formula("(always |e| <= 0.6) and |u| <= 0.5")
    parse_formula("always (|e| <= 0.6 and |u| <= 0.5)")


@pytest.mark.parametrize("text", [
    "always a <= 1 and eventually b <= 2", "always (a <= 1 and b <= 2)", "a <= 1 and b <= 2",
    "always a <= 1 or always b <= 2", "not a <= 1 or b <= 2",
    "always (a <= 1 or (eventually b <= 2))",
])  # fmt: skip
def test_what_can_be_read_in_one_way_needs_no_brackets(text):
    """Windows next to windows, bands next to bands."""
    assert parse_formula(text) is not None
