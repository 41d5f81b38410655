"""Loops whose signals are searched for: one step of the search, repeated until it is done.

Like a call of an opaque function a search has its arguments in rows of `c`, its results follow,
and it goes member by member: what one member needs has no influence on another one.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...expressions.graph import Expr
from .interpret import interpreted_function
from .ir.text import float_text
from .plan import Function

PASS = ("w", "s", "n", "c")  # arguments of a step: given from outside, state, next state, memory
GUESS = 4  # where the guess begins in the state; the first entry is the phase
DONE = 2.0


@dataclass(frozen=True, kw_only=True)
class Solver:
    """A search.

    Attributes
    ----------
    name : str
    given : int
        How many numbers it is given.
    count : int
        How many it results in.
    function : Function
        One step, for one member.
    exact : frozenset of Expr
        Operations of it that are rounded one by one.
    initial : tuple of float
        The state that it begins with.
    """

    name: str
    given: int
    count: int
    function: Function
    exact: frozenset[Expr]
    initial: tuple[float, ...]


def searched(solver: Solver) -> Callable[[np.ndarray], np.ndarray]:
    """Return a search as a function of what it is given, a column per point."""
    find = plain_solver(solver)

    def search(given: np.ndarray) -> np.ndarray:
        c = np.concatenate([given, np.empty((solver.count, given.shape[1]))])
        for point in range(given.shape[1]):
            find(c, 0, point)
        return c[solver.given :]

    return search


def plain_solver(solver: Solver) -> Callable[[np.ndarray, int, int], None]:
    """Return a search as plain Python, called with c, a row and a member."""
    step = interpreted_function(solver.function, 1, {})

    def at(c: np.ndarray, row: int, lane: int) -> None:
        given = c[row : row + solver.given, [lane]]
        state, memory = np.array(solver.initial)[:, None], np.empty((solver.function.plan.rows, 1))
        while state[0, 0] != DONE:
            following = np.empty_like(state)
            step(given, state, following, memory)
            state = following
        first = row + solver.given
        c[first : first + solver.count, lane] = state[GUESS : GUESS + solver.count, 0]

    return at


def solver_text(solver: Solver, lanes: int) -> str:
    """Return the IR of ``name(c, at, lane)``, which repeats ``name.step``."""
    size = len(solver.initial)
    first = [
        f"  %s{i} = getelementptr double, ptr %s, i64 {i}\n"
        f"  store double {float_text(v)}, ptr %s{i}, align 8\n"
        for i, v in enumerate(solver.initial)
    ]
    results = [_result(i, solver.given, lanes) for i in range(solver.count)]
    return f"""\
define internal void @{solver.name}(ptr %c, i64 %at, i64 %lane) noinline nounwind {{
entry:
  %w = alloca [{max(solver.given, 1)} x double], align 32
  %s = alloca [{size} x double], align 32
  %n = alloca [{size} x double], align 32
  %m = alloca [{max(solver.function.plan.rows, 1)} x double], align 32
{_arguments(solver.given, lanes)}{"".join(first)}  br label %search
search:
  call void @{solver.name}.step(ptr %w, ptr %s, ptr %n, ptr %m)
  call void @llvm.memcpy.p0.p0.i64(ptr %s, ptr %n, i64 {8 * size}, i1 0)
  %phase = load double, ptr %s, align 8
  %done = fcmp oeq double %phase, {float_text(DONE)}
  br i1 %done, label %end, label %search
end:
{"".join(results)}  ret void
}}
"""


def _arguments(given: int, lanes: int) -> str:
    """Return the lines that take one member's arguments out of its rows."""
    if not given:
        return ""
    return f"""\
  br label %take
take:
  %i = phi i64 [0, %entry], [%next, %take]
  %row = add i64 %at, %i
  %scaled = mul i64 %row, {lanes}
  %from = add i64 %scaled, %lane
  %source = getelementptr double, ptr %c, i64 %from
  %target = getelementptr double, ptr %w, i64 %i
  %v = load double, ptr %source, align 8
  store double %v, ptr %target, align 8
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, {given}
  br i1 %more, label %take, label %begin
begin:
"""


def _result(i: int, given: int, lanes: int) -> str:
    """Return the lines that hand out one result."""
    return f"""\
  %p{i} = getelementptr double, ptr %s, i64 {GUESS + i}
  %r{i} = load double, ptr %p{i}, align 8
  %a{i} = add i64 %at, {given + i}
  %b{i} = mul i64 %a{i}, {lanes}
  %d{i} = add i64 %b{i}, %lane
  %q{i} = getelementptr double, ptr %c, i64 %d{i}
  store double %r{i}, ptr %q{i}, align 8
"""
