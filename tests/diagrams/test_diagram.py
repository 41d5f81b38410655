"""Diagrams: their defaults, third-party blocks in them, initial states, tables, both examples."""

import control as ct
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_systems import chain, gain, out, third_party

import nlctl
from nlctl.diagrams import leaves
from nlctl.errors import AmbiguousNameError, UnknownNameError
from nlctl.paper import example_1, example_2

MAKERS = [ct.interconnect, nlctl.interconnect]
makers = pytest.mark.parametrize("join", MAKERS, ids=["control", "nlctl"])


class TestDefaults:
    @makers
    def test_update_and_item_assignment_change_them(self, join):
        """A diagram's own values: they hold until they are changed or overridden in a run."""
        diagram = chain(join)
        diagram.params.update({"first.k": 5.0})
        assert out(diagram) == 15.0
        diagram.params["second.k"] = 7.0
        assert out(diagram) == 35.0
        assert out(diagram, {"first.k": 1.0}) == 7.0
        assert out(diagram) == 35.0

    @pytest.mark.parametrize(
        "change",
        [
            lambda d: d.params.update({"first.k": 10.0}),
            lambda d: d.params.__setitem__("first.k", 10.0),
        ],
        ids=["update", "item"],
    )
    def test_a_short_name_as_default(self, change):
        """The unambiguous end of a path works for a default as it does for an override."""
        inner = chain(nlctl.interconnect, name="inner")
        outer = nlctl.interconnect([inner], inputs=["u"], outputs=["y"])
        change(outer)
        assert out(outer) == 30.0

    def test_a_plain_dict_given_to_interconnect(self):
        """`ct.interconnect(params={...})` sets defaults by qualified name."""
        diagram = chain(params={"first.k": 7.0})
        assert out(diagram) == 21.0
        assert out(diagram, {"second.k": 10.0}) == 70.0
        assert out(diagram) == 21.0

    @makers
    @pytest.mark.parametrize("name", ["last.k", "first.k", "inner.first.k"])
    def test_a_plain_dict_reaches_into_nested_diagrams(self, join, name):
        """The same with a diagram among the blocks, by short and by full name."""
        if join is ct.interconnect and name.startswith("inner"):
            name = "second.k"  # python-control puts no name in front
        parts = [chain(join, name="inner"), gain("last", 5.0, "y", "z")]
        with_dict = ct.interconnect(parts, inputs=["u"], outputs=["z"], params={name: 10.0})
        plain = ct.interconnect(parts, inputs=["u"], outputs=["z"])
        assert out(with_dict) == out(plain, {name: 10.0}) != out(plain)


class TestForeignBlocks:
    @makers
    @pytest.mark.parametrize("declared", [True, False])
    @pytest.mark.parametrize("depth", [0, 1, 2])
    def test_bare_names_reach_them_at_any_depth(self, join, declared, depth):
        """A dict parameter of another toolbox's block keeps its bare name beside ours."""
        parts = [
            third_party("theirs", "q", 2.0, "u", "m", declared),
            gain("ours", 3.0, "m", "y"),
        ]
        system = join(parts, inputs=["u"], outputs=["y"], name="d0")
        for level in range(depth):
            system = join([system], inputs=["u"], outputs=["y"], name=f"d{level + 1}")
        ours = "ours.k"
        assert out(system) == 6.0
        assert out(system, {"q": 10.0}) == 30.0
        assert out(system, {"q": 10.0, ours: 5.0}) == 50.0
        assert out(system, {ours: 5.0}) == 10.0

    def test_their_equal_names_are_python_controls_affair_in_its_diagrams(self):
        """Two third-party blocks with one name share the last default, as without our blocks."""
        parts = [
            third_party("f", "q", 2.0, "u", "m"),
            gain("ours", 1.0, "m", "n"),
            third_party("g", "q", 5.0, "n", "y"),
        ]
        with_ours = ct.interconnect(parts, inputs=["u"], outputs=["y"])
        parts[1] = ct.nlsys(None, lambda t, x, u, p: u, inputs=["m"], outputs=["n"], name="ours")
        without = ct.interconnect(parts, inputs=["u"], outputs=["y"])
        for params in (None, {"q": 3.0}):
            assert out(with_ours, params) == out(without, params)


