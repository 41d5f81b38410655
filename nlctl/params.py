"""Parameters of records: declared once with unit, meaning and bounds; checked where they are born.

This module and its bounds are the only validators of numbers in nlctl.
"""

import dataclasses
import functools
import inspect
import math
import re
from collections import namedtuple
from collections.abc import Callable, Iterator, Mapping
from types import FunctionType
from typing import Any, TypeVar, dataclass_transform

import numpy as np

from .annotations import as_numbers, reporting
from .attributes import entries_by_field
from .errors import ParameterError, UnknownKeywordError
from .names import base_name, element_index, unknown
from .pickles import state_of, with_state

Floats = tuple[float, ...]
Matrix = tuple[Floats, ...]
_T = TypeVar("_T")
_KEY = "nlctl"
_MADE_BY_CLASS = 1 << 9  # Py_TPFLAGS_HEAPTYPE: not of types such as int
HIGHEST_ORDER = 100  # of plants and references: a block has a signal for each derivative
EQUATION = "__equation__"  # what `nlctl.equation` marks functions with


@dataclasses.dataclass(frozen=True, kw_only=True)
class Param:
    """What `param` declares about one field: unit, meaning, bounds, number of axes, symbol."""

    unit: str
    meaning: str
    above: float | None
    below: float | None
    at_least: float | None
    at_most: float | None
    ndim: int
    symbol: str | None
    may_be_empty: bool = False

    def rules(self) -> Iterator[tuple[str, Callable[[float], bool]]]:
        """Yield each bound as ``("> 0", test)``."""
        limits = (
            (">", self.above, float.__gt__),
            ("<", self.below, float.__lt__),
            (">=", self.at_least, float.__ge__),
            ("<=", self.at_most, float.__le__),
        )
        for sign, limit, holds in limits:
            if limit is not None:
                yield f"{sign} {limit:g}", lambda v, h=holds, b=limit: bool(h(v, float(b)))

    @property
    def ends(self) -> tuple[tuple[float, bool], tuple[float, bool]]:
        """The least and the largest value, infinite without a bound, and whether it is excluded."""
        low = (self.at_least, False) if self.above is None else (self.above, True)
        high = (self.at_most, False) if self.below is None else (self.below, True)
        return (
            (-np.inf if low[0] is None else float(low[0]), low[1]),
            (np.inf if high[0] is None else float(high[0]), high[1]),
        )

    @property
    def bounds(self) -> str:
        """The bounds as text, for example ``> 0``; empty where there are none."""
        return ", ".join(rule for rule, _ in self.rules())


def param(
    default: Any,
    *,
    unit: str,
    meaning: str,
    above: float | None = None,
    below: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    symbol: str | None = None,
    may_be_empty: bool = False,
) -> Any:
    """Declare a parameter of a block record.

    Parameters
    ----------
    default : float, int, bool or (nested) tuple of float
        Value of the parameter when none is given.  The number of axes of the default is the
        number of axes of the parameter: a tuple is a vector, a tuple of tuples a matrix.
    unit, meaning : str
        Unit (``"1"`` for a pure number) and meaning, shown in every table of parameters.
    above, below : float, optional
        Strict bounds of the value (of every element).
    at_least, at_most : float, optional
        Bounds that the value may attain.
    symbol : str, optional
        What formulas call it, where that is not its name: ``"mu"`` for centres.
    may_be_empty : bool, optional
        Whether a vector may have no element, and a matrix no column.

    Returns
    -------
    dataclasses.Field
        To be assigned in the body of a class decorated with `record`.

    Raises
    ------
    ParameterError
        If the default is not a number, vector or matrix, or a bound is not a number.

    Examples
    --------
    >>> @nlctl.record
    ... class Damper:
    ...     d: float = nlctl.param(0.4, unit="N s/m", meaning="viscous friction", at_least=0)
    >>> print(nlctl.parameters(Damper())["unit"]["d"])
    N s/m
    """
    try:
        ndim = np.ndim(default)
    except ValueError as error:  # rows of different lengths
        raise ParameterError(f"param needs numbers for default, got {default!r}") from error
    bounds = {"above": above, "below": below, "at_least": at_least, "at_most": at_most}
    for name, bound in bounds.items():
        if bound is not None and (as_numbers(bound) is None or np.ndim(bound)):
            raise ParameterError(f"param needs a number for {name}, got {bound!r}")
    declared = Param(
        unit=unit, meaning=meaning, **bounds, ndim=ndim, symbol=symbol, may_be_empty=may_be_empty
    )
    return dataclasses.field(default=default, metadata={_KEY: declared})


