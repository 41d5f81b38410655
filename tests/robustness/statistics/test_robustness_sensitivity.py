"""Sensitivity against functions whose indices are known."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row
from scipy import stats

import nlctl
from nlctl.analysis.robustness.statistics.sensitivity import (
    censored,
    elementary_effects,
    morris,
    regional,
    saltelli,
    sobol_indices,
)
from nlctl.analysis.robustness.stl.spec import unfinished_margin
from nlctl.analysis.robustness.uncertainty.design import independent, sobol
from nlctl.analysis.robustness.uncertainty.space import Choice, Space, Uncertain, scaled


def cube(d, low=0.0, high=1.0):
    """Return a space of d uniform quantities x0, x1, ..."""
    return Space(
        quantities=tuple(
            Uncertain(name=f"x{i}", bounds=(low, high), nominal=(low + high) / 2) for i in range(d)
        )
    )


@pytest.mark.slow
@given(st.integers(0, 10**6), st.sampled_from([2, 4, 8]))
def test_effects_of_a_linear_function_are_its_slopes_times_the_box(entropy, levels):
    """In every trajectory alike: sigma is 0, the interval a point; scaling does not matter."""
    space = Space(
        quantities=(
            Uncertain(name="a", bounds=(1.0, 3.0), nominal=2.0),
            Uncertain(name="b", law=stats.norm(5, 1), nominal=5.0),
            Uncertain(name="c", bounds=(0.0, 1.0), nominal=0.5),
        )
    )
    for part in (space, scaled(space, 0.5)):
        design = morris(part, 3, levels, entropy)
        t = design.table
        got = elementary_effects(design, 4 * t.a - 2 * t.b)
        width = np.array([2.0, np.ptp(space.quantities[1].box), 1.0]) * part.scale
        assert list(got.mu) == pytest.approx([4 * width[0], -2 * width[1], 0], abs=1e-9)
        assert list(got.mu_star) == pytest.approx(np.abs(got.mu), abs=1e-12)
        assert list(got.sigma) == pytest.approx([0, 0, 0], abs=1e-9)
        np.testing.assert_allclose(got.low, got.high, atol=1e-9)


def test_each_step_of_a_trajectory_changes_one_quantity():
    """And every quantity once, between levels of the grid."""
    design = morris(cube(5), 20, 4, entropy=1)
    x = design.table.to_numpy().reshape(20, 6, 5)
    changed = np.abs(np.diff(x, axis=1)) > 1e-9
    assert np.all(changed.sum(axis=1) == 1)
    assert np.all(changed.sum(axis=2) == 1)
    np.testing.assert_allclose(np.abs(np.diff(x, axis=1)[changed]), 2 / 3)
    assert np.abs(x * 3 - np.rint(x * 3)).max() < 1e-12
    assert {0.0, 1.0} <= set(np.rint(x.ravel() * 3) / 3)


def test_an_interaction_shows_as_spread():
    """y = (2a - 1)(2b - 1) + c: mean effects 0, 0, 1; only those of c are all alike."""
    design = morris(cube(3), 400, 4, entropy=2)
    t = design.table
    got = elementary_effects(design, (2 * t.x0 - 1) * (2 * t.x1 - 1) + t.x2)
    # the other factor is +-1 or +-1/3, evenly: mean magnitude 4/3, mean square 2.22
    assert list(got.mu) == pytest.approx([0, 0, 1], abs=0.25)
    assert list(got.mu_star) == pytest.approx([4 / 3, 4 / 3, 1], abs=0.1)
    assert got.sigma["x2"] == pytest.approx(0, abs=1e-9)
    assert got.sigma["x0"] == pytest.approx(np.sqrt(20 / 9), abs=0.1)
    assert np.all((got.low <= got.mu_star + 1e-12) & (got.mu_star <= got.high + 1e-12))


def test_whole_numbers_are_screened_by_the_steps_they_take():
    """A linear function of an integer has one effect, though levels are rounded."""
    space = Space(quantities=(Uncertain(name="n", law=stats.randint(0, 6)),))
    design = morris(space, 10, 4, entropy=0)
    got = elementary_effects(design, 3 * design.table.n)
    assert (got.mu["n"], got.sigma["n"]) == pytest.approx((15, 0), abs=1e-9)


def ishigami(table, a=7.0, b=0.1):
    """Ishigami and Homma 1990, on [-pi, pi]^3."""
    x1, x2, x3 = (table[f"x{i}"] for i in range(3))
    return np.sin(x1) + a * np.sin(x2) ** 2 + b * x3**4 * np.sin(x1)


def test_ishigamis_indices_are_the_known_ones():
    """V1 = (1 + b pi^4 / 5)^2 / 2, V2 = a^2 / 8, V13 = 8 b^2 pi^8 / 225."""
    a, b = 7.0, 0.1
    v1, v2 = (1 + b * np.pi**4 / 5) ** 2 / 2, a**2 / 8
    v13 = 8 * b**2 * np.pi**8 / 225
    v = v1 + v2 + v13
    design = saltelli(cube(3, -np.pi, np.pi), 2**12, entropy=1)
    got = sobol_indices(design, ishigami(design.table), resamples=99)
    assert list(got.S1) == pytest.approx([v1 / v, v2 / v, 0], abs=0.02)
    assert list(got.ST) == pytest.approx([(v1 + v13) / v, v2 / v, v13 / v], abs=0.02)


@pytest.mark.parametrize("a", [(0.0, 1.0, 4.5, 9.0, 99.0)])
def test_the_g_functions_indices_are_the_known_ones(a):
    """prod (|4x - 2| + a_i) / (1 + a_i): V_i = 1 / (3 (1 + a_i)^2), V = prod (1 + V_i) - 1."""
    a = np.array(a)
    v = 1 / (3 * (1 + a) ** 2)
    total = np.prod(1 + v) - 1
    design = saltelli(cube(a.size), 2**12, entropy=3)
    y = np.prod((np.abs(4 * design.table.to_numpy() - 2) + a) / (1 + a), axis=1)
    got = sobol_indices(design, y, resamples=99)
    np.testing.assert_allclose(got.S1, v / total, atol=0.02)
    np.testing.assert_allclose(got.ST, v / (1 + v) * (1 + total) / total, atol=0.02)


def test_a_linear_function_shares_by_its_variances_whatever_the_laws():
    """c_i^2 var(x_i) over their sum, without interactions; a choice has its variance too."""
    space = Space(
        quantities=(
            Uncertain(name="n", law=stats.norm(3, 2)),
            Uncertain(name="u", bounds=(0, 6)),
            Uncertain(name="idle", law=stats.expon()),
        ),
        choices=(Choice(name="arm", options={"x": 0, "y": 0}, weights=(0.2, 0.8)),),
    )
    design = saltelli(space, 2**11, entropy=4)
    t = design.table
    y = t.n - 2 * t.u + 10 * (t.arm == "y")
    variances = np.array([4, 4 * 36 / 12, 0, 100 * 0.16])
    got = sobol_indices(design, y, resamples=99)
    for column in ("S1", "ST"):
        np.testing.assert_allclose(got[column], variances / variances.sum(), atol=0.02)
    assert (got.ST["idle"], got.ST_high["idle"]) == (0, 0)


@pytest.mark.weekly
def test_bootstrap_intervals_cover_and_repeat():
    """Of 40 designs most 90 % intervals hold the known share; one design has one interval."""
    covered = 0
    for entropy in range(40):
        design = saltelli(cube(2), 64, entropy)
        got = sobol_indices(design, design.table.x0 + 2 * design.table.x1, 0.9, resamples=199)
        covered += got.S1_low["x1"] <= 0.8 <= got.S1_high["x1"]
    assert covered >= 30  # below with probability 1e-3 if the coverage is 90 %
    again = sobol_indices(design, design.table.x0 + 2 * design.table.x1, 0.9, resamples=199)
    pd.testing.assert_frame_equal(got, again)


def test_a_constant_response_has_no_shares():
    """0, not NaN."""
    design = saltelli(cube(2), 8, entropy=1)
    assert (sobol_indices(design, np.full(32, 3.7), resamples=9) == 0).all(axis=None)


def margins_with_failures(x):
    """Margin x1 where x0 < 1 - p; elsewhere the run ends at time x1 of 1."""
    graded = [unfinished_margin(time, 1.0) for time in x.x1]
    return np.where(x.x0 < 0.75, x.x1, graded)


def test_shares_with_failed_runs_are_those_of_the_censored_margin():
    """A quarter fails and counts as -1: y = (1 - I) x1 - I with I ~ Bernoulli(p) set by x0.

    E[y | x0] = 1/2 - 3/2 I and E[y | x1] = (1 - p) x1 - p.  Graded margins are (x1 - 2) I, in
    millions: of x1 only the time at which runs end is left, p^2 / 12 of 7 p / 3 - 9 p^2 / 4.
    """
    p = 0.25
    v0, v1, v01 = 9 / 4 * p * (1 - p), (1 - p) ** 2 / 12, p * (1 - p) / 12
    v = v0 + v1 + v01
    assert v == pytest.approx((1 - p) / 3 + p - ((1 - p) / 2 - p) ** 2)  # E[y^2] - E[y]^2
    design = saltelli(cube(2), 2**12, entropy=1)
    graded = margins_with_failures(design.table)
    values, failed, least = censored(graded)
    assert least == -1
    assert failed == np.sum(design.table.x0 >= 0.75)
    got = sobol_indices(design, values, resamples=99)
    assert list(got.S1) == pytest.approx([v0 / v, v1 / v], abs=0.01)
    assert list(got.ST) == pytest.approx([(v0 + v01) / v, (v1 + v01) / v], abs=0.01)
    swamped = sobol_indices(design, graded, resamples=9).S1["x1"]
    assert swamped == pytest.approx(p**2 / 12 / (7 * p / 3 - 9 * p**2 / 4), abs=0.005)


def test_effects_with_failed_runs_are_those_of_the_censored_margin():
    """x0 always steps between {0, 1/3} and {2/3, 1}: there it crosses 1/2, from x1 to -1.

    Its effect is -(1 + x1) 3 / 2, of mean -9 / 4 over the levels of x1; that of x1 is 1 or 0.
    """
    design = morris(cube(2), 400, 4, entropy=2)
    t = design.table
    values, failed, least = censored(np.where(t.x0 < 0.5, t.x1, -2e6 + 1e6 * t.x1))
    assert (failed, least) == (np.sum(t.x0 > 0.5), -1)
    got = elementary_effects(design, values)
    assert list(got.mu) == pytest.approx([-9 / 4, 1 / 2], abs=0.1)
    assert list(got.mu_star) == pytest.approx([9 / 4, 1 / 2], abs=0.1)


@given(st.lists(st.floats(-9e5, 1e3) | st.floats(-2e6, -1e6) | st.just(np.nan), min_size=1))
def test_a_failed_run_is_no_better_than_any_other_and_violates(margins):
    """Margins of runs that ended stay as they are; the order of all others is lost, not turned."""
    margins = np.array(margins)
    ended = margins > -1e6
    if not ended.any():
        with pytest.raises(
            nlctl.errors.ParameterError, match=f"of {margins.size} rows? none reached"
        ):
            censored(margins)
        return
    values, failed, least = censored(margins)
    np.testing.assert_array_equal(values[ended], margins[ended])
    assert failed == np.sum(~ended)
    assert np.all(values[~ended] == least)
    assert least == min(*margins[ended], -1)


def test_what_sets_failures_apart_is_found():
    """Failures where x0 > 0.7: the distance of its two distributions is 1, p tiny; x1 is idle."""
    space = Space(
        quantities=cube(2).quantities,
        choices=(Choice(name="arm", options={"x": 1, "y": 2}),),
    )
    design = independent(space, 400, entropy=5)
    got = regional(design, 0.7 - design.table.x0)
    assert got.statistic["x0"] == 1
    assert got.p_holm["x0"] < 1e-20
    assert got.p_holm["x1"] > 0.01
    assert got.p_holm["arm"] > 0.01
    by_arm = regional(design, np.where(design.table.arm == "x", 1.0, np.nan))
    assert by_arm.statistic["arm"] == pytest.approx(1)
    assert by_arm.p_holm["arm"] < 1e-20
    assert by_arm.p_holm["x0"] > 0.01


@pytest.mark.weekly
def test_p_values_of_idle_quantities_are_uniform():
    """Kolmogorov-Smirnov under the hypothesis: 5 % of p-values are below 0.05."""
    p = []
    for entropy in range(200):
        design = independent(cube(2), 60, entropy)
        p.append(regional(design, design.table.x0 - 0.4).p["x1"])
    below = np.sum(np.array(p) <= 0.05)
    assert stats.binom.sf(below - 1, 200, 0.05) > 1e-4


def test_space_filling_designs_get_no_p_values():
    """The statistic describes; the test's law does not hold."""
    design = sobol(cube(2), 64, entropy=1)
    got = regional(design, 0.7 - design.table.x0)
    assert got.statistic["x0"] == 1
    assert got[["p", "p_holm"]].isna().all(axis=None)


