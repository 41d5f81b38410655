"""Controllers as code for other machines: C99 that is read, object code that is linked."""

from .controller import ExportedController, export_controller
from .objects import TARGETS, object_code

__all__ = ["TARGETS", "ExportedController", "export_controller", "object_code"]
