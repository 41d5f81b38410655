"""Controllers and equations as code for other machines: C99, object code, FMUs."""

from .controller import export_controller, export_equations
from .fmi.archive import fmu
from .objects import TARGETS, Target, object_code
from .source import ExportedController, ExportedEquations, c_files

__all__ = [
    "TARGETS",
    "ExportedController",
    "ExportedEquations",
    "Target",
    "c_files",
    "export_controller",
    "export_equations",
    "fmu",
    "object_code",
]
