"""A space validated against the diagrams that it is to be applied to."""

import inspect
import itertools
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import control as ct
import numpy as np

from nlctl.annotations import as_annotated
from nlctl.arguments import a_function, of_type
from nlctl.blocks import Block, within
from nlctl.diagrams import all_parameter_rows, initial_state, leaves, samplings, state_names
from nlctl.errors import ParameterError, UsageError
from nlctl.names import Parameters, base_name, element_index, element_name, find_name, unknown
from nlctl.native import Compiled
from nlctl.params import with_overrides
from nlctl.upstream.control_internals import is_system

from .space import Space, SpaceError, Uncertain, combinations, ends, nominal, towards_nominal

FEW = 10  # of up to so many quantities of one block all corners are tried


@as_annotated
def resolved(space: Space, diagram: ct.InputOutputSystem | Compiled) -> Space:
    """Return the space with full names, and units and nominal values that it left to the diagram.

    Both ends of every box are tried: a parameter's own bounds refuse them here, not in the middle
    of a study.  (Draws beyond the box of a law with infinite support are refused when they come.)

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.
    diagram : control.InputOutputSystem or Compiled
        Whose parameters and states it names.

    Returns
    -------
    Space
        With every name, unit and nominal value; the given one stays as it is.

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one parameter or state; the nearest are given.
    ParameterError
        If an end of a box breaks a rule of the block.
    SpaceError
        If a parameter is not a number, is an integer while its law is not, a name means the same
        as another one, or the diagram's own value lies outside the box.

    Examples
    --------
    Names may be short, and the diagram says what is nominal:

    >>> from nlctl.analysis.robustness import Space, Uncertain, nominal, resolved
    >>> space = Space(quantities=(Uncertain(name="b_r", bounds=(0.4, 0.7)),))
    >>> nominal(resolved(space, nlctl.actuators.cascade({"zone": nlctl.DeadZone(b_r=0.5)})))
    {'zone.b_r': 0.5}
    """
    system = diagram.system if isinstance(diagram, Compiled) else diagram
    of_type("a space", "diagram", system, ct.InputOutputSystem, "nlctl.interconnect(...)")
    place = {True: _state, False: _parameter}
    quantities = tuple(place[q.is_initial](q, system) for q in space.quantities)
    return replace(space, quantities=quantities)


def _state(quantity: Uncertain, system: Any) -> Uncertain:
    index = {name: i for i, name in enumerate(state_names(system))}
    full = find_name("state", quantity.name.removesuffix("(0)"), index)
    return _filled(quantity, f"{full}(0)", float(initial_state(system)[index[full]]), "")


def _parameter(quantity: Uncertain, system: Any) -> Uncertain:
    params = system.params
    rows = {row.name: row for row in all_parameter_rows(system)}
    clashes = params.clashes if isinstance(params, Parameters) else ()
    base = base_name(quantity.name)
    full = find_name("parameter", base, dict(params) | rows, clashes)
    suffix = quantity.name[len(base) :]
    value, unit = (rows[full].value, rows[full].unit) if full in rows else (params[full], "")
    owner = owner_of(system, full + suffix)
    if owner is not None:
        block, key = owner
        for end in map(np.rint, quantity.box) if quantity.is_integer else quantity.box:
            with_overrides(block.current_spec, {key: end}, full.rpartition(".")[0])
        is_integer = full in rows and isinstance(value, int)
        if is_integer and not quantity.is_integer:
            raise SpaceError(
                f"'{quantity.name}' is an integer and needs a law of integers, such as "
                f"scipy.stats.randint(0, 10), got {quantity.law_text}"
            )
    if suffix:
        value = np.asarray(value)[element_index(full + suffix, np.shape(value))]
    if np.ndim(value):
        raise SpaceError(
            f"'{full}' has shape {np.shape(value)}: address one element of it, "
            f"'{element_name(full, [0] * np.ndim(value))}'"
        )
    return _filled(quantity, full + suffix, float(value), unit)


def owner_of(system: ct.InputOutputSystem, name: str) -> tuple[Block, str] | None:
    """Return the block of nlctl that a parameter belongs to, and its name there."""
    path = base_name(name).rpartition(".")[0]
    for leaf in leaves(system):
        if isinstance(within(leaf.system), Block) and leaf.parameter_path == path:
            return within(leaf.system), name.removeprefix(f"{path}.")
    block = dict(samplings(system)).get(path)
    return None if block is None else (block, name.removeprefix(f"{path}."))


def _filled(quantity: Uncertain, name: str, value: float, unit: str) -> Uncertain:
    number = value if quantity.nominal is None else quantity.nominal
    try:
        return replace(quantity, name=name, nominal=number, unit=quantity.unit or unit)
    except SpaceError as error:
        raise SpaceError(f"{error}, which is the diagram's: give a nominal value") from None


