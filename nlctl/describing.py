"""Describing functions by simulation of the block itself, and the limit cycles they predict."""

from collections.abc import Callable, Mapping
from typing import Any
from weakref import WeakKeyDictionary

import control as ct
import numpy as np

from .annotations import as_annotated
from .arguments import ATOL, RTOL, number
from .attributes import described_record
from .blocks import Block
from .diagrams import initial_state, interconnect, known_system
from .errors import DivergedError, ParameterError
from .native import Compiled
from .native import compile as compile_diagram
from .params import as_numbers
from .response import input_output_response

__all__ = ["LimitCycle", "describing_function", "describing_function_plot", "limit_cycles"]

_PERIODS = 8  # in one run; the first ones settle
_MOST = 64  # such runs, each from where the last one has ended
_SETTLED = 1e-7  # of the describing function, from one period to the next
_TIGHT = 1e-2  # of the default tolerances
_SAMPLES = 400  # of a period of a simulated cycle
_CYCLE = 1e-6  # of amplitude and frequency, from one run to the next
_GONE = 1e-6  # of the predicted amplitude: it has died out
_RIGS: WeakKeyDictionary[Any, tuple[Any, Compiled]] = WeakKeyDictionary()


def _sine(t: float, x: object, u: object, params: Mapping[str, float]) -> list[Any]:
    """u = A sin(omega t)."""
    return [params["A"] * np.sin(params["omega"] * t)]


def _harmonic(t: float, x: object, u: np.ndarray, params: Mapping[str, float]) -> list[Any]:
    """The integrands of the first Fourier coefficients of v."""
    phase = params["omega"] * t
    return [u[0] * np.sin(phase), u[0] * np.cos(phase)]


@as_annotated
def describing_function(
    block: ct.NonlinearIOSystem,
    amplitudes: object,
    omega: float = 1.0,
    *,
    params: Mapping[str, Any] | None = None,
) -> np.ndarray:
    """Return the describing function of a block: the first harmonic of its answer to a sine.

        N(A) = (b + j a) / A      u = A sin(omega t),  v = a cos(omega t) + b sin(omega t) + ...

    The block is simulated as it is, with its memory, its break points and jumps located, until one
    period is like the one before.  ``ct.describing_function(block, A)`` calls it as well.

    Parameters
    ----------
    block : Block or control.NonlinearIOSystem
        With one input and one output.
    amplitudes : array_like of float
        Amplitudes A of the input, in its unit.
    omega : float, optional
        Angular frequency (rad/s).  It makes a difference for blocks with dynamics only.
    params : mapping, optional
        Qualified parameters, ``{"actuator.b_r": 0.6}``.

    Returns
    -------
    ndarray of complex
        In the shape of `amplitudes`.

    Raises
    ------
    ParameterError
        If an amplitude or the frequency is not positive, or it has not one input and one output.
    DivergedError
        If a run does not end well, or does not become periodic.

    Examples
    --------
    Of a relay its magnitude is 4 / (pi A); a play lags:

    >>> relay = nlctl.block(nlctl.Relay(on=0.5, off=-0.5), "relay")
    >>> bool(np.isclose(abs(nlctl.describing_function(relay, 2.0)), 4 / (np.pi * 2.0)))
    True
    >>> play = nlctl.block(nlctl.Backlash(), "play")
    >>> bool(nlctl.describing_function(play, 2.0).imag < 0)
    True
    """
    number("describing_function", "omega", omega, above=0)
    A = as_numbers(amplitudes)
    if A is None or not np.all(np.isfinite(A) & (A > 0)):
        raise ParameterError(f"describing_function needs amplitudes > 0, got {amplitudes!r}")
    rig, given = _rig(block), dict(params or {}) | {"sine.omega": omega, "harmonic.omega": omega}
    values = [_settled(block, rig, float(a), omega, given) for a in np.ravel(A)]
    return np.array(values, dtype=complex).reshape(A.shape)


def _rig(block: Any) -> Compiled:
    """Return a block between a sine and the integrator of its first harmonic."""
    system = known_system("describing_function", block)
    sizes = (system.ninputs, system.noutputs)
    if sizes != (1, 1) or not ct.isctime(system):
        raise ParameterError(
            "describing_function needs a block in continuous time with one input and one output, "
            f"'{system.name}' has {sizes[0]} and {sizes[1]}, dt = {system.dt}"
        )
    spec = getattr(system, "spec", None)
    kept = _RIGS.get(system)
    if kept is not None and kept[0] is spec and spec is not None:
        return kept[1]
    parameters = {"A": 1.0, "omega": 1.0}
    sine = ct.nlsys(None, _sine, inputs=0, outputs=["u"], params=parameters, name="sine")
    harmonic = ct.nlsys(
        _harmonic, None, inputs=["v"], outputs=["b", "a"], states=["b", "a"],
        params={"omega": 1.0}, name="harmonic",
    )  # fmt: skip
    input_, output = _ends(system)
    rig = interconnect(
        [sine, system, harmonic], [[input_, "sine.u"], ["harmonic.v", output]],
        outlist=["harmonic.b", "harmonic.a"], name=f"describing function of {system.name}",
    )  # fmt: skip
    compiled = compile_diagram(rig)
    _RIGS[system] = spec, compiled
    return compiled


