"""Operators with memory in machine code: what is true of every right implementation of them."""

from itertools import pairwise

import numpy as np
import pytest
from actuator_rig import along, compiled, dense, drive, values
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.blocks import default_state
from nlctl.params import equation_arguments

inputs = st.floats(-3, 3).map(lambda u: round(u, 6))
on_the_grid = st.integers(-12, 12).map(lambda k: k / 4)  # meets thresholds exactly
paths = st.one_of(
    st.lists(inputs, min_size=2, max_size=8), st.lists(on_the_grid, min_size=2, max_size=8)
)
positive = st.floats(0.05, 2).map(lambda v: round(v, 6))
signs = st.sampled_from((-1.0, 1.0))


@st.composite
def backlashes(draw):
    left, gap, m = draw(st.floats(-1, 1)), draw(positive), draw(positive)
    return nlctl.Backlash(m_r=m, m_l=m, c_l=left, c_r=left + gap, v0=draw(inputs))


@st.composite
def stops(draw):
    return nlctl.actuators.Stop(r=draw(positive), v0=draw(inputs))


@st.composite
def sums_of_plays(draw):
    r = np.cumsum(draw(st.lists(positive, min_size=4, max_size=4)))
    w = draw(st.lists(positive, min_size=4, max_size=4))
    v0 = draw(st.lists(inputs, min_size=4, max_size=4))
    return nlctl.actuators.PrandtlIshlinskii(w_0=draw(positive), w=w, r=r, v0=tuple(v0))


@st.composite
def inverses(draw):
    r = np.cumsum(draw(st.lists(positive, min_size=4, max_size=4)))
    w = draw(st.lists(positive, min_size=4, max_size=4))
    return nlctl.actuators.PrandtlIshlinskiiInverse(
        w_0=1 + draw(positive), w=w, r=r, v0=draw(inputs)
    )


@st.composite
def generalised_sums(draw):
    """Envelopes that may cross, and plays without a gap of their own, are among them."""
    envelope = st.tuples(positive, positive, inputs, inputs)
    r = np.cumsum([draw(st.sampled_from((0.0, 0.3))), *draw(st.tuples(*[positive] * 3))])
    w = draw(st.lists(positive, min_size=4, max_size=4))
    v0 = draw(st.lists(inputs, min_size=4, max_size=4))
    return nlctl.actuators.GeneralisedPrandtlIshlinskii(
        rising=draw(envelope), falling=draw(envelope), w=w, r=r, v0=tuple(v0)
    )


@st.composite
def relays(draw):
    off = draw(st.floats(-1, 1))
    return nlctl.Relay(off=off, on=off + draw(positive), height=draw(positive), v0=draw(signs))


@st.composite
def relay_sums(draw):
    w = draw(st.lists(positive, min_size=10, max_size=10))
    sides = draw(st.lists(signs, min_size=10, max_size=10))
    return nlctl.actuators.Preisach(w=w, v0=tuple(sides))


EVERY = {
    "play": backlashes(),
    "stop": stops(),
    "Prandtl-Ishlinskii": sums_of_plays(),
    "its inverse": inverses(),
    "generalised": generalised_sums(),
    "relay": relays(),
    "Preisach": relay_sums(),
}
OF_PLAYS = ("Prandtl-Ishlinskii", "its inverse", "generalised")
every_kind = pytest.mark.parametrize("kind", EVERY)


def by_clipping(u, memory, low, high):
    return np.clip(memory, u - high, u - low)


def by_envelopes(u, memory, spec):
    (a, b, c, d), (e, f, g, h) = spec.rising, spec.falling
    ends = a * np.tanh(b * u + c) + d - spec.r, e * np.tanh(f * u + g) + h + spec.r
    return np.clip(memory, np.minimum(*ends), np.maximum(*ends))


def of_the_inverse(spec):
    """Weights and thresholds of the operator whose loading curve is the inverse one."""
    r, slopes = np.array(spec.r), spec.w_0 + np.cumsum([0.0, *spec.w])
    curve = spec.w_0 * r + np.maximum(r[:, None] - r, 0) @ np.array(spec.w)
    return 1 / spec.w_0, np.diff(1 / slopes), curve


