"""Inverses of actuators: with the actuator behind them, or in front, they are the identity."""

import functools

import control as ct
import numpy as np
import pytest
from actuator_rig import along
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import each_row

import nlctl
from nlctl.diagrams import as_system
from nlctl.params import declared_params

positive = st.floats(0.1, 2).map(lambda v: round(v, 4))
inputs = st.floats(-3, 3).map(lambda v: round(v, 4))
paths = st.lists(inputs, min_size=2, max_size=8)


@functools.cache
def compiled(*kinds):
    """Return the machine code of actuators in series."""
    names = [f"stage{i}" for i in range(len(kinds))]
    return nlctl.compile(
        nlctl.actuators.cascade({n: kind() for n, kind in zip(names, kinds, strict=True)})
    )


def in_series(first, second, path):
    """Return the output at the turning points of an input that passes through both."""
    made = compiled(type(first), type(second))
    params, start = {}, {}
    for i, spec in enumerate((first, second)):
        params |= {f"stage{i}.{name}": getattr(spec, name) for name in declared_params(spec)}
        start |= {f"stage{i}.{k}": v for k, v in getattr(spec, "initial", {}).items()}
    times = np.arange(float(len(path)))
    return nlctl.input_output_response(made, times, path, start, params=params).outputs


@given(path=paths, m_r=positive, m_l=positive, b_r=positive, b_l=positive)
def test_a_dead_zone_behind_its_inverse_is_the_identity(path, m_r, m_l, b_r, b_l):
    """For constant slopes, at every input; 0 stays 0."""
    own = {"slope_r": m_r, "slope_l": m_l, "b_r": b_r, "b_l": -b_l}
    zone = nlctl.DeadZone(**own, ripple_r=0.0, ripple_l=0.0)
    path = [*path, 0.0, -path[0]]
    found = in_series(nlctl.actuators.DeadZoneInverse(**own), zone, path)
    np.testing.assert_allclose(found, path, atol=1e-13)
    assert found[-2] == 0.0


@st.composite
def operators(draw):
    """Operators with weights of both signs and memories that fit each other."""
    r = np.cumsum(draw(st.lists(positive, min_size=4, max_size=4)))
    m = np.array(draw(st.lists(positive, min_size=5, max_size=5)))  # slopes of the loading curve
    gaps = np.diff(np.append(0, r))
    shares = draw(st.lists(st.floats(-1, 1), min_size=4, max_size=4))
    v0 = draw(inputs) + np.cumsum(gaps * shares)
    return nlctl.actuators.PrandtlIshlinskii(w_0=m[0], w=np.diff(m), r=r, v0=tuple(v0))


def inverse_of(spec):
    return nlctl.actuators.PrandtlIshlinskiiInverse(w_0=spec.w_0, w=spec.w, r=spec.r, v0=spec.v0)


class TestPrandtlIshlinskii:
    """Kuhnen's inverse in closed form."""

    @pytest.mark.slow
    @given(spec=operators(), data=st.data())
    def test_operator_and_inverse_are_the_identity(self, spec, data):
        """In either order, from every admissible start: exact at every turning point."""
        z = np.array(spec.v0)
        # an input from which the memories do not move at the start
        u0 = z[0] + spec.r[0] * data.draw(st.floats(-1, 1))
        path = [u0, *data.draw(paths)]
        found = in_series(spec, inverse_of(spec), path)
        np.testing.assert_allclose(found, path, atol=1e-11 * (1 + max(map(abs, path))))
        first = along(spec, [u0, u0])[0]
        wanted = [first, *data.draw(paths)]
        found = in_series(inverse_of(spec), spec, wanted)
        np.testing.assert_allclose(found, wanted, atol=1e-11 * (1 + max(map(abs, wanted))))

    @given(spec=operators())
    @settings(max_examples=many(20, part=4))
    def test_the_inverse_is_an_operator_whose_inverse_is_the_first(self, spec):
        """Weights, thresholds and memories of the inverse's inverse."""
        one = inverse_of(spec)
        made = one.derived()
        memories = tuple(one.initial.values())
        two = nlctl.actuators.PrandtlIshlinskiiInverse(
            w_0=made["W_0"], w=made["W"], r=made["R"], v0=memories
        )
        again = two.derived()
        np.testing.assert_allclose(again["W_0"], spec.w_0, rtol=1e-12)
        np.testing.assert_allclose(again["W"], spec.w, atol=1e-11)
        np.testing.assert_allclose(again["R"], spec.r, rtol=1e-11)
        np.testing.assert_allclose(list(two.initial.values()), spec.v0, atol=1e-11)

    @given(spec=operators())
    @settings(max_examples=many(20, part=4))
    def test_loading_curves_mirror_each_other(self, spec):
        """From rest at 0: slope 1 / m between the images of the thresholds."""
        made = inverse_of(spec).derived()
        m = spec.w_0 + np.cumsum([0.0, *spec.w])
        knots = np.append(0, np.cumsum(m[:-1] * np.diff(np.append(0, spec.r))))
        np.testing.assert_allclose(made["R"], knots[1:], rtol=1e-12)
        slopes = made["W_0"] + np.cumsum(np.append(0, made["W"]))
        np.testing.assert_allclose(slopes * m, 1, rtol=1e-12)


