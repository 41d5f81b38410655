"""Bad input is refused where it enters: each message names the culprit, the rule and the value."""

import dataclasses
import re

import control as ct
import numpy as np
import pytest
from rows import each_row
from small_systems import chain, gain, out, third_party

import nlctl
from nlctl.analysis.catalogue import block_records
from nlctl.errors import AmbiguousNameError, DiagramError, ParameterError, UnknownNameError
from nlctl.paper import example_1, example_2
from nlctl.params import check_params

MAKERS = [ct.interconnect, nlctl.interconnect]
makers = pytest.mark.parametrize("join", MAKERS, ids=["control", "nlctl"])


def refused(error, *told):
    """Expect an error whose message contains every piece of text."""
    pieces = "".join(f"(?=.*{re.escape(piece)})" for piece in told)
    return pytest.raises(error, match=f"(?s)^{pieces}")


@each_row(
    ("cls", "values", "told"),
    [
        ("GaussianBasis", {"widths": -2.0}, ["widths[0] > 0", "-2"]),
        ("GaussianBasis", {"widths": (2.0,) * 26 + (0.0,)}, ["widths[26] > 0", "got 0"]),
        (
            "GaussianBasis",
            {"widths": (1.0, 2.0)},
            ["one for each of its 27 centres", "got 2"],
        ),
        ("GaussianBasis", {"centres": []}, ["centres", "(0,)"]),
        ("GaussianBasis", {"centres": np.zeros((0, 2))}, ["at least one value in centres"]),
        ("GaussianBasis", {"centres": [[1.0, 2.0], [3.0]]}, ["numbers for centres", "[3.0]"]),
        ("GaussianBasis", {"centres": [1.0, 2.0]}, ["centres to be a matrix", "(2,)"]),
        ("GaussianBasis", {"centres": [[0.0, np.nan]]}, ["a finite centres[0, 1]", "nan"]),
        ("FilteredError", {"lambdas": (-1.0,)}, ["Hurwitz", "(14)", "(-1.0,)", "root at 1"]),
        ("FilteredError", {"lambdas": (2.0, -1.0)}, ["Hurwitz", "(2.0, -1.0)"]),
        ("FilteredError", {"lambdas": (1.0, np.inf)}, ["a finite lambdas[1]", "inf"]),
        ("AdaptiveWeights", {"nodes": 0}, ["nodes >= 1", "got 0"]),
        ("AdaptiveWeights", {"Gamma": 0}, ["Gamma > 0", "got 0"]),
        ("RobustTerm", {"tau": -0.2}, ["tau > 0", "-0.2"]),
        ("RobustTerm", {"sigma_2": -1e-3}, ["sigma_2 >= 0", "-0.001"]),
        ("NussbaumLaw", {"beta": np.nan}, ["a finite beta", "nan"]),
        ("DeadZone", {"b_l": 0.3}, ["b_l <= 0", "0.3"]),
        ("DeadZone", {"ripple_l": 0.9}, ["|ripple_l| < slope_l", "0.9 and 0.8"]),
        ("Backlash", {"c_l": 0.5}, ["c_l < c_r", "0.5 and 0.5"]),
        ("Genesio", {"gain_mean": -np.inf}, ["a finite gain_mean", "-inf"]),
        ("ForcedDuffing", {"gain_v": -1}, ["gain_v > -1", "-1"]),
        ("SumOfSines", {"frequencies": (1.0, -1.0)}, ["frequencies[1] >= 0", "-1"]),
        ("SumOfSines", {"order": -1}, ["order >= 0", "-1"]),
        ("FilteredStep", {"order": 1.5}, ["order >= 0", "1.5"]),
        ("FilteredStep", {"omega": 0.0}, ["omega > 0", "got 0"]),
        ("PureFeedback", {"order": 0, "f": lambda x, v: v}, ["order >= 1", "got 0"]),
    ],
)
def test_records(cls, values, told):
    """Numbers out of bounds, not finite, of the wrong shape or number."""
    with refused(ParameterError, f"{cls} needs", *told):
        block_records()[cls](**values)


