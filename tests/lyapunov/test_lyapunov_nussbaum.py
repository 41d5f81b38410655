"""Property (12): lobes, running means and types of Nussbaum functions."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad

from nlctl.analysis.lyapunov.nussbaum.property import (
    antiderivative,
    lobe_around,
    lobes,
    nussbaum_property,
)
from nlctl.errors import ParameterError
from nlctl.functions import nussbaum, nussbaum_derivative


def square_cosine(z):
    return z * z * np.cos(z)


def square_cosine_integral(z):
    return (z * z - 2) * np.sin(z) + 2 * z * np.cos(z)


class TestIntegrals:
    @given(st.lists(st.floats(-9, 9), min_size=1, max_size=6))
    def test_quadrature_meets_the_closed_form(self, s):
        """int_0^s z^2 cos z, for any arguments in any order."""
        got = antiderivative(square_cosine)(np.array(s))
        np.testing.assert_allclose(got, square_cosine_integral(np.array(s)), rtol=1e-8, atol=1e-9)

    def test_many_arguments_meet_it_too(self):
        """Beyond 4096 arguments there is interpolation, with N as its slope."""
        s = np.random.default_rng(1).uniform(-2, 30, 10_000)
        got = antiderivative(square_cosine)(s)
        np.testing.assert_allclose(got, square_cosine_integral(s), rtol=1e-9, atol=1e-8)

    def test_the_closed_form_of_the_papers_function_meets_quadrature(self):
        """Of one argument after the other, from 0."""
        s = np.array([0.0, 1.0, 3.0, 5.0, -2.0])
        by_parts = [quad(nussbaum, 0, z)[0] for z in s]
        np.testing.assert_allclose(antiderivative(nussbaum)(s), by_parts, rtol=1e-9)


class TestLobes:
    def test_of_the_papers_function(self):
        """Zeros at odd numbers, extrema where N' = 0, budgets by quadrature."""
        found = lobes(nussbaum, 0, 7)
        np.testing.assert_allclose([lobe.high for lobe in found], [1, 3, 5, 7], atol=1e-12)
        for lobe in found[1:]:
            assert abs(nussbaum_derivative(lobe.place)) < 1e-5 * abs(lobe.extremum)
            assert lobe.extremum == pytest.approx(nussbaum(lobe.place), rel=1e-12)
            by_quadrature = quad(nussbaum, lobe.low, lobe.high)[0]
            assert lobe.integral == pytest.approx(by_quadrature, rel=1e-9)
            assert lobe.sign == np.sign(by_quadrature)

    def test_of_a_sine(self):
        """Every lobe of sin z holds 2 and peaks at 1."""
        for k, lobe in enumerate(lobes(math.sin, 0.0, 4 * math.pi)):
            assert (lobe.low, lobe.high) == pytest.approx((k * math.pi, (k + 1) * math.pi))
            assert lobe.budget == pytest.approx(2)
            assert lobe.place == pytest.approx((k + 0.5) * math.pi, abs=1e-6)
            assert lobe.extremum == pytest.approx((-1) ** k)

    def test_the_lobe_of_a_point(self):
        """At a zero it is the lobe above; without zeros there is none."""
        assert (lobe_around(2.2).low, lobe_around(2.2).high) == pytest.approx((1, 3))
        assert lobe_around(1.0).low == pytest.approx(1)
        assert lobe_around(20.5).budget > 0
        with pytest.raises(ParameterError, match="no zeros on both sides of zeta = 2"):
            lobe_around(2.0, math.exp)

    def test_ranges_that_make_no_sense(self):
        """Overflow is named with its place."""
        with pytest.raises(ParameterError, match=r"not finite at zeta = 26\.6"):
            lobes(nussbaum, 20, 30)
        with pytest.raises(ParameterError, match="low < high, got 3 and 3"):
            lobes(nussbaum, 3, 3)


class TestTypes:
    @pytest.mark.parametrize(
        ("function", "end", "a", "b"),
        [
            (nussbaum, 9.0, True, True),
            (square_cosine, 40.0, True, False),  # means grow as s, shares tend to 1
            (lambda z: z * np.cos(z), 40.0, False, False),  # means stay within -1 and 1
            (lambda z: np.exp(z) * np.cos(z), 20.0, True, False),  # shares tend to e^pi
            (lambda z: z * z * np.cos(z) ** 2 - 1e-3, 20.0, False, False),  # one sign prevails
            (np.cos, 40.0, False, False),
        ],
    )
    def test_a_and_b(self, function, end, a, b):
        """Functions whose types follow from their antiderivatives."""
        found = nussbaum_property(function, end)
        assert (found.type_a, found.type_b) == (a, b)

    def test_ratios_of_budgets(self):
        """e^z cos z: a lobe later, everything is e^pi larger."""
        found = nussbaum_property(lambda z: np.exp(z) * np.cos(z), 20.0)
        np.testing.assert_allclose(found.ratios[1:], math.exp(math.pi), rtol=1e-8)
        assert "checked" in str(found)

    def test_a_short_range_shows_nothing(self):
        """Four lobes at least."""
        with pytest.raises(ParameterError, match=r"four lobes .* \[0, 4\] holds 2"):
            nussbaum_property(nussbaum, 4.0)
