"""Where a run has no derivative: reported with place and time, or refused by name."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball, block, jumping_rate
from scipy.optimize import brentq

import nlctl


def nothing_from(made, t):
    """Whether there are derivatives before a time, and none from it on."""
    known = np.isfinite(made.derivatives).all(axis=(0, 1))
    return np.array_equal(known, made.time < t)


def test_two_conditions_at_one_instant():
    """x > p and y > q are met together: which is first decides."""
    plant = block(
        lambda t, x, u, p: [
            1.0, 1.0, np.where(x[0] > p["p"], np.where(x[1] > p["q"], 1.0, 0.0), 3.0),
        ], {"p": 0.5, "q": 0.5}, ("x", "y", "z"),
    )  # fmt: skip
    made = nlctl.sensitivity_response(plant, [0, 0.4, 1], of=["z"], with_respect_to=["plant.p"])
    (lack,) = made.missing
    assert abs(lack.time - 0.5) < 1e-9
    assert "comparison of 'plant'" in lack.where
    assert "one instant" in lack.why
    assert not made.success
    assert "0.5 s" in made.message
    assert nothing_from(made, 0.5)


def test_one_surface_that_is_written_twice():
    """x > p and 2 x > 2 p are one condition: -1 by p of 3 p + (t - p)."""
    plant = block(
        lambda t, x, u, p: [
            1.0, np.where(x[0] > p["p"], np.where(2 * x[0] > 2 * p["p"], 1.0, 0.0), 3.0)
        ], {"p": 0.5}, ("x", "z"),
    )  # fmt: skip
    made = nlctl.sensitivity_response(plant, [0, 1], of=["z"], with_respect_to=["plant.p"])
    assert made.success
    assert abs(made["z", "plant.p"][-1] - 2) < 1e-9


def test_grazing():
    """A wave that turns at a threshold comes back without end, or not at all, if that is moved."""
    plant = block(
        lambda t, x, u, p: [-2 * (t - 1) ** 3 * 2, np.where(x[0] > p["p"], 1.0, 0.0)],
        {"p": 0.0}, ("x", "z"),
    )  # fmt: skip
    made = nlctl.sensitivity_response(  # x = 1e-10 - (t - 1)^4
        plant, [0, 0.5, 2], 0, [1e-10 - 1.0, 0.0], of=["z"], with_respect_to=["plant.p"]
    )
    (lack,) = made.missing
    assert abs(lack.time - 1) < 1e-2
    assert "comparison of 'plant'" in lack.where
    assert "rate of 0" in lack.why
    assert nothing_from(made, lack.time)


@pytest.mark.parametrize("beyond", [0.0, 1e-12, -1e-12, 1e-9])
def test_touching(beyond):
    """sin t touches 1 at pi / 2, and z' = (x > p) is 0 or more behind, by the least change of p."""
    plant = block(
        lambda t, x, u, p: [x[1], -x[0], np.where(x[0] > p["p"], 1.0, 0.0)], {"p": 1 + beyond},
        ("x", "y", "z"),
    )  # fmt: skip
    made = nlctl.sensitivity_response(
        plant, [0, 1, 2], 0, [0.0, 1.0, 0.0], of=["z"], with_respect_to=["plant.p"]
    )
    (lack,) = made.missing
    assert abs(lack.time - np.pi / 2) < 1e-4
    assert "grazing" in lack.why
    assert nothing_from(made, lack.time)


def test_nearly_touching():
    """1e-3 away it does not, and a kink that is touched has a derivative."""
    for law in (
        lambda t, x, u, p: [x[1], -x[0], np.where(x[0] > 1.001 + p["p"], 1.0, 0.0)],
        lambda t, x, u, p: [x[1], -x[0], np.where(x[0] > 1 + p["p"], x[0] - 1 - p["p"], 0.0)],
    ):
        made = nlctl.sensitivity_response(
            block(law, {"p": 0.0}, ("x", "y", "z")), [0, 1, 2], 0, [0.0, 1.0, 0.0], of=["z"],
            with_respect_to=["plant.p"],
        )  # fmt: skip
        assert made.success
        assert np.allclose(made["z", "plant.p"], 0, atol=1e-6)


def test_start_on_a_condition():
    """At p = x(0) the run is on one side or the other."""
    made = nlctl.sensitivity_response(
        block(lambda t, x, u, p: [np.where(x[0] > p["p"], 1.0, 2.0)], {"p": 0.0}),
        [0, 1, 2], with_respect_to=["plant.p"],
    )  # fmt: skip
    (lack,) = made.missing
    assert lack.time == 0.0
    assert "starts on a condition" in lack.why
    assert np.array_equal(np.isnan(made["x", "plant.p"]), [False, True, True])


