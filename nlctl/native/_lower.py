"""Lowering: a diagram as code over members side by side, from the blocks' own functions.

`Program` calls the blocks' functions for one member.  Here the same functions have been run once
on symbols, and what they compute is written out for several members at a time: each expression
once, whatever depends on parameters alone in advance.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numba.core import config
from numba.core.errors import NumbaWarning

from .._equation import equation
from ..expressions.graph import Expr
from . import _vector_math, _vector_memory, _vector_type
from ._compile import TAUGHT, _jitted
from ._emit import Program
from ._lower_blocks import Call, Equations, equations
from ._lower_emit import written
from ._lower_plan import Store, needed, plan, split
from ._parameters import length
from ._schedule import Schedule
from ._vector_math import FUNCTIONS
from .codegen.fingerprint import module_key
from .codegen.machine_code import Wanted, machine_code
from .codegen.module import loaded

VECTOR, MATRIX = numba.float64[::1], numba.float64[:, ::1]
PREPARE = numba.void(MATRIX, MATRIX)
RHS = numba.void(VECTOR, MATRIX, MATRIX, MATRIX, MATRIX, MATRIX)
OUT = numba.void(VECTOR, MATRIX, MATRIX, MATRIX, MATRIX)
VECTORS = (_vector_math, _vector_memory, _vector_type)  # code that numba is taught
MEMORY = ("load", "store", "gather", "store_first", "repeated", "first", "total", "select")


@dataclass(frozen=True, kw_only=True)
class Lowered:
    """A program over members side by side ("lanes").

    Attributes
    ----------
    source : str
        Defines ``prepare(p, c)``, ``rhs(t, x, u, c, dx, g)`` and ``out(t, x, u, c, y)``.  All
        arrays have a row per number and a column per member, `t` is one row.  `prepare` fills `c`
        with all that depends on the parameters `p` alone; the rest of `c` is room that `rhs` and
        `out` write to, so members that run at the same time need a `c` each.
    functions : mapping
        Functions that are called as they stand, by the names that the source uses.
    constants : mapping
        What else the source refers to, by name.
    records : mapping
        What gathers the parameters of those functions: in plain Python, and in machine code.
    lanes : int
        Number of members.
    size : int
        Rows of `c`.
    assumed : mapping
        Integer parameters that steer what is computed: for places in `p` the values for which the
        source holds.
    opaque : mapping
        Why a function is called and not written out, by its name.
    """

    source: str
    functions: Mapping[str, Any]
    constants: Mapping[str, Any]
    records: Mapping[str, Any]
    lanes: int
    size: int
    assumed: Mapping[int, int]
    opaque: Mapping[str, str]

    def namespace(self, *, native: bool) -> dict[str, Any]:
        """Return everything that the source refers to, by name."""
        records = {name: pair[native] for name, pair in self.records.items()}
        return {**self.constants, **self.functions, **records}

    def holds_for(self, p: Any) -> bool:
        """Whether the source holds for parameters `p`, an array with a row per number."""
        return all(bool(np.all(np.asarray(p)[i] == v)) for i, v in self.assumed.items())


def lower(
    schedule: Schedule, program: Program, lanes: int = 8, found: Equations | None = None
) -> Lowered:
    """Write a diagram as code over members side by side.

    Parameters
    ----------
    schedule : Schedule
    program : Program
        What was emitted for it.
    lanes : int, optional
        Number of members.  With 1, loops take several elements at a time.
    found : Equations, optional
        What the schedule computes, where that has been read already.

    Returns
    -------
    Lowered
    """
    if schedule.loops:
        return _one_by_one(schedule, program, lanes)
    found = found or equations(schedule, program.layout)
    stores = {
        name: [part for row, array in rows for part in _stores(name, row, array)]
        for name, rows in found.results.items()
    }
    size = length(program.layout)
    known = _parameters_alone([s.expr for part in stores.values() for s in part], size)
    tables: dict[Expr, str] = {}
    prepared = [
        Store(array="c", row=r, expr=e, size=e.size or 1)
        for e, (_, r) in known.items()
        if r >= size
    ]
    copied = _copied(size, lanes)
    size += sum(store.size for store in prepared)
    lines: list[str] = [f"L = {lanes}", *_calls(found)]
    for header, wanted, given in (
        ("prepare(p, c)", prepared, {}),
        ("rhs(t, x, u, c, dx, g)", [*stores["dx"], *stores["g"]], known),
        ("out(t, x, u, c, y)", stores["y"], known),
    ):
        planned = plan(wanted, given, size)
        size = planned.rows
        head, *body = written(header, planned, given, lanes, found.calls, tables)
        lines += ["", "", head, *(copied if wanted is prepared else ()), *body]
    constants = {"np": np, **_NAMES, **program.constants}
    constants |= {name: np.array(table.data) for table, name in tables.items()}
    return Lowered(
        source="\n".join([*lines, ""]),
        functions=program.functions if found.calls else {},
        records=program.records if found.calls else {},
        constants=constants,
        lanes=lanes,
        size=max(size, 1),
        assumed=found.graph.assumptions,
        opaque={name: call.reason for name, call in found.calls.items()},
    )


def _one_by_one(schedule: Schedule, program: Program, lanes: int) -> Lowered:
    """Return the program itself for one member after the other: loops are solved by iteration."""
    n, count = schedule.system.nstates or 0, schedule.system.noutputs or 0
    rows = length(program.layout)
    one = program.source.replace("def rhs(", "@equation\ndef rhs_of_one(")
    one = one.replace("def out(", "@equation\ndef out_of_one(")
    given = f"t[lane], x[:, lane].copy(), u[:, lane].copy(), c[:{rows}, lane].copy()"
    source = f"""{one}