def two_controllers():
    """Make a diagram with states on two levels, some of them third-party."""
    one = nlctl.interconnect(
        {"law": nlctl.controllers.NussbaumLaw()}, inputs=LAW, outputs=["u"], name="c1"
    )
    two = one.copy(name="c2")
    two.update_names(inputs=[f"{s}2" for s in LAW], outputs=["u2"])
    theirs = ct.tf(1, [1, 2, 1], inputs="u", outputs="w", name="filter")
    plant = nlctl.block(nlctl.PureFeedback(order=2, f=lambda x, v: v, initial={"x2": 3.0}), "plant")
    plant.update_names(inputs=["u2"])
    return nlctl.interconnect([one, two, theirs, plant], inputs=[*LAW, *two.input_labels])


LAW = ["r", "W_psi", "robust", "Y_d"]


class TestInitialState:
    NAMES = ("c1.law.zeta", "c2.law.zeta", "filter.x[0]", "filter.x[1]", "plant.x1", "plant.x2")

    def test_names_follow_the_state_vector(self):
        """The qualified names are python-control's labels with dots, in its order."""
        for diagram in (two_controllers(), example_1(), example_2()):
            names = nlctl.state_names(diagram)
            assert [name.replace(".", "_") for name in names] == diagram.state_labels
            assert len(nlctl.initial_state(diagram)) == diagram.nstates == len(set(names))
            for leaf in leaves(diagram):
                ours = [f"{leaf.path}.{s}" for s in leaf.system.state_labels]
                assert names[leaf.state_offset :][: len(ours)] == ours

    def test_defaults_are_what_the_records_declare(self):
        """Declared values, 0 for the rest and for third-party blocks."""
        x = nlctl.initial_state(two_controllers())
        np.testing.assert_array_equal(x, [1, 1, 0, 0, 0, 3])
        np.testing.assert_array_equal(
            nlctl.initial_state(nlctl.block(nlctl.Backlash(v0=0.4), "a")), [0.4]
        )

    @given(st.dictionaries(st.sampled_from(NAMES), st.floats(-9, 9)))
    @settings(max_examples=10)
    def test_values_replace_the_states_that_they_name(self, values):
        """Exactly the named entries change."""
        diagram = two_controllers()
        expected = dict(zip(self.NAMES, nlctl.initial_state(diagram), strict=True)) | values
        np.testing.assert_array_equal(nlctl.initial_state(diagram, values), list(expected.values()))

    def test_short_names_and_refusals(self):
        """The end of one path is enough; two paths, none, or NaN are refused by name."""
        diagram = two_controllers()
        assert nlctl.initial_state(diagram, {"x2": 7.0})[5] == 7.0
        with pytest.raises(AmbiguousNameError, match=r"'zeta' could be c1\.law\.zeta or"):
            nlctl.initial_state(diagram, {"zeta": 0.0})
        with pytest.raises(UnknownNameError, match=r"state 'plant.x3'; nearest: 'plant.x"):
            nlctl.initial_state(diagram, {"plant.x3": 0.0})
        for bad in (np.nan, np.inf):
            with pytest.raises(ValueError, match=f"'plant.x1' needs a finite .*, got {bad}"):
                nlctl.initial_state(diagram, {"plant.x1": bad})


class TestParameterTable:
    @makers
    def test_every_name_in_it_works_as_an_override(self, join):
        """What the table calls a parameter is what python-control is given."""
        inner = chain(join, name="inner")
        diagram = join([inner, gain("last", 5.0, "y", "z")], inputs=["u"], outputs=["z"])
        table = nlctl.parameters(diagram)
        assert list(table.columns) == ["value", "unit", "bounds", "meaning"]
        assert sorted(table["value"][lambda v: v > 0]) == [2.0, 3.0, 5.0]
        for name, value in table["value"].items():
            assert out(diagram, {name: value}) == 30.0
            assert out(diagram, {name: value + 1.0}) != 30.0

    def test_the_examples_list_the_papers_values(self):
        """Numbers of the paper's section 5, by qualified name."""
        one, two = (nlctl.parameters(d)["value"] for d in (example_1(), example_2()))
        assert one.index.is_unique
        assert (one["actuator.b_r"], one["controller.law.beta"]) == (0.5, 2.5)
        assert (two["actuator.c_l"], two["controller.law.beta"]) == (-0.6, 5.0)
        assert two["controller.filtered_error.lambdas"] == (2.0, 1.0)