@dataclass_transform(
    kw_only_default=True, frozen_default=True, field_specifiers=(dataclasses.field,)
)
def record(cls: type[_T]) -> type[_T]:
    """Make a class a frozen, keyword-only dataclass whose parameters are checked at birth.

    Bounds come from `param`; a method ``check(self)``, where the class has one, looks at rules
    that concern several fields and raises `ParameterError`.  Its equations become static methods.
    Of a block, see `nlctl.Spec`, ``feedthrough`` is True unless the class says otherwise, and
    without an ``update`` there are no states.

    Parameters
    ----------
    cls : type
        With fields made by `param`.

    Returns
    -------
    type
        The dataclass.

    Raises
    ------
    ParameterError
        When a record is made with a value that breaks a rule.
    UnknownNameError
        When it is made with a parameter that it does not have; also a `TypeError`.

    Examples
    --------
    >>> @nlctl.record
    ... class Spring:
    ...     k: float = nlctl.param(2.0, unit="N/m", meaning="stiffness", above=0)
    >>> Spring(k=-1.0)
    Traceback (most recent call last):
    nlctl.errors.ParameterError: Spring needs k > 0, got -1
    """
    if not isinstance(cls, type):
        raise ParameterError(f"record needs a class, got {type(cls).__name__}")
    if "__dataclass_fields__" in cls.__dict__ or not cls.__flags__ & _MADE_BY_CLASS:
        raise ParameterError(
            f"record needs a class of your own that is not one already, got {cls.__name__}"
        )
    doc = cls.__doc__ if cls.__dict__.get("__doc__") else ""
    if "__post_init__" not in cls.__dict__:
        cls.__post_init__ = check_params  # type: ignore[attr-defined]
        cls.__checked_at_birth__ = True  # type: ignore[attr-defined]
    described: Any = dataclasses.dataclass(frozen=True, kw_only=True)(cls)
    _complete(described)
    described.__doc__ = _DocstringOfRecord(doc or "")
    init, known = described.__init__, [f.name for f in dataclasses.fields(described) if f.init]

    @functools.wraps(init)
    def by_name(self: object, *arguments: object, **given: object) -> None:
        for name in given:
            if name not in known:
                raise unknown("parameter", name, known, f"of {cls.__name__}", UnknownKeywordError)
        if arguments:
            first = next(iter([*_declared(described), *known]), None)
            example = f"{cls.__name__}({first}=...)" if first else f"{cls.__name__}()"
            raise UnknownKeywordError(
                f"{cls.__name__} takes no positional argument, got {repr(arguments[0])[:40]}: "
                f"parameters go by name, {example}"
            )
        init(self, **given)

    described.__init__ = reporting(by_name, described.__name__)
    if "__getstate__" not in cls.__dict__:
        names = tuple(f.name for f in dataclasses.fields(described))
        described.__getstate__ = functools.partialmethod(state_of, names)
        described.__setstate__ = with_state
    return described


def _complete(cls: type) -> None:
    """Make the equations of a class static methods, and set what goes without saying."""
    fields = {field.name for field in dataclasses.fields(cls)}
    for name, value in list(vars(cls).items()):
        if name not in fields and isinstance(value, FunctionType) and hasattr(value, EQUATION):
            setattr(cls, name, staticmethod(value))
    if hasattr(cls, "output"):
        cls.feedthrough = getattr(cls, "feedthrough", True)
        if not hasattr(cls, "update"):
            cls.states = getattr(cls, "states", ())


class _DocstringOfRecord:
    """The docstring of a record, completed when somebody reads it."""

    def __init__(self, text: str) -> None:
        self.text, self.whole = text, ""

    def __get__(self, instance: object, owner: type) -> str:
        self.whole = self.whole or _documented(owner, self.text)
        return self.whole


def _documented(cls: type, doc: str) -> str:
    """Return the docstring of a record class with all fields in numpydoc's Parameters."""
    margin = doc.rpartition("\n")[2]  # what stands in front of the closing quotes
    margin = margin if margin.isspace() else ""
    there = re.findall(r"^\s*(\w+(?:, \w+)*) :", doc, re.M)
    told_of = {name for names in there for name in names.split(", ")}
    lines, commented = [], entries_by_field(cls)
    for field in dataclasses.fields(cls):
        if field.name not in told_of:
            entry = commented.get(field.name) or _inherited_entry(cls, field.name)
            lines += entry or _entry(field, declared_params(cls).get(field.name))
            told_of |= set(entry[0].partition(" : ")[0].split(", ")) if entry else set()
    if not lines:
        return doc
    entries = "".join(f"{margin}{line}\n" for line in lines)
    heading = re.search(r"^\s*Parameters\n\s*-+\n", doc, re.M)
    if heading:
        return doc[: heading.end()] + entries + doc[heading.end() :]
    section = f"{margin}Parameters\n{margin}----------\n{entries}{margin}"
    first = re.search(r"^[ \t]*\w+\n[ \t]*-+$", doc, re.M)  # a section that follows by numpydoc
    if first:
        return f"{doc[: first.start()]}{section.rstrip()}\n\n{doc[first.start() :]}"
    return f"{doc.rstrip()}\n\n{section}"


