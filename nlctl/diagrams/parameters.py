"""The parameters of a diagram: their table, and what a user's overrides may name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..blocks import Block, parameter_rows, sampling_of, within
from ..names import Parameters
from ..params import Param, ParameterRow, declared_params, record_rows
from ..upstream.control_internals import StandIn, current_parameters, set_parameters
from ..upstream.systems import System
from .addresses import divided
from .places import known_system, leaves
from .third_party import apart, declared_keys, is_third_party, set_keys

if TYPE_CHECKING:
    import pandas as pd


def check_read(system: System, params: Mapping[str, Any] | None) -> None:
    """Refuse parameters that nothing in a diagram reads."""
    divided(system, params)


def override(system: ct.NonlinearIOSystem, params: Mapping[str, Any] | None) -> dict[str, Any]:
    """Let a system's equations have a user's overrides from now on; None for its own values."""
    parts = divided(system, params)
    blocks = [within(leaf.system) for leaf in leaves(system)]
    for leaf_block in blocks:
        if "nlctl_overrides" in vars(leaf_block):
            leaf_block.nlctl_overrides = parts.alone.get(id(leaf_block), {})
    set_parameters(system, parts.given)
    for leaf_block in blocks:
        alone = parts.alone.get(id(leaf_block))
        if alone and "nlctl_overrides" not in vars(leaf_block):  # not a run's own
            set_keys(current_parameters(leaf_block), alone, str(leaf_block.name))
    return parts.given


def overridden(system: System, params: Mapping[str, Any] | None = None) -> Any:
    """Return a copy of a system whose equations have a user's overrides; the system stays as it is.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.
    params : mapping, optional
        Overrides by name.

    Returns
    -------
    control.InputOutputSystem
        Its functions, matrices and records are those of the system.

    Raises
    ------
    UnknownNameError, AmbiguousNameError, ParameterError
        If a name or a value is refused.
    """
    copied = apart(system.system if isinstance(system, StandIn) else system).system
    override(copied, params)
    return copied


def parameter_names(system: ct.InputOutputSystem) -> list[str]:
    """Return the qualified names of all parameters in `system`."""
    return [row.name for row in all_parameter_rows(system)]


def all_parameter_rows(system: ct.InputOutputSystem) -> list[ParameterRow]:
    """Return the parameter table of a diagram, with the values of a run without overrides."""
    if isinstance(system, ct.NonlinearIOSystem):
        named = apart(system).system
        set_parameters(named, None)
        system = named
    rows: list[ParameterRow] = []
    for leaf in leaves(system):
        if isinstance(within(leaf.system), Block):
            rows += parameter_rows(within(leaf.system), f"{leaf.parameter_path}.")
        elif is_third_party(within(leaf.system)):
            rows += _third_party_rows(within(leaf.system), leaf.parameter_path)
    for path, owner in samplings(system):
        rows += parameter_rows(owner, f"{path}.")
    return rows


def declared_rules(system: ct.NonlinearIOSystem) -> dict[str, Param]:
    """Return what records declare of parameters, by qualified names."""
    owners = [(leaf.parameter_path, within(leaf.system)) for leaf in leaves(system)]
    specs = [(path, block.spec) for path, block in owners if isinstance(block, Block)]
    specs += [(path, owner.spec) for path, owner in samplings(system)]
    return {
        f"{path}.{name}": rule
        for path, spec in specs
        for name, rule in declared_params(spec).items()
    }


def _third_party_rows(system: Any, path: str) -> list[ParameterRow]:
    """Return the numbers that a third-party block declares; nobody says what they mean."""
    values = current_parameters(system)
    return [
        ParameterRow(name=f"{path}.{key}", value=values[key], unit="", meaning="", bounds="")
        for key in declared_keys(system)
        if isinstance(key, str) and np.asarray(values[key]).dtype.kind in "fib"
    ]


def samplings(system: Any) -> list[tuple[Any, Any]]:
    """Return what says how blocks are sampled, each once, behind the path of its parameters."""
    every = [sampling_of(leaf.system) for leaf in leaves(system)]
    by_identity: dict[int, Any] = {
        id(sampling): sampling for sampling in every if sampling is not None
    }
    known = getattr(system, "params", None)  # transfer functions have none
    owners = known.owners if isinstance(known, Parameters) else {}
    paths = {id(owner): name.rpartition(".")[0] for name, owner in owners.items()}
    return [(paths.get(key, sampling.name), sampling) for key, sampling in by_identity.items()]


@as_annotated
def parameters(system: System) -> pd.DataFrame:
    """Return all parameters of a diagram, block or record as a table.

    Parameters
    ----------
    system : control.InputOutputSystem, record or Compiled
        Whose parameters are listed.

    Returns
    -------
    pandas.DataFrame
        One row per parameter, indexed by qualified name, or by the name of the field for a
        record; columns value, unit, bounds, meaning.

    Raises
    ------
    ParameterError
        If it is none of these.

    Examples
    --------
    >>> float(parameters(nlctl.DeadZone())["value"]["b_r"])
    0.5
    """
    import pandas as pd

    is_record = dataclasses.is_dataclass(system) and not isinstance(system, type)
    if is_record and declared_params(system):
        rows = record_rows(system)
    else:
        rows = all_parameter_rows(known_system("parameters", system))
    return pd.DataFrame(
        {
            "value": [row.value for row in rows],
            "unit": [row.unit for row in rows],
            "bounds": [row.bounds for row in rows],
            "meaning": [row.meaning for row in rows],
        },
        index=pd.Index([row.name for row in rows], name="parameter"),
    )
