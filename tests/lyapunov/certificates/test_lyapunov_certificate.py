"""The certificate that holds for all time, its design, and a region known from the textbook."""

import functools

import numpy as np
import pytest
from flint import arb
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lsim, lti

import nlctl
from nlctl.analysis.intervals.branch_and_bound import Box
from nlctl.analysis.intervals.level_set import prove_decrease
from nlctl.analysis.lyapunov.bounds.error_bounds import error_bounds, filter_poles, reference_bounds
from nlctl.analysis.lyapunov.certificate.certify import certify
from nlctl.analysis.lyapunov.certificate.gains import design
from nlctl.errors import DiagramError, ParameterError

TIGHT = (0.6, 1.3)  # split of the dead zone


def example_1(*, gamma=1e4, sigma_2=1e-3, Gamma=10.0, tau=0.2, N_0=2.4, **kwargs):
    controller = nlctl.adaptive_neural(
        2,
        weights=nlctl.controllers.AdaptiveWeights(Gamma=Gamma),
        robust=nlctl.controllers.RobustTerm(gamma=gamma, sigma_2=sigma_2, tau=tau),
        law=nlctl.controllers.KnownSignLaw(N_0=N_0),
    )
    return nlctl.paper.example_1(controller=controller, **kwargs)


def example_2(*, gamma=1e5, sigma_2=3e-4, Gamma=34.0, tau=0.5, N_0=0.84):
    controller = nlctl.adaptive_neural(
        3,
        filtered_error=nlctl.controllers.FilteredError(lambdas=(2.0, 1.0)),
        weights=nlctl.controllers.AdaptiveWeights(Gamma=Gamma, sigma_1=0.3),
        robust=nlctl.controllers.RobustTerm(gamma=gamma, sigma_2=sigma_2, tau=tau),
        law=nlctl.controllers.KnownSignLaw(beta=5.0, N_0=N_0),
    )
    return nlctl.paper.example_2(controller=controller)


def certified(loop, **kwargs):
    """The certificate with the split proved for |u| <= 200, which covers 165 of `plain`."""
    return certify(loop, k=TIGHT, u_max=100.0, **kwargs)


@functools.cache
def plain():
    """The certificate of Example 1 with the gains above."""
    return certified(example_1())


class TestTracking:
    @given(st.lists(st.integers(1, 20), min_size=1, max_size=4))
    def test_poles_of_products(self, quarters):
        """(s + p_1) ... (s + p_m) gives back its p's, double ones as well."""
        poles = sorted(q / 4 for q in quarters)
        found = filter_poles(np.poly([-p for p in poles])[1:])
        assert [float(p) for p in found] == pytest.approx(poles, rel=1e-12)

    def test_complex_roots_are_refused(self):
        """The other reading of Example 2's lambdas has them."""
        with pytest.raises(ParameterError, match=r"root at -0\.5\+1\.32"):
            filter_poles((1.0, 2.0))

    @pytest.mark.slow
    @given(
        st.lists(st.floats(-1, 1), min_size=3, max_size=3),
        st.lists(st.sampled_from([-1.0, 1.0]), min_size=40, max_size=40),
    )
    def test_no_filtered_error_gets_past_the_bounds(self, e0, signs):
        """e driven by any switching |r| <= C stays within; lambdas of (s + 1)(s + 2)."""
        C, lambdas = 0.7, (3.0, 2.0)
        t = np.linspace(0, 8, 801)
        r = C * np.repeat(signs, 21)[: t.size]
        plant = lti([[0, 1], [-2, -3]], [[0], [1]], np.eye(2), np.zeros((2, 1)))
        _, e, _ = lsim(plant, r, t, e0[:2], interp=False)
        e_3 = r - 2 * e[:, 0] - 3 * e[:, 1]
        start = [*e0[:2], float(r[0] - 2 * e0[0] - 3 * e0[1])]
        bounds = [float(b) for b in error_bounds(lambdas, start, arb(C))]
        assert np.abs(e).max(axis=0)[0] <= bounds[0] + 1e-9
        assert np.abs(e).max(axis=0)[1] <= bounds[1] + 1e-9
        assert np.abs(e_3).max() <= bounds[2] + 1e-9

    def test_a_first_order_filter_attains_its_bound(self):
        """n = 2: |e_1| -> C / lambda, |e_2| <= C + lambda max|e_1|."""
        e1, e2 = (float(b) for b in error_bounds((1.5,), (0.0, 0.0), arb(3)))
        assert (e1, e2) == pytest.approx((2.0, 6.0))

    def test_the_reference_of_the_paper(self):
        """sup of (sin t + sin t/2)/2 and its derivatives, against fine sampling."""
        t = np.linspace(0, 4 * np.pi, 400_001)
        for k, bound in enumerate(reference_bounds(nlctl.SumOfSines(order=3))):
            yd = 0.5 * (np.sin(t + k * np.pi / 2) + 0.5**k * np.sin(t / 2 + k * np.pi / 2))
            assert np.abs(yd).max() <= bound <= np.abs(yd).max() + 1e-5

    @pytest.mark.parametrize(
        ("frequencies", "attained"), [((0.1, 0.3), False), ((0.1, 0.2), True), ((1.0, 3.0), True)]
    )
    def test_decimal_frequencies_are_the_doubles_that_they_are(self, frequencies, attained):
        """3 * 0.1 is not the double 0.3: their phases drift apart, and in the end the sines add up.

        Of sines in step the bound is the supremum over their period.
        """
        reference = nlctl.SumOfSines(order=1, frequencies=frequencies)
        t = np.linspace(0, 2 * np.pi / frequencies[0], 100_001)
        yd = 0.5 * (np.sin(frequencies[0] * t) + np.sin(frequencies[1] * t))
        bound = reference_bounds(reference)[0]
        assert bound == pytest.approx(np.abs(yd).max() if attained else 1.0, rel=1e-5)
        assert bound >= np.abs(yd).max()

    def test_frequencies_without_a_common_period(self):
        """The sum of the amplitudes, which such sines come arbitrarily near."""
        reference = nlctl.SumOfSines(order=1, frequencies=(1.0, np.sqrt(2)))
        expected = (1.0, 0.5 * (1 + np.sqrt(2)))
        assert reference_bounds(reference) == pytest.approx(expected, rel=1e-9)