def _inherited_entry(cls: type, name: str) -> list[str]:
    """Return the lines in which a base class describes a field; none if it has another default."""
    for base in cls.__mro__[1:]:
        entry = re.search(rf"^([ \t]*){name} : .+(?:\n\1[ \t]+\S.*)+", base.__doc__ or "", re.M)
        if entry and getattr(cls, name, None) == getattr(base, name, None):
            return inspect.cleandoc(f"\n{entry[0]}").splitlines()
    return []


def _entry(field: dataclasses.Field[Any], rule: Param | None) -> list[str]:
    """Return the lines of one field: name, type and default; meaning, unit and bounds."""
    kind = field.type if isinstance(field.type, str) else getattr(field.type, "__name__", "")
    kind = {"Floats": "tuple of float", "Matrix": "tuple of tuple of float"}.get(kind, kind)
    default = "" if field.default is dataclasses.MISSING else _default_text(field.default)
    head = f"{field.name} : {kind}{default}"
    if rule is None:
        return [head]
    bounds = f", {rule.bounds}" if rule.bounds else ""
    return [head, f"    {rule.meaning[:1].upper()}{rule.meaning[1:]} ({rule.unit}){bounds}."]


def _default_text(value: Any) -> str:
    text = repr(value)
    if len(text) > 60:
        text = " x ".join(map(str, np.shape(value))) + " values" if np.size(value) > 1 else ""
    return f", default {text}" if text else ", optional"


def ensure_checked(spec: object) -> None:
    """Check a record that was not checked when it was made, such as a plain dataclass."""
    if not is_checked(spec):
        check_params(spec)


def is_checked(spec: object) -> bool:
    """Whether a record was checked, and made of numbers and tuples, when it was made."""
    return getattr(type(spec), "__checked_at_birth__", False)


def declared_params(spec: object) -> dict[str, Param]:
    """Return ``{field name: Param}`` of a record or record class, in order of definition."""
    return _declared(spec if isinstance(spec, type) else type(spec))


@functools.cache
def _declared(cls: type) -> dict[str, Param]:
    return {f.name: f.metadata[_KEY] for f in dataclasses.fields(cls) if _KEY in f.metadata}


def check_params(spec: Any) -> None:
    """Normalise every parameter of `spec` (floats, nested tuples) and check its bounds."""
    who = type(spec).__name__
    types = {f.name: f.type for f in dataclasses.fields(spec)}
    for name, rule in declared_params(spec).items():
        value = _normalised(who, name, getattr(spec, name), rule, types[name])
        object.__setattr__(spec, name, value)  # the record is frozen for everybody else
        _check_bounds(who, name, value, rule)
    if hasattr(spec, "check"):
        spec.check()


def _normalised(who: str, name: str, value: object, rule: Param, kind: object) -> Any:
    """Return `value` as bool, int, float or nested tuple of floats."""
    ndim = rule.ndim
    if kind in (bool, "bool"):
        if not isinstance(value, bool | np.bool_):
            raise ParameterError(f"{who} needs {name} to be True or False, got {value!r}")
        return bool(value)
    array = as_numbers(value)
    if array is None:
        raise ParameterError(f"{who} needs numbers for {name}, got {value!r}")
    if array.ndim == 0 and ndim == 1:
        array = array.reshape(1)
    if array.ndim != ndim:
        shape = {0: "a number", 1: "a vector", 2: "a matrix"}[ndim]
        raise ParameterError(f"{who} needs {name} to be {shape}, got shape {array.shape}")
    if array.size == 0 and not (rule.may_be_empty and (ndim == 1 or len(array))):
        raise ParameterError(f"{who} needs at least one value in {name}, got none")
    if kind in (int, "int"):
        if not (math.isfinite(array) and float(array).is_integer()):
            raise ParameterError(f"{who} needs an integer for {name}, got {value!r}")
        return int(array)
    return nested_tuple(array.tolist())


def integer(who: str, name: str, value: Any, at_least: int, at_most: float = math.inf) -> int:
    """Return `value` as an int."""
    is_integer = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not (is_integer and value >= at_least):
        named = name if is_integer else f"an integer {name.removeprefix('an ')}"
        raise ParameterError(f"{who} needs {named} >= {at_least}, got {value!r}")
    if value > at_most:
        raise ParameterError(f"{who} needs {name} <= {at_most}, got {value!r}")
    return int(value)


