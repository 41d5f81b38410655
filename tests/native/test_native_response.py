"""Responses of compiled diagrams: closed forms, orders, pulses, statuses, the cache."""

import os
import subprocess
import sys

import control as ct
import numpy as np
import pytest
import source_text
from numba.core import config

import nlctl
from nlctl.analysis.paper import CASES, checks
from nlctl.analysis.reproductions.paper import PaperRun, numbers_of
from nlctl.native import Status
from nlctl.native.integrate.methods.tsit5 import TSIT5
from nlctl.native.machine.store import cache_folder

TABLEAU = TSIT5.pair()
B, C, E = TABLEAU.B, TABLEAU.C, TABLEAU.E
A = TABLEAU.A[:, : TSIT5.stages]

OSCILLATOR = ct.ss([[0.0, 1.0], [-1.0, 0.0]], [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]], name="osc")


def exact(function):
    """A compiled one-state system x' = f(t, x) without inputs."""
    return nlctl.compile(
        ct.nlsys(function, lambda t, x, u, params: x, inputs=0, outputs=1, states=1, name="one")
    )


@pytest.fixture(scope="module")
def oscillator():
    """x'' = -x + u, compiled once."""
    return nlctl.compile(OSCILLATOR)


class TestTableau:
    """The coefficients satisfy the order conditions; none was taken on trust."""

    def test_rows_sum_to_the_nodes(self):
        """c_i = sum_j a_ij."""
        np.testing.assert_allclose(A.sum(axis=1), C, atol=2e-15)

    @pytest.mark.parametrize("power", range(5))
    def test_quadrature_conditions_to_order_five(self, power):
        """sum_i b_i c_i^k = 1 / (k + 1)."""
        assert A[6] @ C**power == pytest.approx(1 / (power + 1), abs=1e-14)

    def test_nested_conditions_to_order_five(self):
        """The conditions of trees with inner nodes (Hairer, Norsett, Wanner, II.2)."""
        b, ac = A[6], A @ C
        for value, wanted in (
            *((b @ ac, 1 / 6), (b @ (C * ac), 1 / 8), (b @ (A @ C**2), 1 / 12)),
            *((b @ (A @ ac), 1 / 24), (b @ (C**2 * ac), 1 / 10), (b @ ac**2, 1 / 20)),
            *((b @ (C * (A @ C**2)), 1 / 15), (b @ (A @ C**3), 1 / 20)),
            *((b @ (C * (A @ ac)), 1 / 30), (b @ (A @ (C * ac)), 1 / 40)),
            *((b @ (A @ (A @ C**2)), 1 / 60), (b @ (A @ (A @ ac)), 1 / 120)),
        ):
            assert value == pytest.approx(wanted, abs=1e-14)

    def test_error_weights_vanish_to_order_four_and_not_beyond(self):
        """The embedded solution has order 4, so that there is an error to see."""
        for power in range(4):
            assert E @ C**power == pytest.approx(0, abs=1e-14)
        assert abs(E @ C**4) > 1e-5

    @pytest.mark.parametrize("theta", [0.1, 0.5, 0.9, 1.0])
    def test_interpolant_integrates_polynomials_of_degree_three(self, theta):
        """sum_i b_i(theta) c_i^k = theta^(k+1) / (k + 1), and b(1) = b."""
        weights = theta * sum(B[:, j] * theta**j for j in range(4))
        for power in range(4):
            assert weights @ C**power == pytest.approx(
                theta ** (power + 1) / (power + 1), abs=1e-14
            )
        if theta == 1.0:
            np.testing.assert_allclose(weights, A[6], atol=1e-14)


