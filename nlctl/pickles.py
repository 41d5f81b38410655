"""Functions in a pickle: by name where others can import them, by value where they cannot."""

import pickle
from typing import Any

import cloudpickle

from .errors import UsageError


class ByValue:
    """Stands in a pickle for what has no name there, such as a function in a function."""

    def __init__(self, who: str, field: str, value: object) -> None:
        self.who, self.field, self.value = who, field, value

    def __reduce__(self) -> tuple[Any, ...]:
        try:
            return pickle.loads, (cloudpickle.dumps(self.value),)
        except Exception as error:  # a pickle passes on whatever objects raise
            name = getattr(self.value, "__qualname__", repr(self.value))
            raise UsageError(
                f"{self.who} cannot be pickled: its {self.field}, '{name}', reads what cannot be "
                f"({error}); a function of a module, whose globals stay there, can be"
            ) from error

    def __deepcopy__(self, memo: object) -> "ByValue":
        return self


def state_of(record: object, fields: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of a record, for a pickle, and nothing that follows from them."""
    return {name: _sent(record, name, getattr(record, name)) for name in fields}


def with_state(record: object, state: dict[str, Any]) -> None:
    """Write the fields of a record that was pickled or copied."""
    for name, value in state.items():
        whole = value.value if isinstance(value, ByValue) else value
        object.__setattr__(record, name, whole)


def _sent(record: object, name: str, value: object) -> Any:
    if not callable(value):
        return value
    try:
        pickle.dumps(value)
    except Exception:  # whatever its class raises
        return ByValue(type(record).__name__, name, value)
    return value
