"""Windows of a state that are crossed in a moment: by every method as wide as they are.

x' = 1 + k in a < x < b, else 1: the closed form is a line with one bend more.  A step across both
ends at once, or one with a stage behind, would be wrong by the jump of the rate, up to 1e5.
"""

import control as ct
import numpy as np
import pytest

import nlctl

END = 5.0
HEIGHTS = (-0.9, -0.5, 1.0, 10.0, 30.0, 1e3, 1e5)


def window(t, x, u, params):
    return [1.0 + (params["k"] if params["a"] < x[0] < params["b"] else 0.0)]


@pytest.fixture(scope="module")
def compiled():
    """One program for all windows."""
    given = {"a": 1.0, "b": 2.0, "k": 1.0}
    return nlctl.compile(
        ct.nlsys(window, None, inputs=0, outputs=1, states=1, params=given, name="window")
    )


def end_of(a, b, k):
    """Where x is at the end, from 0."""
    leaves = a + (b - a) / (1 + k)
    return b + END - leaves if leaves < END else a + (END - a) * (1 + k)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor", "auto"])
@pytest.mark.parametrize("rtol", [1e-5, 1e-9])
def test_windows_of_any_width_and_height(compiled, method, rtol):
    """Widths from 1 to 1e-9; the error is that of a few steps, whatever the rate jumps by."""
    rng = np.random.default_rng(5)
    for _ in range(70):
        a, width, k = rng.uniform(0.1, 3.0), 10 ** rng.uniform(-9, 0), rng.choice(HEIGHTS)
        params = {"a": a, "b": a + width, "k": k}
        run = nlctl.input_output_response(
            compiled, [0, END], 0, [0.0], params=params, method=method, rtol=rtol,
            atol=rtol / 100, engine="native", max_steps=20_000,
        )  # fmt: skip
        exact = end_of(**params)
        assert run.states[0, -1] == pytest.approx(exact, abs=50 * rtol * max(1, abs(exact))), params


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_a_product_that_is_negative_for_a_moment(method):
    """(x - a) (x - b) < 0 with x = t: for b - a, 1e-6, where the product is 2.5e-13 at most."""

    def hit(t, x, u, params):
        return [1.0, np.where((x[0] - 0.5) * (x[0] - 0.500001) < 0, 1e6, 0.0)]

    system = ct.nlsys(hit, None, inputs=0, outputs=2, states=2, name="hit")
    made = nlctl.input_output_response(system, [0, 10], 0, 0, method=method)
    np.testing.assert_allclose(made.states[:, -1], [10.0, 1.0], rtol=0, atol=1e-6)


def test_a_pulse_of_a_function_that_is_called_is_seen_from_rest():
    """1 for 0.5 s of 100 s, with no output sample inside."""
    pulses = [0.0] * 200
    pulses[83] = 1.0
    system = ct.nlsys(
        lambda t, x, u, params: [pulses[min(int(2 * t), 199)]], None, inputs=0, outputs=1,
        states=1, name="driven",
    )  # fmt: skip
    made = nlctl.input_output_response(system, [0, 100], 0, 0, engine="native")
    np.testing.assert_allclose(made.states[0, -1], 0.5, rtol=0, atol=1e-5)
