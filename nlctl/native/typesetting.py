"""The equations of blocks and diagrams as LaTeX, read from the functions that are run."""

import itertools
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from dataclasses import replace
from pathlib import Path
from types import FrameType
from typing import Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..attributes import described_record
from ..blocks import Block, supplied_of
from ..delays.transport import PAST
from ..diagrams import known_system, overridden
from ..errors import CompileError
from ..expressions.arrays import Tracer, leaf_vector
from ..expressions.graph import Expr, Graph, Untraceable, needed
from ..expressions.latex import Index, LatexWriter, index_text, number_text, symbol, with_index
from ..params import declared_params
from ..sliding.relay import SLIDING
from ..upstream.systems import System
from .diagram.nodes import Node
from .diagram.parameters import Slot, slots_of
from .diagram.schedule import Schedule, Signal, schedule
from .diagram.trace import feedthrough
from .equations.reader import Reader

_OWN = ("<string>", *(str(Path(__file__).parent.parent / p) for p in ("expressions", "native")))
DERIVATIVE, NEXT_VALUE = r"\dot{{{}}}", "{}^{{+}}"  # of the letter of a state
_RATE = ("a", "b")  # of the rate a + b v of an ideal relay's input
WORTH = 12  # parts from which an expression that is used twice gets a letter


@described_record(made_by="typeset")
class BlockEquations:
    """The equations of one block."""

    block: str  # Its name, with the diagrams around it.
    equations: tuple[str, ...]  # LaTeX: derivatives (or next values) of the states, then outputs.
    where: tuple[str, ...]  # LaTeX: what the symbols of these equations stand for.
    # LaTeX: what the inputs are connected to, where it is not a signal of the same name.
    inputs: tuple[str, ...]
    missing: str = ""  # Why there are no equations, where other blocks have some.

    @property
    def latex(self) -> str:
        """All lines in one aligned environment."""
        lines = [*self.inputs, *self.equations, *self.where] or [r"\text{no formula}"]
        body = " \\\\\n".join(line.replace(" = ", " &= ", 1) for line in lines)
        return f"\\begin{{aligned}}\n{body}\n\\end{{aligned}}"

    def _repr_latex_(self) -> str:
        return f"$${self.latex}$$"


@as_annotated
def typeset(
    system: System, *, values: bool = False, params: Mapping[str, Any] | None = None
) -> tuple[BlockEquations, ...]:
    """Return the equations of a block or diagram as LaTeX, block by block.

    They are read from the functions that are run, so that another sign or parameter is another
    formula; symbols are the names of signals, parameters and of the functions' local variables.

    Parameters
    ----------
    system : control.InputOutputSystem
        Whose equations are written.
    values : bool, optional
        Write the values of parameters in the places of their names.
    params : mapping, optional
        Parameters that are overridden.

    Returns
    -------
    tuple of BlockEquations
        Those of each block, in the order of the diagram.

    Raises
    ------
    CompileError
        If no block has formulas: its functions are not made of expressions, as for `nlctl.compile`.

    Examples
    --------
    >>> (law,) = nlctl.typeset(nlctl.block(nlctl.controllers.FixedGainLaw(), "law"))
    >>> print(law.equations[0])
    u = -\\kappa \\left(\\beta r + W_{\\psi} + \\mathrm{robust} + Y_{d}\\right)
    """
    system = known_system("typeset", system)
    system = ct.ss(system) if isinstance(system, ct.TransferFunction) else system
    read = schedule(overridden(system, params), solve_loops=True)
    blocks = tuple(_written(read, node, values) for node in read.nodes)
    if blocks and all(block.missing for block in blocks):
        raise CompileError(f"block '{blocks[0].block}' has no formula: {blocks[0].missing}")
    return blocks


def _written(read: Schedule, node: Node, values: bool) -> BlockEquations:
    try:
        return _block(read, node, values)
    except RecursionError:
        return _without(read, node, "its expressions are nested too deeply")
    except Untraceable as error:
        return _without(read, node, str(error))


