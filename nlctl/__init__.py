"""nlctl: adaptive neural control of pure-feedback nonlinear systems with python-control.

The names below are loaded when first used, so that ``import nlctl`` and ``nlctl --help`` are
instant.  ``__init__.pyi`` lists them for readers, editors and type checkers alike.
"""

import lazy_loader

from ._version import __version__ as __version__
from .host.checkout import find_analysis as _find_analysis

_find_analysis()

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
