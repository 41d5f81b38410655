"""Objects of somebody's class that a function makes, and what their operators are.

What such an object does is what its class's functions do: these are walked like any other.
"""

from __future__ import annotations

import abc
import ast
import collections
import dataclasses
import enum
import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from types import FunctionType, ModuleType
from typing import Any, Generic, NamedTuple, Protocol

from .values import (
    FRESH,
    OUTSIDE,
    Attributes,
    Bound,
    Given,
    Impure,
    Instance,
    KnownValue,
    OneOf,
    Parent,
    Pure,
    Unknown,
    captured,
    function_choice,
    holder,
    least_upper_bound,
    library,
)
from .walk import Walk

_RULING = ("__setattr__", "__delattr__", "__getattribute__", "__getattr__", "__del__")
_MISSING = "__getattr__"
_NEUTRAL = (object, Generic, Protocol, abc.ABC)
# in attributes: what is written under a name that is only known when it runs, and by way of a dict
_ANY, OF_DICT = "", "__dict__"


def instance(walk: Walk, cls: type, given: Given) -> KnownValue:
    """Return what is known of a new object of somebody's class."""
    _check_plain(cls)
    new = walk.new_object(cls)
    value = KnownValue(True, True, True, known=new)
    start = inspect.getattr_static(cls, "__init__", None)
    if dataclasses.is_dataclass(cls) and _is_generated(start):
        _of_fields(walk, new, given)
        after = inspect.getattr_static(cls, "__post_init__", None)
        if isinstance(after, FunctionType):
            walk.function(after, Given((value,)))
    elif isinstance(start, FunctionType):
        walk.captured(cls, "__init__", start)
        walk.function(start, Given((value,)) + given)
    elif given.every:
        raise Impure(f"makes an object of {cls.__name__}", "use numbers and arrays")
    return KnownValue(True, all(v.own and v.inside for v in new.attributes.values()), True, new)


def _check_plain(cls: type) -> None:
    """Refuse a class whose objects are more than their attributes."""
    ruling = [name for name in _RULING if inspect.getattr_static(cls, name, None) is not (
        inspect.getattr_static(object, name, None))]  # fmt: skip
    if isinstance(inspect.getattr_static(cls, _MISSING, None), FunctionType):
        ruling.remove(_MISSING)  # which is walked where an attribute may be missing
    if dataclasses.is_dataclass(cls) and cls.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        ruling = [name for name in ruling if name not in ("__setattr__", "__delattr__")]
    foreign = [c for c in cls.__mro__ if c not in _NEUTRAL and library(c) is not None]
    plain = type(cls) in (type, abc.ABCMeta, type(Protocol)) and not issubclass(cls, enum.Enum)
    constructor = inspect.getattr_static(cls, "__new__", None)
    if ruling or foreign or not plain or constructor is not object.__dict__["__new__"]:
        raise Impure(f"makes an object of {cls.__name__}", "use numbers and arrays")


def _is_generated(start: object) -> bool:
    return isinstance(start, FunctionType) and start.__code__.co_filename == "<string>"


def _of_fields(walk: Walk, new: Instance, given: Given) -> None:
    """Note the attributes that a dataclass's generated ``__init__`` writes."""
    waiting, named = list(given.places), dict(given.names)
    for field in dataclasses.fields(new.cls):  # type: ignore[arg-type]
        if not field.init:
            value = OUTSIDE
        elif waiting and not field.kw_only:
            value = waiting.pop(0)
        elif field.name in named:
            value = named.pop(field.name)
        elif field.default is not dataclasses.MISSING:
            value = captured(field.default)
        elif field.default_factory is not dataclasses.MISSING:
            value = walk.call(captured(field.default_factory), Given())
        else:  # among *args or **kwargs, or an error where it runs
            value = named.get("**", OUTSIDE)
        new.learn(field.name, value)


def walk_tuple(walk: Walk, cls: type) -> None:
    """Walk the properties and operators of a named tuple: it is a value like others later."""
    if cls in walk.tuples:
        return
    walk.tuples.add(cls)
    value = _tuple_of(cls)
    for name in dir(cls):
        member = inspect.getattr_static(cls, name)
        function = getattr(member, "__func__", member)
        if isinstance(member, property):
            attribute(walk, value, name)
        elif isinstance(function, FunctionType) and _is_operator(name, function):
            walk.captured(cls, name, getattr(cls, name))
            others = [OUTSIDE] * (function.__code__.co_argcount - 1)
            walk.function(function, Given((value, *others)))


def _tuple_of(cls: Any) -> KnownValue:
    """Return a named tuple, whatever is in it."""
    new = Instance(cls)
    for name in cls._fields:
        new.learn(name, OUTSIDE)
    return KnownValue(True, True, True, known=new)


