"""Runs along conditions of plain functions, against closed forms and smoothed equations."""

import math

import control as ct
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nlctl

methods = pytest.mark.parametrize("method", [None, "tsit5", "rodas5p", "taylor"])


def plain(update, states, output=None, inputs=0, **more):
    """A system of one block."""
    return ct.nlsys(
        update, output, states=states, inputs=inputs, outputs=1 if output else states, name="plant",
        **more,
    )  # fmt: skip


def from_both_sides(t, x, u, params):
    return [-1.0 if x[0] > 0.5 else 1.0]


def by_truth_value(t, x, u, params):
    return [1.0 - 2.0 * (x[0] >= 0.5)]


def by_sign(t, x, u, params):
    return [np.sign(0.5 - x[0])]


def by_choice(t, x, u, params):
    return np.where(x < 0.5, 1.0, -1.0)


def within_a_band(t, x, u, params):
    return [1.0 if abs(x[0] + 0.1) <= 0.6 else -1.0]


def by_heaviside(t, x, u, params):
    return 1.0 - 2.0 * np.heaviside(x - 0.5, 0.5)


@pytest.mark.parted
@methods
@pytest.mark.parametrize(
    "update",
    [from_both_sides, by_truth_value, by_sign, by_choice, within_a_band, by_heaviside],
)  # fmt: skip
def test_a_run_stays_where_both_sides_lead_back(update, method):
    """x' = 1 below 1/2 and -1 above: x = min(t, 1/2)."""
    times = np.linspace(0, 2, 41)
    run = nlctl.input_output_response(plain(update, 1), times, 0, 0.0, method=method)
    assert run.states[0] == pytest.approx(np.minimum(times, 0.5), abs=1e-9)
    # sign and heaviside have the mean where they are asked at 1/2 itself
    assert len(run.statistics.slides) == 1 or update in (by_sign, by_heaviside)
    assert ("slides   along" in str(run)) == bool(run.statistics.slides)
    assert run.events["time"].to_numpy() == pytest.approx([0.5], abs=1e-6)  # once
    assert run.events["direction"].item() in ("rising", "falling")


def test_without_sliding_it_ends_with_the_reason():
    with pytest.raises(nlctl.errors.ChatteringError) as ended:
        nlctl.input_output_response(plain(from_both_sides, 1), [0, 2.0], 0, 0.0, slide=False)
    assert ended.value.time == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parted
@methods
def test_dry_friction_holds_until_it_is_overcome(method):
    """v' = t / 10 - sign(v) from 1: rests after 10 - sqrt(80) s, and breaks away after 10 s."""
    times = np.linspace(0, 15, 61)
    friction = plain(lambda t, x, u, p: [0.1 * t - np.sign(x[0])], 1)
    run = nlctl.input_output_response(friction, times, 0, 1.0, method=method)
    rests = 10 - np.sqrt(80)
    v = np.where(times < rests, 1 + times**2 / 20 - times, 0.0)
    v = np.where(times > 10, (times - 10) ** 2 / 20, v)
    assert run.states[0] == pytest.approx(v, abs=1e-6)
    events = run.events[run.events.which.str.startswith("sign")]
    assert events.time.iloc[0] == pytest.approx(rests, abs=1e-6)
    released = events[events.which == "sign: end of sliding"]
    assert released.time.to_numpy() == pytest.approx([10.0], abs=1e-6)


@methods
def test_a_surface_that_moves_is_followed(method):
    """x' = -5 sign(x - sin 3t): once it is met, x is what moves."""
    times = np.linspace(0, 4, 41)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: -5 * np.sign(x - np.sin(3 * t)), 1), times, 0, 1.0, method=method
    )
    met = times > 0.2
    assert run.states[0, met] == pytest.approx(np.sin(3 * times[met]), abs=1e-6)


