"""The native engine: any python-control diagram as machine code.

`compile` reads a diagram (`_schedule`), writes the source of its right-hand side (`_emit`), turns
that into machine code and keeps it on disk (`_compile`, `_cache`); `_integrate` and `_response`
simulate it.
"""

from ._code import CompileError
from ._compile import Compiled, compile  # noqa: A004 (what it does)
from ._ensemble import Ensemble, ensemble_response
from ._lane import Status
from ._response import Response
from ._schedule import AlgebraicLoopError
from ._simulate import Settings, Statistics

__all__ = [
    "AlgebraicLoopError",
    "CompileError",
    "Compiled",
    "Ensemble",
    "Response",
    "Settings",
    "Statistics",
    "Status",
    "compile",
    "ensemble_response",
]
