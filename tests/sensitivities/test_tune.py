"""Gains by search: optima in closed form, several samples, a cost, and what cannot be tuned."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import block
from scipy.special import lambertw

import nlctl
from nlctl.analysis.metrics import Metric, final
from nlctl.analysis.robustness import Requirement, Space, Spec, Uncertain, always, in_band

BEST = float(lambertw(8.0).real)  # a exp(a) = 8


def decay():
    """x' = -a x, with the output y = a; b does nothing."""
    return ct.nlsys(
        lambda t, x, u, p: [-p["a"] * x[0] + 0 * p["b"]],
        lambda t, x, u, p: [x[0], p["a"] + 0 * x[0]], inputs=0, outputs=["x", "y"], states=["x"],
        params={"a": 0.5, "b": 2.0}, name="plant",
    )  # fmt: skip


def small():
    """1 - 2 exp(-a): |x| <= 1/2 at 1 s."""
    formula = always(in_band("x", lower=-0.5, upper=0.5), start=1.0)
    return Requirement(key="small", formula=formula, until=1.0)


def slow():
    """1 - a / 4: y <= 4."""
    return Requirement(key="slow", formula=always(in_band("y", upper=4.0)), until=1.0)


def tuned(space, spec, **more):
    return nlctl.tune(decay(), space, spec, initial_state={"plant.x": 1.0}, **more)


def test_where_two_margins_meet():
    """1 - 2 exp(-a) = 1 - a / 4 at a = W(8): the least margin is the largest there."""
    found = tuned({"plant.a": (0.1, 10.0)}, [small(), slow()])
    assert abs(found["plant.a"] - BEST) < 2e-3 * BEST
    assert abs(found.margin - (1 - BEST / 4)) < 1e-3
    assert abs(found.before["small"] - (1 - 2 * np.exp(-0.5))) < 1e-5
    assert found.notes == ()
    history = found.history
    assert history["margin"].max() <= found.margin + 1e-6
    assert np.all(np.diff(history["runs"]) >= 0)


def test_short_names():
    """X0 = [1] is {"plant.x": 1.0}; T and U are times and inputs."""
    space, t = {"plant.a": (0.1, 10.0)}, np.linspace(0, 1, 501)
    short = nlctl.tune(decay(), space, [small(), slow()], T=t, U=0.0, X0=[1.0], starts=1)
    long = tuned(space, [small(), slow()], timepts=t, starts=1)
    assert short["plant.a"] == long["plant.a"]
    with pytest.raises(nlctl.errors.UnknownKeywordError, match="'u' of tune"):
        nlctl.tune(decay(), space, [small()], u=0.0)


def test_the_worst_of_several_samples_counts():
    """From x = 1, 2 and 3: 6 exp(-a) = a / 4, also with a space and a spec of studies."""
    best = float(lambertw(24.0).real)
    space = Space(quantities=(Uncertain(name="plant.a", bounds=(0.1, 10.0), nominal=0.5),))
    found = tuned(
        space, Spec(requirements=(small(), slow())), samples={"plant.x(0)": [1.0, 2.0, 3.0]}
    )
    assert abs(found["plant.a"] - best) < 2e-3 * best
    assert abs(found.margin - (1 - best / 4)) < 1e-3


@pytest.mark.parametrize(("band", "expected"), [(4.0, np.log(5)), (1.0, 1.0)])
def test_cost_within_margins(band, expected):
    """(x(1) - 1/5)^2 is the least at a = log 5, or where y <= 1 ends it."""
    cost = Metric(
        key="apart", signal="x", function=lambda t, x: (final(t, x) - 0.2) ** 2, unit="1",
        meaning="distance",
    )  # fmt: skip
    slow = Requirement(key="slow", formula=always(in_band("y", upper=band)), until=1.0)
    found = tuned({"plant.a": (0.1, 10.0)}, slow, cost=cost)
    assert abs(found["plant.a"] - expected) < 0.02
    assert found.margin > 0
    assert found.after["apart"] < found.before["apart"]