def test_rates_are_filippovs_mean():
    """(-2, 3/2) where x > y and (2, -3) where y > x: 5/8.5 of the time there, on x = y."""

    def update(t, x, u, params):
        return [-2.0 if x[0] > x[1] else 2.0, -3.0 if x[1] > x[0] else 1.5]

    times = np.linspace(0, 1, 21)
    run = nlctl.input_output_response(plain(update, 2), times, 0, [1.5, 1.0])
    meets = times > 1 / 7
    expected = 1.5 - 2 / 7 + (2 - 4 * 5 / 8.5) * (times[meets] - 1 / 7)
    assert run.states[:, meets] == pytest.approx(np.array([expected, expected]), abs=1e-8)


def test_outputs_are_the_same_mean():
    """x' = 1/2 - v with v = sign(x): while x rests, v is 1/2."""
    loop = plain(
        lambda t, x, u, p: 0.5 - np.sign(x), 1, lambda t, x, u, p: 3 + np.sign(x[0]) * (2 + x[0])
    )
    run = nlctl.input_output_response(loop, [0, 1.0, 3.0, 4.0], 0, 1.0)
    assert run.outputs.ravel() == pytest.approx([6.0, 5.5, 4.0, 4.0], abs=1e-6)


def test_integrators_that_wait_at_a_limit_slide_along_it():
    """2 e + I rests at 1.2 while e I' alone would lead beyond: x' = 1.2 - x there."""

    def update(t, x, u, params):
        e = 1.0 - x[0]
        asked = 2 * e + x[1]
        given = np.clip(asked, -1.2, 1.2)
        return [given - x[0], 3 * e if asked == given or e * asked < 0 else 0.0]

    times = np.linspace(0, 4, 401)
    run = nlctl.input_output_response(plain(update, 2), times, 0, [0.0, 0.0])
    x, integral = run.states
    begin = np.log(1.5)  # 2 (1 - x) = 1.2 at x = 0.4 = 1.2 (1 - exp(-t))
    end = np.log(2.0)  # 3 e = -(2 e)' = 2 (1.2 - x) at x = 0.6
    slides = (times > begin) & (times < end)
    assert x[slides] == pytest.approx(1.2 * (1 - np.exp(-times[slides])), abs=1e-7)
    assert (2 * (1 - x) + integral)[slides] == pytest.approx(1.2, abs=1e-7)
    linear = times > 1.0  # x' = 2 - 3 x + I, I' = 3 (1 - x): within the limits
    A, b = np.array([[-3.0, 1.0], [-3.0, 0.0]]), np.array([2.0, 3.0])
    k = np.flatnonzero(linear)[0]
    q = solve_ivp(lambda t, z: A @ z + b, (times[k], 4), run.states[:, k], t_eval=times[k:],
                  rtol=1e-10, atol=1e-12)  # fmt: skip
    assert run.states[:, k:] == pytest.approx(q.y, abs=1e-7)


def test_two_conditions_slide_one_after_the_other_and_together():
    """x' = -sign(x), y' = -2 sign(y): |x| = 1 - t, |y| = max(3 - 2 t, 0)."""
    times = np.linspace(0, 3, 31)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [-np.sign(x[0]), -2 * np.sign(x[1])], 2), times, 0, [1.0, -3.0]
    )
    expected = [np.maximum(1 - times, 0), -np.maximum(3 - 2 * times, 0)]
    assert run.states == pytest.approx(np.array(expected), abs=1e-8)
    assert len(run.statistics.slides) == 2


def test_two_masses_with_friction_between_them():
    """Each friction acts on what the other one compares: against signs over a width of 1e-7."""

    def flow(sign):
        def update(t, x, u=0, params=0):
            x1, v1, x2, v2 = x
            between, ground = 0.8 * sign(v1 - v2), 0.5 * sign(v2)
            force = 2 * np.sin(t) - 3 * (x1 - x2)
            return [v1, force - between, v2, (between - ground + 3 * (x1 - x2)) / 2]

        return update

    times, start = np.linspace(0, 10, 41), [0.1, 0.0, 0.0, 0.0]
    run = nlctl.input_output_response(plain(flow(np.sign), 4), times, 0, start)
    smooth = solve_ivp(flow(lambda s: np.clip(s / 1e-7, -1, 1)), (0, 10), start, method="Radau",
                       t_eval=times, rtol=1e-8, atol=1e-11)  # fmt: skip
    assert run.states == pytest.approx(smooth.y, abs=3e-6)
    assert len(run.statistics.slides) == 2