SIGNALS = ["y", "yd", "e", "r", "u", "v", "zeta", "delta_hat", "W_norm"]
PAPER = {2: example_1, 3: example_2}


def probe(diagram, t=0.7, params=None, **states):
    """Return outputs and derivatives by name, at a state where every term counts."""
    size = diagram.nstates
    x = nlctl.initial_state(diagram) + 0.3 + 0.1 * np.cos(np.arange(size))
    x = {**dict(zip(nlctl.state_names(diagram), x, strict=True)), **states}
    vector = nlctl.initial_state(diagram, x)
    signals = diagram.output(t, vector, [], params=params)
    slopes = diagram.dynamics(t, vector, [], params=params)
    return (
        dict(zip(diagram.output_labels, signals, strict=True)),
        dict(zip(x, slopes, strict=True)),
        x,
    )


class TestExamples:
    def test_they_go_by_the_names_of_their_diagrams(self):
        """In Python example_1, on the command line example-1."""
        for name, make in nlctl.paper.EXAMPLES.items():
            assert make().name == name
            assert nlctl.paper.named_example(name.replace("_", "-")) is make
        with pytest.raises(nlctl.errors.UnknownNameError, match="'example-3'; nearest: 'example-"):
            nlctl.paper.named_example("example-3")

    @pytest.mark.parametrize("order", PAPER)
    def test_signals(self, order):
        """No input from outside, and the documented outputs in the documented order."""
        diagram = PAPER[order]()
        assert diagram.output_labels == SIGNALS + [f"x{i + 1}" for i in range(order)]
        assert diagram.input_labels == []
        x0 = nlctl.initial_state(diagram)
        run = ct.input_output_response(diagram, np.linspace(0, 0.02, 3), 0, x0)
        first = dict(zip(diagram.output_labels, run.outputs[:, 0], strict=True))
        x1 = {2: 0.5, 3: 1.0}[order]
        assert (first["y"], first["e"], first["zeta"]) == (x1, x1, 1.0)
        assert abs(first["u"]) < 1e-14  # N(1) = 0

    def test_p1_and_phase_of_example_1(self):
        """p1 multiplies -x1; the integral phase replaces w t by the integral of w."""
        (_, base, x), (_, stiff, _) = probe(example_1()), probe(example_1(p1=0.2))
        assert stiff["plant.x2"] - base["plant.x2"] == pytest.approx(-0.4 * x["plant.x1"])
        t = 0.7
        _, integral, _ = probe(example_1(phase="integral"))
        forcing = {
            phase: (5 + 0.1 * np.cos(t)) * np.cos(phase)
            for phase in (0.5 * t + 0.1 * t * np.sin(t), 0.5 * t + 0.1 * (1 - np.cos(t)))
        }
        product, other = forcing.values()
        assert integral["plant.x2"] - base["plant.x2"] == pytest.approx(other - product)
        assert probe(example_1(phase="product"))[1] == base

    def test_lambdas_and_v0_of_example_2(self):
        """r = lambda_2 e1 + lambda_1 e2 + e3; v0 is where the memory starts."""
        (one, _, x), (two, _, _) = probe(example_2()), probe(example_2(lambdas=(1.0, 2.0)))
        yd1 = 0.5 * np.cos(0.7) + 0.25 * np.cos(0.35)
        e1, e2 = one["e"], x["plant.x2"] - yd1
        assert two["r"] - one["r"] == pytest.approx(e1 - e2)
        start = nlctl.initial_state(example_2(v0=0.4))
        index = nlctl.state_names(example_2()).index("actuator.memory")
        assert (start[index], nlctl.initial_state(example_2())[index]) == (0.4, 0.0)

    @pytest.mark.parametrize("order", PAPER)
    def test_the_layout_of_the_centres(self, order):
        """Layouts differ in u; an array is taken as it is; a grid may leave out the last states."""
        make = PAPER[order]
        values = {c: probe(make(centres=c))[0]["u"] for c in ("diagonal", "3x9", "9x3", "27")}
        assert len(set(values.values())) == 4
        array = nlctl.controllers.grid_centres([3, 9])
        assert probe(make(centres=array))[0]["u"] == values["3x9"]
        default = {2: "diagonal", 3: "3x3x3"}[order]
        assert probe(make(centres=default))[0] == probe(make())[0]

    @pytest.mark.parametrize("order", PAPER)
    def test_a_sensor_changes_what_the_controller_sees(self, order):
        """e = y + n_1 - yd with the noise of signal 1, and y itself as before."""
        takes = tuple(f"x{i + 1}" for i in range(order))
        names = {"inputs": takes, "outputs": tuple(f"{s}_measured" for s in takes)}
        sensors = (
            nlctl.references.BandLimitedNoise(**names, seed=5, rms=rms) for rms in (0.1, 0.0)
        )
        noisy, silent = (probe(PAPER[order](sensor=sensor))[0] for sensor in sensors)
        clean, _, _ = probe(PAPER[order]())
        n = nlctl.functions.band_limited(0.1, low=0, high=50, seed=[5, 0])(0.7)
        assert abs(n) > 1e-3
        assert noisy["e"] - clean["e"] == pytest.approx(n)
        assert (noisy["y"], silent) == (clean["y"], clean)

    def test_third_party_plant_and_actuator(self):
        """Somebody else's blocks take the place of ours, and keep their dict parameters."""
        plant = ct.nlsys(
            lambda t, x, u, p: [x[1], -p["stiffness"] * x[0] + u[0]],
            lambda t, x, u, p: [x[0], x[0], x[1]],
            inputs=["v"],
            outputs=["y", "x1", "x2"],
            states=["x1", "x2"],
            name="theirs",
            params={"stiffness": 4.0},
        )
        actuator = ct.nlsys(None, lambda t, x, u, p: 3 * u, inputs=["u"], outputs=["v"], name="k")
        diagram = example_1(plant=plant, actuator=actuator)
        for params, stiffness in ((None, 4.0), ({"stiffness": 7.0}, 7.0)):
            signals, slopes, x = probe(diagram, params=params)
            assert signals["v"] == pytest.approx(3 * signals["u"])
            expected = -stiffness * x["plant.x1"] + signals["v"]
            assert slopes["plant.x2"] == pytest.approx(expected)

    def test_a_controller_of_another_kind(self):
        """A PD law without adaptation: the diagram has the signals that exist."""
        law = ct.nlsys(
            None,
            lambda t, x, u, p: [u[0] - u[2], -p["kp"] * (u[0] - u[2]) - p["kd"] * (u[1] - u[3])],
            inputs=["x1", "x2", "yd", "yd1"],
            outputs=["e", "u"],
            name="pd",
            params={"kp": 10.0, "kd": 5.0},
        )
        for order, make in PAPER.items():
            diagram = make(controller=law)
            states = [f"x{i + 1}" for i in range(order)]
            assert diagram.output_labels == ["y", "yd", "e", "u", "v", *states]
            signals, _, x = probe(diagram, params={"kd": 0.0})
            assert signals["u"] == pytest.approx(-10 * (x["plant.x1"] - signals["yd"]))

    def test_actuators_change_places(self):
        """Dead zone and backlash are exchanged without a change of the controller."""
        for make, spec in ((example_1, nlctl.Backlash()), (example_2, nlctl.DeadZone())):
            usual, exchanged = probe(make())[0], probe(make(actuator=spec))[0]
            assert usual["u"] == exchanged["u"]
            assert usual["v"] != exchanged["v"]