def test_start_on_one_of_many_conditions():
    """Of five thresholds the run starts on one: by the others there are derivatives."""
    plant = block(
        lambda t, x, u, p: [sum(np.where(x[0] >= p["p"][i], 2.0**i, 0.0) for i in range(3)) + 1],
        {"p": np.array([-1.0, 0.0, 1.0])},
    )  # fmt: skip
    made = nlctl.sensitivity_response(
        plant, [0, 1], with_respect_to=["plant.p[0]", "plant.p[1]", "plant.p[2]"]
    )
    (lack,) = made.missing
    assert lack.with_respect_to == ("plant.p[1]",)
    assert np.isnan(made["x", "plant.p[1]"][-1])
    # x' = 4 until x = 1 at t = 1/4, then 8: x = 1 + 8 (t - p / 4), and 4 for 8 as long as x < p
    assert abs(made["x", "plant.p[2]"][-1] - (1 - 8 / 4)) < 1e-9
    assert made["x", "plant.p[0]"][-1] == 0.0


@pytest.mark.parted
@pytest.mark.parametrize(
    ("law", "start"),
    [
        (lambda t, x, u, p: [-abs(x[0]) + p["p"]], 0.0),
        (lambda t, x, u, p: [max(x[0] + p["p"], 0.0)], 0.0),
        (lambda t, x, u, p: [1 - np.clip(x[0] - p["p"], -1, 1)], 1.0),
        (lambda t, x, u, p: [np.where(x[0] > p["p"], p["p"] - x[0], 0.0)], 0.0),
    ],
    ids=["abs", "max", "clip", "where"],
)
@pytest.mark.parametrize("by", ["plant.x(0)", "plant.p"])
def test_at_rest_on_a_kink(law, start, by):
    """A loop that rests there goes one way or the other, as -x and x: no derivative, from 0 on."""
    made = nlctl.sensitivity_response(
        block(law, {"p": 0.0}), np.linspace(0, 2, 5), 0, [start], with_respect_to=by
    )
    (lack,) = made.missing
    assert (lack.time, lack.with_respect_to) == (0.0, (by,))
    assert "kink" in lack.why
    assert np.array_equal(np.isnan(made["x", by]), made.time > 0)


def test_through_a_kink():
    """x' = 1 + |x| passes 0: exp(t) by x(0), although the run starts there."""
    t = np.linspace(0, 2, 5)
    plant = block(lambda t, x, u, p: [1 + abs(x[0])], {"p": 0.0})
    made = nlctl.sensitivity_response(plant, t, with_respect_to="plant.x(0)")
    assert made.success
    assert np.allclose(made["x", "plant.x(0)"], np.exp(t), rtol=1e-7)


@pytest.mark.parametrize(
    ("law", "block_of_memory"),
    [
        (lambda t, x, u, p: [max(-4 * u[0], p["least"])], False),
        (lambda t, x, u, p: [1.0 if u[0] > -p["least"] / 4 else 0.0], False),
        (lambda t, x, u, p: [-p["least"] - 3 * u[0]], True),
    ],
    ids=["kink", "jump", "edge of a gap"],
)
def test_first_sample_at_a_kink(law, block_of_memory):
    """What is sampled at t = 0, with x(0) = 1 / 4, is at its limit; or at the edge of a gap."""
    sampled = nlctl.sampled(
        ct.nlsys(None, law, inputs=["x"], outputs=["u"], params={"least": -1.0}, dt=0.1, name="law")
    )
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0]], lambda t, x, u, p: x, inputs=["v"], outputs=["x"],
        states=["x"], name="plant",
    )  # fmt: skip
    gap = (
        nlctl.Backlash(m_r=1.0, m_l=1.0, c_r=0.25, c_l=-0.25)
        if block_of_memory
        else nlctl.Gain(k=1.0)
    )
    loop = nlctl.interconnect({"law": sampled, "gap": gap, "plant": plant}, outputs=["x"])
    for by in ("plant.x(0)", "law.least"):
        made = nlctl.sensitivity_response(loop, [0, 0.5], 0, {"plant.x": 0.25}, with_respect_to=by)
        (lack,) = made.missing
        assert (lack.time, lack.with_respect_to) == (0.0, (by,))
        assert ("driven at the start" if block_of_memory else "sampled is right at") in lack.why
        assert np.isnan(made["x", by][-1])


