"""Loops with a reference model: V = E^T P E + |W_hat - W|^2 / Gamma', by rational arithmetic.

The model has xm_n' = b yd - a^T xm, E = x - xm, and the law u is (b yd - a^T xm - K^T E - W_hat^T
psi) / gain, or -W_hat^T psi where it has no gain.  With x_n' = beta v + c (b yd - a^T xm - K^T E) +
lambda W^T psi + rest, whatever beta and W are, E_n' = -K^T E - lambda (W_hat - W)^T psi + delta.
As long as V < C all signals are in a box, on which |rest|, and so |delta|, is bounded; if V cannot
reach C with that bound, it never does.
"""

import itertools
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import Any

from .content import Record, begins, need, read_rational, read_split, split_text, states_text
from .equations import WrittenEquation, stays
from .integers import ALL, ZERO, Interval, absolute, exact_text, sqrt

_MOST, _BITS = 20_000, 20_000  # products of terms, and bits of a coefficient
SumOfProducts = dict[tuple[Any, ...], Fraction]  # by product: a tuple of pairs (atom, power)
NO_SYMBOLS: SumOfProducts = {(): Fraction(1)}


def one_symbol(name: str) -> SumOfProducts:
    """Return a symbol as a sum."""
    return {((("symbol", name), 1),): Fraction(1)}


def plus(a: SumOfProducts, b: SumOfProducts, scale: Fraction) -> SumOfProducts:
    """Return a + scale b."""
    total = dict(a)
    for product, c in b.items():
        total[product] = total.get(product, Fraction(0)) + scale * c
    need(all(c.numerator.bit_length() <= _BITS for c in total.values()), "a number is too large")
    return {product: c for product, c in total.items() if c}


def _times(a: SumOfProducts, b: SumOfProducts) -> SumOfProducts:
    need(len(a) * len(b) <= _MOST, "an equation is too long")
    result: SumOfProducts = {}
    for one, c in a.items():
        for two, d in b.items():
            powers: dict[Any, int] = dict(one)
            for atom, n in two:
                powers[atom] = powers.get(atom, 0) + n
            product = tuple(sorted(powers.items(), key=repr))
            result = (
                plus(result, {product: c}, d) if product in result else result | {product: c * d}
            )
    return plus({}, result, Fraction(1))


def _function(operation: str, *arguments: SumOfProducts) -> SumOfProducts:
    inner = (tuple(sorted(one.items(), key=repr)) for one in arguments)
    return {(((operation, *inner), 1),): Fraction(1)}


def multiplied_out(equation: WrittenEquation) -> SumOfProducts:
    """Return an equation as a sum of products of symbols and functions of sums."""
    sums: list[SumOfProducts] = []
    for operation, *operands in equation.nodes:
        if operation == "number":
            sums.append(plus({}, NO_SYMBOLS, read_rational(operands[0])))
        elif operation == "symbol":
            sums.append(one_symbol(operands[0]))
        elif operation == "power":
            power = NO_SYMBOLS
            for _ in range(operands[1]):
                power = _times(power, sums[operands[0]])
            sums.append(power)
        elif operation == "+":
            sums.append(plus(sums[operands[0]], sums[operands[1]], Fraction(1)))
        elif operation == "*":
            sums.append(_times(sums[operands[0]], sums[operands[1]]))
        elif operation == "/" and sums[operands[1]].keys() == {()}:
            sums.append(plus({}, sums[operands[0]], 1 / sums[operands[1]][()]))
        elif operation == "/":
            sums.append(_times(sums[operands[0]], _function("/", sums[operands[1]])))
        else:
            sums.append(_function(operation, *(sums[i] for i in operands)))
    return sums[-1]


def as_equation(total: Mapping[tuple[Any, ...], Fraction]) -> WrittenEquation:
    """Return a sum of products as an equation."""
    nodes: list[list[Any]] = []

    def add(*node: object) -> int:
        nodes.append(list(node))
        return len(nodes) - 1

    def atom_of(operation: str, *inner: Any) -> int:
        if operation == "symbol":
            return add(operation, *inner)
        places = [sum_of(dict(one)) for one in inner]
        return add(operation, *([add("number", "1")] if operation == "/" else []), *places)

    def sum_of(terms: Mapping[tuple[Any, ...], Fraction]) -> int:
        whole = add("number", "0")
        for product, c in terms.items():
            term = add("number", str(c))
            for atom, n in product:
                term = add("*", term, add("power", atom_of(*atom), n))
            whole = add("+", whole, term)
        return whole

    sum_of(total)
    return WrittenEquation(nodes)


_FEEDBACK = "(b yd - a^T xm - K^T E - W_hat^T psi)"
_Numbers = Sequence[Fraction]
_Fall = tuple[Fraction, Fraction]  # bounds of V for all time, and of E^T P E in the end


