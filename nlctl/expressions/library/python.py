"""Python's own functions, of expressions."""

from __future__ import annotations

import builtins
import copy
import functools
import heapq
import math
import sys
import warnings
from collections.abc import Callable
from types import BuiltinFunctionType, FunctionType, MethodType, NoneType
from typing import Any

import numpy as np

from ..arrays import Tracer, python_number, scalar, traced
from ..decimals import to_decimals
from ..graph import Ambiguous, Expr, Graph, MessageWritten, Namespace, Untraceable, catchable
from ..masked import Masked, MaskedPlaces
from ..operators import elementwise
from ..promoted import is_numpys
from ..texts import text_of
from .ordered import extreme, first_ones, sorted_things
from .table import WRITTEN, NumberType, is_traced, of, unwrapped, written_out

_SAFE = ("abs", "all", "any", "bool", "dict", "divmod", "enumerate", "filter", "iter",
         "list", "map", "next", "pow", "range", "reversed", "set", "slice", "sum",
         "tuple", "zip", "object", "property", "staticmethod", "classmethod")  # fmt: skip
_FUNCTIONS = (FunctionType, MethodType, BuiltinFunctionType, functools.partial)
_EXACT = 22  # the largest power of ten that is a float
# of a kind of numbers: those of Python and of NumPy
NUMBER_SAMPLES = {"f": (0.0, np.float64(0)), "i": (0, np.int64(0)), "b": (True, np.True_)}
# these ask their arguments, as they do of arrays


def of_math(graph: Graph, operation: str, result: object, arguments: tuple[Any, ...]) -> Any:
    """Return the result of a function of math, which raises errors where NumPy's does not."""
    if not isinstance(result, Tracer):
        return result
    if result.shape:
        raise Untraceable("a function of math of an array")
    if operation in _DEFINED:
        return python_number(graph, result.only)
    op, infinity, value = graph.op, graph.const(math.inf), result.only
    given = [traced(graph, v).only for v in arguments]
    if operation in _PERIODIC:
        finite = op("not", op("eq", op("absolute", given[0]), infinity))
    else:
        if graph.attempts:
            undefined = [op("ne", value, value), *(op("eq", v, v) for v in given)]
            graph.guard(op("not", functools.reduce(functools.partial(op, "and"), undefined)),
                        ValueError)  # fmt: skip
        finite = op("lt", op("absolute", value), infinity)
        for v in given:
            passed = op("and", op("eq", op("absolute", v), infinity), op("eq", value, value))
            finite = op("or", finite, op("or", op("ne", v, v), passed))
    if finite.op != "const" or not finite.data:
        if operation in _UNSETTLED and graph.attempts:
            raise Untraceable("try around what may raise one of several errors")
        graph.guard(finite, OverflowError if operation in _OVERFLOWING else ValueError)
    return python_number(graph, value)


_DEFINED = ("tanh", "arctan", "arctan2", "arcsinh", "cbrt", "erf", "erfc", "absolute", "copysign")
_PERIODIC = ("sin", "cos", "tan")  # everywhere but at infinity
_OVERFLOWING = ("exp", "expm1", "exp2", "sinh", "cosh")
_UNSETTLED = ("power", "hypot")


def _number_of(value: Any, name: str, kind: str) -> Any:
    """Return the number that an object's class makes of it, where that depends on the state."""
    method = getattr(type(value), name, None)
    if isinstance(value, Tracer) or not isinstance(method, FunctionType):
        return value
    number = method(value)
    if not isinstance(number, Tracer):
        return value
    if number.shape or number.only.kind != kind:
        raise Untraceable(f"'{name}' of an object returns something else")
    return number


def guard_whole(graph: Graph, value: Tracer) -> None:
    """Note that Python makes no integer of NaN or infinity."""
    op = functools.partial(elementwise, graph)
    if graph.attempts:
        graph.guard(op("eq", value, value).only, ValueError)
    finite = op("lt", op("absolute", value), math.inf).only
    if finite.op != "const":
        graph.guard(finite, OverflowError)


def python_integer(graph: Graph, name: str, value: Tracer) -> Tracer:
    """Return an integer of Python's, by what a number is rounded by; there is none of NaN."""
    guard_whole(graph, value)
    return python_number(graph, graph.integer(elementwise(graph, name, value).only))


