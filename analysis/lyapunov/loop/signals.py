"""Signals of an observed loop over time, and margins of statements about them."""

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from typing import Any, Literal

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from nlctl.annotations import as_annotated
from nlctl.attributes import described_record
from nlctl.errors import ParameterError
from nlctl.names import check_known
from nlctl.upstream.systems import SystemResponse

POINTWISE = 1e-9  # of a statement's size: rounding, and G near v = 0
INTEGRATED = 1e-6  # of V: the integrator's error at its default tolerance


@described_record(made_by="signals_of")
class Signals:
    """Signals of `nlctl.analysis.lyapunov.loop.instrumented` over time, ``signals["r"]``."""

    t: np.ndarray  # (m,)
    values: Mapping[str, np.ndarray] = field(repr=False)  # Arrays of shape (m,) by output name.

    def __getitem__(self, name: str) -> np.ndarray:
        check_known("output signal", name, self.values, "of the response")
        return self.values[name]

    def vector(self, name: str) -> np.ndarray:
        """Return name[0], name[1], ... as the columns of an array of shape (m, l)."""
        count = 0
        while f"{name}[{count}]" in self.values:
            count += 1
        columns = [self.values[f"{name}[{i}]"] for i in range(count)]
        return np.column_stack(columns) if columns else np.zeros((self.t.size, 0))

    def at(self, time: float) -> dict[str, float]:
        """Return x, r, u, v, zeta and delta_hat at the sample nearest to a time.

        Parameters
        ----------
        time : float
            Time (s).

        Returns
        -------
        dict
            Values by name; what the loop lacks is left out.
        """
        i = int(np.argmin(np.abs(self.t - time)))
        names = [n for n in self.values if n[:1] == "x" and n[1:].isdigit()]
        shown = [*names, "r", "u", "v", "zeta", "delta_hat"]
        return {name: float(self.values[name][i]) for name in shown if name in self.values}


@as_annotated
def signals_of(response: SystemResponse | Signals) -> Signals:
    """Return the outputs of a response by name.

    Parameters
    ----------
    response : control.TimeResponseData
        With several outputs.

    Raises
    ------
    ParameterError
        If it is not a response.

    Examples
    --------
    >>> from nlctl.analysis.lyapunov import signals_of
    >>> response = nlctl.input_output_response(nlctl.paper.example_1(), np.linspace(0, 0.1, 11))
    >>> float(signals_of(response)["zeta"][0])
    1.0
    """
    if isinstance(response, Signals):
        return response
    if not hasattr(response, "output_labels"):
        raise ParameterError(
            f"signals_of needs a response with named outputs, got {type(response).__name__}"
        )
    rows = np.atleast_2d(np.asarray(response.outputs))
    return Signals(
        t=np.asarray(response.time, dtype=float),
        values=dict(zip(response.output_labels, rows, strict=True)),
    )


def peak_by_rates(t: np.ndarray, y: np.ndarray, rate: np.ndarray) -> float:
    r"""Return max \|y\| of a signal whose derivative is known at the samples."""
    # Between two samples it is the cubic with their values and derivatives, which needs no sign
    # that the signal is smooth: r of (14) bends where the actuator does, and never jumps.
    # Shapes: `t, y, rate` (m,).
    if not np.all(np.isfinite(y) & np.isfinite(rate)):
        return float(np.max(np.abs(y)))
    if t.size < 2:
        return float(np.max(np.abs(y), initial=0.0))
    curve = CubicHermiteSpline(t, y, rate)
    turning = curve.derivative().roots(extrapolate=False)
    inside = np.abs(curve(turning[np.isfinite(turning)]))
    return float(max(np.max(np.abs(y)), np.max(inside, initial=0.0)))


@described_record(made_by="observed")
class Margin:
    """Margin of one statement over time; it holds where it is not below -tolerance * scale."""

    equation: str  # Number in the paper, ``"(31)"``.
    statement: str  # In corrected form.
    # The margin is the larger side less the smaller one; of an equality it is minus the distance
    # between the sides.
    kind: Literal["inequality", "equality"]
    t: np.ndarray = field(repr=False)  # (m,)
    margin: np.ndarray = field(repr=False)
    scale: float  # Size of the terms that the statement is made of.
    tolerance: float  # Relative to `scale`.

    @property
    def least(self) -> float:
        """Least margin; NaN if it is NaN anywhere."""
        return float(np.min(self.margin))

    @property
    def at(self) -> float:
        """Time (s) of the least margin, or of the first NaN."""
        return float(self.t[int(np.argmin(self.margin))])

    @property
    def _broken(self) -> np.ndarray:
        """At which samples it does not hold, up to the tolerance."""
        return ~(self.margin >= -self.tolerance * self.scale)

    @property
    def holds(self) -> bool:
        """Whether it holds at every sample, up to the tolerance."""
        return not self._broken.any()

    @property
    def share_violated(self) -> float:
        """Share of the samples at which it does not hold."""
        return float(np.mean(self._broken))

    @property
    def first_violated(self) -> float:
        """Time (s) of the first sample at which it does not hold; NaN if there is none."""
        return float(self.t[int(np.argmax(self._broken))]) if self._broken.any() else np.nan


def inequality(
    equation: str,
    statement: str,
    t: np.ndarray,
    low: object,
    high: object,
    scale: float | None = None,
    tolerance: float = POINTWISE,
) -> Margin:
    """Return the margin high - low of low <= high."""
    low, high = (np.broadcast_to(np.asarray(side, dtype=float), t.shape) for side in (low, high))
    if scale is None:
        finite = np.abs(np.concatenate([low, high]))
        scale = float(np.max(finite[np.isfinite(finite)], initial=0.0))
    with np.errstate(invalid="ignore"):  # inf - inf is NaN, which does not hold
        margin = high - low
    return Margin(
        equation=equation, statement=statement, kind="inequality", t=t, margin=margin, scale=scale,
        tolerance=tolerance,
    )  # fmt: skip


def equality(equation: str, statement: str, *sides: Any, **options: float) -> Margin:
    """Return the margin -|one - other| of one = other; arguments as for `inequality`."""
    one_way = inequality(equation, statement, *sides, **options)
    return dataclasses.replace(one_way, kind="equality", margin=-np.abs(one_way.margin))