def _product(x: _Numbers, y: _Numbers) -> Fraction:
    return sum((a * b for a, b in zip(x, y, strict=True)), Fraction(0))


def _root(x: Fraction) -> Fraction:
    return sqrt(Interval.of(x)).top


def positive_inverse(M: Sequence[_Numbers], what: str) -> list[_Numbers]:
    """Return the inverse of a symmetric matrix whose pivots are positive, as it is itself then."""
    n = len(M)
    rows = [[*row, *(Fraction(int(i == j)) for j in range(n))] for i, row in enumerate(M)]
    for i in range(n):
        need(rows[i][i] > 0, f"{what} is positive definite")
        rows[i] = [v / rows[i][i] for v in rows[i]]
        for j in range(n):
            if j != i:
                rows[j] = [a - rows[j][i] * b for a, b in zip(rows[j], rows[i], strict=True)]
    return [row[n:] for row in rows]


class EnergyForm:
    """E^T P E with the derivative -E^T Q E + 2 r d, r = P_n^T E, along E_n' = -K^T E + d."""

    def __init__(self, proof: Record, gains: _Numbers) -> None:
        n, what = len(gains), proof.where
        flat = proof.numbers("P", n * n)
        self.P = P = [flat[n * i : n * (i + 1)] for i in range(n)]
        need([list(column) for column in zip(*P, strict=True)] == P, f"P of {what} is symmetric")
        self.mu, self.inverse = proof.positive("mu"), positive_inverse(P, f"P of {what}")
        PA = [[a - row[-1] * K for a, K in zip([0, *row[:-1]], gains, strict=True)] for row in P]
        Q = [[-PA[i][j] - PA[j][i] for j in range(n)] for i in range(n)]
        slower = [[Q[i][j] - self.mu * P[i][j] for j in range(n)] for i in range(n)]
        positive_inverse(slower, f"Q - mu P of {what}")
        self.q = _product(
            P[-1], [_product(row, P[-1]) for row in positive_inverse(Q, f"Q of {what}")]
        )

    def reach(self, level: Fraction, c: _Numbers) -> Fraction:
        """Return the largest c^T E where E^T P E <= level."""
        return _root(level * _product(c, [_product(row, c) for row in self.inverse]))

    def errors(self, level: Fraction) -> list[Fraction]:
        """Return the largest |E_1|, |E_2|, ... where E^T P E <= level."""
        return [_root(level * row[i]) for i, row in enumerate(self.inverse)]

    def largest(self, sides: Sequence[Interval]) -> Fraction:
        """Return the largest E^T P E of a box, which is that of a corner."""
        corners = itertools.product(*((x.bottom, x.top) for x in sides))
        return max(_product(E, [_product(row, E) for row in self.P]) for E in corners)

    def driven(self, D: Fraction) -> Fraction:
        """Return what E^T P E is below in the end while |d| <= D: above it, E^T Q E > 4 q D^2."""
        return 4 * self.q * D * D / self.mu


