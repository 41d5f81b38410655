"""Parameters from tables of pandas, and from several experiments at once."""

import control as ct
import numpy as np
import pandas as pd
import pytest
from closed_form_runs import block
from scipy.stats import t as students_t

import nlctl
from nlctl import Measurement

T = np.linspace(0, 2, 21)


def lag():
    return nlctl.block(nlctl.Lag(T=1.0), "lag")


def step_of(height, T_lag=0.4, t=T):
    return height * (1 - np.exp(-t / T_lag))


def drift():
    """x' = a + b t."""
    return block(lambda t, x, u, p: [p["a"] + p["b"] * t], {"a": 0.5, "b": 0.5})


def fisher(found):
    """Return the Fisher matrix of a fit, in units of its noise."""
    return found.noise**2 * np.linalg.inv(found.covariance)


@pytest.mark.parametrize(
    "table",
    [
        pd.DataFrame({"v": step_of(1.0)}, index=T),
        pd.DataFrame({"time": T, "v": step_of(1.0)}),
        pd.DataFrame({"v": step_of(1.0)}, index=pd.to_timedelta(T, unit="s")),
        pd.DataFrame({"v": step_of(1.0)}, index=pd.Timestamp(2026, 1, 1) + pd.to_timedelta(T, "s")),
    ],
    ids=["index", "column", "differences", "stamps"],
)
def test_times_of_a_table(table):
    """A lag of 0.4 s, whatever says when its step was measured."""
    found = nlctl.fit(lag(), data=table, parameters={"lag.T": 1.0}, inputs=1.0)
    assert abs(found["lag.T"] - 0.4) < 1e-8
    assert np.allclose(found.response.time, T, atol=1e-9)


def test_inputs_and_gaps_of_a_table():
    """A ramp in the column of the input, and outputs with gaps: T (exp(-t / T) - 1) + t."""
    v = T + 0.4 * np.expm1(-T / 0.4)
    v[5:9] = np.nan
    table = pd.DataFrame({"u": T, "v": v, "time": T})
    found = nlctl.fit(lag(), data=table, parameters={"lag.T": 1.0})
    assert abs(found["lag.T"] - 0.4) < 1e-8
    assert np.isnan(found.residuals["v"][5:9]).all()
    same = nlctl.fit(lag(), T, {"v": v}, {"lag.T": 1.0}, T)
    assert np.array_equal(found.values, same.values)
    assert np.array_equal(found.covariance, same.covariance)


def test_one_experiment_in_a_list():
    """It is what it is alone."""
    data = {"v": step_of(1.0) + 0.01 * np.cos(9 * T)}
    alone = nlctl.fit(lag(), T, data, {"lag.T": 1.0}, 1.0)
    listed = nlctl.fit(lag(), T, [data], {"lag.T": 1.0}, 1.0)
    assert np.array_equal(alone.values, listed.values)
    assert np.array_equal(alone.covariance, listed.covariance)
    assert repr(alone) == repr(listed)


def test_each_experiment_has_its_own():
    """Steps of a lag from other initial states, of other heights, at other times; one lag."""
    finer = np.linspace(0, 1, 31)
    decays = 0.7 * np.exp(-finer / 0.4)
    steps = [
        Measurement(data={"v": step_of(2.0)}, timepts=T, inputs=2.0),
        Measurement(data={"v": decays}, timepts=finer, initial_state={"lag.v": 0.7}),
        pd.DataFrame({"v": step_of(3.0), "u": 3.0 + 0 * T}, index=T),
        Measurement(data={"v": step_of(1.0, 0.2)}, timepts=T, inputs=1.0, params={"lag.k": 1.0}),
    ]
    found = nlctl.fit(lag(), data=steps[:3], parameters={"lag.T": 1.0})
    assert abs(found["lag.T"] - 0.4) < 1e-8
    assert [one.name for one in found.experiments] == [f"experiment {k}" for k in (1, 2, 3)]
    assert found.experiments[1].response.time.size == 31
    assert all(np.abs(one.residuals["v"]).max() < 1e-6 for one in found.experiments)
    assert "1 parameter to 3 experiments" in repr(found)


