"""What SciPy's laws of probability are written with, and its documentation does not name."""

from collections.abc import Callable
from typing import Any


def apply_where() -> Callable[..., Any] | None:
    """Return the choice between two formulas by a condition; None of an older SciPy."""
    try:
        from scipy._lib.array_api_extra import apply_where
    except ImportError:
        return None
    return apply_where


def lazy_select() -> Callable[..., Any] | None:
    """Return the choice among several formulas by conditions; None of another SciPy."""
    from scipy._lib import _util

    return getattr(_util, "_lazyselect", None)


def beta_density() -> Callable[..., Any] | None:
    """Return the ufunc that is the density of `scipy.stats.beta`; None of an older SciPy."""
    from scipy import special

    return getattr(special._ufuncs, "_beta_pdf", None)