class FollowedModel:
    """A loop with a reference model, as the file has it."""

    def __init__(self, whole: Record) -> None:
        self.premise, self.proof = whole.record("premises"), whole.record("proof")
        self.K, self.a = self.premise.numbers("K"), self.premise.numbers("a")
        need(0 < len(self.K) == len(self.a) <= 8, "plant and model are of one order, 1 to 8")
        self.form = EnergyForm(self.proof.record("error"), self.K)
        self.model = EnergyForm(self.proof.record("model"), self.a)
        need(self.premise.numbers("P_b") == self.form.P[-1], "P is that of the loop's own r")
        self.b, self.command = self.premise.number("b"), self.premise.not_negative("command")
        self.split, self.law = self.premise.record("actuator"), self.premise.record("weights")
        k_1, k_2, _ = read_split(self.split, Fraction(0))
        gain = self.premise["gain"]
        self.gain = Fraction(1) if gain is None else self.premise.number("gain")
        self.beta = self.proof.number("beta")
        need(self.gain != 0 and self.beta / self.gain > 0, "the gain has the sign of beta")
        self.lam = self.beta * (k_1 + k_2) / 2 / self.gain
        self.Gamma = self.law.positive("Gamma") / self.lam
        self.plant = WrittenEquation(self.premise["equation"])
        self.psi = [WrittenEquation(nodes) for nodes in self.premise.listed("regressor")]
        self.W = self.proof.numbers("W", len(self.psi))
        self.W_squared = _product(self.W, self.W)
        self.V_0, self.weights_0 = self._start()
        self.rest = self._rest()
        driven = self.model.driven(abs(self.b) * self.command)
        self.xm = max(self.model.largest(self._sides("model")), driven)

    def _sides(self, part: str) -> list[Interval]:
        count = len(self.psi) if part == "W_hat" else len(self.K)
        return [self.premise.record("starts").interval(s) for s in self.premise.states(part, count)]

    def _start(self) -> tuple[Fraction, Fraction]:
        """Return the largest V(0) and |W_hat(0)|."""
        level = None if self.premise["level"] is None else self.premise.not_negative("level")
        starts = self.premise.record("starts").content
        names = self.premise.listed("plant") + self.premise.listed("W_hat")
        if level is not None and not all(str(name) in starts for name in names):
            self._sides("model")
            return level, _root(level * self.Gamma) + _root(self.W_squared)
        E = [x - xm for x, xm in zip(self._sides("plant"), self._sides("model"), strict=True)]
        ends = [(x.bottom, x.top) for x in self._sides("W_hat")]
        far = sum(max((w - W) ** 2 for w in side) for side, W in zip(ends, self.W, strict=True))
        V_0 = self.form.largest(E) + far / self.Gamma
        size = _root(sum((max(w * w for w in side) for side in ends), Fraction(0)))
        return V_0 if level is None else min(V_0, level), size

    def _rest(self) -> WrittenEquation | None:
        """Return what beta v, the feedback, and the weights leave of the plant's equation."""
        rest = plus(multiplied_out(self.plant), one_symbol("v"), -self.beta)
        share = Fraction(1) if self.premise["gain"] is None else 1 - self.lam
        rest = plus(rest, one_symbol("yd"), -share * self.b)
        for i, (K, a) in enumerate(zip(self.K, self.a, strict=True)):
            rest = plus(rest, one_symbol(f"x{i + 1}"), share * K)
            rest = plus(rest, one_symbol(f"xm{i + 1}"), share * (a - K))
        for W, psi in zip(self.W, self.psi, strict=True):
            rest = plus(rest, multiplied_out(psi), -self.lam * W)
        return as_equation(rest) if rest else None

    def region(self, C: Fraction, most: Fraction) -> tuple[Fraction, Fraction, Fraction]:
        """Return bounds of |delta|, |u| and |W_hat| while V < C, if |rest| <= `most` there."""
        W_hat = _root(C * self.Gamma) + _root(self.W_squared)
        if self.law["kind"] == "projection":
            W_hat = min(W_hat, max(self.law.positive("W_max"), self.weights_0))
        reach, modelled = self.form.errors(C), self.model.errors(self.xm)
        box = {"t": Interval(0, ALL.high), "yd": _around(self.command)}
        for i, (e, m) in enumerate(zip(reach, modelled, strict=True)):
            box |= {f"x{i + 1}": _around(e + m), f"xm{i + 1}": _around(m)}
        psi = ZERO
        for one in self.psi:
            psi = psi + one.on(box).power(2)
        need(psi.top < ALL.high, "|psi| is bounded")
        feedback = abs(self.b) * self.command + self.model.reach(self.xm, self.a)
        feedback = (feedback + self.form.reach(C, self.K)) * int(self.premise["gain"] is not None)
        u = (W_hat * sqrt(psi).top + feedback) / abs(self.gain)
        k_1, k_2, eps = read_split(self.split, u)
        box["v"] = _around(k_2 * u + eps)
        sides = {name: x for name, x in box.items() if name in "tv" or name[1:].isdigit()}
        value = self.plant.on(sides)
        need(absolute(value).top < ALL.high, "the plant's equation has a value on the box")
        line = f"|rest| <= {float(most):.6g}"
        need(most >= 0, line)
        if self.rest is not None:
            read = {node[1] for node in self.rest.nodes if node[0] == "symbol"}
            over = {name: x for name, x in box.items() if name in read}
            stays(self.rest.near_middle, over, -most, most, line)
        return most + abs(self.beta) * (eps + (k_2 - k_1) / 2 * u), u, W_hat


def _around(x: Fraction) -> Interval:
    return Interval.of(-x, x)


def _forgotten(loop: FollowedModel, D: Fraction, stage: Record, V_0: Fraction) -> _Fall:
    """V' <= -alpha_1 V + alpha_0 for every rate alpha_1 that is small enough."""
    sigma = loop.law.number("sigma")
    if sigma == D == 0:
        return V_0, Fraction(0)
    a, fastest = stage.positive("alpha_1"), loop.law.number("Gamma") * sigma
    need(a < loop.form.mu and a < 2 * fastest, "alpha_1 < min{mu, 2 Gamma sigma}")
    alpha_0 = loop.form.q * D * D / (1 - a / loop.form.mu)
    alpha_0 += sigma * loop.lam * loop.W_squared / (2 - a / fastest)
    return max(V_0, alpha_0 / a), alpha_0 / a


