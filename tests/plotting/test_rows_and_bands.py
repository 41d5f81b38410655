"""Which signals share a row, and what bands of many runs hold."""

import control as ct
import matplotlib as mpl
import numpy as np
import pytest
from examples import many
from hypothesis import given, settings
from hypothesis import strategies as st

import nlctl
from nlctl.analysis.robustness import Requirement, Spec, always, in_band
from nlctl.plotting.groups import Wires, groups_of, wires_of

mpl.use("Agg")
T = np.linspace(0, 5, 101)


@pytest.fixture(autouse=True)
def closed():
    """Figures of a test go with it."""
    yield
    mpl.pyplot.close("all")


NO_WIRES = Wires()


def kinds(signals, wires=NO_WIRES):
    """The rows as sets, without their titles."""
    return {frozenset(names) for names in groups_of(signals, wires).values()}


signs = st.sampled_from([-1.0, 1.0])


@given(a=signs, b=signs, c=st.floats(0.5, 2.0))
@settings(max_examples=many(20, part=4), deadline=None)
def test_sums_and_differences_share_a_row(a, b, c):
    """e = +-y +-r, also where r is constant; what is another multiple does not."""
    y, r = np.sin(T), np.cos(3 * T)
    other = np.exp(-T)
    signals = {"y": y, "r": r, "e": a * y + b * r, "other": other}
    assert kinds(signals) == {frozenset("yre"), frozenset({"other"})}
    step = {"y": y, "r": np.full_like(y, c), "e": a * y + b * c}
    assert kinds(step) == {frozenset("yre")}
    scaled = {"y": y, "r": r, "e": y - (1 + c) * r}
    blocks = {"y": "plant", "r": "reference", "e": "sum"}
    assert len(kinds(scaled, Wires(blocks=blocks))) == 3


def test_equal_signals_share_a_row_and_zeros_none():
    """Of one unit is what is equal but for its sign; of a signal that is 0 nobody knows."""
    y = np.sin(T)
    signals = {"y": y, "x1": -y, "still": 0 * y, "dead": 0 * y}
    blocks = {"y": "plant", "x1": "plant", "still": "a", "dead": "b"}
    assert kinds(signals, Wires(blocks=blocks)) == {
        frozenset({"y", "x1"}), frozenset({"still"}), frozenset({"dead"})
    }  # fmt: skip


def test_a_row_has_at_most_four_signals():
    """As many as there are line styles; all signals are shown once, in their order."""
    signals = {f"s{k}": np.sin((k + 1) ** 1.3 * T) for k in range(11)}
    rows = groups_of(signals, Wires(blocks=dict.fromkeys(signals, "bank")))
    assert [len(names) for names in rows.values()] == [4, 4, 3]
    assert [name for names in rows.values() for name in names] == list(signals)


def loop():
    """A PI loop of python-control's blocks, around a saturation and a plant of two outputs."""
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - x[0], x[0] - x[1]], None, inputs=["v"], outputs=["a", "b"],
        states=["a", "b"], name="plant",
    )  # fmt: skip
    error = ct.summing_junction(["r", "-b"], "e", name="sum")
    law = ct.ss([0], [1], [0.5], [2], inputs="e", outputs="u", name="law")
    limit = nlctl.block(nlctl.Saturation(limit=1.0), "limit")
    return nlctl.interconnect(
        [plant, error, law, limit], inputs=["r"], outputs=["a", "b", "e", "u", "v"], name="loop"
    )


def test_both_ends_of_an_actuator_share_a_row():
    """By the wires of the diagram: u goes into the saturation, v comes out of it."""
    found = wires_of(loop())
    assert found.pairs == (("u", "v"),)
    assert found.blocks == {"a": "plant", "b": "plant", "e": "sum", "u": "law", "v": "limit"}
    run = nlctl.input_output_response(loop(), T, 1.0)
    _, rows = run.rows()
    assert {frozenset(names) for names in rows.values()} == {
        frozenset({"b", "e", "r"}), frozenset({"u", "v"}), frozenset({"a"})
    }  # fmt: skip
    drawn = run.plot()
    assert isinstance(drawn, ct.ControlPlot)
    assert drawn.axes.shape == (3, 1)
    shown = [line.get_ydata() for lines in drawn.lines[:, 0] for line in lines]
    assert len(shown) == 6
    np.testing.assert_array_equal(shown[0], run.outputs[0])