def test_fisher_matrices_add_up():
    """Of x' = a - b x in two experiments, at the values that fit both."""
    plant = nlctl.compile(
        block(lambda t, x, u, p: [p["a"] - p["b"] * x[0]], {"a": 1.0, "b": 1.0})
    )  # fmt: skip
    rng = np.random.default_rng(8)
    both = [
        Measurement(
            data={"x": 0.7 + (x0 - 0.7) * np.exp(-1.3 * t) + 0.02 * rng.normal(size=t.size)},
            timepts=t, initial_state={"plant.x": x0}, sigma=sigma,
        )
        for x0, t, sigma in ((0.0, T, 1.0), (3.0, 0.5 * T[1:], 0.5))
    ]  # fmt: skip
    together = nlctl.fit(plant, data=both, parameters={"plant.a": 1.0, "plant.b": 1.0})
    values = dict(zip(together.names, together.values, strict=True))
    alone = [nlctl.fit(plant, data=one, parameters=values, max_evaluations=1) for one in both]
    assert np.allclose(fisher(together), sum(map(fisher, alone)), rtol=1e-9)
    squares = [one.noise**2 * one.freedom for one in alone]
    assert np.isclose(together.noise**2 * together.freedom, sum(squares), rtol=1e-9)
    assert together.freedom == sum(one.freedom + 2 for one in alone) - 2


def lines(rng):
    """Return three noisy lines of one slope from three heights, at different times."""
    times = [np.linspace(0, 1, 8), np.linspace(0, 2, 12), np.array([0.0, 0.3, 1.0, 3.0])]
    return [
        Measurement(
            data={"x": height + 1.5 * t + 0.1 * rng.normal(size=t.size)}, timepts=t, name=name
        )
        for t, height, name in zip(times, (0.0, -1.0, 2.0), ("low", "mid", "high"), strict=True)
    ]


SLOPE_AND_HEIGHTS = {"parameters": {"plant.a": 1.0, "plant.x(0)": 0.0}, "separate": ["plant.x(0)"]}


def rise():
    return nlctl.compile(block(lambda t, x, u, p: [p["a"]], {"a": 1.0}))


def pooled(measured):
    """Return slope, heights and their 95 % half widths, of the analysis of covariance."""
    t, y = ([f(m) for m in measured] for f in (lambda m: m.timepts, lambda m: m.data["x"]))
    spread = sum(((a - a.mean()) ** 2).sum() for a in t)
    slope = sum(((a - a.mean()) * b).sum() for a, b in zip(t, y, strict=True)) / spread
    heights = [b.mean() - slope * a.mean() for a, b in zip(t, y, strict=True)]
    rows = zip(t, y, heights, strict=True)
    squares = sum(((b - h - slope * a) ** 2).sum() for a, b, h in rows)
    freedom = sum(map(len, t)) - 4
    errors = [1 / spread, *(1 / a.size + a.mean() ** 2 / spread for a in t)]
    width = students_t.ppf(0.975, freedom) * np.sqrt(squares / freedom * np.array(errors))
    return np.array([slope, *heights]), width


def test_lines_of_one_slope():
    """Slope, heights and intervals are those in closed form, which cover in exactly 95 %."""
    measured = lines(np.random.default_rng(3))
    found = nlctl.fit(rise(), data=measured, **SLOPE_AND_HEIGHTS)
    names = [f"plant.x(0) in {name}" for name in ("low", "mid", "high")]
    assert list(found.names) == ["plant.a", *names]
    values, width = pooled(measured)
    assert np.allclose(found.values, values, rtol=1e-7, atol=1e-9)
    assert np.allclose(found.intervals(), np.stack([values - width, values + width], 1), atol=1e-7)


@pytest.mark.weekly
def test_intervals_of_several_cover():
    """Of 200 fits 95 % intervals of slope and heights hold the truth in 178 to 200 (3.9 sigma)."""
    rng, plant, inside = np.random.default_rng(7), rise(), np.zeros(4, dtype=int)
    for _ in range(200):
        low, high = nlctl.fit(plant, data=lines(rng), **SLOPE_AND_HEIGHTS).intervals().T
        inside += (low <= [1.5, 0, -1, 2]) & (high >= [1.5, 0, -1, 2])
    assert np.all(inside >= 178), inside


def test_what_one_experiment_alone_does_not_tell():
    """Of a u - b one step has the difference alone; with a second one, of another height, both."""
    plant = ct.nlsys(
        lambda t, x, u, p: [p["a"] * u[0] - p["b"]], lambda t, x, u, p: x, inputs=["u"],
        outputs=["x"], states=["x"], params={"a": 1.0, "b": 1.0}, name="plant",
    )  # fmt: skip
    parameters = {"plant.a": 1.5, "plant.b": 0.5}
    one, other = (
        Measurement(data={"x": (2 * u - 0.7) * T + 1e-3 * np.cos(30 * T)}, timepts=T, inputs=u)
        for u in (1.0, 3.0)
    )
    assert nlctl.fit(plant, data=one, parameters=parameters).unidentifiable == tuple(parameters)
    found = nlctl.fit(plant, data=[one, other], parameters=parameters)
    assert found.unidentifiable == ()
    assert np.allclose(found.values, [2, 0.7], atol=1e-3)