def by_switching(u, sides, on, off):
    return np.where(u >= on, 1.0, np.where(u <= off, -1.0, sides))


def operator(spec, path):
    """Return the output at each turning point, from the textbook's step between two of them."""
    memory, out = default_state(nlctl.block(spec, "b")), []
    for u in path:
        if isinstance(spec, nlctl.Backlash):
            memory = spec.m_r * by_clipping(u, memory / spec.m_r, spec.c_l, spec.c_r)
            out.append(memory[0])
        elif isinstance(spec, nlctl.actuators.Stop):
            memory = by_clipping(u, memory, -spec.r, spec.r)
            out.append(u - memory[0])
        elif isinstance(spec, nlctl.actuators.PrandtlIshlinskii):
            memory = by_clipping(u, memory, -np.array(spec.r), np.array(spec.r))
            out.append(spec.w_0 * u + np.dot(spec.w, memory))
        elif isinstance(spec, nlctl.actuators.PrandtlIshlinskiiInverse):
            first, w, r = of_the_inverse(spec)
            memory = by_clipping(u, memory, -r, r)
            out.append(first * u + np.dot(w, memory))
        elif isinstance(spec, nlctl.actuators.GeneralisedPrandtlIshlinskii):
            memory = by_envelopes(u, memory, spec)
            out.append(np.dot(spec.w, memory))
        elif isinstance(spec, nlctl.Relay):
            memory = by_switching(u, memory, spec.on, spec.off)
            out.append(spec.height * memory[0])
        else:
            memory = by_switching(u, memory, np.array(spec.alpha), np.array(spec.beta))
            out.append(np.dot(spec.w, memory))
    return np.array(out)