def _ends(block: Block) -> tuple[str, str]:
    """Return the input and the output of a block, as lists of connections have them."""
    return f"{block.name}.{block.input_labels[0]}", f"{block.name}.{block.output_labels[0]}"


def _settled(
    block: Any, rig: Compiled, A: float, omega: float, params: Mapping[str, Any]
) -> complex:
    """Return the describing function at one amplitude, once it is the same in two periods."""
    times = 2 * np.pi / omega * np.arange(_PERIODS + 1)
    state: Any = None
    for _ in range(_MOST):
        run: Any = input_output_response(
            rig, times, 0, state, params=dict(params) | {"sine.A": A}, rtol=_TIGHT * RTOL,
            atol=_TIGHT * ATOL,
        )  # fmt: skip
        b, a = np.diff(run.y, axis=1)
        values = (b + 1j * a) * omega / (np.pi * A)
        if abs(values[-1] - values[-2]) <= _SETTLED * max(abs(values[-1]), _SETTLED):
            return complex(values[-1])
        state = run.x[:, -1]
    raise DivergedError(
        f"'{block.name}' is not periodic after {_PERIODS * _MOST} periods of a sine of amplitude "
        f"{A:g}: it has no describing function there",
        float(_MOST * times[-1]),
    )


@described_record(made_by="limit_cycles")
class LimitCycle:
    """A limit cycle that a describing function predicts, and what the loop does."""

    predicted_amplitude: float  # Of the first harmonic of the nonlinearity's input, and in rad/s.
    predicted_omega: float
    # Half of the peak-to-peak value of that signal in the simulated loop, and 2 pi over its period;
    # NaN where the oscillation dies out, grows without bound, or does not settle.
    amplitude: float
    omega: float
    found: str  # How the run ended, in words.


@as_annotated
def limit_cycles(
    system: ct.LTI, block: ct.NonlinearIOSystem, amplitudes: object, omega: object = None
) -> list[LimitCycle]:
    """Return the limit cycles of a linear system with a block in its negative feedback.

    Each intersection of `control.describing_function_response` is a start: from there the loop is
    simulated, the block as it is, until amplitude and frequency no longer change.

    Parameters
    ----------
    system : control.LTI
        With one input and one output, in continuous time.
    block : Block or control.NonlinearIOSystem
        With one input and one output.
    amplitudes : array_like of float
        Where the describing function is computed.
    omega : array_like of float, optional
        Angular frequencies (rad/s) of the Nyquist curve.

    Returns
    -------
    list of LimitCycle
        One for each intersection.

    Raises
    ------
    ParameterError
        If the system or the block has not one input and one output, or an amplitude is not
        positive.

    Examples
    --------
    Of python-control's own example an amplitude of 3.34 is predicted, and the loop has 3.38:

    >>> plant = ct.tf([8], [1, 2, 2, 1])
    >>> saturation = nlctl.block(nlctl.Saturation(limit=1.0), "saturation")
    >>> (cycle,) = nlctl.limit_cycles(plant, saturation, [1.5, 2, 3, 4])
    >>> round(cycle.predicted_amplitude, 2), round(cycle.predicted_omega, 3)
    (3.34, 1.414)
    >>> round(cycle.amplitude, 2), round(cycle.omega, 3)
    (3.38, 1.407)
    """
    response = _response(system, block, amplitudes, omega)
    return [_cycle(system, block, float(a), float(w)) for a, w in response.intersections]


def _response(system: Any, block: object, amplitudes: object, omega: object) -> Any:
    """Return python-control's describing function response."""
    if (system.ninputs, system.noutputs) != (1, 1):
        raise ParameterError(
            "limit_cycles needs a linear system with one input and one output, got "
            f"{system.ninputs} and {system.noutputs}"
        )
    A = as_numbers(amplitudes)
    if A is None or A.ndim != 1 or A.size < 2 or not np.all(np.isfinite(A) & (A > 0)):
        raise ParameterError(f"limit_cycles needs two amplitudes > 0 or more, got {amplitudes!r}")
    return ct.describing_function_response(system, block, A, omega, warn_nyquist=False)


