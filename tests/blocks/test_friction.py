"""Friction: steady states, paths, and the published behaviour of LuGre."""

import functools
import re

import control as ct
import numpy as np
import pytest
from actuator_rig import compiled, drive, values
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row
from scipy.integrate import solve_ivp

import nlctl
from nlctl.params import equation_arguments

positive = st.floats(0.2, 3).map(lambda v: round(v, 3))
speeds = st.floats(-2, 2).map(lambda v: round(v, 4)).filter(lambda v: abs(v) > 0.01)
steps = st.lists(speeds, min_size=2, max_size=6)  # of the position, one after the other


def travel(spec, moves, durations=None, start=None):
    """Move by `moves`, each from rest to rest in its duration: a triangle of velocity.

    Return the response at the ends of the moves.
    """
    durations = np.ones(len(moves)) if durations is None else np.asarray(durations)
    ends = np.append(0.0, np.cumsum(durations))
    times = np.unique(np.concatenate((ends, (ends[1:] + ends[:-1]) / 2)))
    u = np.zeros(times.size)
    u[1::2] = 2 * np.array(moves) / durations
    run = drive(spec, times, u, start, rtol=1e-10, atol=1e-12)
    return run.states[0, ::2]


def dahl_along(spec, force, moves):
    """Return Dahl's force at the ends of moves: exponentials of the position."""
    for dx in moves:
        target = np.sign(dx) * spec.F_c
        force = target + (force - target) * np.exp(-spec.sigma_0 * abs(dx) / spec.F_c)
        yield force


def bouc_wen_along(spec, z, moves):
    """Return z at the ends of moves for nu = 1: exponentials of the position, one per sign of z."""
    for dx in moves:
        left, s = abs(dx), np.sign(dx)
        y = s * z  # then y grows: dy/dx = alpha - beta (gamma + s delta ...) |y|
        while left > 0:
            rate = spec.beta * (spec.gamma + spec.delta if y >= 0 else spec.delta - spec.gamma)
            rate = rate if y >= 0 else -rate
            # dy/dx = alpha - rate y on this side of 0
            to_zero = np.log(1 - rate * y / spec.alpha) / rate if y < 0 else np.inf
            dx_here = min(left, to_zero)
            y = spec.alpha / rate + (y - spec.alpha / rate) * np.exp(-rate * dx_here)
            y = 0.0 if dx_here == to_zero else y
            left -= dx_here
        z = s * y
        yield z


class TestDahl:
    """Force as a function of the path."""

    @given(moves=steps, sigma_0=positive, F_c=positive)
    @settings(max_examples=many(20, part=4))
    def test_along_a_path_the_force_is_made_of_exponentials(self, moves, sigma_0, F_c):
        """F -> +-F_c with the length F_c / sigma_0."""
        spec = nlctl.actuators.Dahl(sigma_0=sigma_0, F_c=F_c)
        found = travel(spec, moves)[1:]
        np.testing.assert_allclose(found, list(dahl_along(spec, 0.0, moves)), atol=1e-8)
        assert np.all(np.abs(found) <= F_c * (1 + 1e-9))

    @given(moves=steps, data=st.data())
    @settings(max_examples=many(10, part=2))
    def test_it_is_rate_independent(self, moves, data):
        """The same moves at other speeds."""
        spec = nlctl.actuators.Dahl(sigma_0=2.0)
        times = data.draw(st.lists(st.floats(0.1, 10), min_size=len(moves), max_size=len(moves)))
        np.testing.assert_allclose(travel(spec, moves, times), travel(spec, moves), atol=1e-8)

    def test_stiffness_before_sliding(self):
        """d force / d position = sigma_0 at force 0."""
        spec = nlctl.actuators.Dahl()
        forces = travel(spec, [1e-9, -2e-9])
        np.testing.assert_allclose(np.diff(forces) / [1e-9, -2e-9], spec.sigma_0, rtol=3e-4)