@pytest.mark.parametrize(
    ("points", "center", "square"),
    [
        ([(1, 0), (-1, 0), (0, 2)], (0, 0.75), 25 / 16),  # three distances are equal there
        ([(1, 0), (-1, 0), (0, 0.5)], (0, 0), 1.0),  # two are, where nothing is flat but a ridge
    ],
)
def test_smallest_circle_around_points(points, center, square):
    """1 - (squared distance) / 4 of each point: the least is the largest at the center."""
    far = np.array(points, dtype=float)
    distances = ct.nlsys(
        None, lambda t, x, u, p: [(p["a"] - a) ** 2 + (p["b"] - b) ** 2 for a, b in far],
        inputs=0, outputs=["d0", "d1", "d2"], params={"a": 2.5, "b": -1.5}, name="plane",
    )  # fmt: skip
    near = [
        Requirement(key=key, formula=in_band(key, upper=4.0), until=0.0)
        for key in ("d0", "d1", "d2")
    ]
    found = nlctl.tune(
        distances, {"plane.a": (-3.0, 3.0), "plane.b": (-3.0, 3.0)}, near,
        timepts=np.linspace(0, 1, 3), starts=1,
    )  # fmt: skip
    assert abs(found.margin - (1 - square / 4)) < 2e-3
    assert np.abs(found.values - center).max() < 0.05
    assert found.counted_runs < 60


def test_peak_between_samples():
    """A peak of height a at 0.05 s is not seen every 0.1 s, and the note has its margin."""
    plant = ct.nlsys(
        None, lambda t, x, u, p: [p["a"] * np.exp(-(((t - 0.05) / 0.01) ** 2)), p["a"] + 0 * t],
        inputs=0, outputs=["peak", "high"], params={"a": 1.0}, name="plant",
    )  # fmt: skip
    spec = [
        Requirement(key="low", formula=always(in_band("peak", upper=2.0)), until=1.0),
        Requirement(key="high", formula=in_band("high", lower=0.5), until=0.0),
    ]
    coarse = nlctl.tune(plant, {"plant.a": (0.1, 10.0)}, spec, timepts=np.linspace(0, 1, 11))
    unseen = 1 - coarse["plant.a"] / 2
    note = next(note for note in coarse.notes if "with 41 samples" in note)
    assert f"the margin of 'low' is {unseen:.4g} with 41 samples" in note
    fine = nlctl.tune(plant, {"plant.a": (0.1, 10.0)}, spec, timepts=np.linspace(0, 1, 201))
    assert not any("samples" in note for note in fine.notes)
    assert abs(fine["plant.a"] - 0.8) < 2e-3  # 1 - a / 2 = 2 a - 1
    assert fine.margin > unseen


def test_what_each_gain_has_bought():
    """b buys nothing; a alone buys everything, and without it nothing is bought."""
    found = tuned({"plant.a": (0.1, 10.0), "plant.b": (1.0, 3.0)}, [small(), slow()])
    table = found.to_pandas()
    assert abs(table["alone"]["plant.a"] - found.margin) < 1e-9
    assert abs(table["put_back"]["plant.a"] - found.margin_before) < 1e-9
    assert abs(table["alone"]["plant.b"] - found.margin_before) < 1e-9
    assert table["after"]["plant.b"] == 2.0
    assert found.notes == ("nothing that is asked depends on plant.b, which is left at the start",)


def test_flat_requirement():
    """What no gain moves is named, with its value; the rest is tuned."""
    flat = Requirement(key="flat", formula=in_band("x", upper=4.0), until=1.0)
    found = tuned({"plant.a": (0.1, 10.0)}, [small(), flat])
    assert any(note.startswith("'flat' is flat: it was 0.75 at all") for note in found.notes)
    alone = tuned({"plant.a": (0.1, 10.0)}, flat)
    assert alone["plant.a"] == 0.5
    assert any("'flat' is flat" in note for note in alone.notes)
    assert any("nothing better" in note for note in alone.notes)


