"""Calls of a function of which only the address is known: compiled once for all programs."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from ...upstream.numba_internals import infer_global, make_intrinsic_template


def call_rhs(rhs, t, x, u, p, dx, g):
    """Evaluate a right-hand side: a plain function, in machine code the address of one."""
    rhs(t, x, u, p, dx, g)


def call_out(out, t, x, u, p, y):
    """Evaluate the outputs."""
    out(t, x, u, p, y)


def call_point(point, t, x, u, c):
    """Evaluate what derivatives at a point have in common."""
    point(t, x, u, c)


def call_along(along, t, x, u, c, v, dx):
    """Evaluate the derivative of a right-hand side along directions."""
    along(t, x, u, c, v, dx)


def _by_address(typing_context: Any, function: Any, *arrays: Any) -> Any:
    def generate(context, builder, sig, args):
        pointer = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * len(arrays)).as_pointer()
        given = [
            builder.bitcast(context.make_array(k)(context, builder, a).data, pointer)
            for k, a in zip(sig.args[1:], args[1:], strict=True)
        ]
        builder.call(builder.inttoptr(args[0], kind), given)
        return context.get_dummy_value()

    return types.none(function, *arrays), generate


def _register(function: Any, definition: Any) -> None:
    name = function.__name__
    template = make_intrinsic_template(function, definition, name, prefer_literal=False)
    infer_global(function, types.Function(template))


_register(call_rhs, lambda typing_context, f, t, x, u, p, dx, g: _by_address(
    typing_context, f, t, x, u, p, dx, g))  # fmt: skip
_register(call_out, lambda typing_context, f, t, x, u, p, y: _by_address(
    typing_context, f, t, x, u, p, y))  # fmt: skip
_register(call_point, lambda typing_context, f, t, x, u, c: _by_address(
    typing_context, f, t, x, u, c))  # fmt: skip
_register(call_along, lambda typing_context, f, t, x, u, c, v, dx: _by_address(
    typing_context, f, t, x, u, c, v, dx))  # fmt: skip
