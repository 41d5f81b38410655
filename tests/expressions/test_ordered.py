"""Comparisons that follow from others: never anything else than what they are."""

import itertools
import operator

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from nlctl.expressions.graph import Graph
from nlctl.expressions.trace import implied_by

ORDERS = {"lt": operator.lt, "le": operator.le, "gt": operator.gt, "ge": operator.ge}
NUMBERS = (1.0, 2.0, 3.0)
PLACES = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, np.nan)
COMPARED = st.tuples(st.sampled_from(sorted(ORDERS)), st.sampled_from(NUMBERS), st.booleans())


def written(graph, thing, order, number, turned):
    """Return a comparison, with the number on its left where it is turned."""
    args = (thing, graph.const(number))
    return graph.op(order, *(args[::-1] if turned else args))


def holds(value, order, number, turned):
    return bool(ORDERS[order](number, value) if turned else ORDERS[order](value, number))


@given(st.sampled_from("xt"), st.lists(COMPARED, max_size=4), COMPARED)
def test_what_follows_is_so(array, before, asked):
    """For each value that decides the others so, NaN among those of a state, never of the time."""
    graph = Graph({"x": 1, "t": 1})
    thing = graph.leaf(array, 0, None)
    places = [value for value in PLACES if array == "x" or value == value]
    for value in places:
        decisions = {written(graph, thing, *each): holds(value, *each) for each in before}
        found = implied_by(written(graph, thing, *asked), decisions)
        assert found is None or found == holds(value, *asked)
        alike = [
            holds(other, *asked)
            for other in places
            if all(holds(other, *each) == holds(value, *each) for each in before)
        ]
        simple = len(before) <= 1 and array == "t"
        assert found is not None or not simple or len(set(alike)) == 2


def test_thresholds_in_a_row_have_few_ways():
    """Of n windows of the time there are 2 n + 1 ways, not 3^n."""
    graph, ways = Graph({"t": 1}), set()
    time = graph.leaf("t", 0, None)
    windows = [(k, k + 0.5) for k in range(20)]
    for value in np.arange(-0.25, 20.0, 0.25):
        decisions = {}
        for order, number in itertools.chain(*((("ge", a), ("lt", b)) for a, b in windows)):
            condition = graph.op(order, time, graph.const(number))
            if implied_by(condition, decisions) is None:
                decisions[condition] = ORDERS[order](value, number)
        ways.add(tuple(decisions.items()))
    assert len(ways) == 2 * len(windows) + 1
