"""The controller: filtered error, network, adaptation, Nussbaum law, and their joining."""

import math

import numpy as np
import pytest
from examples import many
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.polynomial import Polynomial
from rows import each_row

import nlctl
from nlctl.controllers import binomial_lambdas
from nlctl.params import equation_arguments

numbers = st.floats(-3, 3)
orders = st.integers(2, 6)


def vectors(size):
    return st.lists(numbers, min_size=size, max_size=size).map(np.array)


def stable_lambdas(draw, order):
    """Draw lambda_1, ..., lambda_{n-1} with real roots in the open left half plane."""
    roots = draw(st.lists(st.floats(-3, -0.1), min_size=order - 1, max_size=order - 1))
    return tuple(np.poly(roots)[1:])


class TestFilteredError:
    @given(st.data(), orders)
    def test_equations_14_and_18_written_out(self, data, n):
        """r = lambda_{n-1} e_1 + ... + lambda_1 e_{n-1} + e_n, and Y_d one derivative later."""
        spec = nlctl.controllers.FilteredError(lambdas=stable_lambdas(data.draw, n))
        x, yd = data.draw(vectors(n)), data.draw(vectors(n + 1))
        e = x - yd[:n]
        r, Y_d = e[n - 1], -yd[n]
        for i in range(1, n):  # lambda_{n-i} goes with e_i in r, with e_{i+1} in Y_d
            r += spec.lambdas[n - i - 1] * e[i - 1]
            Y_d += spec.lambdas[n - i - 1] * e[i]
        got = spec.output(0.0, (), np.concatenate([x, yd]), equation_arguments(spec))
        np.testing.assert_allclose(got, [e[0], r, Y_d], rtol=1e-12, atol=1e-10)
        assert spec.order == n
        assert len(spec.inputs) == 2 * n + 1

    @given(st.data(), orders, st.floats(-1, 1))
    def test_the_derivative_of_r_is_xn_dot_plus_Yd(self, data, n, t):  # noqa: N802
        """(15)-(18): along any motion x_i' = x_{i+1}, by complex step through the equation."""
        spec = nlctl.controllers.FilteredError(lambdas=stable_lambdas(data.draw, n))
        y, yd = (Polynomial(data.draw(vectors(n + 3))) for _ in range(2))

        def signals(t):
            return np.array(
                [(y.deriv(i) if i else y)(t) for i in range(n)]
                + [(yd.deriv(i) if i else yd)(t) for i in range(n + 1)]
            )

        p, h = equation_arguments(spec), 1e-30
        r_dot = spec.output(0.0, (), signals(t + 1j * h), p)[1].imag / h
        Y_d = spec.output(0.0, (), signals(t), p)[2]
        scale = 1e4 * math.factorial(n + 2)
        assert r_dot == pytest.approx(y.deriv(n)(t) + Y_d, rel=1e-10, abs=1e-14 * scale)

    @given(st.data(), st.integers(1, 4))
    def test_it_takes_exactly_the_hurwitz_polynomials(self, data, degree):
        """Roots are drawn, coefficients follow; the record refuses a root not in Re s < 0."""
        parts = st.floats(-3, 3).filter(lambda v: abs(v) > 0.05)
        pairs = [(data.draw(parts), data.draw(parts)) for _ in range(degree // 2)]
        roots = [complex(a, sign * b) for a, b in pairs for sign in (1, -1)]
        roots += [data.draw(parts)] if degree % 2 else []
        lambdas = np.poly(roots).real[1:]
        if max(np.real(roots)) < 0:
            assert nlctl.controllers.FilteredError(lambdas=lambdas).lambdas == tuple(lambdas)
        else:
            with pytest.raises(
                nlctl.errors.ParameterError, match=r"^FilteredError needs a Hurwitz"
            ):
                nlctl.controllers.FilteredError(lambdas=lambdas)

    @given(st.tuples(*[st.integers(-2, 6)] * 3))
    @settings(max_examples=many(300))
    def test_degree_3_by_the_criterion_of_hurwitz(self, lambdas):
        """s^3 + a s^2 + b s + c with whole a, b, c: a > 0, c > 0, a b > c, in exact arithmetic."""
        a, b, c = lambdas
        if a > 0 and c > 0 and a * b > c:
            nlctl.controllers.FilteredError(lambdas=lambdas)
        else:
            with pytest.raises(nlctl.errors.ParameterError, match="Hurwitz"):
                nlctl.controllers.FilteredError(lambdas=lambdas)

    @each_row("lambdas", [(0,), (0, 4), (2, 0), (1, 1, 1), (1, 2, 2), (2, 2, 2, 1)])
    def test_the_boundary_is_refused(self, lambdas):
        """Roots on the imaginary axis: e does not follow r to zero."""
        with pytest.raises(nlctl.errors.ParameterError, match="Hurwitz"):
            nlctl.controllers.FilteredError(lambdas=lambdas)

    @pytest.mark.parametrize("n", range(2, 8))
    def test_binomial_lambdas(self, n):
        """(s + 1)^(n-1) has Pascal's coefficients, and is accepted."""
        lambdas = binomial_lambdas(n)
        assert lambdas == pytest.approx([math.comb(n - 1, k) for k in range(1, n)])
        assert nlctl.controllers.FilteredError(lambdas=lambdas).order == n


class TestPieces:
    @given(st.data(), st.integers(1, 6), numbers, st.floats(0.1, 9), st.floats(0, 2))
    def test_weights_25(self, data, l, r, Gamma, sigma):  # noqa: E741
        """W_hat' = Gamma (r psi - sigma_1 W_hat), W_hat^T psi, |W_hat|."""
        spec = nlctl.controllers.AdaptiveWeights(nodes=l, Gamma=Gamma, sigma_1=sigma)
        psi, W = data.draw(vectors(l)), data.draw(vectors(l))
        p, u = equation_arguments(spec), np.concatenate([[r], psi])
        law = [Gamma * (r * psi[i] - sigma * W[i]) for i in range(l)]
        np.testing.assert_allclose(spec.update(0.0, W, u, p), law, rtol=1e-13, atol=1e-14)
        expected = [sum(W[i] * psi[i] for i in range(l)), math.sqrt(sum(w * w for w in W))]
        np.testing.assert_allclose(spec.output(0.0, W, u, p), expected, rtol=1e-13, atol=1e-13)

    @given(r=numbers, delta=numbers, gamma=st.floats(0.1, 9), tau=st.floats(0.05, 2))
    def test_robust_term_25(self, r, delta, gamma, tau):
        """delta_hat' = gamma (r tanh(r/tau) - sigma_2 delta_hat), delta_hat tanh(r/tau)."""
        spec = nlctl.controllers.RobustTerm(gamma=gamma, tau=tau, sigma_2=0.3)
        p = equation_arguments(spec)
        sign = (math.exp(r / tau) - math.exp(-r / tau)) / (math.exp(r / tau) + math.exp(-r / tau))
        law = gamma * (r * sign - 0.3 * delta)
        assert spec.update(0.0, (delta,), (r,), p)[0] == pytest.approx(law, abs=1e-13 * 30)
        got = spec.output(0.0, (delta,), (r,), p)
        assert got == pytest.approx((delta * sign, delta), abs=1e-14)

    @given(u=vectors(4), zeta=numbers, beta=st.floats(0.1, 9))
    def test_nussbaum_law_23_and_24(self, u, zeta, beta):
        """u = N(zeta) eta and zeta' = r eta, so that u r = N(zeta) zeta' identically."""
        spec = nlctl.controllers.NussbaumLaw(beta=beta)
        p, eta = equation_arguments(spec), beta * u[0] + u[1] + u[2] + u[3]
        N = math.exp(zeta**2) * math.cos(math.pi * zeta / 2)
        control, state = spec.output(0.0, (zeta,), tuple(u), p)
        zeta_dot = spec.update(0.0, (zeta,), tuple(u), p)[0]
        assert control == pytest.approx(N * eta, rel=1e-9, abs=1e-10)
        assert zeta_dot == pytest.approx(u[0] * eta, abs=1e-13)
        assert control * u[0] == pytest.approx(N * zeta_dot, rel=1e-9, abs=1e-10)
        assert state == zeta

    @given(zeta=numbers)
    def test_another_nussbaum_function(self, zeta):
        """Any function of zeta may be put in, also a plain one."""
        spec = nlctl.controllers.NussbaumLaw(N=lambda z: z**2 * np.cos(z), beta=2.0)
        got = spec.output(0.0, (zeta,), (1.0, 0.5, 0.0, 0.0), equation_arguments(spec))[0]
        assert got == pytest.approx(zeta**2 * math.cos(zeta) * 2.5)

    def test_centres(self):
        """Diagonals, grids and Latin hypercubes lie where their names say."""
        diagonal = np.array(nlctl.controllers.diagonal_centres(5, 3, -2, 2))
        np.testing.assert_array_equal(diagonal, np.outer([-2, -1, 0, 1, 2], np.ones(3)))
        grid = nlctl.controllers.grid_centres([2, 3], 0, 2)
        assert grid == ((0, 0), (0, 1), (0, 2), (2, 0), (2, 1), (2, 2))
        cube = np.array(nlctl.controllers.latin_hypercube_centres(8, 2, -4, 4, seed=3))
        for column in cube.T:  # one centre in each of the eight slices of every axis
            assert sorted(np.floor(column + 4)) == list(range(8))
        assert (cube == nlctl.controllers.latin_hypercube_centres(8, 2, -4, 4, seed=3)).all()
        assert (cube != nlctl.controllers.latin_hypercube_centres(8, 2, -4, 4, seed=4)).any()


@st.composite
def loops(draw):
    """Draw a whole controller: records, a state and the inputs."""
    n = draw(st.integers(2, 4))
    count = draw(st.integers(1, 4))
    centres = [draw(vectors(draw(st.integers(n, n)))) for _ in range(count)]
    records = {
        "filtered_error": nlctl.controllers.FilteredError(lambdas=stable_lambdas(draw, n)),
        "basis": nlctl.controllers.GaussianBasis(centres=centres, widths=draw(st.floats(0.5, 3))),
        "weights": nlctl.controllers.AdaptiveWeights(nodes=count, Gamma=draw(st.floats(0.1, 3))),
        "robust": nlctl.controllers.RobustTerm(tau=draw(st.floats(0.1, 1))),
        "law": nlctl.controllers.NussbaumLaw(beta=draw(st.floats(0.1, 5))),
    }
    state = [*draw(vectors(count)), draw(numbers), draw(st.floats(-2, 2))]
    return n, records, np.array(state), draw(vectors(2 * n + 1))


class TestJoined:
    @given(loops())
    def test_it_is_the_composition_of_the_equations(self, loop):
        """(14), (19), (23)-(25) written out for any order, against the diagram."""
        n, made, state, inputs = loop
        diagram = nlctl.adaptive_neural(n, **made)
        assert diagram.input_labels == list(made["filtered_error"].inputs)
        assert diagram.output_labels == ["e", "r", "u", "zeta", "delta_hat", "W_norm"]
        W, (delta, zeta), x = state[:-2], state[-2:], inputs[:n]
        e = x - inputs[n : 2 * n]
        A = np.array(made["filtered_error"].lambdas)[::-1]
        r, Y_d = A @ e[:-1] + e[-1], A @ e[1:] - inputs[2 * n]
        centres, width = np.array(made["basis"].centres), made["basis"].widths[0]
        psi = np.exp(-np.sum((x - centres) ** 2, axis=1) / width**2)
        sign = np.tanh(r / made["robust"].tau)
        eta = made["law"].beta * r + W @ psi + delta * sign + Y_d
        u = np.exp(zeta**2) * np.cos(np.pi / 2 * zeta) * eta
        got = diagram.output(0.0, state, inputs)
        expected = [e[0], r, u, zeta, delta, np.linalg.norm(W)]
        np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)
        slopes = [
            *(made["weights"].Gamma * (r * psi - 0.5 * W)),
            1.5 * (r * sign - 0.5 * delta),
            r * eta,
        ]
        np.testing.assert_allclose(diagram.dynamics(0.0, state, inputs), slopes, atol=1e-8)

    @pytest.mark.parametrize("n", [2, 3, 4])
    def test_defaults_for_every_order(self, n):
        """27 nodes on the diagonal of R^n, lambdas of (s + 1)^(n-1), but 1.5 for order 2."""
        values = nlctl.parameters(nlctl.adaptive_neural(n))["value"]
        lambdas = (1.5,) if n == 2 else binomial_lambdas(n)
        assert values["filtered_error.lambdas"] == lambdas
        assert np.shape(values["basis.centres"]) == (27, n)

    @given(inputs=vectors(5), zeta=st.floats(-2, 2), delta=numbers)
    @settings(max_examples=many(20, part=4))
    def test_pieces_left_out(self, inputs, zeta, delta):
        """Zero in the place of network, robust term or both: the terms of (23) disappear."""
        assume(abs(math.cos(math.pi / 2 * zeta)) > 1e-3)
        no_network = {"weights": nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))}
        no_robust = {"robust": nlctl.controllers.Zero(outputs=("robust", "delta_hat"))}
        e = inputs[:2] - inputs[2:4]
        r = 1.5 * e[0] + e[1]
        base = 2.5 * r + 1.5 * e[1] - inputs[4]
        N = math.exp(zeta**2) * math.cos(math.pi / 2 * zeta)
        for pieces, state, eta in (
            (no_network, [delta, zeta], base + delta * math.tanh(r / 0.2)),
            (no_network | no_robust, [zeta], base),
        ):
            diagram = nlctl.adaptive_neural(2, **pieces)
            assert diagram.nstates == len(state)
            u = diagram.output(0.0, state, inputs)[diagram.output_index["u"]]
            assert u == pytest.approx(N * eta, rel=1e-9, abs=1e-9)

    @each_row(
        ("order", "pieces", "told"),
        [
            (0, {}, "order >= 1, got 0"),
            (2.0, {}, "order >= 1, got 2.0"),
            (
                3,
                {"filtered_error": nlctl.controllers.FilteredError()},
                r"order 3 needs 2 lambdas, got 1 \(",
            ),
            (
                2,
                {"basis": nlctl.controllers.GaussianBasis(centres=np.eye(3))},
                "at most 2 coordinates, got 3",
            ),
        ],
    )
    def test_orders_and_dimensions_must_fit(self, order, pieces, told):
        """The message says what is needed and what was given."""
        with pytest.raises(nlctl.errors.ParameterError, match=rf"adaptive_neural .*{told}"):
            nlctl.adaptive_neural(order, **pieces)

    def test_the_number_of_nodes_must_fit(self):
        """Weights for other nodes than the basis has: the missing signal is named."""
        weights = nlctl.controllers.AdaptiveWeights(nodes=28)
        with pytest.raises(nlctl.errors.ParameterError, match="nodes=28 for 27"):
            nlctl.adaptive_neural(2, weights=weights)
        basis = nlctl.block(
            nlctl.controllers.GaussianBasis(), "basis"
        )  # a system's centres are not looked at
        with pytest.raises(nlctl.errors.DiagramError, match=r"'weights' takes .* 'psi\[27\]'"):
            nlctl.adaptive_neural(2, basis=basis, weights=nlctl.block(weights, "weights"))
        with pytest.raises(nlctl.errors.ParameterError, match="nodes=26 for 27"):
            nlctl.adaptive_neural(2, weights=nlctl.controllers.AdaptiveWeights(nodes=26))