def low_order(order):
    return {"reference": nlctl.SumOfSines(order=order)}


@each_row(
    ("make", "choices", "error", "told"),
    [
        (example_1, low_order(1), ParameterError, ["1 derivative,", "order 2 needs 2"]),
        (example_2, low_order(2), ParameterError, ["2 derivatives", "order 3 needs 3"]),
        (example_1, {"phase": "chirp"}, UnknownNameError, ["'chirp'", "'integral', 'product'"]),
        (example_1, {"phase": "produkt"}, UnknownNameError, ["'produkt'", "nearest: 'product'"]),
        (example_1, {"centres": "triangle"}, ParameterError, ["'triangle'", "'diagonal'"]),
        (example_1, {"centres": "3x3x3"}, ParameterError, ["at most 2", "'3x3x3'"]),
        (example_1, {"centres": "3x0"}, ParameterError, ["'3x0'"]),
        (example_1, {"centres": np.eye(3)}, ParameterError, ["at most 2 coordinates", "3"]),
        (example_1, {"p1": np.nan}, ParameterError, ["ForcedDuffing needs a finite p1", "nan"]),
        (
            example_1,
            {"plant": nlctl.plants.ForcedDuffing(), "p1": 0.2},
            ParameterError,
            ["p1", "plant is"],
        ),
        (example_2, {"lambdas": (1.0, -1.0)}, ParameterError, ["Hurwitz", "(1.0, -1.0)"]),
        (example_2, {"lambdas": (1.0, 2.0, 1.0)}, ParameterError, ["needs 2 lambdas", "got 3"]),
        (example_2, {"v0": np.inf}, ParameterError, ["a finite v0", "inf"]),
        (example_2, {"actuator": nlctl.Backlash(), "v0": 0.1}, ParameterError, ["v0", "actuator"]),
        (example_1, {"actuator": nlctl.plants.Genesio()}, DiagramError, ["'plant'", "'actuator'"]),
        (example_1, {"actuator": nlctl.DeadZone}, TypeError, ["DeadZone is a class"]),
        (example_1, {"actuator": "dead zone"}, TypeError, ["str is not a block"]),
    ],
)
def test_examples(make, choices, error, told):
    """A choice that does not exist or does not fit, a block in the wrong place."""
    with refused(error, *told):
        make(**choices)


class TestJoining:
    @each_row(
        ("parts", "inputs", "outputs", "error", "told"),
        [
            ("u>a>m mm>b>y", "u", "y", DiagramError, ["'b'", "'mm'", "nearest: 'm'"]),
            ("u>a>m m>b>y", "u", "yy", UnknownNameError, ["output signal 'yy'", "'y'"]),
            ("u>a>m m>b>y", "u w", "y", UnknownNameError, ["input signal 'w'", "'u'"]),
            ("u>a>m m>b>y", "", "y", DiagramError, ["'a'", "'u'", "no block outputs"]),
            ("u>a>y u>b>y", "u", "y", DiagramError, ["'y'", "'a'", "'b'", "summing_junction"]),
            ("u>a>m m>a>y", "u", "y", DiagramError, ["two blocks", "'a'"]),
            ("u>a>m m>b>y", "u m", "y", DiagramError, ["'m'", "'a'"]),
            ("u>a>m m>b>y", "u u", "y", DiagramError, ["'u'"]),
        ],
    )
    def test_signals_that_do_not_fit(self, parts, inputs, outputs, error, told):
        """Misspelt, from two sources or from none, and blocks of one name."""
        blocks = []
        for part in parts.split():
            takes, name, delivers = part.split(">")
            blocks.append(gain(name, 1.0, takes, delivers))
        with refused(error, *told):
            nlctl.interconnect(blocks, inputs=inputs.split(), outputs=outputs.split())

    def test_a_signal_may_bear_the_name_of_a_block(self):
        """Both are often called after the quantity: block 'u' takes signal 'u'."""
        blocks = {"u": gain("u", 2.0, "u", "m"), "m": gain("m", 3.0, "m", "y")}
        assert out(nlctl.interconnect(blocks, inputs=["u"], outputs=["y"])) == 6.0

    def test_one_signal_may_be_given_as_a_string(self):
        """As in `ct.interconnect`: inputs="ref" is the signal ref, not r, e and f."""
        diagram = nlctl.interconnect([gain("a", 2.0, "ref", "out")], inputs="ref", outputs="out")
        assert (diagram.input_labels, diagram.output_labels) == (["ref"], ["out"])


