"""Observers: errors in closed form, peaking, and the Kalman filter that the extended one is."""

import control as ct
import numpy as np
import pytest
import scipy.linalg
import scipy.special
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.expressions.graph import Untraceable
from nlctl.expressions.jacobian_source import jacobian_function

TIGHT = {"rtol": 1e-10, "atol": 1e-12}
A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, -2.0, -1.5]])
B, C = np.array([[0.0], [0.0], [1.0]]), np.array([[1.0, 0.0, 0.0]])
every_engine = pytest.mark.parametrize("engine", ["native", "python-control"])


def linear_plant():
    return ct.ss(A, B, C, 0, inputs="u", outputs="y", states=["x1", "x2", "x3"], name="plant")


def with_observer(observer, plant, x0, times, engine="native", u=0.0):
    """Run a plant with an observer from x_hat = 0; return errors, estimates and the response."""
    parts = {"plant": plant, "observer": observer}
    loop = nlctl.interconnect(parts, inputs=["u"], outputs=["y", *observer.outputs])
    start = {f"plant.{name}": v for name, v in zip(plant.state_labels, x0, strict=True)}
    run = nlctl.input_output_response(loop, times, u, start, engine=engine, **TIGHT)
    n = len(x0)
    x, estimates = np.array(run.states)[:n], np.array(run.outputs)[1:]
    return x - estimates, estimates, run


class TestLuenberger:
    @every_engine
    def test_a_plant_needs_no_input(self, engine):
        """Of x'' = -4 x alone the error is exp(-2 t) (1 + 2 t) of that at t = 0."""
        plant = ct.nlsys(
            lambda t, x, u, params: [x[1], -4 * x[0]], lambda t, x, u, params: x[0],
            inputs=0, outputs=["y"], states=["p", "q"], name="plant",
        )  # fmt: skip
        linear = nlctl.linearize(plant, [0.0, 0.0])
        assert linear.ninputs == 0
        np.testing.assert_array_equal(linear.A, [[0, 1], [-4, 0]])
        record = nlctl.observers.luenberger(linear, [-2.0, -2.0])
        assert record.inputs == ("y",)
        parts = {"plant": plant, "observer": record}
        loop = nlctl.interconnect(parts, inputs=[], outputs=["y", "x1_hat"])
        t = np.linspace(0, 3, 31)
        run = nlctl.input_output_response(loop, t, 0, {"plant.p": 1.0}, engine=engine, **TIGHT)
        error = run.outputs[0] - run.outputs[1]
        np.testing.assert_allclose(error, np.exp(-2 * t) * (1 - 2 * t), atol=1e-8)

    @every_engine
    @each_row("poles", [(-3.0, -4.0, -5.0), (-2.0, -2.0, -2.0), (-3.0, -2 + 2j, -2 - 2j)])
    def test_the_error_is_that_of_its_poles(self, poles, engine):
        """exp((A - L C) t) (x(0) - x_hat(0)), whatever u is; its eigenvalues are the poles."""
        plant, x0 = linear_plant(), np.array([1.0, -0.5, 0.3])
        observer = nlctl.observers.luenberger(plant, poles=poles)
        t = np.linspace(0, 3, 31)
        error, _, _ = with_observer(observer, plant, x0, t, engine, u=np.sin(5 * t))
        closed = A - np.array(observer.L) @ C
        exact = np.array([scipy.linalg.expm(closed * s) @ x0 for s in t]).T
        np.testing.assert_allclose(error, exact, atol=1e-7)
        np.testing.assert_allclose(np.poly(closed), np.poly(poles), rtol=1e-9)

    @settings(max_examples=many(20, part=4), deadline=None)
    @given(st.integers(0, 10_000))
    def test_poles_of_random_plants(self, seed):
        """With two outputs, and a direct path from u to y."""
        rng = np.random.default_rng(seed)
        plant = ct.ss(*(rng.normal(size=s) for s in ((4, 4), (4, 1), (2, 4), (2, 1))))
        poles = np.array([-1.0, -2.0, -3.0, -4.0])
        observer = nlctl.observers.luenberger(plant, poles=poles)
        closed = np.array(observer.A) - np.array(observer.L) @ np.array(observer.C)
        np.testing.assert_allclose(np.sort(np.linalg.eigvals(closed).real), poles[::-1], rtol=1e-5)
        x, u = rng.normal(size=4), rng.normal(size=1)
        y = plant.C @ x + plant.D @ u  # where x_hat = x it moves as the plant does
        moved = nlctl.block(observer, "observer").dynamics(0, x, np.append(u, y))
        np.testing.assert_allclose(moved, plant.A @ x + plant.B @ u, atol=1e-9)

    def test_separation(self):
        """With u = -K x_hat the poles of the loop are those of A - B K and of A - L C."""
        plant = linear_plant()
        K = ct.place(A, B, [-1.0, -1.5, -2.0])
        names = [f"x{i}_hat" for i in (1, 2, 3)]
        law = ct.ss([], [], [], np.append(-K, [[1.0]], 1), inputs=[*names, "d"], outputs="u")
        observer = nlctl.observers.luenberger(plant, poles=[-5.0, -6.0, -7.0])
        parts = {"plant": plant, "observer": observer, "law": law}
        loop = nlctl.compile(nlctl.interconnect(parts, inputs=["d"], outputs=["y"]))
        poles = np.linalg.eigvals(loop.linearize(np.zeros(6)).A)
        np.testing.assert_allclose(np.sort(poles.real), [-7, -6, -5, -2, -1.5, -1], rtol=1e-6)

    @each_row(
        ("values", "told"),
        [
            ({}, "either poles or L"),
            ({"poles": [-1, -2]}, "3 poles for 'plant', got 2"),
            ({"poles": [-1, -2, -3], "L": 1}, "either poles or L"),
        ],
    )
    def test_what_is_refused_of_poles(self, values, told):
        with pytest.raises(nlctl.errors.ParameterError, match=rf"^luenberger needs {told}"):
            nlctl.observers.luenberger(linear_plant(), **values)

    def test_what_cannot_be_observed_is_refused(self):
        """By name; and what is no plant in continuous time with an input."""
        blind = ct.ss(np.diag([1.0, 2.0]), [[1], [1]], [[1, 0]], 0, name="blind")
        with pytest.raises(nlctl.errors.ParameterError, match="'blind'"):
            nlctl.observers.luenberger(blind, poles=[-1.0, -2.0])
        with pytest.raises(nlctl.errors.ParameterError, match=r"continuous time .* dt = 0\.1"):
            nlctl.observers.luenberger(ct.ss(0.5, 1, 1, 0, 0.1), poles=[-1.0])
        with pytest.raises(nlctl.errors.ParameterError, match=r"L of shape 2 x 1 .* got 1 x 2"):
            nlctl.observers.LuenbergerObserver(L=((1.0, 2.0),))
        with pytest.raises(nlctl.errors.ParameterError, match=r"needs 1 in measured, got 2"):
            nlctl.observers.LuenbergerObserver(measured=("a", "b"))


