"""Derivatives against python-control: exact ones are compared with differences of its equations.

A derivative is the smallest detail that an expression says of a function.  Along some directions
it is compared with differences of python-control's own rates and outputs.  Only differences that
agree with each other over six decades of steps and on both sides count: at a jump, at most kinks,
and where rounding hides what moves, they do not.

``v * (1 - sign(v) * z) if v != 0 else 0.0`` has another expression at v = 0 alone, a search for a
root ends before its first step where it begins at the root: of such a point no expression has the
derivative, and differences are taken, which is said.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from typing import Any

import control as ct
import numpy as np

from ..diagrams import supplied_blocks
from ..diagrams.points import rates_and_outputs
from ..errors import AuditError, InexactWarning
from ..responses.arguments import state_array
from ..sampling.system import happening
from .diagram.parameters import length
from .jacobians import inexact, jacobian, point_numbers
from .reading import Reading

_STEPS = 10.0 ** -np.array([4, 7, 10])  # relative to what is moved; absolute where that is 0
_BOTH_SIDES = np.concatenate([_STEPS, -_STEPS])
_ALIKE, _APART = 1e-3, 1e-2  # parts by which differences agree, and by which they contradict
_SEEN = 1e-9  # part of a value that differences show
_WAYS, _NEIGHBOURS, _NEAR = 2, 16, 1e-6  # directions; points around; how far these are
_Values = Callable[[np.ndarray], np.ndarray]  # of states and inputs, of shape (n + m,)


def audited_jacobian(
    reading: Reading, x0: object, u0: object, t: float, params: Mapping[str, Any] | None
) -> dict[str, np.ndarray]:
    """Return derivatives by states and inputs that differences do not contradict."""
    system = reading.system
    n, m, given = system.nstates or 0, system.ninputs or 0, reading.schedule.ninputs
    directions = np.eye(n + given + length(reading.program.layout), n + m)
    point = np.append(state_array(system, x0), point_numbers("u0 needs", m, f"'{system.name}'", u0))
    equations = reading.equations_with(reading.parameter_vector(params))

    def derivatives(point: np.ndarray) -> dict[str, np.ndarray]:
        return jacobian(reading, point[:n], point[n:], t, params, directions)

    found = derivatives(point)
    if not n + m or supplied_blocks(system) or inexact(equations, ("dx", "y")):
        return found
    values = rates_and_outputs(system, params)

    def at(point: np.ndarray) -> np.ndarray:
        try:
            with happening(), np.errstate(all="ignore"):
                return np.concatenate(values(t, point[:n], point[n:]))
        except Exception:  # past the end of what the blocks' functions are defined on
            return np.full(n + (system.noutputs or 0), np.nan)

    matrix = _checked(system, _matrix(found), (at, lambda near: _matrix(derivatives(near))), point)
    return found | dict(zip(("dx", "y"), np.split(matrix, [n]), strict=True))


def _matrix(found: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the derivatives of rates and outputs, shape (n + noutputs, n + m)."""
    return np.concatenate([found["dx"], found["y"]])


def _checked(
    system: ct.InputOutputSystem, matrix: np.ndarray, of: tuple[_Values, _Values], point: np.ndarray
) -> np.ndarray:
    """Return the derivatives `matrix` of values; `of` has these and derivatives elsewhere."""
    at, slopes = of
    sizes, chance = np.where(point == 0.0, 1.0, np.abs(point)), np.random.default_rng(0)
    seen = _SEEN * np.fmax(np.abs(at(point)), np.abs(matrix) @ sizes)
    ways = sizes * chance.uniform(0.5, 1.0, (_WAYS, sizes.size))
    if not any(_contradicted(matrix @ way, _measured(at, point, way), seen).any() for way in ways):
        return matrix
    around = point + _NEAR * sizes * chance.uniform(-1.0, 1.0, (_NEIGHBOURS, sizes.size))
    near, matrix = [slopes(one) for one in around], matrix.copy()
    for column, way in enumerate(np.diag(sizes)):
        measured = _measured(at, point, way)
        for row in map(int, np.flatnonzero(_contradicted(matrix @ way, measured, seen))):
            words = _in_words(system, row, column, matrix, measured[1] / sizes[column])
            there = zip(near, around, strict=True)
            if all(_contradicted(m @ way, _measured(at, one, way), seen)[row] for m, one in there):
                raise AuditError(f"{words}; nothing was returned: ct.linearize takes differences")
            warnings.warn(
                f"{words}, which are taken: the expressions have the slope of one side of a kink, "
                "or of this point alone",
                InexactWarning,
                stacklevel=5,
            )
            matrix[row, column] = measured[1, row] / sizes[column]
    return matrix


def _in_words(
    system: ct.InputOutputSystem, row: int, column: int, matrix: np.ndarray, measured: np.ndarray
) -> str:
    of = [f"the rate of '{x}'" for x in system.state_labels]
    of += [f"output '{y}'" for y in system.output_labels]
    by = [*system.state_labels, *system.input_labels]
    return (
        f"the derivative of {of[row]} of '{system.name}' by '{by[column]}' is "
        f"{matrix[row, column]:.6g} by its expressions and {measured[row]:.6g} by differences of "
        "python-control's values"
    )


def _measured(at: _Values, point: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return differences along a way, shape (steps, values); NaN where there is no value."""
    moved = np.array([at(point + step * way) for step in (0.0, *_BOTH_SIDES)])
    with np.errstate(all="ignore"):
        return (moved[1:] - moved[0]) / _BOTH_SIDES[:, None]


def _contradicted(slopes: np.ndarray, measured: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return of which values differences agree with each other, and not with the slopes."""
    with np.errstate(all="ignore"):
        size = np.maximum(np.abs(measured).max(axis=0), np.abs(slopes))
        apart = np.abs(measured - slopes).min(axis=0) > _APART * size
        return apart & (np.ptp(measured, axis=0) <= _ALIKE * size) & (size > seen)