class TestCertify:
    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("loop", "k", "known"),
        [
            pytest.param(example_1(gamma=1e5, sigma_2=1e-4), TIGHT, 0.46703, marks=pytest.mark.ci),
            (example_1(), TIGHT, 0.48346),
            pytest.param(example_2(), None, 1.44794, marks=pytest.mark.ci),
            pytest.param(example_2(tau=0.05), None, 0.51938, marks=pytest.mark.ci),
        ],
    )
    def test_the_bound_holds_for_the_run_and_meets_the_known_one(self, loop, k, known):
        """Each box closes with at most the bound of an independent computation."""
        found = certify(loop, k=k, u_max=250.0)
        assert found.holds
        assert known >= found.C_0
        assert found.C_0 < found.C
        assert found.ultimate <= found.C_0
        run = nlctl.input_output_response(nlctl.compile(loop), np.linspace(0, 20, 4001))
        signals = dict(zip(loop.output_labels, np.asarray(run.outputs), strict=True))
        assert np.abs(signals["r"]).max() <= found.C_0
        assert np.abs(signals["u"]).max() <= found.u_max
        for name in found.region.box.names:
            low, high = found.region.box[name]
            assert low <= signals[name].min() <= signals[name].max() <= high

    @pytest.mark.slow
    def test_the_bound_is_that_of_its_constants(self):
        """Every formula once more by hand, from the proved delta*."""
        found = plain()
        delta = found.region.delta_star
        assert delta == pytest.approx(found.region.matched + 1.32 * 0.3, rel=1e-3)
        V_0 = delta**2 / 2e4
        alpha_0 = 0.2785 * (0.2 * delta + 0.1) + 1e-3 * delta**2 / 2
        assert (found.V_0, found.alpha_0, found.alpha_1) == pytest.approx((V_0, alpha_0, 5.0))
        assert pytest.approx(np.sqrt(2 * max(V_0, alpha_0 / 5))) == found.C_0

    @pytest.mark.slow
    def test_delta_star_covers_the_run(self):
        """|g + d + G eps_u| along a run, from the plant's acceleration: x_n' - kG u."""
        loop, found = example_1(), plain()
        run = nlctl.input_output_response(nlctl.compile(loop), np.linspace(0, 20, 501))
        signals = dict(zip(loop.output_labels, np.asarray(run.outputs), strict=True))
        x2_dot = [loop.dynamics(t, x, [])[1] for t, x in zip(run.time, run.states.T, strict=True)]
        u, v, x1 = signals["u"], signals["v"], signals["x1"]
        G = (1 + 0.1 * np.cos(x1)) * (1 + 0.2 * np.cos(v))
        k = np.clip(np.divide(v, u, out=np.ones_like(u), where=u != 0), *TIGHT)
        assert np.abs(np.array(x2_dot) - k * G * u).max() <= found.region.delta_star
        assert found.region.G_min <= G.min() <= G.max() <= found.region.G_max

    @pytest.mark.slow
    def test_the_published_gains_do_not_close(self):
        """C -> C_0(C) runs away, and the reason shows how."""
        loop = example_1(gamma=1.5, sigma_2=0.5, Gamma=0.5)
        found = certified(loop)
        assert not found.holds
        assert np.inf == found.C_0
        assert list(found.iterations) == sorted(found.iterations)
        assert "does not close" in found.reason
        assert "C_0" not in [c.symbol for c in found.constants]
        assert str(found).startswith("no bound is proved")

    @pytest.mark.slow
    def test_a_gain_below_the_sector_is_refused(self):
        """N_0 < 1 / (k_1 G_min)."""
        found = certified(example_1(N_0=1.5))
        assert not found.holds
        assert "N_0 = 1.5 is below 1/(k_1 G_min)" in found.reason

    @pytest.mark.slow
    def test_sigma_zero_proves_nothing(self):
        """sigma_2 = 0 makes alpha_1 = 0: no bound for all time."""
        assert not certified(example_1(sigma_2=0.0)).holds

    @pytest.mark.weekly
    @pytest.mark.ci
    def test_parameters_of_the_run_count(self):
        """The same override that a run takes changes the proof."""
        loop = example_1()
        by_override = certified(loop, params={"robust.tau": 0.1})
        assert by_override.C_0 == certified(example_1(tau=0.1)).C_0
        assert by_override.C_0 < plain().C_0

    @pytest.mark.slow
    def test_a_larger_disturbance_needs_a_larger_bound(self):
        """q_mean enters delta* with its whole size."""
        forced = certified(example_1(plant=nlctl.plants.ForcedDuffing(q_mean=6.0)))
        assert forced.region.delta_star >= plain().region.delta_star + 1.0 - 0.02
        assert forced.C_0 > plain().C_0

    def test_other_blocks_are_refused_by_name(self):
        """The proof is about KnownSignLaw, not about the paper's law."""
        with pytest.raises(DiagramError, match=r"KnownSignLaw.*got NussbaumLaw"):
            certify(nlctl.paper.example_1())


