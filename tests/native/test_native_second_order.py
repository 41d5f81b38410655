"""Relays that act on u'' alone: they come to rest, or end for a reason."""

import re

import control as ct
import numpy as np
import pytest
from examples import crossed
from scipy.integrate import solve_ivp

import nlctl
from nlctl.native import Status

TIMES = np.linspace(0, 5, 101)


def loop(update, output=lambda t, x, u, p: x[0], states=2, relay=None, params=None):
    body = ct.nlsys(
        update,
        output,
        states=states,
        inputs=["v"],
        outputs=["u"],
        name="plant",
        params=params or {},
    )
    blocks = {"relay": relay or nlctl.IdealRelay(), "plant": body}
    return nlctl.interconnect(blocks, outputs=["u", "v"])


def run(system, start=(1.0, 0.0), times=TIMES, **given):
    x0 = {f"plant.x[{i}]": value for i, value in enumerate(start)}
    return nlctl.input_output_response(system, times, 0, x0, **given)


def lagged(t, x, u, p):
    """x' = w, T w' = -K v - w: an integrator behind a lag."""
    return np.array([x[1], -(x[1] + p["K"] * u[0]) / p["T"]])


def of_plant(made):
    return made.states[[label.startswith("plant") for label in made.state_labels]]


@pytest.mark.parametrize(
    ("method", "rtol", "T"), crossed(["auto", "tsit5", "rodas5p"], [1e-4, 1e-6, 1e-8], [0.05, 0.2])
)
def test_a_relay_behind_a_lag_comes_to_rest(T, method, rtol):
    """Its rate falls as exp(-2 t / (3 T)) when it is small: to nothing at 40 T."""
    times = np.linspace(0, 50 * T, 101)
    made = run(
        loop(lagged, params={"K": 1.0, "T": T}), times=times, method=method, max_steps=200_000
    )
    late = times > 48 * T
    assert np.abs(of_plant(made)[0, late]).max() <= 1e-6
    assert np.all(made.states[0, late] == 0)
    assert np.abs(of_plant(made)[:, -1]).max() <= 1e-6


@pytest.mark.parted
@pytest.mark.parametrize(("K", "rest_rate"), [(1.0, 4e-3), (2.0, 1e-3), (0.5, 1e-3), (10.0, 1e-3)])
def test_it_switches_until_the_rate_is_that_of_rest(K, rest_rate):
    """J / A^2 = +-1 / K: from passage to passage 1 / |z| grows by 2 / (3 K), to 1 / rest_rate."""
    relay = nlctl.IdealRelay(rest_rate=rest_rate)
    made = run(loop(lagged, relay=relay, params={"K": K, "T": 0.05}))
    assert made.statistics.status is Status.OK
    assert made.statistics.events == pytest.approx(1.5 * K / rest_rate, rel=0.03)


def driven(t, x, u, p):
    """x' = d(t) - x - w, w' = (v - w) / T."""
    return np.array([0.3 + 0.2 * np.sin(t) - x[0] - x[1], (u[0] - x[1]) / 0.1])


def test_at_rest_the_lag_follows_the_disturbance():
    """u = x = 0: w = d and v = d + T d'."""
    times = np.linspace(0, 10, 201)
    made = run(loop(driven), times=times)
    t = times[times > 6]
    (x, w), v = of_plant(made)[:, times > 6], made.outputs[1, times > 6]
    np.testing.assert_allclose(x, 0, atol=1e-6)
    np.testing.assert_allclose(w, 0.3 + 0.2 * np.sin(t), rtol=0, atol=1e-6)
    np.testing.assert_allclose(v, 0.3 + 0.2 * np.sin(t) + 0.02 * np.cos(t), rtol=0, atol=1e-4)


def test_it_leaves_where_the_output_would_have_to_be_beyond_the_height():
    """d = 0.25 t: v = 0.25 (t + T) up to 1 at t = 4 - T; then w' = (1 - w) / T."""
    T = 0.1
    system = loop(lambda t, x, u, p: np.array([0.25 * t - x[0] - x[1], (u[0] - x[1]) / 0.1]))
    times = np.linspace(0, 8, 81)
    made = run(system, (0.3, 0.0), times)
    end = 4 - T
    after = times > end
    exact = solve_ivp(
        lambda t, x: [0.25 * t - x[0] - x[1], (1 - x[1]) / T], (end, 8), [0.0, 0.25 * end],
        rtol=1e-11, atol=1e-12, t_eval=times[after],
    ).y  # fmt: skip
    np.testing.assert_allclose(of_plant(made)[:, after], exact, rtol=0, atol=2e-5)
    np.testing.assert_allclose(of_plant(made)[0, ~after & (times > 2)], 0, atol=1e-6)


