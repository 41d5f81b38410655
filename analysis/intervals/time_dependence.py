"""Whether a function of (u, t) reads the time at all."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

from flint import arb

from .arithmetic import Ball
from .paths import every_way


class TimeRead(Exception):  # noqa: N818 (it ends an evaluation; nobody else sees it)
    """The time was read."""


def _refused(*_: Any, **__: Any) -> NoReturn:
    raise TimeRead


class _Unread:
    """A time that nothing can be done with: arithmetic, comparison and conversion raise."""

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = _refused
    __rtruediv__ = __pow__ = __rpow__ = __mod__ = __rmod__ = __floordiv__ = _refused
    __rfloordiv__ = __neg__ = __pos__ = __abs__ = __float__ = __int__ = __bool__ = _refused
    __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = __hash__ = _refused  # type: ignore[assignment]
    __array_ufunc__ = __array__ = __iter__ = __len__ = __getitem__ = __index__ = _refused
    __round__ = __trunc__ = __floor__ = __ceil__ = __divmod__ = __matmul__ = _refused


UNREAD: Any = _Unread()


def reads_time(function: Callable[[Any, Any], Any]) -> bool:
    """Whether ``function(u, t)`` reads t for any u; what cannot be followed does."""
    everywhere = Ball(arb(0, "inf"), (arb(1),))
    try:
        return any(result is UNREAD for result in every_way(lambda: function(everywhere, UNREAD)))
    except Exception:  # TimeRead, or whatever a function raises that is not followed
        return True
