"""Polynomials that are positive somewhere, as sums of squares: found by Clarabel, proved exactly.

p > 0 wherever g_i >= 0 if p = s_0 + s_1 g_1 + ... with sums of squares s_i, each v^T Q v of
monomials v and a positive definite Q.  All coefficients of p may be unknown: what is asked is
linear in them and in Q.  The numbers that are found are rounded to fractions, what that leaves of
the equation is put into Q, and Q is positive definite if its leading minors are positive.
"""

import itertools
import operator
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx

from nlctl.expressions.graph import Expr, Untraceable, needed
from nlctl.native.enclosures.scalars import scalar_expressions

from ...intervals.normal_form import is_positive_definite
from ..convex import ConeLimit, at_most, equal, minimizer, semidefinite

__all__ = ["PositiveCondition", "Term", "monomial_terms", "polynomials_of", "positive_where"]

Term = tuple[int, ...]
_SUMS = {"add": operator.add, "sub": operator.sub, "mul": operator.mul}
_PARTS = 1 << 20  # of 1, to which numbers are rounded
_ENOUGH = 1e-7  # least eigenvalue of a proposal


def monomial_terms(variables: int, degree: int) -> list[Term]:
    """Return the powers in all monomials up to a degree, the constant first."""
    powers = itertools.product(range(degree + 1), repeat=variables)
    return sorted((p for p in powers if sum(p) <= degree), key=lambda p: (sum(p), p))


def polynomials_of(results: Sequence[Expr], ring: fmpq_mpoly_ctx) -> list[fmpq_mpoly]:
    """Return expressions of the leaves ``x[0], x[1], ...`` as polynomials of a ring's variables."""
    _, results = scalar_expressions(results)
    polynomials: dict[Expr, fmpq_mpoly] = {}
    for node in needed(results):
        parts = [polynomials[arg] for arg in node.args]
        if node.op == "const" and np.isfinite(node.data):
            polynomials[node] = ring.constant(fmpq(*float(node.data).as_integer_ratio()))
        elif node.op == "leaf":
            polynomials[node] = ring.gen(node.data[1])
        elif node.op == "neg":
            polynomials[node] = -parts[0]
        elif node.op in _SUMS:
            polynomials[node] = _SUMS[node.op](*parts)
        elif node.op == "div" and parts[1].is_constant() and parts[1] != 0:
            polynomials[node] = parts[0] / parts[1].leading_coefficient()
        else:
            raise Untraceable(f"'{node.op}' is in no polynomial")
    return [polynomials[result] for result in results]


@dataclass(frozen=True, kw_only=True)
class PositiveCondition:
    """A polynomial sum c_i p_i that is to be positive wherever others are not negative.

    The c_i are unknown.
    """

    parts: Sequence[fmpq_mpoly]
    where: Sequence[fmpq_mpoly] = ()

    @cached_property
    def degree(self) -> int:
        """That of the sum, or one more to be even."""
        most = max(int(p.total_degree()) for p in (*self.parts, *self.where))
        return most + most % 2


@dataclass(frozen=True, kw_only=True)
class _Gram:
    """A sum of squares of monomials v, v^T Q v times a polynomial."""

    basis: list[Term]
    factor: fmpq_mpoly
    sign: int  # of the product in an equation
    first: int  # of Q's numbers among all unknown ones
    pairs: list[tuple[int, int]]  # their places in Q

    def product(self, k: int) -> fmpq_mpoly:
        """What number k stands in front of."""
        i, j = self.pairs[k]
        term = tuple(a + b for a, b in zip(self.basis[i], self.basis[j], strict=True))
        ring = self.factor.context()
        return ring.from_dict({term: self.sign * (1 if i == j else 2)}) * self.factor


