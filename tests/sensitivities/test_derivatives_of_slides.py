"""Derivatives of runs that slide along conditions: closed forms, and differences of runs."""

import control as ct
import numpy as np
import pytest

import nlctl


def friction():
    """v' = a t - c sign(v)."""
    return ct.nlsys(
        lambda t, x, u, p: [p["a"] * t - p["c"] * np.sign(x[0])], None, states=1, inputs=0,
        outputs=1, name="block", params={"a": 0.1, "c": 1.0},
    )  # fmt: skip


def test_dry_friction_forgets_while_it_rests():
    """Behind the release at t = c / a = 10: v = a (t^2 - 100) / 2 - c (t - 10)."""
    times = np.linspace(0, 15, 16)
    by = nlctl.sensitivity_response(
        friction(), times, 0, 1.0, with_respect_to=["a", "c", "block.x[0](0)"]
    )
    assert not by.missing
    assert by.statistics.slides == ("sign of block 'block'",)
    slope = np.array([times**2 / 2, -times, np.ones_like(times)])  # until it rests at 1.056
    slope[:, times > 1.06] = 0.0
    late = times >= 10
    slope[0, late], slope[1, late] = (times[late] ** 2 - 100) / 2, -(times[late] - 10)
    assert by.derivatives[0] == pytest.approx(slope, abs=1e-7)


def test_friction_is_found_from_data():
    times = np.linspace(0, 15, 61)
    rests = 10 - np.sqrt(80)
    v = np.where(times < rests, 1 + times**2 / 20 - times, 0.0)
    v = np.where(times > 10, (times - 10) ** 2 / 20, v)
    fit = nlctl.fit(friction(), times, {"y[0]": v}, {"c": (1.3, 0.5, 2.0)}, initial_state=1.0)
    assert fit.values[0] == pytest.approx(1.0, abs=1e-6)


def test_two_masses_with_friction_have_the_slopes_of_differences():
    def update(t, x, u, params):
        x1, v1, x2, v2 = x
        between, ground = params["f1"] * np.sign(v1 - v2), params["f2"] * np.sign(v2)
        force = params["g"] * np.sin(t) - 3 * (x1 - x2)
        return [v1, force - between, v2, (between - ground + 3 * (x1 - x2)) / 2]

    masses = ct.nlsys(update, None, states=4, inputs=0, outputs=4, name="masses",
                      params={"f1": 0.8, "f2": 0.5, "g": 2.0})  # fmt: skip
    times, start, names = np.linspace(0, 6, 13), [0.1, 0.0, 0.0, 0.0], ["f1", "f2", "g"]
    loop = nlctl.compile(masses)
    by = nlctl.sensitivity_response(loop, times, 0, start, with_respect_to=names)
    assert not by.missing
    for j, name in enumerate(names):
        value, h = masses.params[name], 1e-5
        ends = [
            nlctl.input_output_response(loop, times, 0, start, params={name: value + k * h}).states
            for k in (-1, 1)
        ]
        assert by.derivatives[:, j] == pytest.approx((ends[1] - ends[0]) / (2 * h), abs=2e-5)


@pytest.mark.parametrize(
    ("name", "steps"),
    [
        ("floor", lambda x: np.floor(2 * x) / 2), ("//", lambda x: x // 0.5 / 2),
        ("%", lambda x: x - x % 0.5),
    ],
)  # fmt: skip
def test_levels_that_are_passed_and_one_along_which_it_slides(name, steps):
    """x' = a - y, z' = y with y = floor(2 x) / 2: it passes 1/2, and stays at 1 with y = a."""

    def update(t, x, u, params):
        y = steps(x[0])
        return [params["a"] - y, y]

    a = 0.8
    loop = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="loop", params={"a": a})
    times = np.array([0.0, 0.5, 1.5, 2.0, 4.0])
    by = nlctl.sensitivity_response(
        loop, times, of=["y[0]", "y[1]"], with_respect_to=["a"], rtol=1e-9, atol=1e-11
    )
    first, second = 0.5 / a, 0.5 / a + 0.5 / (a - 0.5)
    later = -0.5 / a**2, -0.5 / a**2 - 0.5 / (a - 0.5) ** 2  # their derivatives by a
    between, slides = (times > first) & (times < second), times > second
    x = np.where(between, times - first - (a - 0.5) * later[0], np.where(slides, 0.0, times))
    z = np.where(between, -0.5 * later[0], 0.0)
    z = np.where(slides, 0.5 * (later[1] - later[0]) + times - second - a * later[1], z)
    assert by.derivatives[:, 0] == pytest.approx(np.array([x, z]), abs=1e-7)
    assert by.statistics.slides == (f"{name} of block 'loop'",)


