"""Remedies for the slow drift of zeta: dead zone, leakage, monotone base."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_trapezoid

import nlctl
from nlctl.functions import nussbaum_integral
from nlctl.params import equation_arguments

numbers = st.floats(-3, 3)
signals = st.tuples(numbers, numbers, numbers, numbers)
LAWS = (
    nlctl.controllers.DeadZoneNussbaumLaw,
    nlctl.controllers.LeakyNussbaumLaw,
    nlctl.controllers.MonotoneNussbaumLaw,
)


def rate(law, zeta, u):
    return law.update(0.0, (zeta,), u, equation_arguments(law))[0]


def outputs(law, zeta, u):
    return law.output(0.0, (zeta,), u, equation_arguments(law))


class TestDeadZone:
    @given(st.floats(-1, 1), numbers, signals)
    def test_zeta_stands_still_inside(self, share, zeta, u):
        """|r| <= r_0 gives zeta' = 0 exactly, whatever the other signals are."""
        law = nlctl.controllers.DeadZoneNussbaumLaw(r_0=0.4)
        assert rate(law, zeta, (0.4 * share, *u[1:])) == 0

    @given(numbers, signals, st.floats(0.01, 2))
    def test_energy_with_the_shortened_error(self, zeta, u, r_0):
        """N(zeta) zeta' = d(r) u with d(r) = sign(r) max(|r| - r_0, 0)."""
        law = nlctl.controllers.DeadZoneNussbaumLaw(r_0=r_0)
        control = outputs(law, zeta, u)[0]
        d = np.sign(u[0]) * max(abs(u[0]) - r_0, 0)
        N = np.exp(zeta**2) * np.cos(np.pi / 2 * zeta)
        assert N * rate(law, zeta, u) == pytest.approx(d * control, rel=1e-9, abs=1e-9)

    def test_zeta_stops_in_the_loop(self):
        """It grows until |r| fits into the dead zone; the paper's law drifts on."""
        times = np.linspace(0, 60, 3001)
        grown, largest = {}, {}
        for law in (
            nlctl.controllers.NussbaumLaw(),
            nlctl.controllers.DeadZoneNussbaumLaw(r_0=0.3),
        ):
            loop = nlctl.paper.example_1(controller=nlctl.adaptive_neural(2, law=law))
            run = nlctl.input_output_response(nlctl.compile(loop), times)
            zeta, r = (np.asarray(run.outputs)[loop.output_index[s]] for s in ("zeta", "r"))
            late = times >= 30
            grown[type(law)], largest[type(law)] = np.ptp(zeta[late]), np.abs(r[late]).max()
        assert (
            grown[nlctl.controllers.DeadZoneNussbaumLaw]
            < 0.1 * grown[nlctl.controllers.NussbaumLaw]
        )
        assert largest[nlctl.controllers.DeadZoneNussbaumLaw] < 1.05 * 0.3

    def test_without_a_dead_zone_it_is_the_papers_law(self):
        """r_0 -> 0."""
        law, u = nlctl.controllers.DeadZoneNussbaumLaw(r_0=1e-300), (0.3, -0.2, 0.1, 0.4)
        assert rate(law, 1.5, u) == pytest.approx(
            rate(nlctl.controllers.NussbaumLaw(), 1.5, u), rel=1e-15
        )


class TestLeakage:
    @given(numbers, signals, st.floats(0, 1))
    def test_it_adds_a_pull_towards_the_start(self, zeta, u, c):
        """zeta' of the paper less c (zeta - 1)."""
        expected = rate(nlctl.controllers.NussbaumLaw(), zeta, u) - c * (zeta - 1)
        assert rate(nlctl.controllers.LeakyNussbaumLaw(c=c), zeta, u) == pytest.approx(
            expected, abs=1e-12
        )

    def test_it_forgets_exponentially(self):
        """r = 0: zeta - 1 falls as e^(-c t)."""
        block = nlctl.block(nlctl.controllers.LeakyNussbaumLaw(c=0.5), "law")
        times = np.linspace(0, 6, 61)
        run = nlctl.input_output_response(block, times, 0.0, {"zeta": 2.5})
        np.testing.assert_allclose(run.states[0], 1 + 1.5 * np.exp(-0.5 * times), rtol=1e-6)


class TestMonotone:
    @given(numbers, signals)
    def test_zeta_never_falls(self, zeta, u):
        """zeta' >= beta r^2, and u = N zeta' / r as in the paper."""
        law = nlctl.controllers.MonotoneNussbaumLaw()
        slope = rate(law, zeta, u)
        assert slope >= law.beta * u[0] ** 2 - 1e-12
        N = np.exp(zeta**2) * np.cos(np.pi / 2 * zeta)
        assert outputs(law, zeta, u)[0] * u[0] == pytest.approx(N * slope, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    "law", [nlctl.controllers.NussbaumLaw, nlctl.controllers.MonotoneNussbaumLaw]
)
def test_the_integral_of_r_u_is_that_of_the_nussbaum_function(law):
    """The energy int r u dt and int N dzeta agree along a run of the whole loop."""
    times = np.linspace(0, 20, 20_001)
    loop = nlctl.paper.example_1(controller=nlctl.adaptive_neural(2, law=law()))
    run = nlctl.input_output_response(nlctl.compile(loop), times)
    zeta, r, u = (run.outputs[loop.output_index[s]] for s in ("zeta", "r", "u"))
    work = cumulative_trapezoid(r * u, times, initial=0)
    np.testing.assert_allclose(
        nussbaum_integral(zeta) - nussbaum_integral(1.0), work, atol=2e-4 * np.abs(work).max()
    )


@pytest.mark.parametrize("law", LAWS)
def test_another_nussbaum_function_may_be_put_in(law):
    """The law's N is a parameter as in the paper's."""
    spec = law(N=lambda zeta: zeta * zeta * np.cos(zeta))
    zeta, u = 2.0, (0.5, 0.2, 0.0, 0.1)
    ratio = outputs(spec, zeta, u)[0] / outputs(law(), zeta, u)[0]
    assert ratio == pytest.approx(zeta**2 * np.cos(zeta) / nlctl.functions.nussbaum(zeta))
