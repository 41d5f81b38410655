"""PID of (ref, y) and of e: transfer functions, recovery from a limit, changes without a jump."""

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.params import equation_arguments

GAINS = {"k_p": 2.0, "k_i": 1.5, "k_d": 0.8, "T_f": 0.05}
FREE = {"u_min": -1e9, "u_max": 1e9}
numbers = st.floats(-50, 50)
every_engine = pytest.mark.parametrize("engine", ["native", "python-control"])


def laws(k_p, k_i, k_d, T_f, b=1.0, c=1.0):
    """Return the transfer functions from ref and from -y to u."""
    s = ct.tf("s")
    slope = k_d * s / (T_f * s + 1)
    return k_p * b + k_i / s + c * slope, k_p + k_i / s + slope


def rates(spec, x, u):
    return np.array(spec.update(0.0, np.array(x), np.array(u), equation_arguments(spec)))


def asked(spec, x, u):
    return spec.output(0.0, np.array(x), np.array(u), equation_arguments(spec))[0]


def alone(spec, times, x0=(0.0, 0.0), **inputs):
    """Run a law by itself on inputs that are functions of time; return u and its states."""
    u = [np.broadcast_to(inputs[name], times.shape) for name in spec.inputs]
    law = nlctl.block(spec, "law")
    run = nlctl.input_output_response(law, times, np.array(u), x0, rtol=1e-10, atol=1e-12)
    return run.outputs.ravel(), run.states


class TestUnsaturated:
    @each_row(("b", "c"), [(1.0, 1.0), (0.4, 0.0), (0.0, 0.0)])
    def test_it_is_its_transfer_functions(self, b, c):
        """From either input, at four frequencies."""
        law = nlctl.compile(nlctl.block(nlctl.PID2(**GAINS, **FREE, b=b, c=c), "law"))
        linear, (of_ref, of_y) = law.linearize([0.0, 0.0], [0.0, 0.0]), laws(**GAINS, b=b, c=c)
        for omega in (0.1, 1.0, 10.0, 100.0):
            found = linear(1j * omega)[0]
            np.testing.assert_allclose(found, [of_ref(1j * omega), -of_y(1j * omega)], rtol=1e-9)

    @pytest.mark.parted
    @every_engine
    @each_row(("b", "c"), [(1.0, 1.0), (0.4, 0.0)])
    def test_step_responses_of_the_closed_loop(self, b, c, engine):
        """Of reference and load, those that python-control has of the transfer functions."""
        plant = ct.tf([1.0], [1.0, 1.4, 1.0])
        of_ref, of_y = laws(**GAINS, b=b, c=c)
        sensitivity = 1 / (1 + plant * of_y)
        t = np.linspace(0, 10, 201)
        made = ct.ss(plant, inputs="v", outputs="y", name="plant")
        add = ct.summing_junction(["u", "load"], "v", name="add")
        loop = nlctl.interconnect(
            {"law": nlctl.PID2(**GAINS, **FREE, b=b, c=c), "plant": made, "add": add},
            inputs=["ref", "load"],
            outputs=["y"],
        )
        for place, closed in enumerate([plant * of_ref * sensitivity, plant * sensitivity]):
            u = np.zeros((2, t.size))
            u[place] = 1.0
            y = nlctl.input_output_response(loop, t, u, engine=engine).outputs.ravel()
            exact = ct.forced_response(ct.ss(ct.minreal(closed, 1e-6, verbose=False)), t, u[place])
            np.testing.assert_allclose(y, exact.outputs, atol=2e-6)

    @given(numbers, numbers, numbers, numbers)
    def test_of_an_error_it_is_that_of_ref_minus_y(self, integral, filtered, ref, y):
        """With b = c = 1; the weights of ref leave the response to y alone."""
        x = (integral, filtered)
        whole, own = nlctl.PID2(**GAINS), nlctl.PID2(**GAINS, signals=("e",))
        assert asked(own, x, [ref - y]) == asked(whole, x, [ref, y])
        np.testing.assert_array_equal(rates(own, x, [ref - y]), rates(whole, x, [ref, y]))
        weighted = nlctl.PID2(**GAINS, b=0.3, c=0.2)
        np.testing.assert_array_equal(asked(weighted, x, [0.0, y]), asked(whole, x, [0.0, y]))

    def test_the_standard_form(self):
        """K (1 + 1 / (T_i s) + T_d s / (1 + s T_d / N))."""
        spec = nlctl.controllers.standard_pid(3.0, 2.0, 0.5, 8.0, signals="e", **FREE)
        linear = nlctl.compile(nlctl.block(spec, "law")).linearize([0.0, 0.0], [0.0])
        for s in (0.3j, 2j, 40j):
            exact = 3 * (1 + 1 / (2 * s) + 0.5 * s / (1 + s * 0.5 / 8))
            assert linear(s) == pytest.approx(exact, rel=1e-9)
        assert nlctl.controllers.standard_pid(1.0, 4.0, 1.0).T_t == 2.0
        assert nlctl.controllers.standard_pid(1.0, 4.0).T_t == 4.0

    def test_sampled_it_is_the_recursion(self):
        """I[k+1] = I[k] + dt k_i e, z[k+1] = z[k] + dt D, at dt = 0.02 s, on a sampled ramp."""
        dt, count = 0.02, 60
        spec = nlctl.PID2(**GAINS, b=0.4, c=0.5)
        law = nlctl.sampled(nlctl.discretise(nlctl.block(spec, "law"), dt))
        t = np.arange(count) * dt
        ramp = nlctl.sources.Ramp(slope=0.7, outputs="ref")
        wave = nlctl.Sine(omega=3.0, outputs="y")
        loop = nlctl.interconnect({"r": ramp, "y": wave, "law": law}, outputs=["u"])
        u = nlctl.input_output_response(loop, t).outputs.ravel()
        ref, y = 0.7 * t, np.sin(3.0 * t)
        integral = np.append(0.0, np.cumsum(dt * 1.5 * (ref - y)))[:-1]
        slope, z = np.zeros(count), 0.0
        for k in range(count):
            slope[k] = (0.5 * ref[k] - y[k] - z) / 0.05
            z += dt * slope[k]
        exact = 2.0 * (0.4 * ref - y) + integral + 0.8 * slope
        np.testing.assert_allclose(u, exact, atol=1e-10)


