"""The constants of the proof for whole loops, against their formulas and an independent audit."""

import functools

import numpy as np
import pytest

import nlctl
from nlctl.analysis.intervals.box import Box, visited_box
from nlctl.analysis.lyapunov.bounds.decomposition import DecompositionError
from nlctl.analysis.lyapunov.constants import constants, disturbance, kappa
from nlctl.errors import DiagramError, ParameterError, UnknownNameError

BOX_1 = Box.of(x1=(-0.85, 1.0), x2=(-0.55, 1.1), v=(-12, 6))
BOX_2 = Box.of(x1=(-0.85, 1.1), x2=(-0.55, 0.75), x3=(-0.6, 0.6), v=(-2.5, 4.5))
AUDIT = {  # an independent computation: eps*, |W|, delta*, alpha_0, V(0), C_0 with Q = 0
    (1, "diagonal"): (0.45861, 0.529, 6.6376, 11.454, 14.965, 11.026),
    (1, "9x3"): (0.58261, 0.987, 6.7616, 12.050, 16.215, 11.350),
    (2, "diagonal"): (5.4462, 4.327, 9.0382, 16.320, 52.885, 17.983),
    (2, "3x3x3"): (8.5241, 0.129, 12.116, 23.709, 61.308, 20.946),
}


def example(number, **choices):
    return getattr(nlctl.paper, f"example_{number}")(**choices)


@functools.cache
def of_example(number, layout):
    return constants(example(number, centres=layout), BOX_1 if number == 1 else BOX_2)


@functools.cache
def given_weights():
    """Example 1 with W = 0: no convex programme, so cheap."""
    return constants(example(1), BOX_1, W=np.zeros(27))


@pytest.mark.slow
@pytest.mark.parametrize(("number", "layout"), AUDIT)
def test_the_constants_agree_with_the_audit(number, layout):
    """To the tolerance of eps*, 1e-3, which every later constant inherits."""
    found = of_example(number, layout)
    symbols = ("eps*", "|W|", "delta*", "alpha_0", "V(0)", "C_0")
    values = [found[symbol] for symbol in symbols]
    assert values == pytest.approx(AUDIT[number, layout], rel=2e-3, abs=1e-3)
    assert found["alpha_1"] == {1: 0.25, 2: 0.15}[number]


def test_the_smooth_sign_inequality_is_proved():
    """(29), and it is tight: 0.2784 would not do, nor does s = 1.2 leave more than 1e-3."""
    proof = kappa()
    assert proof.holds
    assert proof.boxes < 1000
    s = np.linspace(0, 10, 100_001)
    assert 0.2784 < np.max(s - s * np.tanh(s)) < 0.2785


def test_the_formulas_join_the_constants():
    """(20), (31), (21), (36) in plain floats give what is tabulated, rounded up."""
    c, g = given_weights(), given_weights().parts.gains
    delta = c["G_max"] * c["eps_u*"] + c["d*"] + c["eps*"]
    a_0 = 0.2785 * g.tau * delta + g.sigma_2 * delta**2 / 2
    V_0 = g.r_0**2 / 2 + delta**2 / (2 * g.gamma)
    assert c["delta*"] == pytest.approx(delta, rel=1e-12)
    assert c["alpha_0"] == pytest.approx(a_0, rel=1e-9)
    assert c["V(0)"] == pytest.approx(V_0, rel=1e-9)
    for Q in (0.0, 0.4):
        C_0 = np.sqrt(2 * (a_0 / c["alpha_1"] + V_0 + Q))
        assert c.C_0(Q) == pytest.approx(C_0, rel=1e-9)
        assert c.C_0(Q) >= C_0 * (1 - 1e-15)
    assert c.ultimate() == pytest.approx(np.sqrt(2 * a_0 / c["alpha_1"]), rel=1e-9)
    assert given_weights().C_0() == given_weights()["C_0"]


@pytest.mark.slow
def test_the_tightest_weights_beat_none():
    """The bound holds for every W, so the best of them is a choice."""
    assert of_example(1, "diagonal")["C_0"] < given_weights()["C_0"]


def test_the_forcing_of_example_1_counts_as_disturbance():
    """d* = 5.1 + 0.1 max |x|^2: q cos(w t) is not a function of x."""
    corner = 1.0**2 + 1.1**2
    assert given_weights()["d*"] == pytest.approx(5.1 + 0.1 * corner, abs=1e-6)


def test_a_disturbance_over_a_finite_time_is_no_larger():
    """Over 2 s the forcing and d have not met their worst phases together."""
    box = BOX_1.only("x1", "x2")
    finite, always = (
        disturbance(nlctl.plants.ForcedDuffing(), box, (0, end), tol=1e-2) for end in (2.0, np.inf)
    )
    assert finite.magnitude <= always.magnitude
    assert finite.low > always.low


def test_parameters_and_initial_states_of_a_run_are_read():
    """Qualified overrides reach the formulas."""
    c = constants(
        example(1),
        BOX_1,
        W=np.zeros(27),
        params={"law.beta": 0.05, "robust.tau": 0.1},
        start={"plant.x2": 0.4},
    )
    assert c["alpha_1"] == 0.1  # 2 beta is now the smallest
    assert c.parts.gains.tau == 0.1
    reference = 0.5 * (1 + 0.5)  # yd'(0); yd(0) = 0, so r(0) = 1.5 e_1 + e_2
    assert c.parts.gains.r_0 == pytest.approx(1.5 * 0.5 + 0.4 - reference)


