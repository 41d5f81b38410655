"""Texts of what is only known when a function runs: messages, that nobody computes with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .arrays import Tracer
from .graph import Untraceable


class Unwritten:
    """A text that may be handed on and thrown away; nothing can be asked of it."""

    @property
    def __class__(self) -> Any:
        return str

    def _asked(self, *_: object) -> Any:
        raise Untraceable("a text of what is only known when it runs")

    def _longer(self, other: object) -> Any:
        return self if isinstance(other, str) else NotImplemented

    __getattr__ = __str__ = __format__ = __hash__ = __eq__ = __len__ = __bool__ = _asked
    __iter__ = __mod__ = __lt__ = __gt__ = __contains__ = _asked
    __getitem__ = __repr__ = __mul__ = __rmul__ = __le__ = __ge__ = __ne__ = _asked
    __add__ = __radd__ = _longer


def text_of(write: Callable[[], str], *parts: tuple[Any, str]) -> Any:
    """Return a text, one that says nothing where numbers in it are only known when it runs."""
    varying = [(v, form) for v, form in parts if isinstance(v, Tracer) or type(v) is Unwritten]
    if not varying:
        return write()
    for value, form in varying:
        if form and (not isinstance(value, Tracer) or value.shape or value.only.kind != "f"):
            raise Untraceable("a text of what is only known when it runs")
        format(0.5 if form else "", form)
    return Unwritten()


def formatted(thing: Any, *values: Any, **named: Any) -> Any:
    """Return ``thing.format(...)``, of a text or of anything else."""
    if type(thing) is not str:
        return thing.format(*values, **named)
    count = len(values)
    return _filled(
        lambda *v: thing.format(*v[:count], **dict(zip(named, v[count:], strict=True))),
        (*values, *named.values()),
    )


def filled_in(form: str, values: Any) -> Any:
    """Return ``form % values``."""
    several = type(values) is tuple
    return _filled(lambda *v: form % (v if several else v[0]), values if several else (values,))


def _filled(write: Callable[..., str], values: tuple[Any, ...]) -> Any:
    """Return a text with values in it; what they may be shows whether it can be written."""
    text = text_of(lambda: write(*values), *((v, "") for v in values))
    if type(text) is Unwritten:
        try:
            write(*map(_sample, values))
        except (TypeError, ValueError) as error:
            raise Untraceable(f"a text that cannot be written: {error}") from error
    return text


def _sample(value: Any) -> Any:
    """Return what a value may be when the function runs."""
    if type(value) is Unwritten:
        return ""
    if not isinstance(value, Tracer):
        return value
    of_kind = {"f": 0.5, "i": 0, "b": True}
    return np.zeros(value.shape) if value.is_array else of_kind[value.only.kind]
