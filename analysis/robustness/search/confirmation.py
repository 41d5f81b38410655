"""A witness run again in other ways, before it is called confirmed."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pandas as pd

from nlctl.annotations import as_annotated
from nlctl.arguments import flag, of_type
from nlctl.attributes import described_record
from nlctl.errors import DivergedError
from nlctl.native import Status
from nlctl.response import input_output_response
from nlctl.responses.breaks import breaks_of, sampled_between, unsampled

from ..runs.experiment import Experiment, Prepared, evaluate, loop_of_row
from ..stl.spec import FAILED, margins, unfinished_margin
from ..uncertainty.space import checked_row
from .evaluation import as_table

TIGHTER = 100.0  # tolerances are divided by this
_OTHERS = ("tsit5", "rodas5p")  # the explicit integrator and the stiff one
_REFERENCE = "LSODA"  # SciPy's, in python-control
# how a run may end where its states leave the finite numbers
_BURST = (Status.DIVERGED.name, Status.STEP_TOO_SMALL.name)
_SAME = 0.01  # bursts are the same if their times differ by at most this part of the later one


@described_record(eq=False, made_by="confirm")
class Confirmation:
    """Whether a violation stays one in other integrations; printed, it is a sentence."""

    row: Mapping[str, Any]
    # One row per replay: engine, method, rtol, atol, status, time (s) reached and margin. The first
    # is as in the study.
    replays: pd.DataFrame
    reason: str  # Why it is not confirmed; empty if it is.

    @property
    def is_confirmed(self) -> bool:
        """Whether every replay violates the spec in the same way."""
        return not self.reason

    @property
    def spread(self) -> float:
        """Largest difference of two replays' margins."""
        return float(np.ptp(self.replays["margin"].to_numpy(dtype=float)))

    def __str__(self) -> str:
        if self.reason:
            return f"Not confirmed: {self.reason}."
        reached = self.replays["margin"].to_numpy(dtype=float)
        low, high = reached.min(), reached.max()
        if high <= -FAILED:
            return f"Confirmed by {len(self.replays)} integrations, none of which reaches its end."
        return (
            f"Confirmed by {len(self.replays)} integrations: margins from {low:.6g} to {high:.6g}, "
            f"which differ by {self.spread:.2g}."
        )


@as_annotated
def confirm(
    prepared: Prepared, row: Mapping[str, Any], *, python_control: bool = False
) -> Confirmation:
    """Run a row as in the study, and at 1/100 of its tolerances with either integrator.

    It is confirmed only if all violate the spec and end alike: all at the end of the experiment,
    or all in a burst at the same time, to 1 %.  A run that needed too many steps confirms nothing,
    nor does one that bursts where others do not.

    Parameters
    ----------
    prepared : Prepared
        The experiment, compiled: what `prepare` returns.
    row : mapping
        ``{name: value}``, such as `WorstCase.witness`.
    python_control : bool, optional
        Also run it in python-control, at the tighter tolerances: another engine, and other code of
        the diagram.

    Raises
    ------
    UnknownNameError, ParameterError
        If the row lacks a quantity, has another one, or a number is not finite.

    Examples
    --------
    >>> from nlctl.analysis.robustness import (
    ...     Experiment, Requirement, Space, Spec, Uncertain, always, confirm, in_band, prepare
    ... )
    >>> space = Space(quantities=(Uncertain(name="lag.T", bounds=(0.05, 0.5)),))
    >>> high = always(in_band("v", lower=0.9), start=0.3)
    >>> fast = Requirement(key="fast", formula=high, until=1.0)
    >>> experiment = Experiment(
    ...     space=space, build=lambda: nlctl.actuators.cascade({"lag": nlctl.Lag()}),
    ...     spec=Spec(requirements=(fast,)), timepts=np.linspace(0, 1, 101), inputs=1.0,
    ... )
    >>> found = confirm(prepare(experiment), {"lag.T": 0.4})
    >>> print(found.reason == "", bool((found.replays["margin"] < 0).all()))
    True True
    """
    study = of_type("confirm", "prepared", prepared, Prepared, "prepare(experiment)").experiment
    row = checked_row(study.space, row)
    python_control = flag("confirm", "python_control", python_control)
    tighter = replace(study, rtol=study.rtol / TIGHTER, atol=study.atol / TIGHTER)
    table = as_table(study.space, [row])
    replays = []
    for experiment in (study, *(replace(tighter, method=method) for method in _OTHERS)):
        ended = evaluate(replace(prepared, experiment=experiment), table).iloc[0]
        replays.append(_replay("native", experiment, *ended[["status", "time", "spec"]]))
    if python_control:
        replays.append(_in_python_control(prepared, tighter, row))
    table_of_replays = pd.DataFrame(replays)
    return Confirmation(row=dict(row), replays=table_of_replays, reason=_reason(table_of_replays))


def _replay(
    engine: str, experiment: Experiment, status: str, time: float, margin: float, method: str = ""
) -> dict[str, Any]:
    return {
        "engine": engine,
        "method": method or experiment.method,
        "rtol": experiment.rtol,
        "atol": experiment.atol,
        "status": status,
        "time": float(time),
        "margin": float(margin),
    }


def _in_python_control(
    prepared: Prepared, experiment: Experiment, row: Mapping[str, Any]
) -> dict[str, Any]:
    loop, given = loop_of_row(prepared, row)
    end = float(experiment.timepts[-1])
    replay = partial(_replay, "python-control", experiment, method=_REFERENCE)
    run = partial(
        input_output_response,
        loop.system,
        experiment.timepts,
        experiment.inputs,
        engine="python-control",
        method=_REFERENCE,
        rtol=experiment.rtol,
        atol=experiment.atol,
        initial_state=given["initial_state"],
        params=given["params"],
    )
    try:
        response = run()
        events = np.unique(response.events["time"].to_numpy(dtype=float))
        if unsampled(response.time, events).size:  # a pulse between two samples, say
            response = run(evaluation_times=sampled_between(response.time, events))
    except DivergedError as error:
        margin = unfinished_margin(error.time, end)
        return replay(Status.DIVERGED.name, error.time, margin)
    signals = dict(zip(loop.system.output_labels, np.atleast_2d(response.outputs), strict=True))
    margin = margins(experiment.spec, response.time, signals, breaks=breaks_of(response))["spec"]
    return replay(Status.OK.name, end, margin)


def _reason(replays: pd.DataFrame) -> str:
    """Return why a violation is not confirmed, or nothing."""
    runs = replays.to_dict("records")
    for run in runs:
        how = f"with {run['engine']}, method {run['method']}, rtol = {run['rtol']:.1g}"
        if run["status"] not in (Status.OK.name, *_BURST):
            return f"the run {how} ended with {run['status']} at {run['time']:.4g} s"
        if (run["status"] in _BURST) != (runs[0]["status"] in _BURST):
            return f"the run {how} ended with {run['status']}, the study's with {runs[0]['status']}"
        if np.isnan(run["margin"]):
            return f"the run {how} has no margin"
        if run["margin"] > 0:
            return f"the run {how} holds, margin {run['margin']:.4g}"
    times = replays["time"].to_numpy(dtype=float)
    if np.ptp(times) > _SAME * np.max(times):
        return f"the runs end at different times, from {np.min(times):.4g} to {np.max(times):.4g} s"
    return ""
