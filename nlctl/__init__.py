"""nlctl: adaptive neural control of pure-feedback nonlinear systems with python-control.

The names below are loaded when first used, so that ``import nlctl`` and ``nlctl --help`` are
instant.  ``__init__.pyi`` lists them for readers, editors and type checkers alike: what most
scripts need, and the rooms with everything else.
"""

import lazy_loader

from ._version import __version__ as __version__
from .host.checkout import find_analysis as _find_analysis

_find_analysis()

_listed, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    """Return what is listed; of what has moved into a room, with a warning that names it."""
    if name not in __all__:
        from .host.rooms import found_in_room, with_nearest  # late: few ask

        try:
            return found_in_room(name) or _listed(name)
        except AttributeError:
            raise AttributeError(with_nearest(name, __all__)) from None
    return _listed(name)
