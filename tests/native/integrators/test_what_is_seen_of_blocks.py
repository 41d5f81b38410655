"""What a block switches at, or is sharp in, is seen however the block is wired."""

import control as ct
import numpy as np
import pytest

import nlctl

W, AT = 1e-3, 2.3
METHODS = ["tsit5", "rodas5p", "auto"]
SEEN = {  # of q, halved, and what a run over 9 s integrates of them
    "sharp": (lambda q: np.exp(-(((q - AT) / W) ** 2)) / W, np.sqrt(np.pi)),
    "window": (lambda q: np.where(np.abs(q - AT) < W, 1 / W, 0.0), 2.0),
}


@pytest.mark.parted
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", SEEN)
def test_a_block_that_is_given_its_own_output(name, method):
    """v = f(q) / 2 + v / 2 is f(q)."""
    f, integral = SEEN[name]
    blocks = {
        "clock": ct.nlsys(lambda t, x, u, p: [1.0], lambda t, x, u, p: x[0], inputs=0,
                          outputs=["q"], states=1, name="clock"),
        "loop": ct.nlsys(None, lambda t, x, u, p: [0.5 * f(u[0]) + 0.5 * u[1]],
                         inputs=["q", "v"], outputs=["v"], name="loop"),
        "sum": ct.ss(0, 1, 1, 0, inputs="v", outputs="z", name="sum"),
    }  # fmt: skip
    compiled = nlctl.compile(nlctl.interconnect(blocks, outputs=["z"]), algebraic_loops="solve")
    run = nlctl.input_output_response(compiled, [0, 9], 0, method=method, squeeze=True)
    assert run.outputs[-1] == pytest.approx(integral, rel=1e-5)


@nlctl.record
class _Drained:
    """A tank that counts when its level passes 1/4 and 1/9, both of which are in one guard."""

    inputs, outputs, states, feedthrough = (), ("h",), ("h", "n"), False
    initial = {"h": 1.0}

    @nlctl.equation
    def update(t, x, u, p):
        return -np.sqrt(np.maximum(x[0], 0.0)), np.where(x[0] > 0.5, 0.0, 0.0)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @nlctl.equation
    def guard(t, x, u, p):
        return ((x[0] - 0.25) * (x[0] - 1 / 9),)

    @nlctl.equation
    def reset(t, x, u, p):
        return x[0], x[1] + 1.0


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_a_guard_with_two_levels_next_to_a_steep_rate(method):
    """h = (1 - t/2)^2: the guard falls at 1/4, which is t = 1."""
    tank = nlctl.block(_Drained(), "tank")
    run = nlctl.input_output_response(tank, [0, 1.9], method=method)
    assert run.states[1, -1] == 1.0
    guards = run.events[run.events["which"].str.startswith("guard")]
    np.testing.assert_allclose(guards["time"], [1.0], atol=1e-6)