class TestBoucWen:
    """Hysteretic force as a function of the path."""

    @given(moves=steps, gamma=positive, delta=st.floats(-0.9, 0.9), beta=positive, alpha=positive)
    @settings(max_examples=many(20, part=4))
    def test_along_a_path_it_is_made_of_exponentials(self, moves, gamma, delta, beta, alpha):
        """nu = 1: on either side of z = 0 one exponential of the position."""
        delta = round(delta * gamma, 6)
        spec = nlctl.actuators.BoucWen(alpha=alpha, beta=beta, gamma=gamma, delta=delta)
        found = travel(spec, moves)[1:]
        exact = list(bouc_wen_along(spec, 0.0, moves))
        np.testing.assert_allclose(found, exact, atol=1e-7 * (1 + max(map(abs, exact))))
        assert np.all(np.abs(found) <= spec.z_max * (1 + 1e-7))

    @given(moves=steps, gamma=positive, share=st.floats(-0.9, 1), nu=st.floats(1, 3))
    @settings(max_examples=many(20, part=4))
    def test_z_stays_below_its_bound(self, moves, gamma, share, nu):
        """From within it, for every exponent, and it is attained by a long move."""
        spec = nlctl.actuators.BoucWen(alpha=2, beta=1, gamma=gamma, delta=share * gamma, nu=nu)
        start = [0.999 * spec.z_max]
        assert np.all(np.abs(travel(spec, moves, start=start)) <= spec.z_max * (1 + 1e-7))
        slope = 2 * nu / spec.z_max  # at which z tends to its bound, per position
        assert travel(spec, [40 / slope])[-1] == pytest.approx(spec.z_max, rel=1e-6)

    def test_the_values_of_the_benchmark_have_no_bound(self):
        """gamma + delta < 0: dz/dy = alpha + 300 z, an exponential that grows."""
        spec = nlctl.actuators.BoucWen()
        assert spec.z_max == np.inf
        y = 0.01
        exact = spec.alpha / 300 * np.expm1(300 * y)
        assert travel(spec, [y])[-1] == pytest.approx(exact, rel=1e-8)

    def test_a_run_that_it_ends_names_it(self):
        """Behind a law that holds 2 m/s for 70 ms the force is alpha / 300 (exp(42) - 1)."""
        law = ct.ss([], [], [], [[2.0]], 0.07, inputs="r", outputs="velocity", name="law")
        spring = nlctl.block(nlctl.actuators.BoucWen(), "spring")
        mass = ct.ss([[0.0]], [[1.0]], [[1.0]], 0, inputs="force", outputs="y", name="mass")
        back = ct.summing_junction(["w", "-y"], "r", name="back")
        loop = nlctl.interconnect(
            [nlctl.sampled(law), spring, mass, back], inputs=["w"], outputs=["y"]
        )
        force = 5e4 / 300 * np.expm1(42)
        end = f"state 'spring.z' is {force:.3g} at t = 0.07 s"
        with pytest.raises(nlctl.errors.DivergedError, match=re.escape(end)):
            nlctl.input_output_response(loop, np.linspace(0, 1, 101), 1.0)


OF_THE_PATH = {
    "Dahl": nlctl.actuators.Dahl(sigma_0=2.0),
    "Bouc-Wen": nlctl.actuators.BoucWen(alpha=2.0, beta=1.0, gamma=0.8, delta=0.3, nu=1.7),
}


@pytest.mark.parametrize("spec", OF_THE_PATH.values(), ids=OF_THE_PATH)
class TestForcesOfThePath:
    """What is true of both: their force follows from the path alone."""

    @given(moves=steps, data=st.data())
    @settings(max_examples=many(10, part=2))
    def test_they_are_rate_independent(self, spec, moves, data):
        """The same moves at other speeds."""
        times = data.draw(st.lists(st.floats(0.1, 10), min_size=len(moves), max_size=len(moves)))
        np.testing.assert_allclose(travel(spec, moves, times), travel(spec, moves), atol=1e-8)

    @given(one=steps, two=steps)
    @settings(max_examples=many(10, part=2))
    def test_a_run_may_be_split(self, spec, one, two):
        """Going on from a saved state (semigroup)."""
        whole, first = travel(spec, one + two), travel(spec, one)
        rest = travel(spec, two, start=first[-1:])
        np.testing.assert_allclose(np.append(first, rest[1:]), whole, atol=1e-8)

    @given(moves=steps)
    @settings(max_examples=many(10, part=2))
    def test_at_rest_they_keep_their_force(self, spec, moves):
        """To the bit: no velocity, no change (idempotence)."""
        force = travel(spec, moves)[-1]
        run = drive(spec, np.array([0.0, 50.0]), np.zeros(2), [force])
        assert run.states[0, -1] == force

    @given(far=positive, moves=steps)
    @settings(max_examples=many(10, part=2))
    def test_cycles_burn(self, spec, far, moves):
        """Whatever came before, over a cycle of the position that has been gone through before."""
        start = travel(spec, [*moves, *[far, -far] * 20])[-1:]
        times = np.linspace(0, 2, 401)
        speed = np.where(times < 1, far, -far)
        run = drive(spec, times, speed, start, rtol=1e-10, atol=1e-12)
        assert np.trapezoid(run.states[0] * speed, times) > 0


