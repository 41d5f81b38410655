"""Assumptions 1 to 3, (10) and the compact set, as margins along a response."""

from __future__ import annotations

import numpy as np

from ..intervals.box import Box
from .loop.signals import Margin, Signals, inequality
from .premises import Premises


def assumptions(signals: Signals, given: Premises, box: Box, u_max: float) -> tuple[Margin, ...]:
    """Evaluate what the proof supposes, along a response of an observed loop."""
    t, split, u = signals.t, given.split, np.abs(signals["u"])
    eps_u = np.abs(split.eps_u(signals["u"], signals["v"]))
    psi = signals.vector("psi")[:, : given.W.size]
    error = np.abs(signals["g"] + given.forcing(t) - psi @ given.W)
    d, G = np.abs(signals["d"] - given.forcing(t)), signals["G"]
    sector = np.minimum(G - given.G_min, given.G_max - G)
    return (
        inequality("Omega", "x and v stay in the box", t, 0.0, _room(signals, box), 1.0),
        inequality("A1", "v = k u + eps_u, k_1 <= k <= k_2, |eps_u| <= eps_u*", t, eps_u,
                   split.eps_star),
        inequality("A1 range", "|u| stays where the split is proved", t, u, u_max),
        inequality("A2", "|d| <= d*", t, d, given.d),
        inequality("A3", "G_min <= F/v <= G_max, G_min > 0", t, 0.0,
                   np.minimum(sector, given.G_min), given.G_max),
        inequality("(10)", "|g - W^T psi| <= eps*", t, error, given.eps),
    )  # fmt: skip


def _room(signals: Signals, box: Box) -> np.ndarray:
    """Least distance to a face of the box, over half the side's length."""
    room = np.full(signals.t.size, np.inf)
    for name, (low, high) in zip(box.names, box.cell, strict=True):
        y, half = signals[name], 0.5 * (high - low) if np.isfinite(high - low) else 1.0
        distance = np.minimum(y - low, high - y) / (half if half > 0 else 1.0)
        room = np.minimum(room, distance)  # keeps NaN
    return room