def _without(read: Schedule, node: Node, missing: str) -> BlockEquations:
    """Return that a block has no equations, and why."""
    return BlockEquations(
        block=node.path, equations=(), where=(), inputs=tuple(_connections(read, node)),
        missing=missing,
    )  # fmt: skip


def _block(read: Schedule, node: Node, values: bool) -> BlockEquations:
    system = node.system
    every = {} if values else slots_of(system, node.path)
    written = "f" if isinstance(system, Block) else "fi"  # ours that are integers steer
    slots = {name: slot for name, slot in every.items() if slot.kind in written}
    if supplied_of(system) is PAST:
        return _delayed(read, node, slots)
    inputs = tuple({Signal(None, j): 1.0} for j in range(len(node.inputs)))
    alone = replace(node, state_offset=0, inputs=inputs, sampled=None, direct=feedthrough(system))
    reader = Reader(graph=Graph(), layout={0: slots}, blocks=[alone])

    def traced() -> tuple[dict[str, Any], dict[Expr, str]]:
        with np.errstate(all="ignore"), _local_names() as names:
            found = {"x": reader.derivatives(0), "y": _outputs(reader, system)}
            if node.sampled and node.sampled.euler:
                found["x"] = _euler(reader, node.sampled, slots, values)
        return found, names

    found, names = _beside_a_profiler(traced)
    for call in reader.calls.values():
        return _without(read, node, call.reason)
    leaf = _symbols(system, slots)
    writer = LatexWriter(leaf=leaf, known=_known(system, found, names, leaf))
    next_value = bool(node.sampled and node.sampled.euler) or not ct.isctime(system)
    form = NEXT_VALUE if next_value else DERIVATIVE
    lines = [
        *_lines(writer, found["x"], [changing(s, form) for s in _names(system.state_labels)]),
        *_lines(writer, found["y"], _names(system.output_labels[: found["y"].size])),
    ]
    return BlockEquations(
        block=node.path,
        equations=tuple(line for line in lines if not _says_nothing(line)),
        where=tuple(_definitions(writer)),
        inputs=tuple(_connections(read, node)),
    )


def _delayed(read: Schedule, node: Node, slots: Mapping[str, Slot]) -> BlockEquations:
    """Return the equations of a transport delay, which are of the past."""
    system: Any = node.system
    spec = system.current_spec
    signals = {*_names(system.output_labels), *_names(system.input_labels)}
    tau = r"\mathrm{delay}" if symbol("tau") in signals else symbol("tau")
    tau = tau if "delay" in slots else number_text(spec.delay)
    earlier = f"t - {tau}" + (r" - \mathrm{varying}\left(t\right)" if spec.varying else "")
    pairs = zip(_names(system.output_labels), _names(system.input_labels), strict=True)
    return BlockEquations(
        block=node.path,
        equations=tuple(rf"{y}\left(t\right) = {u}\left({earlier}\right)" for y, u in pairs),
        where=(),
        inputs=tuple(_connections(read, node)),
    )


def _outputs(reader: Reader, system: System) -> Tracer:
    """Return the outputs; of an ideal relay with letters for a and b of its input's rate."""
    if supplied_of(system) is SLIDING:
        return reader.relay_output(0, leaf_vector(reader.graph, "u", 0, (1 + len(_RATE),)))
    return reader.outputs(0, ())


def _euler(reader: Reader, sampled: Any, slots: dict[str, Slot], values: bool) -> Tracer:
    """Return the next states x + T_s f of a block in continuous time; T_s joins its slots."""
    step: Any = sampled.sampling.current_spec.dt
    if not values:
        offset = max((slot.offset + slot.size for slot in slots.values()), default=0)
        slots["T_s"] = Slot(name="T_s", offset=offset, shape=(), kind="f")
        step = leaf_vector(reader.graph, "p", offset, ())
    rates = reader.derivatives(0)
    return leaf_vector(reader.graph, "x", 0, (rates.size,)) + step * rates