MASS = 1.0  # kg


@functools.cache
def pushed(spring):
    """Return a mass on LuGre friction, pushed by a force f or pulled at y through a spring."""

    def motion(t, x, u, params):
        position, velocity = x
        pull, friction = u
        force = params["k"] * (pull - position) if params["k"] > 0 else pull
        return [velocity, (force - friction) / MASS]

    mass = ct.nlsys(
        motion, lambda t, x, u, p: x, states=2, inputs=["pull", "force"],
        outputs=["position", "velocity"], name="mass", params={"k": spring},
    )  # fmt: skip
    loop = nlctl.interconnect(
        [mass, nlctl.block(nlctl.actuators.LuGre(), "friction")],
        inputs=["pull"], outputs=["position", "velocity", "force"], name="mass_on_friction",
    )  # fmt: skip
    return nlctl.compile(loop)


def by_scipy(spring, times, pull):
    """Integrate the same mass, its equations written out again, by Radau's method."""
    s0, s1, s2, F_c, F_s, v_s = 1e5, np.sqrt(1e5), 0.4, 1.0, 1.5, 1e-3

    def rates(t, x):
        position, velocity, z = x
        g = F_c + (F_s - F_c) * np.exp(-((velocity / v_s) ** 2))
        z1 = velocity - s0 * abs(velocity) / g * z
        friction = s0 * z + s1 * z1 + s2 * velocity
        at = np.interp(t, times, pull)
        force = spring * (at - position) if spring else at
        return [velocity, (force - friction) / MASS, z1]

    with np.errstate(over="ignore"):  # SciPy's differences where an equation has no such argument
        made = solve_ivp(rates, times[[0, -1]], [0, 0, 0], "Radau", times, rtol=1e-9, atol=1e-12)
    return made.y


