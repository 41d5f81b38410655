"""Maps of failures in the plane of two quantities: known boundaries."""

import numpy as np
import pandas as pd
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy import stats
from small_systems import function

import nlctl
from nlctl.analysis.robustness.search.failure_map import boundary, failure_map
from nlctl.analysis.robustness.uncertainty.space import Choice, Space, SpaceError, Uncertain

SPACE = Space(
    quantities=(
        Uncertain(name="a", bounds=(-1.0, 1.0), nominal=0.0),
        Uncertain(name="b", bounds=(0.0, 4.0), nominal=2.0),
        Uncertain(name="c", bounds=(0.0, 1.0), nominal=0.25),
    ),
    choices=(Choice(name="arm", options={"x": 1, "y": 2}),),
)


def ellipse(table):
    """< 0 outside of (2 a)^2 + (b - 2)^2 = 1.5^2 about the middle."""
    return 1.5 - np.hypot(2 * table["a"], table["b"] - 2)


def test_the_boundary_is_the_ellipse():
    """Its points are off by less than a tenth of a cell: the margin is smooth there."""
    made = failure_map(function(ellipse), SPACE, "a", "b", levels=3)
    points = boundary(made)
    assert made.is_finished
    assert made.cell == (pytest.approx(2 / 64), pytest.approx(4 / 64))
    assert np.max(np.abs(ellipse(points))) < 0.1 * made.cell[1]
    angles = np.sort(np.arctan2(2 * points["a"], points["b"] - 2))
    assert np.max(np.diff(angles)) < 0.1  # all the way round


def test_runs_are_spent_at_the_boundary():
    """Far less than the full fine grid, and the finest points are near the ellipse."""
    made = failure_map(function(ellipse), SPACE, "a", "b", levels=4)
    assert len(made.table) < 0.2 * (8 * 16 + 1) ** 2
    last = made.table[made.table["round"] == made.table["round"].max()]
    assert np.max(np.abs(ellipse(last))) < 0.5
    assert not made.table.duplicated(["a", "b"]).any()


def test_a_line_is_met_exactly():
    """A linear margin: the joined lines are the margin itself."""
    made = failure_map(function(lambda t: t["a"] + 0.1 * t["b"] - 0.37), SPACE, "a", "b")
    points = boundary(made)
    np.testing.assert_allclose(points["a"] + 0.1 * points["b"], 0.37, atol=1e-12)


def test_a_small_island_between_grid_points_is_found():
    """No corner of the first grid is inside, but the margin nearby is small for its slope."""

    def island(table):
        return np.hypot(table["a"] - 0.1, (table["b"] - 2.2) / 2) - 0.09

    first = failure_map(function(island), SPACE, "a", "b", levels=0)
    assert np.all(first.table["spec"] > 0)
    made = failure_map(function(island), SPACE, "a", "b", levels=4)
    points = boundary(made)
    assert np.max(np.abs(island(points))) < 0.02
    assert len(points) > 20


def test_the_triangles_cover_the_box_once():
    """Their areas add up to the box, and all are of positive area."""
    made = failure_map(function(ellipse), SPACE, "a", "b", cells=3, levels=3)
    p = made.table[["a", "b"]].to_numpy()[made.triangles]
    one, two = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    areas = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]) / 2
    assert areas.sum() == pytest.approx(8.0)
    assert areas.min() > 0


def test_the_others_are_nominal_or_given():
    made = failure_map(function(ellipse), SPACE, "b", "c", levels=1)
    assert set(made.table["a"]) == {0.0}
    assert set(made.table["arm"]) == {"x"}
    made = failure_map(function(ellipse), SPACE, "b", "a", at={"c": 0.7, "arm": "y"}, levels=1)
    assert set(made.table["c"]) == {0.7}
    assert set(made.table["arm"]) == {"y"}
    witness = {"a": 0.3, "b": 1.0, "c": 0.7, "arm": "y"}  # of the axes' values nothing is taken
    again = failure_map(function(ellipse), SPACE, "b", "a", at=witness, levels=1)
    pd.testing.assert_frame_equal(again.table, made.table)


@settings(deadline=None, max_examples=many(20, part=4))
@given(st.integers(0, 2**32), st.integers(1, 400))
def test_it_keeps_to_its_runs(entropy, most):
    """The first grid always runs; margins are those of the rows; NaN counts as failing."""
    rng = np.random.default_rng(entropy)
    k, shift = rng.normal(size=(2, 2)), rng.normal()

    def waves(table):
        x = table[["a", "b"]].to_numpy() @ k
        margins = np.sin(3 * x[:, 0]) + np.cos(2 * x[:, 1]) + shift
        return np.where(margins < -1, np.nan, margins)

    made = failure_map(function(waves), SPACE, "a", "b", cells=4, levels=3, most=most)
    assert len(made.table) <= max(25, most)
    np.testing.assert_array_equal(made.table["spec"], waves(made.table))
    if made.is_finished:
        assert len(failure_map(function(waves), SPACE, "a", "b", cells=4, levels=3).table) == len(
            made.table
        )


def test_diverged_runs_draw_no_refinement_of_their_own():
    """Graded margins of -1e6 and below have large slopes among themselves."""

    def bursts(table):
        return np.where(table["a"] > 0.5, -1e6 * (2 - table["a"]), 0.8)

    made = failure_map(function(bursts), SPACE, "a", "b", levels=3)
    fine = made.table[made.table["round"] >= 2]
    assert np.all(np.abs(fine["a"] - 0.5) <= 0.25)
    assert np.all(np.abs(boundary(made)["a"] - 0.5) <= made.cell[0])


@each_row(
    ("changes", "error", "message"),
    [
        ({"x": "aa"}, nlctl.errors.UnknownNameError, "nearest: 'a'"),
        ({"y": "arm"}, nlctl.errors.UnknownNameError, "quantity 'arm' for an axis"),
        ({"y": "a"}, nlctl.errors.ParameterError, "got 'a' twice"),
        ({"at": {"cc": 1}}, nlctl.errors.UnknownNameError, "nearest: 'c'"),
        ({"cells": 0}, nlctl.errors.ParameterError, "cells >= 1"),
        (
            {"space": Space(quantities=(*SPACE.quantities, Uncertain(name="n", law=stats.norm())))},
            SpaceError,
            "'n' has no nominal value",
        ),
    ],
)
def test_bad_calls_are_refused(changes, error, message):
    given = {"evaluate": function(ellipse), "space": SPACE, "x": "a", "y": "b"}
    with pytest.raises(error, match=message):
        failure_map(**given | changes)