def changing(name: str, form: str) -> str:
    """Return the symbol of a derivative or next value: the mark is its letter's."""
    head, mark, index = name.partition("_")
    return form.format(head) + mark + index


def _says_nothing(line: str) -> bool:
    left, _, right = line.partition(" = ")
    return left == right


def _names(labels: list[str]) -> list[str]:
    return [symbol(label) for label in labels]


def _lines(writer: LatexWriter, array: Tracer, names: list[str]) -> Iterator[str]:
    """Yield an equation per number, and one per vector."""
    at = 0
    for expr, size in (part for whole in array.pieces() for part in _pieces(*whole)):
        if size == 1 or not expr.size:
            for k in range(at, at + size):
                yield f"{names[k]} = {writer.formula(expr, by_name=False)}"
        else:
            vector, first = _vector(names, at)
            right = writer.formula(expr, (1 - first, 1, "i"), by_name=False)
            yield rf"{vector('i')} = {right}, \quad i = {first}, \dots, {first + size - 1}"
        at += size


def _pieces(expr: Expr, size: int) -> Iterator[tuple[Expr, int]]:
    if expr.op != "concat":
        yield expr, size
        return
    for piece, length in zip(expr.args, expr.data, strict=True):
        yield from _pieces(piece, length)


def _vector(names: list[str], at: int) -> tuple[Callable[[str], str], int]:
    """Return what names the elements of a vector by an index, and the number of the first one."""
    found = re.fullmatch(r"(.*)_\{((?:.*,)?)(\d+)\}", names[at])
    if not found:
        return (lambda index: with_index(names[at], index)), 1
    return (lambda index: f"{found[1]}_{{{found[2]}{index}}}"), int(found[3])


def _symbols(system: System, slots: Mapping[str, Slot]) -> Callable[[str, Index], str]:
    """Return what names a place in one of the arrays that a block reads."""
    inputs = [*system.input_labels, *(_RATE if supplied_of(system) is SLIDING else ())]
    labels = {"x": _names(system.state_labels), "u": _names(inputs)}
    declared = declared_params(system.spec) if isinstance(system, Block) else {}

    def leaf(array: str, index: Index) -> str:
        start, step, letter = index
        if array == "t":
            return "t"
        if array in labels:
            if not step:
                return labels[array][start]
            vector, first = _vector(labels[array], start)
            return vector(index_text((first - 1, step, letter)))
        for name, slot in slots.items():
            if 0 <= start - slot.offset < slot.size:
                own = declared[name].symbol if name in declared else name
                return _entry(symbol(own or name), slot, (start - slot.offset, step, letter))
        raise CompileError(f"block '{system.name}' has no parameter at {start}")

    return leaf


