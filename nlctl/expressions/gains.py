"""Functions of python-control that compute gains, solve equations of matrices, make systems.

What they are made of asks for more than an equation may; what they return depends on the numbers
that they are given alone.
"""

from __future__ import annotations

_OF_NUMBERS = ("lqr", "dlqr", "lqe", "dlqe", "place", "place_acker", "place_varga", "acker",
               "care", "dare", "lyap", "dlyap", "ctrb", "obsv", "tf", "ss", "zpk", "tf2ss", "ss2tf",
               "ssdata", "tfdata", "c2d", "sample_system", "pade", "series", "parallel",
               "feedback", "poles", "zeros", "dcgain")  # fmt: skip


def computes_gains(function: object) -> bool:
    """Whether a function is one of these."""
    module = getattr(function, "__module__", None) or ""
    return (
        module.partition(".")[0] == "control" and getattr(function, "__name__", "") in _OF_NUMBERS
    )
