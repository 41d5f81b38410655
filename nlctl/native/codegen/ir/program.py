"""A program as LLVM IR: C functions of addresses of numbers.

    void prepare(double *p, double *c)
    void rhs(double *t, double *x, double *u, double *c, double *dx, double *g)
    void out(double *t, double *x, double *u, double *c, double *y)

No two arrays overlap.  Each has a row per number and an entry per member in each row.
"""

from collections.abc import Collection, Iterable, Mapping

from ....expressions.graph import Expr
from ..plan import Function
from ..solver import DONE, GUESS, Solver
from .loops import LoopWriter
from .numbers import Writer
from .text import Body, Module, Turns, constant, pointers

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
        texts.append(_solver(module, solver, lanes))
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
            LoopWriter(writer, loop).write()
    return b.function(name, pointers(function.arguments), linkage)


def _solver(module: Module, solver: Solver, lanes: int) -> str:
    """Return the IR of ``name(c, at, lane)``, which repeats ``name.step``."""
    b, size, zero = Body(module), len(solver.initial), constant(0, kind="i")

    def entry(k: str) -> str:
        """Return where the member has entry k of its rows."""
        row = b.new(f"mul i64 {b.new(f'add i64 %at, {k}').text}, {lanes}").text
        return b.address("c", 0, b.new(f"add i64 {row}, %lane").text)

    rooms = {"w": solver.given, "s": size, "n": size, "m": solver.function.plan.rows}
    for name, count in rooms.items():
        b.write(f"%{name} = alloca [{max(count, 1)} x double], align 32")
    given = constant(solver.given, kind="i")
    b.counted(zero, given, lambda i: b.store(b.load(entry(i.text), 0), b.address("w", 0, i.text)))
    for i, value in enumerate(solver.initial):
        b.store(constant(value), b.address("s", i))
    search = Turns(b, [])
    b.write(f"call void @{solver.name}.step(ptr %w, ptr %s, ptr %n, ptr %m)")
    b.write(f"call void @llvm.memcpy.p0.p0.i64(ptr %s, ptr %n, i64 {8 * size}, i1 0)")
    search.end(b.compare("une", b.load("%s", 0), DONE), [])
    for i in range(solver.count):
        b.store(b.load(b.address("s", GUESS + i), 0), entry(str(solver.given + i)))
    return b.function(solver.name, "ptr %c, i64 %at, i64 %lane", "internal ", "noinline ")
