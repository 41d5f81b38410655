"""Baselines, ablations and the actuators that put controllers to the test."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tuning import TOLERANCES, evolved_gains

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.analysis.lyapunov.nussbaum.forecast import BurstForecast
from nlctl.analysis.metrics import Metric, absolute_integral, final, peak
from nlctl.analysis.paper import loops
from nlctl.analysis.paper.controllers import baselines, compared_controllers, sensor
from nlctl.params import equation_arguments

numbers = st.floats(-50, 50)
T = np.linspace(0, 20, 2001)
EXAMPLES = nlctl.paper.EXAMPLES


def at(spec, x, u):
    return spec.output(0.0, x, u, equation_arguments(spec))


def rates(spec, x, u):
    return spec.update(0.0, x, u, equation_arguments(spec))


def run(system, times, x0=None, **kwargs):
    return nlctl.input_output_response(nlctl.compile(system), times, 0, x0, **kwargs)


def pid_loop(pid, load=0.0):
    """Return x1' = x2, x2' = v + load, to be held at 1."""

    @nlctl.equation
    def f(x, v):
        return v + load

    step = nlctl.SumOfSines(amplitudes=1.0, frequencies=0.0, phases=np.pi / 2)
    plant = nlctl.PureFeedback(order=2, f=f)
    blocks = {"reference": step, "plant": plant, "pid": pid, "actuator": nlctl.Gain()}
    return nlctl.interconnect(blocks, outputs=["e", "u"])


class TestPID:
    def test_it_is_the_transfer_function(self):
        """From -e to u k_p + k_i / s, and from -e' k_d / (T_f s + 1)."""
        pid = nlctl.PID(k_p=2.0, k_i=3.0, k_d=0.7, T_f=0.1, u_max=1e9)
        linear = ct.linearize(nlctl.block(pid, "pid"), [0.0, 0.0], [0.0] * 4)
        for omega in (0.1, 1.0, 10.0, 100.0):
            s = 1j * omega
            gains = linear(s)[1]  # x1, x2, yd, yd1 to u
            expected = np.array([2.0 + 3.0 / s, 0.7 / (0.1 * s + 1)])
            np.testing.assert_allclose(gains, [*-expected, *expected], rtol=1e-6)
            ideal = 2.0 + 3.0 / s + 0.7 * s / (0.1 * s + 1)  # with yd1 = s yd
            assert gains[2] + s * gains[3] == pytest.approx(ideal, rel=1e-6)

    def test_it_removes_a_constant_disturbance(self):
        """Integral action: the error goes to 0, and u to minus the load."""
        loop = pid_loop(nlctl.PID(k_p=6.0, k_i=4.0, k_d=5.0), load=3.0)
        e, u = run(loop, np.linspace(0, 30, 301)).outputs[:, -1]
        assert e == pytest.approx(0, abs=1e-6)
        assert u == pytest.approx(-3.0, abs=1e-6)

    @given(numbers, numbers, numbers, numbers)
    def test_u_keeps_its_limit_and_the_integral_is_tracked_back(self, integral, slope, x1, yd):
        """|u| <= u_max; beyond it I' = -k_i e + (u - w) / T_t with the unlimited w."""
        pid, x, signals = nlctl.PID(u_max=15.0, T_t=0.5), (integral, slope), (x1, 0.3, yd, 0.1)
        e, u = at(pid, x, signals)
        w = at(nlctl.PID(u_max=1e12), x, signals)[1]
        assert e == x1 - yd
        assert u == np.clip(w, -15, 15)
        rate = rates(pid, x, signals)[0]
        assert rate == pytest.approx(-pid.k_i * e + (u - w) / 0.5, rel=1e-9, abs=1e-6)

    def test_anti_windup_shortens_the_overshoot(self):
        """With a limit that is met for seconds, back-calculation beats a wound-up integral."""
        most = {}
        for T_t in (0.2, 1e9):
            pid = nlctl.PID(k_p=3.0, k_i=1.0, k_d=3.0, T_t=T_t, u_max=0.2)
            most[T_t] = run(pid_loop(pid), np.linspace(0, 30, 3001)).outputs[0].max()
        assert most[0.2] < 0.5 * most[1e9]

    @given(numbers, numbers)
    def test_no_initial_error_kicks_the_derivative(self, x1, x2):
        """u(0) = -k_p e(0), whatever the slope."""
        pid = nlctl.PID(u_max=1e6)
        x0 = nlctl.initial_state(nlctl.block(pid, "pid"))
        assert at(pid, tuple(x0), (x1, x2, 0.3, 0.1))[1] == pytest.approx(-10 * (x1 - 0.3))


