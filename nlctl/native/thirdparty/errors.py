"""Why numba refuses a diagram: the block, the line, the reason, and what to write instead."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from types import CodeType
from typing import Any

from numba.core.compiler import run_frontend

from ..._errors import CompileError
from .._emit import Program

PLACES = (r'File "([^"]+)", line (\d+)', r"(?:at|from) (\S+) \((\d+)\)")
HEADINGS = ("(step: ", "During:", "File ", "Return of", "Raised from")
HINTS = {  # what the message has in it -> what to do
    r"exception_match|\btry\b|Raise|except": "write an if instead of try ... except",
    r"\bParams\(|'Params'": "declare it in the block's params, or compile with params={...}",
    r"scipy": "numba does not know SciPy: write the formula out, or use numpy or math",
    r"numpy\.matrix": "use np.array and @ instead of np.matrix",
    r"[Uu]nify": "give a variable, and every return, one type: 1.0 and not 1, always an array",
    r"f-string|format|unicode|[Ss]tring": "leave text out of equations",
    r"with \(context|context manager": "leave files and other contexts out of equations",
    r"Untyped global|freevar|Cannot determine Numba type": "use numbers and arrays, as params or "
    "constants, instead of objects",
    r"NameError": "define the name, or pass it in params",
    r"dict|set\(": "use params, tuples and arrays instead of dicts and sets",
}
DEFAULT_HINT = "write it with arithmetic, numpy or math functions, tuples and arrays"


def explained(error: Exception, program: Program) -> CompileError:
    """Make the error that names the block and the line.

    Parameters
    ----------
    error : Exception
        What numba has raised.
    program : Program
    """
    text = str(error)
    culprit, line = _culprit(text, program.functions)
    reason = _reason(text)
    hint = next((h for mark, h in HINTS.items() if re.search(mark, reason)), DEFAULT_HINT)
    if culprit is None:
        where = "the program of this diagram"
    else:
        code = _code(program.functions[culprit])
        where = f"block '{program.owners[culprit]}' (file {code.co_filename}, line {line})"
    return CompileError(
        f"numba cannot compile {where}: {reason}; {hint}; the diagram still runs in python-control"
    )


def _code(function: Any) -> CodeType:
    return getattr(function, "py_func", function).__code__


def _culprit(text: str, functions: Mapping[str, Any]) -> tuple[str | None, int]:
    """Return the name of the function that numba complains about, and the line."""
    places = [(file, int(line)) for mark in PLACES for file, line in re.findall(mark, text)]
    for name, function in functions.items():
        code = _code(function)
        first, last = code.co_firstlineno, max(_lines(code))
        file = code.co_filename.replace("\\", "/").rpartition("/")[2]
        inside = [n for f, n in places if f.endswith(file) and first <= n <= last]
        if inside:
            return name, inside[0]
    called = [name for name in functions if f"{name}(" in text]  # a function of another file
    called = called or [name for name, f in functions.items() if not _readable(f)]
    called = called or (list(functions) if len(functions) == 1 else [])
    return (called[0], _code(functions[called[0]]).co_firstlineno) if called else (None, 0)


def _lines(code: CodeType) -> Iterator[int]:
    """Yield the lines of a function and of those inside it."""
    yield from (line for _, _, line in code.co_lines() if line is not None)
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _lines(constant)


def _readable(function: Any) -> bool:
    """Whether numba understands the statements of a function, types aside."""
    try:
        run_frontend(getattr(function, "py_func", function))
    except Exception:  # numba passes on whatever reading raises
        return False
    return True


def _reason(text: str) -> str:
    """Return numba's reason in one line: the innermost one, where refusals are nested."""
    text = text.rpartition("Failed in nopython mode pipeline")[2]
    lines = [line.strip() for line in text.splitlines()]
    lines = [line for line in lines if line and not line.startswith(HEADINGS)] or ["unknown reason"]
    reason = lines[0].partition(" Raised from ")[0].rstrip(".")
    missing = re.search(r">>> (?:getitem|static_getitem)\(Params\(.*Literal\[str\]\((\w+)\)", text)
    if missing:
        return f"params['{missing[1]}'] is read, and no such parameter is known ('Params')"
    if reason.startswith("No implementation"):
        call = next((line[4:] for line in lines if line.startswith(">>> ")), "")
        why = re.search(r"(?:Unsupported|Typing)\w*Error: (.*)", text)
        reason = f"no implementation of {call}" + (f" ({why[1]})" if why else "")
    return reason