class TestAntiWindup:
    PI = {"k_p": 2.0, "k_i": 3.0, "k_d": 0.0, "u_min": -1.0, "u_max": 1.0, "signals": ("e",)}

    @given(numbers, numbers, numbers, st.sampled_from(["back-calculation", "clamping", "none"]))
    def test_u_keeps_its_limits_and_within_them_all_are_equal(self, integral, filtered, e, kind):
        spec = nlctl.PID2(**GAINS, signals="e", u_min=-5.0, u_max=8.0, anti_windup=kind)
        free = nlctl.PID2(**GAINS, signals="e", u_min=-1e9, u_max=1e9, anti_windup="none")
        x, w = (integral, filtered), asked(free, (integral, filtered), [e])
        assert asked(spec, x, [e]) == min(max(w, -5.0), 8.0)
        if -5 <= w <= 8:
            np.testing.assert_array_equal(rates(spec, x, [e]), rates(free, x, [e]))

    @given(numbers, numbers)
    def test_clamping_stops_and_never_turns_back(self, integral, e):
        """Between 0 and k_i e; 0 where w is beyond the limit by T_t k_i |e|, as e pushes."""
        spec = nlctl.PID2(**self.PI, T_t=0.1, anti_windup="clamping")
        w, rate = integral + 2.0 * e, rates(spec, (integral, 0.0), [e])[0]
        assert min(0.0, 3.0 * e) <= rate <= max(0.0, 3.0 * e)
        if abs(w) >= 1.0 + 0.1 * 3.0 * abs(e) and w * e > 0:
            assert rate == 0.0
        if w * e < 0:  # it comes back from the other limit at full speed
            assert rate == 3.0 * e

    def test_back_calculation_in_closed_form(self):
        """I' = k_i e + (u_max - k_p e - I) / T_t: at last w exceeds the limit by T_t k_i e."""
        t, T_t = np.linspace(0, 3, 61), 0.4
        u, states = alone(nlctl.PID2(**self.PI, T_t=T_t), t, e=1.0)
        end = 1.0 - 2.0 + T_t * 3.0
        np.testing.assert_allclose(states[0], end * (1 - np.exp(-t / T_t)), atol=1e-8)
        np.testing.assert_array_equal(u, 1.0)

    def test_clamping_in_closed_form(self):
        """With e = 0.25 the limit is met at 2/3 s, then I - I_e = -T_t k_i e exp(-t / T_t)."""
        t, T_t = np.linspace(0, 3, 61), 0.4
        _, states = alone(nlctl.PID2(**self.PI, T_t=T_t, anti_windup="clamping"), t, e=0.25)
        late = 0.5 + T_t * 0.75 * (1 - np.exp(-np.maximum(t - 2 / 3, 0) / T_t))
        exact = np.where(t < 2 / 3, 0.75 * t, late)
        np.testing.assert_allclose(states[0], exact, atol=1e-8)
        _, states = alone(nlctl.PID2(**self.PI, T_t=0.1, anti_windup="clamping"), t, e=1.0)
        np.testing.assert_array_equal(states[0], 0.0)  # at the limit from the first instant on

    @pytest.mark.parted
    @every_engine
    def test_recovery_from_a_limit(self, engine):
        """After 10 s at e = 0.25, e = -0.25: u leaves its limit when I has fallen to 1.5.

        Wound up, I = 7.5 and falls by 0.75 /s, for 8 s.  With either anti-windup it is 0.5 + 0.3,
        w = I - 0.5 is within the limits at once.
        """
        source = nlctl.sources.Square(amplitude=0.25, period=40.0, duty=0.25, outputs="e")
        t = np.linspace(0, 20, 401)
        left = {}
        for kind in ("back-calculation", "clamping", "none"):
            spec = nlctl.PID2(**self.PI, T_t=0.4, anti_windup=kind)
            loop = nlctl.interconnect({"source": source, "law": spec}, outputs=["u"])
            u = nlctl.input_output_response(loop, t, engine=engine).outputs.ravel()
            left[kind] = t[np.flatnonzero(u >= 1.0 - 1e-9)[-1]]
        assert left["none"] == pytest.approx(18.0, abs=0.051)
        assert left["back-calculation"] == left["clamping"] == pytest.approx(9.95)

    @pytest.mark.parametrize("kind", ["back-calculation", "clamping"])
    def test_overshoot_of_a_loop_behind_a_limit(self, kind):
        """A double integrator with |u| <= 0.2, as the baseline has it: less than half."""
        plant = ct.ss([[0, 1], [0, 0]], [[0], [1]], [[1, 0]], 0, inputs="u", outputs="y", name="p")
        limits = {"u_min": -0.2, "u_max": 0.2}
        t, most = np.linspace(0, 30, 3001), {}
        for name in (kind, "none"):
            spec = nlctl.PID2(k_p=3, k_i=1, k_d=3, T_f=0.02, T_t=0.2, anti_windup=name, **limits)
            parts = {"step": nlctl.Step(), "law": spec, "plant": plant}
            loop = nlctl.interconnect(parts, outputs=["y"])
            most[name] = nlctl.input_output_response(loop, t).outputs.max() - 1
        assert most[kind] < 0.5 * most["none"]


