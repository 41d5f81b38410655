"""Python run with -OO has no docstrings and no assertions: everything imports, and runs alike."""

import subprocess
import sys

import pytest

EVERYTHING = """
import importlib, pkgutil
import nlctl, nlctl.analysis, nlctl.paper
for package in (nlctl, nlctl.analysis):
    for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
"""
RUN = """
import numpy as np
import nlctl
from nlctl.analysis.metrics import settling_time
times = np.linspace(0, 5, 501)
lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
y = nlctl.input_output_response(lag, times, 1.0).outputs
settled = settling_time(times, 1 - np.ravel(y), 0.05).hex()
"""


@pytest.mark.weekly
def test_a_run_has_the_same_numbers():
    """1 - y = exp(-t) is at 0.05 when t = ln 20; here modules are imported by other tests."""
    here: dict = {}
    exec(RUN, here)
    program = f"{EVERYTHING}{RUN}print(settled, __debug__)"
    told = subprocess.run(
        [sys.executable, "-OO", "-c", program], capture_output=True, text=True, check=True
    ).stdout.split()
    assert told == [here["settled"], "False"]
    assert float.fromhex(here["settled"]) == pytest.approx(2.9957, abs=1e-3)
