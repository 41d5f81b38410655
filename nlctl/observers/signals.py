"""Names of an observer's signals."""

from ..arguments import are_names, names_in
from ..errors import ParameterError


def estimate_names(count: int) -> tuple[str, ...]:
    """Return ("x1_hat", ..., "xn_hat")."""
    return tuple(f"x{i}_hat" for i in range(1, count + 1))


def set_names(spec: object, key: str, count: int | None, at_least: int = 1) -> None:
    """Make a field of a record a tuple of names; refuse what is none, and another number."""
    who, given = type(spec).__name__, getattr(spec, key)
    names = names_in(given)
    if not are_names(names) or len(set(names)) < len(names):
        raise ParameterError(f"{who} needs different names in {key}, got {names}")
    if len(names) < at_least or count not in (None, len(names)):
        number = f"{count}" if count is not None else f"at least {at_least}"
        raise ParameterError(f"{who} needs {number} in {key}, got {len(names)}: {names}")
    object.__setattr__(spec, key, names)