class TestSlidingMode:
    @given(numbers, st.floats(0.1, 20), st.floats(1e-3, 5))
    def test_it_is_the_saturated_proportional_law(self, r, K, phi):
        """-K r / phi inside of the layer, -K sign r outside."""
        (u,) = at(nlctl.controllers.SlidingModeLaw(K=K, phi=phi), (), (r,))
        assert u == pytest.approx(-K * (r / phi if abs(r) < phi else np.sign(r)), rel=1e-12)

    def test_it_reaches_the_layer_in_the_time_of_the_book(self):
        """r' = u + d, |d| <= D < K: |r| falls at K - D at least, |r(0)| / (K - D) at most."""

        @nlctl.equation
        def f(x, v):
            return v

        @nlctl.equation
        def d(x, t):
            return 2.0 * np.sin(5 * t)

        plant = nlctl.PureFeedback(order=2, f=f, d=d, initial={"x1": 1.0})
        controller = nlctl.sliding_mode(law=nlctl.controllers.SlidingModeLaw(K=8.0, phi=0.05))
        still = nlctl.SumOfSines(order=2, amplitudes=0.0, frequencies=1.0, phases=0.0)
        blocks = {"r": still, "plant": plant, "controller": controller, "actuator": nlctl.Gain()}
        loop = nlctl.interconnect(blocks, outputs=["e", "r", "u"])
        times = np.linspace(0, 10, 10_001)
        response = run(loop, times)
        e, r, _ = response.outputs
        slope = 1.5 * np.abs(response.states[1]).max()  # r' = 1.5 x2 + u + d
        assert np.all(np.abs(r[times >= 1.5 / (8 - 2 - slope)]) < 0.05)
        # Slotine and Li (7.21): |e| <= phi / lambda within the layer, when transients are over
        assert np.abs(e[times > 5]).max() <= 0.05 / 1.5


class TestActuators:
    @given(numbers, st.floats(0.1, 40))
    def test_saturation(self, u, limit):
        """The textbook's formula, an odd function."""
        spec = nlctl.Saturation(limit=limit)
        assert at(spec, (), (u,)) == (np.clip(u, -limit, limit),)
        assert at(spec, (), (-u,))[0] == -at(spec, (), (u,))[0]

    @given(numbers)
    def test_a_cascade_is_the_composition(self, u):
        """In the order of the stages, each parameter under its stage's name."""
        one, two = nlctl.Saturation(limit=3.0), nlctl.DeadZone()
        for stages in ({"a": one, "b": two}, {"b": two, "a": one}):
            made, v = nlctl.actuators.cascade(stages), u
            for stage in stages.values():
                (v,) = at(stage, (), (v,))
            assert made.output(0.0, [], [u])[0] == pytest.approx(v, rel=1e-14, abs=1e-14)
        assert {"a.limit", "b.b_r"} <= set(nlctl.parameters(made).index)

    def test_memory_survives_in_a_cascade(self):
        """A wide saturation in front of the backlash changes nothing over 20 s."""
        stages = {"saturation": nlctl.Saturation(limit=1e3), "body": nlctl.Backlash()}
        inside = run(nlctl.paper.example_2(actuator=nlctl.actuators.cascade(stages)), T)
        alone = run(nlctl.paper.example_2(), T)
        np.testing.assert_allclose(inside.outputs, alone.outputs, atol=1e-5)

    def test_stages_with_other_signals_are_refused(self):
        """By the stage's name."""
        with pytest.raises(nlctl.errors.DiagramError, match=r"'plant' goes from \['v'\]"):
            nlctl.actuators.cascade({"plant": nlctl.plants.Genesio()})
        with pytest.raises(nlctl.errors.DiagramError, match="at least one stage"):
            nlctl.actuators.cascade({})