def test_a_backlash_from_two_experiments():
    """Each turns in one direction alone, and tells one end of the gap; both tell both ends."""
    plant = nlctl.interconnect(
        {"gap": nlctl.Backlash(m_r=1.0, m_l=1.0), "lag": nlctl.Lag(T=0.5)},
        connections=[["lag.u", "gap.v"]], inplist=["gap.u"], inputs=["drive"],
        outlist=["lag.v"], outputs=["y"],
    )  # fmt: skip
    compiled, t = nlctl.compile(plant), np.linspace(0, 3, 61)
    truth = {"gap.c_r": 0.4, "gap.c_l": -0.3}
    runs = [
        Measurement(
            timepts=t, inputs=u,
            data={"y": nlctl.input_output_response(compiled, t, u, params=truth).outputs},
        )
        for u in (t, -t)
    ]  # fmt: skip
    start = {"gap.c_r": 0.6, "gap.c_l": -0.6}
    assert nlctl.fit(compiled, data=runs[0], parameters=start).unidentifiable == ("gap.c_l",)
    assert nlctl.fit(compiled, data=runs[1], parameters=start).unidentifiable == ("gap.c_r",)
    found = nlctl.fit(compiled, data=runs, parameters=start)
    assert found.unidentifiable == ()
    assert np.allclose(found.values, [0.4, -0.3], atol=1e-6)


STEP = {"v": step_of(1.0)}


@pytest.mark.parametrize(
    ("data", "more", "match"),
    [
        ([STEP, {"v": T[1:]}], {}, r"need shape .* \(in 'experiment 2'\)"),
        ([STEP, Measurement(data={"w": T}, name="late")], {}, r"signal 'w'.*\(in 'late'\)"),
        ([STEP, Measurement(data=STEP, inputs=T[1:])], {}, r"inputs .*\(in 'experiment 2'\)"),
        ([STEP, Measurement(data=STEP, sigma=-1.0)], {}, r"sigma of 'v'.*\(in 'experiment 2'\)"),
        ([STEP, Measurement(data=STEP, params={"lag.T": -1.0})], {}, "'lag.T' is sought"),
        ([Measurement(data=STEP, name="one")] * 2, {}, "two experiments have the name 'one'"),
        ([], {}, "at least one experiment"),
        ([STEP, 3.0], {}, "pandas.DataFrame, nlctl.Measurement or a list of these, got float"),
        (STEP, {"timepts": None}, "data need times"),
        (STEP, {"timepts": pd.DataFrame(STEP)}, "timepts are data"),
        (pd.DataFrame(STEP), {"timepts": None}, "only counts the rows, 0 to 21"),
        (pd.DataFrame(STEP | {"time": T}), {}, "times are given twice"),
        (pd.DataFrame(STEP | {"u": T}), {"inputs": 1.0}, "input 'u' is given twice"),
        (pd.DataFrame(np.stack([T, T], 1), columns=["v", "v"]), {}, "two columns 'v'"),
        (STEP, {"separate": ["lag.k"]}, "'lag.k'"),
        (STEP, {"separate": "lag.T"}, "list of names"),
    ],
)
def test_bad_experiments(data, more, match):
    """One sentence each, with the experiment."""
    with pytest.raises((nlctl.errors.ParameterError, nlctl.errors.UnknownNameError), match=match):
        nlctl.fit(lag(), **{"timepts": T, "data": data, "parameters": {"lag.T": 1.0}} | more)


def test_an_experiment_that_ends_before():
    """x' = x^2 from 1 is infinite at t = 1: the error names the experiment."""
    plant = block(lambda t, x, u, p: [p["a"] * x[0] ** 2], {"a": 1.0})
    starts = (0.1, 1.0)
    data = [Measurement(data={"x": T}, initial_state={"plant.x": x}) for x in starts]
    with pytest.raises(nlctl.errors.DivergedError, match=r"\(in 'experiment 2'\)") as raised:
        nlctl.fit(plant, T, data, {"plant.a": 1.0})
    assert 0.9 < raised.value.time < 1.1


def test_a_name_that_may_be_input_or_output():
    """A diagram with an output of the name of its input: the column needs a word more."""
    system = ct.nlsys(
        lambda t, x, u, p: [u[0] - p["a"] * x[0]], lambda t, x, u, p: [x[0], u[0]], inputs=["u"],
        outputs=["x", "u"], states=["x"], params={"a": 1.0}, name="plant",
    )  # fmt: skip
    table = pd.DataFrame({"x": (1 - np.exp(-2 * T)) / 2, "u": 1.0 + 0 * T}, index=T)
    with pytest.raises(nlctl.errors.ParameterError, match="the input or the output"):
        nlctl.fit(system, data=table, parameters={"plant.a": 1.0})
    found = nlctl.fit(system, data=table, parameters={"plant.a": 1.0}, inputs=1.0)
    assert abs(found["plant.a"] - 2) < 1e-7