def test_without_sigma_modification_there_is_no_bound():
    """sigma_2 = 0 makes alpha_1 = 0 and C_0 infinite."""
    c = constants(example(1), BOX_1, W=np.zeros(27), params={"robust.sigma_2": 0.0})
    assert c["alpha_1"] == 0
    assert c["C_0"] == np.inf
    assert c.ultimate() == np.inf


def test_a_network_may_be_left_out():
    """W_hat vanishes from V and its rate sigma_1 Gamma from alpha_1; eps* is sup |g|."""
    silent = nlctl.controllers.Zero(outputs=("W_psi", "W_norm"))
    c = constants(example(1, controller=nlctl.adaptive_neural(2, weights=silent)), BOX_1)
    assert c.W.size == 0
    assert c["eps*"] == pytest.approx(given_weights()["eps*"], abs=1e-3)
    assert c["alpha_1"] == 0.5 * 1.5 > given_weights()["alpha_1"]
    assert c["alpha_0"] == pytest.approx(given_weights()["alpha_0"], rel=1e-3)


@pytest.mark.slow
def test_the_actuator_s_split_is_a_choice():
    """A lower k_1 lowers eps_u* and with it every bound."""
    c = constants(example(1), BOX_1, W=np.zeros(27), k=(0.6, 1.3))
    assert c["eps_u*"] == pytest.approx(0.3, abs=2e-4)
    assert c["C_0"] < given_weights()["C_0"]


def test_every_constant_tells_where_it_comes_from():
    """Provenance, method and set stand in the table and in print."""
    c = given_weights()
    table = c.table()
    assert set(table["provenance"]) <= {"proved", "computed", "sampled", "given"}
    assert (table[["how", "over", "unit"]] != "").all(axis=None)
    proved = table.index[table["provenance"] == "proved"]
    assert {"m1", "m2", "m3", "m4", "G_max", "d*", "eps*"} <= set(proved)
    assert table.loc["|W|", "provenance"] == "given"
    assert all(symbol in str(c) for symbol in table.index)
    with pytest.raises(UnknownNameError, match=r"delta\*"):
        c["delta"]


@pytest.mark.weekly
def test_what_could_not_be_bounded_is_not_called_proved():
    """A gain that grows with v has no sector over all v."""
    plant = nlctl.PureFeedback(order=2, f=hardening)
    c = constants(example(1, plant=plant), Box.of(x1=(-1, 1), x2=(-1, 1)), W=np.zeros(27))
    assert c["G_max"] == np.inf
    assert c["C_0"] == np.inf
    assert c.table().loc["G_max", "provenance"] == "undecided"


@nlctl.equation
def hardening(x, v):
    return -x[0] - x[1] + v + v * v * v


def test_a_visited_box_contains_what_was_visited():
    """Every sample lies inside; the box says that it is sampled."""
    response = nlctl.input_output_response(example(1), np.linspace(0, 0.5, 51))
    box = visited_box(response, margin=0.05)
    assert box.provenance == "sampled"
    assert "5 % more" in str(box)
    for name in ("x1", "x2", "u", "v"):
        y = response.outputs[response.output_labels.index(name)]
        low, high = box[name]
        assert high - low == pytest.approx(1.1 * np.ptp(y))
        assert low < y.min() < y.max() < high
    x1 = response.outputs[response.output_labels.index("x1")]
    bare = visited_box(response, response, margin=0)
    assert bare.low[bare.names.index("x1")] == x1.min()
    with pytest.raises(ParameterError, match="margin"):
        visited_box(response, margin=-1)


def test_a_loop_outside_the_proof_is_refused_by_name():
    """A sensor, no robust term, a third-party diagram, saturation."""
    with pytest.raises(DiagramError, match="block 'sensor'"):
        constants(example(1, sensor=nlctl.references.BandLimitedNoise()), BOX_1)
    silent = nlctl.controllers.Zero(outputs=("robust", "delta_hat"))
    with pytest.raises(
        DiagramError, match=r"needs gamma, sigma_2, tau of block 'controller.robust'"
    ):
        constants(example(1, controller=nlctl.adaptive_neural(2, robust=silent)), BOX_1)
    plant_alone = nlctl.interconnect({"plant": nlctl.plants.ForcedDuffing()}, inputs=["v"])
    with pytest.raises(DiagramError, match="output r"):
        constants(plant_alone, BOX_1)
    with pytest.raises(DecompositionError, match="Limiter has no known split"):
        constants(example(1, actuator=Limiter()), BOX_1)


@nlctl.record
class Limiter:
    inputs, outputs, states, feedthrough = ("u",), ("v",), (), True

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (np.tanh(u[0]),)


def test_a_box_and_weights_that_do_not_fit_are_refused():
    """A side for every state, a weight for every node."""
    with pytest.raises(UnknownNameError, match="x2"):
        constants(example(1), Box.of(x1=(0, 1), v=(0, 1)))
    with pytest.raises(ParameterError, match=r"W of shape \(27,\), got \(3,\)"):
        constants(example(1), BOX_1, W=np.zeros(3))


def test_the_chirp_and_the_bounded_phase_share_all_constants_but_none_of_time():
    """d* for all time takes the worst phase, so both readings have the same."""
    other = constants(example(1, phase="integral"), BOX_1, W=np.zeros(27))
    assert other["d*"] == pytest.approx(given_weights()["d*"], abs=1e-9)