def set_integer(spec: object, name: str, at_least: int, at_most: float = math.inf) -> None:
    """Check an argument of a record, such as an order, and keep it as an int."""
    label = "an order" if name == "order" else name
    value = integer(type(spec).__name__, label, getattr(spec, name), at_least, at_most)
    object.__setattr__(spec, name, value)


def checked_times(timepts: object) -> np.ndarray:
    """Return a time grid as a float array."""
    times = as_numbers(timepts)
    if times is None:
        raise ParameterError(f"timepts needs numbers, got {str(timepts)[:60]!r}")
    times = times.copy()
    if times.ndim != 1 or times.size < 2:
        raise ParameterError(f"timepts needs at least two times, got shape {times.shape}")
    is_finite = np.isfinite(times)
    rises = (times[1:] > times[:-1]) & is_finite[1:] & is_finite[:-1]
    if not rises.all():
        before, after = times[(at := int(rises.argmin())) : at + 2]
        raise ParameterError(
            f"timepts needs finite times in increasing order, got {before:g} s, then {after:g} s"
        )
    return times


def nested_tuple(value: object) -> Any:
    """Return lists in lists as tuples in tuples."""
    return tuple(map(nested_tuple, value)) if isinstance(value, list) else value


def _check_bounds(who: str, name: str, value: object, rule: Param) -> None:
    for index, element in np.ndenumerate(np.asarray(value, dtype=float)):
        where = name + (f"[{', '.join(map(str, index))}]" if index else "")
        if not math.isfinite(element):
            raise ParameterError(f"{who} needs a finite {where}, got {element}")
        for text, holds in rule.rules():
            if not holds(float(element)):
                raise ParameterError(f"{who} needs {where} {text}, got {element:g}")


def with_overrides(spec: Any, overrides: Mapping[str, Any], block: str) -> Any:
    """Return `spec` with parameters replaced, checked, and errors that name the block."""
    # A diagram hands every block all of its values each time: those that it has are checked.
    fields = {f.name: getattr(spec, f.name) for f in dataclasses.fields(spec)}
    whole = {
        k: v for k, v in overrides.items() if "[" not in k and (v is None or v is not fields.get(k))
    }
    try:
        changed = dataclasses.replace(spec, **whole) if whole else spec
        for key, value in overrides.items():
            if "[" in key:
                changed = _replace_element(changed, key, value)
        ensure_checked(changed)
    except ParameterError as error:
        raise ParameterError(f"{error} (block '{block}')") from None
    return changed


def _replace_element(spec: Any, key: str, value: object) -> Any:
    name, number = base_name(key), as_numbers(value)
    array = np.array(getattr(spec, name), dtype=float)
    try:
        index = element_index(key, array.shape)
        if number is None or number.ndim:
            raise ParameterError(f"'{key}' needs a number")
    except ParameterError:
        raise ParameterError(
            f"{type(spec).__name__} has {name} of shape {array.shape}; "
            f"'{key}' = {value!r} is not an element of it"
        ) from None
    array[index] = number
    return dataclasses.replace(spec, **{name: array})


@functools.cache
def _arguments_type(name: str, fields: tuple[str, ...]) -> type:
    return namedtuple(name, fields)


def equation_arguments(spec: Any) -> Any:
    """Return what the equations of `spec` receive as ``p``: its numbers as a named tuple."""
    # Vectors and matrices become read-only float arrays. A record may add numbers that follow
    # from its parameters with a method ``derived(self) -> dict``.
    values = {name: getattr(spec, name) for name in declared_params(spec)}
    if hasattr(spec, "derived"):
        values |= spec.derived()
    for name, value in values.items():
        if isinstance(value, tuple | np.ndarray):
            array = np.array(value, dtype=float)
            array.flags.writeable = False
            values[name] = array
    return _arguments_type(type(spec).__name__, tuple(values))(**values)


@dataclasses.dataclass(frozen=True, kw_only=True)
class ParameterRow:
    """One line of a parameter table."""

    name: str
    value: Any
    unit: str
    meaning: str
    bounds: str

    @property
    def text(self) -> str:
        """The value as short text; long vectors are summarised."""
        array = np.asarray(self.value)
        if array.size > 6:
            return (
                f"{' x '.join(map(str, array.shape))} values in [{array.min():g}, {array.max():g}]"
            )
        if isinstance(self.value, tuple):
            return "(" + ", ".join(f"{v:g}" for v in array.ravel()) + ")"
        return str(self.value) if isinstance(self.value, bool) else f"{self.value:g}"


def record_rows(spec: object, path: str = "") -> list[ParameterRow]:
    """Return the parameter table of a record, with names that begin with `path`."""
    return [
        ParameterRow(
            name=f"{path}{name}",
            value=getattr(spec, name),
            unit=p.unit,
            meaning=p.meaning,
            bounds=p.bounds,
        )
        for name, p in declared_params(spec).items()
    ]
