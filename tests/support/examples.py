"""How many examples a property is tried on."""

import os

import pytest


def many(examples, part=5):
    """Number of examples of a test of random programs: a fifth, but all of them once a week."""
    return examples if os.environ.get("ALL_EXAMPLES") else examples // part


def some(rows, part=3, first=0):
    """Every third row of a table that takes long, but all of them once a week."""
    rows = list(rows)
    return rows if os.environ.get("ALL_EXAMPLES") else rows[first % part :: part]


def parted(rows, part=3):
    """Rows of a parametrized test: every third each day, the others marked weekly."""
    rows = list(rows)
    return [
        pytest.param(r, marks=pytest.mark.weekly) if i % part else r for i, r in enumerate(rows)
    ]