@every_kind
class TestEveryOperator:
    @pytest.mark.slow
    @given(data=st.data())
    def test_machine_code_follows_the_operator(self, kind, data):
        """From turning point to turning point, thresholds met exactly among them."""
        spec, path = data.draw(EVERY[kind]), data.draw(paths)
        np.testing.assert_allclose(along(spec, path), operator(spec, path), atol=1e-13)

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_machine_code_equals_python_control_at_break_points(self, kind, data):
        """Right-hand side and output, at random and with u and memory on every corner."""
        spec = data.draw(EVERY[kind])
        block, made, p = nlctl.block(spec, "b"), compiled(type(spec)), values(spec)
        x = np.array(data.draw(st.lists(inputs, min_size=len(spec.states), max_size=10)))
        x = x[: len(spec.states)]
        corners = spec.switching(0.0, x, np.array([0.0]), equation_arguments(spec))
        slope = spec.switching(0.0, x, np.array([1.0]), equation_arguments(spec))
        at = -np.asarray(corners) / (np.asarray(slope) - np.asarray(corners))
        for u in (data.draw(inputs), *at, *np.nextafter(at, 9), *np.nextafter(at, -9)):
            for name in ("dynamics", "output"):
                expected = getattr(block, name)(0.0, x, [u])
                got = getattr(made, name)(0.0, x, [u], p)
                np.testing.assert_allclose(got, expected, rtol=1e-14, atol=1e-12)  # rates of 1000

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_it_is_rate_independent(self, kind, data):
        """The same path at other times makes the same outputs, to the bit."""
        spec, path = data.draw(EVERY[kind]), data.draw(paths)
        steps = data.draw(
            st.lists(st.floats(0.01, 50), min_size=len(path) - 1, max_size=len(path) - 1)
        )
        warped = drive(spec, np.append(0.0, np.cumsum(steps)), path).outputs[0]
        np.testing.assert_array_equal(warped, along(spec, path))

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_a_run_may_be_split(self, kind, data):
        """Going on from a saved state equals going on, to the bit (semigroup)."""
        spec, one, two = data.draw(EVERY[kind]), data.draw(paths), data.draw(paths)
        whole = along(spec, one + two)
        first = drive(spec, np.arange(float(len(one))), one)
        rest = along(spec, one[-1:] + two, first.states[:, -1])
        np.testing.assert_array_equal(np.append(first.outputs[0], rest[1:]), whole)

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(10, part=2))
    def test_it_does_not_depend_on_the_solver(self, kind, data):
        """Explicit or stiff, at another tolerance, with fixed steps that meet no turning point."""
        spec, path = data.draw(EVERY[kind]), data.draw(paths)
        times, known = np.arange(float(len(path))), along(spec, path)
        for options in (
            {"method": "rodas5p"},
            {"method": "taylor"},
            {"rtol": 1e-4, "atol": 1e-6},
            {"step": 0.37},
        ):
            found = drive(spec, times, path, **options).outputs[0]
            np.testing.assert_allclose(found, known, rtol=0, atol=1e-12)

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(10, part=2))
    def test_cycles_turn_one_way(self, kind, data):
        """Once it has been through, a cycle of u encloses v counterclockwise, or clockwise."""
        spec, (a, b) = data.draw(EVERY[kind]), data.draw(st.tuples(inputs, inputs))
        u = dense([a, b, a, b, a], 400)
        v = along(spec, u)
        sense = 1 if kind in ("stop", "its inverse") else -1
        rest = 2 * abs(b - a) / 400 * np.abs(v).max()  # of jumps between two points
        assert sense * integral(v[801:], u[801:]) >= -rest

    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_a_constant_input_keeps_the_output(self, kind, data):
        """Applied to what it has become, the operator changes nothing (idempotence)."""
        spec, path = data.draw(EVERY[kind]), data.draw(paths)
        v = along(spec, [*path, path[-1], path[-1]])
        assert v[-1] == v[-2] == v[-3]

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_closed_minor_loops_leave_no_trace(self, kind, data):
        """After a <= c <= b the path a, b, c, b goes on as a, b does (wiping out)."""
        spec, before = data.draw(EVERY[kind]), data.draw(paths)
        a, c, b = sorted(data.draw(st.lists(inputs, min_size=3, max_size=3)))
        for path in ([a, b], [b, a]):
            after = data.draw(paths)
            straight = along(spec, before + path + after)
            looped = along(spec, [*before, *path, c, path[-1], *after])
            np.testing.assert_allclose(looped[-len(after) :], straight[-len(after) :], atol=1e-12)

    @pytest.mark.slow
    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_minor_loops_between_equal_inputs_are_congruent(self, kind, data):
        """Whatever came before, the loop between a and b is the same but for a shift of v."""
        spec, (a, b) = data.draw(EVERY[kind]), data.draw(st.tuples(inputs, inputs))
        loops = []
        for _ in range(2):
            before, cycle = data.draw(paths), dense([a, b, a], 8)
            loops.append(along(spec, [*before, a, b, *cycle])[-cycle.size :])
        np.testing.assert_allclose(np.diff(loops[0]), np.diff(loops[1]), atol=1e-12)

    @given(data=st.data())
    @settings(max_examples=many(20, part=4))
    def test_the_output_is_admissible_from_the_first_instant(self, kind, data):
        """For every first input and every memory: in the band of that input."""
        spec, u = data.draw(EVERY[kind]), data.draw(inputs)
        first = along(spec, [u, u])[0]
        if kind in ("play", *OF_PLAYS):
            low, high = spec.band(0.0, u, equation_arguments(spec))
            assert low - 1e-12 <= first <= high + 1e-12
        elif kind == "stop":
            assert abs(first) <= spec.r * (1 + 1e-12)
        else:
            assert first == pytest.approx(operator(spec, [u])[0], abs=1e-13)


def sum_of_slopes(spec):
    """The largest slope of both envelopes, by the sum of the weights."""
    return sum(spec.w) * max(spec.rising[0] * spec.rising[1], spec.falling[0] * spec.falling[1])


def sum_of_weights(spec):
    """The weights of the inverse, most of them negative."""
    first, w, _ = of_the_inverse(spec)
    return first + np.abs(w).sum()


