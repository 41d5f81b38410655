"""Loops with a filtered error r: known sign, and sliding mode."""

import math
from collections.abc import Iterable, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import Any

from .content import Record, begins, need, read_rational, read_split, split_text, states_text
from .equations import WrittenEquation, stays
from .integers import ALL, PI_ENCLOSED, TWO, ZERO, Interval, absolute, exact_text, sqrt

_INF = math.inf
_KAPPA = Fraction(2785, 10_000)  # above the largest s - s tanh s


class Filtered:
    """A loop with a filtered error r, whose state stays in a box while |r| < C."""

    def __init__(self, whole: Record) -> None:
        self.premise, self.proof = whole.record("premises"), whole.record("proof")
        self.lambdas = self.premise.numbers("lambdas")
        self.n = len(self.lambdas) + 1
        self.equation = WrittenEquation(self.premise["equation"])
        self.split = self.premise.record("actuator")
        self.starts = self.premise.record("starts")
        self.C = self.proof.positive("C")
        self.wanted = self._reference()
        yd = (_derivative(_sines(self.premise), k).on({"t": ZERO}) for k in range(self.n))
        x_0 = (self.starts.interval(name) for name in self.premise.states("plant", self.n))
        self.e0 = [x - y for x, y in zip(x_0, yd, strict=True)]
        self.errors, self.r_0 = self._errors()
        reach = [e + y for e, y in zip(self.errors, self.wanted, strict=False)]
        self.box = {f"x{i + 1}": Interval.of(-x, x) for i, x in enumerate(reach)}
        self._plant()

    def _reference(self) -> list[Fraction]:
        """Check the bounds of yd, yd', ..., over a period, or by the amplitudes."""
        bounds, sines = self.proof.numbers("reference", self.n + 1), _sines(self.premise)
        for k, most in enumerate(bounds):
            if sum(abs(a) * w**k for a, w, _ in sines) <= most:
                continue
            slowest = Fraction(0)
            for _, w, _ in sines:
                low = math.gcd(slowest.numerator * w.denominator, w.numerator * slowest.denominator)
                slowest = Fraction(low, slowest.denominator * w.denominator)
            need(slowest > 0, f"|yd^({k})| <= {float(most):.6g}")
            period = (PI_ENCLOSED * TWO / Interval.of(slowest)).top
            box = {"t": Interval.of(0, period)}
            derivative = _derivative(sines, k)
            line = f"|yd^({k})| <= {float(most):.6g}"
            stays(derivative.near_middle, box, -most, most, line)
        return bounds

    def _errors(self) -> tuple[list[Fraction], Fraction]:
        """Return bounds of |e_1|, ..., |e_n| while |r| < C, and of |r(0)|."""
        # r is what a chain of filters makes of e_1: z_0 = e_1, z_i = z_(i-1)' + p_i z_(i-1), and
        # the last one is r.
        poles = self._poles()[::-1]
        starts = [self.e0]  # of z_i and its derivatives
        for p in poles:
            z = starts[-1]
            starts.append([after + p * here for here, after in pairwise(z)])
        most = [Interval.of(self.C)]  # of |z_i| and its derivatives, from the last one on
        for p, z in zip(poles[::-1], starts[-2::-1], strict=True):
            first = Interval.of(max(absolute(z[0]).top, (most[0] / p).top))
            rising = [first]
            for after in most:
                rising.append(after + p * rising[-1])
            most = rising
        return [bound.top for bound in most], absolute(starts[-1][0]).top

    def _poles(self) -> list[Interval]:
        """Check that s^(n-1) + lambda_1 s^(n-2) + ... has the real roots -p < 0 of the file."""
        pairs = self.proof["poles"]
        need(isinstance(pairs, list) and len(pairs) == self.n - 1, "poles are missing")
        ends = sorted([read_rational(text) for text in pair] for pair in pairs)
        need(all(len(pair) == 2 and 0 < pair[0] <= pair[1] for pair in ends), "a pole is not > 0")
        coefficients = [Fraction(1), *self.lambdas]
        if all(low == high for low, high in ends):
            product = [Fraction(1)]
            for p, _ in ends:
                product = [a + p * b for a, b in zip([*product, 0], [0, *product], strict=True)]
            need(product == coefficients, "the poles are not those of the filter")
        else:
            signs = [[_horner(coefficients, -p) for p in pair] for pair in ends]
            apart = all(a[1] < b[0] for a, b in pairwise(ends))
            crossed = all(low * high < 0 for low, high in signs)
            need(apart and crossed, "the poles are not those of the filter")
        return [Interval.of(low, high) for low, high in ends]

    def _plant(self) -> None:
        """Check the bounds of g + d and of the gain F/v on the box."""
        time = self.box | {"t": Interval(0, _INF)}
        self.matched, self.G_min = self.proof.number("matched"), self.proof.positive("G_min")
        self.G_max = self.proof.number("G_max")
        line = f"|g + d| <= {float(self.matched):.6g}"
        stays(self.equation.near_middle, time | {"v": ZERO}, -self.matched, self.matched, line)
        line = f"{float(self.G_min):.6g} <= F/v <= {float(self.G_max):.6g}"
        stays(self.equation.quotient_on, time | {"v": ALL}, self.G_min, self.G_max, line)
        self.k_1, _, eps = read_split(self.split, Fraction(0))
        self.delta = self.matched + self.G_max * eps
        error_terms = (a * e for a, e in zip(reversed(self.lambdas), self.errors[1:], strict=True))
        self.Y_d = self.wanted[self.n] + sum(map(abs, error_terms), Fraction(0))