def _cycle(system: object, block: Any, A: float, omega: float) -> LimitCycle:
    """Simulate the loop from a predicted cycle on."""
    linear: Any = ct.ss(system)
    linear = ct.ss(
        linear.A, linear.B, linear.C, linear.D, inputs=["u"], outputs=["y"], name="linear"
    )
    input_, output = _ends(block)
    loop = compile_diagram(
        interconnect(
            [linear, block],
            [["linear.u", f"-{output}"], [input_, "linear.y"]],
            outlist=["linear.y"],
            outputs=["y"],
            name="cycle",
        )
    )
    row = np.ravel(linear.C)
    phasor = -describing_function(block, A, omega) * A
    resolvent = np.linalg.solve(1j * omega * np.eye(linear.nstates) - linear.A, linear.B[:, 0])
    state = initial_state(loop.system)
    state[: linear.nstates] = np.imag(resolvent * phasor)
    asked = {"predicted_amplitude": A, "predicted_omega": omega}

    def rises(t: float, x: object, u: object, params: object) -> float:
        return float(row @ np.asarray(x)[: row.size])

    rises.direction = 1.0  # type: ignore[attr-defined]
    return LimitCycle(**asked, **_followed(loop, state, (A, omega), rises))


def _followed(
    loop: Compiled, state: np.ndarray, predicted: tuple[float, float], rises: Callable[..., Any]
) -> dict[str, Any]:
    """Return amplitude and frequency that a loop settles at, and how it ended."""
    A, omega = predicted
    nothing = {"amplitude": np.nan, "omega": np.nan}
    before = np.array([np.nan, np.nan])
    for _ in range(_MOST):
        times = np.linspace(0, _PERIODS * 2 * np.pi / omega, _PERIODS * _SAMPLES + 1)
        try:
            run: Any = input_output_response(loop, times, 0, state, events={"rises": rises})
        except DivergedError as error:
            return nothing | {"found": f"it grows without bound: {error}"}
        state = run.x[:, -1]
        passed = run.events.loc[run.events["which"] == "rises", "time"].to_numpy(dtype=float)
        y = np.ravel(run.outputs)
        if np.ptp(y[-_SAMPLES:]) <= 2 * _GONE * A:
            return nothing | {"found": "it dies out"}
        if not np.max(np.abs(y)) <= A / _GONE:
            return nothing | {"found": f"it grows beyond {A / _GONE:.3g}"}
        if passed.size < 2:
            break
        last = (times >= passed[-2]) & (times <= passed[-1])
        omega = 2 * np.pi / (passed[-1] - passed[-2])
        now = np.array([(_top(y[last]) + _top(-y[last])) / 2, omega])
        if np.all(np.abs(now - before) <= _CYCLE * np.abs(now)):
            return {"amplitude": float(now[0]), "omega": float(omega), "found": "it settles"}
        before = now
    return nothing | {"found": f"it does not settle within {_MOST * _PERIODS} periods"}


def _top(y: np.ndarray) -> float:
    """Return the largest value of a smooth signal: a parabola's vertex at its largest sample."""
    k = int(np.argmax(y))
    if not 0 < k < y.size - 1:
        return float(y[k])
    left, right = y[k - 1] - y[k], y[k + 1] - y[k]
    bend = left + right
    return float(y[k] - (right - left) ** 2 / (8 * bend)) if bend < 0 else float(y[k])


@as_annotated
def describing_function_plot(
    system: ct.LTI,
    block: ct.NonlinearIOSystem,
    amplitudes: object,
    omega: object = None,
    **kwargs: Any,
) -> ct.ControlPlot:
    """Plot the Nyquist curve and -1/N(A), as python-control does, and the simulated limit cycles.

    A predicted cycle is where the curves meet; the simulated one is a cross on the Nyquist curve at
    its own frequency, with its amplitude and frequency.

    Parameters
    ----------
    system, block, amplitudes, omega : object
        As for `limit_cycles`.
    **kwargs : object
        Of `control.describing_function_plot`.

    Returns
    -------
    control.ControlPlot
        Lines, axes and figure; the lines of the simulated cycles are the last.

    Raises
    ------
    ParameterError
        As `limit_cycles` does.

    Examples
    --------
    >>> plant = ct.tf([8], [1, 2, 2, 1])
    >>> saturation = nlctl.block(nlctl.Saturation(limit=1.0), "saturation")
    >>> drawn = nlctl.describing_function_plot(plant, saturation, [1.5, 2, 3, 4])
    >>> len(drawn.lines)
    3
    """
    response = _response(system, block, amplitudes, omega)
    plot = ct.describing_function_plot(response, **kwargs)
    ax, crosses = plot.axes[0, 0], []
    for cycle in (_cycle(system, block, float(a), float(w)) for a, w in response.intersections):
        if np.isfinite(cycle.omega):
            at = complex(system(1j * cycle.omega))
            label = f"simulated: {cycle.amplitude:.3g} @ {cycle.omega:.3g} rad/s"
            crosses += ax.plot(at.real, at.imag, "kx", markersize=9, label=label)
    if crosses:
        ax.legend(handles=crosses, framealpha=0.9)
    lines = np.empty(3, dtype=object)
    lines[:2], lines[2] = plot.lines, crosses
    return ct.ControlPlot(lines, plot.axes, plot.figure)
