"""Designs: what each promises about its rows, and rows that can be made again."""

import itertools
import pickle

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.uncertainty.design import (
    from_table,
    independent,
    latin_hypercube,
    row_seed,
    rows,
    seed_number,
    sobol,
)
from nlctl.analysis.robustness.uncertainty.lattice import corners, grid, one_at_a_time
from nlctl.analysis.robustness.uncertainty.space import Choice, Space, SpaceError, Uncertain

A = Uncertain(name="a", bounds=(1.0, 3.0), nominal=1.5)
B = Uncertain(name="b", law=stats.norm(0, 2), nominal=0.0)
SEED = Uncertain(name="seed", law=stats.randint(0, 5), nominal=0)
ARM = Choice(name="arm", options={"x": 1, "y": 2, "z": 3})
SPACE = Space(quantities=(A, B), choices=(ARM,))


@pytest.mark.slow
@given(st.integers(0, 2**64), st.integers(1, 30), st.integers(0, 29))
def test_any_row_can_be_drawn_again_without_the_others(entropy, size, row):
    """Alone, in a longer design, and in any chunk it is the same."""
    row = min(row, size - 1)
    design = independent(SPACE, size, entropy)
    alone = rows(design, range(row, row + 1))
    assert alone.equals(design.table.iloc[row : row + 1])
    assert alone.equals(rows(independent(SPACE, size + 7, entropy), range(row, row + 1)))
    backwards = pd.concat([rows(design, range(k, k + 1)) for k in reversed(range(size))])
    assert backwards.sort_index().equals(design.table)
    assert list(design.table.index) == list(range(size))


def test_rows_are_drawn_from_the_laws():
    """Kolmogorov-Smirnov against each law; neighbouring rows and columns are uncorrelated."""
    table = independent(SPACE, 4000, entropy=1).table
    for q in (A, B):
        assert stats.kstest(table[q.name], q.law.cdf).pvalue > 0.01
    assert abs(np.corrcoef(table.a, table.b)[0, 1]) < 3 / np.sqrt(4000)
    assert abs(np.corrcoef(table.a[1:], table.a[:-1])[0, 1]) < 3 / np.sqrt(4000)
    assert stats.chisquare(table.arm.value_counts()).pvalue > 0.01


def test_a_rows_seed_depends_on_entropy_and_number_alone():
    """The documented SeedSequence; different rows and designs have different seeds."""
    one, two = independent(SPACE, 5, 7), latin_hypercube(SPACE, 5, 7)
    wanted = np.random.SeedSequence(7, spawn_key=(3,)).generate_state(4)
    np.testing.assert_array_equal(row_seed(one, 3).generate_state(4), wanted)
    assert seed_number(one, 3) == seed_number(two, 3)
    seeds = {seed_number(independent(SPACE, 9, e), k) for e in range(20) for k in range(9)}
    assert len(seeds) == 180
    assert 0 <= max(seeds) < 2**64


@pytest.mark.parametrize("make", [independent, sobol, latin_hypercube])
def test_random_designs_repeat_by_their_entropy(make):
    """The same entropy, the same table; without one it is fresh and kept."""
    fresh = make(SPACE, 16)
    assert make(SPACE, 16, fresh.entropy).table.equals(fresh.table)
    assert not make(SPACE, 16).table.equals(fresh.table)
    assert pickle.loads(pickle.dumps(fresh)).table.equals(fresh.table)


def test_only_independent_draws_are_iid():
    """And a user's table if the user says so."""
    table = pd.DataFrame({"a": [1.0, 2.0], "b": [0, 1], "arm": ["x", "y"]})
    designs = [
        sobol(SPACE, 4), latin_hypercube(SPACE, 4), grid(SPACE, 2), corners(SPACE),
        one_at_a_time(SPACE), from_table(SPACE, table),
    ]  # fmt: skip
    assert not any(design.is_iid for design in designs)
    assert len({design.kind for design in designs}) == len(designs)
    assert independent(SPACE, 3).is_iid
    assert from_table(SPACE, table, drawn_independently=True).is_iid


@given(st.integers(1, 40), st.integers(0, 99))
def test_a_latin_hypercube_has_one_row_in_every_slice(n, entropy):
    """Of every quantity, by its law."""
    table = latin_hypercube(SPACE, n, entropy).table
    for q in (A, B):
        slices = np.floor(q.law.cdf(table[q.name]) * n).astype(int)
        assert sorted(slices) == list(range(n))