def of_tuples(walk: Walk, name: str, given: Given) -> list[KnownValue]:
    """Return what is known of the results of methods of the named tuples that the call makes."""
    results = []
    for cls in list(walk.tuples):
        method = inspect.getattr_static(cls, name, None)
        if isinstance(method, FunctionType):
            walk.captured(cls, name, method)
            results.append(
                walk.function(method, Given((_tuple_of(cls), *given.places), given.names))
            )
    return results


def _is_operator(name: str, method: FunctionType) -> bool:
    """Whether Python calls a method by itself, and it is not one that all named tuples have."""
    module = method.__globals__
    return name.startswith("__") and module is not vars(collections) and "_tuple_new" not in module


def attribute(walk: Walk, base: KnownValue, name: str) -> KnownValue:
    """Return what is known of an attribute of an object that the call has made."""
    new: Instance = base.known
    if name == OF_DICT:
        return attributes_of(walk, base)
    if name == "__class__":
        return captured(new.cls)
    values = [new.attributes[key] for key in dict.fromkeys((name, _ANY)) if key in new.attributes]
    member = inspect.getattr_static(new.cls, name, None)
    if name in new.attributes or member is None:
        finds = operator_of(walk, base, _MISSING)
        values += [walk.function(finds, Given((base, captured(name))))] if finds else []
        return least_upper_bound(values or [OUTSIDE])  # without one it raises where it runs
    walk.captured(new.cls, name, getattr(new.cls, name))
    result, may_be_method = of_class(walk, base, member), hasattr(type(member), "__get__")
    if may_be_method:  # nothing but a dict hides one: `set_attribute`
        values = [new.attributes[OF_DICT]] if OF_DICT in new.attributes else []
    return least_upper_bound([result, *values])


def set_attribute(walk: Walk, base: KnownValue, name: KnownValue, value: KnownValue) -> KnownValue:
    """Note that an attribute is written, by its name or, where that is open, any of them."""
    thing = base.known
    if isinstance(thing, OneOf):
        return least_upper_bound([set_attribute(walk, c, name, value) for c in thing.choices])
    if not isinstance(thing, Instance):
        raise Impure("calls setattr() of what it did not make", "keep it in a state of the block")
    is_named = isinstance(name.known, str)
    if is_named and name.known in ("__dict__", "__class__"):
        raise Impure(f"writes '{name.known}' of an object", "write its attributes by their names")
    if not is_named and isinstance(function_choice([value]), OneOf):
        raise Impure("writes functions into attributes by computed names", "write the names")
    names = [name.known] if is_named else dir(thing.cls)
    setters = [inspect.getattr_static(thing.cls, n, None) for n in names]
    for setter in setters:
        if isinstance(setter, property) and setter.fset is not None:
            walk.call(captured(setter.fset), Given((base, value)))
    if not is_named or not isinstance(setters[0], property):
        thing.learn(names[0] if is_named else _ANY, value)
    return FRESH


def replaced_fields(walk: Walk, base: KnownValue, named: Mapping[str, KnownValue]) -> KnownValue:
    """Return what is known of what `dataclasses.replace` makes of an object."""
    thing = base.known
    if isinstance(thing, OneOf):
        return least_upper_bound([replaced_fields(walk, c, named) for c in thing.choices])
    known = isinstance(thing, Instance)
    cls = thing.cls if known else type(thing)
    if isinstance(thing, Unknown) or not dataclasses.is_dataclass(cls):
        raise Impure("replaces fields of what is only known when it runs", "name the class")
    before = {
        field.name: attribute(walk, base, field.name)
        if known
        else captured(getattr(thing, field.name))
        for field in dataclasses.fields(cls)
    }
    return instance(walk, cls, Given((), {**before, **named}))


def of_parent(walk: Walk, parent: Parent, name: str) -> KnownValue:
    """Return what ``super().name`` is for an object that the call has made."""
    order = parent.own.known.cls.__mro__
    for cls in order[order.index(parent.cls) + 1 :]:
        if name in vars(cls):
            if cls is object:
                return KnownValue(True, True, known=Pure())  # object.__init__ does nothing
            walk.captured(cls, name, getattr(cls, name))
            return of_class(walk, parent.own, vars(cls)[name])
    return OUTSIDE


