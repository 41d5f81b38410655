"""SciPy's rotations, as unit quaternions of expressions: x, y, z, w."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..arithmetic import Arithmetic
from ..arrays import Special, Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise, product
from .table import WRITTEN

SMALL_ANGLE = 1e-3  # rad, below which SciPy takes a series
_AXES = "xyz"
_ORTHOGONAL = 1e-13  # what rounding leaves of a product of rotations, and less than SciPy asks for


class Turn(Special):
    """One rotation."""

    __array_ufunc__ = None
    __hash__ = None  # type: ignore[assignment]

    def __init__(self, graph: Graph, quat: Sequence[Any]) -> None:
        self.graph = graph
        self.quat = [traced(graph, q) for q in quat]

    def inv(self) -> Turn:
        """Return the inverse."""
        x, y, z, w = self.quat
        return Turn(self.graph, [-x, -y, -z, w])

    def __mul__(self, other: object) -> Turn:
        if not isinstance(other, Turn):
            raise Untraceable("a product of a rotation and something else")
        return Turn(self.graph, _composed(self.quat, other.quat))

    def as_quat(self, canonical: bool = False, *, scalar_first: bool = False) -> Tracer:
        """Return the quaternion."""
        if canonical:
            raise Untraceable("the canonical quaternion of a rotation")
        x, y, z, w = self.quat
        return traced(self.graph, [w, x, y, z] if scalar_first else [x, y, z, w])

    def as_matrix(self) -> Tracer:
        """Return the matrix."""
        x, y, z, w = self.quat
        return traced(
            self.graph,
            [
                [x * x - y * y - z * z + w * w, 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), -x * x + y * y - z * z + w * w, 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), -x * x - y * y + z * z + w * w],
            ],
        )

    def apply(self, vectors: object, inverse: bool = False) -> Tracer:
        """Return rotated vectors."""
        matrix = self.as_matrix().T if inverse else self.as_matrix()
        vectors = traced(self.graph, vectors)
        if vectors.ndim == 1:
            return product(matrix, vectors)
        return product(vectors, matrix.T)

    def magnitude(self) -> Tracer:
        """Return the angle (rad)."""
        op = functools.partial(elementwise, self.graph)
        return 2.0 * op("arctan2", self._length(), op("absolute", self.quat[3]))

    def _length(self) -> Tracer:
        x, y, z, _ = self.quat
        return elementwise(self.graph, "sqrt", x * x + y * y + z * z)

    def as_rotvec(self, degrees: bool = False) -> Tracer:
        """Return the axis, as long as the angle."""
        op = functools.partial(elementwise, self.graph)
        x, y, z, w = self.quat
        sign = op("select", op("lt", w, 0.0), -1.0, 1.0)
        angle = 2.0 * op("arctan2", self._length(), sign * w)
        least = x * x + y * y + z * z  # arcsin by its series: the root has no slope at 0
        square = 4.0 * least * (1.0 + least / 3.0 + 8.0 * least * least / 45.0)
        series = 2.0 + square / 12.0 + 7.0 * square * square / 2880.0
        scale = op("select", op("le", angle, SMALL_ANGLE), series, angle / op("sin", angle / 2.0))
        factor = scale * sign * (180.0 / math.pi if degrees else 1.0)
        return traced(self.graph, [factor * q for q in self.quat[:3]])

    def as_euler(self, seq: str, degrees: bool = False) -> Tracer:
        """Return Euler's angles; where two axes are parallel the third angle is 0."""
        angles = _euler_angles(self.graph, self.quat, seq)
        unit = 180.0 / math.pi if degrees else 1.0
        return traced(self.graph, [a * unit for a in angles])


def _composed(p: Sequence[Any], q: Sequence[Any]) -> list[Any]:
    x, y, z, w = p
    a, b, c, d = q
    return [
        w * a + d * x + y * c - z * b,
        w * b + d * y + z * a - x * c,
        w * c + d * z + x * b - y * a,
        w * d - x * a - y * b - z * c,
    ]


def _euler_angles(graph: Graph, quat: Sequence[Any], seq: str) -> list[Any]:
    """Return angles by the sums and differences of halves of the first and the third."""
    op = functools.partial(elementwise, graph)
    extrinsic = seq.islower()
    order = [_AXES.index(c) for c in (seq.lower() if extrinsic else seq.lower()[::-1])]
    i, j, k = order
    symmetric = i == k
    k = 3 - i - j if symmetric else k
    sign = (i - j) * (j - k) * (k - i) / 2
    x = list(quat)
    if symmetric:
        a, b, c, d = x[3], x[i], x[j], x[k] * sign
    else:
        a, b, c, d = x[3] - x[j], x[i] + x[k] * sign, x[j] + x[3], x[k] * sign - x[i]
    half_sum, half_diff = op("arctan2", b, a), op("arctan2", d, c)
    middle = 2.0 * op("arctan2", op("hypot", c, d), op("hypot", a, b))
    no_turn = op("le", op("absolute", middle), 1e-7)
    half_turn = op("le", op("absolute", middle - math.pi), 1e-7)
    first, third = half_sum - half_diff, half_sum + half_diff
    single = op("select", no_turn, 2.0 * half_sum, 2.0 * half_diff * (-1.0 if extrinsic else 1.0))
    locked = op("or", no_turn, half_turn)
    angles = [first, middle, third] if extrinsic else [third, middle, first]
    angles[0] = op("select", locked, single, angles[0])
    angles[2] = op("select", locked, 0.0, angles[2])
    if not symmetric:
        angles[2 if extrinsic else 0] = angles[2 if extrinsic else 0] * sign
        angles[1] = angles[1] - math.pi / 2
    return [_wrapped(op, v) for v in angles]