def test_a_sobol_design_is_balanced():
    """Of 64 rows one in each of 64 slices of every axis, four in each of 16 squares of any two."""
    space = Space(quantities=tuple(Uncertain(name=n, bounds=(0, 1)) for n in "abc"))
    unit = sobol(space, 64, 3).table.to_numpy()
    for axis in range(3):
        assert sorted(np.floor(unit[:, axis] * 64)) == list(range(64))
    cells = np.floor(unit[:, :2] * 4) @ [4, 1]
    assert set(np.bincount(cells.astype(int))) == {4}


def test_a_grid_crosses_everything():
    """Ends included; integers stay integers; one level is the middle."""
    space = Space(quantities=(A, SEED), choices=(ARM,))
    table = grid(space, {"a": 3, "seed": 5}).table
    assert len(table) == len(table.drop_duplicates()) == 45
    wanted = itertools.product([1.0, 2.0, 3.0], range(5), "xyz")
    assert {(r.a, r.seed, r.arm) for r in table.itertuples()} == set(wanted)
    assert set(grid(space, 1).table.a) == {2.0}


def test_corners_are_the_ends_of_the_boxes():
    """2^d for d quantities, times the options."""
    table = corners(SPACE).table
    assert len(table) == len(table.drop_duplicates()) == 12
    assert set(table.a) == set(A.box)
    assert set(table.b) == set(B.box)


def test_one_at_a_time_changes_one_thing_a_row():
    """Row 0 is nominal; each other row differs where `varied` says, or not at all."""
    design = one_at_a_time(SPACE, 3)
    first = design.table.iloc[0]
    assert dict(first) == {"a": 1.5, "b": 0.0, "arm": "x"}
    for (_, row), varied in zip(design.table.iterrows(), design.details["varied"], strict=True):
        assert {k for k in row.index if row[k] != first[k]} <= {varied}
    assert list(design.details["varied"]) == ["", *"aaabbb", "arm", "arm"]
    assert list(design.table.a[1:4]) == [1.0, 2.0, 3.0]


def test_a_users_table_is_taken_as_it_is():
    """Columns in any order; the index becomes row numbers."""
    table = pd.DataFrame({"arm": ["y", "x"], "b": [1, -50], "a": ["2.5", 1.0]}, index=[7, 9])
    design = from_table(SPACE, table)
    assert design.table.to_dict("list") == {"a": [2.5, 1.0], "b": [1, -50], "arm": ["y", "x"]}
    assert list(design.table.index) == [0, 1]


GOOD = {"a": [1.0], "b": [0.0], "arm": ["x"]}


@each_row(
    ("make", "error", "message"),
    [
        (lambda: independent(SPACE, 0), nlctl.errors.ParameterError, "size >= 1, got 0"),
        (lambda: independent(SPACE, 2, -1), nlctl.errors.ParameterError, "entropy >= 0"),
        (lambda: sobol(SPACE, 100), nlctl.errors.ParameterError, "got 100: take 64 or 128"),
        (lambda: grid(SPACE, 0), nlctl.errors.ParameterError, "levels of 'a' >= 1"),
        (
            lambda: grid(SPACE, {"a": 2}),
            nlctl.errors.ParameterError,
            "levels of 'b' >= 1, got None",
        ),
        (lambda: grid(SPACE, {"aa": 2}), nlctl.errors.UnknownNameError, "nearest: 'a'"),
        (lambda: one_at_a_time(SPACE, 1), nlctl.errors.ParameterError, "levels >= 2"),
        (
            lambda: one_at_a_time(Space(quantities=(Uncertain(name="a", bounds=(0, 1)),))),
            SpaceError,
            "no nominal value",
        ),
        (
            lambda: rows(independent(SPACE, 5), range(3, 6)),
            nlctl.errors.ParameterError,
            "rows 0 to 4",
        ),
        (
            lambda: from_table(SPACE, pd.DataFrame({**GOOD, "c": [1]})),
            nlctl.errors.UnknownNameError,
            "'c' in the table",
        ),
        (
            lambda: from_table(SPACE, pd.DataFrame(GOOD).drop(columns="b")),
            nlctl.errors.ParameterError,
            r"lacks \['b'\]",
        ),
        (
            lambda: from_table(SPACE, pd.DataFrame({**GOOD, "a": [np.nan]})),
            nlctl.errors.ParameterError,
            "'a' needs finite numbers, row 0",
        ),
        (
            lambda: from_table(SPACE, pd.DataFrame({**GOOD, "arm": ["w"]})),
            nlctl.errors.UnknownNameError,
            "option 'w' of 'arm'",
        ),
    ],
)
def test_designs_that_cannot_be_are_refused(make, error, message):
    """With name, rule and value."""
    with pytest.raises(error, match=message):
        make()