LIPSCHITZ = {
    "play": lambda spec: spec.gains[1],
    "stop": lambda spec: 2.0,
    "Prandtl-Ishlinskii": lambda spec: spec.gains[1],
    "its inverse": sum_of_weights,
    "generalised": sum_of_slopes,
}


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("kind", LIPSCHITZ)
@given(data=st.data())
def test_outputs_are_no_further_apart_than_the_inputs(kind, data):
    """In the supremum norm: Lipschitz constant m of the play, 2 of the stop, the sum of a sum.

    Those of memories of equal inputs: relays have none.
    """
    spec = data.draw(EVERY[kind])
    pairs = data.draw(st.lists(st.tuples(inputs, inputs), min_size=2, max_size=8))
    one, two = np.array(pairs).T
    constant = LIPSCHITZ[kind](spec)
    apart = np.abs(along(spec, one) - along(spec, two)).max()
    assert apart <= constant * np.abs(one - two).max() * (1 + 1e-12)


def integral(v, u):
    """The integral of v du along a polygon."""
    return float(np.sum((u[1:] - u[:-1]) * (v[1:] + v[:-1])) / 2)


quarters = st.integers(1, 8).map(lambda k: k / 4)


def every_quarter(path):
    """Return a path with a point at every multiple of 1/4 that it passes: all kinks are there."""
    points = [path[:1]]
    for a, b in pairwise(path):
        count = max(round(abs(b - a) * 4), 1)
        points.append(a + (b - a) * np.arange(1, count + 1) / count)
    return np.concatenate(points)


grid_paths = st.lists(on_the_grid, min_size=2, max_size=8)


@given(A=quarters, r=quarters)
def test_loop_areas_of_play_and_stop(A, r):
    """A cycle of amplitude A encloses 4 r (A - r), and nothing where A <= r."""
    cycle = every_quarter([-A, A, -A])
    for spec, sense in (
        (nlctl.Backlash(m_r=1, m_l=1, c_r=r, c_l=-r), -1),
        (nlctl.actuators.Stop(r=r), 1),
    ):
        v = along(spec, [A, *cycle])[1:]
        assert integral(v, cycle) == pytest.approx(sense * 4 * r * max(A - r, 0.0), abs=1e-12)


@given(A=quarters, w=st.lists(positive, min_size=4, max_size=4))
def test_the_loop_area_of_a_sum_of_plays_is_the_sum_of_theirs(A, w):
    """Of each 4 r (A - r), by its weight."""
    spec, r = (
        nlctl.actuators.PrandtlIshlinskii(w=w, r=(0.25, 0.5, 1.0, 1.5)),
        np.array((0.25, 0.5, 1.0, 1.5)),
    )
    cycle = every_quarter([-A, A, -A])
    v = along(spec, [A, *cycle])[1:]
    wanted = -4 * np.dot(w, r * np.maximum(A - r, 0))
    assert integral(v, cycle) == pytest.approx(wanted, abs=1e-11)


@given(A=st.floats(0.1, 3), w=st.lists(positive, min_size=10, max_size=10))
def test_the_loop_area_of_a_preisach_operator_is_that_of_the_relays_it_switches(A, w):
    """Of each relay that both ends pass 2 w (alpha - beta): exactly, between its thresholds."""
    spec = nlctl.actuators.Preisach(w=w)
    alpha, beta = np.array(spec.alpha), np.array(spec.beta)
    near = np.add.outer([-1e-9, 0.0, 1e-9], [*alpha, *beta]).ravel()
    up = np.unique([-A, *near[np.abs(near) < A], A])
    cycle = np.concatenate((up, up[-2::-1]))
    v = along(spec, [A, *cycle])[1:]
    passed = (alpha <= A) & (beta >= -A)
    wanted = -2 * np.dot(w, np.where(passed, alpha - beta, 0))
    assert integral(v, cycle) == pytest.approx(wanted, abs=1e-6)


@given(A=quarters, height=positive)
def test_loop_area_of_a_relay(A, height):
    """It encloses 2 height (on - off) where the input passes both thresholds, counterclockwise."""
    spec = nlctl.Relay(on=0.6, off=-0.3, height=height)
    near = np.array([-A, *(-0.3 + 1e-9 * np.arange(-1, 2)), *(0.6 + 1e-9 * np.arange(-1, 2)), A])
    near = near[np.abs(near) <= A]
    cycle = np.concatenate((near, near[-2::-1]))
    v = along(spec, [A, *cycle])[1:]
    expected = 2 * height * 0.9 if A >= 0.6 else 0.0
    assert -integral(v, cycle) == pytest.approx(expected, abs=1e-7)


