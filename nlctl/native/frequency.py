"""Frequency responses of diagrams with transport delays: exact, since no delay is approximated."""

from collections.abc import Mapping
from typing import Any

import control as ct
import numpy as np
from numpy.typing import ArrayLike

from ..annotations import as_annotated
from ..arguments import number, vector
from ..errors import ParameterError
from ..responses.arguments import checked_params, state_array
from ..upstream.systems import System
from .compiled import Compiled, as_compiled
from .cut_delays import CutDiagram, Derivatives
from .jacobians import tell_of, tell_of_differences

_WHO = "frequency_response"
_POINTS = 1000  # of frequencies that nobody has given
_SLOWER, _FASTER = 1e-3, 10.0  # than the slowest and the fastest of a diagram
_STILL = 1e-8  # 1/s, slower is an integrator


@as_annotated
def frequency_response(
    system: System | Compiled,
    omega: ArrayLike | None = None,
    *,
    at: Mapping[str, float] | Any = None,
    inputs: ArrayLike | None = None,
    t: float = 0.0,
    params: Mapping[str, Any] | None = None,
) -> ct.FrequencyResponseData:
    """Return the frequency response of a diagram around a point, its delays kept exactly.

        H(j w) = G_11 + G_12 Delta (I - G_22 Delta)^-1 G_21,    Delta = diag(exp(-j w tau_i))

    G is the linearization of the diagram with its delays cut: from its inputs and what leaves the
    delays to its outputs and what arrives there, with exact derivatives.

    Parameters
    ----------
    system : control.InputOutputSystem or Compiled
        A diagram in continuous time, or what `compile` made of it.
    omega : array_like of shape (k,), optional
        Frequencies (rad/s), increasing; by default 1000 from a thousandth of the slowest to ten
        times the fastest pole or delay.
    at : mapping, array_like or control.OperatingPoint, optional
        State around which the signals are small; `find_operating_point` finds one.
    inputs : array_like, optional
        Inputs there; 0 by default, or those of the operating point.
    t : float, optional
        Time (s), of equations that depend on it.
    params : mapping, optional
        Qualified parameters.

    Returns
    -------
    control.FrequencyResponseData
        For ``ct.bode_plot``, ``ct.nyquist_plot``, ``ct.stability_margins``; at a kink that of the
        side that the point belongs to.

    Raises
    ------
    CompileError, AlgebraicLoopError
        If the diagram cannot be compiled; if a delay varies.
    ParameterError, UnknownNameError
        If an argument is refused.
    UsageError
        If there are sampled blocks, by name.

    Warns
    -----
    InexactWarning
        If a function is called unchanged: its derivatives are differences, all others exact.

    Examples
    --------
    >>> wire = nlctl.block(nlctl.TransportDelay(inputs=("u",), outputs=("v",), delay=0.5), "wire")
    >>> lag = ct.ss(-1, 1, 1, 0, inputs="v", outputs="y", name="lag")
    >>> chain = nlctl.interconnect([wire, lag], inputs=["u"], outputs=["y"])
    >>> found = nlctl.frequency_response(chain, [1.0, 2.0])
    >>> bool(abs(found(1j) - np.exp(-0.5j) / (1 + 1j)) < 1e-15)
    True
    """
    checked_params(params)
    compiled = as_compiled(system, params)
    if not ct.isctime(compiled.system):
        raise ParameterError(
            f"{_WHO} needs a diagram in continuous time, and '{compiled.system.name}' has "
            f"dt = {compiled.system.dt}: ct.frequency_response(nlctl.linearize(diagram, x0)) has it"
        )
    cut = CutDiagram(_WHO, compiled, number(_WHO, "t", t), params)
    delays = cut.delays(_WHO)
    linear = _around(cut, at, inputs)
    w = _default(linear, delays) if omega is None else _checked(omega)
    return ct.FrequencyResponseData(
        np.moveaxis(_closed(cut, linear, delays, w), 0, -1), w,
        inputs=compiled.system.input_labels, outputs=compiled.system.output_labels,
        name=compiled.system.name, sysname=compiled.system.name,
    )  # fmt: skip


def _around(cut: CutDiagram, at: object, inputs: object) -> Derivatives:
    """Return the derivatives around a point."""
    if isinstance(at, ct.OperatingPoint):
        at, inputs = at.states, at.inputs if inputs is None else inputs
    x = state_array(cut.compiled.system, at)
    u = cut.inputs(_WHO, "inputs", inputs)
    derivatives, said = cut.checked(x, u, cut.leaving(x, u))
    for sentence in said:
        tell_of(sentence)
    tell_of_differences(cut.compiled, cut.p)
    return derivatives


def _checked(omega: object) -> np.ndarray:
    """Return the frequencies."""
    w = vector(_WHO, "omega", np.atleast_1d(omega) if np.isscalar(omega) else omega)
    if not w.size or w[0] < 0 or not np.all(np.diff(w) > 0):
        raise ParameterError(f"{_WHO} needs increasing omega >= 0 (rad/s), got {w[:4]}")
    return w


def _default(linear: Derivatives, delays: np.ndarray) -> np.ndarray:
    """Return frequencies around those of the poles and of the delays."""
    n = linear.rates.shape[0]
    found = np.append(np.abs(np.linalg.eigvals(linear.rates[:, :n])), 1.0 / delays)
    found = found[np.isfinite(found) & (found > _STILL)]
    least, most = (found.min(), found.max()) if found.size else (1.0, 1.0)
    return np.geomspace(least * _SLOWER, most * _FASTER, _POINTS)


def _closed(cut: CutDiagram, linear: Derivatives, delays: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return H(j w), shape (frequencies, outputs, inputs)."""
    n, m, lines = cut.n, cut.m, cut.lines
    B, below = linear.rates[:, n:], np.concatenate([linear.outputs, linear.arriving])
    s = 1j * w[:, None, None]
    with np.errstate(all="ignore"):  # a pole on the axis is infinite
        states = np.broadcast_to(linear.rates[:, :n], (w.size, n, n))
        G = below[:, :n] @ _solved(s * np.eye(n) - states, B) + below[:, n:]
        late = np.exp(-s[:, :, 0] * delays)[:, None, :]
        inside = np.eye(lines) - G[:, cut.noutputs :, m:] * late
        back = (G[:, : cut.noutputs, m:] * late) @ _solved(inside, G[:, cut.noutputs :, :m])
    return G[:, : cut.noutputs, :m] + back


def _solved(matrices: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solve linear equations, one after the other; where one has no solution it is infinite."""
    right = np.broadcast_to(right, (len(matrices), *right.shape[-2:]))
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        found = np.full(right.shape, complex(np.inf, np.nan))
        for k, (matrix, each) in enumerate(zip(matrices, right, strict=True)):
            if np.linalg.matrix_rank(matrix) == len(matrix):
                found[k] = np.linalg.solve(matrix, each)
        return found
