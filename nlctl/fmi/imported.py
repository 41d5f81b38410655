"""An FMU as a block of a diagram."""

import os
import re
from collections.abc import Sequence
from typing import Any

import control as ct

from ..annotations import as_annotated
from ..arguments import number
from ..blocks import block
from ..equations import equation
from ..errors import ParameterError, UsageError
from ..params import param, record
from ..sampling.system import sampled
from .running import Described, Running, read_description


def in_model_exchange(of: Described, running: Running) -> Any:
    """Return a record with the equations of an FMU in Model Exchange."""
    n, names, fields = len(of.states), _identifiers(of.states), _identifiers(of.parameters)
    running.go_to(0.0, [float(v.start) for v in of.parameters])
    begins = dict(zip(names, running.states(), strict=True))

    def put(t: float, x: Any, u: Any, p: object) -> list[float]:
        values = [getattr(p, field) for field in fields]
        running.go_to(x[n], values)
        running.put(t, x[:n], u)
        return values

    def update(t: float, x: object, u: object, p: object) -> Any:
        put(t, x, u, p)
        return *running.rates(), 0.0

    def output(t: float, x: object, u: object, p: object) -> Any:
        put(t, x, u, p)
        return running.outputs()

    def guard(t: float, x: Any, u: object, p: object) -> Any:
        values = put(t, x, u, p)
        z = running.indicators()
        due = running.next[running.go_to(x[n], values)]
        return *z, *(-each for each in z), min(due - t, 1e9)

    def reset(t: float, x: Any, u: object, p: object) -> Any:
        values = [getattr(p, field) for field in fields]
        return running.event(x[n], t, x[:n], u, values)

    made = {f.__name__: staticmethod(equation(f)) for f in (update, output, guard, reset)}
    content = {
        **{
            field: param(float(v.start), unit=v.unit or "1", meaning=v.description or v.name)
            for field, v in zip(fields, of.parameters, strict=True)
        },
        "inputs": tuple(v.name for v in of.inputs), "outputs": tuple(v.name for v in of.outputs),
        "states": (*names, "inner_state"), "initial": begins,
        "feedthrough": bool(of.inputs and of.outputs),
        "__annotations__": dict.fromkeys(fields, float), "__module__": __name__, **made,
        "__doc__": f"The FMU '{of.path.name}' in Model Exchange.",
    }  # fmt: skip
    return record(type("ModelExchange", (), content))()


def in_co_simulation(of: Described, running: Running, name: str, dt: float) -> Any:
    """Return an FMU in Co-Simulation as a system in discrete time."""
    parameters = {v.name: float(v.start) for v in of.parameters}

    def values(params: Any) -> list[float]:
        return [params[key] for key in parameters]

    def update(t: float, x: Any, u: object, params: object) -> Any:
        return [running.step(x[0], u, values(params), dt)]

    def output(t: float, x: Any, u: object, params: object) -> Any:
        running.go_to(x[0], values(params))
        return list(running.outputs())

    return ct.nlsys(
        update, output, inputs=[v.name for v in of.inputs], outputs=[v.name for v in of.outputs],
        states=["inner_state"], params=parameters, dt=dt, name=name,
    )  # fmt: skip


def _identifiers(variables: Sequence[Any]) -> list[str]:
    """Return what a record calls variables, such as states or parameters."""
    identifiers: list[str] = []
    for variable in variables:
        identifier = re.sub(r"\W+", "_", variable.name).strip("_")
        identifier = f"p_{identifier}" if not identifier.isidentifier() else identifier
        identifiers.append(
            identifier if identifier not in identifiers else f"{identifier}_{len(identifiers)}"
        )
    return identifiers


@as_annotated
def FMU(  # noqa: N802 (it reads as a block's record, and is called as one)
    path: str | os.PathLike[str],
    name: str | None = None,
    *,
    kind: str | None = None,
    dt: float | None = None,
    start: float = 0.0,
    ignore_completed_steps: bool = False,
) -> ct.InputOutputSystem:
    """Make a block of an FMU, FMI 2.0 or 3.0, that FMPy runs.

    Opening one runs its library: do it with FMUs that you would run as a program.  A study file
    cannot name this function unless its user has trusted it.

    In Model Exchange its continuous states are the block's, its event indicators and event times
    are guards, and what it does at an event is the block's reset.  In Co-Simulation it is a sampled
    block: at each sample it makes a step with the inputs of then, and its outputs are those that
    the last step has led to.

    Parameters
    ----------
    path : str or path-like
        The file.
    name : str, optional
        Of the block; by default the model identifier.
    kind : {"ModelExchange", "CoSimulation"}, optional
        By default Model Exchange if the FMU has that.
    dt : float, optional
        Sampling time (s) of Co-Simulation; by default the step of its default experiment.
    start : float, optional
        When it begins (s): the first time of the runs.
    ignore_completed_steps : bool, optional
        In Model Exchange, take an FMU that by its description needs a report of each accepted step
        (`completedIntegratorStep`), which a block does not make: for those at which nothing
        happens there.  In FMI 2.0 all that do not mention it need one.

    Returns
    -------
    control.InputOutputSystem
        To be connected as any block; ``nlctl.input_output_response(..., engine="python-control")``
        runs it.  Its last state is the number of the inner state that the FMU is in.

    Raises
    ------
    ParameterError
        If there is no such file, it is not an FMU, or a number is out of its bounds.
    UnknownNameError
        If the kind is neither.
    UsageError
        If it is not supported: FMI 1.0, no library for this platform, inputs other than real
        numbers, arrays, states that cannot be kept, reports of accepted steps that it needs; or
        FMPy is not installed.

    Notes
    -----
    Every inner state that an event or a step leads to is kept as long as the block: a step that is
    repeated begins where it began.  Machine code refuses the block, and says that python-control
    takes over.

    Examples
    --------
    >>> ball = nlctl.FMU("BouncingBall.fmu")  # doctest: +SKIP
    >>> run = nlctl.input_output_response(
    ...     ball, [0, 1], engine="python-control"
    ... )  # doctest: +SKIP
    """
    start = number("FMU", "start", start)
    of = read_description(path, kind, ignore_completed_steps=ignore_completed_steps)
    name = str(name or of.own.modelIdentifier)
    running = Running(of, start)
    if of.kind == "ModelExchange":
        if dt is not None:
            raise ParameterError("FMU takes dt in Co-Simulation alone: leave it out")
        return block(in_model_exchange(of, running), name)
    if not of.keeps_states:
        raise UsageError(
            f"'{of.path.name}' cannot be a block: its state cannot be read and written "
            "(canGetAndSetFMUState)"
        )
    if dt is None:
        dt = getattr(of.whole.defaultExperiment, "stepSize", None)
        if dt is None:
            raise ParameterError(f"'{of.path.name}' says nothing of its step: give dt in s")
    return sampled(in_co_simulation(of, running, name, number("FMU", "dt", float(dt), above=0)))
