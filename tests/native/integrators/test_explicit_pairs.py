"""Explicit pairs as tableaus: whatever method is given, the driver takes all of it from there."""

from dataclasses import replace
from fractions import Fraction

import control as ct
import numpy as np
import pytest
from rows import each_row

import nlctl
from nlctl.errors import ParameterError, UnknownNameError
from nlctl.native.integrate.methods import EXPLICIT_PAIRS
from nlctl.native.integrate.methods.tableau import Tableau
from nlctl.native.integrate.methods.tsit5 import TSIT5


def fractions(*texts):
    return tuple(float(Fraction(text)) for text in texts)


BOGACKI_SHAMPINE = Tableau(
    name="Bogacki-Shampine 3(2)", order=3, stable=2.5, c=fractions("0", "1/2", "3/4", "1"),
    a=(fractions("1/2"), fractions("0", "3/4"), fractions("2/9", "1/3", "4/9")),
    error=fractions("-5/72", "1/12", "1/9", "-1/8"),
)  # fmt: skip
DORMAND_PRINCE = Tableau(
    name="Dormand-Prince 5(4)", order=5, stable=3.3,
    c=fractions("0", "1/5", "3/10", "4/5", "8/9", "1", "1"),
    a=(
        fractions("1/5"), fractions("3/40", "9/40"), fractions("44/45", "-56/15", "32/9"),
        fractions("19372/6561", "-25360/2187", "64448/6561", "-212/729"),
        fractions("9017/3168", "-355/33", "46732/5247", "49/176", "-5103/18656"),
        fractions("35/384", "0", "500/1113", "125/192", "-2187/6784", "11/84"),
    ),
    error=fractions("71/57600", "0", "-71/16695", "71/1920", "-17253/339200", "22/525", "-1/40"),
)  # fmt: skip
HEUN_EULER = Tableau(  # whose last stage is not the next one's first: its weights are one more row
    name="Heun-Euler 2(1)", order=2, stable=1.9, c=(0.0, 1.0, 1.0), a=((1.0,), (0.5, 0.5)),
    error=(-0.5, 0.5, 0.0),
)  # fmt: skip
WITH_IDLE_STAGES = replace(  # two that nothing reads: more than the sums that are written out
    TSIT5, name="nine stages", c=(*TSIT5.c[:6], 0.5, 0.5, 1.0),
    a=(*TSIT5.a[:5], (0.5, *[0.0] * 5), (0.5, *[0.0] * 6), (*TSIT5.a[5], 0.0, 0.0)),
    error=(*TSIT5.error[:6], 0.0, 0.0, TSIT5.error[6]),
    dense=(*TSIT5.dense[:6], (0.0,) * 4, (0.0,) * 4, TSIT5.dense[6]),
)  # fmt: skip
TOYS = (BOGACKI_SHAMPINE, DORMAND_PRINCE, HEUN_EULER, WITH_IDLE_STAGES)
toys = pytest.mark.parametrize("method", TOYS, ids=lambda method: method.name)


@pytest.fixture(scope="module")
def quotient():
    """x1' = -2 t x1^2, x2' = x1 - x2: x1 = 1 / (1 + t^2) from x1(0) = 1."""
    return nlctl.compile(
        ct.nlsys(
            lambda t, x, u, p: [-2 * t * x[0] ** 2, x[0] - x[1]],
            None,
            inputs=0,
            outputs=2,
            states=2,
            name="quotient",
        )
    )


def run(system, times, method, **more):
    return nlctl.input_output_response(system, times, 0, [1.0, 0.0], method=method, **more)