def prepare(p, c):
    for i in range({rows}):
        for lane in range({lanes}):
            c[i, lane] = p[i, lane]


def rhs(t, x, u, c, dx, g):
    dx1, g1 = np.empty({n}), np.empty({program.events})
    for lane in range({lanes}):
        rhs_of_one({given}, dx1, g1)
        for i in range({n}):
            dx[i, lane] = dx1[i]
        for i in range({program.events}):
            g[i, lane] = g1[i]


def out(t, x, u, c, y):
    y1 = np.empty({count})
    for lane in range({lanes}):
        out_of_one({given}, y1)
        for i in range({count}):
            y[i, lane] = y1[i]
"""
    return Lowered(
        source=source,
        functions=program.functions,
        constants={"np": np, **_NAMES, **program.constants},
        records=program.records,
        lanes=lanes,
        size=max(rows, 1),
        assumed={},
        opaque={"rhs_of_one": "it has algebraic loops to be solved"},
    )


def plain_functions(lowered: Lowered) -> tuple[Any, Any, Any]:
    """Return ``prepare``, ``rhs`` and ``out`` as plain Python."""
    namespace = lowered.namespace(native=False)
    exec(lowered.source, namespace)
    return namespace["prepare"], namespace["rhs"], namespace["out"]


def lowered_code(lowered: Lowered) -> tuple[Any, Any, Any]:
    """Return ``prepare``, ``rhs`` and ``out`` as machine code, from the cache if it is there.

    With NUMBA_DISABLE_JIT=1 the same source runs as plain Python.

    Raises
    ------
    CompileError
        If a block's function is no plain function.
    """
    if getattr(config, "DISABLE_JIT", False):
        return plain_functions(lowered)
    module = loaded(lowered, {name: _jitted(f) for name, f in lowered.functions.items()})
    options = {"error_model": "numpy", "nogil": True}
    signatures = {"prepare": PREPARE, "rhs": RHS, "out": OUT}
    wanted = [
        Wanted(function=getattr(module, name), signature=signature, options=options)
        for name, signature in signatures.items()
    ]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaWarning)  # of what the user need not know
        prepare, rhs, out = machine_code(
            f"{module.__name__} {module_key(*TAUGHT, *VECTORS)}", wanted
        )
        return prepare, rhs, out


def _stores(name: str, row: int, array: Any) -> list[Store]:
    graph = array.graph
    if array.axis is not None:
        return split(Store(array=name, row=row, expr=graph.number(array.only), size=array.length))
    return [
        Store(array=name, row=row + k, expr=graph.number(e), size=1)
        for k, e in enumerate(array.cells.flat)
    ]


def _copied(rows: int, lanes: int) -> list[str]:
    """Return the lines that make the parameters the first rows of `c`."""
    if not rows:
        return []
    line = "c[i, 0] = p[i, 0]" if lanes == 1 else "store(c, i * L, load(p, i * L, L))"
    return [f"    for i in range({rows}):", f"        {line}"]


def _parameters_alone(results: list[Expr], rows: int) -> dict[Expr, tuple[str, int]]:
    """Return what is used and depends on parameters alone, with its place in `c`.

    That is where a parameter has it in `p`, and behind all of them, from `rows` on, what is
    computed of them.
    """
    nodes = needed(results, ())
    inside = {node for node in nodes if node.varies}
    used = set(results) - inside
    for node in reversed(nodes):
        for arg in node.args if node in inside else ():
            if arg.kind == "b":  # truth values have no place in an array of floats
                inside.add(arg)
            elif not arg.varies:
                used.add(arg)
    found = {}
    for node in nodes:
        if node in used and node.op == "leaf" and node.size is None:
            found[node] = ("c", node.data[1])
        elif node in used and node.op != "const":
            found[node], rows = ("c", rows), rows + (node.size or 1)
    return found


def _calls(found: Equations) -> list[str]:
    """Return the source of the functions that call an opaque function for one member."""
    lines: list[str] = []
    for call in found.calls.values():
        lines += ["", "", "@equation", f"def {call.name}(c, at, lane):  # {call.reason}"]
        lines += [f"    {line}" for line in _unpacked(call)]
    return lines


def _unpacked(call: Call) -> list[str]:
    _, x, u, p, y = np.cumsum(call.lengths)
    given = [
        f"given = c[at : at + {p}, lane].copy()",
        "t = given[0]",
        f"x, u, p = given[1:{x}], given[{x}:{u}], given[{u}:{p}]",
        f"y = c[at + {p} : at + {y}, lane]",
    ]
    return [*given, *call.lines]


_NAMES = {name: getattr(_vector_memory, name) for name in MEMORY} | FUNCTIONS
_NAMES |= {"equation": equation}
