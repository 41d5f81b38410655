"""The native engine: any python-control diagram as machine code, and ensembles of it.

`compile` reads a diagram (`diagram/`).  The blocks' functions are run once on symbols
(`equations/`), and what they compute is planned for one member or several; one generator writes
LLVM IR from the plan (`codegen/`), and its object code is kept on disk (`machine/`).  What cannot
be traced is called unchanged, as numba compiles it or back in Python (`opaque/`), if it depends
on its arguments alone (`purity/`).  Algebraic loops are refused, or solved by Newton's method with
the derivatives of their own expressions.

`timed/` knows before a run when functions of t alone jump, `integrate/` moves batched members
through time, each with its own steps.  `response` makes of one run what python-control returns,
`ensemble` runs many.
"""

from .ahead import compile_ahead
from .compiled import Compiled, compile, linearize  # noqa: A004 (what it does)
from .ensemble import ensemble_response
from .ensemble_result import Ensemble
from .frequency import frequency_response
from .integrate.methods.tableau import Tableau
from .integrate.state import Status
from .operating_points import (
    OperatingPoint,
    find_operating_point,
    find_operating_points,
)
from .response import Response, uninterrupted
from .results import Statistics
from .settings import Settings
from .stepping import Stepper, StepperState, VectorStepper, stepper, vector_stepper
from .typesetting import BlockEquations, typeset

__all__ = [
    "BlockEquations",
    "Compiled",
    "Ensemble",
    "OperatingPoint",
    "Response",
    "Settings",
    "Statistics",
    "Status",
    "Stepper",
    "StepperState",
    "Tableau",
    "VectorStepper",
    "compile",
    "compile_ahead",
    "ensemble_response",
    "find_operating_point",
    "find_operating_points",
    "frequency_response",
    "linearize",
    "stepper",
    "typeset",
    "uninterrupted",
    "vector_stepper",
]
