"""Sources against closed forms: integrals, Fourier series, phases; no pulse is stepped over."""

import control as ct
import numpy as np
import pytest
import scipy.signal
import scipy.special
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

ENGINES = ("native", "python-control")
every_engine = pytest.mark.parametrize("engine", ENGINES)


def value(spec, t):
    """Return a source's value at each time."""
    p, none = equation_arguments(spec), np.zeros(0)
    return np.array([spec.output(s, none, none, p)[0] for s in np.atleast_1d(t)])


def integral(spec, until, engine="native"):
    """Return the integral of a source from 0, by a run of which only the ends are asked for."""
    integrator = ct.ss(0, 1, 1, 0, inputs="ref", outputs="y", name="integrator")
    loop = nlctl.interconnect({"source": spec, "integrator": integrator}, outputs=["y"])
    return nlctl.input_output_response(loop, [0.0, until], engine=engine).outputs.ravel()[-1]


class TestNothingIsSteppedOver:
    """The runs begin and stay at rest: error control alone would see none of this."""

    @every_engine
    @each_row("width", [1.0, 1e-3, 1e-6])
    def test_a_pulse(self, width, engine):
        """Height times width, one pulse in 1000 s."""
        spec = nlctl.sources.Pulse(height=2.0, t_start=612.3, width=width)
        assert integral(spec, 1000.0, engine) == pytest.approx(2.0 * width, rel=1e-5)

    @every_engine
    def test_a_train(self, engine):
        """Every one of 200 pulses of a millisecond; the last is cut in half by the end."""
        spec = nlctl.sources.PulseTrain(height=3.0, t_start=0.25, width=1e-3, period=0.5)
        assert integral(spec, 100.0, engine) == pytest.approx(200 * 3e-3, rel=1e-6)
        assert integral(spec, 99.7505, engine) == pytest.approx(199.5 * 3e-3, rel=1e-6)

    @every_engine
    def test_a_square(self, engine):
        """The mean of a period is amplitude (2 duty - 1), here of 20 and a fifth, all high."""
        spec = nlctl.sources.Square(amplitude=2.0, period=0.7, duty=0.3)
        expected = 20 * 0.7 * 2.0 * (-0.4) + 0.14 * 2.0
        assert integral(spec, 20.2 * 0.7, engine) == pytest.approx(expected, rel=1e-7)

    @pytest.mark.parted
    @every_engine
    @each_row("periodic", [False, True])
    def test_a_spike_in_a_table(self, periodic, engine):
        """A triangle of 0.1 ms, once or a hundred times."""
        spec = nlctl.sources.TimeTable(
            times=(0.0, 0.6, 0.6001, 0.6002, 1.0), values=(0, 0, 1, 0, 0), periodic=periodic
        )
        wanted = 1e-4 * (100 if periodic else 1)
        assert integral(spec, 100.0, engine) == pytest.approx(wanted, rel=1e-6)

    @pytest.mark.slow
    @each_row("hold", [False, True])
    def test_long_tables(self, hold):
        """A thousand points at random times: trapezoids, or rectangles."""
        rng = np.random.default_rng(5)
        times = np.append(0.0, np.cumsum(rng.exponential(size=999)))
        values = rng.normal(size=1000)
        exact = np.diff(times) @ values[:-1] if hold else np.trapezoid(values, times)
        spec = nlctl.sources.TimeTable(times=times, values=values, hold=hold)
        assert integral(spec, times[-1]) == pytest.approx(exact, rel=1e-6)

    def test_the_jumps_are_solved_before_the_run(self):
        """At t_start + k period and a width later, to the last digits; nothing is opaque."""
        train = nlctl.sources.PulseTrain(t_start=0.3, width=0.1, period=0.7)
        integrator = ct.ss(0, 1, 1, 0, inputs="ref", outputs="y", name="integrator")
        loop = nlctl.interconnect({"train": train, "integrator": integrator}, outputs=["y"])
        run = nlctl.input_output_response(loop, [0.0, 10.0])
        k = np.arange(14)
        edges = np.sort(np.concatenate([0.3 + 0.7 * k, 0.4 + 0.7 * k]))
        found = np.unique(run.events["time"].round(12))
        np.testing.assert_allclose(found, edges[edges < 10], atol=1e-12)
        assert not run.statistics.opaque

    def test_points_of_a_table_are_solved_before_the_run(self):
        """Two of them 10 us apart in 1000 s, and all of a table that repeats."""
        integrator = ct.ss(0, 1, 1, 0, inputs="ref", outputs="y", name="integrator")
        times = np.array([0.0, 100.3, 700.1, 700.10001, 1000.0])
        for periodic, until in ((False, 1000.0), (True, 2500.0)):
            table = nlctl.sources.TimeTable(times=times, values=(1, 2, 3, 4, 1), periodic=periodic)
            loop = nlctl.interconnect({"table": table, "integrator": integrator}, outputs=["y"])
            run = nlctl.input_output_response(loop, [0.0, until])
            every = np.unique(np.add.outer((0.0, 1000.0, 2000.0), times).ravel())
            inside = every[(every > 0.0) & (every < until)]
            found = np.unique(run.events["time"].to_numpy())
            off = [np.abs(found - each).min() for each in inside]
            assert max(off) < 1e-9


