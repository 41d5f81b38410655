"""Gradients of metrics and margins: what derivatives of signals do to a number of a response."""

import numpy as np

from ..annotations import as_annotated
from ..attributes import described_record
from ..errors import ParameterError
from ..names import unknown
from ..native.ensemble_result import MetricLike
from .record import SensitivityResponse

_STEP = 1e-5  # of the size of the signals
_AGREE = 1e-5  # of both sides, or of a change by all of itself: less is that of the step


@described_record(eq=False)
class MetricGradient:
    """The derivatives of a number of a response, of `nlctl.metric_gradient`.

    Examples
    --------
    >>> made = nlctl.sensitivities.MetricGradient(
    ...     key="size", value=1.0, with_respect_to=("p",), scale=np.ones(1), above=np.ones(1),
    ...     below=-np.ones(1),
    ... )
    >>> print(made.one_sided, made.gradient)
    ('p',) [nan]
    """

    key: str  # Of the metric.
    value: float
    with_respect_to: tuple[str, ...]
    scale: np.ndarray  # (k,): Of what size each quantity is.
    # (k,): Derivatives to both sides: by how much it changes, for each unit, where a quantity
    # grows, and where it falls.  They differ at kinks, such as where two peaks are equally high.
    above: np.ndarray
    below: np.ndarray

    @property
    def gradient(self) -> np.ndarray:
        """The derivatives, NaN where both sides differ, shape (k,)."""
        return np.where(self._smooth, 0.5 * (self.above + self.below), np.nan)

    @property
    def one_sided(self) -> tuple[str, ...]:
        """By what there is no derivative, but one to each side."""
        finite = np.isfinite(self.above) & np.isfinite(self.below)
        rows = zip(self.with_respect_to, finite & ~self._smooth, strict=True)
        return tuple(name for name, kinked in rows if kinked)

    @property
    def _smooth(self) -> np.ndarray:
        size = np.abs(self.above) + np.abs(self.below) + abs(self.value) / self.scale
        return np.abs(self.above - self.below) <= _AGREE * size

    def __getitem__(self, name: str) -> float:
        if name not in self.with_respect_to:
            raise unknown("quantity", str(name), self.with_respect_to, "of this gradient")
        return float(self.gradient[self.with_respect_to.index(name)])

    def __repr__(self) -> str:
        rows = zip(self.with_respect_to, self.above, self.below, self._smooth, strict=True)
        lines = [f"Gradient of '{self.key}' = {self.value:.6g}"]
        lines += [
            f"  {name}  {a:.6g}" if smooth else f"  {name}  {a:.6g} above, {b:.6g} below"
            for name, a, b, smooth in rows
        ]
        return "\n".join(lines)


@as_annotated
def metric_gradient(metric: MetricLike, response: SensitivityResponse) -> MetricGradient:
    """Return the derivatives of a number of a response by what the response has them by.

    The metric is evaluated on the samples, moved a little along their derivatives to either side:
    no further run is needed, and any function of samples has one.  At a kink both sides differ.

    Parameters
    ----------
    metric : Metric or Requirement
        A metric as `nlctl.ensemble_response` takes them, such as those of
        `nlctl.analysis.metrics`, or a requirement of signal temporal logic, whose value is its
        margin.
    response : SensitivityResponse
        With the signals that it looks at.

    Returns
    -------
    MetricGradient
        In units of the metric over those of each quantity.  NaN where the response has no
        derivative within the time that the metric looks at.

    Raises
    ------
    UnknownNameError
        If the response has no signal that the metric looks at.
    ParameterError
        If the metric looks at a time of which the response has no sample.

    Examples
    --------
    >>> from nlctl.analysis.metrics import Metric, integral
    >>> lag = nlctl.block(nlctl.Lag(T=0.5), "lag")
    >>> run = nlctl.sensitivity_response(lag, np.linspace(0, 8, 801), 1.0, with_respect_to="lag.T")
    >>> late = Metric(
    ...     key="late", signal="v", function=lambda t, v: integral(t, 1 - v), unit="s",
    ...     meaning="integral of 1 - v",
    ... )
    >>> print(nlctl.metric_gradient(late, run))  # the integral of exp(-t / T) is T
    Gradient of 'late' = 0.5
      lag.T  0.999998
    """
    for signal in metric.signals:
        if signal not in response.signals:
            raise unknown("signal", signal, response.signals, f"for metric '{metric.key}'")
    inside = (response.time >= metric.start) & (response.time <= metric.end)
    if not inside.any():
        raise ParameterError(
            f"metric '{metric.key}' looks at {metric.start:g} to {metric.end:g} s, of which the "
            "response has no sample"
        )
    places = [response.signals.index(signal) for signal in metric.signals]
    t, y = response.time[inside], response.values[places][:, inside]
    sides, here = [], float(metric.function(t, *y.copy()))
    for j, scale in enumerate(response.scale):
        way = response.derivatives[places, j][:, inside] * scale
        sides.append([side / scale for side in _to_both_sides(metric, t, (y, here), way)])
    above, below = np.array(sides, dtype=float).T
    return MetricGradient(
        key=metric.key, value=here,
        with_respect_to=response.with_respect_to, scale=response.scale, above=above, below=below,
    )  # fmt: skip


def _to_both_sides(
    metric: MetricLike, t: np.ndarray, at: tuple[np.ndarray, float], way: np.ndarray
) -> tuple[float, float]:
    """Return the derivatives along a way of the samples and against it, of second order each."""
    y, here = at
    if not np.isfinite(way).all() or not np.isfinite(y).all():
        return np.nan, np.nan
    longest = np.abs(way).max(initial=0.0)
    if longest == 0.0:
        return 0.0, 0.0
    step = _STEP * max(np.abs(y).max(initial=0.0), longest) / longest
    moved = [float(metric.function(t, *(y + k * step * way))) for k in (1.0, 2.0, -1.0, -2.0)]
    above = (4 * moved[0] - 3 * here - moved[1]) / (2 * step)
    below = (3 * here - 4 * moved[2] + moved[3]) / (2 * step)
    return above, below
