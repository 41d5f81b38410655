"""The neural controllers of docs/data: both engines, and the networks against plain NumPy."""

import importlib.util

import numpy as np
import pytest
from places import ROOT

import nlctl

pytestmark = pytest.mark.slow  # loops of networks with up to 20,000 weights


@pytest.fixture(scope="module")
def ainncs():
    """The module beside the weights."""
    spec = importlib.util.spec_from_file_location("ainncs", ROOT / "docs" / "data" / "ainncs.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parted
@pytest.mark.parametrize("name", ["cruise control", "TORA", "unicycle", "pendulum"])
def test_machine_code_is_python_control(ainncs, name):
    """From one start, over the whole horizon, to tight tolerances."""
    case = ainncs.CASES[name]
    times, low = np.linspace(0, case.end, 21), case.box[0]
    start = {f"plant.x{k + 1}": value for k, value in enumerate(low)}
    tight = {"rtol": 1e-10, "atol": 1e-12}
    one, other = (
        nlctl.input_output_response(case.loop, times, 0, start, engine=engine, **tight)
        for engine in ("native", "python-control")
    )
    np.testing.assert_allclose(one.outputs, other.outputs, rtol=1e-7, atol=1e-7)


@pytest.mark.parted
@pytest.mark.parametrize("name", ["cruise control", "TORA", "unicycle", "pendulum"])
def test_no_corner_of_the_box_violates(ainncs, name):
    """As published: verified there, the pendulum from the box of the later year."""
    case = ainncs.CASES[name]
    sides = [sorted(set(ends)) for ends in zip(*case.box, strict=True)]
    corners = np.array(np.meshgrid(*sides)).reshape(len(sides), -1).T.astype(float)
    t, margin = case.runs(corners)
    assert margin[:, t >= case.begin].min() > 0


def test_the_pendulum_is_falsified_from_the_published_start(ainncs):
    case = ainncs.CASES["pendulum"]
    t, margin = case.runs(np.array([[1.2, 0.2]]))
    assert margin[0, t >= case.begin].min() < 0