class TestBumpless:
    def loop(self, e, T_t):
        """A law that tracks v; v is 0.7 by hand until t = 5, and u from then on."""

        def by_hand(t, x, u, params):
            return [0.7 if t < 5 else u[0]]

        switch = ct.nlsys(None, by_hand, inputs="u", outputs="v", name="switch")
        law = nlctl.PID2(k_p=2.0, k_i=3.0, T_t=T_t, signals="e", applied="v")
        error = nlctl.Step(height=0.0, offset=e, outputs="e")
        return nlctl.interconnect({"error": error, "law": law, "switch": switch}, outputs=["v"])

    @every_engine
    @each_row("e", [0.0, 0.3])
    def test_from_manual_to_automatic(self, e, engine):
        """The jump of v is T_t k_i e (1 - exp(-5 / T_t)) - (0.7 - w(0)) exp(-5 / T_t), near 0."""
        T_t, rest = 0.5, np.exp(-10.0)
        t = np.array([0.0, 4.9999999, 5.0, 6.0])
        loop = self.loop(e, T_t)
        run = nlctl.input_output_response(
            loop, t, 0, {"law.filtered": e}, engine=engine, rtol=1e-10, atol=1e-12
        )
        v = run.outputs.ravel()
        jump = T_t * 3.0 * e * (1 - rest) - (0.7 - 2.0 * e) * rest
        assert v[1] == 0.7
        assert v[2] - v[1] == pytest.approx(jump, abs=1e-6)
        assert v[3] - v[2] == pytest.approx(3.0 * e, abs=1e-6)  # then it integrates e

    @given(numbers, numbers, numbers)
    def test_other_gains_of_the_integral_make_no_jump(self, integral, filtered, e):
        """The state is what is added to u, not the integral of the error."""
        a, b = (nlctl.PID2(signals="e", k_i=k, T_t=T) for k, T in ((1.0, 1.0), (9.0, 0.2)))
        assert asked(a, (integral, filtered), [e]) == asked(b, (integral, filtered), [e])


@each_row(
    ("values", "told"),
    [
        ({"u_min": 1.0, "u_max": -1.0}, "u_min < u_max, got 1 and -1"),
        ({"T_f": 0.0}, "T_f > 0, got 0"),
        ({"b": -0.1}, "b >= 0, got -0.1"),
        ({"signals": ("a", "b", "c")}, r"\('ref', 'y'\) or \('e',\).* got \('a', 'b', 'c'\)"),
        ({"signals": "e", "b": 0.5}, "b = 1 and c = 1 of an error, got 0.5 and 1"),
        ({"anti_windup": "clamp"}, "got 'clamp'; nearest: 'clamping'"),
        ({"anti_windup": "none", "applied": "v"}, "an anti-windup that reads 'v'"),
        ({"applied": None}, "a name for applied, got None"),
    ],
)
def test_what_is_refused(values, told):
    """By record, rule and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=rf"^PID2 needs .*{told}"):
        nlctl.PID2(**values)


@each_row(
    ("values", "told"),
    [({"T_i": 0.0}, "T_i > 0, got 0"), ({"T_d": -1.0}, "T_d >= 0, got -1"), ({"N": 0}, "N > 0")],
)
def test_what_the_standard_form_refuses(values, told):
    with pytest.raises(nlctl.errors.ParameterError, match=rf"^standard_pid needs .*{told}"):
        nlctl.controllers.standard_pid(**{"K": 1.0, "T_i": 1.0, **values})
    with pytest.raises(nlctl.errors.UnknownNameError, match="nearest: 'u_max'"):
        nlctl.controllers.standard_pid(1.0, 1.0, umax=3.0)
