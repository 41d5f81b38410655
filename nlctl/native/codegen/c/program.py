"""Functions of a program as C99: numbers, then loops with their sums, level by level."""

import re
from collections.abc import Mapping

from ....expressions.graph import Expr
from ..ir.loops import elements_per_turn
from ..ir.numbers import Writer, one_line
from ..plan import Function, LoopOfLevel
from .body import CBody, CModule


def function_text(module: CModule, name: str, function: Function, labels: Mapping[str, str]) -> str:
    """Return the text of a function of arrays; `labels` say what entries such as "x[3]" are."""
    b = CBody(module, labels)
    if function.copied:
        source, target = function.arguments[:2]
        b.write(f"memcpy({target}, {source}, {function.copied} * sizeof(double));")
    writer = Writer(b, function.plan, 1, frozenset())
    for level in function.plan.levels:
        writer.numbers(level.numbers)
        for loop in level.loops:
            _loop(writer, b, loop)
    inside = b.text()
    written = {store.array for store in function.plan.stores}
    used = {name for name in function.arguments if re.search(rf"\b{name}\[", inside)}
    if function.copied:
        used.update(function.arguments[:2])
        written.add(function.arguments[1])
    given = ", ".join(
        f"{'' if argument in written else 'const '}double *{argument}"
        for argument in function.arguments
    )
    unused = "".join(f"  (void){name};\n" for name in function.arguments if name not in used)
    return f"static void {name}({given})\n{{\n{unused}{inside}}}\n"


def _loop(w: Writer, b: CBody, loop: LoopOfLevel) -> None:
    """Write a loop; its sums are of the parts, and added up, as machine code does it."""
    step = elements_per_turn(loop.size)
    whole = loop.size // step * step
    sums = [node for node in loop.nodes if node.op == "sum"]
    b.note("")
    for node in sums:
        b.write(f"double sum{node.index}[{step}] = {{0.0}};")
    b.write(f"for (int k = 0; k < {loop.size}; ++k) {{")
    outer, pairs = w.names, w.pairs
    w.names, w.pairs, b.indent = dict(outer), {}, b.indent + "  "
    part = (
        f"k % {step}"
        if whole == loop.size
        else (f"k < {whole} ? k % {step} : k - {loop.size - step}")
    )
    for node in loop.nodes:
        _reads(w, b, node.args)
        if node.op == "sum":
            b.note("")
            b.write(f"sum{node.index}[{part}] += {w.names[node.args[0]].text};")
        else:
            b.note(one_line(node))
            w.names[node] = w.operation(node)
    for store in loop.stores:
        _reads(w, b, (store.expr,))
        b.note("")
        b.store(w.names[store.expr], b.address(store.array, store.row, "k"))
    w.names, w.pairs, b.indent = outer, pairs, b.indent[:-2]
    b.note("")
    b.write("}")
    for node in sums:
        parts = [f"sum{node.index}[{i}]" for i in range(step)]
        while len(parts) > 1:
            half = len(parts) // 2
            parts = [f"({a} + {c})" for a, c in zip(parts[:half], parts[half:], strict=True)]
        b.note(f"e{node.index} = sum")
        w.names[node] = b.new(parts[0])
        w.stored(node)


def _reads(w: Writer, b: CBody, args: tuple[Expr, ...]) -> None:
    """Read the elements of vectors that lie in memory."""
    for arg in args:
        if arg.size and arg not in w.names:
            if arg.op == "table" and arg not in w.plan.stored:
                w.names[arg] = b.load(f"{b.module.table(arg.data)}[k]", 0)
                continue
            array, row, step = w.plan.elements(arg)
            w.names[arg] = b.load(b.address(array, row, "k", step), 0)