def test_bounces_without_end():
    """Bounces accumulate at t_1 (1 + e) / (1 - e): NaN behind, for the signals as well."""
    made = nlctl.sensitivity_response(
        nlctl.block(Ball(), "ball"), [0, 2, 4, 6], of=["h"], with_respect_to=["ball.e"]
    )
    (lack,) = made.missing
    assert abs(lack.time - np.sqrt(2 / 9.81) * 1.8 / 0.2) < 1e-3
    assert "without end" in lack.why
    assert "guard of 'ball'" in lack.where
    assert np.array_equal(made.time, [0, 2, 4, 6])
    assert nothing_from(made, lack.time)
    assert np.isnan(made.values[0, -1])


def test_two_balls_at_once():
    """Two blocks jump at one instant: nobody says which is first."""
    balls = ct.interconnect(
        [nlctl.block(Ball(), "a"), nlctl.block(Ball(), "b")], connections=False, inputs=[],
        outlist=["a.h", "b.h"], outputs=["one", "other"],
    )  # fmt: skip
    by = ["a.e", "b.h(0)"]
    (lack,) = nlctl.sensitivity_response(balls, [0, 1], with_respect_to=by).missing
    assert abs(lack.time - np.sqrt(2 / 9.81)) < 1e-6
    assert "guard of 'a', guard of 'b'" in lack.where
    apart = nlctl.sensitivity_response(balls, [0, 0.6], 0, {"b.h": 1.1}, with_respect_to=by)
    alone = nlctl.sensitivity_response(
        nlctl.block(Ball(), "ball"), [0, 0.6], of=["h"], with_respect_to=["ball.e"]
    )
    assert apart.success
    assert np.allclose(apart["one", "a.e"], alone["h", "ball.e"], rtol=0, atol=1e-7)
    assert np.array_equal(apart["other", "a.e"], [0, 0])


def delayed(update, output=lambda t, x, u, p: x, varying=None):
    wire = nlctl.block(
        nlctl.TransportDelay(inputs=("x",), outputs=("y",), delay=0.3, varying=varying), "wire"
    )
    plant = ct.nlsys(
        update, output, inputs=["y"], outputs=["x", "z"], states=["x", "z"], params={"p": 0.5},
        name="plant",
    )  # fmt: skip
    return nlctl.interconnect({"wire": wire, "plant": plant}, outputs=["z"])


def test_jump_that_comes_back_through_a_delay_that_varies():
    """A signal jumps at t = p, and where it leaves its delay, at t - 0.3 - 0.1 sin(t) = p."""
    loop = delayed(
        lambda t, x, u, p: [1.0, u[0]],
        lambda t, x, u, p: [np.where(x[0] > p["p"], 1.0, 0.0), x[1]],
        lambda t: 0.1 * np.sin(t),
    )
    made = nlctl.sensitivity_response(loop, [0, 0.6, 0.7, 0.9], with_respect_to=["plant.p"])
    (lack,) = made.missing
    assert lack.time < 0.9
    assert "delay" in lack.why
    assert np.isnan(made["z", "plant.p"][-1])


def test_condition_on_a_signal_whose_delay_varies():
    """Its rate is not kept: refused."""
    loop = delayed(
        lambda t, x, u, p: [np.where(u[0] > 0.5, 1.0, 2.0), 0.0], varying=lambda t: 0.1 * np.sin(t)
    )
    with pytest.raises(nlctl.errors.CompileError, match="a signal whose delay varies"):
        nlctl.sensitivity_response(loop, [0, 1], with_respect_to=["plant.x(0)"])


def test_what_is_refused():
    """Delays that vary, clocks, discrete time, and names."""
    loop = delayed(lambda t, x, u, p: [-u[0], 0.0], varying=lambda t: 0.1 * np.sin(t))
    with pytest.raises(nlctl.errors.CompileError, match=r"'wire.delay' .* a delay that varies"):
        nlctl.sensitivity_response(loop, [0, 1], with_respect_to=["wire.delay"])
    law = ct.nlsys(None, lambda t, x, u, p: [-u[0]], inputs=["y"], outputs=["u"], name="law")
    plant = ct.ss(-1, 1, 1, 0, inputs="u", outputs="y", name="plant")
    sampled = nlctl.interconnect({"plant": plant, "law": nlctl.sampled(law, 0.1)}, outputs=["y"])
    with pytest.raises(nlctl.errors.CompileError, match="says when samples are taken"):
        nlctl.sensitivity_response(sampled, [0, 1], with_respect_to=["law.sampling.dt"])
    discrete = ct.nlsys(
        lambda t, x, u, p: [0.5 * x[0]], lambda t, x, u, p: x, states=1, inputs=0, outputs=1,
        dt=0.1, name="d",
    )  # fmt: skip
    with pytest.raises(nlctl.errors.CompileError, match="discrete time"):
        nlctl.sensitivity_response(discrete, [0, 0.1], with_respect_to=["d.x[0](0)"])


