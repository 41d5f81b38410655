"""What a function may return as rates: python-control takes whatever NumPy makes floats of."""

import subprocess
import sys

import control as ct
import numpy as np
import pandas as pd
import pytest

import nlctl

RATES = {
    "series": lambda t, x, u, p: pd.Series([-x[0], x[0] - x[1]]),
    "frame": lambda t, x, u, p: pd.DataFrame([[-x[0], x[0] - x[1]]]),
    "one for both": lambda t, x, u, p: np.array([-x[0]]),
    "a number": lambda t, x, u, p: -x[0],
    "objects": lambda t, x, u, p: np.array([np.array(-x[0]), np.bool_(True)], dtype=object),
    "single": lambda t, x, u, p: np.array([-x[0], x[0] - x[1]], dtype=np.float32),
}


@pytest.mark.parted
@pytest.mark.parametrize("name", RATES)
def test_the_reference_takes_what_python_control_takes(name):
    block = ct.nlsys(RATES[name], None, states=2, inputs=0, outputs=2, name="block")
    times, tight = np.linspace(0, 1, 5), {"rtol": 1e-9, "atol": 1e-11}
    run = nlctl.input_output_response(block, times, 0, [1.0, 0.5], engine="python-control", **tight)
    exact = ct.input_output_response(block, times, 0, [1.0, 0.5], solve_ivp_kwargs=tight).states
    np.testing.assert_allclose(run.states, exact, atol=1e-6 if name == "single" else 1e-8)


def test_what_a_function_keeps_is_not_written_into():
    """Rates of a table that is read-only; what a run sets to 0 of them it sets in a copy."""
    table = np.array([1.0, -2.0])
    table.setflags(write=False)
    block = ct.nlsys(lambda t, x, u, p: table, None, states=2, inputs=0, outputs=2, name="block")
    run = nlctl.input_output_response(block, [0, 1], 0, [0.0, 0.0], engine="python-control")
    np.testing.assert_allclose(run.states[:, -1], [1.0, -2.0], atol=1e-12)


def test_a_forgotten_return_diverges():
    """Of None NumPy makes NaN, with which SciPy's RK45 looks for a first step for ever."""
    block = ct.nlsys(lambda t, x, u, p: None, None, states=2, inputs=0, outputs=2, name="block")
    with pytest.raises(nlctl.errors.DivergedError, match="'block' diverged"):
        nlctl.input_output_response(block, [0, 1], 0, [1.0, 0.5], engine="python-control")


def test_a_block_with_sizes_loads_nothing_of_the_engine():
    """In discrete time python-control runs it by itself."""
    script = """
import sys, control as ct, nlctl
lag = ct.ss(0.5, 1, 1, 0, dt=1)
run = nlctl.input_output_response(lag, [0, 1, 2], [1, 1, 1], engine="python-control")
print(float(run.outputs[-1]), any(name.startswith("nlctl.native") for name in sys.modules))
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1.5", "False"]