class TestLuGre:
    """What the figures of Canudas de Wit et al. 1995 show, and their closed forms."""

    @given(v=st.floats(1e-4, 0.1), sign=st.sampled_from((-1, 1)))
    @settings(max_examples=many(10, part=2))
    def test_at_a_constant_velocity_it_becomes_stribecks_curve(self, v, sign):
        """Section III: F = g(v) sign(v) + sigma_2 v, with the transient in closed form."""
        spec, v = nlctl.actuators.LuGre(), sign * v
        g = 1.0 + 0.5 * np.exp(-((v / 1e-3) ** 2))
        time = 40 * g / (1e5 * abs(v))
        run = drive(spec, [0, time / 40, time], [v, v, v], rtol=1e-10, atol=1e-14)
        steady = nlctl.actuators.Stribeck().output(
            0, (), (v,), equation_arguments(nlctl.actuators.Stribeck())
        )[0]
        assert steady == pytest.approx(g * np.sign(v) + 0.4 * v, rel=1e-13)
        assert run.outputs[0, -1] == pytest.approx(steady, rel=1e-7)
        assert run.states[0, 1] == pytest.approx(sign * g / 1e5 * (1 - np.exp(-1)), rel=1e-7)

    def test_before_sliding_it_is_a_spring_with_a_damper(self):
        """Linearised at rest: d force / dz = sigma_0, d force / d velocity = sigma_1 + sigma_2."""
        at_rest = compiled(nlctl.actuators.LuGre).linearize(
            0, 0, params=values(nlctl.actuators.LuGre())
        )
        np.testing.assert_allclose(at_rest.A, 0, atol=0)
        np.testing.assert_allclose(at_rest.B, 1)
        np.testing.assert_allclose(at_rest.C, 1e5)
        np.testing.assert_allclose(at_rest.D, np.sqrt(1e5) + 0.4, rtol=1e-12)

    def test_presliding_displacement(self):
        """A force up to 1.425 N and back leaves a displacement, and no motion.

        It moves some tens of micrometres, stiffer at first than later; the loop is hysteretic.
        """
        times = np.linspace(0, 60, 121)
        pull = np.interp(times, [0, 20, 60], [0, 1.425, -1.425])
        run = nlctl.input_output_response(pushed(0.0), times, pull, rtol=1e-9, atol=1e-13)
        position = run.outputs[0]
        at_top, back_at_zero = position[40], np.interp(40.0, times, position)
        assert 0 < back_at_zero < at_top < 1e-4
        assert at_top > 1.425 / 1e5
        exact = by_scipy(0.0, times, pull)
        np.testing.assert_allclose(position, exact[0], atol=1e-6 * at_top)

    def test_the_force_of_break_away_falls_with_the_rate(self):
        """From near F_s towards F_c as the pull grows faster.

        It is the greatest friction before the mass is at ten times the Stribeck velocity.
        """
        forces = []
        for rate in (1.0, 5.0, 20.0, 50.0):
            times = np.linspace(0, 3 / rate, 601)
            run = nlctl.input_output_response(pushed(0.0), times, rate * times, rtol=1e-9)
            before = run.outputs[1] < 0.01
            forces.append(run.outputs[2][before].max())
        assert np.all(np.diff(forces) < 0)
        assert 1.0 < forces[-1] < forces[0] < 1.5

    def test_frictional_lag(self):
        """The force is larger while the velocity rises, by more when it varies faster."""
        widths = []
        for omega in (1.0, 10.0, 25.0):
            times = np.linspace(0, 6 * np.pi / omega, 1201)
            v = 1.1e-3 * (1 - np.cos(omega * times)) + 1e-4
            force = drive(nlctl.actuators.LuGre(), times, v, rtol=1e-9, atol=1e-14).outputs[0]
            rising = np.interp(1e-3, v[800:1001], force[800:1001])
            falling = np.interp(1e-3, v[1000:][::-1], force[1000:][::-1])
            widths.append(rising - falling)
        assert widths[0] > 0
        assert np.all(np.diff(widths) > 0)

    @pytest.mark.slow
    def test_stick_and_slip(self):
        """Pulled at 0.1 m/s by a spring of 2 N/m; Radau's method agrees to 1e-6.

        It sticks until the spring is at the force of break-away, then slips below F_c.
        """
        times = np.linspace(0, 12, 241)
        run = nlctl.input_output_response(pushed(2.0), times, 0.1 * times, rtol=1e-10, atol=1e-13)
        position, velocity, _ = run.outputs
        exact = by_scipy(2.0, times, 0.1 * times)
        np.testing.assert_allclose(position, exact[0], atol=1e-6)
        spring = 2 * (0.1 * times - position)
        assert np.mean(np.abs(velocity) < 1e-4) > 0.5
        assert velocity.max() > 0.2
        assert 1.45 < spring.max() < 1.55
        assert spring[times > 9].min() < 0.9

    def test_it_burns_more_than_it_gives_back(self):
        """The work of the force is at least what the bristles store, sigma_0 z^2 / 2."""
        times = np.linspace(0, 4, 4001)
        v = 2e-3 * np.sin(7 * times) + 1e-3 * np.sin(31 * times)
        run = drive(nlctl.actuators.LuGre(), times, v, rtol=1e-9, atol=1e-14)
        power = run.outputs[0] * v
        work = np.append(0, np.cumsum((power[1:] + power[:-1]) / 2) * times[1])
        assert np.all(work - 1e5 * run.states[0] ** 2 / 2 > -1e-9)


@functools.cache
def on_a_belt():
    """Return a mass of 1 kg on friction that sticks, pulled through a spring of 2 N/m."""
    mass = ct.nlsys(
        lambda t, x, u, p: [x[1], u[0] - u[1]], lambda t, x, u, p: x, states=2,
        inputs=["applied", "force"], outputs=["position", "velocity"], name="mass",
    )  # fmt: skip
    spring = ct.nlsys(
        None, lambda t, x, u, p: [2.0 * (u[0] - u[1])], inputs=["pull", "position"],
        outputs=["applied"], name="spring",
    )  # fmt: skip
    blocks = [mass, spring, nlctl.block(nlctl.actuators.StickSlip(sigma_2=0.0), "friction")]
    outputs = ["position", "velocity", "applied", "force"]
    return nlctl.compile(nlctl.interconnect(blocks, inputs=["pull"], outputs=outputs, name="belt"))


