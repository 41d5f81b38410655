"""A loop that runs in a page: WebAssembly of the IR that is run here, and of the integrators."""

from .handles import Handle, handles
from .linking import check_linker
from .program import WebProgram, web_program

__all__ = ["Handle", "WebProgram", "check_linker", "handles", "web_program"]