class TestStepRampSine:
    @given(st.floats(-5, 5), st.floats(-5, 5))
    def test_a_ramp_is_the_integral_of_a_step(self, t, start):
        """And its offset is where it begins."""
        ramp = nlctl.sources.Ramp(slope=1.5, t_start=start, offset=0.5)
        step = nlctl.Step(height=1.5, t_step=start)
        assert value(ramp, t)[0] == 0.5 + value(step, t)[0] * (t - start)

    def test_a_sine_is_one_of_a_sum_of_sines(self):
        t = np.linspace(-3, 3, 50)
        one = nlctl.Sine(amplitude=2.0, omega=3.0, phase=0.4)
        many = nlctl.SumOfSines(order=0, amplitudes=2.0, frequencies=3.0, phases=0.4)
        np.testing.assert_allclose(value(one, t), value(many, t), rtol=1e-14, atol=1e-15)


class TestSquare:
    @each_row("duty", [0.5, 0.2])
    def test_its_fourier_coefficients(self, duty):
        """Of period T: a_n - i b_n = 4 A / (2 pi i n) (1 - exp(-2 pi i n duty))."""
        spec = nlctl.sources.Square(amplitude=1.5, period=2.0, duty=duty, t_start=0.0)
        n, count = np.arange(1, 8), 1_000_000
        t = (np.arange(count) + 0.5) / count * 2.0  # between the jumps, which are at samples / 2
        high = (t % 2.0) < duty * 2.0
        assert np.array_equal(value(spec, t[::1000]) > 0, high[::1000])
        wave = np.where(high, 1.5, -1.5)
        found = [2 * np.mean(wave * np.exp(-1j * np.pi * k * t)) for k in n]
        exact = 4 * 1.5 / (2j * np.pi * n) * (1 - np.exp(-2j * np.pi * n * duty))
        np.testing.assert_allclose(found, exact, atol=1e-9)

    @given(st.integers(0, 10_000), st.floats(1e-3, 10), st.floats(-10, 10))
    def test_a_period_that_has_begun_has_begun(self, k, period, start):
        """At start + k period the wave is high, however the sum was rounded."""
        spec = nlctl.sources.Square(period=period, t_start=start, duty=0.5)
        t = start + k * period
        if abs(start) <= k * period or k == 0:
            assert value(spec, t)[0] == 1.0
            assert value(spec, k * period + start)[0] == 1.0

    def test_a_sampled_block_sees_it_at_its_own_instants(self):
        """A wave of two samples a period alternates, sample for sample."""
        square = nlctl.sources.Square(period=0.2)
        hold = nlctl.sampled(ct.ss([], [], [], 1, 0.1, inputs="ref", outputs="y", name="hold"))
        loop = nlctl.interconnect({"square": square, "hold": hold}, outputs=["y"])
        y = nlctl.input_output_response(loop, np.arange(200) * 0.1).outputs.ravel()
        np.testing.assert_array_equal(y, np.tile([1.0, -1.0], 100))

    def test_before_its_start_it_is_in_the_middle(self):
        spec = nlctl.sources.Square(t_start=1.0, offset=0.25)
        np.testing.assert_array_equal(value(spec, [0.0, 0.9, 1.0, 1.6]), [0.25, 0.25, 1.25, -0.75])


