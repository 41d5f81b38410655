"""What is declared of jumps is compared as well: a planted defect in each of it is found."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.errors import AuditError
from nlctl.expressions.arrays import concatenated
from nlctl.native.diagram.program import count_switching_functions
from nlctl.native.equations import blocks as read_blocks
from nlctl.native.equations.reader import Reader

TIMES = np.linspace(0, 0.4, 5)


@nlctl.record
class Ball:
    """A ball above the ground; its height is the output."""

    inputs, outputs, states, feedthrough = (), ("u",), ("h", "v"), False
    initial = {"h": 1.0}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], -9.81

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def guard(t, x, u, p):
        """Where it falls on the ground."""
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def reset(t, x, u, p):
        """It loses a part of its speed."""
        return x[0], -0.8 * x[1]


def loop():
    """Return a ball whose height a gap and a relay look at."""
    gap, relay = nlctl.block(nlctl.Backlash(), "gap"), nlctl.block(nlctl.Relay(), "relay")
    return ct.interconnect(
        [nlctl.block(Ball(), "ball"), gap, relay],
        [["gap.u", "ball.u"], ["relay.u", "ball.u"]],
        outlist=["gap.v", "relay.v"],
        name="loop",
    )


def high(t, x, u, params):
    """Where the ball is at half its height."""
    return x[0] - 0.5


def run(system):
    return nlctl.input_output_response(system, TIMES, events={"half": high}, engine="native")


def scaled(kind, what):
    """Return what plants a factor in a part of what a method of the reader returns."""

    def plant(patch):
        right = getattr(Reader, kind)
        patch.setattr(Reader, kind, lambda self, i: what(self.blocks[i], right(self, i)))

    return plant


def scaled_watched(patch):
    right = read_blocks.trace
    patch.setattr(read_blocks, "trace", lambda *given: 1.01 * right(*given))


def declared(node, found):
    own = count_switching_functions(node)
    return concatenated(found.graph, [1.01 * found[:own], found[own:]])


def committed(node, found):
    own = count_switching_functions(node)
    return concatenated(found.graph, [found[:own], 1.01 * found[own:]])


DEFECTS = {
    "guard": (scaled("guards", lambda node, found: 1.01 * found), "ball: guard"),
    "reset": (scaled("resets", lambda node, found: 1.01 * found), "ball: reset of 'h'"),
    "switching": (scaled("events", declared), "(gap|relay): switching"),
    "commit": (scaled("events", committed), "(gap|relay): commit"),
    "watched": (scaled_watched, "half"),
}


@pytest.mark.parted
@pytest.mark.parametrize("defect", DEFECTS)
def test_a_planted_defect_is_found(defect, monkeypatch):
    """The rates and outputs are right, and what is located or jumps is not."""
    plant, named = DEFECTS[defect]
    plant(monkeypatch)
    with pytest.raises(AuditError, match=f"differ at '{named}.*' of block 'loop'"):
        run(loop())


def test_the_right_run_is_not_refused():
    """In both engines the ball is at half its height at the same time."""
    native, reference = run(loop()), nlctl.input_output_response(
        loop(), TIMES, events={"half": high}, engine="python-control"
    )  # fmt: skip
    times = [each.events.query("which == 'half'").time.to_numpy() for each in (native, reference)]
    np.testing.assert_allclose(times[0], np.sqrt(1 / 9.81), rtol=1e-6)
    np.testing.assert_allclose(times[1], times[0], rtol=1e-6)


def test_samples_next_to_resets_of_more_states_are_compared():
    """One number that is held, next to a ball whose two states are reset: h = 1 - g t^2 / 2."""
    constant = ct.nlsys(None, lambda t, x, u, p: [2.0], inputs=0, outputs=["c"], name="constant")
    loop = ct.interconnect(
        [nlctl.sampled(constant, 0.1), nlctl.block(Ball(), "ball")], inputs=[], inplist=[],
        outputs=["c", "u"],
    )  # fmt: skip
    run = nlctl.input_output_response(loop, TIMES, audit="every run")
    np.testing.assert_allclose(run.outputs, [0 * TIMES + 2, 1 - 9.81 / 2 * TIMES**2], atol=1e-9)
