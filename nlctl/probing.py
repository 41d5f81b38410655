"""Equations of a block, called once: what they take and return, and whether inputs act at once."""

import inspect
import traceback
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from .errors import BlockError, UsageError
from .names import unknown
from .wording import counted

_Names = Sequence[str]


def probed(
    who: str, spec: Any, names: Mapping[str, _Names | None], x: np.ndarray, u: np.ndarray, p: Any
) -> None:
    """Refuse equations that fail at a point, or return what is not a number for each name.

    `names` has the equations; None stands for one that may return any number of numbers.
    """
    with np.errstate(all="ignore"):
        for what, labels in names.items():
            _check_values(f"{who} returns", what, _called(who, spec, what, x, u, p), labels)
        # With NaN for an input, an output that it reaches turns NaN as well.
        if not spec.feedthrough and u.size:
            before = np.asarray(spec.output(0.0, x, u, p), dtype=float)
            after = np.asarray(_called(who, spec, "output", x, u * np.nan, p), dtype=float)
            if not np.array_equal(before, after, equal_nan=True):
                label = (names["output"] or ())[int(np.argmax(before != after))]
                raise BlockError(
                    f"{who} declares feedthrough = False, but output '{label}' depends on the input"
                )


def _called(who: str, spec: object, what: str, x: np.ndarray, u: np.ndarray, p: Any) -> Any:
    """Return what an equation returns; what it raises becomes a sentence."""
    function = getattr(spec, what)
    check_arguments(who, what, function, ("t", "x", "u", "p"))
    try:
        return function(0.0, x, u, p)
    except UsageError:
        raise
    except Exception as error:  # whatever a user's function raises
        if isinstance(error, AttributeError) and error.obj is p:
            where = f"in {what} of {who}{_place(error)}"
            reads = unknown("parameter", f"p.{error.name}", [f"p.{n}" for n in p._fields], where)
            raise BlockError(str(reads)) from error
        raise BlockError(
            f"{who} ends in {type(error).__name__} from {what}{_place(error)}, called with "
            f"{counted(x.size, 'state')} and {counted(u.size, 'input')}: {error}"
        ) from error


def check_arguments(who: str, what: str, function: object, taken: tuple[str, ...]) -> None:
    """Refuse what is not a function, and one that cannot be called as equations are."""
    needed = f"{what}({', '.join(taken)})"
    if not callable(function):
        raise BlockError(f"{who} needs a function {needed}, got {function!r}")
    try:
        signature = inspect.signature(function)
        signature.bind(*taken)
    except TypeError:
        static = ", a static method" if taken[-1] == "p" else ""
        how = f": write @nlctl.equation above {what}" if inspect.ismethod(function) else ""
        raise BlockError(f"{who} needs {needed}{static}, got {what}{signature}{how}") from None
    except ValueError:  # a function in C that does not say what it takes
        return


def _check_values(returns: str, what: str, values: Any, labels: _Names | None) -> None:
    """Refuse what is not one number for each name."""
    count = np.size(values) if labels is None else len(labels)
    needs = "numbers" if labels is None else f"{counted(count, 'number')}: {', '.join(labels)}"
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        array = np.array(None)
    if array.dtype.kind not in "biuf":
        raise BlockError(f"{returns} {str(values)[:60]!r} from {what}, needs {needs}")
    if array.size != count:
        got = counted(array.size, "value")
        raise BlockError(f"{returns} {got} from {what}, needs {count}: {', '.join(labels or ())}")


def _place(error: Exception) -> str:
    """Return the file and line that an error comes from, if it is that of a function."""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f" ({last.filename}, line {last.lineno})" if last.filename != __file__ else ""
