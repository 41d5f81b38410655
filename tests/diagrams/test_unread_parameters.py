"""A parameter that nothing in a diagram can read is an error, what something may read is not."""

import control as ct
import numpy as np
import pytest

import nlctl
from nlctl.analysis.lyapunov import read_parts

TIMES = np.array([0.0, 0.1])


def loop(*more):
    """A dead zone in front of a lag, and what is behind it."""
    zone, lag = nlctl.block(nlctl.DeadZone(), "zone"), nlctl.block(nlctl.Lag(), "lag")
    lag = lag.copy(name="lag")
    lag.set_inputs(["v"])
    lag.set_outputs(["y"])
    outputs = more[-1].output_labels if more else ["y"]
    return ct.interconnect([zone, lag, *more], inputs=["u"], outputs=outputs, name="loop")


def third_party():
    """A block of one's own that may read any parameter."""

    def gained(t, x, u, params):
        return u * params.get("gain", 2.0)

    return ct.nlsys(None, gained, inputs="w", outputs="z", name="own")


RUNS = {
    "machine code": lambda d, p: nlctl.input_output_response(d, TIMES, 1.0, params=p),
    "python-control": lambda d, p: nlctl.input_output_response(
        d, TIMES, 1.0, params=p, engine="python-control"
    ),
    "compile": lambda d, p: nlctl.compile(d, params=p),
    "typeset": lambda d, p: nlctl.typeset(d, params=p),
    "compiled": lambda d, p: nlctl.compile(d).output(0.0, np.zeros(d.nstates or 0), [1.0], p),
}


@pytest.mark.parametrize("run", RUNS.values(), ids=RUNS)
@pytest.mark.parametrize("name", ["gain", "b_q[0]"])
def test_what_nothing_reads_is_refused(run, name):
    """Blocks of nlctl read their own parameters only, linear systems none, whatever is sampled."""
    linear = ct.ss(-1.0, 1.0, 1.0, 0.0, inputs="y", outputs="z", name="linear")
    held = nlctl.sampled(nlctl.block(nlctl.Gain(), "held"), 0.05)
    for diagram in (loop(), loop(linear), nlctl.block(nlctl.Gain(), "gain"), held):
        with pytest.raises(nlctl.errors.UnknownNameError, match=rf"unknown parameter '{name[:3]}"):
            run(diagram, {name: 1.0})


def test_the_proof_refuses_it_too():
    """Whatever reads a loop for the ledger, a certificate or constants reads its parts first."""
    with pytest.raises(nlctl.errors.UnknownNameError, match="unknown parameter 'gain'"):
        read_parts(nlctl.paper.example_1(), params={"gain": 1.0})


@pytest.mark.parametrize("engine", ["native", "python-control"])
def test_what_may_be_read_is_read(engine):
    """A function of one's own need not declare what it reads."""
    diagram = ct.interconnect([third_party()], inputs=["w"], outputs=["z"], name="both")
    run = nlctl.input_output_response(diagram, TIMES, 1.0, params={"gain": 3.0}, engine=engine)
    assert run.outputs.tolist() == [3.0, 3.0]
