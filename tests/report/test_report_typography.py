"""Text as in print: signs, powers, units that stay with their number, formulas of the ledger."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from test_report_page import HOSTILE

from nlctl.analysis.pages.proof import formulas
from nlctl.analysis.report.mathml import inline, spoken
from nlctl.analysis.report.typography import FORMULA, NO_BREAK, in_print, pieces, plain_text


@each_row(
    ("typed", "printed"),
    [
        ("for t >= 10 s, |e| = 0.1, (n < 3)", "for t_≥_10_s, |e|_=_0.1, (n_<_3)"),
        ("of them < 3, speed = 2", "of them_<_3, speed_=_2"),
        ("x1(0) = -0.5 and n < m", "x1(0)_=_−0.5 and n < m"),
        ("0.0e+00, 2.1e+00, 1e0", "0, 2.1, 1"),
        ("rms (71%), 50% each, a%20b", "rms (71_%), 50_% each, a%20b"),
        ("d per |x|^2, s^-i", "d per |x|², s⁻ⁱ"),
        ("99 % of 20 of 30 runs", "99_% of 20 of 30 runs"),
        ("2.5 / s, 10 1/s^2 and 3 N m", "2.5_/_s, 10_1/s² and 3_N m"),
        ("tolerance 1e-06 or 5e-05", "tolerance 10⁻⁶ or 5·10⁻⁵"),
        ("-1.776e-15", "−1.776·10⁻¹⁵"),
        ("1e+06 runs, 1e300", "10⁶ runs, 10³⁰⁰"),
        ("uniform on [-0.5, -0.1]", "uniform on [−0.5, −0.1]"),
        ("1/s^4 and m^-2", "1/s⁴ and m⁻²"),
        ("Example 1, row 17, Lemma 1", "Example_1, row_17, Lemma_1"),
        ("lines (33)-(36)", "lines (33)–(36)"),
        ("nlctl run --set a=-0.5 -o b", "nlctl run --set a=−0.5 -o b"),
        ("mid-2017, 5-fold, x1-x2, a-1", "mid-2017, 5-fold, x1-x2, a-1"),
        ("version 1.2e3.4, 82ece39d, 12e4f5", "version 1.2e3.4, 82ece39d, 12e4f5"),
        ("10 steps, 5 moves, 3 half", "10 steps, 5 moves, 3 half"),
    ],
)
def test_text_is_set_as_in_print(typed, printed):
    """Numbers, powers and units, and nothing else; _ stands for a space that does not break."""
    assert in_print(typed) == printed.replace("_", NO_BREAK)


@given(st.text())
def test_setting_a_text_loses_nothing_and_is_done_once(text):
    """Every letter and digit stays in its order, and set text does not change again."""
    once = in_print(text)
    assert in_print(once) == once
    apart = r"[\W_e⁰¹²³⁴⁵⁶⁷⁸⁹]|\d"
    assert re.sub(apart, "", once) == re.sub(apart, "", text)


@given(st.text(), st.sampled_from(["a", r"\dot V", r"x^{2}"]), st.text())
def test_a_formula_between_two_texts_is_one_piece(before, latex, after):
    """What stands around it stays text."""
    found = pieces(f"{before.replace(chr(92), '')}\\({latex}\\){after.replace(chr(92), '')}")
    assert [piece.latex for piece in found if piece.latex] == [latex]


@pytest.mark.parametrize("name", HOSTILE)
def test_names_of_users_are_no_formulas(name):
    """Dollars, backslashes and braces are what they are."""
    assert not [piece for piece in pieces(HOSTILE[name]) if piece.latex]


LEDGER = [
    (
        "V_r' <= r W^T psi + |r| delta* + r Y_d",
        r"\(\dot{V}_{r}\le r\,W^{T}\,\psi +|r|\,\delta^{*}+r\,Y_{d}\)",
    ),
    (
        "V <= alpha_0/alpha_1 + (V(0) - alpha_0/alpha_1) e^(-alpha_1 t) + I",
        r"\(V\le \alpha_{0}/\alpha_{1}+(V(0)-\alpha_{0}/\alpha_{1})\,e^{-\alpha_{1}\,t}+I\)",
    ),
    ("- W~^T Gamma^-1 W_hat'", r"\(-\tilde{W}^{T}\,\Gamma ^{-1}\,\dot{\hat{W}}\)"),
    ("delta~ delta_hat'/gamma", r"\(\tilde{\delta}\,\dot{\hat{\delta}}/\gamma \)"),
    ("|r| <= sqrt(2 B), B of (32)", r"\(|r|\le \sqrt{2\,B}\), \(B\) of (32)"),
    ("x1 in [-0.99, 1.13]", r"\(x_{1}\) in [-0.99, 1.13]"),
    ("all signals stay finite over 20 s", "all signals stay finite over 20 s"),
    ("1 response in [0, 20] s", "1 response in [0, 20] s"),
    ("the lobe's 'own' 5-fold", "the lobe's 'own' 5-fold"),
    ("a monotone zeta or a constant gain", r"a monotone \(\zeta \) or a constant gain"),
    ("lines (b), (c); as of (23), (24)", "lines (b), (c); as of (23), (24)"),
    ("45.5 % of 5001 samples violate it", "45.5 % of 5001 samples violate it"),
    ("int k G N dzeta", r"\(\int k\,G\,N\,d\zeta \)"),
    ("sigma_2 delta*^2 / (2 alpha_1)", r"\(\sigma_{2}\,\delta^{*2}/(2\,\alpha_{1})\)"),
    ("l+ E+ - l- E-", r"\(l_{+}\,E_{+}-l_{-}\,E_{-}\)"),
]


@each_row(("typed", "told"), LEDGER)
def test_formulas_of_the_ledger_are_told_from_words(typed, told):
    """Words stay words; what stands for symbols is LaTeX that the page can show."""
    assert formulas(typed) == told
    for latex in FORMULA.findall(told):
        assert str(inline(latex)).startswith("<math")


@each_row(
    ("latex", "words"),
    [
        (r"\dot V \le -\alpha_1 V", "V̇ ≤ −α_1V"),
        (r"e^{-\alpha_1 t}", "e^(−α_1t)"),
        (r"\hat W^T \psi(x)", "Ŵ^Tψ(x)"),
        (r"\frac{a}{b}", "a/b"),
        (r"\notacommand{", r"\notacommand{"),
    ],
)
def test_a_formula_can_be_read_aloud(latex, words):
    """In titles and descriptions of figures, where no MathML can stand."""
    assert spoken(latex) == words
    assert plain_text(rf"see \({latex}\).") == f"see {words}."


def test_a_comma_stays_on_the_line_of_its_formula():
    """What closes a formula goes with it; what follows after a space may go on below."""
    found = pieces(r"if \(a < b\), then (\(c\)).")
    assert [(p.text, p.latex, p.tail) for p in found] == [
        ("if ", "", ""), ("", "a < b", ","), (" then (", "", ""), ("", "c", ")."),
    ]  # fmt: skip


def test_an_index_of_several_signs_is_an_index():
    """In braces, as (1) has it."""
    assert formulas("x_i' = x_{i+1}, y = x_1") == r"\(\dot{x}_{i}=x_{i+1}\), \(y=x_{1}\)"
