"""A requirement taken apart: the least margin of its parts is its own."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.analysis.robustness import Requirement, margin
from nlctl.analysis.robustness.stl.text import parse_formula

T = np.linspace(0.0, 5.0, 251)
FORMULAS = (
    "always |y| <= 1",
    "always from 2 s on -0.5 <= y <= 1",
    "always in [1, 3] s (y <= 1 and z >= -1)",
    "(always y <= 1) and (eventually z >= 0.5)",
    "always (|y| <= 0.3 or z <= 1)",
    "eventually in [0, 3] s always from 0 s on |y| <= 1",
    "always in [0, 2] s eventually in [0, 1] s y >= 0",
    "not eventually y >= 1",
)


@pytest.mark.parted
@pytest.mark.parametrize("text", FORMULAS)
@given(seed=st.integers(0, 10_000))
def test_least_of_the_parts(text, seed):
    """Of waves at random, to rounding."""
    rng = np.random.default_rng(seed)
    amplitudes, rates, phases = rng.normal(size=(3, 2, 4))
    waves = [(a[:, None] * np.sin(w[:, None] * 3 * T + p[:, None])).sum(axis=0)
             for a, w, p in zip(amplitudes, rates, phases, strict=True)]  # fmt: skip
    signals = dict(zip("yz", waves, strict=True))
    whole = Requirement(key="whole", formula=parse_formula(text), until=5.0)
    parts = [part for row in whole.parts for part in row]
    least = min(margin(part, T, signals) for part in parts)
    assert abs(least - margin(whole, T, signals)) < 1e-9


def test_pieces_of_a_window_follow_each_other():
    """Each row covers the window of one bound, from its start to the end of the run."""
    whole = Requirement(key="in", formula=parse_formula("always from 2 s on |y| <= 1"), until=5.0)
    upper, lower = whole.parts
    for row in (upper, lower):
        assert row[0].formula.start == 2.0
        assert row[-1].formula.end == 5.0
        assert all(a.formula.end == b.formula.start for a, b in pairwise(row))
