"""Describing functions and relay oscillations: published formulas, exact periods, simulation."""

import functools

import control as ct
import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.optimize import brentq

import nlctl


def sine(t, x, u, params):
    """u = A sin t."""
    return [params["A"] * np.sin(t)]


def harmonic(t, x, u, params):
    """The integrands of the first Fourier coefficients of v."""
    return [u[0] * np.sin(t), u[0] * np.cos(t)]


def source_and_sink():
    """Return the sine of amplitude A, and the integrator of Fourier coefficients."""
    source = ct.nlsys(None, sine, inputs=0, outputs=["u"], params={"A": 1.0}, name="source")
    sink = ct.nlsys(
        harmonic, lambda t, x, u, params: x, inputs=["v"], outputs=["a", "b"], states=2, name="sink"
    )
    return source, sink


@functools.cache
def compiled(kind):
    source, sink = source_and_sink()
    blocks = [source, nlctl.block(kind(), "actuator"), sink]
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["v", "a", "b"], name="rig"))


SAMPLES = 4096


def first_harmonic(kind, A, **params):
    """Return N(A) by Fourier integrals along the run, and by FFT of its samples, of one period.

    The second period is taken: by then memories have forgotten where they started.
    """
    times = np.linspace(0, 4 * np.pi, 2 * SAMPLES + 1)
    named = {f"actuator.{name}": value for name, value in params.items()} | {"A": A}
    run = nlctl.input_output_response(compiled(kind), times, params=named, rtol=1e-10, atol=1e-12)
    v, a, b = run.outputs
    integrals = (a[-1] - a[SAMPLES] + 1j * (b[-1] - b[SAMPLES])) / (np.pi * A)
    coefficient = np.fft.rfft(v[SAMPLES:-1])[1] * 2 / SAMPLES / A
    return integrals, 1j * coefficient


def of_saturation(h):
    """Describing function of clip(u / A, -h, h) for unit amplitude, h = limit / A."""
    h = min(h, 1.0)
    return 2 / np.pi * (np.arcsin(h) + h * np.sqrt(1 - h**2))


def of_play(h):
    """Of the play of half gap h for unit amplitude: Gelb and Vander Velde, appendix B."""
    if h >= 1:
        return 0.0
    s = 1 - 2 * h
    real = (np.pi / 2 + np.arcsin(s) + s * np.sqrt(1 - s**2)) / np.pi
    return real - 1j * 4 * h * (1 - h) / np.pi


def of_relay(h, height):
    """Of the relay with thresholds +-h for unit amplitude."""
    return 4 * height / np.pi * (np.sqrt(1 - h**2) - 1j * h) if h < 1 else 0.0


def of_relay_pair(on, off):
    """Of a relay of height 1 for unit amplitude, by its Fourier integrals: +1 from on to off."""
    if max(on, -off) >= 1:
        return 0.0
    return 2 / np.pi * (np.sqrt(1 - on**2) + np.sqrt(1 - off**2) - 1j * (on - off))


amplitudes = st.floats(0.3, 5).map(lambda v: round(v, 3))
shares = st.floats(0.05, 1.4).map(lambda v: round(v, 3)).filter(lambda h: abs(h - 1) > 0.02)