@functools.cache
def backlash_behind_its_inverse():
    """Return machine code: two sines with their derivative, the inverse, a backlash."""

    def wave(t, x, u, params):
        a, b, w = params["a"], params["b"], params["w"]
        value = a * np.sin(t) + b * np.sin(w * t)
        return [value, a * np.cos(t) + b * w * np.cos(w * t)]

    source = ct.nlsys(
        None, wave, inputs=0, outputs=["u", "u1"], params={"a": 1.0, "b": 0.0, "w": 3.0},
        name="source",
    )  # fmt: skip
    inverse, gap = nlctl.actuators.BacklashInverse(), as_system(nlctl.Backlash(), "gap")
    gap.update_names(inputs=["v"], outputs=["y"])
    blocks = [source, nlctl.block(inverse, "inverse"), gap]
    return nlctl.compile(nlctl.interconnect(blocks, outputs=["u", "v", "y"], name="compensated"))


class TestBacklash:
    """Tao and Kokotovic's inverse, which jumps where its input reverses."""

    @given(a=positive, b=positive, m_r=positive, m_l=positive, c_l=st.floats(-1, 1), gap=positive)
    @settings(max_examples=many(20, part=4))
    def test_a_backlash_behind_its_inverse_is_the_identity(self, a, b, m_r, m_l, c_l, gap):
        """After the gap has been crossed, at every time; whether slopes are equal or not."""
        own = {"m_r": m_r, "m_l": m_l, "c_l": c_l, "c_r": c_l + gap}
        params = {f"{name}.{k}": v for name in ("inverse", "gap") for k, v in own.items()}
        times = np.linspace(0, 12, 121)
        run = nlctl.input_output_response(
            backlash_behind_its_inverse(), times, params=params | {"a": a, "b": b, "w": 2.3}
        )
        u, v, y = run.outputs
        turns = a * np.cos(times) + 2.3 * b * np.cos(2.3 * times)
        late = np.maximum.accumulate(turns < 0)  # it has come back once
        np.testing.assert_allclose(y[late], u[late], atol=1e-6 * (1 + a + b))
        upper, lower = (f(u / m_r + c_l + gap, u / m_l + c_l) for f in (np.maximum, np.minimum))
        sure = np.abs(turns) > 1e-3
        expected = np.where(turns > 0, upper, lower)
        np.testing.assert_allclose(v[sure], expected[sure], atol=1e-12)

    def test_at_rest_it_keeps_its_side(self):
        """u' = 0: as it was before."""
        block = nlctl.block(nlctl.actuators.BacklashInverse(), "b")
        for side, end in ((1.0, 0.5), (-1.0, -0.6)):
            assert block.output(0.0, [side], [1.2, 0.0])[0] == pytest.approx(1 + end)


@each_row(
    ("make", "told"),
    [
        (
            lambda: nlctl.actuators.BacklashInverse(c_l=0.5),
            "BacklashInverse needs c_l < c_r, got 0.5",
        ),
        (
            lambda: nlctl.actuators.BacklashInverse(v0=0.0),
            "BacklashInverse needs v0 of 1 and -1 only",
        ),
        (
            lambda: nlctl.actuators.DeadZoneInverse(b_l=0.3),
            "DeadZoneInverse needs b_l < 0, got 0.3",
        ),
        (
            lambda: nlctl.actuators.PrandtlIshlinskiiInverse(w=(-0.7, 0, 0, 0)),
            r"needs w_0 \+ w\[0\] \+ ... \+ w\[0\] > 0, so that the operator has an inverse",
        ),
        (
            lambda: nlctl.actuators.PrandtlIshlinskiiInverse(r=(0.2, 0.2, 0.3, 0.4)),
            "PrandtlIshlinskiiInverse needs increasing thresholds",
        ),
    ],
)
def test_what_has_no_inverse_is_refused(make, told):
    """With record, rule and value."""
    with pytest.raises(nlctl.errors.ParameterError, match=told):
        make()
