"""Dead zone: its characteristic.  Backlash: what is known of the play operator."""

from itertools import pairwise

import control as ct
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import nlctl
from nlctl.actuators.backlash import play, play_band
from nlctl.params import equation_arguments

inputs = st.floats(-20, 20)


def v_of(spec, u):
    """Return the dead zone's output."""
    return spec.output(0.0, (), (u,), equation_arguments(spec))[0]


@st.composite
def dead_zones(draw):
    slopes = {side: draw(st.floats(0.2, 3)) for side in "rl"}
    values = {f"slope_{side}": m for side, m in slopes.items()}
    values |= {f"ripple_{s}": m * draw(st.floats(-0.95, 0.95)) for s, m in slopes.items()}
    return nlctl.DeadZone(**values, b_r=draw(st.floats(0.01, 2)), b_l=-draw(st.floats(0.01, 2)))


class TestDeadZone:
    @given(u=inputs)
    def test_the_characteristic_of_the_paper(self, u):
        """Three pieces, written out."""
        right, left = (1 + 0.3 * np.sin(u)) * (u - 0.5), (0.8 + 0.2 * np.cos(u)) * (u + 0.3)
        expected = right if u >= 0.5 else left if u <= -0.3 else 0.0
        assert v_of(nlctl.DeadZone(), u) == pytest.approx(expected, rel=1e-14, abs=1e-15)

    @given(spec=dead_zones(), step=st.floats(1e-9, 1e-3))
    def test_it_is_continuous_at_the_break_points(self, spec, step):
        """v(b) = 0 at either end, and close by it is at most steepest slope times distance."""
        for b, side in ((spec.b_r, "r"), (spec.b_l, "l")):
            steepest = getattr(spec, f"slope_{side}") + abs(getattr(spec, f"ripple_{side}"))
            assert v_of(spec, b) == 0.0
            assert v_of(spec, b - np.sign(b) * step * min(1.0, abs(b))) == 0.0
            outside = b + np.sign(b) * step
            assert abs(v_of(spec, outside)) <= steepest * abs(outside - b) * (1 + 1e-12)

    @given(spec=dead_zones(), u=inputs)
    def test_sector_and_sign(self, spec, u):
        """v has the sign of u or is 0, and lies between the least and the steepest slope."""
        v = v_of(spec, u)
        if spec.b_l <= u <= spec.b_r:
            assert v == 0.0
            return
        side, b = ("r", spec.b_r) if u > 0 else ("l", spec.b_l)
        slope, ripple = getattr(spec, f"slope_{side}"), abs(getattr(spec, f"ripple_{side}"))
        distance = abs(u - b)
        assert v * u > 0 or distance < 1e-12
        assert (slope - ripple) * distance * (1 - 1e-12) <= abs(v)
        assert abs(v) <= (slope + ripple) * distance * (1 + 1e-12)

    @given(u=inputs, slope=st.floats(0.1, 5), b=st.floats(0.1, 3))
    def test_the_symmetric_one_without_ripple_is_odd_and_shrinks_by_b(self, u, slope, b):
        """v = slope (u - clip(u, -b, b)), the textbook formula."""
        spec = nlctl.DeadZone(slope_r=slope, slope_l=slope, ripple_r=0, ripple_l=0, b_r=b, b_l=-b)
        assert v_of(spec, u) == pytest.approx(slope * (u - np.clip(u, -b, b)), abs=1e-12)
        assert v_of(spec, -u) == -v_of(spec, u)

    @pytest.mark.parametrize("side", ["r", "l"])
    def test_a_slope_that_could_vanish_is_refused(self, side):
        """Assumption 1 wants k(u, t) > 0."""
        told = rf"needs \|ripple_{side}\| < slope_{side}.* got -2 and 1"
        with pytest.raises(nlctl.errors.ParameterError, match=told):
            nlctl.DeadZone(**{f"slope_{side}": 1.0, f"ripple_{side}": -2.0})


