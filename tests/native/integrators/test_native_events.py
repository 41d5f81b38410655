"""Corners and switches against closed forms: dead zones, relays, sliding, accumulating events."""

import itertools
from typing import Any

import numpy as np
import pytest
from numba.core import config
from scipy.integrate import quad
from scipy.special import ber

import nlctl
from nlctl.native import Status
from nlctl.native.integrate.methods.tsit5 import TSIT5

run: Any = nlctl.input_output_response
needs_jit = pytest.mark.skipif(getattr(config, "DISABLE_JIT", False), reason="thousands of steps")


@nlctl.record
class Oscillator:
    """u'' = -u from (a sin phase, a cos phase): u = a sin(t + phase)."""

    a: float = 2.0
    phase: float = 0.0

    inputs, outputs, states, feedthrough = (), ("u",), ("u", "du"), False

    @property
    def initial(self):
        return {"u": self.a * np.sin(self.phase), "du": self.a * np.cos(self.phase)}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], -x[0]

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


@nlctl.record
class Kink:
    """v = u - 1 above 1, otherwise 0, without declaring the corner."""

    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (np.maximum(u[0] - 1.0, 0.0),)


@nlctl.record
class Hidden(Kink):
    """The same, of a function that is called as it stands: nobody knows of the corner."""

    @staticmethod
    def output(t, x, u, p):
        height = float(u[0]) + 0.0 * ber(u[0])
        return (height - 1.0 if height > 1.0 else 0.0,)


@nlctl.record
class Located(Kink):
    """The same, with its corner declared."""

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return (u[0] - 1.0,)


@nlctl.record
class Lag:
    """x' = -a x + gain v + c."""

    a: float = nlctl.param(1.0, unit="1/s", meaning="rate")
    gain: float = nlctl.param(1.0, unit="1/s", meaning="gain")
    c: float = nlctl.param(0.0, unit="1/s", meaning="drift")
    takes: str = "v"
    delivers: str = "x"

    states, feedthrough = ("x",), False

    @property
    def inputs(self):
        return (self.takes,)

    @property
    def outputs(self):
        return (self.delivers,)

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (-p.a * x[0] + p.gain * u[0] + p.c,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)


@nlctl.record
class Relay:
    """v = -height once x > on, +height once x < off, otherwise as before."""

    on: float = nlctl.param(1.0, unit="1", meaning="upper threshold")
    off: float = nlctl.param(-1.0, unit="1", meaning="lower threshold")
    height: float = nlctl.param(2.0, unit="1", meaning="height", above=0)
    takes: str = "x"
    delivers: str = "v"

    states, memory, feedthrough = ("side",), ("side",), False
    initial = {"side": 1.0}

    @property
    def inputs(self):
        return (self.takes,)

    @property
    def outputs(self):
        return (self.delivers,)

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return (0.0,)

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (p.height * x[0],)

    @staticmethod
    @nlctl.equation
    def commit(t, x, u, p):
        if u[0] > p.on:
            return (-1.0,)
        if u[0] < p.off:
            return (1.0,)
        return (x[0],)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return u[0] - p.on, u[0] - p.off


