"""Switches that come ever closer together: each engine integrates them, or ends with a reason."""

import re

import control as ct
import numpy as np
import pytest

import nlctl

engines = pytest.mark.parametrize("engine", ["python-control", "native"])


def own(update, states):
    """A user's own function, not a block of nlctl."""
    return ct.nlsys(update, None, states=states, inputs=0, outputs=states, name="own")


def lagged(T):
    """x' = w, T w' = -sign(x) - w."""
    return own(lambda t, x, u, p: [x[1], -(np.sign(x[0]) + x[1]) / T], 2)


def diagram(*lags):
    """An integrator behind a sign, with lags between them."""
    sign = ct.nlsys(None, lambda t, x, u, p: -np.sign(u), inputs=["u"], outputs=["v0"], name="sign")
    integrator = ct.ss(0, 1, 1, 0, inputs=f"v{len(lags)}", outputs="u", name="plant")
    blocks = {"sign": sign, "plant": integrator}
    for k, T in enumerate(lags):
        blocks[f"lag{k}"] = ct.ss(-1 / T, 1 / T, 1, 0, inputs=f"v{k}", outputs=f"v{k + 1}",
                                  name=f"lag{k}")  # fmt: skip
    return nlctl.interconnect(blocks, outputs=["u"])


@pytest.mark.parted
@pytest.mark.parametrize(
    ("system", "block", "start", "engine"),
    [
        (lagged(1e-3), "own", [1.0, 0.0], "native"),
        pytest.param(lagged(1e-3), "own", [1.0, 0.0], "python-control", marks=pytest.mark.slow),
        (diagram(0.05), "sign", {"plant.x[0]": 1.0}, "native"),
        pytest.param(
            diagram(0.05), "sign", {"plant.x[0]": 1.0}, "python-control", marks=pytest.mark.weekly
        ),
        pytest.param(lagged(0.05), "own", [1.0, 0.0], "native", marks=pytest.mark.weekly),
        pytest.param(lagged(0.05), "own", [1.0, 0.0], "python-control", marks=pytest.mark.weekly),
    ],
)
def test_a_sign_behind_a_lag_ends_with_the_reason(system, block, start, engine):
    """From switch to switch they come faster as 1 / n: as exp(t), without a finite end."""
    words = rf"switches of block '{block}' \(sign\) accumulate ever faster.*second-order sliding"
    with pytest.raises(nlctl.errors.ChatteringError, match=words) as ended:
        nlctl.input_output_response(system, [0, 30.0], 0, start, engine=engine, slide=False)
    assert 1.0 < ended.value.time < 2.5


@engines
def test_rates_that_lead_back_at_once_are_not_said_to_be_of_second_order(engine):
    """x'' = -2 where x' > 1.2, and below -x, which is 0.2 there."""

    def flow(t, x, u, params):
        near = [-4.0 * x[0], 2.0 - x[0], -2.0]
        return [x[1], np.select([x[0] > 1.0, x[0] < -0.5, x[1] > 1.2], near, -x[0])]

    slides = own(flow, 2)
    with pytest.raises(nlctl.errors.ChatteringError) as ended:
        nlctl.input_output_response(slides, [0, 8.0], 0, [0.0, 1.5], engine=engine, slide=False)
    assert "second-order" not in str(ended.value)


@pytest.mark.weekly
@engines
def test_twisting_ends_near_the_time_of_its_last_switch(engine):
    """x'' = -3 sign(x) - sign(x'): half a turn takes 1.5 sqrt(|x|), and halves |x|."""
    twisting = own(lambda t, x, u, p: [x[1], -3 * np.sign(x[0]) - np.sign(x[1])], 2)
    limit = 1.5 / (1 - np.sqrt(0.5))
    with pytest.raises(nlctl.errors.ChatteringError) as ended:
        nlctl.input_output_response(twisting, [0, 30.0], 0, [1.0, 0.0], engine=engine, slide=False)
    near = re.search(r"block 'own' \(sign\) accumulate near t = ([\d.]+) s", str(ended.value))
    assert near
    assert float(near[1]) == pytest.approx(limit, abs=2e-4)
    assert ended.value.time == pytest.approx(limit, abs=1e-3)


@pytest.mark.parted
@engines
def test_a_sign_behind_two_lags_oscillates(engine):
    """1 / (s (1 + T s)^2) has the phase -pi at w = 1 / T: the period of describing functions."""
    T = 0.4
    times = np.linspace(0, 20, 801)
    made = nlctl.input_output_response(diagram(T, T), times, 0, {"plant.x[0]": 0.1}, engine=engine)
    rises = [t for t, block, _, way in made.happened if block == "sign" and way == "rising"]
    late = [t for t in rises if t > 10]
    period = (late[-1] - late[0]) / (len(late) - 1)
    assert period == pytest.approx(2 * np.pi * T, rel=0.05)


@engines
def test_the_turns_of_an_oscillator_do_not_accumulate(engine):
    """x'' = -sign(x) from 1 at rest: a period of 4 sqrt(2), eight of which go on."""
    oscillator = own(lambda t, x, u, p: [x[1], -np.sign(x[0])], 2)
    times = 4 * np.sqrt(2) * np.arange(9)
    made = nlctl.input_output_response(
        oscillator, times, 0, [1.0, 0.0], engine=engine, rtol=1e-9, atol=1e-11
    )
    np.testing.assert_allclose(made.states[0], 1.0, rtol=0, atol=1e-6)