@st.composite
def backlashes(draw, equal_slopes=False):
    m_r = draw(st.floats(0.2, 3))
    c_l = draw(st.floats(-2, 1.5))
    return nlctl.Backlash(
        m_r=m_r,
        m_l=m_r if equal_slopes else draw(st.floats(0.2, 3)),
        c_l=c_l,
        c_r=c_l + draw(st.floats(0.05, 3)),
    )


def sweep(spec, path, memory):
    """Return the exact play along turning points: clipping is exact while u is monotone."""
    p = equation_arguments(spec)
    for u in path:
        memory = play(u, memory, p)
    return float(memory)


class TestPlay:
    """The operator itself, from one turning point of u to the next."""

    @given(spec=backlashes(), u=inputs, memory=inputs)
    def test_output_lies_in_the_gap_and_moves_no_more_than_it_must(self, spec, u, memory):
        """v is the point of the gap nearest to the memory."""
        lines = spec.m_r * (u - spec.c_r), spec.m_l * (u - spec.c_l)
        low, high = play_band(u, equation_arguments(spec))
        assert (low, high) == (min(lines), max(lines))
        assert sweep(spec, [u], memory) == np.clip(memory, low, high)

    @given(spec=backlashes(), u=inputs, memory=inputs, first=inputs)
    def test_a_constant_input_keeps_the_output(self, spec, u, memory, first):
        """Once clipped, clipped for good; also after any history."""
        v = sweep(spec, [first, u], memory)
        assert sweep(spec, [u, u, u], v) == v

    @given(spec=backlashes(), path=st.lists(inputs, min_size=1, max_size=5), data=st.data())
    def test_memories_never_move_apart(self, spec, path, data):
        """Two memories under one input keep their order, and their distance does not grow."""
        one, two = sorted(data.draw(st.lists(inputs, min_size=2, max_size=2)))
        a, b = sweep(spec, path, one), sweep(spec, path, two)
        assert 0 <= b - a <= two - one

    @given(spec=backlashes(equal_slopes=True), path=st.lists(inputs, min_size=2, max_size=6))
    def test_it_is_rate_independent(self, spec, path):
        """Only the turning points of u count, not how many points lie between them."""
        dense = [u for a, b in pairwise(path) for u in np.linspace(a, b, 9)]
        assert sweep(spec, dense, 0.0) == pytest.approx(sweep(spec, path, 0.0), abs=1e-12)

    @given(spec=backlashes(equal_slopes=True), memory=inputs, data=st.data())
    def test_closed_minor_loops_leave_no_trace(self, spec, memory, data):
        """After a <= c <= b, the path a, b, c, b ends where a, b does (return point memory)."""
        a, c, b = sorted(data.draw(st.lists(inputs, min_size=3, max_size=3)))
        for path in ([a, b], [b, a]):
            loop = [*path, c, path[-1]]
            assert sweep(spec, loop, memory) == pytest.approx(sweep(spec, path, memory), abs=1e-12)

    @given(spec=backlashes(equal_slopes=True), data=st.data())
    def test_a_wide_enough_swing_wipes_out_the_past(self, spec, data):
        """After u has crossed the gap the output does not depend on what came before."""
        before = data.draw(st.lists(inputs, max_size=4))
        u = data.draw(inputs)
        path = [u, u + (spec.c_r - spec.c_l) + 1e-9]
        top = spec.m_r * (path[-1] - spec.c_r)
        assert sweep(spec, before + path, 0.0) == pytest.approx(top, abs=1e-8)

    @given(spec=backlashes(), memory=inputs, u=inputs, du=st.floats(-1e-6, 1e-6))
    def test_it_is_continuous_where_the_lines_cross(self, spec, memory, u, du):
        """Unequal slopes: a small step of u makes a small step of v everywhere."""
        crossing = u
        if spec.m_r != spec.m_l:
            crossing = (spec.m_r * spec.c_r - spec.m_l * spec.c_l) / (spec.m_r - spec.m_l)
        for where in (u, crossing):
            v = sweep(spec, [where], memory)
            steepest = max(spec.m_r, spec.m_l)
            change = abs(sweep(spec, [where + du], v) - v)
            assert change <= steepest * abs(du) + 1e-9 * (1 + abs(where))

    def test_the_gap_has_two_ends(self):
        """c_l < c_r, and the slopes are positive."""
        with pytest.raises(nlctl.errors.ParameterError, match=r"needs c_l < c_r, got 1 and 0\.5"):
            nlctl.Backlash(c_l=1.0)
        with pytest.raises(nlctl.errors.ParameterError, match="Backlash needs m_l > 0, got 0"):
            nlctl.Backlash(m_l=0)


