"""Diagrams of linear blocks alone: without inputs, with one state or output, without either."""

import control as ct
import numpy as np
import pytest

import nlctl


def lag(name, u, y, dt=0, pole=-1.0):
    return ct.ss([[pole]], [[1.0]], [[1.0]], [[0.0]], dt, name=name, inputs=[u], outputs=[y])


def gain(name, u, y, k=0.5):
    return ct.ss([], [], [], [[k]], name=name, inputs=[u], outputs=[y])


@pytest.mark.parametrize("outputs", [["y"], ["y", "u"], None, []])
def test_circle_of_two_lags(outputs):
    """x' = -x + z, z' = -z + x from (1, 0): x = (1 + exp(-2 t)) / 2."""
    loop = nlctl.interconnect([lag("a", "u", "y"), lag("b", "y", "u")], outputs=outputs)
    assert (loop.ninputs, loop.nstates) == (0, 2)
    assert loop.noutputs == (2 if outputs is None else len(outputs))
    t = np.linspace(0, 2, 21)
    run = nlctl.input_output_response(loop, t, 0.0, [1.0, 0.0])
    assert np.abs(run.states[0] - (1 + np.exp(-2 * t)) / 2).max() < 1e-6
    assert np.abs(loop.dynamics(0, np.array([1.0, 0.0]), []) - [-1, 1]).max() == 0.0


@pytest.mark.parametrize("law", [gain("b", "y", "u", -0.5), gain("b", "y", "u", 0.5)])
@pytest.mark.parametrize("names", [["y"], ["u"], ["y", "u"]])
def test_one_state(law, names):
    """x' = (k - 1) x: one state, in a circle with a static gain."""
    loop = nlctl.interconnect([lag("a", "u", "y"), law], outputs=names)
    t, k = np.linspace(0, 2, 21), law.D[0, 0]
    run = nlctl.input_output_response(loop, t, 0.0, [1.0])
    expected = {"y": np.exp((k - 1) * t), "u": k * np.exp((k - 1) * t)}
    for row, name in zip(np.atleast_2d(run.outputs), names, strict=True):
        assert np.abs(row - expected[name]).max() < 1e-6


def test_transfer_function():
    """1 / (s + 1) with -1 fed back; its block keeps its name, wherever it stands."""
    plant = ct.tf([1], [1, 1], name="plant", inputs=["u"], outputs=["y"])
    t = np.linspace(0, 2, 21)
    for parts in ([plant, gain("b", "y", "u", -1.0)], [gain("b", "y", "u", -1.0), plant]):
        loop = nlctl.interconnect(parts, outputs=["y"])
        run = nlctl.input_output_response(loop, t, 0.0, [1.0])
        assert np.abs(run.outputs - np.exp(-2 * t)).max() < 1e-6


@pytest.mark.parametrize("outputs", [["y"], ["y", "u"]])
def test_discrete_time(outputs):
    """x[n + 1] = x[n] / 2 + z[n], z[n + 1] = z[n] / 2 + x[n]: x + z grows 3/2 times."""
    parts = [lag("a", "u", "y", 1.0, 0.5), lag("b", "y", "u", 1.0, 0.5)]
    loop = nlctl.interconnect(parts, outputs=outputs)
    assert loop.dt == 1.0
    run = nlctl.input_output_response(loop, np.arange(6.0), 0.0, [1.0, 0.0])
    n = np.arange(6)
    assert np.allclose(run.states[0], (1.5**n + (-0.5) ** n) / 2, rtol=1e-14)


@pytest.mark.parametrize("outputs", [["y"], ["y", "u"]])
def test_static_gains_alone(outputs):
    """y = 2 u, u = y / 4: all signals are 0, and the circle is named when it is compiled."""
    loop = nlctl.interconnect(
        [gain("a", "u", "y", 2.0), gain("b", "y", "u", 0.25)], outputs=outputs
    )
    assert (loop.nstates, loop.noutputs) == (0, len(outputs))
    assert np.all(loop.output(0, [], []) == 0.0)
    with pytest.raises(nlctl.errors.AlgebraicLoopError, match=r"a\.y -> b\.u"):
        nlctl.compile(loop)


@pytest.mark.parametrize("outlist", ["a.y", None])
def test_lists_of_connections(outlist):
    """The same circle by lists."""
    loop = nlctl.interconnect(
        [lag("a", "u", "y"), lag("b", "v", "z")], [["a.u", "b.z"], ["b.v", "a.y"]],
        outlist=outlist,
    )  # fmt: skip
    t = np.linspace(0, 2, 21)
    run = nlctl.input_output_response(loop, t, 0.0, [1.0, 0.0])
    assert np.abs(run.states[0] - (1 + np.exp(-2 * t)) / 2).max() < 1e-6


@pytest.mark.parametrize("dt", [0, 0.1])
def test_with_an_input_it_stays_a_linear_system(dt):
    """Poles and zeros are asked of it as before."""
    loop = nlctl.interconnect([lag("a", "u", "y", dt)], inputs=["u"], outputs=["y"])
    assert isinstance(loop, ct.LinearICSystem)
    assert loop.poles() == [-1.0]
