"""How many examples a property is tried on."""

import itertools
import os

import pytest


def many(examples, part=5):
    """Number of examples of a test of random programs: a fifth, but all of them once a week."""
    return examples if os.environ.get("ALL_EXAMPLES") else examples // part


def some(rows, part=3, first=0):
    """Every third row of a table that takes long, but all of them once a week."""
    rows = list(rows)
    return rows if os.environ.get("ALL_EXAMPLES") else rows[first % part :: part]


def crossed(*tables):
    """Rows of a test of all combinations: every value each day, the other combinations weekly.

    A table is a list of values, or a dict of values by their names.
    """
    named = [
        [*table.items()] if isinstance(table, dict) else [(_name_of(v), v) for v in table]
        for table in tables
    ]
    part = min(3, sorted(map(len, named))[-2])  # on the diagonals each value of each table is
    rows = []
    for row in itertools.product(*map(enumerate, named)):
        marks = [pytest.mark.weekly] if sum(place for place, _ in row) % part else []
        name = "-".join(name for _, (name, _) in row)
        rows.append(pytest.param(*(v for _, (_, v) in row), marks=marks, id=name))
    return rows


def _name_of(value):
    """Name of a value in the name of a test."""
    if isinstance(value, dict):  # how a run is made
        return "-".join(map(str, value.values()))
    return getattr(value, "__name__", str(value))