def of_class(walk: Walk, base: KnownValue, member: Callable[..., Any]) -> KnownValue:
    """Return what is known of what an object finds in its class."""
    if isinstance(member, property):
        return walk.call(captured(member.fget), Given((base,)))
    if hasattr(member, "func") and hasattr(member, "attrname"):  # a cached property
        return walk.call(captured(member.func), Given((base,)))
    if isinstance(member, staticmethod):
        return captured(member.__func__)
    if isinstance(member, classmethod):
        cls = captured(base.known.cls)
        return KnownValue(True, True, known=Bound(captured(member.__func__), Given((cls,))))
    if isinstance(member, FunctionType | functools._lru_cache_wrapper):
        return KnownValue(True, True, known=Bound(captured(member), Given((base,))))
    return captured(member)


def with_field_names(node: ast.Call, function: object, given: Given) -> Given:
    """Return what makes a named tuple, with its fields where a list has their names."""
    if not (function is collections.namedtuple or function is NamedTuple) or len(node.args) < 2:
        return given
    listed = node.args[1].elts if isinstance(node.args[1], ast.List | ast.Tuple) else []
    names = [part.elts[0] if isinstance(part, ast.Tuple) else part for part in listed]
    known = [name.value for name in names if isinstance(name, ast.Constant)]
    if not names or len(known) < len(names):
        return given
    return Given((given.places[0], captured(known), *given.places[2:]), given.names)


def named_tuple(given: Given) -> KnownValue:
    """Return the class that `collections.namedtuple` makes of names that are written out."""
    places, names = ([v.known for v in given.places], {k: v.known for k, v in given.names.items()})
    if any(isinstance(v, Unknown) for v in (*places, *names.values())):
        raise Impure("makes a named tuple of what is only known when it runs", "name its fields")
    return captured(collections.namedtuple(*places, **names))  # pyright: ignore


def attributes_of(walk: Walk, value: KnownValue) -> KnownValue:
    """Return what is known of the attributes of an object by their names."""
    thing = value.known
    if isinstance(thing, Instance):
        thing.learn(_ANY, OUTSIDE)  # whatever is written into it
        return dataclasses.replace(holder(thing.attributes.values()), known=Attributes(value))
    if isinstance(thing, Unknown) and value.own and value.holds:
        return dataclasses.replace(value)  # a `SimpleNamespace` that the call has made
    if isinstance(thing, Unknown | type | ModuleType) or not hasattr(thing, "__dict__"):
        raise Impure("calls vars() of what is only known when it runs", "name the attributes")
    walk.captured(thing, "__dict__", vars(thing))  # which may have more one day
    for name, part in vars(thing).items():
        walk.captured(thing, name, part)
    return dataclasses.replace(captured(dict(vars(thing))), inside=False)


def operator_of(walk: Walk, value: KnownValue, name: str) -> FunctionType | None:
    """Return the function of somebody's class that is an object's operator."""
    thing = value.known
    cls = thing.cls if isinstance(thing, Instance) else type(thing)
    plain = isinstance(thing, Unknown | type) or library(cls) is not None
    if plain and not isinstance(thing, Instance):
        return None
    function = inspect.getattr_static(cls, name, None)
    if not isinstance(function, FunctionType) or _is_generated(function):
        return None
    if function.__module__ == "enum":  # a member or a combination of members
        return None
    walk.captured(cls, name, function)
    return function


def iterates(walk: Walk, value: KnownValue) -> bool:
    """Walk the methods of somebody's class that go through an object; return if there are any."""
    method = operator_of(walk, value, "__iter__")
    if method is None:
        return False
    result = walk.function(method, Given((value,)))
    choices = result.known.choices if isinstance(result.known, OneOf) else (result,)
    for choice in choices:
        following = operator_of(walk, choice, "__next__")
        if following is not None:
            walk.function(following, Given((choice,)))
    return True


def may_be_called(thing: object) -> bool:
    """Whether a thing may be called: of objects that the call has made, by their classes."""
    return not isinstance(thing, Instance) or any("__call__" in vars(c) for c in thing.cls.__mro__)


def asks_what_is_there(function: object, places: Sequence[KnownValue]) -> bool:
    """Whether ``hasattr`` asks for something that an object certainly has."""
    thing, name = (*(value.known for value in places), None, None)[:2]
    if function is not hasattr or not isinstance(name, str) or isinstance(thing, Unknown | Pure):
        return False
    if isinstance(thing, Instance):
        return name in thing.attributes or inspect.getattr_static(thing.cls, name, None) is not None
    return inspect.getattr_static(thing, name, None) is not None


def class_of_value(value: KnownValue) -> KnownValue:
    """Return what is known of the class of something."""
    if isinstance(value.known, Unknown):
        return OUTSIDE
    return captured(value.known.cls if isinstance(value.known, Instance) else type(value.known))


OF_ATTRIBUTES = {("vars", 1): attributes_of, ("setattr", 3): set_attribute}