def check_keyword(function: Callable[..., Any], name: str) -> None:
    """Refuse a keyword that a function does not take."""
    parameters = inspect.signature(function).parameters
    if name not in parameters and not any(p.kind is p.VAR_KEYWORD for p in parameters.values()):
        plain = function.func if isinstance(function, partial) else function
        where = getattr(plain, "__qualname__", "")
        raise unknown("keyword", name, parameters, where and f"of {where}")


@as_annotated
def diagrams(
    space: Space, build: Callable[..., ct.InputOutputSystem]
) -> list[tuple[Mapping[str, str], ct.InputOutputSystem]]:
    """Build the diagram of every combination of the choices, and check the space against each.

    Parameters
    ----------
    space : Space
        Quantities with their laws, and choices.
    build : callable
        Called with one keyword per choice, such as `nlctl.paper.example_1`.

    Returns
    -------
    list of (labels, diagram)
        The options by the names of their choices, and the diagram built with them.

    Raises
    ------
    UnknownNameError
        If `build` has no such keyword.
    UsageError
        As in `resolved`; the message names the combination.

    Examples
    --------
    >>> from nlctl.analysis.robustness import Choice, Space, diagrams
    >>> stages = {"zone": nlctl.DeadZone(), "gain": nlctl.Gain()}
    >>> space = Space(choices=(Choice(name="stage", options=stages),))
    >>> made = diagrams(space, lambda stage: nlctl.actuators.cascade({"stage": stage}))
    >>> [labels["stage"] for labels, diagram in made]
    ['zone', 'gain']
    """
    a_function("an experiment", "build", build)
    for choice in space.choices:
        check_keyword(build, choice.name)
    options = {choice.name: choice.options for choice in space.choices}
    built = []
    for labels in combinations(space):
        diagram = build(**{name: options[name][label] for name, label in labels.items()})
        if not is_system(diagram):
            raise ParameterError(
                f"build needs to return a diagram, {getattr(build, '__name__', 'it')} returned "
                f"{type(diagram).__name__} (with {_text(labels)})"
            )
        try:
            resolved(space, diagram)
        except UsageError as error:
            raise type(error)(f"{error} (with {_text(labels)})") from None
        built.append((labels, diagram))
    return built


def _text(labels: Mapping[str, str]) -> str:
    return ", ".join(f"{name} = {label}" for name, label in labels.items()) or "the diagram"


def refusal_of(space: Space, systems: Iterable[ct.InputOutputSystem]) -> str:
    """Return why a block refuses values of the boxes that each by itself are admissible, or ""."""
    return next(filter(None, (one(1.0) for one in refusals(space, systems, space.names))), "")


def refusals(
    space: Space, systems: Iterable[ct.InputOutputSystem], names: Collection[str]
) -> Iterator[Callable[[float], str]]:
    """Yield for each corner what says for a factor why its block refuses it, or nothing."""
    # Blocks are those with parameters that are uncertain; of these `names` may be scaled.
    middle = nominal(space)
    for system in systems:
        blocks, fields = {}, {}
        for quantity in space.quantities:
            owner = None if quantity.is_initial else owner_of(system, quantity.name)
            if owner is not None:  # a third-party block takes what it is given
                block, key = owner
                path = base_name(quantity.name).rpartition(".")[0]
                blocks[path] = block
                fields.setdefault(path, {})[quantity.name] = key
        for path, keys in fields.items():
            given = {key: middle[name] for name, key in keys.items()}
            record = with_overrides(blocks[path].current_spec, given, path)
            for corner in _corners(space, [name for name in keys if name in names]):
                yield partial(_refusal, space, record, path, keys, corner)


def _refusal(
    space: Space,
    record: object,
    path: str,
    keys: Mapping[str, str],
    corner: Mapping[str, Any],
    factor: float,
) -> str:
    """Return why a block refuses a corner moved by a factor from nominal, or nothing."""
    row = towards_nominal(space, corner, factor, corner)
    try:
        with_overrides(record, {keys[name]: row[name] for name in row}, path)
    except ParameterError as error:
        return str(error)
    return ""


def _corners(space: Space, names: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Yield what is tried of some quantities: those that are not nominal, each at an end."""
    values = ends(space).to_dict("list")
    sizes = [len(names)] if len(names) <= FEW else [1, 2]
    for group in itertools.chain(*(itertools.combinations(names, size) for size in sizes)):
        for corner in itertools.product(*(values[name] for name in group)):
            yield dict(zip(group, corner, strict=True))
