"""Derivatives against python-control: exact ones are compared with differences of its equations.

A derivative is the smallest detail that an expression says of a function.  Along some directions
it is compared with differences of python-control's own rates and outputs.  Only differences that
agree with each other over six decades of steps and on both sides count: at a jump, at most kinks,
and where rounding hides what moves, they do not.

``v * (1 - sign(v) * z) if v != 0 else 0.0`` has another expression at v = 0 alone, a search for a
root ends before its first step where it begins at the root: of such a point no expression has the
derivative, and differences are taken, which is said.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..diagrams import supplied_blocks
from ..diagrams.points import rates_and_outputs
from ..errors import AuditError
from ..expressions.staircases import contradicted
from ..responses.arguments import state_array
from ..sampling.system import happening
from ..upstream.systems import System
from .diagram.parameters import length
from .jacobians import inexact, jacobian, point_numbers, tell_of, tell_of_differences
from .reading import Reading

_STEPS = 10.0 ** -np.array([4, 7, 10])  # relative to what is moved; absolute where that is 0
_BOTH_SIDES = np.concatenate([_STEPS, -_STEPS])
_ALIKE, _APART = 1e-3, 1e-2  # parts by which differences agree, and by which they contradict
_SEEN = 1e-9  # part of a value that differences show
_WAYS, _NEIGHBOURS, _NEAR = 2, 16, 1e-6  # directions; points around; how far these are
_Values = Callable[[np.ndarray], np.ndarray]  # of a point's coordinates


def audited_jacobian(
    reading: Reading, x0: object, u0: object, t: float, params: Mapping[str, Any] | None
) -> dict[str, np.ndarray]:
    """Return derivatives by states and inputs that differences do not contradict."""
    system, p = reading.system, reading.parameter_vector(params)
    n, m, given = system.nstates or 0, system.ninputs or 0, reading.schedule.ninputs
    directions = np.eye(n + given + length(reading.program.layout), n + m)
    point = np.append(state_array(system, x0), point_numbers("u0 needs", m, f"'{system.name}'", u0))
    values = rates_and_outputs(system, params)
    return _audited(
        reading, p, point, [*system.state_labels, *system.input_labels],
        lambda near: jacobian(reading, near[:n], near[n:], t, p, directions),
        lambda near: values(t, near[:n], near[n:]),
    )  # fmt: skip


def audited_by_parameters(
    reading: Reading, names: Sequence[str], directions: np.ndarray,
    point: tuple[float, object, object], params: Mapping[str, Any] | None,
) -> dict[str, np.ndarray]:  # fmt: skip
    """Return derivatives by parameters that differences do not contradict."""
    system, (t, x0, u0) = reading.system, point
    x = state_array(system, x0)
    u = point_numbers("u0 needs", system.ninputs or 0, f"'{system.name}'", u0)
    start = directions.shape[0] - length(reading.program.layout)
    p = reading.parameter_vector(params)

    def with_values(now: np.ndarray) -> dict[str, Any]:
        return {**(params or {}), **dict(zip(names, now.tolist(), strict=True))}

    return _audited(
        reading, p, p @ directions[start:], names,
        lambda near: jacobian(
            reading, x, u, t, reading.parameter_vector(with_values(near)), directions
        ),
        lambda near: rates_and_outputs(system, with_values(near))(t, x, u),
    )  # fmt: skip


def _audited(
    reading: Reading, p: np.ndarray, point: np.ndarray, by: Sequence[str],
    derivatives: Callable[[np.ndarray], dict[str, np.ndarray]],
    values: Callable[[np.ndarray], tuple[np.ndarray, ...]],
) -> dict[str, np.ndarray]:  # fmt: skip
    """Return derivatives at a point by what its coordinates are."""
    system, equations = reading.system, reading.equations_with(p)
    tell_of_differences(reading, p)
    found = derivatives(point)
    if not point.size or supplied_blocks(system) or inexact(equations, ("dx", "y")):
        return found
    count = (system.nstates or 0) + (system.noutputs or 0)

    def at(near: np.ndarray) -> np.ndarray:
        try:
            with happening(), np.errstate(all="ignore"):
                return np.concatenate(values(near))
        except Exception:  # past the end of what the blocks' functions are defined on
            return np.full(count, np.nan)

    words = derivatives_in_words(system, by)
    both = at, lambda near: _matrix(derivatives(near))
    matrix, said = checked_derivatives(words, _matrix(found), both, point)
    for sentence in said:
        tell_of(sentence)
    return found | dict(zip(("dx", "y"), np.split(matrix, [system.nstates or 0]), strict=True))


def _matrix(found: Mapping[str, np.ndarray]) -> np.ndarray:
    """Return the derivatives of rates and outputs, shape (nstates + noutputs, coordinates)."""
    return np.concatenate([found["dx"], found["y"]])


def derivatives_in_words(
    system: System, by: Sequence[str], lines: Sequence[str] = ()
) -> list[list[str]]:
    """Return what is derived, rates, outputs and what arrives at delays, and by what."""
    of = [f"the rate of '{x}'" for x in system.state_labels or ()]
    of += [f"output '{y}'" for y in system.output_labels or ()]
    of += [f"what enters '{line}'" for line in lines]
    return [[f"the derivative of {a} of '{system.name}' by '{b}'" for b in by] for a in of]


def checked_derivatives(
    words: Sequence[Sequence[str]], matrix: np.ndarray, of: tuple[_Values, _Values],
    point: np.ndarray,
) -> tuple[np.ndarray, list[str]]:  # fmt: skip
    """Return the derivatives `matrix` of values, and of which differences are taken, in words."""
    # `of` are functions of a point: the values, and the derivatives there
    at, slopes = of
    sizes, chance = np.where(point == 0.0, 1.0, np.abs(point)), np.random.default_rng(0)
    seen = _SEEN * np.fmax(np.abs(at(point)), np.abs(matrix) @ sizes)
    ways = sizes * chance.uniform(0.5, 1.0, (_WAYS, sizes.size))
    if not any(_contradicted(matrix @ way, _measured(at, point, way), seen).any() for way in ways):
        return matrix, []
    around = point + _NEAR * sizes * chance.uniform(-1.0, 1.0, (_NEIGHBOURS, sizes.size))
    near, matrix, told = [slopes(one) for one in around], matrix.copy(), []
    for column, way in enumerate(np.diag(sizes)):
        measured = _measured(at, point, way)
        for row in map(int, np.flatnonzero(_contradicted(matrix @ way, measured, seen))):
            slope = measured[1, row] / sizes[column]
            said = f"{words[row][column]} is {matrix[row, column] + 0.0:.6g} by its expressions "
            said += f"and {slope:.6g} by differences"
            there = zip(near, around, strict=True)
            if all(_contradicted(m @ way, _measured(at, one, way), seen)[row] for m, one in there):
                raise AuditError(f"{said}; nothing was returned: ct.linearize takes differences")
            told.append(f"{said}, which are taken: the expressions have the slope of one side of a "
                        "kink, or of this point alone")  # fmt: skip
            matrix[row, column] = slope
    return matrix, told


def _measured(at: _Values, point: np.ndarray, way: np.ndarray) -> np.ndarray:
    """Return differences along a way, shape (steps, values); NaN where there is no value."""
    moved = np.array([at(point + step * way) for step in (0.0, *_BOTH_SIDES)])
    with np.errstate(all="ignore"):
        return (moved[1:] - moved[0]) / _BOTH_SIDES[:, None]


def _contradicted(slopes: np.ndarray, measured: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Return of which values differences contradict the slopes along a way."""
    return contradicted(slopes, measured, seen, _ALIKE, _APART)
