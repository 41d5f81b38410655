"""The stiff method's Jacobian and its honesty: exact derivatives, order, drift of Example 2."""

from typing import Any

import control as ct
import numpy as np
import pytest
from numba.core import config
from stiff_problems import PROBLEMS

import nlctl
from nlctl.native.along import derivatives
from nlctl.native.integrate.state import DIRECTIONS

run: Any = nlctl.input_output_response
needs_jit = pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="thousands of steps")


def driven(update, states, inputs=1, name="driven"):
    """Return x' = update(t, x, u, params), compiled, with the states as outputs."""
    return nlctl.compile(
        ct.nlsys(
            update, lambda t, x, u, params: x, inputs=inputs, outputs=states, states=states,
            name=name,
        )
    )  # fmt: skip


def forced(t, x, u, p):
    """A vector that is summed, a product with the input, and time by itself."""
    return np.array([np.sin(3 * t) * x[1] - x[0] ** 3, u[0] * x[0] - np.sum(x * x) + u[1] * t])


def diagram(name):
    """Return a compiled diagram and a state of it."""
    if name in nlctl.paper.EXAMPLES:
        compiled = nlctl.compile(nlctl.paper.EXAMPLES[name]())
        x = np.asarray(nlctl.initial_state(compiled.system), dtype=float)
        return compiled, x + 0.3 * np.cos(np.arange(x.size))
    if name == "forced":
        return driven(forced, 2, inputs=2), np.array([0.7, -0.4])
    update, _, x0 = PROBLEMS[name]
    return driven(update, len(x0), inputs=0), np.array(x0) + 0.1


class TestExact:
    """Machine code along directions, against other ways to the same numbers."""

    @pytest.mark.parted
    @pytest.mark.parametrize("name", ["example_1", "example_2", "forced", *PROBLEMS])
    def test_columns_are_those_of_the_linearization(self, name):
        """Which evaluates the expressions one by one, in NumPy; time is by central differences."""
        compiled, x = diagram(name)
        n, m = x.size, compiled.system.ninputs or 0
        u, t = 0.5 + np.arange(m), 0.37
        made = derivatives(compiled, compiled.parameter_vector())
        assert made is not None
        v, found = np.eye(n + m + 1), []
        for first in range(0, n + m + 1, DIRECTIONS):
            part = np.zeros((n + m + 1, DIRECTIONS))
            columns = v[:, first : first + DIRECTIONS]
            part[:, : columns.shape[1]] = columns
            dx = np.full((n, DIRECTIONS), np.nan)
            repeated = [np.repeat(np.atleast_1d(a)[:, None], DIRECTIONS, 1) for a in (x, u)]
            made.point(np.full(DIRECTIONS, t), *repeated, made.c)
            made.function(np.full(DIRECTIONS, t), *repeated, made.c, part, dx)
            found.append(dx[:, : columns.shape[1]])
        found = np.hstack(found)
        linear = compiled.linearize(x, u if m else None, t)
        scale = 1 + np.abs(linear.A).max()
        np.testing.assert_allclose(found[:, :n], linear.A, rtol=1e-11, atol=1e-13 * scale)
        np.testing.assert_allclose(found[:, n : n + m], linear.B, rtol=1e-11, atol=1e-13)
        h = 1e-5
        later, before = (compiled.dynamics(t + s, x, u) for s in (h, -h))
        np.testing.assert_allclose(
            found[:, -1], (later - before) / (2 * h), rtol=1e-6, atol=1e-8 * scale
        )

    def test_integers_of_the_call_steer_what_is_differentiated(self):
        """x' = -1.5^n x, by a loop of n passes: the derivative for every n of a call."""

        def passes(t, x, u, p):
            y = -x[0]
            for _ in range(p["n"]):
                y = 1.5 * y
            return [y]

        system = ct.nlsys(passes, None, inputs=0, states=["x"], params={"n": 2}, name="loop")
        compiled = nlctl.compile(system)
        for n in (2, 5, 0, 5):
            made = derivatives(compiled, compiled.parameter_vector({"loop.n": n}))
            assert made is not None
            v, dx = np.zeros((2, DIRECTIONS)), np.full((1, DIRECTIONS), np.nan)
            v[0] = np.arange(DIRECTIONS)
            here = [np.zeros((k, DIRECTIONS)) for k in (1, 0)]
            made.point(np.zeros(DIRECTIONS), *here, made.c)
            made.function(np.zeros(DIRECTIONS), *here, made.c, v, dx)
            assert np.allclose(dx[0], -(1.5**n) * v[0], rtol=1e-14, atol=0)

    @pytest.mark.slow
    def test_an_opaque_function_is_differentiated_by_differences_and_named(self):
        """The printed form says which; the numbers are the traced twin's."""

        def opaque(t, x, u, p):
            k = 0
            while k * k < 50 + 0 * x[0]:  # a loop that the values decide
                k += 1
                if k < 3:
                    continue  # a pass with one is not written out
            return np.array([-k * 100.0 * (x[0] - np.cos(t))])

        compiled = driven(opaque, 1, inputs=0)
        assert derivatives(compiled, compiled.parameter_vector()) is not None
        assert "Jacobian     exact, with differences where" in repr(compiled)
        plain = driven(lambda t, x, u, p: np.array([-800.0 * (x[0] - np.cos(t))]), 1, inputs=0)
        assert "Jacobian     exact" in repr(plain)
        ends = [
            run(each, [0, 1.0], 0, [1.0], method="rodas5p", rtol=1e-8).states[0, -1]
            for each in (compiled, plain)
        ]
        assert ends[0] == pytest.approx(ends[1], abs=1e-8)

    def test_a_derivative_that_is_not_finite_is_taken_by_differences(self):
        """x' = 1 - sqrt(x) from 0: the slope of the root is infinite there."""
        compiled = driven(lambda t, x, u, p: np.array([1 - np.sqrt(x[0])]), 1, inputs=0)
        made = run(compiled, [0, 3.0], 0, [0.0], method="rodas5p", rtol=1e-9, atol=1e-12)
        y = np.sqrt(made.states[0, -1])
        assert -2 * (y + np.log1p(-y)) == pytest.approx(3.0, abs=1e-6)  # in closed form


