"""The controller's scalar functions: closed forms, inequalities, spectra."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy.integrate import quad

from nlctl.functions import (
    band_limited,
    clip,
    gaussian,
    nussbaum,
    nussbaum_derivative,
    nussbaum_integral,
    smooth_sign,
)

KAPPA = 0.2785  # of (29)


def sampled(noise, t):
    return np.array([noise(float(s)) for s in t])


class TestNussbaum:
    @given(st.integers(-6, 6))
    def test_its_zeros_and_extremes_at_whole_numbers(self, k):
        """N(k) = e^(k^2) cos(k pi / 2): zero for odd k, +-e^(k^2) for even k."""
        expected = [1, 0, -1, 0][k % 4] * np.exp(k * k)
        assert nussbaum(float(k)) == pytest.approx(expected, rel=1e-13, abs=1e-14 * np.exp(k * k))

    @given(st.floats(-5, 5))
    def test_it_is_even(self, zeta):
        """N(-zeta) = N(zeta), so N'(-zeta) = -N'(zeta)."""
        assert nussbaum(-zeta) == nussbaum(zeta)
        assert nussbaum_derivative(-zeta) == -nussbaum_derivative(zeta)

    @given(st.floats(-5, 5))
    def test_derivative_by_complex_step(self, zeta):
        """N' = Im N(zeta + i h) / h, which needs no difference and has no cancellation."""
        h = 1e-30
        slope = nussbaum(zeta + 1j * h).imag / h
        scale = np.exp(zeta**2) * (1 + abs(zeta))
        assert nussbaum_derivative(zeta) == pytest.approx(slope, abs=1e-14 * scale)

    @given(st.floats(-4, 4))
    def test_integral_by_quadrature(self, s):
        """The closed form with erfi equals the integral from 0 to s."""
        expected, _ = quad(nussbaum, 0, s, epsabs=1e-12, epsrel=1e-12, limit=200)
        scale, _ = quad(lambda z: abs(nussbaum(z)), 0, abs(s), epsrel=1e-6, limit=200)
        assert nussbaum_integral(s) == pytest.approx(expected, abs=1e-10 * (scale + 1e-3))

    def test_integral_of_an_array(self):
        """Vectors of limits are taken element by element, and N is its derivative."""
        s, h = np.linspace(-2, 2, 9), 1e-4
        slope = (nussbaum_integral(s + h) - nussbaum_integral(s - h)) / (2 * h)
        np.testing.assert_allclose(slope, nussbaum(s), rtol=1e-6, atol=1e-6)

    @pytest.mark.parametrize(
        ("s", "mean", "digits"),
        [(1, 0.788, 3), (3, -130, 3), (5, 2.35e8, 3), (7, -2.22e18, 3), (9, 8.2e31, 2)],
    )
    def test_property_12(self, s, mean, digits):
        """Means over [0, s] swing to either side without bound (figures of an audit)."""
        for side in (s, -s):
            got = nussbaum_integral(side) / side
            assert float(f"{got:.{digits - 1}e}") == pytest.approx(mean, rel=1e-12)

    def test_swings_grow_so_fast_that_gains_may_vary(self):
        """Each lobe outweighs the one before by more and more (type B of the literature)."""
        lobes = np.abs(np.diff(nussbaum_integral(np.array([1.0, 3.0, 5.0, 7.0, 9.0]))))
        ratios = lobes[1:] / lobes[:-1]
        assert (ratios > 1e4).all()
        assert (np.diff(ratios) > 0).all()

    def test_nan_passes(self):
        """A lost state is not hidden."""
        for function in (nussbaum, nussbaum_derivative, nussbaum_integral):
            assert np.isnan(function(np.nan))


class TestSmoothSign:
    @given(r=st.floats(-1e3, 1e3), tau=st.floats(1e-3, 1e3))
    def test_inequality_29(self, r, tau):
        """0 <= |r| - r tanh(r / tau) <= 0.2785 tau."""
        gap = abs(r) - r * smooth_sign(r, tau)
        assert -1e-13 * abs(r) <= gap <= KAPPA * tau

    def test_the_constant_of_29_is_nearly_attained(self):
        """The maximum is kappa tau with kappa = exp(-(kappa + 1)), near |r| = 0.64 tau."""
        r = np.linspace(0, 2, 200_001)
        gap = r - r * smooth_sign(r, 1.0)
        kappa = 0.2785
        for _ in range(60):
            kappa = np.exp(-(kappa + 1))
        assert gap.max() == pytest.approx(kappa, abs=1e-9)
        assert r[gap.argmax()] == pytest.approx(0.6392, abs=1e-4)
        assert kappa < KAPPA

    @given(r=st.floats(0.01, 9))
    def test_it_tends_to_the_sign(self, r):
        """For a narrow width it is the sign, and it is odd for any width."""
        assert smooth_sign(r, 1e-4) == 1.0
        assert smooth_sign(-r, 0.7) == -smooth_sign(r, 0.7)


class TestClip:
    @given(y=st.floats(), low=st.floats(-9, 9), width=st.floats(0, 9))
    def test_it_is_that_of_numpy(self, y, low, width):
        """Equal to numpy.clip, also for NaN and infinity."""
        np.testing.assert_array_equal(clip(y, low, low + width), np.clip(y, low, low + width))


