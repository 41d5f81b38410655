"""Whether a response is one of a loop, and whether that loop obeys N(zeta) zeta' = r u."""

from __future__ import annotations

from typing import Any

import numpy as np

from nlctl.diagrams import state_names
from nlctl.errors import DiagramError, ParameterError
from nlctl.wording import counted

from ..nussbaum.property import GainFunction
from .roles import read_parts

__all__ = ["law_of_response", "own_parameters"]

_LOOKS = 12  # samples that are compared
_EQUAL = 1e-6  # relative, and absolute below 1


def own_parameters(loop: Any, response: Any) -> dict[str, Any]:
    """Return the parameters of a response that differ from those of its loop."""
    usual, given = dict(loop.params), (response.params or {}).items()
    return {k: v for k, v in given if "." in k and not np.array_equal(usual.get(k, np.nan), v)}


def law_of_response(loop: Any, response: Any) -> GainFunction:
    """Return the Nussbaum function of the loop that a response is of.

    At samples of the response zeta, r and u are compared with the diagram's own outputs at the same
    states, and N(zeta) zeta' with r u, zeta' from the diagram's own right-hand side.

    Parameters
    ----------
    loop : control.InterconnectedSystem or Compiled
    response : control.TimeResponseData
        With its states, and the outputs zeta, r and u.

    Raises
    ------
    DiagramError
        If the loop is not the one that the proof is about, has no Nussbaum law, or its law is not
        (23), (24).
    ParameterError
        If the response is not one of the loop.
    """
    loop = getattr(loop, "system", loop)
    states = np.atleast_2d(np.asarray(response.states))
    if states.shape[0] != loop.nstates:
        raise ParameterError(
            f"the response has {counted(states.shape[0], 'state')}, '{loop.name}' has "
            f"{loop.nstates}: give the loop that it is of"
        )
    params = own_parameters(loop, response)
    parts = read_parts(loop, params=params)
    if "zeta" not in parts.law.states or not hasattr(parts.law, "N"):
        raise DiagramError(
            f"slow_drift is about laws with a Nussbaum argument, got {type(parts.law).__name__}"
        )
    place = state_names(loop).index(f"{parts.paths['law']}.zeta")
    for i in np.unique(np.linspace(0, states.shape[1] - 1, _LOOKS).astype(int)):
        t, x = float(response.time[i]), states[:, i]
        zeta, r, u = _compared(loop, response, i, params)
        rate = float(np.asarray(loop.dynamics(t, x, np.zeros(0), params=params))[place])
        _check_close(
            f"N(zeta) zeta' and r u of '{loop.name}'", parts.law.N(zeta) * rate, r * u, t,
            DiagramError,
        )  # fmt: skip
    return parts.law.N


def _compared(loop: Any, response: Any, i: int, params: dict[str, Any]) -> list[float]:
    """Return zeta, r and u of the loop at a sample, equal to those of the response."""
    t, x = float(response.time[i]), np.atleast_2d(np.asarray(response.states))[:, i]
    own = np.asarray(loop.output(t, x, np.zeros(0), params=params))
    told, labels = np.atleast_2d(np.asarray(response.outputs)), list(response.output_labels)
    values = []
    for name in ("zeta", "r", "u"):
        value = float(own[loop.output_labels.index(name)])
        given = float(told[labels.index(name), i])
        _check_close(f"{name} of the response and of '{loop.name}'", given, value, t)
        values.append(value)
    return values


def _check_close(
    what: str, a: float, b: float, t: float, error: type[ValueError] = ParameterError
) -> None:
    if not abs(a - b) <= _EQUAL * max(1.0, abs(a), abs(b)):
        raise error(f"{what} differ at t = {t:g} s: {a:.9g} and {b:.9g}")
