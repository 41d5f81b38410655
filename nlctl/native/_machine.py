"""A program's machine code for members side by side, whichever way it can be had."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control as ct
import numpy as np

from ._compile import Compiled
from ._discrete import compile_discrete
from ._lower import Lowered, lower
from ._lower_blocks import Equations, whole
from ._routine import check, entry, lowered_code
from .thirdparty.errors import explained

WIDTH = 8  # members side by side in ensembles: one AVX-512 register


@dataclass(frozen=True, kw_only=True)
class Machine:
    """Functions over `width` members, with the member as the last index of every array.

    Attributes
    ----------
    width : int
    rows : int
        Rows of the parameters that `rhs` and `out` take.
    prepare : callable
        ``prepare(p, c)`` fills these from the program's parameter vectors.
    rhs, out : callable
        ``rhs(t, x, u, c, dx, g)`` and ``out(t, x, u, c, y)``.
    """

    width: int
    rows: int
    prepare: Callable[[np.ndarray, np.ndarray], None]
    rhs: Any
    out: Any

    @property
    def entries(self) -> tuple[Any, Any]:
        """What integrators take of `rhs` and `out`."""
        return entry(self.rhs), entry(self.out)

    def check(self, c: np.ndarray) -> None:
        """Raise what an opaque function has raised, with `c` as the parameters."""
        check((self.rhs, self.out), c)


def machine(compiled: Compiled, p: np.ndarray, width: int = 1) -> Machine:
    """Return machine code that holds for parameter vectors `p` of shape (parameters, members).

    The lowered program computes each expression once.  Where it does not hold, because an integer
    that steers an equation has another value, the blocks' functions are called as they stand.
    """
    known: dict[Any, Any] = compiled.__dict__.setdefault("_machines", {})
    if width not in known:
        known[width] = _made(compiled, width, compiled.equations)
    lowered, made = known[width]
    if lowered.holds_for(p):
        return made
    if ("as it stands", width) not in known:
        found = whole(compiled.schedule, compiled.program)
        known["as it stands", width] = _made(compiled, width, found)
    return known["as it stands", width][1]


def _made(compiled: Compiled, width: int, found: Equations | None) -> tuple[Lowered, Machine]:
    lowered = lower(compiled.schedule, compiled.program, width, found)
    try:
        prepare, rhs, out = lowered_code(lowered)
    except Exception as error:  # numba passes on whatever typing raises
        raise explained(error, compiled.program) from error
    return lowered, Machine(width=width, rows=lowered.size, prepare=prepare, rhs=rhs, out=out)


def compile_ahead(compiled: Compiled, *, ensemble: bool = False) -> None:
    """Make a diagram's machine code now, instead of with its first run; it stays in the cache.

    The integrators, which all diagrams share, are not included.

    Parameters
    ----------
    compiled : Compiled
    ensemble : bool, optional
        Make that of `nlctl.ensemble_response`, instead of that of single runs.

    Raises
    ------
    CompileError
        If a block's function cannot be machine code.
    """
    width = WIDTH if ensemble else 1
    compile_for(compiled, np.repeat(compiled.parameter_vector()[:, None], width, axis=1), width)


def compile_for(compiled: Compiled, p: np.ndarray, width: int) -> None:
    """Make the machine code that runs with parameters `p` need, as `machine` takes them."""
    if ct.isctime(compiled.system):
        machine(compiled, p, width)
    else:
        compile_discrete(compiled)
