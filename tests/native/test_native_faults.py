"""What goes wrong ends with a status and a time, and what was asked wrongly with a sentence."""

from typing import Any

import control as ct
import numpy as np
import pytest
from numba.core import config
from scipy.integrate import solve_ivp
from scipy.special import ber

import nlctl
from nlctl.native import Status, uninterrupted

run: Any = nlctl.input_output_response
interpreted = bool(getattr(config, "DISABLE_JIT", False))
ENDED = (Status.DIVERGED, Status.STEP_TOO_SMALL, Status.STEP_LIMIT)


def compiled(update, states=1, inputs=0, **params):
    """Return x' = update(t, x, u, params), compiled, with the states as outputs."""
    return nlctl.compile(
        ct.nlsys(
            update,
            lambda t, x, u, params: x,
            inputs=inputs,
            outputs=states,
            states=states,
            params=params,
            name="faulty",
        )
    )


@pytest.fixture(scope="module")
def power():
    """x' = x^p."""
    return compiled(lambda t, x, u, params: np.array([x[0] ** params["p"]]), p=2.0)


@pytest.fixture(scope="module")
def linear():
    """x' = k x + u."""
    return compiled(lambda t, x, u, params: np.array([params["k"] * x[0] + u[0]]), inputs=1, k=-1.0)


class TestDivergence:
    """The state leaves the finite numbers: the run says when."""

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
    @pytest.mark.parametrize("p", [2.0, 3.0, 5.0])
    def test_finite_escape(self, power, method, p):
        """x' = x^p from 1 escapes at 1 / (p - 1), and is right until then."""
        escape, times = 1 / (p - 1), np.linspace(0, 2 / (p - 1), 21)
        made = run(
            power, times, 0, [1.0], params={"p": p}, method=method, ignore_errors=True, rtol=1e-9
        )
        assert made.statistics.status in (Status.DIVERGED, Status.STEP_TOO_SMALL)
        assert made.statistics.time == pytest.approx(escape, rel=1e-6)
        assert not made.success
        kept = made.time[:9]
        assert made.time[-1] <= escape * (1 + 1e-9)
        np.testing.assert_allclose(made.states[0, :9], (1 - kept / escape) ** (-escape), rtol=1e-6)

    def test_overflow(self, linear):
        """x' = 200 x passes 1e308 at t = ln(1.8e308) / 200."""
        made = run(linear, np.linspace(0, 5, 51), 0, [1.0], params={"k": 200.0}, ignore_errors=True)
        assert made.statistics.status is Status.DIVERGED
        assert made.statistics.time == pytest.approx(np.log(np.finfo(float).max) / 200, abs=0.05)
        assert np.all(np.isfinite(made.states))

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
    @pytest.mark.parametrize("k", [-1e100, -1e200, -1e300, 1e300, -np.inf, np.nan])
    def test_infinite_stiffness(self, linear, method, k):
        """Ends at once: with 0, the limit, or with a status, never with another number."""
        times = [0.0, 1.0]
        made = run(
            linear,
            times,
            0,
            [1.0],
            params={"k": k},
            method=method,
            max_steps=2000,
            ignore_errors=True,
        )
        if made.statistics.status is Status.OK:
            assert k < 0
            assert abs(made.states[0, -1]) < 1e-8
        else:
            assert made.statistics.status in ENDED
            assert made.statistics.time < 1e-9

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
    @pytest.mark.parametrize("start", [np.nan, np.inf])
    def test_a_start_that_is_no_number(self, linear, method, start):
        """Diverged at t = 0; nothing else is delivered."""
        with pytest.raises((nlctl.errors.DivergedError, nlctl.errors.ParameterError)):
            run(linear, [0, 1], 0, [start], method=method)

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
    def test_nan_from_a_block(self, method):
        """sqrt(1 - t) is not a number from t = 1 on."""
        root = compiled(lambda t, x, u, params: np.array([np.sqrt(1.0 - t)]))
        made = run(root, np.linspace(0, 2, 21), ignore_errors=True, method=method)
        assert made.statistics.status is Status.DIVERGED
        assert made.statistics.time == pytest.approx(1, abs=1e-3)
        done = made.time
        np.testing.assert_allclose(
            made.states[0], 2 / 3 * (1 - np.clip(1 - done, 0, 1) ** 1.5), atol=1e-6
        )

    def test_a_memory_passes_nan_on(self):
        """A play whose input turns NaN, the square root of 1 - t from t = 1 on, is no calm play."""
        root = ct.nlsys(
            None, lambda t, x, u, params: [np.sqrt(1.0 - t)], inputs=0, outputs="u", name="root"
        )
        play = nlctl.block(nlctl.Backlash(), "play")
        with pytest.raises(nlctl.errors.DivergedError):
            run(nlctl.compile(ct.interconnect([root, play], outputs="v")), np.arange(5.0))

    def test_a_discontinuity_is_no_divergence(self):
        """x' = 1 before t = 1 and -1 after: x(2) = 0, whatever the steps."""
        jump = compiled(lambda t, x, u, params: np.array([1.0 if t < 1.0 else -1.0]))
        for method in ("tsit5", "rodas5p"):
            made = run(jump, [0, 2.0], method=method)
            assert made.states[0, -1] == pytest.approx(0, abs=1e-6)