@engines
def test_a_bounded_number_of_ever_faster_switches_is_integrated(engine):
    """cos(exp(t) - 1): it is 0 at log(1 + pi / 2 + k pi), faster and faster until the end."""
    chirp = own(lambda t, x, u, p: [np.exp(t), np.sign(np.cos(x[0]))], 2)  # x[0] is the phase
    times = np.linspace(0, np.log(1 + 20 * np.pi), 11)
    made = nlctl.input_output_response(
        chirp, times, 0, [0.0, 0.0], engine=engine, rtol=1e-9, atol=1e-11
    )
    switches = np.log1p(np.pi * (np.arange(20) + 0.5))
    ends = np.r_[0.0, switches]
    wanted = [
        sum((-1) ** k * (min(t, b) - a) for k, (a, b) in enumerate(
            zip(ends, np.r_[switches, np.inf], strict=True)) if a < t)
        for t in times
    ]  # fmt: skip
    np.testing.assert_allclose(made.states[1], wanted, rtol=0, atol=1e-7)


def test_an_ideal_relay_is_refused_by_name_where_python_control_is_asked_for():
    plant = ct.ss([[0, 1], [0, -20.0]], [[0], [-20.0]], [[1, 0]], 0, inputs="v", outputs="u",
                  name="plant")  # fmt: skip
    loop = nlctl.interconnect({"plant": plant, "relay": nlctl.IdealRelay()}, outputs=["u"])
    with pytest.raises(nlctl.errors.UsageError, match="block 'relay' is an ideal relay"):
        nlctl.input_output_response(loop, [0, 5.0], 0, {"plant.x[0]": 1}, engine="python-control")
    made = nlctl.input_output_response(loop, [0, 5.0], 0, {"plant.x[0]": 1})
    assert abs(float(np.ravel(made.outputs)[-1])) < 1e-6


def test_places_that_lie_close_together_do_not_accumulate():
    """argmin over |x - X_k| switches halfway between neighbours, the last of which are close."""
    values, places = np.array([0.0, 0.0, 5e3, 0.0, 0.0]), np.array([0.0, 1.0, 1.0002, 3.0, 4.0])
    nearest = ct.nlsys(
        lambda t, x, u, p: [1.0, values[np.argmin(np.abs(places - x[0]))]],
        lambda t, x, u, p: x[1], inputs=0, outputs=1, states=2, name="nearest",
    )  # fmt: skip
    run = nlctl.input_output_response(
        nearest, [0, 3.5], 0, [0, 0], engine="python-control", rtol=1e-6, atol=1e-8
    )
    assert run.states[1, -1] == pytest.approx(5e3 * (2.0001 - 1.0001), rel=1e-6)


methods = pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])


@methods
def test_a_run_slides_where_the_shortest_steps_are_lost_in_the_rounding_of_a_state(method):
    """Rates lead back from both sides, slowly from one: 1e-16 s of that move no last digit."""

    def flow(t, x, u, params):
        high = np.where(2 * x[1] ** 2 - 0.623 >= 0.199, np.sin(4.614 * t + 0.532), -0.978)
        places, heights = [-1.0, -0.2, 0.093, 0.7, 1.2], [0.726, -0.778, 0.476, -0.072, 0.342]
        near = np.where(x[1] >= 0.099, np.sin(4.853 * t - 0.7), 0.059)
        x2 = -2.0 * x[0] - 0.2 * x[1] + 0.819 * high + 0.257 * near
        return [x[1] + 0.885 * np.interp(x[1], places, heights), x2]

    with pytest.raises(nlctl.errors.ChatteringError) as ended:
        nlctl.input_output_response(own(flow, 2), [0, 6.0], 0, [0.6, -0.3], method=method,
                                    max_steps=20_000, rtol=1e-8, atol=1e-10,
                                    slide=False)  # fmt: skip
    assert ended.value.time == pytest.approx(0.195423, abs=1e-5)


@pytest.mark.parted
@methods
@pytest.mark.parametrize(
    ("rate", "start", "end", "slides"),
    [
        # from 16.5003 down to 16.5 at 1e-4, and held there
        (lambda t, x: np.where(x > 16.5, -1e-4, 1e-4), 16.5003, 100.0, 3.0),
        (lambda t, x: np.where(x > t, 0.5, 2.0), 1.0, 4.0, 2.0),  # x = 1 + t / 2 comes to t
        (lambda t, x: 0.5 - np.floor(x), 0.3, 4.0, 1.4),  # long steps lead far up the staircase
    ],
    ids=["slowly", "along time", "at a stair"],
)
def test_a_run_that_slides_ends_with_the_reason(method, rate, start, end, slides):
    slider = own(lambda t, x, u, p: [rate(t, x[0])], 1)
    with pytest.raises(nlctl.errors.ChatteringError) as ended:
        nlctl.input_output_response(slider, [0, end], 0, [start], method=method,
                                    max_steps=200_000, rtol=1e-9, atol=1e-11,
                                    slide=False)  # fmt: skip
    assert ended.value.time == pytest.approx(slides, abs=1e-3)


def test_what_is_counted_ever_faster_is_not_said_to_slide():
    """1 / (1 - x) passes ever more integers before x = 1."""
    counter = own(lambda t, x, u, p: [1.0, np.floor(1 / (1 - x[0]))], 2)
    with pytest.raises(nlctl.errors.ChatteringError, match="moves ever faster") as ended:
        nlctl.input_output_response(
            counter, [0, 2.0], 0, [0.0, 0.0], engine="python-control", rtol=1e-6, atol=1e-8
        )
    assert ended.value.time < 1.0
    assert "second-order" not in str(ended.value)
