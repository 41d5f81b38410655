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
from ..solver import DONE, GUESS, Solver
from .loops import written
from .numbers import Writer
from .text import Body, Module, float_text

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
