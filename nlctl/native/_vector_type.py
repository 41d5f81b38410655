"""Vectors of floats as values of compiled code: one LLVM vector each, so SIMD by construction.

Arithmetic and comparisons act on all elements alike, and a number beside a vector is meant in
every element.  Where the compiler's own vectoriser would decide loop by loop, this decides once,
for any processor: LLVM splits a vector that is wider than the machine's.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from functools import partial
from typing import Any

from llvmlite import ir
from numba import types
from numba.core.typing.templates import infer_global, make_intrinsic_template
from numba.extending import lower_builtin, models, register_model, type_callable


class Vector(types.Type):
    """`width` numbers: float64, or the truth values of a comparison."""

    def __init__(self, width: int, truth: bool = False) -> None:
        self.width, self.truth = width, truth
        super().__init__(name=f"{'Truth' if truth else 'Vector'}({width})")


@register_model(Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager, fe_type):
        super().__init__(manager, fe_type, llvm_type(fe_type))


def llvm_type(kind: Any) -> ir.Type:
    """Return the LLVM type of a vector or number."""
    if isinstance(kind, Vector):
        return ir.VectorType(ir.IntType(1) if kind.truth else ir.DoubleType(), kind.width)
    return ir.IntType(1) if isinstance(kind, types.Boolean) else ir.DoubleType()


def common_type(*kinds: Any) -> Any:
    """Return the type of the result of float arithmetic, None if it is not ours."""
    if any(not isinstance(k, Vector | types.Number) or getattr(k, "truth", False) for k in kinds):
        return None
    widths = {k.width for k in kinds if isinstance(k, Vector)}
    if len(widths) > 1:
        return None
    return Vector(widths.pop()) if widths else types.float64


def cast(context: Any, builder: Any, value: Any, kind: Any, target: Any) -> Any:
    """Return `value` as a `target`: a number is repeated in every element."""
    if isinstance(kind, Vector):
        return value
    truth = isinstance(target, types.Boolean) or getattr(target, "truth", False)
    scalar = types.boolean if truth else types.float64
    value = context.cast(builder, value, kind, scalar)
    if not isinstance(target, Vector):
        return value
    if scalar is types.boolean:
        value = builder.trunc(value, ir.IntType(1)) if value.type.width > 1 else value
    wide = llvm_type(target)
    one = builder.insert_element(ir.Constant(wide, ir.Undefined), value, ir.IntType(32)(0))
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), target.width), [0] * target.width)
    return builder.shuffle_vector(one, ir.Constant(wide, ir.Undefined), zeros)


def instruction(function: Callable[..., Any], *, prefer_literal: bool = False) -> Any:
    """Say what machine code does for a plain function, as numba's ``intrinsic`` says it.

    An ``overload`` that calls an intrinsic would do, but each of its calls costs compile time.
    """

    def register(definition: Callable[..., Any]) -> Callable[..., Any]:
        name = function.__name__
        template = make_intrinsic_template(
            function, definition, name, prefer_literal=prefer_literal
        )
        infer_global(function, types.Function(template))
        return definition

    return register


def _binary(operation: Any, result: Any, build: Any, scalar: Any) -> None:
    """Teach numba an operator: vector with vector, and vector with scalar on either side."""

    @type_callable(operation)
    def typed(context):
        return result

    def lowered(context, builder, sig, args):
        truth = scalar is types.Boolean
        wide = Vector(sig.return_type.width, truth)
        both = zip(args, sig.args, strict=True)
        return build(builder, *(cast(context, builder, v, k, wide) for v, k in both))

    for pair in ((Vector, Vector), (Vector, scalar), (scalar, Vector)):
        lower_builtin(operation, *pair)(lowered)


def _number(a: Any, b: Any) -> Any:
    return common_type(a, b) if isinstance(a, Vector) or isinstance(b, Vector) else None


def _compared(a: Any, b: Any) -> Any:
    kind = _number(a, b)
    return None if kind is None else Vector(kind.width, truth=True)


def _truth(a: Any, b: Any) -> Any:
    truths = [k for k in (a, b) if isinstance(k, Vector) and k.truth]
    rest = [k for k in (a, b) if k not in truths]
    return truths[0] if truths and all(isinstance(k, types.Boolean) for k in rest) else None


for _name in ("add", "sub", "mul", "truediv"):
    _build = getattr(ir.IRBuilder, f"f{_name.removeprefix('true')}")
    _binary(getattr(operator, _name), _number, _build, types.Number)
for _name, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "=="}.items():
    _build = partial(lambda builder, a, b, sign: builder.fcmp_ordered(sign, a, b), sign=_sign)
    _binary(getattr(operator, _name), _compared, _build, types.Number)
_binary(operator.ne, _compared, lambda b, x, y: b.fcmp_unordered("!=", x, y), types.Number)
for _name in ("and_", "or_", "xor"):
    _binary(getattr(operator, _name), _truth, getattr(ir.IRBuilder, _name), types.Boolean)


@type_callable(operator.neg)
def _typed_neg(context):
    return lambda a: a if isinstance(a, Vector) and not a.truth else None


@lower_builtin(operator.neg, Vector)
def _neg(context, builder, sig, args):
    return builder.fneg(args[0])


@type_callable(operator.invert)
def _typed_invert(context):
    return lambda a: a if isinstance(a, Vector) and a.truth else None


@lower_builtin(operator.invert, Vector)
def _invert(context, builder, sig, args):
    return builder.not_(args[0])
