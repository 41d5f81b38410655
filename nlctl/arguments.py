"""Arguments of functions, checked in one way; each check returns the value that it let through.

Every message names who asked, the argument, the rule and the value.
"""

from collections.abc import Iterable
from typing import Any, TypeVar

import numpy as np

from .errors import ParameterError
from .params import as_numbers
from .params import integer as integer
from .wording import nearest

_T = TypeVar("_T")
RTOL, ATOL = 1e-8, 1e-10  # of every run unless it is given others: a member of an ensemble is a run


def one_of(who: str, name: str, value: object, options: Iterable[str]) -> Any:
    """Return an option that is one of a few words."""
    options = list(options)
    if isinstance(value, str) and value in options:
        return value
    near = nearest(value, options, most=1, cutoff=0.6) if isinstance(value, str) else []
    hint = f"; nearest: '{near[0]}'" if near else ""
    rule = " or ".join(f"'{option}'" for option in options)
    raise ParameterError(f"{who} needs {name} to be {rule}, got {value!r}{hint}")


def names_in(given: str | Iterable[str]) -> tuple[str, ...]:
    """Return one name, or several, as a tuple."""
    return (given,) if isinstance(given, str) else tuple(given)


def are_names(names: Iterable[object]) -> bool:
    """Whether all of them are texts with something in them."""
    return all(isinstance(name, str) and name for name in names)


def pairs(who: str, inputs: tuple[str, ...], outputs: tuple[str, ...]) -> None:
    """Check that a block's signals come in pairs, one before it for each behind it."""
    if len(inputs) != len(outputs) or not inputs:
        raise ParameterError(f"{who} needs as many inputs as outputs, got {inputs} and {outputs}")


def number(
    who: str,
    name: str,
    value: object,
    *,
    above: float = -np.inf,
    below: float = np.inf,
    at_least: float = -np.inf,
    at_most: float = np.inf,
) -> float:
    """Return a finite number as a float."""
    is_number = isinstance(value, int | float | np.integer | np.floating)
    if not is_number or isinstance(value, bool):
        raise ParameterError(f"{who} needs a number for {name}, got {value!r}")
    try:
        converted = float(value)
    except OverflowError:  # an integer beyond the largest number
        converted = np.inf
    holds = above < converted < below and at_least <= converted <= at_most
    if not (holds and np.isfinite(converted)):
        rule = _rule(name, (above, at_least), (below, at_most))
        raise ParameterError(f"{who} needs {rule}, got {value}")
    return converted


def _rule(name: str, low: tuple[float, float], high: tuple[float, float]) -> str:
    """Return bounds as ``0 < name < 1``, ``name >= 2`` or ``a finite name``."""
    lows = [f"{b:g} {sign} " for sign, b in zip(("<", "<="), low, strict=True) if np.isfinite(b)]
    highs = [f" {sign} {b:g}" for sign, b in zip(("<", "<="), high, strict=True) if np.isfinite(b)]
    if lows and not highs:
        limit, sign = lows[0].split()
        return f"a finite {name} {sign.replace('<', '>')} {limit}"
    return f"{lows[0]}{name}{highs[0]}" if lows else f"a finite {name}{''.join(highs)}"


def tolerances(who: str, rtol: object, atol: object) -> None:
    """Check the tolerances of an integrator: with rtol >= 1 no digit of a state need be right."""
    number(who, "rtol", rtol, above=0, below=1)
    number(who, "atol", atol, above=0)


def vector(who: str, name: str, value: object) -> np.ndarray:
    """Return finite numbers as a float array of shape (m,)."""
    array = as_numbers(value)
    if array is None or (array.ndim != 1 and array.size):
        given = repr(value) if array is None else f"shape {array.shape}"
        raise ParameterError(f"{who} needs a list of numbers for {name}, got {given}")
    bad = np.nonzero(~np.isfinite(array))[0]
    if bad.size:
        raise ParameterError(f"{who} needs finite {name}, got {array[bad[0]]} as number {bad[0]}")
    return array.reshape(-1)


def fraction(who: str, name: str, value: object) -> float:
    """Return a number between 0 and 1, both excluded."""
    return number(who, name, value, above=0, below=1)


def flag(who: str, name: str, value: object) -> bool:
    """Return True or False."""
    if not isinstance(value, bool | np.bool_):
        raise ParameterError(f"{who} needs {name} to be True or False, got {value!r}")
    return bool(value)


def of_type(who: str, name: str, value: object, kind: type[_T], how: str = "") -> _T:
    """Return a value of the kind that a function works on."""
    if not isinstance(value, kind):
        remedy = f" ({how})" if how else ""
        raise ParameterError(
            f"{who} needs {name} to be of type {kind.__name__}{remedy}, got {type(value).__name__}"
        )
    return value


def tuple_of(who: str, name: str, values: object, kind: type[_T]) -> tuple[_T, ...]:
    """Return a sequence of values of one kind as a tuple."""
    if not isinstance(values, list | tuple):
        raise ParameterError(
            f"{who} needs {name} to be a tuple of {kind.__name__}, got {type(values).__name__}"
        )
    for place, value in enumerate(values):
        of_type(who, f"{name}[{place}]", value, kind)
    return tuple(values)


def text(who: str, name: str, value: object) -> str:
    """Return a text that is not empty."""
    if not (isinstance(value, str) and value):
        raise ParameterError(f"{who} needs a name for {name}, got {value!r}")
    return value


def a_function(who: str, name: str, value: object) -> Any:
    """Return what can be called."""
    if not callable(value):
        raise ParameterError(f"{who} needs a function for {name}, got {type(value).__name__}")
    return value
