"""One run of a loop that the command line was given, with what was set of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from nlctl.attributes import described_record


@described_record
class Simulated:
    """A loop, what was set of it, and its run."""

    loop: Any
    response: Any
    params: Mapping[str, Any]  # Parameters and initial states that were set.
    start: Mapping[str, float]  # Parameters and initial states that were set.


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
