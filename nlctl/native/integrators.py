"""The integrators as machine code, from the bitcode that is shipped next to their sources."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numba

from ..host.checkout import file_of_nlctl
from ..upstream.numba_internals import is_jit_disabled
from .integrate import advance, evaluate, start
from .integrate.workspace import TASK, WORK
from .machine.address import data_address
from .machine.export import AS_SHIPPED
from .machine.machine_code import Wanted
from .machine.shipped import Shipped

_ADDRESS = numba.intp
INTEGRATORS = Shipped(
    path=file_of_nlctl("native/integrators.bitcode"),
    wanted=tuple(
        Wanted(
            function=function,
            signature=numba.void(*arguments),
            options=AS_SHIPPED,
        )
        for function, *arguments in (
            (start.start, _ADDRESS, TASK, WORK),
            (advance.advance, _ADDRESS, _ADDRESS, _ADDRESS, TASK, WORK, numba.intp),
            (evaluate.outputs, _ADDRESS, _ADDRESS, TASK, WORK),
        )
    ),
    whole=tuple(f"native/integrate/{name}.py" for name in ("advance", "start", "workspace")),
)


def integrators() -> dict[str, Callable[..., Any]]:
    """Return `start`, `advance` and `outputs`, ready to be called."""
    return INTEGRATORS.functions


def handle(record: Any) -> Any:
    """Return what the integrators take for a record, for many calls: it must outlive them."""
    return record if is_jit_disabled() else data_address(record.table)
