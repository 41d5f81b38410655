"""A space held against the diagrams that it is to be applied to."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import control as ct
import numpy as np

from nlctl._block import Block
from nlctl._diagram import all_parameter_rows, initial_state, leaves, state_names
from nlctl._errors import UsageError
from nlctl._names import Parameters, base_name, find_name, unknown
from nlctl._param import with_overrides
from nlctl.native import Compiled

from .quantity import SpaceError, Uncertain
from .space import Space, combinations

__all__ = ["diagrams", "resolved"]


def resolved(space: Space, diagram: ct.InputOutputSystem | Compiled) -> Space:
    """Return the space with full names, and units and nominal values that it left to the diagram.

    Both ends of every box are tried: a parameter's own bounds refuse them here, not in the middle
    of a study.  (Draws beyond the box of a law with infinite support are refused when they come.)

    Raises
    ------
    UnknownNameError, AmbiguousNameError
        If a name is not that of exactly one parameter or state; the nearest are given.
    ParameterError
        If an end of a box breaks a rule of the block.
    SpaceError
        If a parameter is no number, is a whole number while its law is not, a name means the same
        as another one, or the diagram's own value lies outside the box.
    """
    system = diagram.system if isinstance(diagram, Compiled) else diagram
    place = {True: _state, False: _parameter}
    quantities = tuple(place[q.is_initial](q, system) for q in space.quantities)
    return replace(space, quantities=quantities)


def _state(quantity: Uncertain, system: Any) -> Uncertain:
    index = {name: i for i, name in enumerate(state_names(system))}
    full = find_name("state", quantity.name.removesuffix("(0)"), index)
    return _filled(quantity, f"{full}(0)", float(initial_state(system)[index[full]]), "")


def _parameter(quantity: Uncertain, system: Any) -> Uncertain:
    known = system.params
    rows = {row.name: row for row in all_parameter_rows(system)}
    clashes = known.clashes if isinstance(known, Parameters) else ()
    base = base_name(quantity.name)
    full = find_name("parameter", base, dict(known) | rows, clashes)
    suffix = quantity.name[len(base) :]
    value, unit = (rows[full].value, rows[full].unit) if full in rows else (known[full], "")
    for leaf in leaves(system):
        if isinstance(leaf.system, Block) and full.rpartition(".")[0] == leaf.parameter_path:
            key = full.rpartition(".")[2] + suffix
            for end in quantity.box:
                number = int(end) if quantity.is_whole else end
                with_overrides(leaf.system.current_spec, {key: number}, leaf.path)
            _check_whole(quantity, full in rows and isinstance(value, int))
    if suffix:
        value = np.asarray(value)[tuple(int(k) for k in re.findall(r"\d+", suffix))]
    if np.ndim(value):
        raise SpaceError(
            f"'{full}' has shape {np.shape(value)}: address one element of it, "
            f"'{full}[{', '.join('0' * np.ndim(value))}]'"
        )
    return _filled(quantity, full + suffix, float(value), unit)


def _check_whole(quantity: Uncertain, wanted: bool) -> None:
    if wanted and not quantity.is_whole:
        raise SpaceError(
            f"'{quantity.name}' is a whole number and needs a law of whole numbers, such as "
            f"scipy.stats.randint(0, 10), got {quantity.law_text}"
        )


def _filled(quantity: Uncertain, name: str, value: float, unit: str) -> Uncertain:
    number = value if quantity.nominal is None else quantity.nominal
    try:
        return replace(quantity, name=name, nominal=number, unit=quantity.unit or unit)
    except SpaceError as error:
        raise SpaceError(f"{error}, which is the diagram's: give a nominal value") from None


def diagrams(
    space: Space, build: Callable[..., ct.InputOutputSystem]
) -> list[tuple[Mapping[str, str], ct.InputOutputSystem]]:
    """Build the diagram of every combination of the choices, and hold the space against each.

    Parameters
    ----------
    space : Space
    build : callable
        Called with one keyword per choice, such as `nlctl.paper.example_1`.

    Returns
    -------
    list of (labels, diagram)

    Raises
    ------
    UnknownNameError
        If `build` has no such keyword.
    UsageError
        As in `resolved`; the message names the combination.
    """
    keywords = inspect.signature(build).parameters
    takes_any = any(p.kind is inspect.Parameter.VAR_KEYWORD for p in keywords.values())
    for choice in space.choices:
        if choice.name not in keywords and not takes_any:
            where = f"of {getattr(build, '__name__', build)}"
            raise unknown("keyword", choice.name, keywords, where)
    options = {choice.name: choice.options for choice in space.choices}
    built = []
    for labels in combinations(space):
        diagram = build(**{name: options[name][label] for name, label in labels.items()})
        try:
            resolved(space, diagram)
        except UsageError as error:
            raise type(error)(f"{error} (with {_text(labels)})") from None
        built.append((labels, diagram))
    return built


def _text(labels: Mapping[str, str]) -> str:
    return ", ".join(f"{name} = {label}" for name, label in labels.items()) or "the diagram"