class TestAccuracy:
    """Against closed forms and against python-control."""

    def test_error_falls_with_the_fifth_power_of_the_number_of_steps(self, oscillator):
        """cos t over ten seconds, at the end of the run."""
        steps, errors = [], []
        for rtol in (1e-5, 1e-7, 1e-9):
            t = np.array([0.0, 10.0])
            run = nlctl.input_output_response(oscillator, t, 0, [1.0, 0.0], rtol=rtol, atol=rtol)
            steps.append(run.statistics.accepted)
            errors.append(abs(run.y[0, -1] - np.cos(10)))
        orders = -np.diff(np.log(errors)) / np.diff(np.log(steps))
        assert np.all(orders > 4.5)

    def test_values_between_steps_are_as_good_as_at_steps(self):
        """A dense grid and a sparse one give the same solution to the tolerance."""
        system = exact(lambda t, x, u, params: -x[0] * np.cos(t))
        t = np.linspace(0, 10, 1001)
        run = nlctl.input_output_response(system, t, 0, [1.0], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(run.states[0], np.exp(-np.sin(t)), rtol=2e-7)
        assert run.statistics.accepted < 200

    @pytest.mark.skipif(
        getattr(config, "DISABLE_JIT", False), reason="the same source takes a minute in Python"
    )
    def test_example_1_reaches_its_figures(self):
        """All thirteen figures of the published case, from machine code."""
        (case,) = [c for c in CASES if c.key == "1"]
        loop = case.make()
        run = nlctl.input_output_response(nlctl.compile(loop), case.times, rtol=1e-10, atol=1e-12)
        signals = {name: run.y[i] for name, i in loop.output_index.items()}
        metrics = numbers_of(case, run.time, signals)
        made = PaperRun(case=case, time=run.time, signals=signals, metrics=metrics)
        compared = checks({"1": made})
        assert len(compared) == 13
        assert all(check.holds for check in compared)

    @pytest.mark.slow
    def test_parameters_and_initial_states_by_name(self):
        """The same overrides give the same response in python-control and in machine code."""
        loop, t = nlctl.paper.example_1(), np.linspace(0, 0.15, 16)
        settings = {"params": {"law.beta": 4.0, "actuator.b_r": 0.7}, "rtol": 1e-9, "atol": 1e-11}
        start = {"plant.x1": 0.9, "zeta": 1.1}
        ours = nlctl.input_output_response(nlctl.compile(loop), t, 0, start, **settings)
        plain = nlctl.input_output_response(loop, t, 0, start, engine="python-control", **settings)
        np.testing.assert_allclose(ours.y, plain.y, rtol=1e-6, atol=1e-7)
        assert ours.output_labels == plain.output_labels
        assert ours.params["law.beta"] == 4.0
        assert list(ours.to_pandas().columns) == list(plain.to_pandas().columns)


class TestInputs:
    """Inputs are linear between their times, and corners are seen."""

    def test_a_pulse_is_not_stepped_over(self, oscillator):
        """A short pulse late in a calm run moves the state (python-control issue 1152)."""
        t = np.linspace(0, 100, 1001)
        pulse = np.where(np.isclose(t, 80.0), 10.0, 0.0)  # a triangle of area 1, 0.2 s wide
        run = nlctl.input_output_response(oscillator, t, pulse)
        # response of x'' = -x to a triangle: its transform at 1 rad/s times a sine
        gain = 10.0 * 2 * (1 - np.cos(0.1)) / 0.1
        after = t > 80.2
        np.testing.assert_allclose(run.y[0][after], gain * np.sin(t[after] - 80), atol=1e-6)
        plain = ct.input_output_response(OSCILLATOR, t, pulse)
        assert abs(plain.y[0][after] - gain * np.sin(t[after] - 80)).max() > 0.1

    def test_a_ramp_and_a_constant(self, oscillator):
        """x'' = -x + t has the solution t - sin t."""
        t = np.linspace(0, 5, 11)
        run = nlctl.input_output_response(oscillator, t, t)
        np.testing.assert_allclose(run.y[0], t - np.sin(t), atol=1e-7)
        run = nlctl.input_output_response(oscillator, t, 2.0)
        np.testing.assert_allclose(run.y[0], 2 - 2 * np.cos(t), atol=1e-7)

    @pytest.mark.parametrize("shape", [(5,), (2, 11), (1, 10)])
    def test_wrong_shapes_are_refused(self, oscillator, shape):
        """The message says which shape is needed."""
        with pytest.raises(nlctl.errors.ParameterError, match=r"inputs need shape \(1, 11\)"):
            nlctl.input_output_response(oscillator, np.linspace(0, 1, 11), np.zeros(shape))

    def test_wrong_initial_states_and_methods_are_refused(self, oscillator):
        """The message says how many values there must be, and which method there is."""
        with pytest.raises(nlctl.errors.ParameterError, match="needs 2 values for 'osc', got 3"):
            nlctl.input_output_response(oscillator, [0, 1], 0, [1, 2, 3])
        with pytest.raises(nlctl.errors.UnknownNameError, match=r"unknown method 'RK45'.*tsit5"):
            nlctl.input_output_response(oscillator, [0, 1], method="RK45")

    def test_several_inputs_by_list(self):
        """One entry per input, numbers or arrays, as in python-control."""
        system, t = ct.ss(-1, [[1.0, 2.0]], 1, [[0.0, 0.0]], name="two"), np.linspace(0, 3, 31)
        run = nlctl.input_output_response(nlctl.compile(system), t, [t, 1.5])
        plain = ct.input_output_response(system, t, [t, 1.5], solve_ivp_kwargs={"rtol": 1e-9})
        np.testing.assert_allclose(run.y, plain.y, atol=1e-6)


class TestStatus:
    """Every run ends with a status, never with calm numbers."""

    def test_escape_in_finite_time(self):
        """x' = x^2 from 1 escapes at t = 1; what was computed before is kept."""
        escaping = exact(lambda t, x, u, params: x * x)
        t = np.linspace(0, 2, 21)
        with pytest.raises(nlctl.errors.DivergedError) as caught:
            nlctl.input_output_response(escaping, t, 0, [1.0])
        assert caught.value.time == pytest.approx(1, abs=1e-7)
        part = nlctl.input_output_response(escaping, t, 0, [1.0], ignore_errors=True)
        assert not part.success
        assert part.statistics.status in (Status.DIVERGED, Status.STEP_TOO_SMALL)
        np.testing.assert_allclose(part.states[0][:9], 1 / (1 - t[:9]), rtol=1e-6)
        assert part.time[-1] <= 1

    def test_overflow_of_the_nussbaum_gain(self):
        """exp(zeta^2) overflows at 26.64: at zeta = 30 there is no finite right-hand side."""
        with pytest.raises(nlctl.errors.DivergedError, match="no finite state after t = 0 s"):
            nlctl.input_output_response(
                nlctl.compile(nlctl.paper.example_1()), [0, 1], 0, {"law.zeta": 30.0}
            )

    def test_nan_from_a_block(self):
        """A block that returns NaN from t = 0.5 on ends the run there."""
        broken = exact(lambda t, x, u, params: np.array([np.nan if t > 0.5 else 1.0]))
        with pytest.raises(nlctl.errors.DivergedError) as caught:
            nlctl.input_output_response(broken, [0, 1])
        assert caught.value.time == pytest.approx(0.5, abs=1e-6)

    def test_limit_of_steps(self, oscillator):
        """A run that would take too long stops and says so."""
        with pytest.raises(nlctl.errors.DivergedError, match="limit of steps"):
            nlctl.input_output_response(oscillator, [0, 1e6], 0, [1.0, 0.0], max_steps=100)

    def test_discrete_time_gives_the_same_response_as_python_control(self):
        """x[k+1] = 0.5 x[k] + u[k], to the last bit, and statistics as for any run."""
        system = ct.ss(0.5, 1, 1, 0, dt=0.1, name="sampled")
        t = 0.1 * np.arange(20)
        run = nlctl.input_output_response(nlctl.compile(system), t, np.sin(t), 1.0)
        plain = ct.input_output_response(system, t, np.sin(t), 1.0)
        np.testing.assert_array_equal(run.states, plain.states)
        assert run.statistics.status is Status.OK

    def test_a_static_system_has_outputs(self):
        """No states: the outputs follow the inputs."""
        gain = nlctl.compile(nlctl.block(nlctl.DeadZone(), "zone"))
        t = np.linspace(0, 1, 5)
        run = nlctl.input_output_response(gain, t, t - 0.5)
        wanted = nlctl.block(nlctl.DeadZone(), "zone")
        np.testing.assert_allclose(run.y[0], [float(wanted([v])) for v in t - 0.5])


@pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT")
class TestCache:
    """Compiled programs are found again, and never stale."""

    SCRIPT = (
        "import sys, nlctl, numpy as np\n"
        "from nlctl.native.machine import finish\n"
        "made, right = [], finish._object_code\n"
        "finish._object_code = lambda text: made.append(text) or right(text)\n"
        "compiled = nlctl.compile(nlctl.block(nlctl.DeadZone(slope_r=float(sys.argv[1])), 'z'))\n"
        "print(compiled.output(0.0, [], [2.0])[0], len(made))\n"
    )

    def start(self, folder, slope):
        result = subprocess.run(
            [sys.executable, "-c", self.SCRIPT, str(slope)],
            env=os.environ | {"NLCTL_CACHE_DIR": str(folder)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        value, compilations = result.stdout.split()
        return float(value), int(compilations)

    @pytest.mark.ci
    def test_a_second_process_compiles_nothing(self, tmp_path):
        """Other parameters use the same machine code."""
        first, compilations = self.start(tmp_path, 1.0)
        assert compilations > 0
        second, compilations = self.start(tmp_path, 2.0)
        assert compilations == 0
        assert second - first == pytest.approx(1.5)  # one unit of slope at u - b_r = 1.5

    @pytest.mark.weekly
    @pytest.mark.ci
    def test_an_unwritable_cache_costs_time_only(self, tmp_path):
        """A file in the place of the folder: the program still runs."""
        blocked = tmp_path / "file"
        blocked.write_text("")
        assert self.start(blocked / "cache", 1.0)[0] == pytest.approx(1.5 * (1 + 0.3 * np.sin(2.0)))

    def test_an_edited_equation_is_another_program(self):
        """Code, closure constants and called functions count; parameters and names do not."""

        def program(scale, source):
            made = source_text.run(
                f"def f(t, x, u, params):\n    return [{source}]\n",
                {"np": np, "inner": (lambda v: scale * v)},
            )
            system = ct.nlsys(None, made["f"], inputs=1, outputs=1, name="edited")
            return nlctl.compile(system).lowered.text

        base = program(1.0, "inner(u[0])")
        assert program(1.0, "inner(u[0])") == base
        assert program(2.0, "inner(u[0])") != base
        assert program(1.0, "inner(u[0]) + 1") != base
        first = nlctl.compile(nlctl.paper.example_1()).lowered.text
        other = nlctl.compile(nlctl.paper.example_1(p1=0.3, centres="3x9")).lowered.text
        assert first == other

    def test_the_folder_can_be_chosen(self, monkeypatch, tmp_path):
        """NLCTL_CACHE_DIR goes before the user's cache folder."""
        monkeypatch.setenv("NLCTL_CACHE_DIR", str(tmp_path))
        assert cache_folder() == tmp_path


def test_a_run_that_takes_the_memory_of_another_leaves_its_response_alone():
    """The next run of a loop lays out nothing; what was returned before is not its memory."""
    compiled, times = nlctl.compile(OSCILLATOR), np.linspace(0.0, 2.0, 21)
    first = nlctl.input_output_response(compiled, times, 0.0, [1.0, 0.0], return_states=True)
    for start in ([0.0, 1.0], [3.0, 0.0]):
        nlctl.input_output_response(compiled, times, 1.0, start)
        nlctl.input_output_response(compiled, times[:5], 1.0, start)  # memory of another size
    np.testing.assert_allclose(first.x, [np.cos(times), -np.sin(times)], atol=1e-7)
    np.testing.assert_array_equal(first.t, times)
    again = nlctl.input_output_response(compiled, times, 0.0, [1.0, 0.0])
    np.testing.assert_array_equal(again.x, first.x)
    assert not np.shares_memory(again.x, first.x)