class TestDescribingFunctions:
    """Formula, Fourier integrals with all events located, and FFT."""

    @given(A=amplitudes, h=shares)
    @settings(max_examples=8)
    def test_of_the_saturation(self, A, h):
        """Gain 1 below the limit."""
        found, by_fft = first_harmonic(nlctl.Saturation, A, limit=h * A)
        assert found == pytest.approx(of_saturation(h), abs=1e-8)
        assert by_fft == pytest.approx(of_saturation(h), abs=1e-6)

    @given(A=amplitudes, h=shares)
    @settings(max_examples=8)
    def test_of_the_dead_zone(self, A, h):
        """With saturation of the same width it adds up to 1."""
        flat = {"slope_r": 1.0, "slope_l": 1.0, "ripple_r": 0.0, "ripple_l": 0.0}
        found, by_fft = first_harmonic(nlctl.DeadZone, A, b_r=h * A, b_l=-h * A, **flat)
        assert found == pytest.approx(1 - of_saturation(h), abs=1e-8)
        assert by_fft == pytest.approx(1 - of_saturation(h), abs=1e-6)

    @given(A=amplitudes, h=shares)
    @settings(max_examples=8)
    def test_of_the_play(self, A, h):
        """It lags; with the stop it adds up to 1."""
        gap = {"m_r": 1.0, "m_l": 1.0, "c_r": h * A, "c_l": -h * A}
        found, by_fft = first_harmonic(nlctl.Backlash, A, **gap)
        assert found == pytest.approx(of_play(h), abs=1e-8)
        assert by_fft == pytest.approx(of_play(h), abs=1e-6)
        found, _ = first_harmonic(nlctl.actuators.Stop, A, r=h * A)
        assert found == pytest.approx(1 - of_play(h), abs=1e-8)

    @given(A=amplitudes)
    @settings(max_examples=4)
    def test_of_the_sum_of_plays(self, A):
        """It is linear in the operator."""
        spec = nlctl.actuators.PrandtlIshlinskii()
        plays = [w * of_play(r / A) for w, r in zip(spec.w, spec.r, strict=True)]
        found, _ = first_harmonic(nlctl.actuators.PrandtlIshlinskii, A)
        assert found == pytest.approx(spec.w_0 + sum(plays), abs=1e-8)

    @given(A=amplitudes)
    @settings(max_examples=4)
    def test_of_the_inverse_of_a_sum_of_plays(self, A):
        """A sum of plays with the inverse loading curve."""
        spec = nlctl.actuators.PrandtlIshlinskiiInverse()
        r, slopes = np.array(spec.r), spec.w_0 + np.cumsum([0.0, *spec.w])
        thresholds = spec.w_0 * r + np.maximum(r[:, None] - r, 0) @ np.array(spec.w)
        plays = [of_play(each / A) for each in thresholds]
        found, by_fft = first_harmonic(nlctl.actuators.PrandtlIshlinskiiInverse, A)
        wanted = 1 / spec.w_0 + np.diff(1 / slopes) @ plays
        assert found == pytest.approx(wanted, abs=1e-8)
        assert by_fft == pytest.approx(wanted, abs=1e-6)

    @given(A=amplitudes.filter(lambda A: min(abs(A - k / 4) for k in range(20)) > 0.02))
    @settings(max_examples=6)
    def test_of_a_preisach_operator(self, A):
        """The sum of its relays, whose thresholds are not symmetric."""
        spec = nlctl.actuators.Preisach()
        relays = [
            w * of_relay_pair(on / A, off / A) / A
            for on, off, w in zip(spec.alpha, spec.beta, spec.w, strict=True)
        ]
        found, by_fft = first_harmonic(nlctl.actuators.Preisach, A)
        assert found == pytest.approx(sum(relays), abs=1e-6)
        assert by_fft == pytest.approx(sum(relays), abs=1e-2)

    @given(A=amplitudes, h=shares, height=amplitudes)
    @settings(max_examples=8)
    def test_of_the_relay(self, A, h, height):
        """Jumps between samples cost the FFT its accuracy, not the integrals."""
        on = {"on": h * A, "off": -h * A, "height": height * A}
        found, by_fft = first_harmonic(nlctl.Relay, A, **on)
        assert found == pytest.approx(of_relay(h, height), abs=1e-7 * height)
        assert by_fft == pytest.approx(of_relay(h, height), abs=4e-3 * height)


def lag(omega, zeta):
    """Return A, B, C of x'' + 2 zeta omega x' + omega^2 x = omega^2 v."""
    A = np.array([[0.0, 1.0], [-(omega**2), -2 * zeta * omega]])
    return A, np.array([0.0, omega**2]), np.array([1.0, 0.0])


def half_cycle(omega, zeta, h):
    """Return x(0) of the symmetric cycle whose relay is at +1 for a time h, then at -1.

    x(h) = e^{A h} x(0) + A^{-1} (e^{A h} - I) B = -x(0).
    """
    A, B, _ = lag(omega, zeta)
    E = expm(A * h)
    return -np.linalg.solve(np.eye(2) + E, np.linalg.solve(A, (E - np.eye(2)) @ B))


