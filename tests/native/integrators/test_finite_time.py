"""Rest that is reached in finite time: x' = -sign(x) sqrt(|x|) is (1 - t / 2)^2 until 2 s."""

import control as ct
import numpy as np
import pytest
from examples import crossed

import nlctl

LAWS = {
    "a tank": lambda t, x, u, p: [-np.sqrt(max(x[0], 0.0))],
    "sign": lambda t, x, u, p: [-np.sign(x[0]) * np.sqrt(abs(x[0]))],
    "power": lambda t, x, u, p: [-np.sign(x[0]) * abs(x[0]) ** 0.5],
    "if": lambda t, x, u, p: [-np.sqrt(x[0]) if x[0] > 0 else np.sqrt(-x[0])],
    "copysign": lambda t, x, u, p: [-np.copysign(np.sqrt(abs(x[0])), x[0])],
    "heaviside": lambda t, x, u, p: [(1 - 2 * np.heaviside(x[0], 0.5)) * np.sqrt(abs(x[0]))],
}
T = np.linspace(0, 3, 13)


def run(law, **how):
    plant = ct.nlsys(law, lambda t, x, u, p: x, inputs=0, outputs=1, states=1, name="plant")
    return nlctl.input_output_response(
        plant, T, 0, [1.0], rtol=1e-6, atol=1e-8, ignore_errors=True, max_steps=100_000, **how
    )


@pytest.mark.parametrize(("method", "law"), crossed([None, "rodas5p"], LAWS))
def test_rest_is_reached(law, method):
    response = run(law, method=method)
    assert response.success
    exact = np.maximum(1 - T / 2, 0) ** 2
    assert np.abs(response.outputs - exact).max() < 1e-6


@pytest.mark.parted
@pytest.mark.parametrize("law", [LAWS["sign"], LAWS["if"], LAWS["copysign"], LAWS["heaviside"]])
def test_no_polynomial_leads_away_from_rest(law):
    """Near 0 Taylor's method knows little of sqrt(|x|): it says so, or is right."""
    response = run(law, method="taylor")
    exact = np.maximum(1 - response.time / 2, 0) ** 2
    assert np.abs(response.outputs - exact).max() < 1e-6
