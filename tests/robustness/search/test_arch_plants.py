"""Plants of the falsification table: python-control, traces, and what is known exactly."""

import numpy as np
import pytest
from arch_plants import afc, at, cc, inputs, nn, published, sc
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import nlctl

PLANTS = {"at": at.plant, "afc": afc.plant, "nn": nn.plant, "cc": cc.plant, "sc": sc.plant}


def moved(row, rng):
    """Random values of all pieces of a row."""
    return {
        q.name: float(rng.uniform(*q.bounds)) for q in row.space.quantities
    }  # fmt: skip


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("key", [
    "AT1", pytest.param("AFC29", marks=pytest.mark.weekly), "NN.03", "CC1", "SC",
])  # fmt: skip
def test_machine_code_is_python_controls_at_points_of_a_run(key):
    """Every block is read as expressions, and the audit compares with its equations."""
    row = next(row for row in published.ROWS if row.key == key)
    compiled = nlctl.compile(row.build())
    assert "called as" not in str(compiled)
    params = moved(row, np.random.default_rng(2))
    end = min(row.until, 12.0)
    run = nlctl.input_output_response(
        compiled, np.linspace(0, end, 121), params=params, audit="every run", rtol=1e-6, atol=1e-8,
        method=row.method,
    )  # fmt: skip
    assert np.isfinite(run.outputs).all()


@pytest.mark.parted
@pytest.mark.parametrize("key", ["NN.03", "SC"])
def test_a_run_is_the_reference_engines(key):
    row = next(row for row in published.ROWS if row.key == key)
    system, t = row.build(), np.linspace(0, 1.5, 16)
    params = moved(row, np.random.default_rng(3))
    ours, theirs = (
        nlctl.input_output_response(system, t, params=params, engine=engine, rtol=1e-9, atol=1e-11)
        for engine in ("native", "python-control")
    )
    np.testing.assert_allclose(ours.outputs, theirs.outputs, rtol=1e-5, atol=3e-6)


def test_pieces_are_the_signal_that_they_say():
    source = inputs.pieces("u", 3, 0.5)
    lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    loop = nlctl.interconnect([source, lag], outputs=["u", "v"])
    t = np.array([0.0, 0.25, 0.5, 0.75, 1.0, 1.75])
    params = {f"u.value[{k}]": v for k, v in enumerate([1.0, -2.0, 3.0])}
    run = nlctl.input_output_response(loop, t, params=params)
    np.testing.assert_array_equal(run.outputs[0], [1, 1, -2, -2, 3, 3])
    ends = [1 - np.exp(-0.5)]
    ends.append(-2 + (ends[0] + 2) * np.exp(-0.5))
    assert run.outputs[1, 4] == pytest.approx(ends[1], rel=1e-7)


def test_tables_go_on_in_straight_lines():
    table = inputs.line([0, 1, 3], [1, 2, 0])
    np.testing.assert_allclose([table(x) for x in (-2, 0.5, 2, 5)], [-1, 1.5, 1, -2])
    plane = inputs.surface([0, 1], [0, 1, 2], np.array([[0, 1, 2], [3, 4, 5]]))
    assert plane([[2.0, -1.0]])[0] == pytest.approx(3 * 2 - 1)