def _wrapped(op: Callable[..., Any], angle: Arithmetic) -> Any:
    angle = op("select", op("lt", angle, -math.pi), angle + 2 * math.pi, angle)
    return op("select", op("gt", angle, math.pi), angle - 2 * math.pi, angle)


def from_quat(graph: Graph, quat: object, *, scalar_first: bool = False) -> Turn:
    """Return the rotation of a quaternion, which is normalised."""
    parts = _numbers(graph, quat, 4)
    if scalar_first:
        parts = [*parts[1:], parts[0]]
    size = elementwise(graph, "sqrt", sum((q * q for q in parts[1:]), parts[0] * parts[0]))
    guard = elementwise(graph, "ne", size, 0.0).only
    if guard.op != "const":
        graph.guards.append(guard)
    return Turn(graph, [q / size for q in parts])


def _numbers(graph: Graph, values: object, count: int) -> list[Any]:
    array = traced(graph, values)
    if array.shape != (count,):
        raise Untraceable("several rotations at once")
    return list(array)


def from_rotvec(graph: Graph, rotvec: object, degrees: bool = False) -> Turn:
    """Return the rotation about an axis by its length."""
    op = functools.partial(elementwise, graph)
    parts = _numbers(graph, rotvec, 3)
    if degrees:
        parts = [v * (math.pi / 180.0) for v in parts]
    square = sum((v * v for v in parts[1:]), parts[0] * parts[0])
    angle = op("sqrt", square)  # without a slope at 0: there the square alone counts
    is_small = op("le", angle, SMALL_ANGLE)
    series = 0.5 - square / 48.0 + square * square / 3840.0
    scale = op("select", is_small, series, op("sin", angle / 2.0) / angle)
    cosine = 1.0 - square / 8.0 + square * square / 384.0
    cosine = op("select", is_small, cosine, op("cos", angle / 2.0))
    return Turn(graph, [*(scale * v for v in parts), cosine])


def from_euler(graph: Graph, seq: str, angles: object, degrees: bool = False) -> Turn:
    """Return the rotation of Euler's angles."""
    array = traced(graph, angles)
    values = [array] if not array.shape else list(array)
    if len(values) != len(seq) or any(v.shape for v in values):
        raise Untraceable("several rotations at once")
    rotation: list[Any] | None = None
    for axis, angle in zip(seq.lower(), values, strict=True):
        half = angle * ((math.pi / 180.0 if degrees else 1.0) / 2.0)
        quat: list[Any] = [traced(graph, 0.0)] * 3
        quat[_AXES.index(axis)] = elementwise(graph, "sin", half)
        quat.append(elementwise(graph, "cos", half))
        if rotation is None:
            rotation = quat
        else:
            rotation = _composed(quat, rotation) if seq.islower() else _composed(rotation, quat)
    return Turn(graph, rotation or [0.0, 0.0, 0.0, 1.0])


def from_matrix(graph: Graph, matrix: object) -> Turn:
    """Return the rotation of an orthogonal matrix; of another SciPy takes the nearest one."""
    m, op = traced(graph, matrix), functools.partial(elementwise, graph)
    if m.shape != (3, 3):
        raise Untraceable("several rotations at once")
    apart = op("absolute", product(m.T, m) - np.eye(3))
    for part in apart.elements().flat:
        graph.limited(graph.op("le", part, graph.const(_ORTHOGONAL)))
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    sizes = [m[0, 0], m[1, 1], m[2, 2], trace]
    quats = []
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        quat: list[Any] = [None, None, None, m[k, j] - m[j, k]]
        quat[i], quat[j] = 1.0 - trace + 2.0 * m[i, i], m[j, i] + m[i, j]
        quat[k] = m[k, i] + m[i, k]
        quats.append(quat)
    quats.append([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], 1.0 + trace])
    largest, chosen = sizes[0], quats[0]
    for size, quat in zip(sizes[1:], quats[1:], strict=True):
        above = op("gt", size, largest)
        largest = op("select", above, size, largest)
        chosen = [op("select", above, new, old) for new, old in zip(quat, chosen, strict=True)]
    return from_quat(graph, chosen)


def _identity(graph: Graph) -> Turn:
    """Return the rotation that changes nothing."""
    return Turn(graph, [0.0, 0.0, 0.0, 1.0])


@functools.cache
def enter_rotations() -> Any:
    """Enter the ways to make a rotation; return SciPy's class."""
    from scipy.spatial.transform import Rotation

    for maker in (from_quat, from_rotvec, from_euler, from_matrix, _identity):
        WRITTEN[Rotation, maker.__name__.strip("_")] = maker
    return Rotation


def turn_of(graph: Graph, rotation: Any) -> Turn:
    """Return a rotation of SciPy's, which is a constant."""
    quat = np.asarray(rotation.as_quat(), dtype=float)
    if quat.shape != (4,):
        raise Untraceable("several rotations at once")
    return Turn(graph, list(quat))
