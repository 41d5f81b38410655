"""A pytest plugin: each run of python-control's own tests is repeated in nlctl's machine code.

Loaded by name (`-p nlctl_beside_control`) in a process of its own.  A line of JSON per call goes
to the file that NLCTL_CALLS names: the test, and "equal", "refused", "different" or "error".
"""

from __future__ import annotations

import inspect
import json
import os
import sys
import warnings
from typing import Any

import control
import numpy as np
import pytest

import nlctl
from nlctl.errors import UsageError

ORIGINAL = control.input_output_response
SIGNATURE = inspect.signature(ORIGINAL)
TIGHT = {"rtol": 1e-9, "atol": 1e-11}
CLOSE = 1e-6  # of the largest number of the response
TAKEN = {"sys", "timepts", "inputs", "initial_state", "params", "squeeze"}
ALIASES = {
    "T": "timepts",
    "U": "inputs",
    "X0": "initial_state",
    "u": "inputs",
    "x0": "initial_state",
}
_running = {"test": "", "inside": False}


def beside(*args: Any, **kwargs: Any) -> Any:
    """Return what python-control returns; before that, compare."""
    if not _running["inside"]:
        _running["inside"] = True
        try:
            tell(*verdict(args, kwargs))
        finally:
            _running["inside"] = False
    return ORIGINAL(*args, **kwargs)


def verdict(args: tuple, kwargs: dict) -> tuple[str, str]:
    """Compare a tight run of python-control with one in machine code."""
    try:
        given = SIGNATURE.bind(*args, **kwargs).arguments
        more = given.pop("kwargs", {})
        given.update({ALIASES.get(key, key): value for key, value in more.items()})
    except TypeError as error:
        return "not compared", str(error)
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            wanted = tight(given)
        except Exception as error:  # a test of what python-control refuses
            return "not compared", f"python-control raises {type(error).__name__}: {error}"
        try:
            found = native(given)
        except (UsageError, nlctl.errors.DivergedError) as error:
            return "refused", f"{type(error).__name__}: {error}"
        except Exception as error:
            return "error", f"{type(error).__name__}: {error}"
    return compared(wanted, found)


def tight(given: dict) -> Any:
    """Return python-control's response with small errors, and always as an object."""
    more = {key: value for key, value in given.items() if key in TAKEN - {"squeeze"}}
    system = more.pop("sys")
    if system.isctime():
        more["solve_ivp_kwargs"] = TIGHT | {"method": "LSODA"}
    return ORIGINAL(system, **more)


def native(given: dict) -> Any:
    """Return the response of the compiled system."""
    known = (*TAKEN, "t_eval", "solve_ivp_kwargs", "solve_ivp_method", "method", "transpose",
             "return_states", "return_x", "ignore_errors")  # fmt: skip
    for key in given:
        if key not in known:
            raise UsageError(f"this comparison does not know the argument {key}")
    inputs, start = given.get("inputs", 0.0), given.get("initial_state", 0.0)
    return nlctl.input_output_response(
        given["sys"], given["timepts"], inputs, start, params=given.get("params"), engine="native"
    )


def compared(wanted: Any, found: Any) -> tuple[str, str]:
    """Compare outputs and states at all times."""
    for part in ("y", "x"):
        if part == "x" and wanted.x is None:  # a system without states
            continue
        one, two = (np.asarray(getattr(run, part), dtype=float) for run in (wanted, found))
        if one.shape != two.shape:
            return "different", f"{part} has shape {two.shape}, python-control {one.shape}"
        scale = np.max(np.abs(one), initial=0.0, where=np.isfinite(one))
        apart = np.max(np.abs(one - two), initial=0.0)
        if not apart <= CLOSE * scale + 1e-9:
            return "different", f"{part} by {apart:.3g}, largest number {scale:.3g}"
    return "equal", ""


def tell(kind: str, text: str) -> None:
    with open(os.environ["NLCTL_CALLS"], "a") as file:
        file.write(json.dumps({"test": _running["test"], "kind": kind, "text": text}) + "\n")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    _running["test"] = item.name


for module in [m for name, m in sys.modules.items() if name.split(".")[0] == "control"]:
    if getattr(module, "input_output_response", None) is ORIGINAL:
        module.input_output_response = beside
