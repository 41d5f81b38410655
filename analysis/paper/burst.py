r"""Example 2 beyond the loss of its gain's sign: through the burst, and what follows.

Where the exact run is given up, v rises through so many periods of sin^2 v in a step that no
integrator follows it.  From there the loop is carried on in three ways.

1. *Averaged.*  While v sweeps through the ripple, the mean of 1 + gain_v sin^2 v moves the plant,
   1 + gain_v / 2; of the backlash the slope counts, its gap is small against v.  That leaves out
   what r changes by in one period of the ripple, which is small against r.
2. *By its integral.*  `nlctl.analysis.lyapunov.aftermath` bounds the peak and the place of rest
   whatever the gain does within its bounds, without the averaging.
3. *At rest.*  There N(zeta) is about -3e10 and zeta stands still, zeta' = r u / N.  The loop is
   then run as it is, with a constant N = -K; where K is large its signals no longer depend on K,
   which two values show.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from typing import Any

import control as ct
import numpy as np

from nlctl import native, paper
from nlctl.actuators import Gain
from nlctl.attributes import described_record
from nlctl.controllers import adaptive_neural
from nlctl.diagrams import state_names
from nlctl.equations import equation
from nlctl.response import input_output_response

from ..intervals.box import Box
from ..lyapunov.bounds.sector import sector
from ..lyapunov.loop.roles import Parts, read_parts
from ..lyapunov.nussbaum.aftermath import Aftermath, aftermath
from ..lyapunov.nussbaum.long_run import LONG_RUN_SIGNALS, LongRun

HELD_GAINS = (5e2, 1e3)  # K of N = -K: what both agree in is that of -3e10; steps grow as K^2
_BEAT = 20 * np.pi  # s; common period of the reference and of the disturbance
_LENGTH = 1e-3  # s; the burst lasts a tenth of it
_FINE, _PASSES = 0.02, 6  # steps of zeta between samples, reached by so many refinements
_DRAG = 1.0  # |c/eta|: c is about (lambda - a) r, a tenth of eta, while r is large


@described_record
class Burst:
    """Example 2 after its gain has lost its sign, by an averaged computation."""

    start: float  # Time (s) at which the exact run was given up and the averaged one begins.
    time: np.ndarray = field(repr=False)  # (m,): Since then (s).
    signals: Mapping[str, np.ndarray] = field(repr=False)  # zeta, e, r and u over `time`, averaged.
    bounds: Aftermath  # From the integral of N, for all gains within their bounds.
    # (k,): Since the end of `time` (s), over two common periods of reference and disturbance.
    late_time: np.ndarray = field(repr=False)
    # e over `late_time` by the constant K instead of \|N\|.
    late: Mapping[float, np.ndarray] = field(repr=False)

    @property
    def peaks(self) -> tuple[float, float]:
        """Largest \\|r\\| and \\|u\\|."""
        r, u = (float(np.max(np.abs(self.signals[name]))) for name in ("r", "u"))
        return r, u

    @property
    def rest(self) -> float:
        """The zeta at which it has ended."""
        return float(self.signals["zeta"][-1])

    @property
    def lasted(self) -> float:
        """Time (s) from the start until zeta is at rest, to a thousandth."""
        zeta = self.signals["zeta"]
        return float(self.time[np.flatnonzero(zeta < zeta[-1] - 1e-3)[-1]])

    @property
    def calm(self) -> float:
        """Largest \\|e\\| over `late_time`, of the largest K."""
        return float(np.max(np.abs(self.late[max(self.late)])))

    @property
    def apart(self) -> float:
        """How far the largest \\|e\\| of the other K are from `calm`, relative."""
        others = [float(np.max(np.abs(e))) for e in self.late.values()]
        return max(abs(e / self.calm - 1) for e in others)


def through_the_burst(run: LongRun) -> Burst | None:
    """Carry a run of Example 2 on through its burst."""
    if not np.isfinite(run.burst) or not run.last:
        return None
    exact, start = paper.example_2(), float(run.time[-1])
    last = dict(zip(state_names(exact), run.last, strict=True))
    parts = read_parts(exact)
    time, rows, state = _swept(native.compile(averaged(parts, start)), last)
    signals = {name: rows[name] for name in LONG_RUN_SIGNALS}
    late_time = np.linspace(0.0, 2 * _BEAT, 12_001)
    late = {
        K: _at_rest(native.compile(_with_gain(parts, start + time[-1], K)), state, late_time)
        for K in HELD_GAINS
    }
    return Burst(
        start=start,
        time=time,
        signals=signals,
        bounds=_bounds(parts, signals),
        late_time=late_time,
        late=late,
    )


def averaged(parts: Parts, start: float) -> ct.InterconnectedSystem:
    """Return Example 2 from a time on, with the mean of its ripple and its backlash as a slope."""
    plant, mean = parts.plant, 1 + parts.plant.gain_v / 2
    smooth = dataclasses.replace(
        plant, gain_mean=mean * plant.gain_mean, gain_x=mean * plant.gain_x, gain_v=0.0
    )
    return _shifted(parts, start, smooth, parts.law, actuator=Gain(k=parts.actuator.m_r))


def _with_gain(parts: Parts, start: float, K: float) -> ct.InterconnectedSystem:
    """Return Example 2 with N = -K, from a time on."""

    @equation
    def constant(zeta: float) -> float:
        return 0.0 * zeta - K

    return _shifted(parts, start, parts.plant, dataclasses.replace(parts.law, N=constant))


def _shifted(
    parts: Parts, start: float, plant: Any, law: object, **others: Any
) -> ct.InterconnectedSystem:
    """Return the loop with disturbance and reference as they are from `start` on."""
    reference: Any = parts.roles.spec("reference")
    phases = zip(reference.phases, reference.frequencies, strict=True)
    return paper.example_2(
        plant=dataclasses.replace(plant, d_phase=plant.d_phase + plant.d_frequency * start),
        reference=dataclasses.replace(reference, phases=tuple(p + w * start for p, w in phases)),
        controller=adaptive_neural(
            parts.order,
            filtered_error=parts.filtered_error,
            basis=parts.basis,
            weights=parts.weights,
            robust=parts.robust,
            law=law,
        ),
        **others,
    )


def _swept(
    loop: native.Compiled, start: Mapping[str, float]
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, float]]:
    """Run the averaged loop, sampled where zeta moves; return times, signals and the last state."""
    names = state_names(loop.system)
    x0 = np.array([start[name] for name in names])
    time = np.append(0.0, np.geomspace(1e-9, _LENGTH, 600))
    rows: dict[str, np.ndarray] = {}
    response: Any = None
    for _ in range(_PASSES):
        response = input_output_response(loop, time, 0, x0, rtol=1e-9, atol=1e-11)
        rows = dict(zip(response.output_labels, np.asarray(response.outputs), strict=True))
        wide = np.flatnonzero(np.abs(np.diff(rows["zeta"])) > _FINE)
        if not wide.size:
            break
        inside = [np.linspace(time[i], time[i + 1], 22)[1:-1] for i in wide]
        time = np.unique(np.concatenate([time, *inside]))
    last = dict(zip(names, np.asarray(response.states)[:, -1], strict=True))
    return response.time, rows, {name: float(x) for name, x in last.items()}


def _at_rest(loop: native.Compiled, start: Mapping[str, float], time: np.ndarray) -> np.ndarray:
    """Return e of the loop from a state on; its backlash starts anywhere."""
    x0 = np.array([start.get(name, 0.0) for name in state_names(loop.system)])
    response: Any = input_output_response(loop, time, 0, x0, rtol=1e-7, atol=1e-9)
    return np.asarray(response.outputs)[response.output_labels.index("e")]


def _bounds(parts: Parts, signals: Mapping[str, np.ndarray]) -> Aftermath:
    """Bound the burst for every x and v: G in its sector, k the slope of the backlash."""
    sides = dict.fromkeys((*parts.plant.states, "v"), (-np.inf, np.inf))
    G, k = sector(parts.plant, Box.of(**sides)), parts.actuator.m_r
    return aftermath(
        float(signals["zeta"][0]),
        parts.law.N,
        kG=(k * G.G_min, k * G.G_max),
        energy=0.5 * float(signals["r"][0]) ** 2,
        drag=_DRAG,
    )