class TestTransmission:
    def test_a_passing_manoeuvre_is_simulinks(self):
        """Speed, engine and gears of ``test_data.h5`` of cpslab-asu/model-autotrans.

        Simulink has a fixed step of 0.04 s there.  MathWorks' schedule: the throttle falls from
        60 to 40 % until 14.9 s, is 100 % at 15 s and falls to 0 at 100 s.
        """
        t = 0.01 * np.arange(3001)
        throttle = np.interp(t, [0, 14.9, 15, 100], [60, 40, 100, 0])
        run = nlctl.input_output_response(at.car(), t, [throttle, 0 * t])
        seen = [100, 200, 400, 600, 800, 1000, 1200, 1400, 1480, 1600, 1800, 2000, 2400, 2800, 3000]
        speed = [18.3291, 29.7018, 43.4266, 53.1845, 60.9457, 66.4942, 70.8057, 74.2675, 75.4619,
                 80.4924, 90.0638, 98.5734, 110.1744, 119.1906, 123.0493]  # fmt: skip
        rpm = [2596.66, 2617.64, 3138.49, 2777.82, 2511.92, 2504.18, 2532.23, 2570.60, 2587.98,
               3940.61, 4318.99, 4631.02, 3707.26, 3939.38, 4040.16]  # fmt: skip
        np.testing.assert_allclose(run.outputs[0, seen], speed, atol=0.02)
        np.testing.assert_allclose(run.outputs[1, seen], rpm, rtol=1e-3)
        (shifts,) = np.nonzero(np.diff(run.outputs[2]))
        np.testing.assert_allclose(t[shifts + 1], [1.8, 4.24, 7.8, 15.08, 20.48], atol=1e-9)
        np.testing.assert_array_equal(run.outputs[2, shifts + 1], [2, 3, 4, 3, 4])

    def test_with_full_brakes_it_stands_still(self):
        """At rest the torque of the converter is less than brakes and drag: it slides there."""
        run = nlctl.input_output_response(at.car(), [0, 1, 5], [[0, 0, 0], [325, 325, 325]])
        assert np.abs(run.outputs[0]).max() < 1e-5
        assert run.outputs[1, -1] == pytest.approx(idle(), rel=1e-4)

    def test_the_engine_stays_within_its_limits(self):
        t = np.linspace(0, 30, 3001)
        params = {f"throttle.value[{k}]": 100.0 * (k < 6) for k in range(at.COUNT)}
        params |= {f"brake.value[{k}]": 325.0 * (k >= 6) for k in range(at.COUNT)}
        run = nlctl.input_output_response(at.plant(), t, params=params)
        assert run.outputs[1].min() == pytest.approx(600, abs=1e-6)


def idle():
    """The engine's speed without throttle at rest: torque of the map = that of the converter."""
    capacity = at.TABLES["capacity"][0]
    assert at.TORQUE([[0.0, at.SLOWEST]])[0] < (at.SLOWEST / capacity) ** 2  # slower still
    return at.SLOWEST


class TestFuel:
    @pytest.mark.weekly
    def test_a_constant_throttle_leaves_no_error(self):
        """The PI of normal mode is an integrator: mu goes to 0."""
        run = nlctl.input_output_response(
            afc.plant(), np.linspace(0, 30, 31), rtol=1e-6, atol=1e-8, method="rodas5p",
            params={f"throttle.value[{k}]": 20.0 for k in range(afc.COUNT)},
        )  # fmt: skip
        mu, mode, _ = run.outputs
        assert abs(mu[-1]) < 1e-6
        np.testing.assert_array_equal(mode[[5, 9, 11, 30]], [1, 1, 0, 0])

    def test_exhaust_arrives_one_unit_of_way_later(self):
        """Of a ratio that is linear in the way, what arrives is that one unit before."""
        ways = np.linspace(3.0, 7.0, afc.STORED + 1)
        assert afc.read(ways, 2 * ways + 1, 5.123) == pytest.approx(2 * 5.123 + 1)
        assert np.isnan(afc.read(ways, ways, 2.9))