class TestOrder:
    """Of what an error in the Jacobian or in df/dt would spoil."""

    def test_inputs_that_rise_count_in_the_time_derivative(self):
        """x' = -50 (x - u) + u' with x = u = t: steps of fixed length have the exact solution.

        With df/dt that forgets u a step is of order 1 and not exact for a ramp.
        """
        compiled = driven(lambda t, x, u, p: np.array([-50.0 * (x[0] - u[0]) + 1.0]), 1)
        made = run(compiled, [0, 1.0], [0, 1.0], [0.0], method="rodas5p", step=0.25)
        assert made.statistics.accepted == 4
        assert made.states[0, -1] == pytest.approx(1.0, abs=1e-13)

    def test_stiff_steps_keep_their_order(self):
        """x' = -k (x^3 - cos^3 t) - sin t, x = cos t: order 4 and more where h k >> 1."""

        def update(t, x, u, p):
            return np.array([-1e5 * (x[0] ** 3 - np.cos(t) ** 3) - np.sin(t)])

        compiled, errors = driven(update, 1, inputs=0), []
        for steps in (8, 16, 32):
            made = run(compiled, [0, 1.0], 0, [1.0], method="rodas5p", step=1 / steps)
            errors.append(abs(made.states[0, -1] - np.cos(1.0)))
        assert np.all(np.log2(errors[:-1]) - np.log2(errors[1:]) > 3.5), errors


@pytest.fixture(scope="module")
def example_2():
    """Example 2 compiled; from zeta(0) = 2.5 its fast mode has 5000 1/s."""
    return nlctl.compile(nlctl.paper.example_2())


def from_2_5(compiled, times, method, rtol):
    return run(
        compiled, times, 0, {"law.zeta": 2.5}, method=method, rtol=rtol, atol=rtol / 100,
        audit=False,
    )  # fmt: skip


@needs_jit
class TestBacklashInAStiffLoop:
    """Example 2: what the backlash is driven by amplifies errors of r by 6000."""

    def test_the_carried_memory_is_as_accurate_as_any_state(self, example_2):
        """Between two turns, at the ends of steps: its error falls with the tolerance."""
        for end in (1.1, 1.3):
            exact = from_2_5(example_2, [0.0, end], "tsit5", 1e-11)
            i = exact.output_labels.index("v")
            v = float(exact.outputs[i, -1])
            for rtol in (1e-5, 1e-6, 1e-7, 1e-8):
                made = from_2_5(example_2, [0.0, end], "rodas5p", rtol)
                assert float(made.outputs[i, -1]) == pytest.approx(v, rel=10 * rtol)

    @pytest.mark.weekly
    @pytest.mark.ci
    def test_the_drift_of_zeta_is_the_same_by_all_methods(self, example_2):
        """Over 100 s: zeta drifts by 1.1e-2, and all agree to a thousandth of that and better."""
        exact, rows = from_2_5(example_2, [0, 100.0], "tsit5", 1e-9), {}
        i = exact.output_labels.index("zeta")
        for method, rtol in (("rodas5p", 1e-6), ("auto", 1e-6), ("rodas5p", 1e-8), ("auto", 1e-8)):
            made = from_2_5(example_2, [0, 100.0], method, rtol)
            rows[method, rtol] = made.outputs[i, -1] - exact.outputs[i, -1]
        drift = exact.outputs[i, -1] - 2.5
        assert 0.01 < drift < 0.012
        for (_, rtol), error in rows.items():
            assert abs(error) < (5e-6 if rtol == 1e-6 else 2.5e-6)