class TestLimits:
    """Runs that somebody ends."""

    def test_the_limit_of_steps_is_kept(self, linear):
        """Accepted and rejected steps together."""
        for limit in (1, 7, 50):
            made = run(linear, [0, 1e9], 1.0, [0.0], params={"k": -1.0}, max_steps=limit,
                       step=1e-3, ignore_errors=True)  # fmt: skip
            assert made.statistics.status is Status.STEP_LIMIT
            assert made.statistics.accepted + made.statistics.rejected == limit
            assert made.statistics.time == pytest.approx(limit * 1e-3)
            assert made.time.tolist() == [0.0]

    def interrupted(self, after):
        reports = []

        def progress(t):
            reports.append(t)
            if len(reports) == after:
                raise KeyboardInterrupt

        return reports, progress

    def test_ctrl_c_keeps_what_is_done(self, linear):
        """The part until then is right; the response says that it is a part."""
        reports, progress = self.interrupted(1)
        times = np.linspace(0, 50, 5001)
        made = run(linear, times, 1.0, [0.0], step=1e-3, progress=progress, ignore_errors=True)
        assert made.statistics.status is Status.STOPPED
        assert made.statistics.time == reports[-1]
        assert 0 < made.statistics.time < 50
        assert made.time[-1] <= made.statistics.time < made.time[-1] + 0.02
        np.testing.assert_allclose(made.states[0], 1 - np.exp(-made.time), atol=1e-9)
        assert not made.success
        with pytest.raises(KeyboardInterrupt, match="was stopped at t ="):
            uninterrupted(made)

    def test_ctrl_c_raises_otherwise(self, linear):
        """No error that a loop over many runs would take for one of them; it says where."""
        _, progress = self.interrupted(1)
        with pytest.raises(KeyboardInterrupt, match="was stopped at t ="):
            run(linear, [0, 50.0], 1.0, [0.0], step=1e-3, progress=progress)

    def test_progress_rises_to_the_end(self, linear):
        """The times that are reported."""
        reports = []
        run(linear, [0, 6.0], 1.0, [0.0], step=1e-3, progress=reports.append)
        assert len(reports) >= 3
        assert reports == sorted(reports)
        assert reports[-1] == 6.0


class TestBadInput:
    """Every refusal names what is wrong."""

    @pytest.mark.parametrize(
        ("times", "message"),
        [
            ([], "at least two times"),
            ([0.0], "at least two times"),
            (0.0, "at least two times"),
            ([[0.0, 1.0]], "at least two times"),
            ([1.0, 0.0], "increasing"),
            ([0.0, 0.0], "increasing"),
            ([0.0, 2.0, 1.0], "increasing"),
            ([0.0, np.nan], "finite"),
            ([0.0, np.inf], "finite"),
        ],
    )
    def test_time_grids(self, linear, times, message):
        """Empty, one point, unsorted, repeated, not finite."""
        with pytest.raises(nlctl.errors.ParameterError, match=message):
            run(linear, times)

    @pytest.mark.parametrize(
        "u", [[1.0, 2.0], np.ones((2, 3)), np.ones((3, 1)), np.ones((1, 1, 3))]
    )
    def test_inputs_of_a_wrong_shape(self, linear, u):
        """Three times, one input."""
        with pytest.raises(nlctl.errors.ParameterError, match=r"inputs need shape \(1, 3\)"):
            run(linear, [0, 1, 2], u)

    @pytest.mark.parametrize(
        ("settings", "message"),
        [
            ({"rtol": 0}, "0 < rtol < 1, got 0"),
            ({"rtol": np.nan}, "0 < rtol < 1, got nan"),
            ({"atol": -1.0}, "finite atol > 0"),
            ({"step": -0.1}, "step must be > 0"),
            ({"step": np.nan}, "step must be > 0"),
            ({"max_steps": 0}, "max_steps must be >= 1"),
        ],
    )
    def test_settings(self, linear, settings, message):
        """Tolerances, steps, limits."""
        with pytest.raises(nlctl.errors.ParameterError, match=message):
            run(linear, [0, 1], **settings)

    def test_names(self, linear):
        """Method, parameter, state."""
        with pytest.raises(
            nlctl.errors.UnknownNameError, match=r"unknown method 'rodas5'.*rodas5p"
        ):
            run(linear, [0, 1], method="rodas5")
        play = nlctl.compile(nlctl.block(nlctl.Backlash(), "play"))
        with pytest.raises(
            nlctl.errors.UnknownNameError, match="'c_x' of block 'play'; nearest: 'c_r'"
        ):
            run(play, [0, 1], params={"play.c_x": 1.0})
        with pytest.raises(nlctl.errors.UnknownNameError, match=r"x\[7\]"):
            run(linear, [0, 1], 0, {"x[7]": 1.0})
        with pytest.raises(TypeError, match="longest"):
            run(linear, [0, 1], longest=1)

    def test_states_of_a_wrong_length(self, linear):
        """Three numbers for one state."""
        with pytest.raises(nlctl.errors.ParameterError, match="needs 1 value for"):
            run(linear, [0, 1], 0, [1.0, 2.0, 3.0])