class TestMagnet:
    def test_it_falls_with_friction_without_current(self):
        """pos' = -g/4 (1 - exp(-4 t)) without current."""
        t = np.linspace(0, 0.2, 5)
        run = nlctl.input_output_response(nlctl.block(nn.Magnet(), "magnet"), t, 0 * t)
        known = 0.5 - 9.8 / 4 * (t - (1 - np.exp(-4 * t)) / 4)
        np.testing.assert_allclose(run.outputs.reshape(-1), known, rtol=1e-7)

    def test_it_is_brought_to_its_reference(self):
        """There the coil carries the weight in the mean: 5 sign(i) i^2 = 9.8 pos."""
        params = {f"reference.value[{k}]": 2.0 for k in range(nn.COUNT)}
        t = np.linspace(0, 9.0, 9001)
        run = nlctl.input_output_response(nn.plant(), t, params=params)
        late = run.outputs[:, 5000:]
        np.testing.assert_allclose(late[0], 2.0, atol=0.02)
        force = 5 * np.sign(late[1]) * late[1] ** 2
        assert np.mean(force) == pytest.approx(9.8 * 2, rel=0.03)


class TestCars:
    def test_the_first_seconds_are_closed_forms(self):
        """The leader runs ahead, the others stand until their gap is 15; the second then chases."""
        a, b = 0.8, 0.1
        t = np.linspace(0, 10, 1001)
        run = nlctl.input_output_response(cc.cars(), t, [a + 0 * t, b + 0 * t])
        lead = -(a / b) * (t - (1 - np.exp(-b * t)) / b)
        start = brentq(lambda s: -(a / b) * (s - (1 - np.exp(-b * s)) / b) + 5.0, 0.1, 10)
        second = 10 - np.maximum(t - start, 0) ** 2 / 2
        gap, before = second - lead, np.argmax((second - lead)[t > start] < 10) + np.sum(t <= start)
        assert before > 350
        np.testing.assert_allclose(run.outputs[0, :before], gap[:before], atol=1e-6)
        np.testing.assert_allclose(run.outputs[1, : np.sum(t <= start)], 10.0)

    def test_a_published_counterexample_begins_as_published(self):
        """ZlsCheck's 07ef11 of CC1, with its Euler step of 0.01 s: the leader to that order."""
        t = 0.01 * np.arange(281)
        run = nlctl.input_output_response(cc.cars(), t, [0.82072 + 0 * t, 0.0813549 + 0 * t])
        published = np.array([-0.00294899, -0.38786, -1.53386, -2.89551])
        np.testing.assert_allclose(10 - run.outputs[0, [9, 99, 199, 276]], published, atol=0.015)


class TestCondenser:
    def test_it_stands_still_where_heat_and_steam_balance(self):
        """The published set point is an equilibrium of its equations, to the digits given."""
        steam = TestCondenser.balanced()
        rates = sc.Condenser.update(0.0, [90.0, 80.0, sc.FLOW, 90.0], [steam, 0.0], None)
        np.testing.assert_allclose(rates, 0.0, atol=1e-3)
        assert steam == pytest.approx(4.0, rel=1e-3)

    @staticmethod
    def balanced():
        """Steam that condenses at the set point."""
        hot, cold, flow = 96.687, 60.0, sc.FLOW
        mean = 20.0 / np.log((hot - cold) / (hot - 80.0))
        return mean / (0.0872924756541668 / flow**0.8 + 0.00073786772008033) / 2265.65

    def test_the_loop_is_scipys(self):
        """Both blocks, written once more as one function."""
        network, condenser = sc.Network(), sc.Condenser()

        def rate(t, x):
            demand = network.output(t, x[:6], np.array([x[9]]), None)
            return np.concatenate([
                network.update(t, x[:6], np.array([x[9]]), None),
                condenser.update(t, x[6:], [4.005, demand[0]], None),
            ])  # fmt: skip

        start = np.r_[np.zeros(6), 90.0, 80.0, sc.FLOW, 90.0]
        known = solve_ivp(rate, (0, 6), start, rtol=1e-9, atol=1e-10, max_step=0.01).y[9, -1]
        params = {f"steam.value[{k}]": 4.005 for k in range(sc.COUNT)}
        run = nlctl.input_output_response(sc.plant(), [0, 6], params=params)
        assert run.outputs.reshape(-1)[-1] == pytest.approx(known, rel=1e-6)
