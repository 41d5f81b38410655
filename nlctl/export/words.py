"""Names and numbers of a program in C: labels as comments and as indices."""

import hashlib
import re
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from ..errors import CompileError, ParameterError
from ..native import Compiled
from ..native.describe import described_functions
from ..native.diagram.parameters import Slot

_ENOUGH = 20  # passes that are proposed: Newton's method needs less
_RESERVED = re.compile(
    "auto|break|case|char|const|continue|default|do|double|else|enum|extern|float|for|goto|if|"
    "inline|int|long|register|restrict|return|short|signed|sizeof|static|struct|switch|typedef|"
    "union|unsigned|void|volatile|while"
)


def c_name(name: str | None, label: str) -> str:
    """Return a name, checked to be one in C; without one that of a block or diagram."""
    name = re.sub(r"\W", "_", label, flags=re.ASCII) if name is None else name
    if not re.fullmatch(r"[A-Za-z]\w*", name, re.ASCII) or _RESERVED.fullmatch(name):
        raise ParameterError(f"'{name}' is not a name in C: give name= of letters, digits and '_'")
    return name


def comment(text: str) -> str:
    """Return a text that ends no comment and is ASCII."""
    return text.encode("ascii", "replace").decode().replace("*/", "* /").replace("/*", "/ *")


def enumeration(prefix: str, labels: Iterable[str], *, begins: bool = False) -> str:
    """Return the indices of an array as names; of labels of arrays, where these begin."""
    places = dict(enumerate(labels))
    count = len(places)
    if begins:
        places = {
            i: re.sub(r"(\[0\])+$", "", label)
            for i, label in places.items()
            if not re.search(r"\[\d*[1-9]\d*\]", label)
        }
    names = [f"{prefix}_{re.sub(r'[^A-Za-z0-9]+', '_', v).strip('_')}" for v in places.values()]
    if len(set(names)) < len(names):  # such as a.b and a_b
        names = [f"{name}_{i}" for i, name in zip(places, names, strict=True)]
    lines = [f"  {name} = {i}," for i, name in zip(places, names, strict=True)]
    return "\n".join(["enum {", *lines, f"  {prefix}S = {count}", "};"])


def parameter_places(compiled: Compiled) -> Iterator[tuple[Slot, tuple[int, ...], int]]:
    """Yield every number of the parameter vector: its parameter, its index in it, its place."""
    for slots in compiled.program.layout.values():
        for slot in slots.values():
            for k, index in enumerate(np.ndindex(slot.shape)):
                yield slot, index, slot.offset + k


def parameter_values(compiled: Compiled, p: np.ndarray) -> dict[str, float]:
    """Return every number of the parameter vector by its name."""
    names = {
        place: slot.name + "".join(f"[{i}]" for i in index)
        for slot, index, place in parameter_places(compiled)
    }
    return {names.get(i, f"p[{i}]"): float(value) for i, value in enumerate(p)}


def check_written_out(compiled: Compiled, what: str, p: np.ndarray) -> None:
    """Refuse what is called, or searched, or may take more passes than are written out."""
    equations = compiled.equations_with(p)
    for call in equations.calls.values():
        raise CompileError(
            f"'{what}' cannot be exported: a function of it is called ({call.reason})"
        )
    searched = bool(equations.solvers)
    refuse_if_any(what, {"has an algebraic loop, whose signals are searched for": searched})
    for function in described_functions(compiled.schedule, equations.cut):
        raise CompileError(
            f"'{what}' cannot be exported: a loop in the {function} may take more passes than are "
            "written out, and there is nobody to call the function then: take a fixed number of "
            f"passes, 'for _ in range({_ENOUGH})' without 'break', instead of 'while' or a "
            "search of SciPy, and scipy.integrate.fixed_quad instead of quad; "
            "nlctl.input_output_response runs it as it is"
        )


def check_integers(compiled: Compiled, p: np.ndarray, what: str) -> None:
    """Refuse parameters with which the equations are others than those of the diagram."""
    if not compiled.lowered.holds_for(p[:, None]):
        raise CompileError(
            f"'{what}' cannot be exported: integers among the parameters steer its equations: set "
            "them in the diagram"
        )


def refuse_if_any(what: str, reasons: Mapping[str, bool], purpose: str = "be exported") -> None:
    """Refuse a diagram for the first reason that holds."""
    for reason, holds in reasons.items():
        if holds:
            raise CompileError(f"'{what}' cannot {purpose}: it {reason}")


def digest(text: str, parameters: Mapping[str, float], start: np.ndarray, more: object = ()) -> str:
    """Return a key of a program and its numbers."""
    content = repr((text, list(parameters.items()), start.tolist(), more))
    return hashlib.sha256(content.encode()).hexdigest()[:16]