class TestChirp:
    @each_row(("sweep", "method"), [("linear", "linear"), ("logarithmic", "logarithmic")])
    def test_it_is_scipys(self, sweep, method):
        """`scipy.signal.chirp` within the sweep; SciPy's is a cosine, and its phase in degrees."""
        t = np.linspace(0, 8, 400)
        spec = nlctl.sources.Chirp(sweep=sweep, omega_0=0.7, omega_1=9.0, t_1=8.0, phase=0.3)
        other = scipy.signal.chirp(
            t, 0.7 / (2 * np.pi), 8.0, 9.0 / (2 * np.pi), method, np.degrees(0.3 - np.pi / 2)
        )
        np.testing.assert_allclose(value(spec, t), other, atol=1e-12)

    @each_row(
        "spec",
        [
            nlctl.sources.Chirp(omega_0=1.0, omega_1=4.0, t_1=2.0),
            nlctl.sources.Chirp(omega_0=4.0, omega_1=1.0, t_1=2.0),
            nlctl.sources.Chirp(omega_0=3.0, omega_1=3.0, t_1=2.0),
            nlctl.sources.Chirp(omega_0=3.0, omega_1=3.0, t_1=2.0, sweep="logarithmic"),
            nlctl.sources.Chirp(omega_0=1.0, omega_1=4.0, t_1=2.0, sweep="logarithmic"),
        ],
    )
    def test_its_frequency_is_continuous_and_stays(self, spec):
        """The derivative of the phase is omega_0 before, omega_1 behind, a mean between."""
        h, ends = 1e-5, (-0.5, 0.0, 1.0, 2.0, 2.7)
        phase = [  # of sin and cos, the angle between two close times
            value(type(spec)(**{**vars(spec), "phase": shift}), np.add.outer(ends, (-h, h)).ravel())
            for shift in (0.0, np.pi / 2)
        ]
        angle = np.angle(phase[1] + 1j * phase[0]).reshape(-1, 2)
        omega = np.angle(np.exp(1j * np.diff(angle)[:, 0])) / (2 * h)
        a, b = spec.omega_0, spec.omega_1
        middle = np.sqrt(a * b) if spec.sweep == "logarithmic" else (a + b) / 2
        np.testing.assert_allclose(omega, [a, a, middle, b, b], rtol=2e-4)

    @every_engine
    def test_its_integral_is_fresnels(self, engine):
        """Int_0^T sin(omega_1 t^2 / (2 T)) dt = sqrt(pi T / omega_1) S(sqrt(omega_1 T / pi))."""
        T, omega = 20.0, 30.0
        S, _ = scipy.special.fresnel(np.sqrt(omega * T / np.pi))
        spec = nlctl.sources.Chirp(omega_0=0.0, omega_1=omega, t_1=T)
        exact = np.sqrt(np.pi * T / omega) * S
        assert integral(spec, T, engine) == pytest.approx(exact, abs=1e-6)


