"""A loop that runs in a page: WebAssembly of the IR that is run here, and of the integrators."""

from .linking import check_linker
from .program import WebProgram, web_program

__all__ = ["WebProgram", "check_linker", "web_program"]
