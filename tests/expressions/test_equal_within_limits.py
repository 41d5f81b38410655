"""A number and the same within limits: equal where NumPy says so, and located as orders are."""

from itertools import product

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph, needed

VALUES = [-np.inf, -2.0, -1.0, -0.0, 0.0, 1.0, 2.0, np.inf, np.nan]


def limited(graph):
    """Numbers z within limits l and h, in many ways, by their names."""
    z, low, high = (graph.leaf("x", k, None) for k in range(3))
    op, const = graph.op, graph.const
    return z, {
        "below": op("minimum", z, high),
        "above": op("maximum", low, z),
        "clip": op("minimum", op("maximum", z, low), high),
        "other order": op("maximum", op("minimum", high, z), low),
        "constants": op("minimum", op("maximum", z, const(-1.0)), const(1.0)),
        "other constants": op("maximum", op("minimum", z, const(-1.0)), const(1.0)),
        "twice": op("minimum", op("minimum", z, low), high),
    }


@pytest.mark.parametrize("name", ["eq", "ne"])
def test_it_is_what_numpy_says(name):
    """At all combinations of 9 numbers, limits in the wrong order, infinity and NaN among them."""
    graph = Graph({"x": 3})
    z, every = limited(graph)
    x = np.array(list(product(VALUES, repeat=3))).T
    for within in every.values():
        for pair in ((z, within), (within, z)):
            got, *values = evaluate_expressions([graph.op(name, *pair), *pair], {"x": x})
            expected = values[0] == values[1] if name == "eq" else values[0] != values[1]
            np.testing.assert_array_equal(got, expected)


def test_constant_limits_leave_orders_alone():
    graph = Graph({"x": 3})
    z, every = limited(graph)
    ops = {node.op for node in needed([graph.op("eq", z, every["constants"])])}
    assert ops == {"leaf", "const", "and", "le", "ge"}


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_where_it_begins_to_hold_is_located(method):
    """x = -2 + t within [-1, 1/2] from t = 1 to 2.5: as long as 1.5 s, whatever the steps are."""

    def update(t, x, u, params):
        return [1.0, 1.0 if x[0] == np.clip(x[0], -1.0, 0.5) else 0.0]

    block = ct.nlsys(update, None, states=2, inputs=0, outputs=2, name="block")
    run = nlctl.input_output_response(block, [0, 4.0], 0, [-2.0, 0.0], method=method)
    assert run.states[1, -1] == pytest.approx(1.5, abs=1e-9)
