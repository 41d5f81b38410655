"""Machine code made before it is needed."""

import control as ct
import numpy as np

from ..annotations import as_annotated
from .along import derivatives
from .compiled import Compiled
from .discrete import discrete_loop
from .machine.evaluations import ENSEMBLE_WIDTH, machine
from .taylor.turns import series_ahead


@as_annotated
def compile_ahead(compiled: Compiled, *, ensemble: bool = False) -> None:
    """Make a diagram's machine code now, instead of with its first run; it stays in the cache.

    The integrators, which all diagrams share, are not included.

    Parameters
    ----------
    compiled : Compiled
        What `nlctl.compile` returns.
    ensemble : bool, optional
        Make that of `nlctl.ensemble_response`, instead of that of single runs.

    Raises
    ------
    CompileError
        If a block's function cannot be machine code.
    """
    width = ENSEMBLE_WIDTH if ensemble else 1
    compile_for(compiled, np.repeat(compiled.parameter_vector()[:, None], width, axis=1), width)


def compile_for(compiled: Compiled, p: np.ndarray, width: int) -> None:
    """Make the machine code that runs with parameters `p` need, as `machine` takes them."""
    if ct.isctime(compiled.system):
        machine(compiled, np.repeat(p[:, :1], width, axis=1), width)
        if width == 1:
            derivatives(compiled, p[:, 0])
            series_ahead(compiled, p[:, :1])
    else:
        machine(compiled, p[:, :1], 1)
        discrete_loop()
