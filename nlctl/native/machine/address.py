"""Addresses of arrays, and calls of functions by theirs, compiled once for all programs."""

from __future__ import annotations

import ctypes
import inspect
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from llvmlite import ir
from numba import types

from ...upstream.numba_internals import infer_global, make_intrinsic_template

_ANY = ctypes.c_char  # of any data


def data_address(array: np.ndarray) -> int:
    """Return where a contiguous array begins; one without elements begins nowhere."""
    if not array.size:
        return 0
    if not array.flags.writeable:
        return array.ctypes.data
    return ctypes.addressof(_ANY.from_buffer(cast(Any, array)))  # several times as fast


def by_address(function: Callable[..., Any]) -> Any:
    """Have machine code call an address where Python calls the function that is given first."""

    def definition(typing_context, address, *arrays):
        def generate(context, builder, sig, args):
            pointer = ir.DoubleType().as_pointer()
            kind = ir.FunctionType(ir.VoidType(), [pointer] * len(arrays)).as_pointer()
            given = [
                builder.bitcast(context.make_array(k)(context, builder, a).data, pointer)
                for k, a in zip(sig.args[1:], args[1:], strict=True)
            ]
            builder.call(builder.inttoptr(args[0], kind), given)
            return context.get_dummy_value()

        return types.none(address, *arrays), generate

    # numba takes a function's arguments one by one only if they are named
    signature = inspect.signature(function)
    first = inspect.Parameter("typing_context", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    definition.__signature__ = signature.replace(parameters=[first, *signature.parameters.values()])  # type: ignore[attr-defined]
    name = function.__name__
    template = make_intrinsic_template(function, definition, name, prefer_literal=False)
    infer_global(function, types.Function(template))
    return function


@by_address
def call_rhs(rhs, t, x, u, p, dx, g, m):
    """Evaluate a right-hand side: a plain function, in machine code the address of one."""
    rhs(t, x, u, p, dx, g, m)


@by_address
def call_out(out, t, x, u, p, y):
    """Evaluate the outputs."""
    out(t, x, u, p, y)


@by_address
def call_point(point, t, x, u, c):
    """Evaluate what derivatives at a point have in common."""
    point(t, x, u, c)


@by_address
def call_along(along, t, x, u, c, v, dx):
    """Evaluate the derivative of a right-hand side along directions."""
    along(t, x, u, c, v, dx)


@by_address
def call_expansion(expansion, t, x, u, v, c, k):
    """Evaluate the Taylor coefficients of the solution through a point."""
    expansion(t, x, u, v, c, k)


@by_address
def call_growth(growth, x, c, k, largest):
    """Evaluate the last of these coefficients over the tolerance."""
    growth(x, c, k, largest)


@by_address
def call_step(step, h, c, k, x, slope):
    """Evaluate the polynomials of the states at the end of a step."""
    step(h, c, k, x, slope)


@by_address
def call_judge(judge, h, x, x_new, slope, dx, c, k, largest):
    """Evaluate what a step lacks, over the tolerance."""
    judge(h, x, x_new, slope, dx, c, k, largest)


@by_address
def call_values(values, h, c, k, g):
    """Evaluate the polynomials of switching functions."""
    values(h, c, k, g)


@by_address
def call_enclosure(judge, x, o):
    """Judge boxes, see `nlctl.native.enclosures`: machine code at an address, and nothing else."""
    raise NotImplementedError