@pytest.mark.parametrize(("omega", "zeta", "width"), [(1, 0.5, 0.3), (2, 1, 0.1), (1, 2, 0.2)])
def test_a_relay_around_a_second_order_lag_has_the_period_of_tsypkin(omega, zeta, width):
    """Half a period solves -C x(h) = off with x(h) = -x(0): Tsypkin, Relay Control Systems, 1984.

    The relay sees -y, switches to +1 where y falls to -width, and drives the lag.
    """
    C = lag(omega, zeta)[2]
    h = brentq(lambda h: C @ half_cycle(omega, zeta, h) + width, 1e-2, 20.0, xtol=1e-14)
    x0 = half_cycle(omega, zeta, h)
    loop = nlctl.compile(oscillator(omega, zeta, width))
    times = h * np.arange(0, 12, 0.25)
    start = {"plant.v": x0[0], "plant.v1": x0[1], "relay.side": 1.0}
    run = nlctl.input_output_response(loop, times, 0, start, rtol=1e-11, atol=1e-13)
    signs = np.repeat([1.0, -1.0] * 6, 4)
    quarter = run.states[:2].T * signs[:, None]
    np.testing.assert_allclose(quarter, np.tile(quarter[:4], (12, 1)), atol=1e-7)
    inside = np.arange(48) % 4 != 0
    np.testing.assert_array_equal(run.outputs[1, inside], signs[inside])


def oscillator(omega, zeta, width):
    """Return the relay in feedback with the lag."""
    minus = ct.nlsys(None, lambda t, x, u, p: [-u[0]], inputs=["y"], outputs=["e"], name="minus")
    plant = nlctl.block(nlctl.actuators.SecondOrderLag(omega=omega, zeta=zeta), "plant")
    relay = nlctl.block(nlctl.Relay(on=width, off=-width), "relay")
    return ct.interconnect(
        [plant, relay, minus],
        connections=[["plant.u", "relay.v"], ["minus.y", "plant.v"], ["relay.u", "minus.e"]],
        inputs=[],
        outlist=["plant.v", "relay.v"],
        outputs=["y", "s"],
        name="oscillator",
    )