class TestToys:
    @toys
    def test_the_error_falls_with_the_order(self, quotient, method):
        """Fixed steps h and h / 2: the error at the end is divided by 2^order."""
        ends = [run(quotient, [0, 2], method, step=h).states[0, -1] for h in (0.05, 0.025, 0.0125)]
        first, second, third = np.abs(np.array(ends) - 0.2)
        found = [np.log2(first / second), np.log2(second / third)]
        assert found == pytest.approx([method.order] * 2, abs=0.4)

    @toys
    def test_inside_a_step_it_is_of_order_three_at_least(self, quotient, method):
        """Samples between the ends of steps: Hermite's cubic, or the method's own polynomial."""
        inside, errors = np.linspace(0, 1.999, 998), []
        for h in (0.1, 0.05):
            made = run(quotient, np.append(inside, 2.0), method, step=h)
            errors.append(np.abs(made.states[0, :-1] - 1 / (1 + inside**2)).max())
        assert np.log2(errors[0] / errors[1]) > min(method.order, 4) - 0.6

    @toys
    @pytest.mark.parametrize("tolerance", [1e-5, 1e-7])
    def test_the_error_is_that_of_the_tolerance(self, quotient, method, tolerance):
        """Error control takes the order and the error's weights from the tableau."""
        times = np.linspace(0, 2, 21)
        made = run(quotient, times, method, rtol=tolerance, atol=tolerance)
        error = np.abs(made.states[0] - 1 / (1 + times**2)).max()
        assert error < 30 * tolerance
        assert made.statistics.rejected < 0.2 * made.statistics.accepted

    def test_fewer_orders_take_more_steps(self, quotient):
        """At a sharp tolerance."""
        steps = [
            run(quotient, [0, 2], m, rtol=1e-9, atol=1e-9).statistics.accepted
            for m in (HEUN_EULER, BOGACKI_SHAMPINE, DORMAND_PRINCE)
        ]
        assert steps[0] > 5 * steps[1] > 25 * steps[2]

    def test_stages_that_nothing_reads_change_nothing(self, quotient):
        """Sums that are written out and the others: equal to rounding."""
        times = np.linspace(0, 2, 21)
        made = [run(quotient, times, m, step=0.05).states for m in ("tsit5", WITH_IDLE_STAGES)]
        np.testing.assert_allclose(made[0], made[1], rtol=1e-13)

    @toys
    def test_break_points_are_located(self, method):
        """Example 1 has as many events as at a sharp tolerance."""
        compiled, times = nlctl.compile(nlctl.paper.example_1()), np.linspace(0, 1, 11)
        best = nlctl.input_output_response(compiled, times, rtol=1e-11, atol=1e-12)
        made = nlctl.input_output_response(compiled, times, method=method, rtol=1e-7)
        assert made.statistics.events == best.statistics.events > 0
        np.testing.assert_allclose(made.outputs, best.outputs, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("pair", [*EXPLICIT_PAIRS.values(), *TOYS], ids=lambda pair: pair.name)
def test_steps_are_stable_up_to_the_limit(pair):
    """|R(z)| <= 1 for z from -stable to 0, R(z) = 1 + z b (I - z A)^-1 1, and not far beyond."""
    A = pair.pair().A[:, : pair.stages]
    b, ones = A[-1], np.ones(pair.stages)

    def growth(z):
        return abs(1 + z * b @ np.linalg.solve(np.eye(pair.stages) - z * A, ones))

    assert max(growth(z) for z in np.linspace(-pair.stable, -1e-3, 500)) <= 1 + 1e-12
    assert growth(-1.2 * pair.stable) > 1


@each_row(
    ("changed", "told"),
    [
        ({"c": (0.0, 1.0)}, "at least 3 stages, got 2"),
        ({"a": ((0.5,), (0.0, 0.75))}, r"rows of 1 to 3 numbers in a, got \[1, 2\]"),
        ({"error": (0.5, -0.5)}, "4 numbers in error, got 2"),
        ({"order": 0}, "order >= 1, got 0"),
        ({"stable": -1.0}, "stable > 0, got -1.0"),
        ({"c": (0.0, 0.5, 0.75, 0.9)}, "c from 0 to 1"),
        ({"c": (0.0, 0.6, 0.75, 1.0)}, "c as row sums of a"),
        ({"error": (0.5, 0.5, 0.5, 0.5)}, "error weights with the sum 0, got 2.0"),
        ({"dense": ((1.0,),)}, "dense by stages"),
        ({"dense": ((1.0,),) * 4}, "dense to end at the solution"),
    ],
)
def test_what_is_no_pair_is_refused(changed, told):
    """With the rule and the value."""
    with pytest.raises(ParameterError, match=f"Tableau 'Bogacki-Shampine.*' needs {told}"):
        replace(BOGACKI_SHAMPINE, **changed)


def test_python_control_has_no_tableaus(quotient):
    """It is told of the methods that there are."""
    with pytest.raises(UnknownNameError, match="LSODA"):
        run(quotient.system, [0, 1], BOGACKI_SHAMPINE, engine="python-control")
