"""The parameters of a diagram: their table, and what a user's overrides may name."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import control as ct

from ..blocks import Block, ParameterRow, parameter_rows, record_rows, sampling_of, within
from ..names import Parameters, base_name, unknown
from ..params import declared_params
from ..upstream.control_internals import set_parameters
from .places import known_system, leaves

if TYPE_CHECKING:
    import pandas as pd


def check_read(system: Any, params: Mapping[str, Any] | None) -> None:
    """Refuse parameters without a block's name that nothing in a diagram of nlctl's can read.

    A third-party function reads what it likes; blocks of nlctl and linear systems do not.  Where
    none is nlctl's, python-control's own rule holds: what nothing reads is ignored.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.
    params : mapping or None
        Overrides by name.

    Raises
    ------
    UnknownNameError
        The nearest name is given.
    """
    bare = [key for key in params or {} if isinstance(key, str) and "." not in key]
    bare = [key for key in bare if base_name(key) not in system.params]
    if not bare:
        return
    parts = [within(leaf.system) for leaf in leaves(system)]
    others = [part for part in parts if not isinstance(part, Block)]
    linear = ct.StateSpace, ct.TransferFunction
    if len(others) < len(parts) and all(isinstance(part, linear) for part in others):
        raise unknown("parameter", bare[0], parameter_names(system))


def override(system: Any, params: Mapping[str, Any] | None) -> None:
    """Let a system's equations have a user's overrides from now on; None for its own values.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.
    params : mapping or None
        Overrides by name.

    Raises
    ------
    UnknownNameError, AmbiguousNameError, ParameterError
        If a name or a value is refused.
    """
    check_read(system, params)
    set_parameters(system, params)


def parameter_names(system: ct.InputOutputSystem) -> list[str]:
    """Return the qualified names of all parameters of nlctl blocks in `system`.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Returns
    -------
    list of str
        In the order of `all_parameter_rows`.
    """
    return [row.name for row in all_parameter_rows(system)]


def all_parameter_rows(system: ct.InputOutputSystem) -> list[ParameterRow]:
    """Return the parameter table of a diagram, with the values of a run without overrides.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Returns
    -------
    list of ParameterRow
        In the order of the blocks, those of sampling behind them.
    """
    if isinstance(system, ct.NonlinearIOSystem):
        set_parameters(system, None)
    rows: list[ParameterRow] = []
    for leaf in leaves(system):
        if isinstance(within(leaf.system), Block):
            rows += parameter_rows(within(leaf.system), f"{leaf.parameter_path}.")
    for path, owner in samplings(system):
        rows += parameter_rows(owner, f"{path}.")
    return rows


def samplings(system: Any) -> list[tuple[Any, Any]]:
    """Return what says how blocks are sampled, each once, behind the path of its parameters.

    Parameters
    ----------
    system : control.InputOutputSystem
        A diagram or a block.

    Returns
    -------
    list of (str, object)
        Path and owner of the parameters, one for each clock.
    """
    every = [sampling_of(leaf.system) for leaf in leaves(system)]
    found: dict[int, Any] = {id(made): made for made in every if made is not None}
    owners = system.params.owners if isinstance(system.params, Parameters) else {}
    paths = {id(owner): name.rpartition(".")[0] for name, owner in owners.items()}
    return [(paths.get(key, made.name), made) for key, made in found.items()]


def parameters(system: Any) -> pd.DataFrame:
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
    >>> import nlctl
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