@pytest.mark.slow
@given(path=grid_paths, r=quarters)
def test_the_stop_stores_v_squared_over_two_and_burns_the_rest(path, r):
    """Its work, the integral of v du, is the change of v^2 / 2 and r times the play's way."""
    spec, u = nlctl.actuators.Stop(r=r), every_quarter(path)
    v = along(spec, u)
    way = np.abs(np.diff(u - v)).sum()
    assert integral(v, u) == pytest.approx((v[-1] ** 2 - v[0] ** 2) / 2 + r * way, abs=1e-12)


@given(path=grid_paths)
def test_plays_burn_their_thresholds_times_their_ways(path):
    """The integral of u dv is the change of what is stored, and sum w_i r_i |dH_i| >= 0."""
    spec = nlctl.actuators.PrandtlIshlinskii(r=(0.25, 0.5, 1.0, 1.5))
    u = every_quarter(path)
    run = drive(spec, np.arange(float(u.size)), u)
    H, v, w, r = run.states, run.outputs[0], np.array(spec.w), np.array(spec.r)
    stored = (spec.w_0 * u**2 + w @ H**2) / 2
    burnt = w * r @ np.abs(np.diff(H)).sum(axis=1)
    assert integral(u, v) == pytest.approx(stored[-1] - stored[0] + burnt, abs=1e-12)


def test_a_preisach_operator_of_one_level_pair_is_a_relay():
    """With one relay, and as the sum of its relays with several."""
    path = np.random.default_rng(4).normal(size=60)
    one = nlctl.actuators.Preisach(alpha=(0.5,), beta=(-0.25,), w=(2.0,))
    np.testing.assert_array_equal(
        operator(one, path), operator(nlctl.Relay(on=0.5, off=-0.25, height=2.0), path)
    )
    many = nlctl.actuators.Preisach(w=np.arange(1.0, 11.0))
    parts = [
        along(nlctl.Relay(on=on, off=off, height=w), path)
        for on, off, w in zip(many.alpha, many.beta, many.w, strict=True)
    ]
    np.testing.assert_allclose(along(many, path), sum(parts), atol=1e-12)


def test_a_sum_of_plays_is_the_sum_of_plays():
    """With as many backlashes; one play and one stop add up to the input."""
    path = np.random.default_rng(5).normal(size=60)
    spec = nlctl.actuators.PrandtlIshlinskii()
    plays = [nlctl.Backlash(m_r=1, m_l=1, c_r=r, c_l=-r) for r in spec.r]
    parts = [w * along(play, path) for w, play in zip(spec.w, plays, strict=True)]
    np.testing.assert_allclose(along(spec, path), spec.w_0 * path + sum(parts), atol=1e-13)
    stop = along(nlctl.actuators.Stop(r=spec.r[0]), path)
    np.testing.assert_allclose(stop + along(plays[0], path), path, atol=1e-13)


def three_plays(path):
    """Return the outputs of three plays and the input itself, at turning points."""
    spec = nlctl.actuators.PrandtlIshlinskii(w_0=0.5, w=(0.2, 0.2, 0.1), r=(0.2, 0.4, 0.6))
    made = compiled(nlctl.actuators.PrandtlIshlinskii, (("w", spec.w), ("r", spec.r)))
    path = np.asarray(path, dtype=float)
    times = np.arange(float(path.size))
    return nlctl.input_output_response(made, times, path, params=values(spec)).outputs


