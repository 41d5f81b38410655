r"""Whether yd1, ..., ydn are the derivatives of yd, along a run.

The reference block itself is differentiated: with its own rates :math:`x' = f(t, x)`,

.. math:: \frac{d}{dt} y_d^{(k-1)} = \frac{d}{ds} g_{k-1}(t + s, x + s f(t, x)) \Big|_{s=0},

by central differences of order 8 with four steps, so that one fits whatever the frequencies are.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from nlctl.diagrams import Place
from nlctl.references import derivative_names
from nlctl.upstream.control_internals import outputs_now, rates_now

from .roles import declared
from .signals import Margin, equality

WEIGHTS = np.array([4 / 5, -1 / 5, 4 / 105, -1 / 280])  # of differences at 1, ..., 4 steps
_STEPS = (1e-1, 1e-2, 1e-3, 1e-4)  # s
SAMPLES = 120
_TOLERANCE = 1e-6  # relative to the largest value of a derivative
SHIFT = 0.381966  # of a sampling interval: corners of a function of time lie on the samples


def reference_margin(place: Place, time: np.ndarray, states: np.ndarray) -> Margin | None:
    """Return how far the reference's derivatives are from those of its own outputs.

    Shapes: `time` (m,), `states` (n, m).
    """
    names, block = declared(place, "outputs"), place.system
    order = sum(name in names for name in derivative_names(len(names))) - 1
    if order < 1 or block.ninputs:
        return None
    rows = [names.index(name) for name in derivative_names(order)]
    block_states = states[place.state_offset :][: block.nstates or 0]
    picked = np.unique(np.linspace(0, time.size - 2, SAMPLES).astype(int))
    times, outputs, rates = [], [], []
    for i in picked:
        shift = 0.0 if block.nstates else SHIFT * (time[i + 1] - time[i])
        t, x = float(time[i] + shift), block_states[:, i]
        here, slopes = outputs_now(block, t, x, np.zeros(0))[rows], _slopes(block, t, x, rows)
        far = np.abs(slopes - here[1:])
        best = np.argmin(np.where(np.isnan(far), np.inf, far), axis=0)
        times.append(t)
        outputs.append(here[1:])
        rates.append(slopes[best, np.arange(order)])
    return _worst(np.array(times), np.array(outputs), np.array(rates))


def _slopes(block: Any, t: float, x: np.ndarray, rows: list[int]) -> np.ndarray:
    """Return the derivatives of yd, ..., yd^(n-1) by each step, shape (steps, n)."""
    none = np.zeros(0)
    rate = rates_now(block, t, x, none) if block.nstates else none

    def along(s: float) -> np.ndarray:
        return outputs_now(block, t + s, x + s * rate, none)[rows[:-1]]

    with np.errstate(all="ignore"):
        return np.array([
            sum(w * (along(j * h) - along(-j * h)) for j, w in enumerate(WEIGHTS, 1)) / h
            for h in _STEPS
        ])  # fmt: skip


def _worst(t: np.ndarray, outputs: np.ndarray, rates: np.ndarray) -> Margin:
    """Return the equality for the derivative that is farthest off, relative to its size."""
    size = np.max(np.maximum(np.abs(outputs), np.abs(rates)), axis=0)
    size = np.where(size > 0, size, 1.0)
    k = int(np.argmax(np.max(np.nan_to_num(np.abs(outputs - rates), nan=np.inf) / size, axis=0)))
    return equality(
        "(yd)", "yd1, ..., ydn are the derivatives of yd", t, outputs[:, k], rates[:, k],
        float(size[k]), _TOLERANCE,
    )  # fmt: skip
