"""A compiled diagram's plan in plain Python, and what its blocks' own functions make of it."""

import functools

import control as ct
import numpy as np

from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.diagram.program import count_switching_functions, memory
from nlctl.native.equations.blocks import equations
from nlctl.native.lower import lower
from nlctl.native.machine.routine import plain_functions
from nlctl.upstream.control_internals import outputs_now, rates_now


def interpreted(compiled):
    """Return ``rhs(t, x, u, p, dx, g, m)`` and ``out(t, x, u, p, y)``, without machine code."""

    @functools.cache
    def functions(parameters):
        p = np.frombuffer(parameters)
        found = equations(compiled.schedule, compiled.program.layout, p)
        lowered = lower(compiled.schedule, compiled.program, 1, found)
        return lowered.size, *plain_functions(lowered)

    def prepared(p):
        size, prepare, rhs, out, *_ = functions(p.tobytes())
        c = np.full((size, 1), np.nan)
        prepare(p[:, None], c)
        return c, rhs, out

    def column(values):
        return np.array(values, dtype=float).reshape(-1, 1)

    def right_hand_side(t, x, u, p, dx, g, m):
        c, rhs, _ = prepared(p)
        rhs(np.array([t]), column(x), column(u), c, dx[:, None], g[:, None], m[:, None])

    def outputs(t, x, u, p, y):
        c, _, out = prepared(p)
        out(np.array([t]), column(x), column(u), c, y[:, None])

    return right_hand_side, outputs


def by_blocks(compiled, t, x, u):
    """Return dx, g and y from the blocks' own functions, called in the order of the schedule."""
    read = compiled.schedule
    outputs, dx, found, committed = {}, np.zeros(x.size), [], []

    def combined(combination):
        ways = ((u if s.block is None else outputs[s.block])[s.index] * gain
                for s, gain in combination.items())  # fmt: skip
        return sum(ways, 0.0)

    def inputs_of(node, unknown=()):
        return np.array([np.nan if j in unknown else combined(c)
                         for j, c in enumerate(node.inputs)])  # fmt: skip

    own = [slice(n.state_offset, n.state_offset + (n.system.nstates or 0)) for n in read.nodes]
    for i, unknown in zip(read.order, read.unknown, strict=True):
        node = read.nodes[i]
        missing = unknown if node.direct.any() else range(len(node.inputs))
        outputs[i] = outputs_now(node.system, t, x[own[i]], inputs_of(node, missing))
    for node, states in zip(read.nodes, own, strict=True):
        inputs = inputs_of(node)
        dx[states] = rates_now(node.system, t, x[states], inputs) if node.system.nstates else 0.0
        for count, name, target in (
            (count_switching_functions(node), "switching", found),
            (len(memory(node)), "commit", committed),
        ):
            if count:
                function = getattr(node.system.spec, name)
                target += list(function(t, x[states], inputs, node.system._current_params))
    return dx, np.array([*found, *committed]), np.array([combined(c) for c in read.outputs])


def evaluated(function, size, t, x, u, p, *more):
    """What a program's function writes into its last argument."""
    result = np.full(size, np.nan)
    function(t, x, u, p, result, *more)
    return result


def compare(system, *, native=False, params=None, points=3, seed=0):
    """Right-hand side and outputs agree with python-control's at random points."""
    compiled = compile_diagram(system, params=params)
    rng = np.random.default_rng(seed)
    given = None if isinstance(system, ct.StateSpace) else params  # all linear: it has none
    rhs, out = compiled.native if native else interpreted(compiled)
    for _ in range(points):
        t, x, u = (
            rng.uniform(0, 5),
            rng.normal(size=system.nstates),
            rng.normal(size=system.ninputs),
        )
        p = compiled.parameter_vector(params)
        close = {"rtol": 1e-13, "atol": 1e-13}
        g, m = (np.empty(compiled.lowered.rows[name]) for name in "gm")
        for function, size, reference, more in (
            (rhs, system.nstates, system.dynamics, (g, m)),
            (out, system.noutputs, system.output, ()),
        ):
            found = evaluated(function, size, t, x, u, p, *more)
            np.testing.assert_allclose(found, reference(t, x, u, given), **close)
