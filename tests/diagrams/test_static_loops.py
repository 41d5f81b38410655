"""Circles of blocks: an algebraic loop is one of signals, not of blocks."""

import graphlib

import control as ct
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.errors import AlgebraicLoopError


def static(name, depends):
    """Return a block: output i is sin of 0.3 (i + 1) and of the inputs that it depends on."""

    def output(t, x, u, params):
        total = [0.3 * (i + 1.0) for i in range(len(depends))]
        for i, row in enumerate(depends):
            for j, used in enumerate(row):
                if used:
                    total[i] = total[i] + (0.4 + 0.2 * j) * u[j]
        return np.array([np.sin(v) for v in total])

    return ct.nlsys(None, output, inputs=len(depends[0]), outputs=len(depends), name=name)


@st.composite
def diagrams(draw):
    """Return a diagram of two to four blocks, and which outputs follow from which."""
    count = draw(st.integers(2, 4))
    sizes = [(draw(st.integers(1, 2)), draw(st.integers(1, 2))) for _ in range(count)]
    depends = [[[draw(st.booleans()) for _ in range(m)] for _ in range(p)] for m, p in sizes]
    outputs = [(b, i) for b, (_, p) in enumerate(sizes) for i in range(p)]
    wires, follows = [], {signal: set() for signal in outputs}
    for b, (m, p) in enumerate(sizes):
        for j in range(m):
            source = draw(st.sampled_from([None, *outputs]))
            if source is None:
                continue
            wires.append([f"b{b}.u[{j}]", f"b{source[0]}.y[{source[1]}]"])
            for i in range(p):
                if depends[b][i][j]:
                    follows[b, i].add(source)
    blocks = [static(f"b{b}", rows) for b, rows in enumerate(depends)]
    made = ct.interconnect(
        blocks, connections=wires or False, inputs=0, inplist=[],
        outlist=[f"b{b}.y[{i}]" for b, i in outputs], check_unused=False,
    )  # fmt: skip
    return made, follows


def has_loop(follows):
    try:
        graphlib.TopologicalSorter(follows).prepare()
    except graphlib.CycleError:
        return True
    return False


@settings(max_examples=many(40))
@given(diagrams())
def test_a_ring_of_blocks_is_an_algebraic_loop_where_its_signals_are(made):
    """Then it is refused; otherwise outputs are those that python-control finds."""
    diagram, follows = made
    if has_loop(follows):
        with pytest.raises(AlgebraicLoopError):
            nlctl.compile(diagram)
        return
    compiled = nlctl.compile(diagram)
    np.testing.assert_allclose(compiled.output(0.0, []), diagram.output(0.0, [], []), rtol=1e-14)


def test_an_input_that_nothing_depends_on_closes_no_loop():
    """y = sin(u[1]) in a circle with a gain of 2, through u[0]; it was a KeyError."""
    one = static("b0", [[False, True]])
    two = static("b1", [[True]])
    circle = ct.interconnect(
        [one, two], connections=[["b0.u[0]", "b1.y[0]"], ["b1.u[0]", "b0.y[0]"]],
        inplist=["b0.u[1]"], inputs=["r"], outlist=["b1.y[0]"], outputs=["y"],
    )  # fmt: skip
    found = nlctl.compile(circle).output(0.0, [], [0.7])
    np.testing.assert_allclose(found, circle.output(0.0, [], [0.7]), rtol=1e-15)