@nlctl.record
class Sign:
    """v = -sign(x), an ideal relay."""

    inputs, outputs, states, feedthrough = ("x",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (-np.sign(u[0]),)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return (u[0],)


@nlctl.record
class Mass:
    """x'' = v from rest at x = 0.5."""

    inputs, outputs, states, feedthrough = ("v",), ("x", "dx"), ("x", "dx"), False
    initial = {"x": 0.5}

    @staticmethod
    @nlctl.equation
    def update(t, x, u, p):
        return x[1], u[0]

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return x[0], x[1]


def joined(*, inputs=(), **blocks):
    return nlctl.compile(nlctl.interconnect(blocks, inputs=inputs))


def last(made, name):
    """Return the last value of a state."""
    return float(made.states[list(made.state_labels).index(name), -1])


class TestDeadZone:
    """x' = dead zone of a sine, with its corners located."""

    def test_a_period_has_its_closed_form(self):
        """With unit slopes and breaks at -0.3 and 0.5, from the areas under two caps."""
        zone = nlctl.DeadZone(slope_l=1.0, ripple_l=0.0, ripple_r=0.0)
        loop = joined(wave=Oscillator(), zone=zone, sum=Lag(a=0.0))

        def cap(b):
            start = np.arcsin(b / 2)
            return 2 * (2 * np.cos(start) - b * (np.pi / 2 - start))

        made = run(loop, 2 * np.pi * np.arange(4), rtol=1e-10, atol=1e-12)
        exact = np.arange(4) * (cap(0.5) - cap(0.3))
        np.testing.assert_allclose(made.states[2], exact, atol=1e-9)
        assert made.statistics.events == 12

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
    def test_the_published_slopes_match_quadrature(self, method):
        """x' = -x + v with slopes that depend on the input."""
        zone, end = nlctl.DeadZone(), 9.0
        loop = joined(wave=Oscillator(), zone=zone, sum=Lag())
        made = run(loop, [0, end], rtol=1e-10, atol=1e-12, method=method)

        def density(s):
            return zone.output(s, (), (2 * np.sin(s),), zone)[0] * np.exp(s - end)

        corners = [np.arcsin(0.25), np.pi - np.arcsin(0.25), np.pi + np.arcsin(0.15)]
        corners += [2 * np.pi - np.arcsin(0.15), 2 * np.pi + np.arcsin(0.25), 9.0]
        corners += [3 * np.pi - np.arcsin(0.25)]
        ends = [0.0, *sorted(c for c in corners if c <= end)]
        exact = sum(quad(density, a, b, epsabs=1e-13)[0] for a, b in itertools.pairwise(ends))
        assert last(made, "sum_x") == pytest.approx(exact, abs=1e-9)


@pytest.fixture(scope="module")
def loops():
    """The integral of a corner that is declared, of one that is not, and of one that is hidden."""
    return {
        kind: joined(wave=Oscillator(), kink=kind(), sum=Lag(a=0.0))
        for kind in (Kink, Hidden, Located)
    }


@pytest.fixture(scope="module")
def lag():
    """A relay that drives what it looks at."""
    return joined(plant=Lag(), relay=Relay())


class TestOrder:
    """A corner inside a step costs the order, a located one does not."""

    def errors(self, loop, method="tsit5"):
        """Root mean square error of x(2) for 8, 16, 32 and 64 steps, the corner anywhere in one."""
        rows, how = [], {"method": method, "rtol": 1e-13}  # of the corner's place
        for phase in 0.02 + 0.25 * ((np.arange(16) * 0.6180339887) % 1.0):
            start = {"wave.u": 2 * np.sin(phase), "wave.du": 2 * np.cos(phase)}
            corner = np.pi / 6 - phase
            exact = 2 * np.cos(np.pi / 6) - 2 * np.cos(2 + phase) - (2 - corner)
            rows.append(
                [
                    last(run(loop, [0, 2], 0, start, step=2 / n, **how), "sum_x") - exact
                    for n in (8, 16, 32, 64)
                ]
            )
        return np.sqrt(np.mean(np.square(rows), axis=0))

    def test_order_five_with_the_corner_located(self, loops):
        """The mean order of the stiff method over three halvings of a fixed step."""
        errors = self.errors(loops[Located], "rodas5p")
        assert np.log2(errors[0] / errors[-1]) / 3 > 4.5

    def test_the_explicit_pair_loses_one_small_local_error(self, loops):
        """Its sixth stage, at the end of a step, misses u there by d h^2 u''; see the other side.

        With |u''| = 1 at the corner that costs at most b_6 |d| h^3, once, beside the order five.
        """
        errors, h = self.errors(loops[Located]), 2 / np.array([8, 16, 32, 64])
        A, C = TSIT5.pair().A[:, : TSIT5.stages], TSIT5.pair().C
        missed = A[6, 5] * abs(A[5] @ C - C[5] ** 2 / 2)
        assert missed < 0.011
        assert np.all(errors < 2e-4 * h**5 + missed * h**3)

    def test_a_corner_that_is_not_declared_is_located_as_well(self, loops):
        """It is seen in the graph: the order of the stiff method stays as it is."""
        errors = self.errors(loops[Kink], "rodas5p")
        assert np.log2(errors[0] / errors[-1]) / 3 > 4.5
        declared = self.errors(loops[Located])
        assert np.all(self.errors(loops[Kink]) < 1.1 * declared)

    def test_order_two_with_the_corner_ignored(self, loops):
        """The same block whose function is called as it stands."""
        errors = self.errors(loops[Hidden])
        assert 1.5 < np.log2(errors[0] / errors[-1]) / 3 < 2.6
        assert errors[-1] > 100 * self.errors(loops[Located])[-1]

    def test_a_corner_takes_a_few_attempts(self, loops):
        """Ten corners in 30 s: not more work than to step over them, and no part of the error."""
        kinds = (Hidden, Located, Kink)
        runs = [run(loops[kind], [0, 30], rtol=1e-9, atol=1e-11) for kind in kinds]
        ignored, *found = (m.statistics.accepted + m.statistics.rejected for m in runs)
        assert [m.statistics.events for m in runs] == [0, 10, 10]
        assert max(found) < 1.1 * ignored
        cap = 2 * (2 * np.cos(np.pi / 6) - np.pi / 3)  # area of a cap above 1
        for made in runs[1:]:
            assert last(made, "sum_x") == pytest.approx(5 * cap, abs=1e-8)


class TestRelay:
    """Relays with hysteresis: limit cycles of known period."""

    @pytest.mark.parametrize(("height", "width"), [(2.0, 1.0), (1.5, 0.2), (10.0, 1.0)])
    def test_a_lag_oscillates_with_its_period(self, lag, height, width):
        """Period 2 ln((h + w) / (h - w)) from threshold to threshold and back."""
        half = np.log((height + width) / (height - width))
        params = {"relay.height": height, "relay.on": width, "relay.off": -width}
        times = half * np.linspace(0, 10, 41)
        made = run(lag, times, 0, {"plant.x": -width, "relay.side": 1.0}, params=params, rtol=1e-10)
        phase = times % (2 * half)
        rise = height - (height + width) * np.exp(-phase)
        fall = -height + (height + width) * np.exp(-(phase - half))
        exact = np.where(phase < half, rise, fall)
        np.testing.assert_allclose(made.states[0], exact, atol=1e-7 * height)
        away = (phase % half > 1e-3) & (phase % half < half - 1e-3)
        side = np.where(phase < half, 1.0, -1.0)
        np.testing.assert_array_equal(made.states[1, away], side[away])
        np.testing.assert_array_equal(made.outputs[1, away], height * side[away])

    def test_an_integrator_draws_a_triangle(self, lag):
        """Slope +-2 between -1 and 1: period 2."""
        params, times = {"plant.a": 0.0}, np.linspace(0, 9, 91)
        exact = 1 - abs((2 * times + 1) % 4 - 2)
        for rtol in (1e-6, 1e-8, 1e-10):
            made = run(lag, times, 0, {"plant.x": 0.0}, params=params, rtol=rtol)
            np.testing.assert_allclose(made.states[0], exact, atol=500 * rtol)

    def test_it_switches_at_a_sample_of_the_input_that_meets_the_threshold(self):
        """u reaches the threshold exactly, just before or just after a corner of the input."""
        loop = joined(relay=Relay(height=1.0), sum=Lag(a=0.0, delivers="y"), inputs=["x"])
        times = np.array([0.0, 1.0, 2.0, 3.0])
        for middle in (1.0, 1 - 1e-6, 1 - 1e-9, 1 - 1e-13, 1 + 1e-6, 1 + 1e-12):
            made = run(loop, times, [0.0, middle, 2.0, 2.0])
            switch = np.interp(1.0, [0.0, middle, 2.0], [0.0, 1.0, 2.0])
            assert last(made, "sum_x") == pytest.approx(2 * switch - 3, abs=1e-6)
            assert abs(made.states[0]).max() == 1.0

    def test_it_starts_on_the_threshold(self):
        """At rest on the threshold nothing happens; leaving it, the relay switches at once."""
        loop = joined(relay=Relay(height=1.0), sum=Lag(a=0.0, delivers="y"), inputs=["x"])
        for rest in (0, 1, 3):
            u = [1.0] * (rest + 1) + [2.0] * 2
            made = run(loop, np.arange(len(u)), u)
            assert last(made, "sum_x") == pytest.approx(rest - 2, abs=1e-6)
            assert abs(made.states[0]).max() == 1.0

    def test_relays_in_a_chain_switch_together(self):
        """Each sees the one before it switch, in the same instant."""
        relays = {
            f"r{i}": Relay(height=1.0, takes=f"s{i}", delivers=f"s{i + 1}", on=0.5, off=-0.5)
            for i in range(4)
        }
        loop = joined(**relays, sum=Lag(a=0.0, takes="s4", delivers="y"), inputs=["s0"])
        start = {"r0.side": 1.0, "r1.side": -1.0, "r2.side": 1.0, "r3.side": -1.0}
        made = run(loop, [0, 1.0, 3.0], [0.0, 1.0, 1.0], start)
        assert last(made, "sum_x") == pytest.approx(-0.5 + 2.5, abs=1e-6)


class TestIdealRelay:
    """Switching without hysteresis."""

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
    def test_a_mass_under_bang_bang_keeps_its_energy(self, method):
        """x'' = -sign x: arcs of parabolas, |x| + x'^2 / 2 = 0.5, period 4."""
        loop = joined(mass=Mass(), relay=Sign())
        times = np.linspace(0, 12, 25)
        made = run(loop, times, rtol=1e-9, atol=1e-11, method=method)
        x, dx = made.states
        np.testing.assert_allclose(abs(x) + dx**2 / 2, 0.5, atol=2e-7)
        np.testing.assert_allclose(x[::8], 0.5, atol=1e-6)
        assert made.statistics.events == 6

    @pytest.mark.parted
    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor", "auto"])
    def test_sliding_ends_with_a_status(self, method):
        """x' = 0.5 - 1.5 sign x slides from t = 0.5 on: no run may take that for a motion."""
        loop = joined(plant=Lag(a=0.0, gain=1.5, c=0.5), relay=Sign())
        made = run(
            loop, [0, 1.0], 0, {"plant.x": 0.5}, method=method, max_steps=30_000, ignore_errors=True
        )
        assert made.statistics.time > 0.49
        if made.statistics.status is Status.OK:
            assert abs(made.states[0, -1]) < 1e-6
        else:
            assert made.statistics.status is Status.CHATTERING

    @pytest.mark.parted
    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor", "auto"])
    def test_a_chattering_memory_ends_with_a_status(self, method):
        """A relay with memory whose thresholds coincide: x stays at them, or the run ends."""
        loop = joined(plant=Lag(a=0.0, c=0.5), relay=Relay(on=0.0, off=0.0, height=1.0))
        start = {"plant.x": 0.5, "relay.side": -1.0}
        made = run(
            loop,
            np.linspace(0, 5, 51),
            0,
            start,
            method=method,
            max_steps=30_000,
            ignore_errors=True,
        )
        assert made.statistics.time > 0.99
        late = made.states[0, made.time > 1.01]
        assert np.all(abs(late) < 1e-4)
        assert made.statistics.status in (Status.OK, Status.CHATTERING, Status.STEP_TOO_SMALL)


@nlctl.record
class Accumulating:
    """u = s^3 sin(1 / s), s = 1 - t: turns that accumulate at t = 1."""

    inputs, outputs, states, feedthrough = (), ("u",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        s = 1.0 - t
        return (s * s * s * np.sin(1.0 / s) if abs(s) > 1e-9 else 0.0,)


@needs_jit
def test_turns_that_accumulate_do_not_stop_a_play():
    """Infinitely many turns before t = 1: the run goes through them and ends."""
    narrow = nlctl.Backlash(c_l=-1e-4, c_r=1e-4, m_l=1.0, m_r=1.0)
    loop = joined(wave=Accumulating(), play=narrow, sum=Lag())
    made = run(loop, np.linspace(0, 1.9, 20), max_steps=200_000)
    assert made.statistics.status is Status.OK
    value, fine = 0.0, np.linspace(0, 1.9, 4_000_001)
    s = 1 - fine
    with np.errstate(divide="ignore", invalid="ignore"):
        u = np.where(abs(s) > 1e-9, s**3 * np.sin(1 / s), 0.0)
    for a in u[np.r_[0, 1 + np.flatnonzero(np.diff(np.sign(np.diff(u)))), -1]]:
        value = min(max(value, a - 1e-4), a + 1e-4)
    assert made.outputs[1, -1] == pytest.approx(value, abs=1e-6)