def respond(u, end, *, start=0.0, memory=None, samples=41, **changed):
    """Run the block under u(t) in python-control; return times, u, v and the last memory."""
    spec = nlctl.Backlash(**{"m_r": 1.0, "m_l": 1.0, "c_r": 0.5, "c_l": -0.5} | changed)
    source = ct.nlsys(None, lambda t, x, _, p: [u(t)], inputs=0, outputs=["u"], name="source")
    diagram = ct.interconnect(
        [source, nlctl.block(spec, "actuator")], inputs=[], outputs=["u", "v"]
    )
    x0 = nlctl.initial_state(diagram) if memory is None else [memory]
    t = np.linspace(start, end, samples)
    run = ct.input_output_response(
        diagram,
        t,
        0,
        x0,
        solve_ivp_method="LSODA",
        solve_ivp_kwargs={"rtol": 1e-9, "atol": 1e-12, "max_step": 0.02},
    )
    return t, *run.outputs, float(run.states[0, -1])


def exact(spec_changed, u, end, samples):
    """Return the play at equal times, from 400 times as many clipping steps."""
    spec = nlctl.Backlash(**{"m_r": 1.0, "m_l": 1.0, "c_r": 0.5, "c_l": -0.5} | spec_changed)
    p, memory, values = equation_arguments(spec), spec.v0, []
    for k, s in enumerate(np.linspace(0, end, 400 * (samples - 1) + 1)):
        memory = play(u(s), memory, p)
        if k % 400 == 0:
            values.append(float(memory))
    return np.array(values)