def test_start_at_a_kink():
    """|x| of x between -1 + b and 1 + b: a kink at b = 0, the best choice."""
    plant = block(lambda t, x, u, p: [np.cos(t), 0.0], {"unused": 1.0}, ("x", "b"))
    shifted = ct.nlsys(
        None, lambda t, x, u, p: [u[0] + p["b"]], inputs=["x"], outputs=["z"], params={"b": 0.0},
        name="shift",
    )  # fmt: skip
    loop = nlctl.interconnect([plant, shifted], outputs=["z"])
    inside = Requirement(key="in", formula=always(in_band("z", lower=-2, upper=2)), until=6.0)
    found = nlctl.tune(loop, {"shift.b": (-1.0, 1.0)}, inside)
    assert abs(found["shift.b"]) < 1e-3
    kinks = [note for note in found.notes if "kink" in note]
    assert kinks[0].startswith("the start is at a kink of 'in' by shift.b")


def test_differences_where_there_is_no_derivative():
    """In discrete time, x[n + 1] = a x[n]: a^4 <= 1/2 and a >= 1/2 within 1."""
    system = ct.nlsys(
        lambda t, x, u, p: [p["a"] * x[0]], lambda t, x, u, p: [x[0], p["a"] + 0 * x[0]],
        inputs=0, outputs=["x", "y"], states=["x"], params={"a": 0.9}, dt=1.0, name="plant",
    )  # fmt: skip
    falls = Requirement(key="falls", formula=always(in_band("x", upper=0.5), start=4.0), until=4.0)
    high = Requirement(key="high", formula=in_band("y", lower=0.5), until=0.0)
    found = nlctl.tune(
        system, {"plant.a": (0.1, 1.0)}, [falls, high], timepts=np.arange(5.0),
        initial_state={"plant.x": 1.0},
    )  # fmt: skip
    grid = np.linspace(0.1, 1.0, 100_001)
    best = np.minimum(1 - 2 * grid**4, 2 * grid - 1).max()
    assert abs(found.margin - best) < 2e-3
    assert found.differentiated_runs == 0
    assert any(note.startswith("differences of runs took the place") for note in found.notes)


def test_start_that_diverges():
    """x' = a x^2 from 1 ends at 1 / a: from a = 3 another start is taken."""
    plant = block(lambda t, x, u, p: [p["a"] * x[0] ** 2], {"a": 3.0})
    low = Requirement(key="low", formula=always(in_band("x", upper=2.0)), until=1.0)
    found = nlctl.tune(plant, {"plant.a": (-3.0, 3.0)}, low, initial_state={"plant.x": 1.0})
    assert found.margin > 0.4  # x(0) = 1 is half of what is allowed
    assert any("does not reach its end" in note for note in found.notes)


def test_no_run_reaches_its_end():
    """x' = a x^2 from 1 has no state at 1 / a: nothing is said of what nobody has seen."""
    plant = block(lambda t, x, u, p: [p["a"] * x[0] ** 2], {"a": 2.0})
    spec = Requirement(key="small", formula=always(in_band("x", upper=9.0)), until=2.0)
    found = nlctl.tune(
        plant, {"plant.a": (1.0, 3.0)}, spec, budget=20, initial_state={"plant.x": 1.0}
    )
    assert any("no run that was tried reaches its end" in note for note in found.notes)
    assert not any("flat" in note or "depends on" in note for note in found.notes)


def test_values_that_a_block_refuses_together():
    """A dead zone whose ends would cross is as good as a run that does not reach its end."""
    source = ct.nlsys(None, lambda t, x, u, p: [np.sin(t)], inputs=0, outputs=["u"], name="source")
    loop = nlctl.interconnect({"source": source, "gap": nlctl.Backlash()}, outputs=["v"])
    low = Requirement(key="low", formula=always(in_band("v", lower=-1, upper=1)), until=6.0)
    found = nlctl.tune(loop, {"gap.c_r": (-0.5, 1.0), "gap.c_l": (-1.0, 0.5)}, low)
    assert found["gap.c_l"] < found["gap.c_r"]
    assert found.margin > found.margin_before