class TestGeneralisedPlays:
    """With the default weights and thresholds: those of `three_plays`, and a play without gap."""

    @given(path=paths)
    @settings(max_examples=many(20, part=4))
    def test_with_equal_envelopes_it_is_a_sum_of_plays_behind_a_characteristic(self, path):
        """A play of half gap 0 is that characteristic itself."""
        envelope = (2.0, 0.5, 0.3, -0.1)
        made = nlctl.actuators.GeneralisedPrandtlIshlinskii(rising=envelope, falling=envelope)
        gamma = 2.0 * np.tanh(0.5 * np.array(path) + 0.3) - 0.1
        np.testing.assert_allclose(along(made, path), three_plays(gamma), atol=1e-13)

    def test_nearly_straight_envelopes_make_the_plain_operator(self):
        """tanh(s u) / s tends to u with the square of s."""
        path = np.random.default_rng(6).uniform(-2, 2, 40)
        wanted, apart = three_plays(path), []
        for s in (0.04, 0.02, 0.01):
            straight = (1 / s, s, 0.0, 0.0)
            made = nlctl.actuators.GeneralisedPrandtlIshlinskii(rising=straight, falling=straight)
            apart.append(np.abs(along(made, path) - wanted).max())
        np.testing.assert_allclose(np.log2(apart[:-1]) - np.log2(apart[1:]), 2.0, atol=0.05)

    @given(c=st.floats(0.1, 1.5), height=positive)
    @settings(max_examples=many(20, part=4))
    def test_the_area_between_saturations_that_are_apart_by_2_c(self, c, height):
        """The integral of h (tanh(u + c) - tanh(u - c)) over all u is 4 c h."""
        one = compiled(nlctl.actuators.GeneralisedPrandtlIshlinskii, (("w", (1.0,)), ("r", (0.0,))))
        ends = {"rising": (height, 1.0, -c, 0.0), "falling": (height, 1.0, c, 0.0)}
        params = {f"actuator.{name}": envelope for name, envelope in ends.items()}
        u = dense([20.0, -20.0, 20.0], 4000)
        run = nlctl.input_output_response(one, np.arange(float(u.size)), u, params=params)
        assert -integral(run.outputs, u) == pytest.approx(4 * c * height, rel=1e-4)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("kind", EVERY)
def test_in_python_control_the_memories_are_committed(kind):
    """By the reference engine: the operator itself, with corners of u between samples."""
    spec = {
        "play": nlctl.Backlash(),
        "stop": nlctl.actuators.Stop(),
        "Prandtl-Ishlinskii": nlctl.actuators.PrandtlIshlinskii(),
        "its inverse": nlctl.actuators.PrandtlIshlinskiiInverse(),
        "generalised": nlctl.actuators.GeneralisedPrandtlIshlinskii(),
        "relay": nlctl.Relay(),
        "Preisach": nlctl.actuators.Preisach(),
    }[kind]
    times = np.linspace(0, 7, 36)  # u(6.4) is 1e-2 beside the threshold -0.5 of a relay
    u = np.interp(times, [0, 2, 3, 5, 7], [-1.3, 1.2, 0.37, 1.6, -1.4 - 1e-2 / 0.7])
    block = nlctl.block(spec, "actuator")
    made = nlctl.input_output_response(block, times, u, engine="python-control")
    np.testing.assert_allclose(made.outputs, drive(spec, times, u).outputs[0], atol=1e-12)


