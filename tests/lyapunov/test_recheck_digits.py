"""Numbers of a claim in words."""

from fractions import Fraction

import numpy as np

from nlctl.analysis.recheck.integers import exact_text, text_above, text_below


def test_text_lies_on_the_side_that_claims_no_more():
    """Within a unit of the sixth digit, whatever the size; exact where that is short."""
    rng = np.random.default_rng(0)
    for number in rng.standard_normal(2_000) * 10.0 ** rng.uniform(-300, 300, 2_000):
        value, above, below = (
            Fraction(v) for v in (repr(float(number)), text_above(number), text_below(number))
        )
        assert below <= value <= above
        assert above - below <= abs(value) / 10**5
    for text in ("0.5", "-2", "1e-09", "412.423", "0", "0.1"):
        assert text_above(float(text)) == text_below(float(text)) == text


def test_fractions_and_what_has_no_end():
    assert (text_above(Fraction(1, 3)), text_below(Fraction(1, 3))) == ("0.333334", "0.333333")
    assert text_above(np.inf) == "inf"
    assert text_below(-np.inf) == "-inf"
    assert text_above(np.nan) == "nan"


def test_a_premise_has_all_digits():
    assert exact_text(0.1) == "0.1"
    assert exact_text(-2.0) == "-2"
    assert exact_text(Fraction(1, 3)) == "0.3333333333333333"
    assert float(exact_text(np.nextafter(0.5, 1.0))) == np.nextafter(0.5, 1.0)