@dataclass(kw_only=True)
class _Program:
    """All unknown numbers: coefficients, those of every Q, and at the end the least eigenvalue."""

    coefficients: int
    size: int
    grams: list[list[_Gram]] = field(default_factory=list)

    def add(self, condition: PositiveCondition) -> None:
        """Take up the squares of a condition; the last one of them stands alone."""
        ring, n = condition.parts[0].context(), condition.parts[0].context().nvars()
        grams = []
        for g in condition.where:
            half = (condition.degree - int(g.total_degree())) // 2
            if half >= 0:
                grams.append(self._gram(monomial_terms(n, half), g))
        products = (gram.product(k) for gram in grams for k in range(len(gram.pairs)))
        support = {m for p in (*condition.parts, *products) for m in p.to_dict()}
        basis = _that_may_occur(monomial_terms(n, condition.degree // 2), support)
        grams.append(self._gram(basis, ring.constant(1)))
        self.grams.append(grams)

    def _gram(self, basis: list[Term], factor: fmpq_mpoly) -> _Gram:
        pairs = [*zip(*map(list, np.tril_indices(len(basis))), strict=True)]
        gram = _Gram(basis=basis, factor=factor, sign=-1, first=self.size, pairs=pairs)
        self.size += len(pairs)
        return gram


def positive_where(
    conditions: Sequence[PositiveCondition], coefficients: int
) -> tuple[list[fmpq] | None, str]:
    """Return coefficients for which all conditions are proved to hold, or None and why not."""
    program = _Program(coefficients=coefficients, size=coefficients)
    for condition in conditions:
        program.add(condition)
    if any(not grams[-1].basis or any(grams[-1].basis[0]) for grams in program.grams):
        return None, "no square has the constant that is needed"
    limits = [_bounded(program)]
    for condition, grams in zip(conditions, program.grams, strict=True):
        limits.append(_equation(program, condition, grams))
        limits += [_definite(program, gram) for gram in grams]
    towards = np.zeros(program.size + 1)
    towards[-1] = -1.0
    x, status = minimizer(np.zeros((len(towards), len(towards))), towards, limits)
    if x is None or not x[-1] > _ENOUGH:
        return None, f"no sums of squares were found ({status})"
    solution = [fmpq(round(v * _PARTS), _PARTS) for v in x]
    for condition, grams in zip(conditions, program.grams, strict=True):
        if not _is_proved(condition, grams, solution):
            return None, "rounded to fractions they are no sums of squares"
    return solution[:coefficients], ""


def _that_may_occur(basis: list[Term], support: Iterable[Term]) -> list[Term]:
    """Return the monomials whose square is in a polynomial, or may be cancelled by others there."""
    support = set(support)
    while True:
        mixed = {
            tuple(a + b for a, b in zip(p, q, strict=True))
            for p, q in itertools.combinations(basis, 2)
        }
        kept = [p for p in basis if tuple(2 * a for a in p) in support | mixed]
        if len(kept) == len(basis):
            return basis
        basis = kept


def _bounded(program: _Program) -> ConeLimit:
    """Coefficients between -1 and 1, and a least eigenvalue of 1 at most."""
    n = program.coefficients
    A = np.zeros((2 * n + 1, program.size + 1))
    A[:n, :n], A[n : 2 * n, :n], A[-1, -1] = np.eye(n), -np.eye(n), 1.0
    return at_most(A, np.ones(2 * n + 1))


def _equation(program: _Program, condition: PositiveCondition, grams: Sequence[_Gram]) -> ConeLimit:
    """Every coefficient of what is left of the condition without its squares is 0."""
    rows: dict[Term, int] = {}
    entries = [(i, part) for i, part in enumerate(condition.parts)]
    entries += [(g.first + k, g.product(k)) for g in grams for k in range(len(g.pairs))]
    numbers: list[tuple[int, int, float]] = []
    for column, polynomial in entries:
        for term, value in polynomial.to_dict().items():
            numbers.append(
                (rows.setdefault(term, len(rows)), column, float(value.p) / float(value.q))
            )
    A = np.zeros((len(rows), program.size + 1))
    for row, column, value in numbers:
        A[row, column] += value
    return equal(A, np.zeros(len(rows)))


def _definite(program: _Program, gram: _Gram) -> ConeLimit:
    """Q - t >= 0 with t the last unknown number."""
    count = len(gram.pairs)
    A = np.zeros((count, program.size + 1))
    diagonal = np.array([i == j for i, j in gram.pairs])
    A[np.arange(count), gram.first + np.arange(count)] = -np.where(diagonal, 1.0, np.sqrt(2.0))
    A[diagonal, -1] = 1.0
    return semidefinite(A, np.zeros(count), len(gram.basis))


def _is_proved(
    condition: PositiveCondition, grams: Sequence[_Gram], solution: Sequence[fmpq]
) -> bool:
    """Whether the equation holds with positive definite Q, the last of which takes what is left."""
    left = sum(
        (c * p for c, p in zip(solution, condition.parts, strict=False)), condition.parts[0] * 0
    )
    for gram in grams:
        for k in range(len(gram.pairs)):
            left += solution[gram.first + k] * gram.product(k)
    *others, last = grams
    places: dict[Term, list[int]] = {}
    for k, (i, j) in enumerate(last.pairs):
        term = tuple(a + b for a, b in zip(last.basis[i], last.basis[j], strict=True))
        places.setdefault(term, []).append(k)
    numbers = [*solution[last.first : last.first + len(last.pairs)]]
    for term, value in left.to_dict().items():
        if term not in places:
            return False
        k = places[term][0]
        numbers[k] += value / (1 if last.pairs[k][0] == last.pairs[k][1] else 2)
    return _is_definite(last, numbers) and all(
        _is_definite(g, solution[g.first : g.first + len(g.pairs)]) for g in others
    )


def _is_definite(gram: _Gram, numbers: Sequence[Any]) -> bool:
    """Whether Q is, with these numbers."""
    size = len(gram.basis)
    Q = fmpq_mat(size, size)
    for (i, j), value in zip(gram.pairs, numbers, strict=True):
        Q[i, j] = Q[j, i] = value
    return is_positive_definite(Q)
