"""Equations of an FMU: in Model Exchange those of a record, in Co-Simulation a discrete system."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import control as ct

from ..equations import equation
from ..params import param, record
from .described import Described
from .running import Running


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
