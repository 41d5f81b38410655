"""A program as LLVM IR: C functions of addresses of numbers.

    void prepare(double *p, double *c)
    void rhs(double *t, double *x, double *u, double *c, double *dx, double *g)
    void out(double *t, double *x, double *u, double *c, double *y)

No two arrays overlap.  Each has a row per number and an entry per member in each row.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

from ....expressions.graph import Expr
from ..plan import Function
from ..solver import Solver
from .loops import written
from .numbers import Writer
from .search import solver_text
from .text import Body, Module

COPY = "declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)"


def program_text(
    functions: Mapping[str, Function],
    lanes: int,
    exact: Collection[Expr],
    solvers: Iterable[Solver] = (),
    portable: Collection[str] = (),
) -> str:
    """Return the IR of some functions; of the portable ones every operation rounds alike."""
    module = Module(inlined=lanes == 1)
    texts = [
        _function(module, name, f, lanes, exact, portable=name in portable)
        for name, f in functions.items()
    ]
    for solver in solvers:
        module.declared[COPY] = None
        step = f"{solver.name}.step"
        texts.append(_function(module, step, solver.function, 1, solver.exact, "internal "))
        texts.append(solver_text(solver, lanes))
    return "\n".join([module.text(), *texts])


def _function(
    module: Module, name: str, function: Function, lanes: int, exact: Collection[Expr],
    linkage: str = "", portable: bool = False,
) -> str:  # fmt: skip
    b = Body(module, portable)
    if function.copied:
        module.declared[COPY] = None
        source, target = function.arguments[:2]
        size = 8 * function.copied * lanes
        b.write(f"call void @llvm.memcpy.p0.p0.i64(ptr %{target}, ptr %{source}, i64 {size}, i1 0)")
    writer = Writer(b, function.plan, lanes, exact)
    for level in function.plan.levels:
        writer.numbers(level.numbers)
        for loop in level.loops:
            written(writer, loop)
    b.write("ret void")
    given = ", ".join(f"ptr noalias %{argument}" for argument in function.arguments)
    return f"define {linkage}void @{name}({given}) nounwind {{\nentry:\n{b.text()}}}\n"