def test_a_saturation_before_the_lag_changes_nothing_but_the_gain():
    """clip(3 v, -1/2, 1/2): K = 1/2, and at rest v is a third of what holds x."""

    def update(t, x, u, p):
        return np.array([0.2 - x[0] - x[1], (np.clip(3 * u[0], -0.5, 0.5) - x[1]) / 0.1])

    made = run(loop(update))
    assert abs(made.outputs[0, -1]) <= 1e-6
    assert made.outputs[1, -1] == pytest.approx(0.2 / 3, abs=1e-6)
    assert of_plant(made)[1, -1] == pytest.approx(0.2, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_the_sign_of_the_jerk_says_what_passages_become(seed):
    """Three random states, one of which acts on u'': |z| changes by 2/3 z^2 (J/A^2 at +-height)."""
    rng = np.random.default_rng(seed)
    a, c = rng.normal(size=3), rng.uniform(0.5, 1.5)
    drift, sides = 0.3 * rng.uniform(-1, 1), np.array([1.0, -1.0])

    def field(v):
        def rates(t, x):
            force = drift + a @ x - c * v
            return [x[1], force, a[0] * v - x[2] + x[1]]

        return rates

    A = drift - c * sides
    w = rng.normal() * 0.1
    A += a[2] * w
    J = a[1] * A + a[2] * (a[0] * sides - w)
    z, x = 1e-3, np.array([0.0, 1e-3, w])

    def passed(t, x):
        return x[0]

    passed.terminal = True
    for v in sides:
        passed.direction = -v
        found = solve_ivp(field(v), (0, 1), x, events=passed, rtol=1e-12, atol=1e-16, max_step=1e-4)
        x = found.y[:, -1] * [0, 1, 1]
    change = (abs(x[1]) - z) / z**2
    assert change == pytest.approx(-2 / 3 * (J / A**2 @ sides), rel=0.05, abs=0.02)


@pytest.mark.parametrize("gain", [0.0, 0.2])
def test_passages_that_do_not_become_slower_are_no_rest(gain):
    """x'' = gain x' - v from a small one: |z| goes on, as z + 2/3 gain z^2 a passage."""
    start = 1e-2
    made = run(loop(lambda t, x, u, p: np.array([x[1], gain * x[1] - u[0]])), (0.0, start))
    x, rate = of_plant(made)
    assert np.all(made.states[0] != 0)
    size = np.sqrt(rate**2 + 2 * np.abs(x))  # |z| at the passage behind, for gain 0
    assert np.all(size >= start * (1 - 1e-5))
    grown = start / (1 - start * 0) * np.exp(gain * 5 / 3)  # E' = gain <x'^2> = 2/3 gain E
    assert size[-1] == pytest.approx(grown, rel=1e-2)


def test_without_a_rate_of_rest_it_ends_with_the_reason_and_the_time():
    system = loop(lagged, relay=nlctl.IdealRelay(rest_rate=0.0), params={"K": 1.0, "T": 0.05})
    with pytest.raises(
        nlctl.errors.ChatteringError, match=r"switches of block 'relay'.* accumulate"
    ) as e:
        run(system)
    assert "second-order sliding" in str(e.value)
    assert 1.5 < e.value.time < 3
    assert run(system, times=[0.0, 1.0]).statistics.status is Status.OK


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
@pytest.mark.parametrize(("damping", "offset"), [(20.0, 0.0), (8.0, 0.4)])
def test_a_sign_behind_a_lag_ends_with_the_reason(method, damping, offset):
    """x'' = -damping (x' + sign(x) - offset), by a user's own function."""
    system = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], -damping * (x[1] + np.sign(x[0]) - offset)]),
        lambda t, x, u, p: x[0], states=2, inputs=0, outputs=1, name="own",
    )  # fmt: skip
    made = nlctl.input_output_response(
        system, [0, 20.0], 0, [1.0, 0.0], ignore_errors=True, method=method, max_steps=2_000_000,
        slide=False,
    )  # fmt: skip
    assert made.statistics.status is Status.CHATTERING
    assert "block 'own'" in made.message
    assert made.statistics.accepted + made.statistics.rejected < 1_200_000


@pytest.mark.parametrize("rtol", [1e-5, 1e-8])
def test_fullers_switches_accumulate_by_name(rtol):
    C = np.sqrt((np.sqrt(33) - 1) / 24)
    system = loop(
        lambda t, x, u, p: np.array([x[1], -u[0]]),
        lambda t, x, u, p: x[0] + C * x[1] * abs(x[1]),
    )
    made = run(system, ignore_errors=True, rtol=rtol, atol=rtol / 100)
    assert made.statistics.status is Status.CHATTERING
    near = re.search(r"switches of block 'relay' .* accumulate near t = ([\d.]+)", made.message)
    start, ratio = np.sqrt(2 / (1 + 2 * C)), np.sqrt((1 - 2 * C) / (1 + 2 * C))
    end = start + start * (1 + ratio) / (1 - ratio)
    assert made.statistics.time == pytest.approx(end, abs=2e-3)
    assert near
    assert float(near[1]) == pytest.approx(end, abs=2e-3)


