"""External inputs that are added to the plant's v: their bounds, and what they do to the split."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np
from flint import arb

from nlctl.errors import DiagramError, ParameterError
from nlctl.names import unknown
from nlctl.params import as_numbers

from ...intervals.arithmetic import Ball
from ...intervals.branch_and_bound import upper
from ..bounds.decomposition import Decomposition
from .roles import Roles

ADDED = "declared bounds of external inputs, times their gains"


def bound_of_inputs(roles: Roles, inputs: Mapping[str, float], loop: Any) -> float:
    """Return the bound of what external inputs add to v."""
    for name, value in inputs.items():
        if name not in roles.disturbances:
            raise unknown("external input", name, loop.input_labels, "that is added to v")
        number = as_numbers(value)
        if number is None or number.ndim or not 0 <= number < np.inf:
            raise ParameterError(f"certify needs a finite bound >= 0 of '{name}', got {value!r}")
    for name in roles.disturbances:
        if name not in inputs:
            raise DiagramError(
                f"external input '{name}' is added to the plant's v, and may be anything: declare "
                f"its bound, certify(loop, inputs={{'{name}': 0.1}}), or take it away"
            )
    return upper(
        sum((arb(abs(gain)) * inputs[name] for name, gain in roles.disturbances.items()), arb(0))
    )


def disturbed(split: Decomposition, bound: float) -> Decomposition:
    """Return the split of v = k u + (eps_u + w) with external inputs |w| <= bound."""
    if not bound:
        return split
    w = Ball(arb(bound))
    return dataclasses.replace(
        split,
        eps_low=-upper(w - split.eps_low),
        eps_high=upper(w + split.eps_high),
        how=f"{split.how}; external inputs add {bound:g} at most",
    )