@pytest.mark.weekly
def test_design_finds_gains_within_the_limit():
    """A smaller proved bound than that of the gains it starts from, for an |u| that is allowed."""
    loop = example_1()
    found = design(loop, u_limit=8.0, k=TIGHT, horizon=5.0, evaluations=12)
    assert found.certificate.holds
    assert found.u <= 8.0
    assert found.certificate.C_0 < plain().C_0
    again = certify(loop, params=found.gains, k=TIGHT)
    assert again.C_0 == found.certificate.C_0
    bounds = [trial.C_0 for trial in found.tradeoff]
    inputs = [trial.u for trial in found.tradeoff]
    assert bounds == sorted(bounds, reverse=True)
    assert inputs == sorted(inputs)
    with pytest.raises(ParameterError, match=r"keep max \|u\| <= 0\.1"):
        design(loop, u_limit=0.1, k=TIGHT, horizon=1.0, evaluations=2)


class TestVanDerPol:
    """Khalil, Nonlinear Systems, 3rd ed., Example 8.9: Van der Pol's equation in reverse time.

    x1' = -x2, x2' = x1 + (x1^2 - 1) x2, V = 1.5 x1^2 - x1 x2 + x2^2.  The book finds c = 2.25 from
    contour plots as the level up to which V' < 0.
    """

    box = Box.of(x1=(-3, 3), x2=(-3, 3))

    @staticmethod
    def V(x):  # noqa: N802
        x1, x2 = x
        return 1.5 * x1 * x1 - x1 * x2 + x2 * x2

    @staticmethod
    def gradient(x):
        x1, x2 = x
        return 3 * x1 - x2, 2 * x2 - x1

    @staticmethod
    def rhs(x):
        x1, x2 = x
        return -x2, x1 + (x1 * x1 - 1) * x2

    def proof(self, level, **kwargs):
        pieces = {"V": self.V, "gradient": self.gradient, "rhs": self.rhs} | kwargs
        return prove_decrease(**pieces, box=self.box, level=level, floor=0.05)

    @staticmethod
    def true_level():
        """On rays, V' = -rho^2 + rho^4 h(theta): the least V at which it is 0."""
        angle = np.linspace(0, np.pi, 100_001)
        c, s = np.cos(angle), np.sin(angle)
        h = 2 * c * c * s * s - c**3 * s
        q = 1.5 * c * c - c * s + s * s
        return float(np.min(q[h > 1e-9] / h[h > 1e-9]))

    def test_the_level_of_the_book_is_proved(self):
        """c = 2.25."""
        found = self.proof(2.25)
        assert found.holds
        assert found.undecided == 0

    @pytest.mark.slow
    def test_the_true_level_is_sharp(self):
        """Proved 1 % below it; 1 % above a point in the set is named where V' >= 0."""
        level = self.true_level()
        assert 2.25 < level < 2.35
        assert self.proof(0.99 * level).holds
        found = self.proof(1.01 * level)
        assert found.holds is False
        point = (found.where["x1"], found.where["x2"])
        assert self.V(point) <= 1.01 * level
        assert np.dot(self.gradient(point), self.rhs(point)) > -1e-8

    def test_forward_time_is_refuted(self):
        """The origin is unstable there: a wrong sign of the right-hand side is found."""
        found = self.proof(1.0, rhs=lambda x: tuple(-f for f in self.rhs(x)))
        assert found.holds is False

    def test_a_wrong_gradient_is_refused(self):
        """It would prove something about another function."""
        with pytest.raises(ParameterError, match="gradient gives dV/dx2"):
            self.proof(1.0, gradient=lambda x: (3 * x[0] - x[1], 2 * x[1]))