class TestGaussian:
    @given(st.data())
    def test_values_are_those_of_the_sum_written_out(self, data):
        """psi_i = prod_j exp(-(Z_j - mu_ij)^2 / nu_i^2), one width for all or one each."""
        count, size = data.draw(st.integers(1, 4)), data.draw(st.integers(1, 3))
        numbers = st.floats(-3, 3)
        Z = np.array(data.draw(st.lists(numbers, min_size=size, max_size=size)))
        mu = np.array(
            [data.draw(st.lists(numbers, min_size=size, max_size=size)) for _ in range(count)]
        )
        widths = np.array(data.draw(st.lists(st.floats(0.5, 3), min_size=count, max_size=count)))
        for nu in (widths, widths[:1]):
            psi = gaussian(Z, mu, nu)
            for i in range(count):
                factors = [
                    np.exp(-(((Z[j] - mu[i, j]) / nu[i % nu.size]) ** 2)) for j in range(size)
                ]
                assert psi[i] == pytest.approx(np.prod(factors), rel=1e-12)

    def test_it_is_one_at_the_centre_and_1_over_e_at_the_width(self):
        """The width nu enters as nu^2, without a factor 2."""
        centres, widths = np.array([[1.0, 2.0]]), np.array([3.0])
        assert gaussian(np.array([1.0, 2.0]), centres, widths) == 1.0
        assert gaussian(np.array([1.0, 5.0]), centres, widths) == pytest.approx(np.exp(-1))


class TestBandLimited:
    @given(seed=st.integers(0, 1000), rms=st.floats(0.01, 100))
    @settings(max_examples=8)
    def test_rms_over_a_long_window(self, seed, rms):
        """The mean square over [0, T] is rms^2 but for beats: pairs of sines weigh 1 / (T dw)."""
        t = np.arange(0, 400, 0.05)
        y = sampled(band_limited(rms, low=5.0, high=50.0, seed=seed, components=8), t)
        assert np.sqrt(np.mean(y**2)) == pytest.approx(rms, rel=0.02)
        assert abs(np.mean(y)) < 0.01 * rms

    @pytest.mark.slow
    @given(seed=st.integers(0, 1000), low=st.floats(0, 20), width=st.floats(1, 30))
    @settings(max_examples=10)
    def test_its_spectrum_lies_in_the_band(self, seed, low, width):
        """Outside the band (in rad/s) there is nothing but leakage of the window."""
        noise, high = band_limited(1.0, low=low, high=low + width, seed=seed), low + width
        t = np.linspace(0, 400, 2**13, endpoint=False)
        power = np.abs(np.fft.rfft(np.blackman(t.size) * sampled(noise, t))) ** 2
        omega = 2 * np.pi * np.fft.rfftfreq(t.size, t[1])
        margin = 4 * 2 * np.pi / t[-1]
        inside = (omega >= low - margin) & (omega <= high + margin)
        assert power[~inside].sum() < 1e-6 * power.sum()
        middle = (low + high) / 2
        assert 0.3 < power[omega < middle].sum() / power.sum() < 0.7  # and fills both halves

    @given(seed=st.integers(0, 1000), t=st.floats(0, 100))
    def test_it_is_a_function_of_time_and_seed(self, seed, t):
        """The same seed gives the same signal, in any order of calls; another seed another one."""
        one, two = (band_limited(1.0, low=0, high=9, seed=seed) for _ in range(2))
        other = band_limited(1.0, low=0, high=9, seed=seed + 1)
        late = one(t + 1.0)
        assert one(t) == two(t) != other(t)
        assert two(t + 1.0) == late

    def test_it_is_bounded_by_its_sines(self):
        """|n| <= rms sqrt(2 m), which one sine attains."""
        t = np.linspace(0, 2 * np.pi, 2001)
        single = sampled(band_limited(2.0, low=1, high=1.5, seed=3, components=1), t)
        assert np.abs(single).max() == pytest.approx(2 * np.sqrt(2), rel=1e-5)
        assert (sampled(band_limited(0.0, low=1, high=2, seed=3), t) == 0).all()

    @each_row(
        ("changed", "told"),
        [
            ({"rms": -0.1}, "rms >= 0, got -0.1"),
            ({"rms": np.nan}, "rms >= 0, got nan"),
            ({"rms": np.inf}, "rms >= 0, got inf"),
            ({"low": 3.0}, "low < high, got low 3.0, high 2.0"),
            ({"low": -1.0}, "0 <= low"),
            ({"low": np.nan}, "0 <= low"),
            ({"high": np.inf}, "high inf"),
            ({"high": 1.0}, "low < high"),
            ({"components": 0}, "components >= 1, got 0"),
        ],
    )
    def test_bad_arguments_are_refused_by_name(self, changed, told):
        """The message tells rule and value."""
        arguments = {"rms": 1.0, "low": 1.0, "high": 2.0, "seed": 0} | changed
        with pytest.raises(ValueError, match=rf"band.limited.* needs .*{told}"):
            band_limited(arguments.pop("rms"), **arguments)
