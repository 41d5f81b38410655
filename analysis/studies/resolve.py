"""What a study file refers to by name: functions in files and modules, blocks, laws of SciPy."""

import importlib
import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from scipy import stats

from nlctl.errors import ParameterError, UnknownNameError, UsageError
from nlctl.host.former_name import present_name, warn_of_it
from nlctl.names import check_known, unknown
from nlctl.paper import named_example

from ..catalogue import named_block
from ..robustness import Uncertain
from ..robustness.uncertainty.binding import check_keyword
from .code.loading import Admits, load_file
from .code.rule import Grant, check_defined, check_function, check_loop_function, check_place
from .file.schema import Law
from .kind import Kind

DEFAULT = "default"
"""The option that leaves a keyword of the loop as it is."""


def loop_function(name: str, folder: Path) -> Callable[..., Any]:
    """Return the function that builds the loop, see `paper.named_example`, `named_function`."""
    if ":" in name:
        function = named_function(name, folder)
        check_loop_function(function, name)
        return function
    try:
        return named_example(name)
    except UnknownNameError as error:
        raise ParameterError(
            f"{error}; a loop of your own is 'path/to/file.py:function' or 'module:function'"
        ) from None


def named_function(name: str, folder: Path) -> Callable[..., Any]:
    """Return ``"path/to/file.py:function"``, relative to `folder`, or ``"module:function"``."""
    module, source, attribute = _place(name, folder)
    function = getattr(module, attribute, None)  # some packages load a name when it is first used
    if not callable(function):
        loaded = vars(module)
        functions = [key for key in dir(module) if key not in loaded or callable(loaded[key])]
        raise unknown("function", attribute, functions, f"in '{source}'")
    check_function(function, name)
    return function


def checked_definition(name: str, grant: Grant) -> None:
    """Import what a study names, and refuse it where code that may not run has defined it."""
    named(name, grant.folder, grant.refuses)
    check_defined(named_function(name, grant.folder), name, grant)


def named_kind(name: str, grant: Grant) -> Kind:
    """Return the kind of analysis ``"path/to/file.py:name"`` or ``"module:name"``."""
    kind = named(name, grant.folder, grant.refuses)
    if not isinstance(kind, Kind):
        raise ParameterError(
            "a kind of analysis is an nlctl.analysis.studies.Kind, "
            f"'{name}' is a {type(kind).__name__}"
        )
    return kind


def named(name: str, folder: Path, admits: Admits | None = None) -> Any:
    """Return whatever ``"path/to/file.py:name"`` or ``"module:name"`` is."""
    module, source, attribute = _place(name, folder, admits)
    if not hasattr(module, attribute):
        names = [key for key in vars(module) if not key.startswith("_")]
        raise unknown("name", attribute, names, f"in '{source}'")
    return getattr(module, attribute)


def _place(name: str, folder: Path, admits: Admits | None = None) -> tuple[Any, str, str]:
    """Return the module that a place is in, how the file calls it, and the name in it."""
    check_place(name)
    source, _, attribute = name.rpartition(":")
    file = source.endswith(".py")
    module = load_file(folder / source, admits) if file else _from_module(source)
    return module, source, attribute


def _from_module(name: str) -> Any:
    present = present_name(name)
    if present != name:
        warn_of_it()
    try:
        return importlib.import_module(present)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise  # it exists, and imports something that does not
        file = Path(f"{name.replace('.', '/')}.py")
        near = f"; there is a file: {file.as_posix()}:NAME" if file.is_file() else ""
        raise ParameterError(f"there is no module '{name}' ({error}){near}") from None


def option(value: object, folder: Path) -> Any:
    """Make what a table of the file describes; numbers and texts stay what they are."""
    if isinstance(value, list):
        return tuple(option(part, folder) for part in value)
    if not isinstance(value, Mapping):
        return value
    if len({"block", "function"} & set(value)) != 1:
        raise ParameterError(
            'a block is { block = "DeadZone", b_r = 0.6 } or { function = "file.py:name", ... }, '
            f"got the keys {sorted(value)}"
        )
    for key in ("block", "function"):
        if key in value and not isinstance(value[key], str):
            raise ParameterError(f"{key} needs a text, got {value[key]!r}"[:200])
    arguments = {key: option(part, folder) for key, part in value.items()}
    name = arguments.pop("block", None)
    function = (
        named_function(arguments.pop("function"), folder)
        if name is None
        else named_block(str(name))
    )
    for key in arguments:
        check_keyword(function, key)
    named_as = str(value.get("function", name))
    check_complete(function, named_as, arguments)
    try:
        return function(**arguments)
    except UsageError:
        raise
    except Exception as error:
        if named_as.rpartition(":")[0].endswith(".py"):  # their own traceback helps
            raise
        raise ParameterError(
            f"'{named_as}' does not take these arguments ({type(error).__name__}: {error})"
        ) from error


def check_complete(function: Callable[..., Any], name: str, given: Mapping[str, Any]) -> None:
    """Refuse to call a function without what it needs."""
    try:
        needed = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):  # none that Python knows
        return
    fixed = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    open_ = [p for p in needed if p.default is p.empty and p.kind not in fixed]
    missing = [parameter.name for parameter in open_ if parameter.name not in given]
    if missing:
        raise ParameterError(f"'{name}' needs {', '.join(missing)} as well")


def uncertain(name: str, law: Law) -> Uncertain:
    """Return the quantity that a table under ``[space]`` describes."""
    given = [key for key in ("uniform", "normal", "law") if getattr(law, key) is not None]
    if len(given) > 1 or not (given or law.bounds):
        raise ParameterError(
            f"'{name}' needs one of uniform, normal and law, or bounds alone, got "
            f"{' and '.join(given) or 'none'}"
        )
    if law.parameters and law.law is None:
        raise ParameterError(f"'{name}' has parameters and no law that takes them")
    frozen = None
    if law.uniform is not None:
        low, high = law.uniform
        if not low < high:
            raise ParameterError(f"'{name}' needs uniform = [low, high], got [{low:g}, {high:g}]")
        frozen = stats.uniform(low, high - low)
    elif law.normal is not None:
        frozen = _frozen(name, "norm", dict(zip(("loc", "scale"), law.normal, strict=True)))
    elif law.law is not None:
        frozen = _frozen(name, law.law, law.parameters)
    return Uncertain(
        name=name, law=frozen, bounds=law.bounds, nominal=law.nominal, unit=law.unit
    )  # fmt: skip


def _frozen(name: str, law: str, parameters: Mapping[str, float]) -> Any:
    generic = stats.rv_continuous | stats.rv_discrete
    laws = {key: thing for key, thing in vars(stats).items() if isinstance(thing, generic)}
    check_known("law", law, laws, "of scipy.stats")
    shapes = [part.strip() for part in (laws[law].shapes or "").split(",") if part.strip()]
    allowed = [*shapes, "loc", *(["scale"] if isinstance(laws[law], stats.rv_continuous) else [])]
    for key in parameters:
        check_known("parameter", key, allowed, f"of the law {law}")
    missing = [shape for shape in shapes if shape not in parameters]
    if missing:
        raise ParameterError(f"'{name}': the law {law} needs {', '.join(missing)} as well")
    frozen = laws[law](**parameters)
    try:
        Uncertain(name=name, law=frozen)
    except UsageError:
        text = ", ".join(f"{key} = {value:g}" for key, value in parameters.items())
        raise ParameterError(f"'{name}': the law {law} does not exist for {text}") from None
    return frozen
