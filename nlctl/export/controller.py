"""A sampled controller as the program of its computer, and all equations of a loop as code."""

from collections.abc import Mapping
from typing import Any

import control as ct

from .. import native
from ..annotations import as_annotated
from ..arguments import number
from ..diagrams import initial_state as state_of
from ..diagrams import leaves, parameter_names
from ..errors import CompileError, ParameterError
from ..names import unknown
from ..native.floats import with_every_float
from ..native.lower import Lowered
from ..sampling.system import Sampled, sampled
from . import words
from .source import ExportedController, ExportedEquations
from .words import c_name, check_written_out, digest, parameter_values


@as_annotated
def export_controller(
    diagram: ct.InterconnectedSystem,
    block: str,
    *,
    dt: float | None = None,
    method: str | None = None,
    params: Mapping[str, Any] | None = None,
    initial_state: Mapping[str, float] | None = None,
    name: str | None = None,
) -> ExportedController:
    """Read a controller of a loop as the program of a computer, to be written as C or object code.

    The program is the one that `nlctl.input_output_response` runs at every sample: operation by
    operation in the same order, each rounded alike on every processor with IEEE 754 doubles.  Only
    functions of the C library that nlctl does not write out (log, pow, atan and others; sin and
    cos of angles beyond 1e6) are as good as the library of the target.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        The loop.
    block : str
        Name of its sampled block, or of a diagram in it whose blocks are all sampled together.
    dt : float, optional
        Sampling time (s) of one that is not sampled, which `nlctl.sampled` samples then.
    method : str, optional
        How one in continuous time becomes one in discrete time, as in `nlctl.sampled`.
    params : mapping, optional
        Parameters by qualified names, on top of those of the loop; ``reset`` takes them in C.
    initial_state : mapping of str to float, optional
        Initial states by name; by default those that blocks declare.
    name : str, optional
        In front of all names in C; by default that of the block.

    Returns
    -------
    ExportedController
        For `c_files` and `object_code`.

    Raises
    ------
    UnknownNameError
        If there is no such block, or no such parameter in it.
    ParameterError
        If it is not sampled and `dt` is not given, or a name is none in C.
    CompileError
        If a target cannot hold it: functions that are called, loops without a fixed number of
        passes, a search for signals of an algebraic loop, several clocks, a delay
        or jitter of its clock.

    Examples
    --------
    >>> loop = nlctl.paper.example_1()
    >>> controller = export_controller(loop, "controller", dt=0.01, method="euler")
    >>> controller.inputs
    ('x1', 'x2', 'yd', 'yd1', 'yd2')
    """
    part = _sampled_part(_block_of(diagram, block), dt, method)
    inputs, outputs = list(part.input_labels), list(part.output_labels)
    alone = ct.interconnect(
        [part], name=part.name, inputs=inputs, outputs=outputs,
        inplist=[f"{part.name}.{u}" for u in inputs],
        outlist=[f"{part.name}.{y}" for y in outputs],
    )  # fmt: skip
    compiled = with_every_float(native.compile(alone))
    clock = _clock_of(compiled, block)
    p = compiled.parameter_vector(_parameters_of(part, block, diagram, params or {}))
    check_written_out(compiled, block, p)
    lowered = compiled.lowered
    if not lowered.holds_for(p[:, None]):
        raise ParameterError(
            f"'{block}': integers among the parameters steer its equations: set them in the diagram"
        )
    values, start = parameter_values(compiled, p), state_of(alone, initial_state)
    return ExportedController(
        name=c_name(name, block), dt=clock.dt,
        offset=clock.offset, inputs=tuple(part.input_labels), outputs=tuple(part.output_labels),
        states=tuple(part.state_labels or ()), parameters=values, initial_state=start,
        takes_time=_reads_time(lowered), lowered=lowered,
        sampled_states=compiled.program.sampled,
        digest=digest(lowered.text, values, start, (clock.dt, clock.offset)),
    )  # fmt: skip


def _block_of(diagram: ct.InterconnectedSystem, path: str) -> Any:
    """Return the block or inner diagram of a dotted name."""
    inner = diagram
    for i, part in enumerate(path.split(".")):
        inside = {s.name: s for s in getattr(inner, "syslist", ())}
        if part not in inside:
            where = f"of '{inner.name}'" if i else "of the loop"
            raise unknown("block", part, inside, where)
        inner = inside[part]
    return inner


