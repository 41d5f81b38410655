"""Lowering: a diagram as a program over batched members, from the blocks' own functions.

The functions have been run once on symbols.  What they compute is planned here for any number of
members at a time: each expression once, whatever depends on parameters alone in advance.  One
generator makes machine code of the plan (`codegen.ir`), and one interpreter carries it out.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..expressions.arrays import Tracer
from ..expressions.graph import Expr, needed
from .codegen.ir.program import program_text
from .codegen.plan import Function, Store, plan_function, split
from .codegen.rewrite import rewritten
from .codegen.solver import Solver
from .diagram.parameters import length
from .diagram.program import Program
from .diagram.schedule import Schedule
from .equations.blocks import Equations, equations
from .equations.located import Conditions
from .opaque.called import Call
from .timed.ahead import OfTime

PREPARE = {"prepare": ("p", "c")}
EVALUATE = {"rhs": ("t", "x", "u", "c", "dx", "g", "m"), "out": ("t", "x", "u", "c", "y")}
SAMPLE = ("t", "x", "u", "c", "s")  # of those of sampled blocks, of resets, of sharp functions
_OF_S = ("sample", "reset", "sharp")
POINT, DIRECTION = "point", "v"
ALONG = {POINT: ("t", "x", "u", "c"), "along": ("t", "x", "u", "c", DIRECTION, "dx")}


@dataclass(frozen=True, kw_only=True)
class Lowered:
    """A program over batched members ("lanes")."""

    # plans of ``prepare(p, c)`` and of what is evaluated: ``rhs(t, x, u, c, dx, g, m)``, ``out(t,
    # x, u, c, y)`` and a ``sample(t, x, u, c, s)`` for each meeting of the clocks of sampled
    # blocks, or ``point(t, x, u, c)`` and then, as often as there are directions, ``along(t, x, u,
    # c, v, dx)``.  All arrays have a row per number and a column per member, `t` is one row.
    # `prepare` fills `c` with all that depends on the parameters `p` alone; the rest of `c` is room
    # that the others write to, so members that run at the same time need a `c` each
    functions: Mapping[str, Function]
    exact: frozenset[Expr]  # operations that are rounded one by one
    calls: Mapping[str, Call]  # functions that are called unchanged, by name
    solvers: Mapping[str, Solver]  # searches for the signals of algebraic loops, by name
    rows: Mapping[str, int]  # rows of every array
    lanes: int  # number of members
    # integer parameters that steer what is computed: for places in `p` the values for which the
    # program holds
    assumed: Mapping[int, int]
    conditions: Conditions = field(default_factory=Conditions)  # what it switches at
    # functions in which a loop may take more passes than are written out: places of blocks, kinds
    cut: frozenset[tuple[int, str]] = frozenset()

    @property
    def size(self) -> int:
        """Rows of `c`."""
        return self.rows["c"]

    def shape(self, array: str) -> tuple[int, ...]:
        """Return the shape of one of its arrays."""
        return (self.lanes,) if array == "t" else (self.rows[array], self.lanes)

    @property
    def sharp(self) -> list[int]:
        """How each of the numbers is by which sharp functions are measured."""
        return self.conditions.kinds if "sharp" in self.functions else []

    @cached_property
    def timed(self) -> OfTime:
        """Its functions of time alone."""
        return OfTime(conditions=self.conditions)

    @property
    def opaque(self) -> dict[str, str]:
        """Why a function is called and not written out, by its name."""
        return {name: call.reason for name, call in self.calls.items()}

    @cached_property
    def operations(self) -> int:
        """How many numbers a right-hand side is made of, with those that `prepare` computes."""
        plan = self.functions["rhs"].plan
        return sum(node.size or 1 for node in plan.nodes if node.op not in ("leaf", "const"))

    @cached_property
    def text(self) -> str:
        """The LLVM IR of its functions."""
        return program_text(
            self.functions, self.lanes, self.exact, self.solvers.values(), self.portable
        )

    @property
    def portable(self) -> frozenset[str]:
        """Functions that round alike everywhere: a computer's program is what runs there."""
        # What samples compute, and what they read of parameters.
        samples = {name for name in self.functions if name.startswith("sample")}
        return frozenset(samples | {"prepare"} if samples else ())

    def holds_for(self, p: object) -> bool:
        """Whether the program holds for parameters `p`, an array with a row per number."""
        values = np.asarray(p)
        return all(bool((values[i] == v).all()) for i, v in self.assumed.items())


def lower(
    schedule: Schedule, program: Program, lanes: int = 8, found: Equations | None = None
) -> Lowered:
    """Plan a diagram as a program over batched members."""
    if found is None:
        found = equations(schedule, program.layout, meetings=program.meetings)
    stores = stores_of(found, found.results)
    wanted = {"rhs": [*stores["dx"], *stores["g"], *stores["m"]], "out": stores["y"]}
    samples = {name: SAMPLE for name in stores if name.startswith("sample")}
    samples |= {name: SAMPLE for name in stores if name in ("reset", "sharp")}
    wanted |= {name: stores[name] for name in samples}
    return _lowered(schedule, program, found, EVALUATE | samples, wanted, lanes)


