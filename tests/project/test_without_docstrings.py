"""Python run with -OO has no docstrings and no assertions: everything imports, and runs alike."""

import subprocess
import sys

import pytest

PROGRAM = """
import importlib, pkgutil
import numpy as np
import nlctl, nlctl.analysis, nlctl.paper
from nlctl.analysis.metrics import settling_time
for package in (nlctl, nlctl.analysis):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
times = np.linspace(0, 5, 501)
lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
y = nlctl.input_output_response(lag, times, 1.0).outputs
print(settling_time(times, 1 - np.ravel(y), 0.05).hex(), __debug__)
"""


@pytest.mark.ci
def test_a_run_has_the_same_numbers():
    """1 - y = exp(-t) is at 0.05 when t = ln 20."""
    told = [
        subprocess.run(
            [sys.executable, *options, "-c", PROGRAM], capture_output=True, text=True, check=True
        ).stdout.split()
        for options in ((), ("-OO",))
    ]
    assert [debug for _, debug in told] == ["True", "False"]
    assert told[0][0] == told[1][0]
    assert float.fromhex(told[0][0]) == pytest.approx(2.9957, abs=1e-3)
