"""Functions that blocks share: Nussbaum functions, Gaussian basis, smooth sign, clip, noise."""

from collections.abc import Callable, Sequence

import numpy as np

from .equations import equation
from .errors import ParameterError

__all__ = [
    "band_limited",
    "clip",
    "gaussian",
    "nussbaum",
    "nussbaum_derivative",
    "nussbaum_integral",
    "smooth_sign",
]


@equation
def nussbaum(zeta):
    """Nussbaum function of the paper, N(zeta) = exp(zeta^2) cos(pi zeta / 2).

    It overflows at zeta = 26.64 and is zero at zeta = 1, where the paper starts.
    """
    return np.exp(zeta * zeta) * np.cos(np.pi / 2 * zeta)


@equation
def nussbaum_derivative(zeta):
    """Derivative N'(zeta) of `nussbaum`."""
    angle = np.pi / 2 * zeta
    return np.exp(zeta * zeta) * (2 * zeta * np.cos(angle) - np.pi / 2 * np.sin(angle))


def nussbaum_integral(zeta):
    r"""Integral of `nussbaum` from 0 to zeta, for property (12).

    .. math:: \int_0^s N = e^{\pi^2/16} \frac{\sqrt\pi}{2} \mathrm{Re}\,\mathrm{erfi}(s+i\pi/4)
    """
    from scipy.special import erfi

    return np.exp(np.pi**2 / 16) * np.sqrt(np.pi) / 2 * erfi(np.asarray(zeta) + 0.25j * np.pi).real


@equation
def gaussian(Z, centres, widths):
    """Gaussian basis of Example 1, psi_i(Z) = exp(-(Z - mu_i)^T (Z - mu_i) / nu_i^2).

    Shapes: `Z` (n,), `centres` (l, n), `widths` (l,); returns (l,).
    """
    squared = (centres[:, 0] - Z[0]) ** 2
    for i in range(1, centres.shape[1]):
        squared = squared + (centres[:, i] - Z[i]) ** 2
    return np.exp(-squared / (widths * widths))


@equation
def smooth_sign(r, tau):
    """Smooth sign tanh(r / tau) of the robust term; |r| - r tanh(r/tau) <= 0.2785 tau, (29)."""
    return np.tanh(r / tau)


@equation
def clip(y, low, high):
    """Clip y into [low, high], min(max(y, low), high); NaN stays NaN.

    With minimum and maximum, which interval proofs know; `numpy.clip` they do not.
    """
    return np.minimum(np.maximum(y, low), high)


def band_limited(
    rms: float, *, low: float, high: float, seed: int, components: int = 32
) -> Callable[[float], float]:
    """Make a band-limited noise signal: a fixed function of time, the same for every solver.

    The signal is a sum of `components` sines with equal amplitudes, frequencies drawn one from
    each of `components` equal parts of the band, and uniform phases.
    """
    omega, phase = noise_spectrum(low, high, seed, components)
    if not (np.isfinite(rms) and rms >= 0):
        raise ParameterError(f"band_limited needs rms >= 0, got {rms}")
    amplitude = float(rms)

    @equation
    def noise(t):
        return noise_value(t, amplitude, omega, phase)

    return noise


def noise_spectrum(low: float, high: float, seed: int | Sequence[int], components: int):
    """Draw the frequencies (rad/s) and phases (rad) of `band_limited`, each of shape (m,)."""
    if not (np.isfinite(high) and 0 <= low < high):
        raise ParameterError(
            f"band-limited noise needs 0 <= low < high, got low {low}, high {high}"
        )
    if components < 1:
        raise ParameterError(f"band-limited noise needs components >= 1, got {components}")
    rng = np.random.default_rng(seed)
    edges = np.linspace(low, high, components + 1)
    omega = rng.uniform(edges[:-1], edges[1:])
    return omega, rng.uniform(0, 2 * np.pi, components)


@equation
def noise_value(t, rms, omega, phase):
    """Value at time t of the sum of equal sines with the given spectrum and rms."""
    return rms * np.sqrt(2 / omega.size) * np.sum(np.sin(omega * t + phase))
