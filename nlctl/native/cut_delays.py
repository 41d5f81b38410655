"""A diagram whose transport delays are cut, for what is constant, and for what is small around it.

What leaves a delay is an input, and what arrives there an output.  Where all is constant both are
equal, and of small sines the one is the other times exp(-s tau).
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..errors import CompileError, UsageError
from .compiled import Compiled
from .derivative_audit import checked_derivatives, derivatives_in_words
from .diagram.parameters import length
from .diagram.schedule import signal_name
from .jacobians import differentiated_at, inexact, open_tangent, point_numbers
from .machine.evaluations import prepared_parameters

_STEPS, _CLOSE = 50, 1e-12  # of Newton's method, for what leaves delays


class Derivatives(NamedTuple):
    """How rates, outputs and what arrives at delays change with states, inputs and what leaves."""

    rates: np.ndarray  # (nstates, nstates + ninputs + lines)
    outputs: np.ndarray  # (noutputs, the same)
    arriving: np.ndarray  # (lines, the same)


class CutDiagram:
    """A compiled diagram with parameters, at a time, with its delays cut."""

    def __init__(
        self, who: str, compiled: Compiled, t: float, params: Mapping[str, Any] | None
    ) -> None:
        system, read = compiled.system, compiled.schedule
        named = [node.path for node in read.nodes if node.sampled]
        if named:
            raise UsageError(
                f"{who} needs a diagram without sampled blocks, and '{system.name}' has "
                f"'{named[0]}': give its continuous part, or use nlctl.linearize, which has the "
                "map over the common period of the clocks"
            )
        self.t = t
        self.n, self.m = system.nstates or 0, system.ninputs or 0
        self.lines, self.noutputs = len(read.lines), system.noutputs or 0
        self.p = compiled.parameter_vector(params)
        self._read(compiled)

    def _read(self, compiled: Compiled) -> None:
        """Take values and derivatives of a diagram."""
        self.compiled, self.tangent = compiled, open_tangent(compiled, self.p)
        self.code, self._c = prepared_parameters(compiled, self.p)

    def _suffices(self, results: Mapping[str, np.ndarray]) -> bool:
        """Whether enough passes of all loops are written out; if not, functions are called now."""
        cut = self.tangent.equations.cut
        if not cut or not any(np.isnan(part).any() for part in results.values()):
            return True
        self._read(self.compiled.calling(cut))
        return False

    def delays(self, who: str) -> np.ndarray:
        """Return the delays (s), shape (lines,); refuse one that varies."""
        found = []
        for line in self.compiled.schedule.lines:
            node = self.compiled.schedule.nodes[line.block or 0]
            if node.system.current_spec.varying is not None:
                raise CompileError(
                    f"{who} needs constant delays, and that of block '{node.path}' varies: a sine "
                    "does not leave it as a sine"
                )
            layout = self.compiled.program.layout[line.block or 0]
            found.append(self.p[layout["delay"].offset])
        return np.array(found, dtype=float)

    def values(self, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> Any:
        """Return rates, outputs and what arrives, with `w` leaving the delays."""
        found = self._evaluated(x, u, w)
        return found["dx"], found["y"][: self.noutputs], found["y"][self.noutputs :]

    def conditions(self, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> np.ndarray:
        """Return the values of what the equations switch at."""
        return self._evaluated(x, u, w)["g"]

    def _evaluated(self, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> dict[str, np.ndarray]:
        """Return the rates, the values of conditions, and the outputs."""
        point = self.t, x, np.concatenate([u, w, np.zeros(self.compiled.schedule.rates)])
        with np.errstate(all="ignore"):  # NaN is seen by who asks
            dx, g, _ = self.code.values(self.code.rhs, "dx g m", point, self._c)
            (y,) = self.code.values(self.code.out, "y", point, self._c)
        found = {"dx": dx, "y": y}
        return {**found, "g": g} if self._suffices(found) else self._evaluated(x, u, w)

    def derivatives(self, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> Derivatives:
        """Return the derivatives at a point, exactly."""
        width = self.n + self.m + self.lines
        total = self.n + self.compiled.schedule.ninputs + length(self.compiled.program.layout)
        given = np.concatenate([u, w, np.zeros(self.compiled.schedule.rates)])
        columns = {"t": [self.t], "x": x, "u": given, "p": self.p}
        with np.errstate(all="ignore"):
            found = differentiated_at(self.tangent, columns, np.eye(total, width))
        if not self._suffices(found):
            return self.derivatives(x, u, w)
        outputs = found["y"]
        return Derivatives(found["dx"], outputs[: self.noutputs], outputs[self.noutputs :])

    def checked(self, x: np.ndarray, u: np.ndarray, w: np.ndarray) -> tuple[Derivatives, list[str]]:
        """Return the derivatives at a point, and of which differences are taken, in words."""
        point, ends = np.concatenate([x, u, w]), [self.n, self.n + self.m]
        found = self.derivatives(x, u, w)
        if not point.size or inexact(self.tangent.equations, ("dx", "y")):
            return found, []
        system, read = self.compiled.system, self.compiled.schedule
        lines = [signal_name(read.nodes, line) for line in read.lines]
        by = [*system.state_labels, *system.input_labels, *lines]
        matrix, said = checked_derivatives(
            derivatives_in_words(system, by, lines),
            np.concatenate(found),
            (
                lambda z: np.concatenate(self.values(*np.split(z, ends))),
                lambda z: np.concatenate(self.derivatives(*np.split(z, ends))),
            ),
            point,
        )
        rows = np.split(matrix, [self.n, self.n + self.noutputs])
        return Derivatives(*rows), said

    def leaving(self, x: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return what leaves the delays where all signals have been constant."""
        w = np.zeros(self.lines)
        for _ in range(_STEPS if self.lines else 0):
            gap = self.values(x, u, w)[2] - w
            if np.abs(gap).max() <= _CLOSE * (1.0 + np.abs(w).max()):
                break
            slope = np.eye(self.lines) - self.derivatives(x, u, w).arriving[:, self.n + self.m :]
            w = w + np.linalg.lstsq(slope, gap, rcond=None)[0]
        return w

    def inputs(self, who: str, name: str, given: object) -> np.ndarray:
        """Return the inputs at a point, shape (ninputs,)."""
        what = f"{name} of '{self.compiled.system.name}'"
        return point_numbers(f"{who} needs", self.m, what, given)
