"""Whether the loop that a response is of obeys N(zeta) zeta' = r u."""

from __future__ import annotations

from typing import Any

import numpy as np

from nlctl.diagrams import known_system, state_names
from nlctl.diagrams.points import OF_RESPONSES, agree, rates_and_outputs
from nlctl.errors import DiagramError

from ...response_of_loop import check_response, check_shape, own_outputs, own_parameters
from ..loop.roles import read_parts
from .property import GainFunction

_SIGNALS = ("zeta", "r", "u")


def law_of_response(loop: Any, response: Any) -> GainFunction:
    """Return the Nussbaum function of the loop that a response is of.

    The response is compared with the loop, see `nlctl.analysis.response_of_loop`, and at its
    samples N(zeta) zeta' with r u, zeta' from the diagram's own right-hand side.
    """
    loop = known_system("slow_drift", loop)
    check_shape(loop, response, _SIGNALS)
    params = own_parameters(loop, response)
    parts = read_parts(loop, params=params)
    check_response(loop, response, params, _SIGNALS)
    if "zeta" not in parts.law.states or not hasattr(parts.law, "N"):
        raise DiagramError(
            f"slow_drift is about laws with a Nussbaum argument, got {type(parts.law).__name__}"
        )
    place = state_names(loop).index(f"{parts.paths['law']}.zeta")
    evaluate = rates_and_outputs(loop, params)
    for i, signals in own_outputs(loop, response, params):
        t, x = float(response.time[i]), np.asarray(response.states)[:, i]
        rate = float(evaluate(t, x, np.zeros(0))[0][place])
        a, b = parts.law.N(signals["zeta"]) * rate, signals["r"] * signals["u"]
        if not agree(a, b, OF_RESPONSES, relative=OF_RESPONSES):
            raise DiagramError(
                f"N(zeta) zeta' and r u of '{loop.name}' differ at t = {t:g} s: {a:.9g} and {b:.9g}"
            )
    return parts.law.N
