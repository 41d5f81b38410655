"""Calls of `judge`, of which only the address is known."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types

from ...upstream.numba_internals import infer_global, make_intrinsic_template


def call_enclosure(judge, x, o):
    """Judge boxes: machine code at an address, and nothing else."""
    raise NotImplementedError


def _by_address(typing_context: Any, judge: Any, x: Any, o: Any) -> Any:
    def generate(context, builder, sig, args):
        pointer = ir.DoubleType().as_pointer()
        kind = ir.FunctionType(ir.VoidType(), [pointer] * 2).as_pointer()
        given = [
            builder.bitcast(context.make_array(k)(context, builder, a).data, pointer)
            for k, a in zip(sig.args[1:], args[1:], strict=True)
        ]
        builder.call(builder.inttoptr(args[0], kind), given)
        return context.get_dummy_value()

    return types.none(judge, x, o), generate


infer_global(
    call_enclosure,
    types.Function(
        make_intrinsic_template(call_enclosure, _by_address, "call_enclosure", prefer_literal=False)
    ),
)