@each_row(
    ("make", "told"),
    [
        (lambda: nlctl.actuators.Stop(r=0.0), "Stop needs r > 0, got 0"),
        (lambda: nlctl.actuators.Stop(v0=np.nan), "Stop needs a finite v0, got nan"),
        (
            lambda: nlctl.actuators.PrandtlIshlinskii(r=(0.2, 0.1, 0.3, 0.4)),
            "increasing thresholds r",
        ),
        (
            lambda: nlctl.actuators.PrandtlIshlinskii(r=(0.2, 0.3)),
            "got 4 weights w and 2 thresholds r",
        ),
        (lambda: nlctl.actuators.PrandtlIshlinskii(w=(-0.3, -0.4, 0, 0)), r"w_0 \+ w\[0\] .* > 0"),
        (
            lambda: nlctl.actuators.PrandtlIshlinskii(v0=(0.0, 1.0)),
            "needs v0 to be one number or 4, got 2",
        ),
        (
            lambda: nlctl.actuators.GeneralisedPrandtlIshlinskii(rising=(1.0, -1.0, 0.0, 0.0)),
            "needs rising = .* a_1 > 0, so that the envelope increases, got",
        ),
        (
            lambda: nlctl.actuators.GeneralisedPrandtlIshlinskii(falling=(1.0, 1.0, 0.0)),
            r"needs falling = \(a_0, a_1, a_2, a_3\)",
        ),
        (
            lambda: nlctl.actuators.GeneralisedPrandtlIshlinskii(r=(0.0,)),
            "got 4 weights w and 1 threshold r",
        ),
        (lambda: nlctl.Relay(on=-1.0), "Relay needs off < on, got -1 and -1"),
        (lambda: nlctl.Relay(v0=0.0), "Relay needs v0 of 1 and -1 only, got 0"),
        (lambda: nlctl.Relay(v0=(1.0, 1.0)), "Relay needs a number for v0"),
        (
            lambda: nlctl.actuators.Preisach(w=(1.0,)),
            "as many alpha as beta and weights w, got 10, 10 and 1",
        ),
        (
            lambda: nlctl.actuators.Preisach(alpha=(1.0,), beta=(1.0,), w=(1.0,)),
            r"beta\[0\] < alpha\[0\]",
        ),
        (lambda: nlctl.actuators.relay_grid((0.0, 0.0)), "two or more increasing levels"),
    ],
)
def test_what_makes_no_operator_is_refused(make, told):
    """With the record, the rule and the value."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()


@pytest.mark.parametrize("kind", ["play", "stop", *OF_PLAYS])
@given(data=st.data())
def test_in_contact_the_switching_function_is_exactly_zero(kind, data):
    """Where the memory was carried to.

    What rounding would leave of it may have the wrong sign, and would be met as an event again.
    """
    spec = data.draw(EVERY[kind])
    p, n = equation_arguments(spec), len(spec.states)
    x = np.array(data.draw(st.lists(inputs, min_size=n, max_size=n)))
    u = np.array([data.draw(inputs)])
    moved = np.array(spec.commit(0.0, x, u, p), dtype=float)
    distances = np.reshape(spec.switching(0.0, moved, u, p), (2, n))
    np.testing.assert_array_equal((distances == 0).any(axis=0)[moved != x], True)


@pytest.mark.weekly
@pytest.mark.parametrize("rtol", [1e-6, 1e-9])
def test_a_sum_of_plays_in_a_closed_loop_takes_no_more_steps_than_a_play(rtol):
    """Several memories that reverse and touch together: the paper's Example 1 with one and four."""
    steps = []
    for actuator in (
        nlctl.Backlash(m_r=1, m_l=1, c_r=0.5, c_l=-0.5),
        nlctl.actuators.PrandtlIshlinskii(),
    ):
        loop = nlctl.compile(nlctl.paper.example_1(actuator=actuator))
        run = nlctl.input_output_response(loop, np.linspace(0, 20, 201), rtol=rtol)
        steps.append(run.statistics.accepted + run.statistics.rejected)
    assert steps[1] < 1.5 * steps[0]


@pytest.mark.parted
@pytest.mark.parametrize("kind", EVERY)
def test_members_of_an_ensemble_are_single_runs(kind):
    """Memories that start elsewhere, side by side in lanes; sums add up in another order."""
    record = {
        "play": nlctl.Backlash, "stop": nlctl.actuators.Stop,
        "Prandtl-Ishlinskii": nlctl.actuators.PrandtlIshlinskii,
        "its inverse": nlctl.actuators.PrandtlIshlinskiiInverse,
        "generalised": nlctl.actuators.GeneralisedPrandtlIshlinskii, "relay": nlctl.Relay,
        "Preisach": nlctl.actuators.Preisach,
    }[kind]  # fmt: skip
    rng = np.random.default_rng(8)
    path, memories = rng.normal(size=20), np.sign(rng.normal(size=(11, len(record().states))))
    names = [f"actuator.{name}" for name in record().states]
    start = dict(zip(names, memories.T, strict=True))
    times = np.arange(20.0)
    made = nlctl.ensemble_response(compiled(record), times, path, start, keep=["v"])
    alone = [along(record(), path, memory) for memory in memories]
    np.testing.assert_allclose(made.signals["v"], alone, rtol=0, atol=1e-15)