class TestAblations:
    def test_what_is_left_out_is_zero_and_the_rest_keeps_its_gains(self):
        """Parameters of the pieces that stay are those of the controller."""
        (controller,) = (s for s in nlctl.paper.example_2().syslist if s.name == "controller")
        own = nlctl.parameters(controller)["value"]
        made = nlctl.controllers.ablations(controller, kappa=7.0)
        for label, without in (
            ("no network", ["weights."]),
            ("no robust term", ["robust."]),
            ("neither", ["weights.", "robust."]),
        ):
            left = nlctl.parameters(made[label])["value"]
            expected = [n for n in own.index if not n.startswith(tuple(without))]
            assert list(left.index) == expected
            assert all(np.array_equal(left[n], own[n]) for n in expected)
        law = nlctl.parameters(made["fixed gain"])["value"]
        assert (law["law.kappa"], law["law.beta"]) == (7.0, 5.0)

    def test_nothing_replaced_is_the_same_controller(self):
        """Bit for bit, and the original is not changed."""
        (controller,) = (s for s in nlctl.paper.example_1().syslist if s.name == "controller")
        twin = nlctl.controllers.replaced(controller)
        x, u = np.linspace(-1, 1, twin.nstates), np.linspace(-0.5, 0.8, twin.ninputs)
        np.testing.assert_array_equal(twin.output(0, x, u), controller.output(0, x, u))
        np.testing.assert_array_equal(twin.dynamics(0, x, u), controller.dynamics(0, x, u))

    @given(st.tuples(numbers, numbers, numbers, numbers), st.floats(1.01, 2.9))
    def test_the_fixed_gain_is_the_nussbaum_law_with_its_argument_held(self, u, zeta):
        """kappa = -N(zeta)."""
        kappa = -float(nlctl.functions.nussbaum(zeta))
        (held,) = at(nlctl.controllers.FixedGainLaw(kappa=kappa), (), u)
        assert held == pytest.approx(
            at(nlctl.controllers.NussbaumLaw(), (zeta,), u)[0], rel=1e-12, abs=1e-12
        )


class TestComparedControllers:
    @pytest.mark.parametrize("example", EXAMPLES)
    def test_all_of_them_fit_into_the_example(self, example):
        """Eleven loops with the signals that a comparison needs."""
        made = compared_controllers(example)
        assert len(made) == 11
        assert next(iter(made)) == "paper"
        for controller in made.values():
            loop = EXAMPLES[example](controller=controller, sensor=sensor(example))
            assert {"e", "u", "v"} <= set(loop.output_labels)

    def test_an_unknown_one_is_named_with_the_nearest(self):
        """Example or controller."""
        with pytest.raises(nlctl.errors.UnknownNameError, match="example_2"):
            baselines("example_3")
        with pytest.raises(nlctl.errors.UnknownNameError, match="sliding mode"):
            loops.example_1(controller="slidingmode")

    def test_the_fixed_gain_is_what_the_paper_s_loop_has_reached(self):
        """-N(zeta) at 20 s, to three digits."""
        for example, build in EXAMPLES.items():
            loop = build()
            zeta = run(loop, T).outputs[loop.output_index["zeta"], -1]
            (law,) = (
                s for s in compared_controllers(example)["fixed gain"].syslist if s.name == "law"
            )
            assert law.spec.kappa == pytest.approx(-nlctl.functions.nussbaum(zeta), rel=2e-3)

    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize("example", EXAMPLES)
    def test_the_certified_one_is_certified(self, example):
        """|r| <= C_0 for all time, proved; C_0 is no larger than the initial error."""
        loop = EXAMPLES[example](controller=compared_controllers(example)["certified"])
        assert certify(loop).C_0 < 1.0

    @pytest.mark.parted
    @pytest.mark.ci
    @pytest.mark.parametrize("example", EXAMPLES)
    def test_the_baselines_are_tuned(self, example):
        """Twice or half of a gain costs more, or exceeds the paper's peak or the search's steps."""
        cost = Metric(key="iae", signal="e", unit="s", meaning="", function=absolute_integral)
        most = Metric(key="peak", signal="u", unit="1", meaning="", function=peak)
        measured = sensor(example)
        own = run(EXAMPLES[example](sensor=measured), T)
        limit = peak(T, own.outputs[list(own.output_labels).index("u")])
        for controller in baselines(example).values():
            loop = EXAMPLES[example](controller=controller, sensor=measured)
            gains = nlctl.parameters(loop)["value"]
            names = [n for n in gains.index if n.endswith(("k_p", "k_d", ".K", ".phi"))]
            grid = {n: np.full(1 + 2 * len(names), float(gains[n])) for n in names}
            for i, n in enumerate(names):
                grid[n][1 + 2 * i : 3 + 2 * i] *= (0.5, 2.0)
            table = nlctl.ensemble_response(
                nlctl.compile(loop), T, params=grid, metrics=(cost, most), max_steps=15_000,
                **TOLERANCES,
            ).table  # fmt: skip
            assert table["peak"][0] <= 1.01 * limit
            searched = table["steps"] <= 10_000
            fits = (table["peak"] <= limit) & searched & (table.index > 0)
            assert np.all(table["iae"][fits] > 0.98 * table["iae"][0])

    @pytest.mark.weekly
    def test_the_search_finds_the_gain_of_least_error(self):
        """x' = u, u = -k x within |u| <= 4 from x(0) = 2: k = 2, and the IAE is 1."""

        @nlctl.equation
        def f(x, v):
            return v

        plant = nlctl.PureFeedback(order=1, f=f, initial={"x1": 2.0})
        still = nlctl.SumOfSines(order=1, amplitudes=0.0, frequencies=1.0, phases=0.0)

        def output(t, x, u, params):
            e = u[0] - u[1]
            return [e, -params["k_p"] * e]

        gain = ct.nlsys(None, output, inputs=["x1", "yd"], outputs=["e", "u"], params={"k_p": 1.0})
        blocks = {"r": still, "plant": plant, "p": gain, "actuator": nlctl.Gain()}
        loop = nlctl.compile(nlctl.interconnect(blocks, outputs=["e", "u"]))
        found = evolved_gains(
            loop,
            {"k_p": (0.1, 100.0)},
            T,
            Metric(key="iae", signal="e", unit="s", meaning="", function=absolute_integral),
            limited=Metric(key="peak", signal="u", unit="1", meaning="", function=peak),
            limit=4.0,
        )
        assert found.gains["k_p"] == pytest.approx(2.0, rel=1e-3)
        assert found.cost == pytest.approx(1.0, rel=1e-3)
        assert found.limited <= 4.0