def _sampled_part(part: ct.NonlinearIOSystem, dt: float | None, method: str | None) -> Any:
    """Return a block whose leaves are all sampled."""
    is_sampled = {
        leaf.path or leaf.system.name: isinstance(leaf.system, Sampled) for leaf in leaves(part)
    }
    if all(is_sampled.values()):
        if dt is not None or method is not None:
            raise ParameterError(f"'{part.name}' is sampled already: leave out dt and method")
        return part
    if any(is_sampled.values()):
        name = next(name for name, yes in is_sampled.items() if not yes)
        raise ParameterError(f"block '{name}' of '{part.name}' is not sampled: sample all of it")
    if dt is None:
        raise ParameterError(
            f"'{part.name}' is not sampled: give dt in s (and method='euler' of one in continuous "
            "time), or put nlctl.sampled(...) of it into the loop"
        )
    return sampled(part, number("export_controller", "dt", dt, above=0), method=method)


def _clock_of(compiled: native.Compiled, block: str) -> Any:
    """Return the one clock of a controller; delay and jitter are the computer's."""
    clocks = list(compiled.program.clocks.values())
    if len(clocks) != 1:
        raise CompileError(
            f"'{block}' cannot be exported: its blocks have {len(clocks)} clocks; export those of "
            "each clock"
        )
    for what in ("delay", "jitter"):
        value = getattr(clocks[0], what)
        if value:
            raise CompileError(
                f"'{block}' cannot be exported with a {what} of {value:g} s, which is the "
                "computer's and not the program's: set it to 0"
            )
    return clocks[0]


def _parameters_of(
    part: ct.NonlinearIOSystem,
    block: str,
    diagram: ct.InterconnectedSystem,
    params: Mapping[str, Any],
) -> dict[str, Any]:
    """Return the parameters of a loop and those given, as far as they are the block's."""
    inside = f"{part.name}."
    for key in params:
        if not str(key).startswith(inside):
            raise unknown("parameter", key, parameter_names(part), f"of '{block}'")
    both = {**dict(diagram.params), **params}
    return {key: value for key, value in both.items() if str(key).startswith(inside)}


def _reads_time(lowered: Lowered) -> bool:
    """Whether what a sample computes depends on the time."""
    return any(
        node.op == "leaf" and node.data[0] == "t"
        for name in ("sample0", "out")
        for node in lowered.functions[name].plan.nodes
    )


@as_annotated
def export_equations(
    diagram: ct.InterconnectedSystem,
    *,
    params: Mapping[str, Any] | None = None,
    initial_state: Mapping[str, float] | None = None,
    name: str | None = None,
) -> ExportedEquations:
    """Read a diagram in continuous time as functions in C: rates, outputs, switching functions.

    Parameters
    ----------
    diagram : control.InterconnectedSystem
        In continuous time.
    params : mapping, optional
        Parameters by qualified names, on top of those of the diagram.
    initial_state : mapping of str to float, optional
        Initial states by name; by default those that blocks declare.
    name : str, optional
        In front of all names in C; by default that of the diagram.

    Returns
    -------
    ExportedEquations
        For `c_files`.

    Raises
    ------
    ParameterError
        If the name is none in C.
    CompileError
        If functions in C cannot say it: sampled blocks, resets, transport delays, functions that
        are called, loops without a fixed number of passes, a search for signals of an algebraic
        loop, discrete time, other integers in `params` that steer equations.

    Examples
    --------
    >>> equations = export_equations(nlctl.paper.example_1(), name="example_1")
    >>> equations.states[:2]
    ('plant_x1', 'plant_x2')
    """
    compiled = with_every_float(native.compile(diagram))
    what = str(diagram.name)
    _check_continuous(compiled, what)
    p = compiled.parameter_vector(params)
    words.check_written_out(compiled, what, p)
    words.check_integers(compiled, p, what)
    values, start = words.parameter_values(compiled, p), state_of(diagram, initial_state)
    labels, lowered = tuple(compiled.state_labels or ()), compiled.lowered
    return ExportedEquations(
        name=words.c_name(name, what), inputs=tuple(diagram.input_labels or ()),
        outputs=tuple(diagram.output_labels or ()), states=labels,
        memory=tuple(labels[i] for i in compiled.program.memory), conditions=lowered.rows["g"],
        parameters=values, initial_state=start, lowered=lowered,
        digest=words.digest(lowered.text, values, start),
    )  # fmt: skip


def _check_continuous(compiled: native.Compiled, what: str) -> None:
    """Refuse what three functions cannot say."""
    words.refuse_if_any(what, {
        "is in discrete time": not ct.isctime(compiled),
        "has sampled blocks: export each with its block": bool(compiled.program.clocks),
        "has resets": bool(compiled.program.guards),
        "has transport delays": bool(compiled.schedule.lines),
    })  # fmt: skip