class Builtins:
    """What a traced function finds as Python's builtins."""

    def __init__(self, stage: Any) -> None:
        self.stage, self.graph = stage, stage.graph

    def namespace(self, import_: Callable[..., Any]) -> dict[str, Any]:
        """Return all of them by name."""
        names = Namespace((name, self._builtin(name, v)) for name, v in vars(builtins).items())
        names.update(__import__=import_, super=self._super, print=self._print)
        for name in ("len", "round", "isinstance", "getattr", "setattr", "hasattr", "type",
                     "vars"):  # fmt: skip
            names[name] = getattr(self, f"_{name}")
        makers = {float: self._float, int: self._int, complex: self._complex}
        names.update({kind.__name__: NumberType(kind, make) for kind, make in makers.items()})
        names["repr"] = functools.partial(self._text, names["repr"])
        names["str"] = NumberType(str, functools.partial(self._text, names["str"]))
        names["sorted"] = functools.partial(sorted_things, self.graph)
        names["min"] = functools.partial(self._extreme, "min")
        names["max"] = functools.partial(self._extreme, "max")
        return names

    def _builtin(self, name: str, real: Any) -> Any:
        is_error = isinstance(real, type) and issubclass(real, BaseException)
        safe = name in _SAFE or is_error or not callable(real) or name == "__build_class__"
        if safe:
            return real
        of_numbers = self.stage.for_numbers(real)
        return NumberType(real, of_numbers) if isinstance(real, type) else of_numbers

    def _text(self, of_numbers: Any, *given: Any) -> Any:
        return text_of(lambda: of_numbers(*given), *((v, "") for v in given))

    def _float(self, value: Any = 0.0) -> Any:
        value = _number_of(value, "__float__", "f")
        if not isinstance(value, Tracer):
            return float(value)
        only = _single(value)
        return python_number(self.graph, self.graph.number(only))

    def _complex(self, *parts: Any) -> Any:
        if not any(map(is_traced, parts)):
            return complex(*parts)
        return WRITTEN[complex](self.graph, *parts)

    def _int(self, value: Any = 0, *rest: Any) -> Any:
        value = _number_of(value, "__int__", "i")
        if not isinstance(value, Tracer):
            return int(value, *rest)
        only = _single(value)
        value = scalar(self.graph, only) if value.shape else value
        if only.op == "const":
            return int(only.data)
        if only.kind == "i":
            whole = python_number(self.graph, only)
            return value.__index__() if only.value is not None else whole  # type: ignore[attr-defined]
        if only.kind == "b":
            return python_number(self.graph, self.graph.integer(only))
        return self._whole("trunc", value)

    def _whole(self, name: str, value: Tracer) -> Tracer:
        """Return an integer; Python raises an error where there is none."""
        return python_integer(self.graph, name, value)

    def _round(self, value: Any, digits: Any = None) -> Any:
        if not isinstance(value, Tracer):
            return round(value) if digits is None else round(value, digits)
        if value.shape or value.only.kind != "f":
            raise Untraceable("round of something else than a float")
        if digits is None:
            return self._whole("rint", value)
        if is_numpys(self.graph, value):
            return written_out(self.graph, np.round, value, digits)
        if not value.is_pythons or not isinstance(digits, int) or not 0 <= digits <= _EXACT:
            raise Untraceable("round to decimals of what may be NumPy's number or Python's")
        return python_number(self.graph, to_decimals(self.graph, value.only, digits))

    def _len(self, value: Any) -> Any:
        chosen = isinstance(value, Masked | MaskedPlaces)
        return value.count() if chosen else len(value)

    def _isinstance(self, thing: object, kind: Any) -> bool:
        originals = {copy: real for real, copy in self.stage.classes.items()}
        kinds = kind if isinstance(kind, tuple) else (kind,)
        kinds = tuple(
            getattr(unwrapped(k), "__dict__", {}).get("_real", unwrapped(k)) for k in kinds
        )
        both = (*kinds, *(originals[k] for k in kinds if k in originals))
        if isinstance(thing, Tracer):
            self._asked(thing)
            return self._is_number(thing, both)
        if callable(thing) and any(k in both for k in (*_FUNCTIONS, np.ufunc)):
            raise Untraceable("the type of a function")
        real = thing.__dict__["_real"] if hasattr(type(thing), "_forwards") else thing
        return isinstance(real, both)

    def _asked(self, thing: object) -> None:
        """Refuse a question for the type of what another call has left."""
        if isinstance(thing, Tracer):
            self.stage.kept.ask([number for number, _ in thing.pieces()])

    def _is_number(self, thing: Tracer, kinds: Any) -> bool:
        if thing.is_array:
            return isinstance(np.empty(0), kinds)
        answers = {isinstance(v, kinds) for v in NUMBER_SAMPLES[thing.only.kind]}
        if len(answers) > 1:
            raise Untraceable("a question for the type of a number")
        return answers.pop()

    def _print(self, *_: object, **__: object) -> None:
        raise MessageWritten("a message is written")

    def _getattr(self, thing: object, *rest: Any) -> Any:
        return getattr(thing, *rest)

    def _setattr(self, thing: Any, name: str, value: object) -> None:
        if isinstance(getattr(type(thing), name, None), FunctionType):  # it is not walked
            raise Ambiguous(f"hides the method {name}() of an object by an attribute")
        setattr(thing, name, value)

    def _vars(self, thing: Any) -> Any:
        if not hasattr(type(thing), "_forwards"):
            return vars(thing)
        return {k: self.stage.instead(v) for k, v in vars(thing.__dict__["_real"]).items()}

    def _hasattr(self, thing: object, name: str) -> bool:
        if not isinstance(thing, Tracer):
            return hasattr(thing, name)
        self._asked(thing)
        kinds = (np.empty(thing.shape),) if thing.is_array else (0.0, np.float64(0.0), 0)
        answers = {hasattr(number, name) for number in kinds}
        if len(answers) > 1:
            raise Untraceable(f"a question for {name} of a number")
        return answers.pop()

    def _type(self, thing: object, *rest: Any) -> Any:
        self._asked(thing)
        if isinstance(thing, Tracer) and (thing.is_array or thing.is_pythons):
            return np.ndarray if not thing.is_pythons else type(NUMBER_SAMPLES[thing.only.kind][0])
        if isinstance(thing, Tracer) and is_numpys(self.graph, thing):
            return type(NUMBER_SAMPLES[thing.only.kind][1])
        if is_traced(thing):
            raise Untraceable("the type of what is only known when it runs")
        if hasattr(type(thing), "_forwards"):
            return self.stage.instead(type(thing.__dict__["_real"]))
        if rest:
            return type(thing, *rest)
        kind = thing.__class__
        stands_for_another = kind.__module__.startswith("nlctl.expressions.")
        if callable(thing) and (stands_for_another or isinstance(thing, _FUNCTIONS)):
            raise Untraceable("the type of a function")
        known = (cls for cls in kind.__mro__ if cls.__module__ == "builtins")
        return next(known) if stands_for_another else kind

    def _super(self, *given: Any) -> Any:
        frame = sys._getframe(1)
        cls, thing = given or (
            frame.f_locals["__class__"], frame.f_locals[frame.f_code.co_varnames[0]],
        )  # fmt: skip
        if hasattr(type(thing), "_forwards"):
            return self.stage.parent(thing, cls)
        return super(cls, thing)

    def _extreme(self, name: str, *values: Any, **options: Any) -> Any:
        """Python's min and max: the first of those that no other is beyond."""
        values = list(values[0]) if len(values) == 1 else list(values)  # type: ignore[assignment]
        key = options.pop("key", None)
        if values:
            options.pop("default", None)
        elif "default" not in options:
            raise catchable(ValueError)
        keys = [v if key is None else key(v) for v in values]
        if not any(map(_holds_traced, (*values, *keys))):
            return getattr(builtins, name)(values, **({"key": key} if key else {}), **options)
        arrays = [v for v in (*([] if key else values), *keys) if isinstance(v, Tracer) and v.shape]
        if options or arrays:
            raise Untraceable(f"{name} of arrays, or with {', '.join(options)}")
        return extreme(name, values, keys, self.graph)


