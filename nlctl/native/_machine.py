"""A program's machine code for members side by side, whichever way it can be had."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import control as ct
import numba
import numpy as np
from numba.core import config

from ._compile import Compiled
from ._discrete import compile_discrete
from ._lower import lower, lowered_code
from ._parameters import length
from ._work import OUT, RHS
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


def machine(compiled: Compiled, p: np.ndarray, width: int = 1) -> Machine:
    """Return machine code that holds for parameter vectors `p` of shape (parameters, members).

    The lowered program computes each expression once.  Where it does not hold, because a whole
    number that steers an equation has another value, the program itself is taken, one by one.
    """
    known: dict[Any, Any] = compiled.__dict__.setdefault("_machines", {})
    if width not in known:
        lowered = lower(compiled.schedule, compiled.program, width, compiled.equations)
        try:
            prepare, rhs, out = lowered_code(lowered)
        except Exception as error:  # numba passes on whatever typing raises
            raise explained(error, compiled.program) from error
        known[width] = (
            lowered,
            Machine(width=width, rows=lowered.size, prepare=prepare, rhs=rhs, out=out),
        )
    lowered, made = known[width]
    if lowered.holds_for(p):
        return made
    if "plain" not in known:
        known["plain"] = _plain(compiled)
    return known["plain"]


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


def _plain(compiled: Compiled) -> Machine:
    """The program as it stands, for one member."""
    one_rhs, one_out = compiled.native

    def rhs(t, x, u, p, dx, g):
        one_rhs(t[0], x.reshape(-1), u.reshape(-1), p.reshape(-1), dx.reshape(-1), g.reshape(-1))

    def out(t, x, u, p, y):
        one_out(t[0], x.reshape(-1), u.reshape(-1), p.reshape(-1), y.reshape(-1))

    if not getattr(config, "DISABLE_JIT", False):
        rhs = numba.njit(RHS.signature, error_model="numpy", nogil=True)(rhs)
        out = numba.njit(OUT.signature, error_model="numpy", nogil=True)(out)
    rows = length(compiled.program.layout)
    return Machine(width=1, rows=rows, prepare=_copied, rhs=rhs, out=out)


def _copied(p: np.ndarray, c: np.ndarray) -> None:
    c[:] = p
