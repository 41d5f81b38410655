"""The corpus of functions as engineers write them: each becomes expressions of equal values."""

import numpy as np
import pytest
from engineers import ENTRIES, system
from engineers.measured import fate
from examples import some

import nlctl

NAMED = {entry.name: entry for entry in ENTRIES}


@pytest.mark.parted
@pytest.mark.parametrize("name", sorted(NAMED))
def test_a_function_becomes_expressions_with_python_controls_values(name):
    """At points with ties, zeros and NaN, too; where Python raises an error there is NaN."""
    found = fate(NAMED[name])
    assert (found.kind, found.apart) == ("traced", ""), found.why


def test_the_corpus_is_large():
    assert len(NAMED) == len(ENTRIES) >= 150


def smooth_differences(system, x, u):
    """Return Richardson's Jacobian, and where two steps say that it is sure of itself."""

    def central(h):
        ends = [(system.dynamics(T, x + h * e, u), system.dynamics(T, x - h * e, u))
                for e in np.eye(x.size)]  # fmt: skip
        return np.stack([(a - b) / (2 * h) for a, b in ends], axis=1)

    fine, coarse = central(1e-4), central(2e-4)
    return (4 * fine - coarse) / 3, np.abs(fine - coarse) < 1e-6 * (1 + np.abs(fine))


T = 0.31


@pytest.mark.weekly
@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_derivatives_and_formulas_follow():
    """Nothing but the functions themselves was written for them."""
    rng = np.random.default_rng(1)
    for entry in some(ENTRIES):
        x, u = rng.uniform(0.2, 1.4, entry.states), rng.uniform(0.2, 0.9, entry.inputs)
        if entry.states == 1 and not entry.inputs:
            continue
        made = system(entry)
        wanted, sure = smooth_differences(made, x, u)
        found = nlctl.compile(made).linearize(x, u, t=T).A
        apart = np.where(sure, np.abs(found - wanted) / (1 + np.abs(wanted)), 0.0)
        assert apart.max() < 1e-6, entry.name
        assert nlctl.typeset(made)[0].equations, entry.name
