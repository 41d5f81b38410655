"""A program's machine code for members side by side, whichever way it can be had."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from .._errors import CompileError
from ._lower import Lowered, lower
from ._lower_blocks import Equations, whole
from ._routine import check, entry, lowered_code
from .thirdparty.errors import explained

if TYPE_CHECKING:
    from ._compile import Compiled

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
    except CompileError:
        raise
    except Exception as error:  # numba passes on whatever typing raises
        raise explained(error, compiled.program) from error
    return lowered, Machine(width=width, rows=lowered.size, prepare=prepare, rhs=rhs, out=out)


def evaluations(compiled: Compiled) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return ``rhs(t, x, u, p, dx, g)`` and ``out(t, x, u, p, y)`` of numbers and flat vectors."""
    machine(compiled, compiled.parameter_vector()[:, None])

    def rhs(t: float, x: Any, u: Any, p: np.ndarray, dx: np.ndarray, g: np.ndarray) -> None:
        code, c = prepared_parameters(compiled, p)
        code.rhs(np.array([t]), _column(x), _column(u), c, dx[:, None], g[:, None])

    def out(t: float, x: Any, u: Any, p: np.ndarray, y: np.ndarray) -> None:
        code, c = prepared_parameters(compiled, p)
        code.out(np.array([t]), _column(x), _column(u), c, y[:, None])

    return rhs, out


def prepared_parameters(
    compiled: Compiled, p: np.ndarray, width: int = 1
) -> tuple[Machine, np.ndarray]:
    """Return machine code for a parameter vector, and what its functions take of that."""
    each = np.repeat(p[:, None], width, axis=1)
    code = machine(compiled, each, width)
    c = np.zeros((code.rows, width))
    code.prepare(each, c)
    return code, c


def _column(values: Any) -> np.ndarray:
    return np.ascontiguousarray(values, dtype=float).reshape(-1, 1)