class TestHighGain:
    def chain(self):
        return ct.ss(
            [[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y",
            states=["x1", "x2"], name="plant",
        )  # fmt: skip

    @every_engine
    @each_row("epsilon", [0.1, 0.01])
    def test_the_peak_of_the_second_estimate(self, epsilon, engine):
        """alpha = (2, 1), x_2 = 0, error 1 in x_1: x_hat_2 = t / epsilon^2 exp(-t / epsilon)."""
        t = np.linspace(0, 12 * epsilon, 121)
        spec = nlctl.observers.HighGainObserver(alpha=(2.0, 1.0), epsilon=epsilon)
        observer = type(spec)(known="u", model=known_input, epsilon=epsilon)
        error, estimates, _ = with_observer(observer, self.chain(), [1.0, 0.0], t, engine)
        exact = t / epsilon**2 * np.exp(-t / epsilon)
        np.testing.assert_allclose(estimates[1], exact, atol=1e-7 / epsilon)
        np.testing.assert_allclose(error[0], (1 - t / epsilon) * np.exp(-t / epsilon), atol=1e-7)
        assert estimates[1].max() == pytest.approx(np.exp(-1) / epsilon, rel=1e-6)

    @each_row("epsilon", [0.2, 0.05, 0.0125])
    def test_an_unknown_input_leaves_an_error_of_the_order_of_epsilon(self, epsilon):
        """x_1'' = 1, which phi_0 = 0 does not know: errors epsilon^2, and 2 epsilon in x_2."""
        spec = nlctl.observers.HighGainObserver(alpha=(2.0, 1.0), epsilon=epsilon)
        t = np.linspace(0, 40 * epsilon, 3)
        step = ct.ss([], [], [], 1, inputs="w", outputs="u", name="gain")
        parts = {"plant": self.chain(), "observer": spec, "gain": step}
        loop = nlctl.interconnect(parts, inputs=["w"], outputs=["y"])
        run = nlctl.input_output_response(loop, t, 1.0, **TIGHT)
        x1, x2, x1_hat, x2_hat = np.array(run.states)[:, -1]
        assert x1 - x1_hat == pytest.approx(epsilon**2, rel=1e-5)
        assert x2 - x2_hat == pytest.approx(2 * epsilon, rel=1e-5)

    def test_its_poles_are_those_of_alpha_divided_by_epsilon(self):
        spec = nlctl.observers.HighGainObserver(alpha=(6.0, 11.0, 6.0), epsilon=0.1)
        linear = nlctl.compile(nlctl.block(spec, "o")).linearize(np.zeros(3), [0.0])
        poles = np.sort(np.linalg.eigvals(linear.A).real)
        np.testing.assert_allclose(poles, [-30.0, -20.0, -10.0], rtol=1e-9)

    @each_row(
        ("values", "told"),
        [
            ({"alpha": (1.0, 1.0, 3.0)}, r"Hurwitz .* got alpha \(1\.0, 1\.0, 3\.0\)"),
            ({"epsilon": 0.0}, "epsilon > 0, got 0"),
            ({"known": "u"}, r"a model that takes \('u',\)"),
            ({"measured": ""}, "a name for measured, got ''"),
            ({"model": 3.0}, "a function for model, got float"),
        ],
    )
    def test_what_is_refused(self, values, told):
        with pytest.raises(nlctl.errors.ParameterError, match=rf"^HighGainObserver needs .*{told}"):
            nlctl.observers.HighGainObserver(**values)


@nlctl.equation
def known_input(x, u):
    return u[0]


@nlctl.equation
def linear_rates(x, u):
    return x[1], x[2], -x[0] - 2.0 * x[1] - 1.5 * x[2] + u[0]


@nlctl.equation
def pendulum(x, u):
    return x[1], -np.sin(x[0]) - 0.1 * x[1] * np.abs(x[1]) + u[0]


@nlctl.equation
def distance(x):
    return (np.hypot(1.0, x[0]), np.exp(x[1]) / 2)


class TestExtendedKalmanFilter:
    Q, R = np.diag([0.1, 0.2, 0.3]), np.array([[0.05]])

    def filter(self, **others):
        return nlctl.observers.ExtendedKalmanFilter(f=linear_rates, Q=self.Q, R=self.R, **others)

    @every_engine
    def test_of_a_linear_plant_it_is_the_kalman_filter(self, engine):
        """P tends to Riccati's solution, and the gain to that of `control.lqe`."""
        plant, t = linear_plant(), np.linspace(0, 30, 4)
        _, _, run = with_observer(self.filter(), plant, [1.0, -0.5, 0.3], t, engine, u=np.cos(t))
        P = np.zeros((3, 3))
        P[np.triu_indices(3)] = np.array(run.states)[-6:, -1]
        L, exact, _ = ct.lqe(A, np.eye(3), C, self.Q, self.R)
        np.testing.assert_allclose(P + np.triu(P, 1).T, exact, atol=1e-7)
        assert np.abs(np.array(L) - exact @ C.T / 0.05).max() < 1e-9

    def test_from_there_it_is_the_luenberger_observer_of_that_gain(self):
        """With P(0) in Riccati's solution, in every instant."""
        plant, t = linear_plant(), np.linspace(0, 8, 41)
        L, P, _ = ct.lqe(A, np.eye(3), C, self.Q, self.R)
        P = (P + P.T) / 2
        x0, u = [1.0, -0.5, 0.3], np.sin(t)
        _, own, _ = with_observer(self.filter(P0=P), plant, x0, t, u=u)
        _, other, _ = with_observer(nlctl.observers.luenberger(plant, L=L), plant, x0, t, u=u)
        np.testing.assert_allclose(own, other, atol=1e-7)

    def test_riccati_of_a_scalar_in_closed_form(self):
        """x' = w, y = x + v: P' = q - P^2 / r, P = sqrt(q r) tanh(t sqrt(q / r)) from 0."""
        q, r, t = 0.4, 0.1, np.linspace(0, 2, 21)
        spec = nlctl.observers.ExtendedKalmanFilter(
            f=still, Q=((q,),), R=((r,),), P0=((0.0,),), known=()
        )
        run = nlctl.input_output_response(nlctl.block(spec, "f"), t, 0.0, **TIGHT)
        exact = np.sqrt(q * r) * np.tanh(t * np.sqrt(q / r))
        np.testing.assert_allclose(np.array(run.states)[1], exact, atol=1e-8)

    @given(st.floats(-3, 3), st.floats(-2, 2), st.floats(-2, 2))
    def test_the_jacobians_are_exact(self, x1, x2, u):
        """Of sine, |x|, a root and an exponential, to the last digits."""
        x = np.array([x1, x2])
        F = jacobian_function(pendulum, 2, 1)(x, np.array([u]))
        np.testing.assert_allclose(
            F, [[0, 1], [-np.cos(x1), -0.2 * np.abs(x2)]], rtol=1e-14, atol=1e-15
        )
        H = jacobian_function(distance, 2)(x)
        exact = [[x1 / np.hypot(1, x1), 0], [0, np.exp(x2) / 2]]
        np.testing.assert_allclose(H, exact, rtol=1e-13, atol=1e-15)

    @given(st.floats(-2, 2), st.floats(-2, 2))
    def test_at_a_point_with_an_expression_of_its_own_they_are_those_next_to_it(self, x1, x2):
        """f = x1 (1 - 2 |x1| x2), written apart where x1 is 0 and where both are equal."""

        def f(x):
            v, z = x
            w = v * (1 - 2 * np.sign(v) * v * z) if v != 0 else 0.0
            return (w if v != z else v - 2 * v * abs(v) * v,)

        made = jacobian_function(f, 2)
        for v, z in ((x1, x2), (0.0, x2), (x2, x2), (0.0, 0.0)):
            exact = [[1 - 4 * abs(v) * z, -2 * abs(v) * v]]
            np.testing.assert_allclose(made(np.array([v, z])), exact, rtol=0, atol=1e-5)

    @pytest.mark.parted
    @every_engine
    def test_a_pendulum_is_found_from_its_angle(self, engine):
        """From an error of 1 rad and 1 rad/s, without noise; everything is machine code."""
        plant = ct.nlsys(
            lambda t, x, u, params: [x[1], -np.sin(x[0]) - 0.1 * x[1] * np.abs(x[1]) + u[0]],
            lambda t, x, u, params: [x[0]],
            inputs="u", outputs="y", states=["x1", "x2"], name="plant",
        )  # fmt: skip
        spec = nlctl.observers.ExtendedKalmanFilter(f=pendulum, Q=0.1 * np.eye(2), R=((0.01,),))
        t = np.linspace(0, 20, 5)
        error, _, run = with_observer(spec, plant, [1.0, 1.0], t, engine, u=0.3 * np.sin(t))
        assert np.abs(error[:, 0]).max() == 1.0
        assert np.abs(error[:, -1]).max() < 1e-6
        if engine == "native":
            assert not run.statistics.opaque

    def test_sampled_it_tends_to_the_continuous_one(self):
        """By Euler's steps: the error of P is of the order of dt, half of it at half of dt."""
        at_last = []
        spec = nlctl.observers.ExtendedKalmanFilter(
            f=still, Q=((0.4,),), R=((0.1,),), P0=((0.0,),), known=()
        )
        for dt in (0.02, 0.01):
            made = nlctl.discretise(nlctl.block(spec, "f"), dt)
            t = np.arange(0, 0.201, dt)
            P = nlctl.input_output_response(made, t, np.zeros((1, t.size))).states[1, -1]
            at_last.append(P - 0.2 * np.tanh(2 * t[-1]))
        assert at_last[0] / at_last[1] == pytest.approx(2.0, rel=0.1)
        plant = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="plant")
        law = nlctl.sampled(nlctl.discretise(nlctl.block(spec, "f"), 0.01))
        loop = nlctl.interconnect({"plant": plant, "f": law}, inputs=["v"], outputs=["x1_hat"])
        y = nlctl.input_output_response(loop, np.linspace(0, 6, 7), 1.0).outputs.ravel()
        assert y[-1] == pytest.approx(1 - np.exp(-6), abs=0.02)

    @each_row(
        ("values", "told"),
        [
            ({"Q": ((1.0, 0.0), (0.5, 1.0))}, "Q symmetric and positive semidefinite, got"),
            ({"R": ((0.0,),)}, "R symmetric and positive definite, got"),
            ({"P0": ((-1.0, 0.0), (0.0, 1.0))}, "P0 symmetric and positive semidefinite"),
            ({"x0": (1.0,)}, r"finite numbers of shape 2 for x0, got \(1.0,\)"),
            ({"f": lambda x, u: (x[0],)}, "f to return 2 of them, as Q has rows, got 1"),
            ({"h": 1.0}, "a function for h, got float"),
            ({"measured": ("a", "b")}, "1 in measured, got 2"),
            ({"h": lambda x: (scipy.special.ber(x[0]),)}, "functions f and h whose expressions"),
        ],
    )
    def test_what_is_refused(self, values, told):
        with pytest.raises(
            nlctl.errors.ParameterError, match=rf"^ExtendedKalmanFilter needs .*{told}"
        ):
            nlctl.observers.ExtendedKalmanFilter(**values)

    def test_more_numbers_than_are_written_out_are_refused(self):
        with pytest.raises(Untraceable, match="more than 8 numbers"):
            jacobian_function(lambda x: x, 9)


@nlctl.equation
def still(x, u):
    return (0.0 * x[0],)