class TestQuestions:
    def test_without_a_question_the_loop_is_the_paper_s(self):
        """Wide saturation, gain 1, no noise."""
        plain, asked = nlctl.paper.example_1(), loops.example_1()
        assert plain.output_labels == asked.output_labels
        np.testing.assert_allclose(run(asked, T).outputs, run(plain, T).outputs, atol=1e-5)

    def test_the_wrong_sign_and_the_limit_are_parameters(self):
        """v = D(k clip(u, -limit, limit)) with the dead zone D."""
        loop = loops.example_1(controller="fixed gain", gain=-1.0, limit=4.0)
        x = nlctl.initial_state(loop)
        for k, limit in ((-1.0, 4.0), (1.0, 4.0), (1.0, 100.0)):
            params = {"actuator.gain.k": k, "saturation.limit": limit}
            values = dict(zip(loop.output_labels, loop.output(0, x, [], params), strict=True))
            assert abs(values["u"]) > 4
            (v,) = at(nlctl.DeadZone(), (), (k * np.clip(values["u"], -limit, limit),))
            assert values["v"] == pytest.approx(v, rel=1e-12)

    def test_the_forecast_of_a_burst_is_that_of_the_law_of_the_slow_drift(self):
        """zeta made so that A = int |N| grows at a constant rate from 0: A = 0.4 t."""
        N = nlctl.functions.nussbaum_integral
        grid = np.linspace(1, 3, 4001)
        t = np.linspace(0, 100, 10_001)
        zeta = np.interp(0.4 * t, N(1.0) - N(grid), grid)
        budget = float(N(1.0) - N(3.0))
        found = BurstForecast(window=5.0).function(t, zeta, np.ones_like(t), -0.4 * np.ones_like(t))
        assert found == pytest.approx(budget / 0.4, rel=0.02)
        late = np.linspace(0, 2 * budget, 2001)
        crossed = np.interp(0.4 * late, N(1.0) - N(grid), grid)
        burst = BurstForecast().function(late, crossed, 0 * late, 0 * late)
        assert burst == pytest.approx(budget / 0.4, rel=1e-3)

    def test_a_run_that_is_too_short_has_no_forecast(self):
        """NaN, not a guess."""
        t = np.linspace(0, 10, 1001)
        assert np.isnan(BurstForecast().function(t, 1.5 + 0.01 * t, 0 * t, 0 * t))
        assert final(t, t) == 10
