"""y' = f(s), where f is 1 for 0.5 < s < 0.501: by all spellings, and whatever the tolerance.

Also where what is compared is no number, infinite, or a narrow peak.  Of s = sin(t) the integral
is known: 2 (asin 0.501 - asin 0.5) until t = 3.
"""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

WAYS = [{"method": name} for name in ("tsit5", "rodas5p", "taylor")]
WAYS.append({"engine": "python-control"})
IDS = ["-".join(how.values()) for how in WAYS]
WIDTH = np.arcsin(0.501) - np.arcsin(0.5)
T = np.array([0, 0.4, 1.1, 3.0])
NUMBERS = {
    "isnan": lambda s: np.where(np.isnan(np.sqrt((s - 0.5) * (0.501 - s))), 0.0, 1.0),
    "isfinite": lambda s: 1.0 * np.isfinite(np.log((s - 0.5) * (0.501 - s))),
    "arccos": lambda s: 0.0 if np.isnan(np.arccos(2000 * (s - 0.5005))) else 1.0,
    "fmax": lambda s: np.fmax(np.sign(np.sqrt((s - 0.5) * (0.501 - s))), 0.0),
    "sqrt": lambda s: 1.0 if np.sqrt(s - 0.5) < np.sqrt(0.001) else 0.0,
    "log": lambda s: 1.0 if np.log(s - 0.5) < np.log(0.001) else 0.0,
}
POLES = {
    "1 / z": lambda s: 1.0 if 1 / (s - 0.5) > 1000 else 0.0,
    "1 / z^2": lambda s: 1.0 if 1 / (s - 0.5005) ** 2 > 4e6 else 0.0,
    "2 + 1 / z": lambda s: 1.0 if 2 + 1 / (s - 0.5) > 1002 else 0.0,
    "max": lambda s: 1.0 if max(1 / (s - 0.5), 1000.0) > 1000.0 else 0.0,
}
PEAKS = {
    "square": lambda s: 1.0 if (s - 0.5005) ** 2 < 2.5e-7 else 0.0,
    "product": lambda s: 1.0 if s * s - 1.001 * s + 0.2505 < 0 else 0.0,
    "exp": lambda s: 1.0 if np.exp(-(((s - 0.5005) / 5e-4) ** 2)) > np.exp(-1.0) else 0.0,
}
EVERY = NUMBERS | POLES | PEAKS


def swinging(f):
    return ct.nlsys(
        lambda t, x, u, p: [f(x[1]), x[2], -x[1]], lambda t, x, u, p: x[0], inputs=0, outputs=1,
        states=3, name="swinging",
    )  # fmt: skip


@pytest.mark.parametrize(("how", "f"), crossed(dict(zip(IDS, WAYS, strict=True)), EVERY))
def test_a_band_of_a_state(f, how):
    with np.errstate(all="ignore"):
        response = nlctl.input_output_response(
            swinging(f), T, 0, [0.0, 0.0, 1.0], rtol=1e-6, atol=1e-9, squeeze=True, **how
        )
    np.testing.assert_allclose(response.outputs, [0, 0, WIDTH, 2 * WIDTH], atol=2e-5)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
@pytest.mark.parametrize("f", PEAKS.values(), ids=PEAKS)
def test_whatever_the_tolerance(f, method):
    """In 7 s the band is met three times, on either side: where steps end is a matter of chance."""
    compiled = nlctl.compile(swinging(f))
    for rtol in 10.0 ** -np.arange(4, 8.1, 0.5):
        run = nlctl.input_output_response(
            compiled, [0, 7], 0, [0.0, 0.0, 1.0], rtol=rtol, atol=1e-3 * rtol, method=method
        )
        assert len(run.events) == 6


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_peaks_of_a_fast_wave(method):
    """sin(40 sin t) is above 0.999 for thirty short times in 7 s, at the tops of its waves."""
    compiled = nlctl.compile(swinging(lambda s: 1.0 * (np.sin(40 * s) > 0.999)))
    for rtol in (1e-5, 1e-6, 1e-7):
        run = nlctl.input_output_response(
            compiled, [0, 7], 0, [0.0, 0.0, 1.0], rtol=rtol, atol=1e-3 * rtol, method=method
        )
        assert len(run.events) == 60


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_the_root_of_a_square_is_a_size(method):
    compiled = nlctl.compile(swinging(lambda s: np.sqrt((s - 0.5) * (s - 0.5))))
    run = nlctl.input_output_response(compiled, [0, 3], 0, [0.0, 0.0, 1.0], method=method)
    assert list(run.events["direction"]) == ["rising", "falling"]
    np.testing.assert_allclose(run.events["time"], [np.pi / 6, 5 * np.pi / 6], atol=1e-7)
