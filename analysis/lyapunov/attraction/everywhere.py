"""Barriers in all of space: polynomials B of polynomial rates, by sums of squares."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from flint import Ordering, fmpq, fmpq_mpoly, fmpq_mpoly_ctx

from nlctl.errors import ParameterError
from nlctl.expressions.graph import Expr, Untraceable
from nlctl.native.enclosures.boxes import expressions_of

from ...intervals.box import Box
from .motion import StateRates
from .squares import PositiveCondition, monomial_terms, polynomials_of, positive_where

__all__ = ["inequality_of", "safe_everywhere"]

_DECAYS = ((1, 1), (1, 3), (3, 1), (1, 10), (10, 1))  # k of B' + k B < 0


def inequality_of(function: Callable[[Any], Any], sides: int) -> Expr:
    """Return the expression of a set, which is where it is not negative."""
    numbers = expressions_of(function, sides)[1]
    if len(numbers) != 1:
        raise Untraceable(f"one number has to be >= 0 in a set, not {len(numbers)}")
    return numbers[0]


def safe_everywhere(
    motion: StateRates, box: Box, start: object, unsafe: Sequence[Any], degree: int, max_boxes: int
) -> dict[str, Any]:
    """Prove it by sums of squares; there are no boxes."""
    ring = fmpq_mpoly_ctx.get(motion.names, Ordering.lex)
    try:
        rates = polynomials_of(motion.rates, ring)
        begins, *bad = (_where(ring, one) for one in (start, *unsafe))
    except Untraceable as error:
        raise ParameterError(
            f"barrier needs polynomials where the box is infinite, got another function ({error}): "
            "give a finite box"
        ) from None
    terms = monomial_terms(len(rates), degree)
    parts = [ring.from_dict({term: 1}) for term in terms]
    along = [sum((p.derivative(i) * f for i, f in enumerate(rates)), p * 0) for p in parts]
    apart = [PositiveCondition(parts=[-p for p in parts], where=begins)]
    apart += [PositiveCondition(parts=parts, where=where) for where in bad]
    coefficients, reason = None, ""
    for k in _DECAYS:
        falls = [-slope - fmpq(*k) * p for p, slope in zip(parts, along, strict=True)]
        coefficients, reason = positive_where([*apart, PositiveCondition(parts=falls)], len(parts))
        if coefficients is not None:
            break
    numbers = [float(c.p) / float(c.q) for c in coefficients or [fmpq(0)] * len(parts)]
    return {
        "middle": np.zeros(len(rates)), "half": np.ones(len(rates)), "terms": tuple(terms),
        "coefficients": np.array(numbers), "reason": reason and f"{reason}: raise degree",
        "boxes": 0, "arithmetic": "rational numbers",
    }  # fmt: skip


def _where(ring: fmpq_mpoly_ctx, one: Any) -> list[fmpq_mpoly]:
    """Return polynomials that are not negative in a set."""
    if callable(one):
        return polynomials_of([inequality_of(one, ring.nvars())], ring)
    ends = [[fmpq(*float(v).as_integer_ratio()) for v in side] for side in one.cell]
    return [(ring.gen(i) - a) * (b - ring.gen(i)) for i, (a, b) in enumerate(ends)]