@pytest.mark.parametrize(
    ("of", "by", "error", "match"),
    [
        (["x"], ["plant.q"], "UnknownNameError", "plant.p"),
        (["x"], ["plant.x"], "UnknownNameError", r"plant.x\(0\)"),
        (["z"], ["plant.p"], "UnknownNameError", "unknown signal 'z'"),
        (["x"], [], "ParameterError", "at least one name"),
        (["x"], ["plant.p", "plant.p"], "ParameterError", "twice"),
        (["x"], 3, "ParameterError", "list of names"),
    ],
)
def test_names(of, by, error, match):
    """A name that means nothing is refused with the nearest ones."""
    with pytest.raises(getattr(nlctl.errors, error), match=match):
        nlctl.sensitivity_response(jumping_rate(), [0, 1], of=of, with_respect_to=by)


def test_a_gain_that_is_written_as_2_is_2_point_0():
    """x' = -a x with a = 2: the derivative by a, and what its function says of it at a point."""
    plant = block(lambda t, x, u, p: [-p["a"] * x[0]], {"a": 2})
    made = nlctl.sensitivity_response(
        plant, [0, 1], initial_state=[1.0], with_respect_to=["plant.a", "plant.x(0)"]
    )
    assert made["x", "plant.a"][-1] == pytest.approx(-np.exp(-2), abs=1e-8)
    assert made["x", "plant.x(0)"][-1] == pytest.approx(np.exp(-2), abs=1e-8)
    assert nlctl.compile(plant).parameter_jacobian(["plant.a"], [3.0])[0] == [[-3.0]]


def rounded_off(t, x, u, p):
    kept = np.array([p["a"], 0])
    kept[1] = 1.5 * x[0]  # an integer for an integer a
    return [-kept[1]]


@pytest.mark.parametrize(
    ("plant", "error", "match"),
    [
        (block(lambda t, x, u, p: [-sum(x[0] ** k for k in range(p["a"]))], {"a": 2}),
         "ParameterError", "'plant.a' in 'plant' cannot lie between two integers"),
        (block(rounded_off, {"a": 2}), "AuditError", "python-control differ"),
        (block(lambda t, x, u, p: [-x[0] if p["a"] else 0.0], {"a": True}),
         "ParameterError", "'plant.a' is True or False"),
    ],
)  # fmt: skip
def test_an_integer_is_no_float(plant, error, match):
    """A number of passes, one that makes other numbers integers, and a choice."""
    with pytest.raises(getattr(nlctl.errors, error), match=match):
        nlctl.sensitivity_response(plant, [0, 1], initial_state=[1.3], with_respect_to=["plant.a"])


ROUNDED = [  # where it does not jump, and where it does
    (np.round, (-1.0, 0.0, 1.0), (-0.5, 0.5, 2.5)),
    (np.floor, (-0.5, 0.5), (-1.0, 0.0, 2.0)),
    (np.ceil, (-0.5, 0.5), (-1.0, 0.0, 2.0)),
    (np.trunc, (-0.5, 0.0, 0.5), (-2.0, -1.0, 1.0, 3.0)),
    (lambda z: z % 1.0, (-0.5, 0.5), (-1.0, 0.0, 2.0)),
    (lambda z: np.fmod(z, 1.0), (-0.5, 0.0, 0.5), (-2.0, 1.0)),
]


@pytest.mark.parted
@pytest.mark.parametrize(("rounded", "inside", "jumps"), ROUNDED)
def test_start_where_a_number_is_rounded(rounded, inside, jumps):
    """A run starts on a condition where a rounding jumps, and nowhere else."""
    plant = block(lambda t, x, u, p: [p["k"], rounded(x[0])], {"k": 0.1}, ("x", "z"))
    for start in (*inside, *jumps):
        made = nlctl.sensitivity_response(
            plant, [0, 1], initial_state=[start, 0.0], of=["z"], with_respect_to=["plant.x(0)"]
        )
        assert bool(made.missing) == (start in jumps), start