def lower_along(
    schedule: Schedule,
    program: Program,
    equations: Equations,
    derivatives: Sequence[tuple[Expr | None, int]],
    lanes: int = 8,
) -> Lowered:
    """Plan the derivative of the right-hand side along a direction, one in each lane."""
    stores, row = [], 0
    for expr, size in derivatives:
        expr = equations.graph.const(0.0) if expr is None else expr
        stores += split(Store(array="dx", row=row, expr=expr, size=size))
        row += size
    return _lowered(schedule, program, equations, ALONG, {POINT: [], "along": stores}, lanes)


def _lowered(
    schedule: Schedule,
    program: Program,
    found: Equations,
    arguments: Mapping[str, tuple[str, ...]],
    wanted: Mapping[str, list[Store]],
    lanes: int,
) -> Lowered:
    stores, exact, _ = rewritten(found.graph, wanted)
    parameters = length(program.layout)
    functions, size = planned(stores, arguments, parameters)
    n, m = schedule.system.nstates or 0, schedule.ninputs
    rows = {
        "p": parameters, "t": 1, "x": n, "u": m, "c": max(size, 1), "dx": n,
        "g": program.events + found.conditions.rows, "m": len(program.memory),
        "y": len(schedule.outputs), "v": n + m + 1,
        "s": max(len(program.sampled), program.resets, len(found.conditions.kinds)),
    }  # fmt: skip
    return Lowered(
        functions=functions, exact=exact, calls=found.calls, solvers=found.solvers, rows=rows,
        lanes=lanes, assumed=found.graph.assumptions, conditions=found.conditions, cut=found.cut,
    )  # fmt: skip


def stores_of(found: Equations, names: Iterable[str]) -> dict[str, list[Store]]:
    """Return what is to be written for some of the results."""
    return {
        name: [
            part
            for row, array in found.results[name]
            for part in _stores("s" if name.startswith(_OF_S) else name, row, array)
        ]
        for name in names
    }


def planned(
    stores: Mapping[str, list[Store]], arguments: Mapping[str, tuple[str, ...]], parameters: int
) -> tuple[dict[str, Function], int]:
    """Return the plans of all functions, and how many rows of `c` they need."""
    # What depends on parameters alone is computed by `prepare`, and what else depends on no
    # direction by `point`.
    results = [s.expr for part in stores.values() for s in part]
    varying = {node for node in needed(results) if node.varies}
    known = _computed_before(results, varying, parameters)
    prepared = _kept(known, parameters)
    size = parameters + sum(store.size for store in prepared)
    wanted, before = {"prepare": prepared, **stores}, dict.fromkeys(stores, known)
    before["prepare"] = {}
    if POINT in stores:
        later = _computed_before(results, _along(results), size, known)
        wanted[POINT], before["along"] = _kept(later, size), known | later
        size += sum(store.size for store in wanted[POINT])
    functions = {}
    for name, given in {**PREPARE, **arguments}.items():
        planned = plan_function(wanted[name], before[name], size)
        size = planned.rows
        copied = parameters if name in PREPARE else 0
        functions[name] = Function(arguments=given, plan=planned, copied=copied)
    return functions, size


def _stores(name: str, row: int, array: Tracer) -> list[Store]:
    found: list[Store] = []
    for expr, size in array.pieces():
        found += split(Store(array=name, row=row, expr=expr, size=size))
        row += size
    return found


def _along(results: Sequence[Expr]) -> set[Expr]:
    """Return what depends on the direction."""
    found: set[Expr] = set()
    for node in needed(results):
        if any(arg in found for arg in node.args) or _reads(node, DIRECTION):
            found.add(node)
    return found


def _reads(node: Expr, array: str) -> bool:
    return node.op == "leaf" and node.data[0] == array


def _computed_before(
    results: Sequence[Expr],
    inside: Collection[Expr],
    rows: int,
    known: Mapping[Expr, tuple[str, int]] | None = None,
) -> dict[Expr, tuple[str, int]]:
    """Return what is used and is not inside, with its place in `c`, beyond what is known."""
    # A parameter has the place there that it has in `p`; what is computed lies from `rows` on.
    known, inside = known or {}, set(inside)
    nodes = needed(results, known)
    used = set(results) - inside
    for node in reversed(nodes):
        for arg in node.args if node in inside else ():
            if arg.kind == "b":  # truth values have no place in an array of floats
                inside.add(arg)
            elif arg not in inside:
                used.add(arg)
    found = {}
    for node in nodes:
        if node not in used or node in known or node.op == "const":
            continue
        if _reads(node, "p") and node.size is None:
            found[node] = ("c", node.data[1])
        elif _reads(node, "p") or node.op != "leaf":
            found[node], rows = ("c", rows), rows + (node.size or 1)
    return found


def _kept(found: Mapping[Expr, tuple[str, int]], rows: int) -> list[Store]:
    """Return what is to be computed and kept in `c`, from `rows` on."""
    return [
        Store(array=array, row=row, expr=expr, size=expr.size or 1)
        for expr, (array, row) in found.items()
        if row >= rows
    ]