DRAWN = independent(cube(2), 8, entropy=1)


@each_row(
    ("call", "message"),
    [
        (lambda: morris(cube(2), 1), "trajectories >= 2"),
        (lambda: morris(cube(2), 5, 3), "even number of levels, got 3"),
        (
            lambda: morris(Space(choices=(Choice(name="arm", options={"x": 1}),)), 5),
            r"\['arm'\] are choices",
        ),
        (lambda: saltelli(cube(2), 100), "got 100: take 64 or 128"),
        (lambda: saltelli(cube(1), 8), r"two quantities, got \['x0'\]"),
        (lambda: elementary_effects(DRAWN, np.ones(8)), r"from morris\(space.*'i.i.d.'"),
        (lambda: sobol_indices(DRAWN, np.ones(8)), r"from saltelli\(space"),
        (lambda: sobol_indices(saltelli(cube(2), 8), np.ones(8)), "each of 32 rows, got 8"),
        (
            lambda: sobol_indices(saltelli(cube(2), 2), np.r_[np.ones(7), np.nan]),
            "row 7 has nan; margins are finite",
        ),
        (lambda: regional(DRAWN, np.ones(8)), "8 rows and 8 that pass"),
        (lambda: regional(DRAWN, np.ones(3)), "each of 8 rows"),
    ],
)
def test_analyses_refuse_what_they_are_not_made_for(call, message):
    """The message says what to make instead."""
    with pytest.raises(nlctl.errors.ParameterError, match=message):
        call()