def _single(value: Tracer) -> Expr:
    """Return the number that an array is for Python, where NumPy's version takes it for one."""
    if value.shape:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                float(np.zeros(value.shape))
        except TypeError:
            raise catchable(TypeError) from None
    return value.elements().flat[0] if value.shape else value.only


def _holds_traced(value: object) -> bool:
    """Whether there are expressions in a number, or in a tuple of numbers."""
    return any(map(_holds_traced, value)) if isinstance(value, tuple) else is_traced(value)


@of(copy.copy, copy.deepcopy)
def copied(graph: Graph, value: Any, memo: object = None) -> Any:
    """Return a copy."""
    if isinstance(value, Tracer):
        return value.copy()
    if type(value) in (list, tuple):
        return type(value)(copied(graph, v) for v in value)
    if type(value) is dict:
        return {k: copied(graph, v) for k, v in value.items()}
    if isinstance(value, float | int | str | bytes | NoneType | np.generic):
        return value
    if type(value) is np.ndarray and value.dtype == float:
        return traced(graph, value).copy()
    raise Untraceable(f"a copy of {type(value).__name__}")


of(heapq.nlargest)(first_ones(True))
of(heapq.nsmallest)(first_ones(False))


@of(np.vectorize)
def vectorize(graph: Graph, function: Callable[..., Any], otypes: object = None) -> Any:
    """Return a function that is called for each element."""

    are_floats = otypes in ("d", [float], [np.float64], ["d"], ["float"], ["f8"])

    def each(*arguments: object, **named: object) -> Any:
        arrays = [traced(graph, a).short() for a in (*arguments, *named.values())]
        shape = np.broadcast_shapes(*(a.shape for a in arrays))
        zero = traced(graph, np.zeros(shape))
        arrays = [elementwise(graph, "add", a, zero) for a in arrays]
        numbers = [[_handed_over(graph, a[index]) for a in arrays] for index in np.ndindex(shape)]
        count = len(arguments)
        results = [
            traced(graph, function(*row[:count], **dict(zip(named, row[count:], strict=True))))
            for row in numbers
        ]
        if any(f.shape or not (are_floats or _is_float(graph, f)) for f in results):
            raise Untraceable("np.vectorize of something else than floats")
        results = [scalar(graph, graph.number(f.only)) for f in results]
        return traced(graph, results).reshape(shape) if shape else results[0]

    return each