@pytest.mark.parametrize("order", [3, 4])
def test_a_limit_cycle_of_a_relay_goes_on(order):
    """Behind 1 / (s + 1)^order it oscillates where the phase is -pi: w = tan(pi / order)."""
    A = -np.eye(order) + np.eye(order, k=-1)
    plant = ct.ss(
        A, -np.eye(order)[:, :1], np.eye(order)[-1:], 0, inputs=["v"], outputs=["u"], name="plant"
    )
    system = nlctl.interconnect({"relay": nlctl.IdealRelay(), "plant": plant}, outputs=["u", "v"])
    times = np.linspace(0, 200, 8001)
    made = nlctl.input_output_response(system, times, 0, {"plant.x[0]": 1.0})
    assert made.statistics.status is Status.OK
    u = made.outputs[0, times > 100]
    passes = np.flatnonzero((u[1:] > 0) & (u[:-1] <= 0))
    w = 2 * np.pi * (passes.size - 1) / np.ptp(times[times > 100][passes])
    assert w == pytest.approx(np.tan(np.pi / order), rel=0.05)  # of describing functions


def test_members_come_to_rest_as_they_do_alone():
    compiled = nlctl.compile(loop(lagged, params={"K": 1.0, "T": 0.05}))
    starts = np.linspace(0.2, 1.5, 9)

    def found(values):
        made = nlctl.ensemble_response(compiled, TIMES, 0, {"plant.x[0]": values}, keep=["u"])
        return made.signals["u"]

    u = found(starts)
    assert np.abs(u[:, -1]).max() < 1e-6
    for k in (0, 8):
        np.testing.assert_array_equal(u[k], found(starts[k : k + 1])[0])


def test_the_audit_knows_what_rests_in_second_order():
    """Python-control's own right-hand side along every run, where it rests as well."""
    made = run(loop(driven), audit="every run")
    assert made.states[0, -1] == 0


CORNERS, POLYGON = np.array([0.0, 4.0, 6.0, 10.0]), np.array([0.0, 0.0, 0.6, 0.6])


def test_it_follows_a_polygon_and_rests_again_behind_each_corner():
    """u = x - r behind a lag: x' = w, T w' = v - w; on u = 0 w = r' and v = r'."""
    body = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], (-u[0] - x[1]) / 0.05]),
        lambda t, x, u, p: x[0] - u[1], states=2, inputs=["v", "r"], outputs=["u"], name="plant",
    )  # fmt: skip
    system = nlctl.interconnect(
        {"relay": nlctl.IdealRelay(), "plant": body}, inputs=["r"], outputs=["u", "v"]
    )
    times = np.linspace(0, 10, 201)
    made = nlctl.input_output_response(
        system, times, np.interp(times, CORNERS, POLYGON), {"plant.x[0]": 0.3}
    )
    for begin, end, slope in ((3.5, 4, 0.0), (5.8, 6, 0.3), (9, 10, 0.0)):
        here = (times > begin) & (times < end)
        np.testing.assert_allclose(made.outputs[0, here], 0, atol=1e-6)
        np.testing.assert_allclose(of_plant(made)[1, here], slope, rtol=0, atol=1e-4)
        np.testing.assert_allclose(made.outputs[1, here], -slope, rtol=0, atol=2e-3)


def test_one_relay_rests_in_second_order_beside_one_that_slides():
    """v1 acts behind a lag and v2 at once; neither reaches the other's input."""
    middle = ct.nlsys(
        lambda t, x, u, p: np.array(
            [0.3 - x[0] - x[1], 10 * (u[0] - x[1]), 0.2 * np.cos(t) - u[1]]
        ),
        lambda t, x, u, p: (x[0], x[2]), states=3, inputs=["v1", "v2"], outputs=["u1", "u2"],
        name="plant",
    )  # fmt: skip
    relays = [nlctl.block(nlctl.IdealRelay(), name) for name in ("r1", "r2")]
    wires = [[f"r{k}.u", f"plant.u{k}"] for k in (1, 2)]
    wires += [[f"plant.v{k}", f"r{k}.v"] for k in (1, 2)]
    system = ct.interconnect(
        [*relays, middle], connections=wires, inplist=[], outlist=["r1.v", "r2.v"],
        outputs=["v1", "v2"],
    )  # fmt: skip
    v1, v2 = run(system, (1.0, 0.0, -0.5)).outputs[:, TIMES > 4]
    np.testing.assert_allclose(v1, 0.3, rtol=0, atol=1e-4)
    np.testing.assert_allclose(v2, 0.2 * np.cos(TIMES[TIMES > 4]), rtol=0, atol=1e-6)