def _forgotten_with_error(loop: FollowedModel, D: Fraction, stage: Record, V_0: Fraction) -> _Fall:
    """V' > 0 only where E^T Q E < q h^2, h = 2 D + sigma |W|^2/2 - 2 sigma |W_hat - W/2|^2."""
    sigma, W = loop.law.positive("sigma") * loop.lam, _root(loop.W_squared)
    V_e, h_0 = stage.number("V_e"), 2 * D + sigma * loop.W_squared / 2
    widest = Interval.of(0, _root(h_0 / (2 * sigma)))
    half, error = Interval.of(W / 2), Interval.of(loop.form.q / loop.form.mu)

    def level(cell: Any) -> Interval:
        h = Interval.of(h_0) - Interval.of(2 * sigma) * cell["s"].power(2)
        return h.power(2) * error + (cell["s"] + half).power(2) * Interval.of(1 / loop.Gamma)

    stays(level, {"s": widest}, Fraction(0), V_e, f"V_e <= {float(V_e):.6g}")
    return max(V_0, V_e), V_e


def _projected(loop: FollowedModel, D: Fraction, stage: Record, V_0: Fraction) -> _Fall:
    """The weights stay in a ball, and W is in the inner one: V' <= -E^T Q E + 2 r delta."""
    W_max, width = loop.law.positive("W_max"), loop.law.positive("width")
    need(loop.W_squared * (1 + width) <= W_max**2, "W is in the inner ball of the projection")
    if D == 0:
        return V_0, Fraction(0)
    far = (max(W_max, loop.weights_0) + _root(loop.W_squared)) ** 2 / loop.Gamma
    return max(V_0, far + loop.form.driven(D)), far + loop.form.driven(D)


_KINDS: dict[str, tuple[Callable[..., _Fall], bool]] = {  # and whether all of V falls in the end
    "sigma-modification": (_forgotten, True),
    "e-modification": (_forgotten_with_error, False),
    "projection": (_projected, True),
}


def reference_model_bounds(whole: Record) -> dict[str, Fraction]:
    """V < C implies V <= level < C; and then again, on the smaller box of what V is in the end."""
    loop = FollowedModel(whole)
    need(loop.law["kind"] in _KINDS, "the modification of the weights is another one")
    fall, all_falls = _KINDS[loop.law["kind"]]
    stages = [Record(stage, "a stage") for stage in loop.proof.listed("stages")]
    bounds: dict[str, Fraction] = {}
    level = end = Fraction(0)
    for stage in stages:
        C = stage.positive("C")
        D, u, W_hat = loop.region(C, stage.number("rest"))
        if not bounds:
            level, end = fall(loop, D, stage, loop.V_0)
            need(level < C, f"V <= {float(level):.6g} is below C = {float(C):.6g}")
            errors = loop.form.errors(level)
            bounds = {f"|E_{i + 1}|": e for i, e in enumerate(errors)} | {
                "|W_hat|": W_hat,
                "|u|": u,
            }
        else:
            need(all_falls and end < C, f"V falls below C = {float(C):.6g}")
            end = min(end, fall(loop, D, stage, Fraction(0))[1])
    need(bool(bounds), "there is no stage")
    return bounds | {"limsup |E_1|": loop.form.errors(end)[0]}


def model_text(whole: Record) -> str:
    """Return what the reader compares with his loop, in words."""
    premise = whole.record("premises")
    law, n = premise.record("weights"), len(premise.numbers("K"))
    rows = ((name, [float(x) for x in premise.numbers(name)]) for name in ("K", "a", "P_b"))
    numbers = ", ".join(f"{name} = {row}" for name, row in rows)
    psi = ", ".join(str(WrittenEquation(nodes)) for nodes in premise.listed("regressor"))
    parameters = {name: law[name] for name in law.content if name != "kind"}
    listed = ", ".join(f"{name} = {exact_text(law.number(name))}" for name in parameters)
    gain = (
        "-W_hat^T psi"
        if premise["gain"] is None
        else f"{_FEEDBACK} / {exact_text(premise.number('gain'))}"
    )
    level = "" if premise["level"] is None else f"V(0) <= {exact_text(premise.number('level'))}, "
    if level:
        error, W = whole.record("proof").record("error"), whole.record("proof").numbers("W")
        level += f"V of P = {[float(x) for x in error.numbers('P')]}, W = {[float(x) for x in W]}, "
    return (
        f"{level}{begins(premise.record('starts'), bool(level))}. Premises: {whole['kind']}; "
        f"{states_text(premise, ('plant', 'model', 'W_hat'))}; "
        f"x{n}' = {WrittenEquation(premise['equation'])}; u = {gain}; psi = [{psi}]; {numbers}, "
        f"b = {exact_text(premise.number('b'))}; |yd| <= {exact_text(premise.number('command'))}; "
        f"{split_text(premise.record('actuator'))}; {law['kind']}: {listed}"
    )