def _is_float(graph: Graph, number: Tracer) -> bool:
    return number.only.kind == "f" and not (graph.mixed and graph.may_be_whole(number.only))


def _handed_over(graph: Graph, value: object) -> Any:
    """Return what NumPy hands a function for an element: a number of Python's."""
    return python_number(graph, traced(graph, value).only)


@of(functools.wraps, makes=True)
def wraps(graph: Graph, *_: object, **__: object) -> Any:
    """Return what leaves a function as it is: no equation asks for its name."""
    return lambda function: function


@of(functools.cache, functools.lru_cache, makes=True)
def uncached(graph: Graph, function: object = None, typed: bool = False, **_: object) -> Any:
    """Return a function that computes again what Python's keeps."""
    if function is None or isinstance(function, int):
        return functools.partial(uncached, graph)

    around, first = getattr(function, "__closure__", None) or (), []

    def computed(*arguments: object, **named: object) -> Any:
        for value in (*arguments, *named.values()):
            if isinstance(value, list | dict | set) or getattr(value, "shape", ()):
                raise TypeError("a cache of what has no hash")
        now = [cell.cell_contents for cell in around]
        first.extend(now if not first else ())
        same = all(a is b and _never_changes(a) for a, b in zip(now, first, strict=True))
        if not same or not isinstance(function, FunctionType):
            raise Untraceable("a cache of a function that reads what changes")
        return function(*arguments, **named)

    return computed


def _never_changes(value: object) -> bool:
    is_number = isinstance(value, bool | int | float | str | NoneType)
    is_alone = isinstance(value, FunctionType) and not value.__closure__
    return is_number or is_alone or (isinstance(value, Tracer) and not value.shape)


@of(np.apply_along_axis)
def apply_along_axis(
    graph: Graph, function: Callable[..., Any], axis: int, values: object
) -> Tracer:
    """Return what a function makes of each row or column."""
    array = traced(graph, values)
    if array.ndim != 2:
        raise Untraceable("apply_along_axis of something else than a matrix")
    rows = array if axis in (1, -1) else array.T
    results = traced(graph, [function(row) for row in rows])
    return results if results.ndim == 1 or axis in (1, -1) else results.T
