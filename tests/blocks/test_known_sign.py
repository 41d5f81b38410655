"""The law for a known sign: its inequality, and V' along the closed loop."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.controllers.known_sign import damped_base
from nlctl.params import equation_arguments

numbers = st.floats(-20, 20)
widths = st.floats(1e-3, 10)


def at(spec, *u):
    return spec.output(0.0, (), u, equation_arguments(spec))[0]


class TestTheLaw:
    @given(numbers, numbers, numbers, numbers, st.floats(0.1, 9), widths)
    def test_r_times_eta_covers_r_times_the_base(self, r, W_psi, robust, Y_d, beta, b):
        """(29) with s in the place of the smooth sign's argument, and r u is never positive."""
        law = nlctl.controllers.KnownSignLaw(beta=beta, b=b)
        eta = damped_base((r, W_psi, robust, Y_d), equation_arguments(law))
        base = beta * r + W_psi + robust + Y_d
        scale = 1 + abs(r) * (abs(base) + abs(beta * r))
        assert r * base <= r * eta + 0.2785 * b + 1e-13 * scale
        assert r * eta >= beta * r * r - 1e-13 * scale
        assert r * at(law, r, W_psi, robust, Y_d) <= 1e-13 * scale * law.N_0

    @given(numbers, st.floats(1.0, 20), st.sampled_from([-1, 1]), st.sampled_from([-1, 1]))
    def test_a_narrow_width_is_the_discontinuous_law(self, Y_d, r, sign, side):
        """b -> 0: u = -N_0 (beta r + |s| sign r)."""
        law, s = nlctl.controllers.KnownSignLaw(b=1e-9), Y_d + sign
        if abs(s) < 1e-3:
            return
        expected = -law.N_0 * (law.beta * side * r + abs(s) * side)
        assert at(law, side * r, sign, 0.0, Y_d) == pytest.approx(expected, rel=1e-12)

    def test_a_wide_width_leaves_proportional_feedback(self):
        """b -> infinity: u = -N_0 beta r."""
        law = nlctl.controllers.KnownSignLaw(b=1e12)
        assert at(law, 0.7, 1.0, 2.0, 3.0) == pytest.approx(-law.N_0 * law.beta * 0.7, rel=1e-9)


def known_sign_loop(order=2, **kwargs):
    robust = nlctl.controllers.RobustTerm(gamma=1e4, sigma_2=1e-3)
    weights = nlctl.controllers.AdaptiveWeights(Gamma=10.0)
    return nlctl.adaptive_neural(
        order, weights=weights, robust=robust, law=nlctl.controllers.KnownSignLaw(), **kwargs
    )


class TestItsPlace:
    def test_it_needs_no_argument_zeta(self):
        """The joined controller has the other outputs and the states of (25) alone."""
        controller = known_sign_loop()
        assert controller.output_labels == ["e", "r", "u", "delta_hat", "W_norm"]
        assert controller.nstates == 28
        loop = nlctl.paper.example_1(controller=controller)
        assert "zeta" not in loop.output_labels

    @pytest.mark.slow
    def test_V_falls_as_the_certificate_says(self):  # noqa: N802
        """V' <= -alpha_1 V + alpha_0 + 0.2785 b, V' being gradient times right-hand side.

        With W = 0 and delta* = 9.3, which exceeds |g + d + G eps_u| on this run's states.
        """
        loop = nlctl.paper.example_1(controller=known_sign_loop())
        times, delta = np.linspace(0, 10, 401), 9.3
        run = nlctl.input_output_response(nlctl.compile(loop), times)
        p = nlctl.parameters(loop)["value"]
        x, r = run.states, run.outputs[loop.output_index["r"]]
        W, delta_hat = x[2:29], x[29]
        slopes = np.array([loop.dynamics(t, y, []) for t, y in zip(times, x.T, strict=True)]).T
        reference = equation_arguments(nlctl.SumOfSines())
        yd = np.array([nlctl.SumOfSines.output(t, (), (), reference) for t in times]).T
        r_dot = 1.5 * (x[1] - yd[1]) + slopes[1] - yd[2]
        gamma, Gamma = p["controller.robust.gamma"], p["controller.weights.Gamma"]
        V = r**2 / 2 + np.sum(W * W, axis=0) / (2 * Gamma) + (delta_hat - delta) ** 2 / (2 * gamma)
        V_dot = (
            r * r_dot
            + np.sum(W * slopes[2:29], axis=0) / Gamma
            + (delta_hat - delta) * slopes[29] / gamma
        )
        alpha_1 = min(5.0, 0.5 * Gamma, 1e-3 * gamma)
        alpha_0 = 0.2785 * (0.2 * delta + 0.1) + 1e-3 * delta**2 / 2
        margin = -alpha_1 * V + alpha_0 - V_dot
        assert margin.min() > 0
        assert np.abs(r).max() < np.sqrt(2 * alpha_0 / alpha_1)
        without = margin - 0.2785 * (0.2 * delta + 0.1)  # what the smooth signs cost is needed
        assert without.min() < 0

    def test_only_a_positive_gain_is_taken(self):
        """N_0 = 0 would be no law, and a negative one the wrong sign."""
        for bad in ({"N_0": 0.0}, {"N_0": -1.0}, {"b": 0.0}):
            with pytest.raises(nlctl.errors.ParameterError, match="KnownSignLaw needs"):
                dataclasses.replace(nlctl.controllers.KnownSignLaw(), **bad)