class TestBacklashInPythonControl:
    """The block with its relaxed memory, in plain `control.input_output_response`."""

    @given(spec=backlashes(), u=inputs, memory=inputs)
    def test_the_output_is_in_the_gap_from_the_start(self, spec, u, memory):
        """Whatever the initial input and memory: no jump, no transient outside the gap."""
        block = nlctl.block(spec, "actuator")
        v = block.output(0.0, [memory], [u])[0]
        low, high = play_band(u, equation_arguments(spec))
        assert low <= v <= high
        assert v == sweep(spec, [u], memory)

    def test_the_error_of_a_held_output_is_the_curvature_over_the_square_of_the_rate(self):
        """After the peak of a smooth u the output misses v = m (peak - c): |u''| grows with f^2."""
        errors = []
        for f in (8.0, 16.0, 32.0):
            end = (np.pi / 2 + 0.6) / f
            _, _, v, _ = respond(lambda t, f=f: 2 * np.sin(f * t), end, samples=3)
            errors.append(abs(v[-1] - 1.5))
        np.testing.assert_allclose(np.log2(np.array(errors[1:]) / errors[:-1]), 2.0, atol=0.15)

    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize(
        "changed", [{}, {"m_r": 1.5, "m_l": 0.8}, {"m_r": 0.8, "m_l": 1.5, "v0": 0.4}]
    )
    def test_it_follows_the_play_operator(self, changed):
        """Equal and unequal slopes, along an input with minor loops."""

        def u(t):
            return 1.5 * np.sin(t) + 0.8 * np.sin(2.7 * t)

        _, _, v, _ = respond(u, 8.0, **changed)
        np.testing.assert_allclose(v, exact(changed, u, 8.0, v.size), atol=2e-4)

    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize(("amplitude", "r"), [(2.0, 0.5), (1.2, 0.3), (1.0, 0.8)])
    def test_the_loop_area_is_4_r_times_amplitude_minus_r(self, amplitude, r):
        """One cycle of u = A sin t encloses 4 r (A - r) for unit slopes and the half gap r."""
        t, _, v, _ = respond(
            lambda t: amplitude * np.sin(t), 4 * np.pi, c_r=r, c_l=-r, samples=1601
        )
        late = t >= 2 * np.pi - 1e-9
        work = v[late] * amplitude * np.cos(t[late])  # v du / dt
        area = abs(np.trapezoid(work, t[late]))
        assert area == pytest.approx(4 * r * (amplitude - r), rel=1e-3)

    @pytest.mark.slow
    def test_it_is_rate_independent(self):
        """The same path at a warped time ends at the same output."""
        path = lambda s: 2 * np.sin(3 * s) * np.exp(-0.3 * s)  # noqa: E731
        ends = [respond(lambda t, w=w: path(w(t)), 3.0, samples=3)[2][-1] for w in WARPS]
        np.testing.assert_allclose(ends, ends[0], atol=1e-4)

    def test_a_minor_loop_leaves_no_trace(self):
        """Down to 0.4 and back on the way from -1.5 to 1.5, or straight: the same afterwards."""
        straight = respond(lambda t: np.interp(t, [0, 1, 4, 5], [-1.5, 1, 1, 1.5]), 5.0)
        looping = respond(
            lambda t: np.interp(t, [0, 1, 2, 3, 4, 5], [-1.5, 1, 0.4, 1, 1, 1.5]), 5.0
        )
        np.testing.assert_allclose(looping[2][-8:], straight[2][-8:], atol=1e-6)
        assert np.abs(looping[1] - straight[1]).max() > 0.5

    @pytest.mark.slow
    def test_a_run_may_be_split(self):
        """Going on from the last memory equals going on."""
        u = lambda t: 2 * np.sin(t)  # noqa: E731
        _, _, whole, end = respond(u, 6.0, samples=7)
        _, _, one, middle = respond(u, 3.0, samples=4)
        _, _, two, last = respond(u, 6.0, start=3.0, memory=middle, samples=4)
        np.testing.assert_allclose([*one, *two[1:], last], [*whole, end], atol=1e-7)

    def test_an_overridden_memory_is_where_the_run_starts(self):
        """v0 is the record's start of the state "memory": a run changes it by the state's name."""
        block, t = nlctl.block(nlctl.Backlash(), "actuator"), np.linspace(0, 0.1, 3)
        made = nlctl.input_output_response(nlctl.block(nlctl.Backlash(v0=0.4), "actuator"), t)
        np.testing.assert_allclose(made.outputs, 0.4, atol=1e-9)
        with pytest.raises(nlctl.errors.UnknownNameError, match="unknown parameter 'v0'"):
            nlctl.input_output_response(block, t, params={"actuator.v0": 0.4})
        run = nlctl.input_output_response(block, t, 0, {"actuator.memory": 0.4})
        np.testing.assert_allclose(run.outputs, made.outputs, atol=1e-9)

    def test_on_the_sides_of_the_gap_it_is_exact(self):
        """While u moves against a side, v is that line."""
        _, u, v, _ = respond(lambda t: 3 * t, 1.0, samples=11)
        touching = u > 0.5 + 1e-9
        np.testing.assert_allclose(v[touching], u[touching] - 0.5, atol=1e-14)
        np.testing.assert_allclose(v[~touching], 0.0, atol=1e-14)


WARPS = [lambda t: t, lambda t: t**2 / 3, lambda t: 3 * np.sin(np.pi * t / 6)]