class TestStickSlip:
    """Both changes of the mode against closed forms."""

    @pytest.mark.parametrize(("speed", "F_s"), [(0.1, 1.5), (0.3, 1.2), (0.02, 1.9)])
    def test_the_cycle_of_a_mass_that_is_pulled_through_a_spring(self, speed, F_s):
        """It sticks until the spring pulls with F_s, swings about F_c, and sticks again.

        Slipping takes (2 / w) (pi - arctan((F_s - F_c) w / (k speed))), sticking
        2 (F_s - F_c) / (k speed).
        """
        k, w, F_c = 2.0, np.sqrt(2.0), 1.0
        first = F_s / (k * speed)
        slips = 2 / w * (np.pi - np.arctan((F_s - F_c) * w / (k * speed)))
        period = slips + 2 * (F_s - F_c) / (k * speed)
        times = np.append(0, first + period * np.arange(0, 4, 0.125))
        run = nlctl.input_output_response(
            on_a_belt(), times, speed * times, params={"friction.F_s": F_s}, rtol=1e-10, atol=1e-12
        )
        phase = (times[1:] - first) % period
        swing = F_c / k + (F_s - F_c) / k * np.cos(w * phase) + speed / w * np.sin(w * phase)
        held = (2 * F_c - F_s) / k + speed * (phase - slips)
        # on a node of the cycle rounding decides on which side of the break-away a sample lies
        stretch = np.where(phase < slips, swing, held)
        stretch = np.where(period - phase < 1e-9, F_s / k, stretch)
        np.testing.assert_allclose(speed * times[1:] - run.outputs[0, 1:], stretch, atol=1e-8)

    @given(v=speeds, push=st.floats(-0.7, 0.7))
    @settings(max_examples=many(20, part=4))
    def test_a_mass_slides_to_rest_and_stays(self, v, push):
        """After v^2 / 2 / (F_c -+ push) of way at a constant push below F_c."""
        times = np.linspace(0, 6, 25)
        applied = np.full(times.size, push)
        run = nlctl.input_output_response(
            free_mass(),
            times,
            applied,
            {"mass.x[1]": v},
            rtol=1e-10,
            atol=1e-12,
        )
        brake = 1.0 - np.sign(v) * push
        stop = abs(v) / brake
        t = np.minimum(times, stop)
        np.testing.assert_allclose(
            run.outputs[0], np.sign(v) * (abs(v) * t - brake * t**2 / 2), atol=1e-8
        )
        at_rest = times > stop + 1e-6
        np.testing.assert_allclose(run.outputs[1, at_rest], 0, atol=1e-8)
        np.testing.assert_allclose(run.outputs[2, at_rest], push, atol=1e-12)

    def test_it_breaks_away_where_the_push_exceeds_static_friction(self):
        """A push that grows by 1 N/s: at 1.5 s, and F - F_c accelerates it from then on."""
        times = np.linspace(0, 3, 31)
        run = nlctl.input_output_response(free_mass(), times, times, rtol=1e-10, atol=1e-12)
        late = np.maximum(times - 1.5, 0)
        velocity = 0.5 * late + late**2 / 2
        np.testing.assert_allclose(run.outputs[1], velocity, atol=1e-8)

    @pytest.mark.parametrize("rtol", [1e-4, 1e-6])
    def test_loose_tolerances_stick_as_well(self, rtol):
        """It overshoots rest, comes back, and then stays."""
        times = np.linspace(0, 6, 25)
        run = nlctl.input_output_response(
            free_mass(), times, 0 * times + 0.3, {"mass.x[1]": 1.0}, rtol=rtol
        )
        np.testing.assert_allclose(run.outputs[1, -12:], 0, atol=1e-6)
        assert run.outputs[0, -1] == pytest.approx(0.5 / 0.7, abs=10 * rtol)

    @given(
        v=st.sampled_from((-1.0, -1e-6, -1e-9, 0.0, 1e-9, 1.1e-6, 1.0)),
        push=st.sampled_from((-2.0, -1.5, -0.3, 0.0, 1.5, 1.5 + 1e-12)),
        mode=st.sampled_from((-1.0, -0.5, 0.0, 0.2, 0.5, 1.0)),
    )
    def test_machine_code_equals_python_control(self, v, push, mode):
        """At rest, at the limit of static friction, and between the modes."""
        block, made = (
            nlctl.block(nlctl.actuators.StickSlip(), "b"),
            compiled(nlctl.actuators.StickSlip),
        )
        for name in ("dynamics", "output"):
            expected = getattr(block, name)(0.0, [mode], [v, push])
            np.testing.assert_array_equal(getattr(made, name)(0.0, [mode], [v, push]), expected)