@pytest.mark.parted
@pytest.mark.parametrize(("rounded", "inside", "jumps"), ROUNDED)
def test_touching_where_a_number_is_rounded(rounded, inside, jumps):
    """x = level + sin t - 1 touches the level at pi / 2: that says nothing where nothing jumps."""
    plant = block(lambda t, x, u, p: [np.cos(t), rounded(x[0] + p["p"])], {"p": 0.0}, ("x", "z"))
    for level in (*inside, *jumps):
        made = nlctl.sensitivity_response(
            plant, [0, 1, 2], 0, [level - 1, 0.0], of=["z"], with_respect_to=["plant.p"]
        )
        grazed = [lack for lack in made.missing if lack.time > 0.1]
        assert bool(grazed) == (level in jumps), level
        for lack in grazed:
            assert abs(lack.time - np.pi / 2) < 1e-4
            assert "grazing" in lack.why


def test_names_of_a_response():
    """Labels of a response are looked up; a table has a column for each derivative."""
    made = nlctl.sensitivity_response(jumping_rate(), [0, 1], with_respect_to="plant.p")
    with pytest.raises(nlctl.errors.UnknownNameError, match="unknown signal"):
        made["y", "plant.p"]
    with pytest.raises(nlctl.errors.UnknownNameError, match="unknown quantity"):
        made["x", "p"]
    table = made.to_pandas()
    assert list(table.columns) == ["time", "x", "d(x)/d(plant.p)"]
    assert np.array_equal(table["d(x)/d(plant.p)"], made["x", "plant.p"])
    assert "with respect to  plant.p" in repr(made)


def test_diverged_run():
    """x' = x^2 from 1 has no state at t = 1: the error of the run itself."""
    plant = block(lambda t, x, u, p: [p["a"] * x[0] ** 2], {"a": 1.0})
    with pytest.raises(nlctl.errors.DivergedError, match="t = 1 s"):
        nlctl.sensitivity_response(plant, [0, 2], 0, [1.0], with_respect_to=["plant.a"])


def test_opaque_function():
    """A function that is called as it stands has differences, and a warning that says so."""
    from scipy.integrate import quad_vec

    def update(t, x, u, p):
        return [-p["a"] * x[0] + quad_vec(lambda s: np.cos(s * x[0]), 0, 1)[0]]

    plant = ct.nlsys(
        update, lambda t, x, u, p: x, inputs=0, outputs=["x"], states=["x"], params={"a": 1.0},
        name="plant",
    )  # fmt: skip
    with pytest.warns(nlctl.errors.InexactWarning, match="called unchanged"):
        made = nlctl.sensitivity_response(plant, [0, 1], with_respect_to=["plant.a", "plant.x(0)"])
    known = block(lambda t, x, u, p: [-p["a"] * x[0] + np.sin(x[0]) / x[0]], {"a": 1.0})
    exact = nlctl.sensitivity_response(
        known, [0, 1], 0, [1e-8], with_respect_to=["plant.a", "plant.x(0)"]
    )
    assert np.allclose(made.derivatives, exact.derivatives, rtol=0, atol=1e-6)


def through_a_root(t, x, u, params):
    return [params["a"] + np.sqrt(np.abs(x[0]))]


@pytest.mark.parametrize("rtol", [1e-7, 1e-9, 1e-11])
def test_rates_without_a_bound_have_derivatives(rtol):
    """x' = a + sqrt|x| from -1: t = 2 (r - a log(1 + r / a)) below 0, with r = sqrt|x|, and above.

    The slope of the rate has no bound at 0.
    """
    plant = ct.nlsys(through_a_root, None, states=1, inputs=0, outputs=1, name="plant",
                     params={"a": 1.0})  # fmt: skip
    run = nlctl.sensitivity_response(
        plant, [0, 0.5, 2.0], 0, -1.0, with_respect_to=["a"], rtol=rtol, atol=rtol
    )
    _, before, after = run.derivatives[0, 0]

    def reached(a, t):
        def passed(x):
            def from_zero(r):
                return 2 * (r - a * np.log1p(r / a))

            begin = from_zero(1.0)
            r = np.sqrt(abs(x))
            return begin - from_zero(r) if x < 0 else begin + from_zero(r)

        return brentq(lambda x: passed(x) - t, -1.0, 5.0, xtol=1e-14)

    slopes = [(reached(1 + 1e-5, t) - reached(1 - 1e-5, t)) / 2e-5 for t in (0.5, 2.0)]
    assert before == pytest.approx(slopes[0], rel=1e-5)
    assert after == pytest.approx(slopes[1], rel=3e-6)
    assert not run.missing