class TestTime:
    """Time grids that are unusual but right."""

    @pytest.mark.parametrize("start", [-5.0, 1e3, 1e6, -1e9])
    @pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
    def test_any_start(self, linear, start, method):
        """The decay over one second does not depend on when it starts."""
        made = run(linear, [start, start + 1.0], 0, [1.0], method=method)
        assert made.states[0, -1] == pytest.approx(np.exp(-1), abs=1e-7)

    @pytest.mark.parametrize("scale", [1e-12, 1e-6, 1e9])
    def test_any_unit_of_time(self, linear, scale):
        """Picoseconds and aeons."""
        made = run(linear, scale * np.arange(3.0), 0, [1.0], params={"k": -1 / scale})
        np.testing.assert_allclose(made.states[0], np.exp(-np.arange(3.0)), atol=1e-7)

    def test_the_smallest_grid_step(self, linear):
        """Two neighbouring floats."""
        made = run(linear, [1.0, np.nextafter(1.0, 2.0), 2.0], 0, [1.0])
        assert made.states[0, -1] == pytest.approx(np.exp(-1), abs=1e-8)


def lotka_volterra(t, x, u=None, params=None):
    """Predator and prey."""
    return np.array([x[0] * (1.5 - x[1]), x[1] * (x[0] - 3.0)])


def kepler(t, x, u=None, params=None):
    """Kepler's ellipse of eccentricity 0.6."""
    cube = (x[0] * x[0] + x[1] * x[1]) ** 1.5
    return np.array([x[2], x[3], -x[0] / cube, -x[1] / cube])


class TestWorkPrecision:
    """Evaluations of the right-hand side for an error, against SciPy's methods."""

    @pytest.mark.parametrize(
        ("problem", "start", "end"),
        [(lotka_volterra, [1.0, 1.0], 10.0), (kepler, [0.4, 0.0, 0.0, 2.0], 10.0)],
    )
    def test_no_more_work_than_rk45(self, problem, start, end):
        """Six evaluations per attempt; at the error reached, RK45 needs as many or more."""
        exact = solve_ivp(problem, (0, end), start, "DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        work, errors = [], []
        for tolerance in 10.0 ** np.arange(-12, -3):
            solution = solve_ivp(problem, (0, end), start, "RK45", rtol=tolerance, atol=tolerance)
            work.append(solution.nfev)
            errors.append(abs(solution.y[:, -1] - exact).max())
        system = compiled(problem, len(start))
        for tolerance in (1e-6, 1e-8, 1e-10):
            made = run(system, [0, end], 0, start, method="tsit5", rtol=tolerance, atol=tolerance)
            error = abs(made.states[:, -1] - exact).max()
            ours = 6 * (made.statistics.accepted + made.statistics.rejected)
            order = np.argsort(errors)
            theirs = np.exp(np.interp(np.log(error), np.log(errors)[order], np.log(work)[order]))
            assert error < 3e3 * tolerance
            assert ours < 1.25 * theirs

    def test_events_cost_little(self):
        """A corner costs a few attempts, not dozens."""
        loop = nlctl.compile(nlctl.paper.example_1())
        run_of = run(loop, [0, 0.5 if interpreted else 20.0], rtol=1e-8).statistics
        assert run_of.rejected < 6 * run_of.events + 0.2 * run_of.accepted


def raising(t, x, u, params):
    """It cannot be traced, and raises an error from a certain time on."""
    value = x[0] + 0.0 * ber(x[0])
    if t > 0.5:
        raise ValueError("too late")
    return [-value]


BEYOND = {
    "run": lambda made: nlctl.input_output_response(made, [0, 1.0], 0, [1.0]),
    "ensemble": lambda made: nlctl.ensemble_response(
        made, [0, 1.0], initial_state={"late.x[0]": [1.0, 2.0]}
    ),
    "evaluation": lambda made: made.dynamics(0.7, [1.0]),
}


@pytest.mark.slow
@pytest.mark.parametrize("kind", BEYOND)
def test_what_an_opaque_function_raises_is_passed_on(kind):
    """Through machine code, which knows no exceptions; before that time all is well."""
    made = nlctl.compile(ct.nlsys(raising, None, inputs=0, outputs=1, states=1, name="late"))
    early = nlctl.input_output_response(made, [0, 0.4], 0, [1.0])
    np.testing.assert_allclose(early.states[0, -1], np.exp(-0.4), rtol=1e-6)
    with pytest.raises(ValueError, match="too late"):
        BEYOND[kind](made)
