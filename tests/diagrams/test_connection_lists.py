"""`interconnect` with python-control's lists, and blocks whose signals are given other names."""

import control as ct
import numpy as np
import pytest
from rows import each_row

import nlctl

T = np.linspace(0, 3, 61)


def lag(name, tau):
    """tau x' = u - x."""
    return ct.nlsys(
        lambda t, x, u, p: [(u[0] - x[0]) / p["tau"]], None, inputs=["u"], outputs=["x"],
        states=["x"], params={"tau": tau}, name=name,
    )  # fmt: skip


LISTS = [
    {"connections": [["b.u", "a.x"]], "inplist": ["a.u"], "outlist": ["b.x"]},
    {"connections": ["b.u", "a.x"], "inplist": "a.u", "outlist": "b.x"},
    {"connections": [["b.u", "a.x"]], "inplist": [("a", "u")], "outlist": [(1, 0)]},
    {
        "connections": [["b.u", "a.x"]], "inplist": ["a.u"], "outlist": ["b.x"],
        "inputs": ["w"], "outputs": ["y"],
    },
    {"connections": [["b.u", "-a.x"]], "inplist": ["a.u"], "outlist": ["-b.x", "a.x"]},
    {"connections": [["a.u", "-b.x"], ["b.u", "a.x"]], "inplist": [["a.u", "b.u"]],
     "outlist": ["a.x", "b.x"]},
]  # fmt: skip


@each_row("lists", LISTS)
def test_it_is_python_controls_diagram(lists):
    """Labels, maps and runs, with parameters by name and tuples, gains and sums."""
    ours = nlctl.interconnect([lag("a", 0.5), lag("b", 0.5)], **lists, name="pair")
    theirs = ct.interconnect([lag("a", 0.5), lag("b", 0.5)], **lists, name="pair")
    for what in ("input_labels", "output_labels", "state_labels"):
        assert getattr(ours, what) == getattr(theirs, what)
    for what in ("connect_map", "input_map", "output_map"):
        np.testing.assert_array_equal(getattr(ours, what), getattr(theirs, what))
    u = np.sin(T)
    runs = [
        ct.input_output_response(each, T, u, solve_ivp_method="LSODA") for each in (ours, theirs)
    ]
    np.testing.assert_array_equal(runs[0].y, runs[1].y)


def test_params_are_values_of_the_diagram():
    """tau = 0.1 and 2 by name, in both engines, in tables, and against the closed form."""
    pair = nlctl.interconnect(
        [lag("a", 1.0), lag("b", 1.0)], [["b.u", "a.x"]], ["a.u"], ["b.x"],
        {"a.tau": 0.1, "b.tau": 2.0},
    )  # fmt: skip
    exact = 1 - (2.0 * np.exp(-T / 2.0) - 0.1 * np.exp(-T / 0.1)) / 1.9
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(pair, T, 1.0, engine=engine)
        np.testing.assert_allclose(run.outputs, exact, atol=1e-6)
    np.testing.assert_allclose(
        nlctl.input_output_response(pair, T, 1.0, params={"a.tau": 2.0}).outputs,
        1 - (1 + T / 2) * np.exp(-T / 2), atol=1e-6,
    )  # fmt: skip
    assert nlctl.parameters(pair)["value"].to_dict() == {"a.tau": 0.1, "b.tau": 2.0}


def test_params_of_records_are_checked_and_kept_in_a_larger_diagram():
    """A value of a record has the record's bounds; the diagram's name goes in front."""
    inner = nlctl.interconnect(
        {"gain": nlctl.Gain(k=2.0)}, inputs=["u"], outputs=["v"], params={"gain.k": 3.0}, name="in"
    )
    outer = nlctl.interconnect([inner], inputs=["u"], outputs=["v"], name="out")
    assert nlctl.input_output_response(outer, [0, 1], 1.0).outputs[-1] == 3.0
    assert nlctl.parameters(outer)["value"]["in.gain.k"] == 3.0
    with pytest.raises(nlctl.errors.ParameterError, match="b_r >= 0, got -1"):
        nlctl.interconnect(
            {"zone": nlctl.DeadZone()}, inputs=["u"], outputs=["v"], params={"zone.b_r": -1.0}
        )


