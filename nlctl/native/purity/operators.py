"""What operators and functions of Python's own ask the classes of objects, which is walked."""

import ast
from collections.abc import Sequence

from ...expressions.protocols import array_protocol
from . import handed_on
from .checked import check_object
from .made import iterates, operator_of
from .values import (
    FRESH,
    PLAIN,
    Given,
    Instance,
    KnownValue,
    OneOf,
    captured,
    element,
    forgotten,
    has_no_truth,
    least_upper_bound,
    was_there,
)
from .walk import Walk

OPERATORS = {
    ast.Add: "add", ast.Sub: "sub", ast.Mult: "mul", ast.Div: "truediv", ast.FloorDiv: "floordiv",
    ast.Mod: "mod", ast.Pow: "pow", ast.MatMult: "matmul", ast.BitAnd: "and", ast.BitOr: "or",
    ast.BitXor: "xor", ast.LShift: "lshift", ast.RShift: "rshift", ast.Lt: "lt", ast.LtE: "le",
    ast.Gt: "gt", ast.GtE: "ge", ast.Eq: "eq", ast.NotEq: "ne",
}  # fmt: skip
_TURNED = {"lt": "gt", "le": "ge", "gt": "lt", "ge": "le", "eq": "eq", "ne": "ne"}
_OF_BUILTINS = {
    "len": ("__len__",), "abs": ("__abs__",), "round": ("__round__",), "float": ("__float__",),
    "int": ("__int__", "__index__", "__trunc__"), "reversed": ("__reversed__",),
    "bool": ("__bool__", "__len__"), "iter": ("__iter__",), "next": ("__next__",),
}  # fmt: skip
_NOTHING = captured(0)  # where a sum starts
_PASSES = 4  # of a sum, after which what is known of it is what it was


def choices_of(value: KnownValue) -> Sequence[KnownValue]:
    """Return the things that a value may be, each of which has operators of its own."""
    return value.known.choices if isinstance(value.known, OneOf) else (value,)


def operands(values: Sequence[KnownValue]) -> None:
    """Check that operators are those of numbers, arrays and containers."""
    for value in values:
        check_object(value, "computes with")


def operated(walk: Walk, kind: type, left: KnownValue, right: KnownValue) -> KnownValue:
    """Return what is known of the result of an operator, which an object's class may have."""
    lefts, rights = choices_of(left), choices_of(right)
    if len(lefts) * len(rights) > 1:
        return least_upper_bound([operated(walk, kind, a, b) for a in lefts for b in rights])
    name, results, plain = OPERATORS.get(kind, ""), [], []
    mirrored = _TURNED.get(name, f"r{name}")
    for one, other, special in ((left, right, name), (right, left, mirrored)):
        operator = operator_of(walk, one, f"__{special}__") if name else None
        if operator is None and special == "ne":  # by default it is what == is not
            operator = operator_of(walk, one, "__eq__")
        if operator is None:
            plain.append(one)
        else:
            results.append(walk.function(operator, Given((one, other))))
    if results:
        return least_upper_bound(results)
    operands(plain)
    return handed_on.result_of_plain(kind, plain)


def signed(walk: Walk, name: str, value: KnownValue) -> KnownValue:
    """Return what is known of the result of an operator of one operand."""
    results = []
    for choice in choices_of(value):
        operator = operator_of(walk, choice, name) if name else None
        if operator is not None:
            results.append(walk.function(operator, Given((choice,))))
        else:
            operands([choice])
    return least_upper_bound(results)


def tested(walk: Walk, value: KnownValue) -> None:
    """Walk what an object's class does to say whether it is true."""
    for choice in choices_of(value):
        if not has_no_truth(choice.known) and of_builtin(walk, "bool", [choice]) is None:
            operands([choice])


def contains(walk: Walk, base: KnownValue, part: KnownValue) -> None:
    """Walk what an object's class does to say whether something is in it."""
    for choice in choices_of(base):
        operator = operator_of(walk, choice, "__contains__")
        if operator is not None:
            walk.function(operator, Given((choice, part)))
        else:  # each part of it is compared
            iterates(walk, choice)
            operands([part] if isinstance(choice.known, Instance) else [choice, part])


def of_builtin(
    walk: Walk, name: str, places: Sequence[KnownValue], start: KnownValue = _NOTHING
) -> KnownValue | None:
    """Return what is known of what a function of Python's own asks an object's class."""
    if not places or name not in (*_OF_BUILTINS, "sum"):
        return None
    if name == "sum":
        return _sum(walk, places[0], places[1] if len(places) > 1 else start)
    results = []
    for choice in choices_of(places[0]):
        every = (operator_of(walk, choice, special) for special in _OF_BUILTINS[name])
        operator = next((one for one in every if one is not None), None)
        if operator is None:
            return None
        others = () if name == "next" else places[1:]
        results.append(walk.function(operator, Given((choice, *others))))
    return least_upper_bound([*results, *(places[1:] if name == "next" else ())])


def with_arrays(walk: Walk, given: Given, module: str) -> Given:
    """Return arguments of a function with the arrays that it makes of objects, if it is NumPy's."""
    if not module.startswith("numpy"):
        return given
    names = {k: _as_array(walk, v) for k, v in given.names.items()}
    return Given(tuple(_as_array(walk, v) for v in given.places), names)


def _as_array(walk: Walk, value: KnownValue) -> KnownValue:
    """Return what is known of the array that NumPy makes of an object, of others the same."""
    thing = value.known
    cls = thing.cls if isinstance(thing, Instance) else type(thing)
    methods = array_protocol(cls) if _is_object(value) and not isinstance(thing, OneOf) else ()
    results = []
    for name in methods:
        method = operator_of(walk, value, name)
        if method is None:
            return value
        others = (FRESH,) if name == "__getitem__" else ()
        results.append(walk.function(method, Given((value, *others))))
    if not results:
        return value
    return results[0] if methods == ("__array__",) else FRESH


def _is_object(value: KnownValue) -> bool:
    return all(isinstance(v.known, Instance) or was_there(v.known) for v in choices_of(value))


def _sum(walk: Walk, over: KnownValue, start: KnownValue) -> KnownValue | None:
    """Return what is known of a sum of objects, or of one that may be where it starts."""
    part = element(over)
    if not (_is_object(part) or _is_object(start)):
        is_plain = start.own and start.inside
        return None if is_plain else least_upper_bound([FRESH, forgotten(start)])
    iterates(walk, over)
    totals = [start]
    for _ in range(_PASSES):
        totals.append(operated(walk, ast.Add, totals[-1], part))
    return least_upper_bound(v for v in totals if not isinstance(v.known, PLAIN))


def ordered(walk: Walk, name: str, places: Sequence[KnownValue]) -> bool:
    """Walk by what objects are put in order; return whether there are objects to be."""
    parts = [element(places[0])] if len(places) == 1 else list(places)
    if name not in ("min", "max", "sorted") or not all(map(_is_object, parts)):
        return False
    for one in parts:
        for other in parts:
            operated(walk, ast.Gt if name == "max" else ast.Lt, one, other)
    return True