def test_masses_whose_friction_forces_are_not_all_determined():
    """Two masses at rest on the ground and on each other, 3 signs: the first leaves at (F + R) / k.

    Together they come to rest where (v1 + v2)' = k t - 2 F has taken 0.6 away.
    """

    def update(t, x, u, p):
        v = x[2:]
        between = p["R"] * np.sign(v[1] - v[0])
        return np.concatenate(
            [v, np.array([p["k"] * t + between, -between]) - p["F"] * np.sign(v)]
        )  # fmt: skip

    loop = ct.nlsys(
        update, None, states=4, inputs=0, outputs=4, name="masses",
        params={"F": 0.3, "R": 0.15, "k": 0.1},
    )  # fmt: skip
    times = np.linspace(0, 10, 6)
    by = nlctl.sensitivity_response(
        loop, times, 0, [0, 0, 0.3, 0.3], of=["y[0]", "y[1]"], with_respect_to=["F", "R", "k"],
        rtol=1e-10, atol=1e-13,
    )  # fmt: skip
    assert not by.missing
    stop = (0.3 - np.sqrt(0.06)) / 0.05
    since, leaves = np.minimum(times, stop), np.maximum(times - 4.5, 0.0)
    # x = 0.3 s - F s^2 / 2 + k s^3 / 12 with v(s) = 0, and k (t - (F + R) / k)^3 / 6
    together = np.array([-(since**2) / 2, np.zeros_like(times), since**3 / 12])
    alone = np.array([-(leaves**2) / 2, -(leaves**2) / 2, leaves**3 / 6 + 4.5 * leaves**2 / 2])
    assert by.derivatives[0] == pytest.approx(together + alone, abs=1e-6)
    assert by.derivatives[1] == pytest.approx(together, abs=1e-6)


def test_there_is_no_derivative_behind_one_of_several_ways():
    """x' = -(a - t) sign(x) slides until t = a, where both sides begin to lead away."""
    loop = ct.nlsys(
        lambda t, x, u, p: [-np.sign(x[0]) * (p["a"] - t)], None, states=1, inputs=0, outputs=1,
        name="loop", params={"a": 1.0},
    )  # fmt: skip
    by = nlctl.sensitivity_response(loop, [0, 0.5, 0.9, 1.5, 2], 0, 0.2, with_respect_to=["a"])
    (lack,) = by.missing
    assert lack.time == pytest.approx(1.0, abs=1e-6)
    assert "several ways" in lack.why
    assert np.isfinite(by.derivatives[0, 0, :3]).all()
    assert np.isnan(by.derivatives[0, 0, 3:]).all()


def of_two_levels(t, x, u, params):
    pushed = -3.0 if 1 < t < 2 else 0.0
    return [pushed - np.sign(x[0] ** 2 - params["a"]) * np.sign(x[0])]


@pytest.mark.parametrize("rtol", [1e-7, 1e-8, 1e-9, 1e-10])
def test_levels_of_a_product_move_with_what_says_where_they_are(rtol):
    """At rest at sqrt(a), then pushed to -sqrt(a): +-1 / (2 sqrt(a)); and on the way."""
    block = ct.nlsys(of_two_levels, None, states=1, inputs=0, outputs=1, name="block",
                     params={"a": 0.25})  # fmt: skip
    times = np.array([0, 0.4, 0.8, 1.1, 1.6, 5.0])
    by = nlctl.sensitivity_response(
        block, times, 0, 1.0, with_respect_to=["a"], rtol=rtol, atol=rtol
    )
    assert not by.missing
    # it passes 0 with -2 before and -4 behind, and -sqrt(a), which moves by -1, with -4 and -2
    past_zero = 1.0 * 4 / 2
    past_level = -1.0 + (past_zero + 1.0) * 2 / 4
    assert by.derivatives[0, 0] == pytest.approx([0, 0, 1, 1, past_level, -1], abs=1e-6)