def _entry(name: str, slot: Slot, index: Index) -> str:
    """Return a parameter, or an element of an array of them."""
    if not slot.shape:
        return name
    if len(slot.shape) == 1:
        return with_index(name, index_text(index))
    (start, step, letter), width = index, slot.shape[1]
    (row, column), along = divmod(start, width), step % width == 0
    first = index_text((row, step // width if along else 0, letter))
    second = index_text((column, 0 if along else step, letter))
    return with_index(name, f"{first},{second}")


def _beside_a_profiler(function: Callable[[], Any]) -> Any:
    """Return what a function returns that sets a profiler of its own, as `_local_names` does."""
    # Where one is at work, such as cProfile's, which Python cannot set again, in another thread.
    if sys.getprofile() is None:
        return function()
    with ThreadPoolExecutor(1) as thread:
        return thread.submit(copy_context().run, function).result()


@contextmanager
def _local_names() -> Iterator[dict[Expr, str]]:
    """Note how functions that are traced meanwhile call what they compute."""
    found: dict[Expr, str] = {}

    def noted(frame: FrameType, event: str, _: object) -> None:
        if event != "return" or frame.f_code.co_filename.startswith(_OWN):
            return  # (also what dataclasses write: "<string>")
        for name, value in frame.f_locals.items():
            scalar = isinstance(value, Tracer) and value.values.size == 1 and value.origin is None
            if scalar and name != "_":  # which names what is not used under it
                found.setdefault(value.only, name)

    sys.setprofile(noted)
    try:
        yield found
    finally:
        sys.setprofile(None)


def _known(
    system: System,
    found: Mapping[str, Tracer],
    names: Mapping[Expr, str],
    leaf: Callable[[str, Index], str],
) -> dict[Expr, str]:
    """Return names for parts of the equations: the author's, and letters for what is used twice."""
    exprs = needed(expr for array in found.values() for expr, _ in array.pieces())
    plain = ("leaf", "const", "table", "concat", "item", "slice", "lu", "lu_regular")
    taken = {leaf(e.data[0], (e.data[1], 0, "")) for e in exprs if e.op == "leaf" and not e.size}
    signals = _signals(system, found["y"])
    known: dict[Expr, str] = {}
    for expr in exprs:
        name = symbol(names[expr]) if expr in names else ""
        is_free = name not in taken and signals.get(name, expr) is expr
        if name and is_free and expr.op not in plain and expr.kind != "b":
            known[expr] = name
            taken.add(name)
    uses: dict[Expr, int] = {}
    for expr in exprs:
        for arg in expr.args:
            uses[arg] = uses.get(arg, 0) + 1
    for expr in exprs:
        heavy = uses.get(expr, 0) > 1 and len(needed([expr], known)) > WORTH
        if heavy and expr not in known and expr.op not in plain and expr.kind != "b":
            known[expr] = next(s for k in itertools.count(1) if (s := f"s_{{{k}}}") not in taken)
            taken.add(known[expr])
    return known


def _signals(system: System, y: Tracer) -> dict[str, Expr | None]:
    """Return what the names of signals stand for, also where a function means something else."""
    signals: dict[str, Expr | None] = dict.fromkeys(
        _names([*system.state_labels, *system.input_labels, *system.output_labels])
    )
    at = 0
    for expr, size in y.pieces():
        if size == 1:
            signals[symbol(system.output_labels[at])] = expr
        at += size
    return signals


def _definitions(writer: LatexWriter) -> Iterator[str]:
    """Yield what the symbols stand for, until no new one turns up."""
    done: set[Expr] = set()
    while set(writer.used) - done:
        expr = max(set(writer.used) - done, key=lambda e: e.index)
        done.add(expr)
        name = writer.used[expr]
        if expr.size:
            right = writer.formula(expr, (0, 1, "i"), by_name=False)
            yield rf"{with_index(name, 'i')} = {right}, \quad i = 1, \dots, {expr.size}"
        else:
            yield f"{name} = {writer.formula(expr, by_name=False)}"
    for table, name in writer.tables.items():
        texts = [number_text(v) for v in table.data]
        shown = texts if len(texts) <= 6 else [*texts[:3], r"\dots", texts[-1]]
        yield rf"{name} = \left({', '.join(shown)}\right)"


def _connections(read: Schedule, node: Node) -> Iterator[str]:
    """Yield what an input is connected to, where that is not just a signal of its name."""
    for label, combination in zip(node.system.input_labels, node.inputs, strict=True):
        terms = []
        for signal, gain in combination.items():
            owner = read.system if signal.block is None else read.nodes[signal.block].system
            labels = owner.input_labels if signal.block is None else owner.output_labels
            terms.append((labels[signal.index], float(gain)))
        if terms == [(label, 1.0)]:
            continue
        yield f"{symbol(label)} = {_combination(terms)}"


def _combination(terms: list[tuple[str, float]]) -> str:
    texts = []
    for label, gain in terms:
        factor = "" if abs(gain) == 1.0 else rf"{number_text(abs(gain))} "
        texts.append(("- " if gain < 0 else "+ ") + factor + symbol(label))
    joined = " ".join(texts) or "0"
    return joined.removeprefix("+ ").replace("- ", "-", 1) if joined[:1] in "+-" else joined
