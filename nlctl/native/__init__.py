"""The native engine: any python-control diagram as machine code, and ensembles of it.

`compile` reads a diagram (`_schedule`, `_wiring`, `_feedthrough`).  The blocks' functions are run
once on symbols (`_lower_blocks`), and what they compute is planned for one member or several
(`_lower`); one generator writes LLVM IR from the plan, and its object code is kept on disk
(`codegen`).  What cannot be traced is called as it stands, as numba compiles it or back in Python
(`_called`); algebraic loops are refused, or solved by Newton's method with the
derivatives of their own expressions (`_tearing`, `_newton`).  `_program` says which arrays there
are, `_machine` holds the functions that come out of it, `_routine` calls them.

`_integrate` moves members side by side through time, each with its own steps: an explicit pair
(`_tsit5`), a stiff method (`_rodas5p`, `_stiff`), decisions (`_control`), corners and memories
(`_events`, `_restart`); all their arrays are one pointer to machine code (`_work`, `_pointed`).
`_response` makes of one run what python-control returns, `_ensemble` runs many; `_discrete` is for
sampled systems.
"""

from ..errors import CompileError
from .audit import AuditError
from .compiled import Compiled, compile  # noqa: A004 (what it does)
from .diagram.schedule import AlgebraicLoopError
from .ensemble import Ensemble, ensemble_response
from .integrate.driver import Settings, Statistics
from .integrate.state import Status
from .machine.ahead import compile_ahead
from .machine.store import CacheWarning
from .response import Response, uninterrupted
from .typesetting import BlockEquations, typeset

__all__ = [
    "AlgebraicLoopError",
    "AuditError",
    "BlockEquations",
    "CacheWarning",
    "CompileError",
    "Compiled",
    "Ensemble",
    "Response",
    "Settings",
    "Statistics",
    "Status",
    "compile",
    "compile_ahead",
    "ensemble_response",
    "typeset",
    "uninterrupted",
]