def to_a_level(t, x, u, params):
    return [-np.sign(x[0] - params["p"])]


def to_a_level_of_a_square(t, x, u, params):
    return [-np.sign(x[0] ** 2 - params["p"] ** 2)]


def to_a_level_ever_faster(t, x, u, params):
    return [-2 * np.sign(x[0] - params["p"]) * (1 + np.sin(t) / 2)]


def until_it_is_not_above(t, x, u, params):
    return [-1.0 if x[0] > params["p"] else 0.0]


def by_steps_at_half(t, x, u, params):
    return [0.5 - np.heaviside(x[0] - params["p"], 0.5)]


@pytest.mark.parametrize("p", [0.25, 0.3, 0.5])
@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9, 1e-11])
@pytest.mark.parametrize(
    "update",
    [
        to_a_level, to_a_level_of_a_square, to_a_level_ever_faster, until_it_is_not_above,
        by_steps_at_half,
    ],
)  # fmt: skip
def test_rest_at_a_level_moves_with_the_level(update, p, rtol):
    """Whether it slides there, or rests because sign(0) = 0 to the last digit: 1."""
    block = ct.nlsys(update, None, states=1, inputs=0, outputs=1, name="block", params={"p": p})
    by = nlctl.sensitivity_response(
        block, [0, 0.2, 4.0, 5.0], 0, 1.0, with_respect_to=["p"], rtol=rtol, atol=rtol
    )
    assert by.derivatives[0, 0] == pytest.approx([0, 0, 1, 1], abs=1e-6 + 10 * rtol)
    assert not by.missing


def held_until_it_is_pushed(t, x, u, params):
    return [(2.0 if 2 < t < 2.5 else 0.0) - np.sign(x[0] - params["p"])]


@pytest.mark.parametrize("p", [0.25, 0.3, 0.5])
@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9])
def test_rest_between_two_samples_counts(p, rtol):
    """It comes to p at 1 - p, is pushed by 1 for half a second and comes back."""
    block = ct.nlsys(held_until_it_is_pushed, None, states=1, inputs=0, outputs=1, name="block",
                     params={"p": p})  # fmt: skip
    by = nlctl.sensitivity_response(
        block, [0, 0.2, 2.4, 5.0], 0, 1.0, with_respect_to=["p"], rtol=rtol, atol=rtol
    )
    assert by.derivatives[0, 0] == pytest.approx([0, 0, 1, 1], abs=1e-6 + 10 * rtol)


def driven_at_a_level(t, x, u, params):
    return [0.3 * np.sin(t) - np.sign(x[0] - params["p"]), params["q"] * x[0]]


@pytest.mark.parametrize("off", [0.0, 1e-9, -1e-12])
def test_a_run_that_slides_from_its_start_has_none_by_what_moves_the_level(off):
    """Moved by whatever little it starts on a side; by q, which moves nothing there, it has one."""
    block = ct.nlsys(driven_at_a_level, None, states=2, inputs=0, outputs=2, name="block",
                     params={"p": 0.25, "q": 1.0})  # fmt: skip
    by = nlctl.sensitivity_response(
        block, [0, 1.0, 2.0], 0, [0.25 + off, 0.0], with_respect_to=["p", "q", "block.x[0](0)"]
    )
    assert np.isnan(by.derivatives[:, [0, 2], 1:]).all()
    assert "starts on a condition" in str(by)
    assert by.derivatives[:, 1] == pytest.approx(np.array([[0, 0, 0], [0, 0.25, 0.5]]), abs=1e-6)
