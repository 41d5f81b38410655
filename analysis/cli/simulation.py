"""One run of a loop that the command line was given, with what was set of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, kw_only=True)
class Simulated:
    """A loop, what was set of it, and its run.

    Attributes
    ----------
    loop : control.InputOutputSystem
    response : Response
    params, start : dict
        Parameters and initial states that were set.
    """

    loop: Any
    response: Any
    params: Mapping[str, Any]
    start: Mapping[str, float]


def simulated(
    name: str,
    settings: Sequence[str],
    inputs: Sequence[str],
    until: float,
    step: float,
    engine: str = "auto",
) -> Simulated:
    """Make the loop of a name, and run it under a bar."""
    from nlctl.response import input_output_response

    from .loops import assignments, input_values, named_loop, sampled_times
    from .terminal import progress_bar

    loop = named_loop(name)
    times = sampled_times(until, step, loop)
    params, start = assignments(loop, settings)
    u = input_values(loop, inputs)[:, None] + 0 * times
    with progress_bar(f"simulating {name}", until) as advance:
        reached = [0.0]

        def progress(t: float) -> None:
            advance(t - reached[0])
            reached[0] = t

        response = input_output_response(
            loop, times, u, start, params=params, engine=engine, progress=progress
        )
    return Simulated(loop=loop, response=response, params=params, start=start)