def test_budget():
    """No search begins a choice of gains beyond it, and says that it is spent."""
    found = tuned({"plant.a": (0.1, 10.0)}, [small(), slow()], budget=4)
    assert found.message == "the budget is spent"
    searched = found.history[found.history["by"] == "search"]
    assert searched["runs"].max() <= 4 + 1.7
    assert found.margin > found.margin_before


def test_nothing_is_lost_by_an_interrupt():
    """Ctrl-C in the middle of it: what was found until then is returned."""
    calls = []

    def stopping(t, x):
        calls.append(1)
        if len(calls) == 40:
            raise KeyboardInterrupt
        return 1 - 2 * abs(final(t, x))

    metric = Metric(key="small", signal="x", function=stopping, unit="1", meaning="margin")
    found = tuned({"plant.a": (0.1, 10.0)}, metric, timepts=np.linspace(0, 1, 11))
    assert found.message == "interrupted"
    assert found.margin > found.margin_before


@pytest.mark.parametrize(
    ("space", "spec", "more", "words"),
    [
        ({}, small, {}, "at least one gain"),
        ({"plant.a": (2.0, 1.0)}, small, {}, "finite bounds low < high, got 2, 1"),
        ({"plant.a": (1.0, 2.0)}, small, {}, "start within its bounds, got 0.5 in"),
        ({"plant.a": 1.0}, small, {}, "(low, high) or (start, low, high), got 1.0"),
        ({"plant.a": (0.1, 1.0)}, list, {}, "at least one requirement or a cost"),
        ({"plant.a": (0.1, 1.0)}, lambda: 3.0, {}, "needs requirements such as"),
        ({"plant.a": (0.1, 1.0)}, small, {"budget": 0}, "budget > 0"),
        ({"plant.a": (0.1, 1.0)}, small, {"samples": {"plant.a": [1.0]}}, "leave it out"),
        ({"plant.a": (0.1, 1.0)}, small, {"samples": {"plant.b": [np.nan]}}, "finite numbers"),
        (3.0, small, {}, "gains with their bounds"),
        ({"plant.a": (0.1, 1.0)}, lambda: [small(), small()], {}, "have the key 'small'"),
        ({"plant.a": (0.1, 1.0)}, small, {"timepts": [0, 0.5]}, "timepts end at 0.5 s"),
    ],
)
def test_bad_input(space, spec, more, words):
    """One sentence with the rule and the value."""
    with pytest.raises(nlctl.errors.ParameterError) as told:
        tuned(space, spec(), **more)
    assert words in str(told.value)


def test_unknown_names():
    """The nearest one is named; a block refuses what it does not take."""
    with pytest.raises(nlctl.errors.UnknownNameError, match=r"plant\.a"):
        tuned({"plant.aa": (0.1, 1.0)}, small())
    lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    near = Requirement(key="near", formula=in_band("v", lower=0.5), until=1.0)
    with pytest.raises(nlctl.errors.ParameterError, match=r"bounds in \[0, inf\], as its block"):
        nlctl.tune(lag, {"lag.T": (-1.0, 2.0)}, near, inputs=1.0)


@pytest.mark.weekly
def test_both_examples():
    """Gains of the paper's law: more is left of both bounds, on the published actuators."""
    space = {f"law.{name}": bounds for name, bounds in {"beta": (0.1, 50.0)}.items()}
    small = always(in_band("e", lower=-0.15, upper=0.15), start=10.0)
    moderate = always(in_band("u", lower=-15.0, upper=15.0))
    spec = [
        Requirement(key=key, formula=formula, until=20.0)
        for key, formula in (("tracks", small), ("moderate", moderate))
    ]
    for example in (nlctl.paper.example_1(), nlctl.paper.example_2()):
        found = nlctl.tune(example, space, spec, budget=40, starts=1)
        assert found.margin > found.margin_before + 0.3


def test_text_is_refused_with_what_reads_it():
    """The words of a study file are a formula, and a requirement has a name and an end."""
    lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    with pytest.raises(nlctl.errors.ParameterError, match=r"parse_formula\('always \|v\| <= 1'\)"):
        nlctl.tune(lag, {"lag.T": (0.1, 2.0)}, "always |v| <= 1")