class TestTimeTable:
    times = st.lists(st.floats(-10, 10), min_size=2, max_size=8, unique=True).map(sorted)
    times = times.filter(lambda times: np.diff(times).min() > 1e-300)

    def test_slopes_that_overflow_are_refused(self):
        with pytest.raises(
            nlctl.errors.ParameterError, match=r"slopes that are finite, got 2e-311 s between"
        ):
            nlctl.sources.TimeTable(times=(0.0, 2e-311), values=(1.0, -0.1))
        assert nlctl.sources.TimeTable(times=(0.0, 2e-311), values=(1.0, -0.1), hold=True)

    @given(times, st.floats(-12, 12))
    def test_straight_lines_are_numpys(self, times, t):
        """And their ends stay, as `numpy.interp` has it."""
        values = np.cos(np.arange(len(times)) * 1.7)
        spec = nlctl.sources.TimeTable(times=times, values=values)
        assert value(spec, t)[0] == pytest.approx(np.interp(t, times, values), abs=1e-9)

    @given(times)
    def test_points_are_met_exactly(self, times):
        """Held values are those of the table, bit by bit, and so are lines at their points."""
        values = np.cos(np.arange(len(times)) * 1.7)
        for hold in (False, True):
            spec = nlctl.sources.TimeTable(times=times, values=values, hold=hold)
            np.testing.assert_array_equal(value(spec, times), values)

    def test_a_held_value_stays_until_the_next(self):
        spec = nlctl.sources.TimeTable(times=(0, 1, 2), values=(3, 4, 5), hold=True)
        np.testing.assert_array_equal(value(spec, [-1, 0.99, 1, 1.99, 2, 9]), [3, 3, 4, 4, 5, 5])

    def test_a_periodic_one_repeats(self):
        """Forwards and backwards."""
        spec = nlctl.sources.TimeTable(times=(1, 2, 4), values=(0, 1, 0), periodic=True)
        t = np.linspace(1, 4, 13)[:-1]
        for k in (-2, 1, 5):
            np.testing.assert_allclose(value(spec, t + 3 * k), value(spec, t), atol=1e-12)

    @every_engine
    def test_the_response_of_a_lag_to_a_triangle(self, engine):
        """T y' = u - y with u = t: y = t - T (1 - exp(-t/T)), then down by superposition."""
        T, t = 0.5, np.linspace(0, 4, 41)

        def ramp(s):
            return np.where(s > 0, s - T * (1 - np.exp(-np.maximum(s, 0) / T)), 0.0)

        lag = ct.ss(-1 / T, 1 / T, 1, 0, inputs="ref", outputs="y", name="lag")
        table = nlctl.sources.TimeTable(times=(0, 1, 2), values=(0, 1, 0))
        loop = nlctl.interconnect({"table": table, "lag": lag}, outputs=["y"])
        y = nlctl.input_output_response(loop, t, engine=engine).outputs.ravel()
        np.testing.assert_allclose(y, ramp(t) - 2 * ramp(t - 1) + ramp(t - 2), atol=1e-7)


@each_row(
    ("cls", "values", "told"),
    [
        ("PulseTrain", {"width": 2.0}, r"width < period, got 2 and 1"),
        ("Chirp", {"sweep": "lin"}, r"sweep to be 'linear' or 'logarithmic', got 'lin'"),
        ("Chirp", {"sweep": "logarithmic", "omega_0": 0.0}, r"omega_0 > 0 .*, got 0"),
        ("TimeTable", {"times": (0.0, 2.0, 1.0), "values": (0, 0, 0)}, r"times\[1\] = 2 and times"),
        ("TimeTable", {"times": (0.0, 1.0, 2.0)}, r"as many values as times, got 2 and 3"),
        ("TimeTable", {"times": (0.0,), "values": (0.0,)}, r"2 to 4096 times, got 1: what"),
        ("TimeTable", {"hold": "yes"}, r"hold to be True or False, got 'yes'"),
        ("Step", {"outputs": ("a", "b")}, r"one name in outputs, got \('a', 'b'\)"),
        ("Pulse", {"width": 0.0}, r"width > 0, got 0"),
    ],
)
def test_what_is_refused(cls, values, told):
    """By record, rule and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=rf"^{cls} needs .*{told}"):
        getattr(nlctl.sources, cls)(**values)


def test_the_output_has_the_name_that_it_is_given():
    assert nlctl.Step(outputs="yd").outputs == ("yd",)
    assert nlctl.block(nlctl.sources.TimeTable(outputs=("load",)), "b").output_labels == ["load"]
