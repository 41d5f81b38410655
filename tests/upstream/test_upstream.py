"""python-control's own tests as a corpus: each run in machine code is the run they ask for."""

import collections
import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from numba.core import config

HERE = Path(__file__).parent
FILES = {  # calls that are equal at least, and refused at most: together 190 and 2
    "iosys": (71, 1),
    "interconnect": (1, 0),
    "nlsys": (20, 0),
    "timeresp": (34, 0),
    "statefbk": (14, 0),
    "trdata": (19, 0),
    "response": (0, 0),
    "stochsys": (31, 1),
}
# most of the time: once a week
LONG = ("iosys", "nlsys", "statefbk", "stochsys", "timeresp", "trdata", "response")
CASES = [pytest.param(name, marks=[pytest.mark.weekly] * (name in LONG)) for name in FILES]


def upstream_tests():
    """Return the folder of the tests that python-control's wheel holds, if it does."""
    folder = Path(importlib.util.find_spec("control").origin).parent / "tests"
    return folder if (folder / "conftest.py").exists() else None


@pytest.mark.upstream
@pytest.mark.skipif(upstream_tests() is None, reason="this python-control came without its tests")
@pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="nothing is compiled without JIT")
@pytest.mark.parametrize("name", CASES)
def test_runs_of_python_controls_own_tests(name, tmp_path):
    """Equal to 1e-6; the few that are refused say why."""
    calls = tmp_path / "calls.jsonl"
    calls.touch()
    paths = os.pathsep.join([str(HERE), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "NLCTL_CALLS": str(calls), "PYTHONPATH": paths}
    file = upstream_tests() / f"{name}_test.py"
    options = ["-p", "nlctl_beside_control", "-p", "no:cacheprovider", "-c", os.devnull]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", *options, "--rootdir", str(tmp_path), str(file)],
        env={**environment, "MPLBACKEND": "Agg"},
        capture_output=True,
        text=True,
        timeout=1500,
        cwd=tmp_path,
    )
    assert done.returncode in (0, 1), done.stdout[-2000:] + done.stderr[-2000:]
    told = [json.loads(line) for line in calls.read_text().splitlines()]
    counts = collections.Counter(call["kind"] for call in told)
    print(f"{name}_test.py: {dict(counts)}; {done.stdout.splitlines()[-1]}")
    for call in told:
        if call["kind"] == "refused":
            assert len(call["text"]) > 20
    equal, refused = FILES[name]
    assert counts["equal"] >= equal
    assert counts["refused"] <= refused
    bad = [call for call in told if call["kind"] in ("different", "error")]
    assert not bad, "\n".join(f"{c['test']}: {c['kind']}: {c['text']}" for c in bad)