def test_what_is_asked_for_is_shown():
    """By name; python-control's arguments are python-control's plot, in a figure of its own."""
    run = nlctl.input_output_response(loop(), T, 1.0)
    assert run.plot(signals=[["r", "b"], "v"]).axes.shape == (2, 1)
    with pytest.raises(nlctl.errors.UnknownNameError, match="unknown signal 'ref'"):
        run.plot(signals=["ref"])
    theirs = run.plot(overlay_signals=True)
    assert theirs.axes.shape == (2, 1)
    with pytest.raises(nlctl.errors.UsageError, match="no meaning next to"):
        run.plot(signals=["b"], overlay_signals=True)


def test_rows_of_python_control_have_room():
    """Four signals have a row each: a figure of 4 x 1.2 in at least; two fit python-control's."""
    lag = nlctl.input_output_response(nlctl.block(nlctl.Lag(), "lag"), T, 1.0)
    assert tuple(lag.plot().figure.get_size_inches()) == (6.4, 4.8)
    first = nlctl.input_output_response(loop(), T, 1.0).plot(plot_inputs=True)
    assert first.figure.get_size_inches()[1] == pytest.approx(6 * 1.2)


def test_states_are_found_by_either_name():
    """python-control's label, the qualified name, the end of one; others are refused."""
    diagram = nlctl.paper.example_1()
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(diagram, T[:3], engine=engine)
        np.testing.assert_array_equal(run.states["plant.x1"], run.states["plant_x1"])
        zeta = run.outputs[diagram.output_index["zeta"]]
        np.testing.assert_allclose(run.states["law.zeta"], zeta, rtol=1e-12)
        both = run.states[["plant.x1", "plant.x2"]]
        np.testing.assert_array_equal(both, run.states[:2])
        with pytest.raises(ValueError, match=r"plant\.x9"):
            run.states["plant.x9"]


# -- many runs -------------------------------------------------------------------------------------


def many():
    """x' = -x from -50, ..., 50: at t the bands end at multiples of exp(-t)."""
    lag = nlctl.block(nlctl.Lag(T=1.0), "lag")
    starts = np.arange(-50.0, 51.0)[:, None]
    return nlctl.ensemble_response(lag, T=T, X0=starts, keep=["v"])


def test_the_bands_hold_the_members_that_they_say():
    """100 %, 90 % and 50 % of evenly spread members: 50, 45 and 25 exp(-t) on either side."""
    ensemble = many()
    drawn = ensemble.plot(members=[0, 100])
    ax = drawn.axes[0, 0]
    for band, width in zip(ax.collections, (50, 45, 25), strict=True):
        corners = band.get_paths()[0].vertices
        start = corners[np.isclose(corners[:, 0], 0.0), 1]
        assert (start.min(), start.max()) == (-width, width)
    lowest, highest = drawn.lines[0, 0]
    np.testing.assert_allclose(lowest.get_ydata(), -50 * np.exp(-T), rtol=1e-6)
    np.testing.assert_allclose(highest.get_ydata(), 50 * np.exp(-T), rtol=1e-6)


def test_limits_of_a_spec_are_lines_where_they_count():
    """|v| <= 10 from 2 s on: two lines from 2 s to the end."""
    formula = always(in_band("v", lower=-10, upper=10), start=2.0)
    spec = Spec(requirements=(Requirement(key="small", formula=formula, until=5.0),))
    assert spec.limits == {"v": [(-10, 2.0, 5.0), (10, 2.0, 5.0)]}
    ax = many().plot(spec=spec).axes[0, 0]
    lines = [c.get_segments()[0].tolist() for c in ax.collections if hasattr(c, "get_segments")]
    assert lines == [[[2.0, y], [5.0, y]] for y in (-10.0, 10.0)]


def test_a_table_has_a_row_for_each_member_and_time():
    """The same numbers, in order."""
    ensemble = many()
    table = ensemble.to_pandas()
    assert list(table.columns) == ["member", "time", "v"]
    assert len(table) == 101 * T.size
    wide = table.pivot_table(index="member", columns="time", values="v")
    np.testing.assert_array_equal(wide.to_numpy(), ensemble.signals["v"])


def test_what_cannot_be_plotted_is_refused():
    """Signals that were not kept, and members that do not exist."""
    with pytest.raises(nlctl.errors.UnknownNameError, match="among those that were kept"):
        many().plot(["u"])
    with pytest.raises(nlctl.errors.ParameterError, match="members from 0 to 100, got 101"):
        many().plot(members=[101])
    nothing = nlctl.ensemble_response(nlctl.block(nlctl.Lag(), "lag"), T)
    with pytest.raises(nlctl.errors.ParameterError, match="keep="):
        nothing.plot()
