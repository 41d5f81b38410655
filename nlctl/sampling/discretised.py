"""Blocks in continuous time as programs in discrete time."""

from collections.abc import Callable
from typing import Any

import control as ct
import numpy as np

from ..annotations import as_annotated
from ..arguments import number, one_of
from ..blocks import Block, memory_states, sampling_of
from ..diagrams import leaves, not_a_system, reconnected
from ..errors import ParameterError
from ..upstream.control_internals import is_system
from ..upstream.systems import System

_METHODS = ("euler", "tustin", "zoh")


@as_annotated
def discretise(system: System, dt: float, method: str = "euler") -> ct.NonlinearIOSystem:
    """Make a block or diagram in discrete time of one in continuous time.

    Parameters
    ----------
    system : control.InputOutputSystem
        In continuous time; it stays as it is.
    dt : float
        Sampling time (s).
    method : {"euler", "tustin", "zoh"}, optional
        ``"euler"``: x[k+1] = x[k] + dt f(t[k], x[k], u[k]), of any block.  The others are for
        linear blocks and are those of `control.sample_system`.

    Returns
    -------
    control.InputOutputSystem
        With the same signals, parameters and initial state.

    Raises
    ------
    ParameterError
        If `dt` is not positive, the method is for linear blocks only, a block has a memory that
        is not a state in discrete time, or no equations, or is sampled already.

    Examples
    --------
    >>> lag = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="lag")
    >>> float(nlctl.discretise(lag, 0.1).A[0, 0])
    0.9
    """
    number("discretise", "dt", dt, above=0)
    one_of("discretise", "method", method, _METHODS)
    if not is_system(system):
        raise ParameterError(not_a_system("discretise", system))
    system = with_equations("discretise", system)
    if isinstance(system, ct.InterconnectedSystem):
        return rebuilt(system, lambda part: _discretised(part, dt, method), dt)
    return _discretised(system, dt, method)


def with_equations(who: str, system: Any) -> Any:
    """Return a system whose blocks have equations: of a transfer function its state space."""
    if isinstance(system, ct.TransferFunction):
        return ct.ss(
            system, name=system.name, inputs=system.input_labels, outputs=system.output_labels
        )
    for leaf in leaves(system):
        _check_equations(who, leaf.system)
    return system


def _check_equations(who: str, block: ct.NonlinearIOSystem) -> None:
    """Refuse a block whose equations are not those of states that it has."""
    if sampling_of(block) is not None:
        raise ParameterError(
            f"'{block.name}' is sampled already: give {who} the block that it samples, .inner"
        )
    if not isinstance(block, ct.StateSpace | ct.NonlinearIOSystem):
        raise ParameterError(f"'{block.name}' is a {type(block).__name__}, which has no equations")
    for kind in ("inputs", "outputs", "states"):
        if getattr(block, f"n{kind}") is None:
            raise ParameterError(
                f"'{block.name}' does not say how many {kind} it has: give {kind}=... to ct.nlsys"
            )


def _discretised(system: Any, dt: float, method: str) -> Any:
    if not (system.nstates or 0):
        copied = system.copy(name=system.name)
        copied.dt = dt
        return copied
    if system.dt not in (0, None):
        raise ParameterError(f"'{system.name}' is in discrete time already (dt = {system.dt})")
    if isinstance(system, ct.StateSpace):
        names = {
            "name": system.name,
            "inputs": system.input_labels,
            "outputs": system.output_labels,
        }
        return ct.sample_system(
            system, dt, "forward_diff" if method == "euler" else method, **names
        )
    if method != "euler":
        raise ParameterError(
            f"discretise needs method='euler' for '{system.name}', which is not linear, got "
            f"{method!r}"
        )
    spec = system.spec if isinstance(system, Block) else None
    for name in memory_states(spec)[:1]:
        raise ParameterError(
            f"'{system.name}' has a memory, '{name}', that is a state in continuous time only: "
            "leave the block outside of what is sampled"
        )
    copied = system.copy(name=system.name)
    copied.dt, copied.updfcn = dt, _euler(system.updfcn, float(dt))
    return copied


def _euler(f: Callable[..., Any], dt: float) -> Any:
    """Return the forward difference of an equation x' = f(t, x, u, p)."""

    def update(t, x, u, p):
        rates = f(t, x, u, p)
        return [x[i] + dt * rates[i] for i in range(len(x))]

    return update


# -- a diagram with other blocks in the same places -----------------------------------------------


def staged(diagram: ct.InterconnectedSystem, first: object = None, last: object = None) -> Any:
    """Return a diagram whose inputs go through a block of as many, and its outputs as well."""
    connect, given, shown = diagram.connect_map, diagram.input_map, diagram.output_map
    parts = list(diagram.syslist)
    if last is not None:  # it takes what the outputs were made of
        y, u = np.split(shown, [connect.shape[1]], axis=1)
        connect = np.block([[connect, np.zeros((len(connect), len(y)))],
                            [y + u @ connect, np.zeros((len(y), len(y)))]])  # fmt: skip
        given = np.vstack([given, u @ given])
        shown = np.hstack([np.zeros_like(y), np.eye(len(y)), np.zeros((len(y), len(connect)))])
        parts.append(last)
    if first is not None:
        count = given.shape[1]
        shown = np.insert(shown, [connect.shape[1]] * count, 0.0, axis=1)
        shown = np.hstack([shown, np.zeros((len(shown), count))])
        connect = np.block([[connect, given], [np.zeros((count, connect.shape[1] + count))]])
        given = np.vstack([np.zeros_like(given), np.eye(count)])
        parts.append(first)
    return reconnected(diagram, parts, (connect, given, shown), diagram.dt)


def rebuilt(diagram: ct.InterconnectedSystem, change: Callable[[Any], Any], dt: object) -> Any:
    """Return a diagram of changed blocks, connected as those of another one are."""
    parts = [
        rebuilt(part, change, dt) if isinstance(part, ct.InterconnectedSystem) else change(part)
        for part in diagram.syslist
    ]
    maps = (diagram.connect_map.copy(), diagram.input_map.copy(), diagram.output_map.copy())
    return reconnected(diagram, parts, maps, dt)
