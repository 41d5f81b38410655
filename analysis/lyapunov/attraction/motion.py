"""What moves: the rates of a diagram, or of a function, as expressions of its states."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import control as ct
import numpy as np

from nlctl.diagrams import state_names
from nlctl.errors import ParameterError
from nlctl.expressions.continuity import may_jump
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Expr, Graph, Untraceable
from nlctl.native.compiled import Compiled, as_compiled
from nlctl.native.enclosures.boxes import BoxCode, enclosed, expressions_of
from nlctl.native.enclosures.rates import state_rates, with_leaves
from nlctl.upstream.numba_internals import is_jit_disabled
from nlctl.upstream.systems import System

from ...intervals.box import Box


@dataclass(frozen=True, kw_only=True)
class StateRates:
    """Rates x' = f(x)."""

    names: tuple[str, ...]  # states
    rates: tuple[Expr, ...]  # of the leaves ``x[0], x[1], ...``

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.names)

    def in_graph(
        self, more: int = 0, also: Sequence[Expr] = ()
    ) -> tuple[Graph, list[Expr], list[Expr]]:
        """Return a graph with the rates and others, and the leaves of states and more sides."""
        exprs = (*self.rates, *also)
        graph, rates = with_leaves(exprs, lambda g, leaf: g.leaf("x", leaf.data[1], None))
        leaves = [graph.leaf("x", i, None) for i in range(self.order + more)]
        return graph, rates, leaves

    def at(self, points: np.ndarray) -> np.ndarray:
        """Return the rates at points, an array of shape (points, states)."""
        rates = evaluate_expressions(self.rates, {"x": np.asarray(points, dtype=float).T})
        return np.stack([np.broadcast_to(v, len(points)) for v in rates], axis=1)

    @cached_property
    def slopes(self) -> BoxCode:
        """Code of all df_i/dx_j, row by row."""
        graph, rates, leaves = self.in_graph()
        one, zero, slopes = graph.const(1.0), graph.const(0.0), []
        for rate in rates:
            for leaf in leaves:
                (slope,) = tangents(graph, [rate], lambda e, j=leaf: one if e is j else None)
                slopes.append(zero if slope is None else slope)
        return enclosed(slopes, self.order)

    def jacobian(self, point: np.ndarray) -> np.ndarray:
        """Return df/dx at a point."""
        slopes = evaluate_expressions(self.slopes.expressions, {"x": point[:, None]})
        return np.array([float(np.ravel(v)[0]) for v in slopes]).reshape(self.order, -1)

    @cached_property
    def jumps(self) -> bool:
        """Whether the rates may jump."""
        return may_jump(self.rates)


def motion_of(
    who: str,
    system: System,
    box: Box,
    params: Mapping[str, Any] | None = None,
    *,
    is_finite: bool = True,
) -> StateRates:
    """Return the rates of a diagram or of a function as expressions, for machine code."""
    if is_jit_disabled():
        raise ParameterError(f"{who} needs machine code: unset NUMBA_DISABLE_JIT")
    try:
        if isinstance(system, ct.InputOutputSystem | Compiled):
            compiled = as_compiled(system, params)
            names: Sequence[str] = state_names(compiled.system)
            rates = state_rates(compiled, dict(params or {}))
        elif isinstance(system, Callable):  # type: ignore[arg-type]
            names, rates = box.names, expressions_of(system, len(box.names))[1]
            rates = with_leaves(rates, lambda g, leaf: g.leaf("x", leaf.data[1], None))[1]
        else:
            raise ParameterError(
                f"{who} needs a diagram or a function of states, got {type(system).__name__}"
            )
    except Untraceable as error:
        raise ParameterError(
            f"{who} needs rates that are a function of the states and can be read: {error}"
        ) from None
    if not len(names) == len(rates) == len(box.names):
        raise ParameterError(
            f"{who} needs a side of the box for each of {', '.join(names)}, got "
            f"{', '.join(box.names)}, and as many rates, got {len(rates)}"
        )
    if is_finite and not np.all(np.isfinite(box.cell)):
        raise ParameterError(f"{who} needs a box with finite sides, got {box}")
    return StateRates(names=tuple(names), rates=tuple(rates))