class TestPythonControls:
    """`ct.describing_function` takes every block, and what it predicts is simulated."""

    PAIRS = (
        (nlctl.Saturation(limit=0.7), ct.saturation_nonlinearity(0.7)),
        (nlctl.Relay(on=0.4, off=-0.4), ct.relay_hysteresis_nonlinearity(1.0, 0.4)),
        (
            nlctl.Backlash(c_r=0.3, c_l=-0.3, m_r=1.0, m_l=1.0),
            ct.friction_backlash_nonlinearity(0.6),
        ),
    )

    @pytest.mark.parametrize(("record", "theirs"), PAIRS, ids=lambda each: type(each).__name__)
    def test_it_is_that_of_python_controls_own_nonlinearities(self, record, theirs):
        """Closed forms there, simulation here."""
        A = np.array([[0.5, 1.0], [2.0, 5.0]])
        found = ct.describing_function(nlctl.block(record, "block"), A)
        assert found.shape == A.shape
        np.testing.assert_allclose(found, np.vectorize(theirs.describing_function)(A), atol=1e-7)

    @given(A=amplitudes, omega=st.floats(0.1, 10))
    @settings(max_examples=8, deadline=None)
    def test_of_a_lag_it_is_the_frequency_response(self, A, omega):
        """1 / (1 + j omega T), whatever the amplitude; python-control asks for no frequency."""
        lag = nlctl.block(nlctl.Lag(T=0.5), "lag")
        found = nlctl.describing_function(lag, A, omega)
        assert found == pytest.approx(1 / (1 + 0.5j * omega), abs=1e-6)
        with pytest.raises(nlctl.errors.UsageError, match="depends on the frequency"):
            ct.describing_function(lag, A)

    @given(A=amplitudes, h=shares, omega=st.floats(0.1, 10))
    @settings(max_examples=8, deadline=None)
    def test_of_memories_it_is_the_same_at_every_frequency(self, A, h, omega):
        """And parameters are overridden by name."""
        play = nlctl.block(nlctl.Backlash(m_r=1.0, m_l=1.0), "play")
        params = {"play.c_r": h * A, "play.c_l": -h * A}
        found = nlctl.describing_function(play, A, omega, params=params)
        assert found == pytest.approx(of_play(h), abs=1e-6)

    @pytest.mark.weekly
    @given(width=st.floats(0.02, 0.3))
    @settings(max_examples=4, deadline=None)
    def test_the_simulated_cycle_of_a_relay_is_tsypkins(self, width):
        """G = 1 / (s (s + 1)): tanh(h / 2) - h / 2 + width = 0 for half a period h."""
        relay = nlctl.block(nlctl.Relay(on=width, off=-width), "relay")
        h = brentq(lambda h: np.tanh(h / 2) - h / 2 + width, 1e-3, 20)
        A = np.linspace(1.05 * width, 2, 80)
        (cycle,) = nlctl.limit_cycles(ct.tf([1], [1, 1, 0]), relay, A, np.logspace(-1, 1.5, 400))
        assert cycle.omega == pytest.approx(np.pi / h, rel=1e-5)
        assert cycle.omega == pytest.approx(cycle.predicted_omega, rel=0.05)
        assert cycle.found == "it settles"

    def test_a_cycle_that_is_not_stable_is_said_not_to_settle(self):
        """x'' = x + ... behind a dead zone: from just inside of the predicted cycle it dies out."""
        zone = nlctl.block(nlctl.DeadZone(ripple_r=0, ripple_l=0, slope_l=1, b_l=-0.5), "zone")
        G = ct.tf([8], [1, 2, 2, 1])
        (cycle,) = nlctl.limit_cycles(G, zone, np.linspace(0.6, 3, 20), np.logspace(-1, 1, 300))
        assert cycle.found != "it settles"
        assert np.isnan(cycle.omega)

    def test_the_plot_has_the_simulated_cycle_on_the_nyquist_curve(self):
        """Below both curves of python-control's plot; at G(j omega) of its own frequency."""
        mpl.use("Agg")
        G = ct.tf([8], [1, 2, 2, 1])
        limit = nlctl.block(nlctl.Saturation(limit=1.0), "limit")
        A = np.linspace(1.2, 5, 12)
        (cycle,) = nlctl.limit_cycles(G, limit, A)
        (cross,) = nlctl.describing_function_plot(G, limit, A).lines[-1]
        mpl.pyplot.close("all")
        at = G(1j * cycle.omega)
        assert (cross.get_xdata()[0], cross.get_ydata()[0]) == pytest.approx((at.real, at.imag))

    def test_what_is_refused(self):
        """Amplitudes that are not positive, and blocks with more signals."""
        limit = nlctl.block(nlctl.Saturation(), "limit")
        for wrong in (0.0, -1.0, np.nan, "2", [1.0, 0.0]):
            with pytest.raises(nlctl.errors.ParameterError, match="amplitudes > 0"):
                nlctl.describing_function(limit, wrong)
        with pytest.raises(nlctl.errors.ParameterError, match="one input and one output"):
            nlctl.describing_function(nlctl.block(nlctl.PID(), "law"), 1.0)
        with pytest.raises(nlctl.errors.ParameterError, match="two amplitudes > 0 or more"):
            nlctl.limit_cycles(ct.tf([1], [1, 1]), limit, [1.0])


def test_a_block_without_states_takes_a_number():
    """As a function; with states it is not one."""
    zone = nlctl.block(nlctl.DeadZone(b_r=0, b_l=0, ripple_r=0, ripple_l=0, slope_l=2), "zone")
    assert [float(zone(u)) for u in (-0.5, 0.0, 0.25)] == [-1.0, 0.0, 0.25]
    assert np.isnan(zone(np.nan))
    with pytest.raises(TypeError, match="static"):
        nlctl.block(nlctl.Lag(), "lag")(1.0)