def test_an_input_drives_it_along():
    """v' = u - sign(v) rests while |u| <= 1, u being linear between its samples."""
    times = np.linspace(0, 8, 81)
    u = np.interp(times, [0, 4, 8], [0.0, 2.0, -2.0])
    loop = plain(lambda t, x, u, p: u[0] - np.sign(x[0]), 1, lambda t, x, u, p: x[0], inputs=1)
    run = nlctl.input_output_response(loop, times, u, 0.0)
    exact = solve_ivp(
        lambda t, v: np.interp(t, times, u) - np.clip(v / 1e-7, -1, 1), (0, 8), [0.0],
        method="Radau", t_eval=times, rtol=1e-9, atol=1e-11, max_step=0.05,
    )  # fmt: skip
    assert run.outputs == pytest.approx(exact.y[0], abs=1e-6)


@pytest.mark.parted
@pytest.mark.parametrize("seed", [1, 2, 7, 11])
def test_linear_loops_with_a_sign_are_limits_of_smooth_ones(seed):
    """Signs over a width of 1e-6, by SciPy's stiff method."""
    rng = np.random.default_rng(seed)
    A, b, c = rng.normal(size=(3, 3)) - np.eye(3), 2 * rng.normal(size=3), rng.normal(size=3)
    wave, start = rng.uniform(0.5, 3.0), rng.normal(size=3)

    def flow(sign):
        return lambda t, x, u=0, p=0: A @ x + b * sign(c @ x + 0.5 * np.sin(wave * t))

    times = np.linspace(0, 4, 21)
    run = nlctl.input_output_response(plain(flow(np.sign), 3), times, 0, start)
    smooth = solve_ivp(flow(lambda s: np.clip(s / 1e-6, -1, 1)), (0, 4), start, method="Radau",
                       t_eval=times, rtol=1e-8, atol=1e-10)  # fmt: skip
    assert run.states == pytest.approx(smooth.y, rel=2e-5, abs=2e-5)


def test_a_relay_of_ones_own_slides_as_the_block_does():
    """x'' = u - d in sliding mode on x + x' / 2 = 0, by a function and by nlctl.IdealRelay."""
    plant = ct.nlsys(
        lambda t, x, u, p: [x[1], u[0] - np.sin(t)], lambda t, x, u, p: [x[0] + 0.5 * x[1]],
        states=2, inputs=["v"], outputs=["s"], name="plant",
    )  # fmt: skip
    own = ct.nlsys(
        None, lambda t, x, u, p: -2 * np.sign(u[0]), inputs=["s"], outputs=["v"], name="law"
    )
    gain = ct.ss([], [], [], -1.0, inputs=["w"], outputs=["v"], name="gain")
    block = nlctl.block(nlctl.IdealRelay(height=2.0), "law", inputs=["s"], outputs=["w"])
    times, start = np.linspace(0, 5, 51), {"plant.x[0]": 0.5}
    first, second = (
        nlctl.input_output_response(
            nlctl.interconnect(blocks, outputs=["s", "v"]), times, 0, start
        ).outputs
        for blocks in ([plant, own], [plant, block, gain])
    )
    assert first == pytest.approx(second, abs=1e-6)


def test_members_of_an_ensemble_slide_as_they_do_alone():
    block = ct.nlsys(
        lambda t, x, u, p: p["c"] - np.sign(x), lambda t, x, u, p: x, states=1, outputs=["x"],
        inputs=0, name="block", params={"c": 0.5},
    )  # fmt: skip
    times, c, loop = np.linspace(0, 4, 41), np.linspace(-1.5, 1.5, 9), nlctl.compile(block)
    ensemble = nlctl.ensemble_response(loop, times, 0, {"x[0]": 1.0}, params={"c": c}, keep=["x"])
    assert (ensemble.table.status == "OK").all()
    for k, value in enumerate(c):
        alone = nlctl.input_output_response(loop, times, 0, 1.0, params={"c": value})
        assert ensemble.signals["x"][k] == pytest.approx(alone.outputs.ravel(), abs=1e-8)
        assert alone.statistics.slides or abs(value) > 0.7  # at 0 after 4 s or more


