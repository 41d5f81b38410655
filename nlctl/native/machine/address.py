"""Calls of a function of which only the address is known: compiled once for all programs."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from ...upstream.numba_internals import infer_global, make_intrinsic_template


def call_rhs(rhs, t, x, u, p, dx, g, m):
    """Evaluate a right-hand side: a plain function, in machine code the address of one."""
    rhs(t, x, u, p, dx, g, m)


def call_out(out, t, x, u, p, y):
    """Evaluate the outputs."""
    out(t, x, u, p, y)


def call_point(point, t, x, u, c):
    """Evaluate what derivatives at a point have in common."""
    point(t, x, u, c)


def call_along(along, t, x, u, c, v, dx):
    """Evaluate the derivative of a right-hand side along directions."""
    along(t, x, u, c, v, dx)


def call_expansion(expansion, t, x, u, v, c, k):
    """Evaluate the Taylor coefficients of the solution through a point."""
    expansion(t, x, u, v, c, k)


def call_growth(growth, x, c, k, largest):
    """Evaluate the last of these coefficients over the tolerance."""
    growth(x, c, k, largest)


def call_step(step, h, c, k, x, slope):
    """Evaluate the polynomials of the states at the end of a step."""
    step(h, c, k, x, slope)


def call_judge(judge, h, x, x_new, slope, dx, c, k, largest):
    """Evaluate what a step lacks, over the tolerance."""
    judge(h, x, x_new, slope, dx, c, k, largest)


def call_values(values, h, c, k, g):
    """Evaluate the polynomials of switching functions."""
    values(h, c, k, g)


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


_register(call_rhs, lambda typing_context, f, t, x, u, p, dx, g, m: _by_address(
    typing_context, f, t, x, u, p, dx, g, m))  # fmt: skip
_register(call_out, lambda typing_context, f, t, x, u, p, y: _by_address(
    typing_context, f, t, x, u, p, y))  # fmt: skip
_register(call_point, lambda typing_context, f, t, x, u, c: _by_address(
    typing_context, f, t, x, u, c))  # fmt: skip
_register(call_along, lambda typing_context, f, t, x, u, c, v, dx: _by_address(
    typing_context, f, t, x, u, c, v, dx))  # fmt: skip
_register(call_expansion, lambda typing_context, f, t, x, u, v, c, k: _by_address(
    typing_context, f, t, x, u, v, c, k))  # fmt: skip
_register(call_growth, lambda typing_context, f, x, c, k, largest: _by_address(
    typing_context, f, x, c, k, largest))  # fmt: skip
_register(call_step, lambda typing_context, f, h, c, k, x, slope: _by_address(
    typing_context, f, h, c, k, x, slope))  # fmt: skip
_register(call_judge, lambda typing_context, f, h, x, x_new, slope, dx, c, k, largest: _by_address(
    typing_context, f, h, x, x_new, slope, dx, c, k, largest))  # fmt: skip
_register(call_values, lambda typing_context, f, h, c, k, g: _by_address(
    typing_context, f, h, c, k, g))  # fmt: skip