@functools.cache
def free_mass():
    """Return a mass of 1 kg on friction that sticks, pushed by a force that is given."""
    mass = ct.nlsys(
        lambda t, x, u, p: [x[1], u[0] - u[1]], lambda t, x, u, p: x, states=2,
        inputs=["applied", "force"], outputs=["position", "velocity"], name="mass",
    )  # fmt: skip
    blocks = [mass, nlctl.block(nlctl.actuators.StickSlip(sigma_2=0.0), "friction")]
    outputs = ["position", "velocity", "force"]
    return nlctl.compile(
        nlctl.interconnect(blocks, inputs=["applied"], outputs=outputs, name="pushed")
    )


@given(v=st.floats(-1, 1), F_c=positive, sigma_2=positive)
def test_stribecks_curve_between_its_levels_is_coulombs(v, F_c, sigma_2):
    """With F_s = F_c; both are odd, and oppose the motion."""
    coulomb, stribeck = (
        nlctl.actuators.Coulomb(F_c=F_c, sigma_2=sigma_2),
        nlctl.actuators.Stribeck(F_c=F_c, F_s=F_c, sigma_2=sigma_2),
    )
    one, other = (s.output(0, (), (v,), equation_arguments(s))[0] for s in (coulomb, stribeck))
    assert one == pytest.approx(other, rel=1e-14)
    assert one == pytest.approx(F_c * np.sign(v) + sigma_2 * v, rel=1e-14)
    assert one * v >= 0


@pytest.mark.parted
@pytest.mark.parametrize(
    "kind",
    [
        nlctl.actuators.Coulomb,
        nlctl.actuators.Stribeck,
        nlctl.actuators.Dahl,
        nlctl.actuators.LuGre,
        nlctl.actuators.BoucWen,
    ],
)
@given(v=st.floats(-2, 2), x=st.floats(-1, 1))
@settings(max_examples=many(20, part=4))
def test_machine_code_equals_python_control(kind, v, x):
    """At random, and where the velocity or the state is 0."""
    spec = kind()
    block, made = nlctl.block(spec, "b"), compiled(kind)
    for state, velocity in ((x, v), (x, 0.0), (0.0, v), (x, -0.0), (-0.0, v), (x, 1e-300)):
        state = [state] * len(spec.states)
        for name in ("dynamics", "output")[not spec.states :]:
            expected = getattr(block, name)(0.0, state, [velocity])
            got = getattr(made, name)(0.0, state, [velocity])
            np.testing.assert_allclose(got, expected, rtol=1e-13, atol=0)


@each_row(
    ("make", "told"),
    [
        (lambda: nlctl.actuators.LuGre(F_s=0.5), "LuGre needs F_c <= F_s, got 1 and 0.5"),
        (lambda: nlctl.actuators.Stribeck(F_c=2.0), "Stribeck needs F_c <= F_s, got 2 and 1.5"),
        (lambda: nlctl.actuators.StickSlip(F_s=0.5), "StickSlip needs F_c <= F_s, got 1 and 0.5"),
        (lambda: nlctl.actuators.StickSlip(v0=0.5), "StickSlip needs v0 to be 0, 1 or -1, got 0.5"),
        (lambda: nlctl.actuators.Dahl(F_c=0.0), "Dahl needs F_c > 0, got 0"),
        (lambda: nlctl.actuators.BoucWen(nu=0.5), "BoucWen needs nu >= 1, got 0.5"),
    ],
)
def test_what_is_no_friction_is_refused(make, told):
    """With record, rule and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()
