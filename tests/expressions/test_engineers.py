"""The corpus of functions as engineers write them: each becomes expressions of equal values."""

import pytest
from engineers import ENTRIES
from engineers.measured import fate

NAMED = {entry.name: entry for entry in ENTRIES}


@pytest.mark.parametrize("name", sorted(NAMED))
def test_a_function_becomes_expressions_with_python_controls_values(name):
    """At points with ties, zeros and NaN, too; where Python raises an error there is NaN."""
    found = fate(NAMED[name])
    assert (found.kind, found.apart) == ("traced", ""), found.why


def test_the_corpus_is_large():
    assert len(NAMED) == len(ENTRIES) >= 150