def filter_text(whole: Record) -> str:
    """Return the starts, and what the reader compares with his loop, in words."""
    premise = whole.record("premises")
    gains, lambdas = premise.record("gains"), premise.numbers("lambdas")
    numbers = ", ".join(f"{name} = {exact_text(gains.number(name))}" for name in gains.content)
    states = ("plant", *(part for part in ("weights", "delta_hat") if part in premise.content))
    sines = (
        f"{exact_text(a)} sin({exact_text(w)} t + {exact_text(c)})" for a, w, c in _sines(premise)
    )
    return (
        f"{begins(premise.record('starts'))}. Premises: {whole['kind']}; "
        f"{states_text(premise, states)}; "
        f"x{len(lambdas) + 1}' = {WrittenEquation(premise['equation'])}; yd = {' + '.join(sines)}; "
        f"{split_text(premise.record('actuator'))}; lambda = {[float(a) for a in lambdas]}; "
        f"{numbers}"
    )


def _sines(premise: Record) -> list[tuple[Fraction, Fraction, Fraction]]:
    reference = premise.record("reference")
    columns = [reference.numbers(name) for name in ("amplitudes", "frequencies", "phases")]
    need(len(set(map(len, columns))) == 1, "the reference has columns of different sizes")
    return list(zip(*columns, strict=True))


def _horner(coefficients: Sequence[Fraction], s: Fraction) -> Fraction:
    total = Fraction(0)
    for c in coefficients:
        total = total * s + c
    return total


def _derivative(sines: Iterable[tuple[Fraction, Fraction, Fraction]], k: int) -> WrittenEquation:
    """Return the k-th derivative of a sum of sines, as an equation in t."""
    nodes: list[Any] = [["symbol", "t"], ["number", "0"]]
    for a, w, phase in sines:
        last, i = len(nodes) - 1, len(nodes)
        size = a * w**k * (-1 if k % 4 in (2, 3) else 1)
        nodes += [["number", str(w)], ["*", 0, i], ["number", str(phase)], ["+", i + 1, i + 2],
                  ["cos" if k % 2 else "sin", i + 3], ["number", str(size)], ["*", i + 4, i + 5],
                  ["+", last, i + 6]]  # fmt: skip
    return WrittenEquation(nodes)


def known_sign_bounds(whole: Record) -> dict[str, Fraction]:
    """V' <= -alpha_1 V + alpha_0 of (31), with W = 0, wherever x is in the box."""
    loop = Filtered(whole)
    gains = loop.premise.record("gains")
    beta, N_0, tau, b = (gains.number(name) for name in ("beta", "N_0", "tau", "b"))
    sigma_1, sigma_2 = gains.number("sigma_1"), gains.number("sigma_2")
    Gamma, gamma = gains.positive("Gamma"), gains.positive("gamma")
    W_0 = [absolute(loop.starts.interval(name)).top for name in loop.premise.states("weights")]
    D_0, delta = loop.starts.interval(*loop.premise.states("delta_hat", 1)), loop.delta
    need(N_0 * loop.k_1 * loop.G_min >= 1, "N_0 k_1 G_min >= 1")
    need(min(beta, tau, b, sigma_1, sigma_2) >= 0, "a gain is negative")
    alpha_1 = min([2 * beta, sigma_2 * gamma] + ([sigma_1 * Gamma] if W_0 else []))
    need(alpha_1 > 0, "alpha_1 > 0")
    alpha_0 = _KAPPA * (tau * delta + b) + sigma_2 * delta**2 / 2
    off = max((delta - D_0.bottom) ** 2, (delta - D_0.top) ** 2)
    V_0 = (loop.r_0**2 + sum(w * w for w in W_0) / Gamma + off / gamma) / 2
    C_0 = sqrt(Interval.of(2 * max(V_0, alpha_0 / alpha_1))).top
    need(C_0 < loop.C, f"|r| <= {float(C_0):.6g} is below C = {float(loop.C):.6g}")
    roots = C_0 * (sqrt(Interval.of(gamma)).top + sqrt(Interval.of(Gamma * len(W_0))).top)
    u = N_0 * (beta * C_0 + loop.Y_d + delta + roots)
    read_split(loop.split, u)
    return {"|r|": C_0, "|u|": u, "limsup |r|": sqrt(Interval.of(2 * alpha_0 / alpha_1)).top}


def sliding_mode_bounds(whole: Record) -> dict[str, Fraction]:
    """|r| falls wherever it is above phi M / (k_1 G_min K), M being all that K dominates."""
    loop = Filtered(whole)
    gains = loop.premise.record("gains")
    K, phi, M = gains.positive("K"), gains.positive("phi"), loop.delta + loop.Y_d
    least = K * loop.k_1 * loop.G_min
    need(least > M, f"K k_1 G_min = {float(least):.6g} is above M = {float(M):.6g}")
    rho = phi * M / least
    C_0 = max(loop.r_0, rho)
    need(C_0 < loop.C, f"|r| <= {float(C_0):.6g} is below C = {float(loop.C):.6g}")
    read_split(loop.split, K)
    errors = {f"|e_{i + 1}|": e for i, e in enumerate(loop.errors)}
    return {"|r|": C_0, **errors, "|u|": K, "limsup |r|": rho}