class TestNames:
    @makers
    @each_row(
        "change",
        [
            lambda d: out(d, {"first.kk": 1.0}),
            lambda d: out(d, {"frist.k": 1.0}),
            lambda d: out(d, {"first.k[": 1.0}),
            lambda d: d.params.update({"first.kk": 1.0}),
            lambda d: d.params.__setitem__("first.kk", 1.0),
            lambda d: d.params.__ior__({"first.kk": 1.0}),
            lambda d: out(d, d.params | {"first.kk": 1.0}),
            lambda d: out(d, {**d.params, "first.kk": 1.0}),
            lambda d: out(d, {"k": 1.0}),
            lambda d: d.params.update({"k": 1.0}),
            lambda d: d.params.__setitem__("k", 1.0),
        ],
        ids=["run", "block", "bracket", "update", "item", "ior", "or", "dict"]
        + ["bare", "bare update", "bare item"],
    )
    def test_a_misspelt_parameter_is_never_ignored(self, join, change):
        """Whichever way a wrong name enters, it is refused there or when the diagram runs."""
        diagram = chain(join)

        def use():
            change(diagram)
            return out(diagram)

        with pytest.raises((UnknownNameError, ParameterError), match=r"first\.k|Affine has k"):
            use()

    @makers
    def test_a_bare_name_is_answered_with_the_full_ones(self, join):
        """k alone says nothing, unless a third-party block has it."""
        with refused(UnknownNameError, "'k'", "'first.k' or 'second.k'"):
            out(chain(join), {"k": 1.0})
        parts = [third_party("f", "k", 2.0, "u", "m"), gain("g", 3.0, "m", "y")]
        assert out(join(parts, inputs=["u"], outputs=["y"]), {"k": 7.0}) == 21.0

    def test_parameters_and_states_of_an_example(self):
        """The controller is nested: short names that mean one thing work, others do not."""
        diagram = example_1()
        x0 = nlctl.initial_state(diagram)
        for name, error, told in (
            ("actuator.b_R", UnknownNameError, ["'actuator.b_R'", "nearest: 'actuator.b_r'"]),
            ("law.betta", UnknownNameError, ["'law.betta'", "'controller.law.beta'"]),
            ("beta", UnknownNameError, ["'beta'", "'controller.law.beta'"]),
            ("law.beta", ParameterError, ["NussbaumLaw needs beta > 0, got -1 (block 'law')"]),
        ):
            with refused(error, *told):
                diagram.dynamics(0.0, x0, [], params={name: -1.0})
        with refused(UnknownNameError, "state 'plant.x3'", "'plant.x"):
            nlctl.initial_state(diagram, {"plant.x3": 0.0})
        with refused(ParameterError, "'plant.x1' needs a finite initial value, got nan"):
            nlctl.initial_state(diagram, {"plant.x1": np.nan})

    @each_row(
        ("name", "value"),
        [
            ("filtered_error.lambdas", (1.0,)),
            ("filtered_error.lambdas", (3.0, 3.0, 1.0)),
            ("basis.centres", np.zeros((5, 3))),
            ("basis.centres", np.zeros((27, 1))),
        ],
    )
    def test_an_override_cannot_change_the_signals_of_a_block(self, name, value):
        """A block made for three states does not silently read two of them."""
        diagram = example_2()
        with refused(ParameterError, f"block '{name.partition('.')[0]}'"):
            diagram.output(0.3, nlctl.initial_state(diagram) + 0.1, [], params={name: value})

    @each_row("bad", ["a", [1.0, 2.0], None, 1j])
    def test_an_initial_value_is_one_number(self, bad):
        """The state and the value are named."""
        with refused(ParameterError, "'plant.x1'", str(bad)):
            nlctl.initial_state(example_1(), {"plant.x1": bad})

    def test_parameters_of_two_controllers(self):
        """A name that two blocks share is answered with both."""
        inner = chain(nlctl.interconnect, name="one", middle="m1", delivers="y1")
        other = chain(nlctl.interconnect, name="two", takes="y1", middle="m2", delivers="y2")
        diagram = nlctl.interconnect([inner, other], inputs=["u"], outputs=["y2"])
        with refused(AmbiguousNameError, "'first.k'", "one.first.k or two.first.k"):
            out(diagram, {"first.k": 1.0})

    def test_parameters_of_a_block_cannot_be_changed_unnoticed(self):
        """Assigning to one parameter of a block changes it, as in python-control, or is refused."""
        block = gain("a", 2.0)
        block.params = {"a.k": 3.0}
        assert out(block) == 3.0
        with pytest.raises(UnknownNameError, match=r"'z' of block 'a'; known: 'c', 'k'"):
            block.params = {"a.z": 1.0}
        try:
            block.params["a.k"] = 5.0
        except TypeError:
            assert out(block) == 3.0
        else:
            assert out(block) == 5.0

    def test_a_later_override_of_a_vector_beats_an_earlier_default_of_its_element(self):
        """What is asked for in the run counts, however the default was written."""
        signals = [*(f"x{i}" for i in (1, 2, 3)), "yd", "yd1", "yd2", "yd3"]
        error = nlctl.block(nlctl.controllers.FilteredError(lambdas=(2.0, 1.0)), "error")
        diagram = nlctl.interconnect([error], inputs=signals, outputs=["r"])
        diagram.params.update({"error.lambdas[1]": 5.0})
        u = [1.0, *[0.0] * 6]  # r = lambda_2 x1
        assert diagram.output(0, [], u) == 5.0
        assert diagram.output(0, [], u, params={"error.lambdas[1]": 6.0}) == 6.0
        assert diagram.output(0, [], u, params={"error.lambdas": (2.0, 7.0)}) == 7.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plain:
    """A dataclass without `record`: block() checks it."""

    k: float = nlctl.param(1, unit="1", meaning="gain", above=0)

    inputs = ("u",)
    outputs = ("y",)
    states = ()
    feedthrough = True

    @staticmethod
    def output(t, x, u, p):
        return (p.k * u[0],)


class TestPlainDataclass:
    def test_it_is_checked_when_made_a_block(self):
        """The design's own way of writing a record is as safe as `record`."""
        with refused(ParameterError, "Plain needs k > 0, got -3"):
            nlctl.block(Plain(k=-3), "gain")
        with refused(ParameterError, "Plain needs a finite k, got nan"):
            nlctl.block(Plain(k=np.nan), "gain")

    def test_it_is_normalised_and_overridden(self):
        """Values become floats, overrides reach it and are checked."""
        made = nlctl.block(Plain(k=3), "gain")
        assert isinstance(made.params["gain.k"], float)
        assert out(made, {"gain.k": 5}) == 5.0
        with refused(ParameterError, "Plain needs k > 0, got -1 (block 'gain')"):
            out(made, {"gain.k": -1})

    def test_check_params_may_be_called_directly(self):
        """`check_params` normalises in place."""
        spec = Plain(k=np.int64(2))
        check_params(spec)
        assert isinstance(spec.k, float)
