"""Texts that a function puts together: by what they may name an attribute."""

import re
from collections.abc import Iterable, Sequence

from .values import FRESH, KnownValue, TextLike

_ANY = ".*"


def joined(parts: Sequence[KnownValue]) -> KnownValue:
    """Return what is known of a text of several parts in their order."""
    text = TextLike.of("".join(map(_pattern, parts)))
    return KnownValue(True, True, known=text) if text is not None else FRESH


def is_text(value: KnownValue) -> bool:
    """Whether a value is a text."""
    return isinstance(value.known, str | TextLike)


def named_by(names: Iterable[str], text: TextLike) -> list[str]:
    """Return those names that a text may be."""
    return [name for name in names if re.fullmatch(text.pattern, name, re.DOTALL)]


def _pattern(value: KnownValue) -> str:
    if isinstance(value.known, TextLike):
        return f"(?:{value.known.pattern})"
    return re.escape(value.known) if isinstance(value.known, str) else _ANY