def test_every_output_of_every_block_without_an_outlist():
    """With the name of the block in front where two have one name."""
    pair = nlctl.interconnect([lag("a", 1.0), lag("b", 1.0)], [["b.u", "a.x"]], ["a.u"])
    assert pair.output_labels == ["a_x", "b_x"]


@each_row(
    ("lists", "error", "message"),
    [
        ({"connections": [["b.u", "a.z"]]}, nlctl.errors.UnknownNameError,
         "signal 'z' of block 'a'"),
        ({"connections": [["c.u", "a.x"]]}, nlctl.errors.UnknownNameError, "block 'c' in 'c.u'"),
        ({"connections": [["b.u", "a.x"]]}, nlctl.errors.DiagramError,
         "'u' of block 'a' is fed by"),
        (
            {"connections": [["b.u", "a.x"]], "inplist": "b.x"}, nlctl.errors.DiagramError,
            "cannot connect these lists",
        ),
        (
            {"connections": [["b.u", "a.x"]], "inplist": "a.u", "params": {"a.ta": 1}},
            nlctl.errors.UnknownNameError, "nearest: 'a.tau'",
        ),
        ({"inplist": ["ab"]}, nlctl.errors.UnknownNameError, "'ab' in a list of connections"),
    ],
)  # fmt: skip
def test_mistakes_are_refused_by_name(lists, error, message):
    """Where python-control warns, or takes 0 for what is not connected."""
    with pytest.raises(error, match=message):
        nlctl.interconnect([lag("a", 1.0), lag("b", 1.0)], **lists)


# -- other names of signals ------------------------------------------------------------------------


def test_blocks_of_one_kind_stand_in_one_diagram():
    """Two lags by name: 1 - (1 + t) exp(-t); states and parameters keep their names."""
    first = nlctl.block(nlctl.Lag(T=1.0), "first", outputs="p")
    second = nlctl.block(nlctl.Lag(T=1.0), "second", inputs={"u": "p"}, outputs=["q"])
    pair = nlctl.interconnect([first, second], inputs=["u"], outputs=["q"])
    for engine in ("native", "python-control"):
        run = nlctl.input_output_response(pair, T, 1.0, engine=engine)
        np.testing.assert_allclose(run.outputs, 1 - (1 + T) * np.exp(-T), atol=1e-7)
    assert nlctl.state_names(pair) == ["first.v", "second.v"]
    run = nlctl.input_output_response(pair, T, 0.0, {"second.v": 1.0}, params={"second.T": 2.0})
    np.testing.assert_allclose(run.outputs, np.exp(-T / 2), atol=1e-7)


def test_a_memory_keeps_its_law_under_other_names():
    """A play whose signals are renamed is the play."""
    u = 2 * np.sin(3 * T)
    plain, other = (
        nlctl.input_output_response(nlctl.block(nlctl.Backlash(), "play", **names), T, u)
        for names in ({}, {"inputs": "angle", "outputs": "gear"})
    )
    np.testing.assert_array_equal(plain.outputs, other.outputs)
    assert (other.input_labels, other.output_labels) == (["angle"], ["gear"])


@each_row(
    ("names", "message"),
    [
        ({"inputs": ["a", "b"]}, "has 1 input (u): inputs needs as many different names"),
        ({"outputs": ""}, "has 1 output"),
        ({"outputs": "a.b"}, "without dots"),
        ({"inputs": {"x": "a"}}, "unknown input 'x' of block 'lag'"),
    ],
)
def test_names_that_cannot_be_given_are_refused(names, message):
    """Too many, empty ones, those that look like a path, and of signals that do not exist."""
    with pytest.raises(nlctl.errors.UsageError) as error:
        nlctl.block(nlctl.Lag(), "lag", **names)
    assert message in str(error.value)
