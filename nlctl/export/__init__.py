"""Controllers and equations as code for other machines: C99 that is read, object code to link."""

from .controller import ExportedController, export_controller
from .equations import ExportedEquations, export_equations
from .objects import TARGETS, Target, object_code

__all__ = [
    "TARGETS",
    "ExportedController",
    "ExportedEquations",
    "Target",
    "export_controller",
    "export_equations",
    "object_code",
]
