"""Complex numbers as pairs of expressions."""

from __future__ import annotations

import cmath
import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .. import arrays
from ..arrays import Computed, Special, Tracer, traced
from ..graph import Graph, Untraceable
from ..operators import elementwise, product, total
from .table import enter


class ComplexPair(Computed):
    """An array of complex numbers: the real and the imaginary parts."""

    def __init__(self, graph: Graph, real: object, imag: object) -> None:
        self.graph = graph
        self.real, self.imag = np_broadcast(graph, real, imag)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the array."""
        return self.real.shape

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return self.real.ndim

    def linear(self, function: Callable[[Tracer], Any]) -> ComplexPair:
        """Return what a linear function with real coefficients makes of both parts."""
        return ComplexPair(self.graph, function(self.real), function(self.imag))

    def operation(self, graph: Graph, name: str, operands: Sequence[Any]) -> Any:
        """Return an operation by its name."""
        if name not in _OPERATIONS:
            raise Untraceable(f"{name} of complex numbers")
        if name == "select":
            condition, *values = operands
            return _OPERATIONS[name](graph, condition, *(paired(graph, v) for v in values))
        return _OPERATIONS[name](graph, *(paired(graph, v) for v in operands))

    def conjugate(self) -> ComplexPair:
        """Return the conjugate complex numbers."""
        return ComplexPair(self.graph, self.real, elementwise(self.graph, "neg", self.imag))

    conj = conjugate

    def sum(self, axis: object = None) -> ComplexPair:
        """Return the sum."""
        return self.linear(lambda part: total(part, axis))

    def mean(self, axis: Any = None) -> ComplexPair:
        """Return the mean."""
        count = self.real.size if axis is None else self.shape[axis]
        return self.linear(lambda part: total(part, axis) / float(count))

    def __len__(self) -> int:
        return len(self.real)

    def __getitem__(self, key: object) -> ComplexPair:
        return self.linear(lambda part: part[key])

    def __setitem__(self, key: object, value: object) -> None:
        value = paired(self.graph, value)
        self.real[key], self.imag[key] = value.real, value.imag

    def __pow__(self, exponent: object) -> ComplexPair:
        if isinstance(exponent, float) and exponent:
            size = elementwise(self.graph, "power", _absolute(self.graph, self), exponent)
            angle = elementwise(self.graph, "mul", _angle(self.graph, self), exponent)
            return rect(self.graph, size, angle)
        if not isinstance(exponent, int) or abs(exponent) > 64:
            raise Untraceable("a power of complex numbers by something else than a number")
        if exponent < 0:
            return _div(self.graph, paired(self.graph, 1.0), self**-exponent)
        unity = paired(self.graph, 1.0)
        return functools.reduce(lambda a, _: _mul(self.graph, a, self), range(exponent), unity)

    def _text(self, *_: object) -> Any:
        raise Untraceable("a complex number instead of a real one")

    __bool__ = __float__ = __str__ = __repr__ = __format__ = _text


def np_broadcast(graph: Graph, real: object, imag: object) -> tuple[Tracer, Tracer]:
    """Return two arrays in one shape."""
    a, b = traced(graph, real), traced(graph, imag)
    if a.shape != b.shape:
        zero = elementwise(graph, "mul", 0.0, elementwise(graph, "add", a, b))
        a = elementwise(graph, "add", a, zero) if a.shape != zero.shape else a
        b = elementwise(graph, "add", b, zero) if b.shape != zero.shape else b
    return a, b


def holds_complex(value: object) -> bool:
    """Whether there are complex numbers in a value, or in a list or tuple."""
    if isinstance(value, list | tuple):
        return any(map(holds_complex, value))
    return isinstance(value, ComplexPair) or arrays.is_complex(value)


def paired(graph: Graph, value: object) -> ComplexPair:
    """Return numbers, arrays and lists as complex numbers."""
    if isinstance(value, ComplexPair):
        return value
    if isinstance(value, list | tuple):
        parts = [paired(graph, v) for v in value]
        return ComplexPair(graph, [p.real for p in parts], [p.imag for p in parts])
    if arrays.is_complex(value):
        array = np.asarray(value, dtype=complex)
        return ComplexPair(graph, np.real(array), np.imag(array))
    real = traced(graph, value)
    return ComplexPair(
        graph, real, elementwise(graph, "mul", 0.0, traced(graph, np.zeros(real.shape)))
    )


Special.of_complex = staticmethod(paired)


def _plus(graph: Graph, a: Tracer, b: Tracer) -> Tracer:
    """a + b with the sign of a zero, at which angles and roots jump: 0.0 changes that of -0.0."""
    for one, other in ((a, b), (b, a)):
        if _has_zeros(other):
            return elementwise(graph, "sub", one, elementwise(graph, "neg", other))
    return a + b


def _minus(graph: Graph, a: Tracer, b: Tracer) -> Tracer:
    """a - b with the sign of a zero."""
    return _plus(graph, elementwise(graph, "neg", b), a) if _has_zeros(a) else a - b


def _has_zeros(array: Tracer) -> bool:
    elements = list(array.values.flat)
    return all(e.op == "const" for e in elements) and any(e.data == 0.0 for e in elements)


def _mul(graph: Graph, a: ComplexPair, b: ComplexPair) -> ComplexPair:
    real = _minus(graph, a.real * b.real, a.imag * b.imag)
    return ComplexPair(graph, real, _plus(graph, a.real * b.imag, a.imag * b.real))


def paired_product(graph: Graph, a: object, b: object) -> ComplexPair:
    """Return the matrix product of complex numbers."""
    a, b = paired(graph, a), paired(graph, b)
    real = product(a.real, b.real) - product(a.imag, b.imag)
    return ComplexPair(graph, real, product(a.real, b.imag) + product(a.imag, b.real))


def _sqrt(graph: Graph, z: ComplexPair) -> ComplexPair:
    """The root with a real part that is not negative, by the larger of both parts."""
    op = functools.partial(elementwise, graph)
    half = (op("absolute", z.real) + _absolute(graph, z)) / 2.0
    large = op("sqrt", half)
    small = op("select", op("eq", large, 0.0), 0.0, op("absolute", z.imag) / (2.0 * large))
    right = op("ge", z.real, 0.0)
    real, imag = op("select", right, large, small), op("select", right, small, large)
    return ComplexPair(graph, real, op("copysign", imag, z.imag))


def _div(graph: Graph, a: ComplexPair, b: ComplexPair) -> ComplexPair:
    """By the size of the divisor, whose square may be too large or too small."""
    if _has_zeros(b.imag) and not any(e.data for e in b.imag.values.flat):
        return ComplexPair(graph, a.real / b.real, a.imag / b.real)
    size = _absolute(graph, b)
    top = _mul(graph, a, ComplexPair(graph, b.real / size, b.imag / size).conjugate())
    return ComplexPair(graph, top.real / size, top.imag / size)


def _exp(graph: Graph, z: ComplexPair) -> ComplexPair:
    half = elementwise(graph, "exp", z.real * 0.5)  # twice: e^710 is too large
    cos, sin = (elementwise(graph, f, z.imag) for f in ("cos", "sin"))
    return ComplexPair(graph, half * cos * half, half * sin * half)


def _log(graph: Graph, z: ComplexPair) -> ComplexPair:
    return ComplexPair(graph, elementwise(graph, "log", _absolute(graph, z)), _angle(graph, z))


def _guarded_log(graph: Graph, z: ComplexPair) -> ComplexPair:
    graph.guard(elementwise(graph, "ne", _absolute(graph, z), 0.0).only, ValueError)
    return _log(graph, z)


def _tanh(graph: Graph, z: ComplexPair) -> ComplexPair:
    tanh, tan, cosh = (elementwise(graph, f, v) for f, v in
                       (("tanh", z.real), ("tan", z.imag), ("cosh", z.real)))  # fmt: skip
    size = tanh * tanh * tan * tan + 1.0
    return ComplexPair(graph, tanh * (tan * tan + 1.0) / size, tan / cosh / cosh / size)


def _wave(graph: Graph, z: ComplexPair, names: Sequence[str], sign: float) -> ComplexPair:
    """Return a sine or a cosine, circular or hyperbolic, by those of both parts."""
    a, b, c, d = (elementwise(graph, f, v) for f, v in
                  zip(names, (z.real, z.imag) * 2, strict=True))  # fmt: skip
    return ComplexPair(graph, a * b, c * d * sign)


def _absolute(graph: Graph, z: ComplexPair) -> Tracer:
    return elementwise(graph, "hypot", z.real, z.imag)


def _angle(graph: Graph, z: ComplexPair) -> Tracer:
    return elementwise(graph, "arctan2", z.imag, z.real)


def _select(graph: Graph, condition: object, a: ComplexPair, b: ComplexPair) -> ComplexPair:
    parts = ((a.real, b.real), (a.imag, b.imag))
    return ComplexPair(graph, *(elementwise(graph, "select", condition, *p) for p in parts))


_OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": lambda g, a, b: ComplexPair(g, _plus(g, a.real, b.real), _plus(g, a.imag, b.imag)),
    "sub": lambda g, a, b: ComplexPair(g, _minus(g, a.real, b.real), _minus(g, a.imag, b.imag)),
    "mul": _mul,
    "div": _div,
    "neg": lambda g, a: ComplexPair(g, -a.real, -a.imag),
    "absolute": _absolute,
    "exp": _exp,
    "sqrt": _sqrt,
    "sin": lambda g, z: _wave(g, z, ("sin", "cosh", "cos", "sinh"), 1.0),
    "cos": lambda g, z: _wave(g, z, ("cos", "cosh", "sin", "sinh"), -1.0),
    "sinh": lambda g, z: _wave(g, z, ("sinh", "cos", "cosh", "sin"), 1.0),
    "cosh": lambda g, z: _wave(g, z, ("cosh", "cos", "sinh", "sin"), 1.0),
    "tanh": _tanh,
    "log": _log,
    "select": _select,
    "eq": lambda g, a, b: (a.real == b.real) & (a.imag == b.imag),
    "ne": lambda g, a, b: (a.real != b.real) | (a.imag != b.imag),
}


ComplexPair.__matmul__ = lambda self, other: paired_product(self.graph, self, other)  # type: ignore[attr-defined]
ComplexPair.__rmatmul__ = lambda self, other: paired_product(self.graph, other, self)  # type: ignore[attr-defined]


def complex_number(graph: Graph, real: object = 0.0, imag: object = 0.0) -> Any:
    """Return ``complex(real, imag)``."""
    if isinstance(real, ComplexPair):
        return real
    return ComplexPair(graph, real, imag)


def rect(graph: Graph, size: object, angle: object) -> ComplexPair:
    """Return ``cmath.rect``."""
    cos, sin = (elementwise(graph, f, angle) for f in ("cos", "sin"))
    return ComplexPair(
        graph, elementwise(graph, "mul", size, cos), elementwise(graph, "mul", size, sin)
    )


def _transform(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a discrete Fourier transform, by its matrices: of the real and imaginary parts."""

    def written(
        graph: Graph, values: object, n: object = None, axis: int = -1, norm: object = None
    ) -> Any:
        z = paired(graph, values)
        if z.ndim != 1 or not isinstance(n, int | None) or norm is not None or axis not in (0, -1):
            raise Untraceable("a Fourier transform with other arguments")
        parts = [(1.0, z.real), *([(1j, z.imag)] if holds_complex(values) else [])]
        whole = [(function(unit * np.eye(len(z)), n, axis=0), part) for unit, part in parts]
        of = lambda name: _sum_of_products(graph, name, whole)  # noqa: E731
        return ComplexPair(graph, of("real"), of("imag")) if whole[0][0].dtype == complex else (
            of("real")
        )  # fmt: skip

    return written


def _sum_of_products(graph: Graph, name: str, whole: Sequence[tuple[Any, Tracer]]) -> Any:
    matrices = [np.ascontiguousarray(getattr(matrix, name)) for matrix, _ in whole]
    terms = [product(traced(graph, m), part) for m, (_, part) in zip(matrices, whole, strict=True)]
    return functools.reduce(lambda a, b: a + b, terms)


for _function in (np.fft.fft, np.fft.ifft, np.fft.rfft, np.fft.irfft):
    enter([_function], _transform(_function))
enter([complex], complex_number)
enter([cmath.rect], rect)
enter([cmath.exp], lambda graph, z: _exp(graph, paired(graph, z)))
enter([cmath.log], lambda graph, z: _guarded_log(graph, paired(graph, z)))
enter([cmath.sqrt], lambda graph, z: _sqrt(graph, paired(graph, z)))
enter([cmath.phase], lambda graph, z: _angle(graph, paired(graph, z)))
enter(
    [cmath.polar],
    lambda graph, z: (_absolute(graph, paired(graph, z)), _angle(graph, paired(graph, z))),
)
