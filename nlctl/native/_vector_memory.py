"""What compiled code does with vectors besides arithmetic: memory, choices, elements, sums.

Each function is a few lines of NumPy, which plain Python runs, and beside it what the machine
does.  All but `load` and `store` take numbers as well.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types

from ._vector_type import Vector, cast, common_type, instruction, llvm_type

_INT = ir.IntType(64)


def load(array, start, width):
    """Return `width` numbers of an array from a flat position on."""
    return array.reshape(-1)[start : start + width].copy()


def store(array, start, vector):
    """Write a vector to a flat position of an array."""
    array.reshape(-1)[start : start + vector.size] = vector


def gather(array, start, step, width, count):
    """Return every step-th number of an array; beyond `count` they are 0."""
    vector = np.zeros(width)
    vector[:count] = array.reshape(-1)[start + step * np.arange(count)]
    return vector


def store_first(array, start, vector, count):
    """Write the first `count` numbers of a vector."""
    array.reshape(-1)[start : start + count] = vector[:count]


def repeated(value, width):
    """Return a vector of equal numbers."""
    return np.full(width, value)


def first(vector, count):
    """Return a vector with all but its first `count` elements set to 0."""
    return np.where(np.arange(vector.size) < count, vector, 0.0)


def total(vector):
    """Return the sum of a vector whose width is a power of two: halves onto each other."""
    while vector.size > 1:
        vector = vector[: vector.size // 2] + vector[vector.size // 2 :]
    return vector[0]


def select(condition, a, b):
    """Return `a` where the condition holds, otherwise `b`, element by element."""
    return np.where(condition, a, b)[()]


def any_true(condition):
    """Whether a condition holds for any element."""
    return bool(np.any(condition))


def element(vector, index):
    """Return one element."""
    return vector[index]


def with_element(vector, index, value):
    """Return a vector with one element replaced."""
    changed = vector.copy()
    changed[index] = value
    return changed


def power_of_two(n):
    """Return 2^n for whole numbers -1022 <= n <= 1023 given as floats; anything for others."""
    return np.ldexp(1.0, np.where(np.abs(n) < 1100, n, 0.0).astype(int))[()]


def muladd(a, b, c):
    """Return a b + c, rounded once where the processor has an instruction for it."""
    return a * b + c


def _address(context: Any, builder: Any, kind: Any, array: Any, start: Any, target: ir.Type) -> Any:
    data = context.make_array(kind)(context, builder, array).data
    return builder.bitcast(builder.gep(data, [start]), target.as_pointer())


@instruction(load, prefer_literal=True)
def _load(typing_context, array, start, width):
    kind = Vector(width.literal_value)

    def generate(context, builder, sig, args):
        pointer = _address(context, builder, sig.args[0], args[0], args[1], llvm_type(kind))
        return builder.load(pointer, align=8)  # rows begin anywhere

    return kind(array, types.intp, width), generate


@instruction(store)
def _store(typing_context, array, start, vector):
    def generate(context, builder, sig, args):
        pointer = _address(context, builder, sig.args[0], args[0], args[1], args[2].type)
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.none(array, types.intp, vector), generate


@instruction(gather, prefer_literal=True)
def _gather(typing_context, array, start, step, width, count):
    kind, known, stride = Vector(width.literal_value), count.literal_value, step.literal_value

    def generate(context, builder, sig, args):
        value = ir.Constant(llvm_type(kind), [0.0] * kind.width)
        for i in range(known):
            place = builder.add(args[1], _INT(i * stride))
            source = _address(context, builder, sig.args[0], args[0], place, ir.DoubleType())
            value = builder.insert_element(value, builder.load(source), _INT(i))
        return value

    return kind(array, types.intp, step, width, count), generate


@instruction(store_first, prefer_literal=True)
def _store_first(typing_context, array, start, vector, count):
    known = count.literal_value

    def generate(context, builder, sig, args):
        for i in range(known):
            place = builder.add(args[1], _INT(i))
            target = _address(context, builder, sig.args[0], args[0], place, ir.DoubleType())
            builder.store(builder.extract_element(args[2], _INT(i)), target)
        return context.get_dummy_value()

    return types.none(array, types.intp, vector, count), generate


@instruction(repeated, prefer_literal=True)
def _repeated(typing_context, value, width):
    kind = Vector(width.literal_value)

    def generate(context, builder, sig, args):
        return cast(context, builder, args[0], sig.args[0], kind)

    return kind(value, width), generate


@instruction(first, prefer_literal=True)
def _first(typing_context, vector, count):
    known = count.literal_value

    def generate(context, builder, sig, args):
        zero = ir.Constant(args[0].type, [0.0] * vector.width)
        order = [i if i < known else vector.width + i for i in range(vector.width)]
        mask = ir.Constant(ir.VectorType(ir.IntType(32), vector.width), order)
        return builder.shuffle_vector(args[0], zero, mask)

    return vector(vector, count), generate


@instruction(total)
def _total(typing_context, vector):
    def generate(context, builder, sig, args):
        value, width = args[0], vector.width
        while width > 1:
            width //= 2
            parts = []
            for begin in (0, width):
                order = list(range(begin, begin + width))
                mask = ir.Constant(ir.VectorType(ir.IntType(32), width), order)
                parts.append(builder.shuffle_vector(value, value, mask))
            value = builder.fadd(*parts)
        return builder.extract_element(value, _INT(0))

    return types.float64(vector), generate


@instruction(select)
def _select(typing_context, condition, a, b):
    kind = common_type(a, b) or types.boolean
    if isinstance(condition, Vector):
        kind = Vector(condition.width)
        if all(isinstance(k, types.Boolean) or getattr(k, "truth", False) for k in (a, b)):
            kind = condition

    def generate(context, builder, sig, args):
        pairs = zip(args[1:], sig.args[1:], strict=True)
        return builder.select(args[0], *(cast(context, builder, v, k, kind) for v, k in pairs))

    return kind(condition, a, b), generate


@instruction(any_true)
def _any_true(typing_context, condition):
    if not isinstance(condition, Vector):
        return condition(condition), lambda context, builder, sig, args: args[0]

    def generate(context, builder, sig, args):
        bits = ir.IntType(condition.width)
        return builder.icmp_unsigned("!=", builder.bitcast(args[0], bits), bits(0))

    return types.boolean(condition), generate


@instruction(element)
def _element(typing_context, vector, index):
    if not isinstance(vector, Vector):
        return vector(vector, index), lambda context, builder, sig, args: args[0]

    def generate(context, builder, sig, args):
        return builder.extract_element(args[0], args[1])

    return types.float64(vector, types.intp), generate


@instruction(with_element)
def _with_element(typing_context, vector, index, value):
    def generate(context, builder, sig, args):
        return builder.insert_element(args[0], args[2], args[1])

    return vector(vector, types.intp, types.float64), generate


@instruction(power_of_two)
def _power_of_two(typing_context, n):
    def generate(context, builder, sig, args):
        real = args[0].type
        count = getattr(real, "count", 1)
        whole = ir.VectorType(_INT, count) if count > 1 else _INT

        def repeated(kind, value):
            return ir.Constant(kind, [value] * count if count > 1 else value)

        # The last bits of 1.5 * 2^52 + k are those of the integer k.
        shifted = builder.fadd(args[0], repeated(real, 1.5 * 2.0**52 + 1023))
        bits = builder.shl(builder.bitcast(shifted, whole), repeated(whole, 52))
        return builder.bitcast(bits, real)

    return n(n), generate


@instruction(muladd)
def _muladd(typing_context, a, b, c):
    kind = common_type(a, b, c)

    def generate(context, builder, sig, args):
        values = [cast(context, builder, v, k, kind) for v, k in zip(args, sig.args, strict=True)]
        return called(builder, "llvm.fmuladd", values)

    return kind(a, b, c), generate


def called(builder: Any, name: str, values: list[Any]) -> Any:
    """Call an LLVM intrinsic whose arguments and result are of one type."""
    kind = values[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    signature = ir.FunctionType(kind, [kind] * len(values))
    function = builder.module.declare_intrinsic(f"{name}.{suffix}", fnty=signature)
    return builder.call(function, values)
