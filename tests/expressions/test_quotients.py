"""Difference quotients: (q(v) - q(0)) / v as an expression without a division by v."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nlctl.expressions.arrays import scalar
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph, Untraceable, needed
from nlctl.expressions.quotients import difference_quotient
from nlctl.expressions.trace import trace

FUNCTIONS = {
    "a product": lambda x, v: (1 + 0.1 * np.cos(x)) * (1 + 0.2 * np.cos(v)) * v + x,
    "a square": lambda x, v: (x + v) * (x + v) - 3.0 * v,
    "a quotient": lambda x, v: (x + v) / (4.0 + x * x + v * v),
    "no v": lambda x, v: np.sin(x) * x + 0.0 * 1.0,
    "a negative": lambda x, v: -(x * v) - v * v * v,
}
number = st.floats(-3, 3)


def made(name):
    graph = Graph({"x": 2})
    x, v = (scalar(graph, graph.leaf("x", i, None)) for i in range(2))
    result = trace(graph, FUNCTIONS[name], lambda: (x, v))[0].only
    return graph, result, v.only


def at(exprs, x, v):
    found = evaluate_expressions(exprs, {"x": np.array([[x], [v]])})
    return [float(np.ravel(value)[0]) for value in found]


@pytest.mark.parametrize("name", FUNCTIONS)
@given(x=number, v=number)
def test_it_leads_from_0_to_v(name, x, v):
    """q(0) + v times the quotient is q(v)."""
    graph, result, variable = made(name)
    quotient = difference_quotient(graph, result, variable)
    (here, slope), (base,) = at([result, quotient], x, v), at([result], x, 0.0)
    assert abs(base + v * slope - here) < 1e-12 * (1 + abs(here) + abs(base))


@pytest.mark.parametrize("name", FUNCTIONS)
@given(x=number)
def test_at_0_it_is_the_derivative(name, x):
    """Where a division by v would have no value."""
    graph, result, variable = made(name)
    quotient = difference_quotient(graph, result, variable)
    one = graph.const(1.0)
    (tangent,) = tangents(graph, [result], lambda leaf: one if leaf is variable else None)
    slope = at([tangent], x, 0.0)[0] if tangent is not None else 0.0
    assert abs(at([quotient], x, 0.0)[0] - slope) < 1e-12 * (1 + abs(slope))


def test_what_is_multiplied_by_v_is_not_asked_for_its_own_quotient():
    """cos(v) v has the quotient cos v; cos v alone has none that is an expression."""
    graph = Graph({"x": 1})
    v = graph.leaf("x", 0, None)
    cosine = graph.op("cos", v)
    assert difference_quotient(graph, graph.op("mul", cosine, v), v) is cosine
    with pytest.raises(Untraceable, match="cos"):
        difference_quotient(graph, cosine, v)
    assert needed([cosine])