def test_event_functions_see_the_states_of_the_diagram():
    seen = []

    def height(t, x, u, params):
        seen.append(len(x))
        return x[0] - 0.25 + 0 * x[-1]

    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [1.0, -np.sign(x[1] - 0.1)], 2), [0, 2.0], 0, [0.0, 1.0],
        events={"height": height},
    )  # fmt: skip
    assert run.events[run.events.which == "height"].time.to_numpy() == pytest.approx([0.25])
    assert run.states.shape == (2, 2)
    assert set(seen) == {2}


@pytest.mark.parametrize(
    "update",
    [
        lambda t, x, u, p: [x[1], -np.sign(x[0] + x[1] * abs(x[1]) / 2)],  # both rates vanish
    ],
    ids=["time optimal"],
)
def test_other_jumps_end_with_the_reason(update):
    with pytest.raises(nlctl.errors.ChatteringError):
        nlctl.input_output_response(plain(update, 2), [0, 4.0], 0, [1.3, 0.0])


def rounded_down(z):
    return math.floor(z)


@pytest.mark.parted
@pytest.mark.parametrize(
    ("steps", "first"),
    [
        (lambda x: np.floor(4 * x) / 4, 0.25), (lambda x: np.trunc(4 * x) / 4, 0.25),
        (lambda x: np.ceil(4 * x) / 4 - 0.25, 0.25), (lambda x: int(4 * x) / 4, 0.25),
        (lambda x: rounded_down(4 * x) / 4, 0.25), (lambda x: round(4 * x) / 4, 0.125),
        (lambda x: x // 0.25 * 0.25, 0.25), (lambda x: x - x % 0.25, 0.25),
        (lambda x: np.floor_divide(x, 0.25) / 4, 0.25), (lambda x: x - np.fmod(x, 0.25), 0.25),
        (lambda x: divmod(x, 0.25)[0] / 4, 0.25), (lambda x: -(-x // 0.25) / 4 - 0.25, 0.25),
        (lambda x: np.rint(4 * x) / 4, 0.125), (lambda x: np.round(x * 1.6, 1) / 1.6, 0.03125),
    ],
)  # fmt: skip
def test_a_run_slides_along_steps(steps, first):
    """x' = 1/3 - steps(x) from 0: it passes a level with what is left, and stays at the next."""
    step = 0.25 if first > 0.1 else 0.0625
    rates = 1 / 3 - step * np.arange(int(1 / 3 / step) + 1)
    levels = first + step * np.arange(rates.size)
    meets = np.cumsum(np.diff(levels, prepend=0.0) / rates)
    times = np.array([0.0, *meets[:-1], 2 * meets[-1]])
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [1 / 3 - steps(x[0])], 1), times, 0, 0.0
    )
    assert run.states[0] == pytest.approx([0.0, *levels], abs=1e-8)
    assert len(run.statistics.slides) == 1
    events = run.events[run.events["time"] > 0]  # floor is at a level where it begins
    jumps = events[~events["which"].str.contains("end")]
    assert jumps["time"].to_numpy() == pytest.approx(meets, abs=1e-6)


def test_a_level_is_left_where_the_next_one_is_called_for():
    """x' = 0.35 t - 0.5 n with n = floor(2 x + 1/2): it slides once, and passes all others."""
    rate = 0.35
    times = np.linspace(0, 10, 41)
    meets = np.sqrt(0.5 / rate)  # x = 1/4 = rate t^2 / 2
    expected = np.where(times < meets, rate / 2 * times**2, 0.25)
    level, left = 0.25, 0.5 / rate  # where x' = 0 with n = 1
    pieces = [(left, level, 1)]
    while pieces[-1][0] < 10:
        begin, level, n = pieces[-1]
        slope = rate * begin - 0.5 * n
        pieces.append(
            (begin + (np.sqrt(slope**2 + rate) - slope) / rate, level + 0.5, n + 1)
        )  # fmt: skip
    for begin, level, n in pieces:
        since = np.maximum(times - begin, 0.0)
        x = level + (rate * begin - 0.5 * n) * since + rate / 2 * since**2
        expected = np.where(times >= begin, x, expected)
    run = nlctl.input_output_response(
        plain(lambda t, x, u, p: [rate * t - 0.5 * np.floor(2 * x[0] + 0.5)], 1), times, 0, 0.0,
        rtol=1e-9, atol=1e-12,
    )  # fmt: skip
    assert run.states[0] == pytest.approx(expected, abs=1e-9)
    assert run.events["time"].to_numpy() == pytest.approx(
        [meets, left, *(begin for begin, _, _ in pieces[1:-1])], abs=1e-7
    )


def test_elements_of_an_array_slide_one_by_one():
    """v' = c - sign(v), 12 of them: each rests once v0 / (1 - c) s are over, and 3 never do."""
    c, start = np.linspace(-0.6, 1.3, 12), np.linspace(0.4, 2.0, 12)
    times = np.linspace(0, 6, 31)
    run = nlctl.input_output_response(plain(lambda t, x, u, p: c - np.sign(x), 12), times, 0, start)
    v = start[:, None] + (c - 1)[:, None] * times
    assert run.states == pytest.approx(np.where(c[:, None] < 1, np.maximum(v, 0), v), abs=1e-8)
    rests = (c < 1) & (start / (1 - c) < 6)
    assert len(run.statistics.slides) == rests.sum()  # others are not said to slide
    assert f"along {len(run.statistics.slides)} x sign of block 'plant'" in str(run)


def friction(law, held):
    """A mass of 1 kg that a force pushes, with a law of friction."""
    mass = ct.nlsys(
        lambda t, x, u, p: [held - u[0]], lambda t, x, u, p: x[0], states=1, inputs=["force"],
        outputs=["velocity"], name="mass",
    )  # fmt: skip
    return nlctl.interconnect({"friction": nlctl.block(law, "friction"), "mass": mass})


@pytest.mark.parametrize(
    "law",
    [
        nlctl.actuators.Coulomb(F_c=1.0, sigma_2=0.0),
        nlctl.actuators.Stribeck(F_c=1.0, F_s=1.0, sigma_2=0.0),
    ],
    ids=["Coulomb", "Stribeck"],
)
def test_what_blocks_declare_slides_as_well(law):
    """v' = 1/2 - F from 1: at rest after 2 s."""
    times = np.linspace(0, 5, 21)
    run = nlctl.input_output_response(friction(law, 0.5), times, 0, [1.0])
    assert run.states[0] == pytest.approx(np.maximum(1 - times / 2, 0), abs=1e-8)
    assert run.statistics.slides == ("sign of block 'friction'",)


def test_what_stands_in_a_diagram_within_another_slides():
    inner = nlctl.interconnect(
        {"friction": nlctl.block(nlctl.actuators.Coulomb(F_c=1.0, sigma_2=0.0), "friction")},
        inputs=["velocity"], outputs=["force"], name="contact",
    )  # fmt: skip
    mass = ct.nlsys(
        lambda t, x, u, p: [0.5 - u[0]], lambda t, x, u, p: x[0], states=1, inputs=["force"],
        outputs=["velocity"], name="mass",
    )  # fmt: skip
    times = np.linspace(0, 5, 21)
    run = nlctl.input_output_response(nlctl.interconnect([inner, mass]), times, 0, [1.0])
    assert run.states[0] == pytest.approx(np.maximum(1 - times / 2, 0), abs=1e-8)
    assert run.statistics.slides == ("sign of block 'contact.friction'",)


def test_a_product_compares_otherwise_behind_a_zero_of_its_other_factor():
    """x rests at 0 from 1/2 s on, above it for 0.6 of the time: x (y - 1) > 0 for 0.4, then 0.6."""

    def update(t, x, u, params):
        across = 1.0 if x[0] * (x[1] - 1.0) > 0 else 0.0
        return [0.2 - np.sign(x[0]), 1.0, across + (2.0 if x[1] > 1.0 else 0.0)]

    run = nlctl.input_output_response(plain(update, 3), [0, 1, 3], 0, [0.4, -0.5, 0.0])
    assert run.states[0] == pytest.approx([0.4, 0.0, 0.0], abs=1e-8)
    assert run.states[2] == pytest.approx([0.0, 0.2, 0.4 + 1.5 * 2.6], abs=1e-7)  # y = 1 at 3/2 s


def test_what_shares_a_factor_and_does_not_change_stays_as_it_is():
    """x' = 1/5 - sign(x / (z + 2)) rests at 0; y' = y / (z + 2) up to -1 moves meanwhile."""

    def update(t, x, u, params):
        return [0.2 - np.sign(x[0] / (x[2] + 2)), np.clip(x[1] / (x[2] + 2), -1, 1), 0.0]

    meets = 2 * np.log(2)  # y = -exp(t / 2) = -2
    times = np.array([0.0, 0.5, 1.0, meets, 3.0])
    run = nlctl.input_output_response(plain(update, 3), times, 0, [0.4, -1.0, 0.0])
    assert run.states[0] == pytest.approx([0.4, 0, 0, 0, 0], abs=1e-8)
    expected = np.where(times < meets, -np.exp(times / 2), -2 - (times - meets))
    assert run.states[1] == pytest.approx(expected, abs=1e-7)


def test_an_inverse_slides():
    """x' = 1/10 - v with v = x + 1/2 above 0, and x - 1/2 below: it comes to 0, and stays."""
    inverse = nlctl.actuators.DeadZoneInverse(slope_r=1.0, slope_l=1.0, b_r=0.5, b_l=-0.5)
    (wanted,), (v,) = inverse.inputs, inverse.outputs
    lag = ct.nlsys(
        lambda t, x, u, p: [0.1 - u[0]], lambda t, x, u, p: x[0], states=1, inputs=[v],
        outputs=[wanted], name="lag",
    )  # fmt: skip
    loop = nlctl.interconnect({"inverse": nlctl.block(inverse, "inverse"), "lag": lag})
    times = np.linspace(0, 4, 21)
    run = nlctl.input_output_response(loop, times, 0, [1.0])
    assert run.states[0] == pytest.approx(np.maximum(1.4 * np.exp(-times) - 0.4, 0), abs=1e-7)


@pytest.mark.slow
def test_the_paper_s_loop_slides_along_the_levels_of_a_quantiser():
    """As with ramps of a thousandth of a step instead of jumps, to about that."""
    times, width = np.linspace(0, 20, 41), 1e-4

    def ramps(t, x, u, params):
        z = u[0] / 0.5 + 0.5
        n = np.floor(z + 0.5)
        return 0.5 * (n - 0.5 + 0.5 * np.clip((z - n) / width, -1, 1))

    smooth = ct.nlsys(None, ramps, inputs=["u"], outputs=["v"], name="actuator")
    run = nlctl.input_output_response(nlctl.paper.example_1(actuator=nlctl.Quantiser(q=0.5)), times)
    expected = nlctl.input_output_response(nlctl.paper.example_1(actuator=smooth), times)
    assert run.statistics.slides == ("floor of block 'actuator'",)
    assert run.outputs[0] == pytest.approx(expected.outputs[0], abs=2e-3)


def test_slide_is_a_truth_value():
    with pytest.raises(nlctl.errors.ParameterError, match="slide must be True or False, got 'no'"):
        nlctl.input_output_response(plain(from_both_sides, 1), [0, 2.0], 0, 0.0, slide="no")


def test_a_fixed_step_has_an_end_as_well():
    """Each step would end at the condition: it was as many as there are numbers in between."""
    times = np.linspace(0, 2, 9)
    run = nlctl.input_output_response(plain(from_both_sides, 1), times, 0, 0.0, step=0.01)
    assert run.states[0] == pytest.approx(np.minimum(times, 0.5), abs=1e-9)
    with pytest.raises(nlctl.errors.ChatteringError):
        nlctl.input_output_response(
            plain(from_both_sides, 1), times, 0, 0.0, step=0.01, slide=False
        )
