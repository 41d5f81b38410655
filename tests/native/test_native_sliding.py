"""Filippov's sliding motion of ideal relays: closed forms, and smaller and smaller hysteresis."""

import pickle
import re

import control as ct
import numpy as np
import pytest
from rows import each_row
from scipy.special import ber

import nlctl
from nlctl.errors import AuditError, CompileError
from nlctl.native import Status

TIMES = np.linspace(0, 10, 201)
FULLER = np.sqrt((np.sqrt(33) - 1) / 24)  # of its optimal switching curve x = -C x' |x'|


def plant(update, output, states=1, inputs=("v",)):
    return ct.nlsys(update, output, states=states, inputs=list(inputs), outputs=["u"], name="plant")


def loop(update, output, states=1, *, relay=None, **more):
    """A relay from the plant's output u to its input v, and what else is connected."""
    inputs = ["v", *(label for block in more.values() for label in block.outputs)]
    blocks = {"relay": relay or nlctl.IdealRelay(), "plant": plant(update, output, states, inputs)}
    outputs = ["u", "v"]
    return nlctl.interconnect(blocks | more, outputs=outputs)


def first(t, x, u, p):
    return x[0]


def run(system, start, times=TIMES, inputs=0, **given):
    x0 = {f"plant.x[{i}]": value for i, value in enumerate(start)}
    return nlctl.input_output_response(system, times, inputs, x0, **given)


def of_plant(made):
    return made.states[[label.startswith("plant") for label in made.state_labels]]


@nlctl.record
class StepAt:
    """0, and 1 from a time on."""

    time: float = nlctl.param(4.0, unit="s", meaning="time of the step")
    inputs, outputs, states, feedthrough = (), ("r",), (), False

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (np.where(t >= p.time, 1.0, 0.0),)

    @staticmethod
    @nlctl.equation
    def switching(t, x, u, p):
        return (t - p.time,)


@pytest.mark.parted
@pytest.mark.parametrize("method", ["tsit5", "rodas5p"])
@pytest.mark.parametrize("c", [-0.9, 0.0, 0.5])
def test_what_comes_to_the_jump_stays_with_the_output_that_holds_it(c, method):
    """x' = c - sign(x) from 1: at 0 after 1 / (1 - c), then v = c."""
    system = loop(lambda t, x, u, p: p["c"] - u[0], first)
    made = nlctl.input_output_response(
        system, TIMES, 0, {"plant.x[0]": 1.0}, params={"c": c}, method=method
    )
    after = 1 / (1 - c)
    x = np.maximum(1 - (1 - c) * TIMES, 0.0)
    np.testing.assert_allclose(made.outputs[0], x, rtol=0, atol=1e-6)
    v, beside = np.where(after > TIMES, 1.0, c), np.abs(TIMES - after) > 1e-6
    np.testing.assert_allclose(made.outputs[1, beside], v[beside], rtol=0, atol=1e-6)


def sliding_mode(t, x, u, p):
    return np.array([x[1], 0.7 * np.sin(3 * t) - u[0]])


@pytest.mark.parametrize("settings", [{}, {"method": "rodas5p"}, {"rtol": 1e-5, "atol": 1e-7}])
def test_a_sliding_mode_is_exponential_whatever_the_disturbance_is(settings):
    """x'' = d - v with u = x + x': on u = 0 x' = -x, and the equivalent control is d + x'."""
    system = loop(
        sliding_mode, lambda t, x, u, p: x[0] + x[1], 2, relay=nlctl.IdealRelay(height=2.0)
    )
    made = run(system, [1.0, 0.0], **settings)
    late = TIMES >= 3
    t, (x, rate), (u, v) = TIMES[late], of_plant(made)[:, late], made.outputs[:, late]
    rtol = settings.get("rtol", 1e-8)
    np.testing.assert_allclose(u, 0, atol=10 * rtol)
    np.testing.assert_allclose(x, x[0] * np.exp(-(t - t[0])), rtol=0, atol=10 * rtol)
    np.testing.assert_allclose(v, 0.7 * np.sin(3 * t) + rate, rtol=0, atol=100 * rtol)
    assert made.statistics.events <= 3


def test_sliding_ends_where_the_output_would_have_to_be_beyond_the_height():
    """x' = r t - v: at rest until r t = 1, then x = r (t - 1 / r)^2 / 2."""
    r = 0.4
    made = run(loop(lambda t, x, u, p: 0.4 * t - u[0], first), [0.0])
    exact = np.where(1 / r < TIMES, r * (TIMES - 1 / r) ** 2 / 2, 0.0)
    np.testing.assert_allclose(made.outputs[0], exact, rtol=0, atol=1e-7)
    np.testing.assert_allclose(made.outputs[1], np.minimum(r * TIMES, 1), rtol=0, atol=1e-7)


def test_it_slides_and_leaves_again_and_again():
    """x' = A sin(t) - v is play: it moves A (cos a - cos t) - (t - a) from where A sin(a) = 1."""
    A, period = 1.5, 2 * np.pi
    times = np.linspace(0, 3 * period, 601)
    made = run(loop(lambda t, x, u, p: 1.5 * np.sin(t) - u[0], first), [0.0], times)
    begin = np.arcsin(1 / A)
    moved = np.maximum(A * (np.cos(begin) - np.cos(times)) - (times - begin), 0.0)
    here = (times >= begin) & (times <= np.pi)
    np.testing.assert_allclose(made.outputs[0, here], moved[here], rtol=0, atol=1e-6)
    odd = made.outputs[0, 20:501] + made.outputs[0, 120:]  # half a period later the other way
    np.testing.assert_allclose(odd, 0, atol=1e-5)
    assert np.sum(np.abs(made.outputs[0]) < 1e-6) > 60


def test_it_converges_with_the_order_of_the_method_where_it_slides():
    """x' = y, u = y + sin(x): on u = 0 tan(x / 2) falls as exp(-t)."""
    system = loop(
        lambda t, x, u, p: np.array([x[1], 0.5 * np.cos(x[0]) - 3 * u[0]]),
        lambda t, x, u, p: x[1] + np.sin(x[0]),
        2,
    )
    exact = 2 * np.arctan(np.tan(0.5) * np.exp(-2.0))
    steps = np.array([0.2, 0.1, 0.05])
    errors = [
        abs(of_plant(run(system, [1.0, -np.sin(1.0)], [0.0, 2.0], step=h))[0, -1] - exact)
        for h in steps
    ]
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(order > 4.5)
    assert np.all(errors < 0.01 * steps**5)


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_a_hysteresis_converges_to_it_with_its_width(seed):
    """Planar systems x' = A x + d - b v, u = c x with c b > 0, at random: apart by O(width)."""
    rng = np.random.default_rng(seed)
    A, d = rng.normal(size=(2, 2)) - np.eye(2), 0.2 * rng.normal(size=2)
    c = rng.normal(size=2)
    b = c / (c @ c) + 0.5 * rng.normal() * np.array([-c[1], c[0]])
    system = ct.ss(A, np.column_stack([-b, d]), c[None, :], 0, inputs=["v", "one"], outputs=["u"])
    one = ct.nlsys(None, lambda t, x, u, p: 1.0, inputs=0, outputs=["one"], name="one")
    times = np.linspace(0, 3, 31)

    def path(relay):
        made = nlctl.interconnect({"relay": relay, "plant": system, "one": one}, outputs=["u"])
        return of_plant(run(made, [1.0, -0.5], times))

    ideal = path(nlctl.IdealRelay(height=2.0))
    sizes = np.array([1e-2, 1e-3])
    apart = [np.abs(path(nlctl.Relay(on=h, off=-h, height=2.0)) - ideal).max() for h in sizes]
    assert np.all(np.array(apart) <= 10 * sizes * np.linalg.norm(b))
    assert apart[1] < apart[0] / 4


@pytest.mark.parted
@pytest.mark.ci
@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_what_holds_of_every_relay(order):
    """Random linear plants and disturbances, u held to and pushed off 0: what v and u may be."""
    wave = ct.nlsys(
        None, lambda t, x, u, p: np.sin(p["f"] * t), inputs=0, outputs=["w"], name="wave",
        params={"f": 1.0},
    )  # fmt: skip
    slid = 0
    for seed in range(8):
        rng = np.random.default_rng([order, seed])
        A = rng.normal(size=(order, order)) - 0.8 * np.eye(order)
        b, c, d = rng.normal(size=(3, order))
        b *= np.sign(c @ b) if seed % 4 else 1.0
        system = ct.ss(
            A, np.column_stack([-b, d]), c[None, :], 0, inputs=["v", "w"], outputs=["u"],
            name="plant",
        )  # fmt: skip
        made = nlctl.interconnect(
            {"relay": nlctl.IdealRelay(), "wave": wave, "plant": system}, outputs=["u", "v"]
        )
        method = ("tsit5", "rodas5p", "auto")[seed % 3]
        found = run(made, rng.normal(size=order), params={"f": rng.uniform(0.5, 4)}, method=method)
        mode, (u, v) = found.states[0], found.outputs
        slid += np.sum(mode == 0)
        assert np.all(np.abs(v) <= 1 + 1e-6)
        assert np.all(v[mode != 0] == mode[mode != 0])
        assert np.all(np.abs(u[mode == 0]) <= 1e-6)
        assert np.all(mode * u >= -1e-7)
    assert slid > 50


def test_friction_on_a_belt_is_that_of_stick_and_slip():
    """x'' = -x - F(x' - belt): it sticks up to the force F, then slips, and sticks for good."""

    def moved(t, x, u, p):
        return np.array([x[1], -x[0] - u[0]])

    slides = run(
        loop(moved, lambda t, x, u, p: x[1] - 0.3, 2, relay=nlctl.IdealRelay(height=1.0)),
        [0.0, 0.0],
    )
    body = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], -x[0] - u[0]]),
        lambda t, x, u, p: np.array([x[1] - 0.3, -x[0]]),
        states=2, inputs=["force"], outputs=["velocity", "applied"], name="plant",
    )  # fmt: skip
    friction = nlctl.actuators.StickSlip(F_c=1.0, F_s=1.0, sigma_2=0.0, v0=-1.0)
    sticks = run(nlctl.interconnect({"friction": friction, "plant": body}), [0.0, 0.0])
    np.testing.assert_allclose(of_plant(slides), of_plant(sticks), rtol=0, atol=1e-6)
    assert np.sum(np.abs(slides.outputs[0]) < 1e-7) > 10  # it has stuck for a while


def test_fullers_problem_ends_as_chattering():
    """Relative degree two on a curve that it reaches by ever shorter arcs; closed-form end."""
    system = loop(
        lambda t, x, u, p: np.array([x[1], -u[0]]),
        lambda t, x, u, p: x[0] + FULLER * x[1] * abs(x[1]),
        2,
    )
    made = run(system, [1.0, 0.0], ignore_errors=True)
    start = np.sqrt(2 / (1 + 2 * FULLER))
    ratio = np.sqrt((1 - 2 * FULLER) / (1 + 2 * FULLER))
    assert made.statistics.status is Status.CHATTERING
    end = start + start * (1 + ratio) / (1 - ratio)
    assert made.statistics.time == pytest.approx(end, abs=1e-3)
    told = re.search(
        r"the switches of block 'relay' .*accumulate near t = ([\d.]+) s", made.message
    )
    assert float(told[1]) == pytest.approx(end, abs=1e-4)


def test_with_relative_degree_two_it_switches():
    """x'' = -sign(x): parabolas |x| + x'^2 / 2 = 1."""
    made = run(loop(lambda t, x, u, p: np.array([x[1], -u[0]]), first, 2), [1.0, 0.0])
    x, rate = of_plant(made)
    np.testing.assert_allclose(np.abs(x) + rate**2 / 2, 1, rtol=0, atol=1e-5)
    assert made.statistics.events >= 4


class TestJumps:
    """u = x - r with a step of r while it slides: x goes after it at 1 + 1/2."""

    exact = np.where(TIMES < 4, np.maximum(1 - TIMES / 2, 0), np.minimum(1.5 * (TIMES - 4), 1))

    def test_a_reference_that_jumps_ends_the_sliding(self):
        system = loop(lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0] - u[1], step=StepAt())
        np.testing.assert_allclose(of_plant(run(system, [1.0]))[0], self.exact, rtol=0, atol=1e-6)

    def test_so_does_a_held_signal(self):
        """Sampled every second, from the diagram's input."""
        gain = nlctl.block(nlctl.Saturation(limit=9.0), "hold")
        hold = nlctl.sampled(gain, 1.0)
        hold = hold.copy(name="hold")
        blocks = {
            "hold": hold,
            "relay": nlctl.IdealRelay(),
            "plant": plant(
                lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0] - u[1], 1, ("v", "r")
            ),
        }
        system = ct.interconnect(
            [nlctl.diagrams.connecting.as_system(one, name) for name, one in blocks.items()],
            connections=[["relay.u", "plant.u"], ["plant.v", "relay.v"], ["plant.r", "hold.v"]],
            inplist=["hold.u"], inputs=["u"], outlist=["plant.u"], outputs=["e"],
        )  # fmt: skip
        made = nlctl.input_output_response(
            system, TIMES, np.where(TIMES > 3.5, 1.0, 0.0), {"plant.x[0]": 1.0}
        )
        np.testing.assert_allclose(of_plant(made)[0], self.exact, rtol=0, atol=1e-6)


def one_way(t, x, u, p):
    return np.array([0.3 - u[0] - 0.4 * u[1], 0.2 * np.cos(t) - u[1]])


def both_ways(t, x, u, p):
    return np.array([0.3 - u[0] - 0.4 * u[1], 0.2 * np.cos(t) - u[1] - 0.1 * u[0]])


def by_product(t, x, u, p):
    return np.array([0.3 - u[0] - 0.4 * u[1], 0.2 * np.cos(t) - u[1] - 0.1 * u[0] * u[1]])


def cascade(update):
    """Two integrators with a relay each; the second relay acts on the first one, too."""
    names = {"inputs": ["v1", "v2"], "outputs": ["u1", "u2"], "name": "plant", "states": 2}
    middle = ct.nlsys(update, lambda t, x, u, p: x, **names)
    relays = [nlctl.block(nlctl.IdealRelay(), name) for name in ("r1", "r2")]
    wires = [[f"r{k}.u", f"plant.u{k}"] for k in (1, 2)] + [
        [f"plant.v{k}", f"r{k}.v"] for k in (1, 2)
    ]
    return ct.interconnect(
        [*relays, middle], connections=wires, inplist=[], outlist=["r1.v", "r2.v"],
        outputs=["v1", "v2"],
    )  # fmt: skip


def test_two_relays_slide_at_once_where_one_acts_on_the_other():
    """v2 = 0.2 cos t and v1 = 0.3 - 0.4 v2."""
    v1, v2 = run(cascade(one_way), [1.0, -1.5]).outputs[:, TIMES > 5]
    t = TIMES[TIMES > 5]
    np.testing.assert_allclose(v2, 0.2 * np.cos(t), rtol=0, atol=1e-7)
    np.testing.assert_allclose(v1, 0.3 - 0.08 * np.cos(t), rtol=0, atol=1e-7)


def test_two_that_act_on_each_other_keep_both_inputs():
    """v1 + 0.4 v2 = 0.3 and 0.1 v1 + v2 = 0.2 cos t."""
    outputs = run(cascade(both_ways), [1.0, -1.5]).outputs[:, TIMES > 5]
    given = np.array([np.full(outputs.shape[1], 0.3), 0.2 * np.cos(TIMES[TIMES > 5])])
    expected = np.linalg.solve([[1.0, 0.4], [0.1, 1.0]], given)
    np.testing.assert_allclose(outputs, expected, rtol=0, atol=1e-7)


def test_two_that_act_on_each_other_otherwise_are_refused():
    with pytest.raises(CompileError, match="relays 'r1', 'r2' act on the rates of each other's"):
        nlctl.compile(cascade(by_product))


@each_row(
    ("update", "output", "told"),
    [
        (lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0] + u[0], "jumps with it"),
        (lambda t, x, u, p: 0.5 - u[0] ** 3, first, r"does not enter the rate u' .* as a \+ b v"),
        (lambda t, x, u, p: 0.5 - np.floor(u[0]), first, "does not enter the rate"),
        (lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: ber(x[0]), "is called unchanged"),
        (lambda t, x, u, p: ber(x[0]) - u[0], first, "has no rate"),
    ],
)  # fmt: skip
def test_what_has_no_rate_is_refused(update, output, told):
    """At once, with advice, and without another engine taking over."""
    with pytest.raises(
        CompileError, match=rf"ideal relay 'relay' .*{told}.*nlctl\.Relay"
    ) as caught:
        run(loop(update, output), [1.0])
    assert "hysteresis" in str(caught.value)


def follower(*more, inputs=("r",), relay=None):
    """x' = 1/2 - v, and the relay sees u = x - r, where r comes from outside."""
    follows = plant(lambda t, x, u, p: 0.5 - u[0], lambda t, x, u, p: x[0] - u[1], 1, ("v", "r"))
    blocks = [nlctl.block(relay or nlctl.IdealRelay(height=3.0), "relay"), follows, *more]
    return nlctl.interconnect(blocks, inputs=list(inputs), outputs=["u", "v"])


CORNERS = np.array([0.0, 2.0, 3.0, 4.0, 5.5, 7.0, 10.0])
POLYGON = np.array([0.0, 0.4, 0.4, -0.3, 2.0, 2.0, 1.0])


class TestInputsOfTheDiagram:
    """They are linear between the times of a run, and have known rates there."""

    @pytest.mark.parametrize("method", ["tsit5", "rodas5p", "auto"])
    def test_what_slides_follows_a_polygon(self, method):
        """From 1, at -5/2, until x = 0.2 t at t = 1 / 2.7: then x = r and v = 1/2 - r'."""
        r = np.interp(TIMES, CORNERS, POLYGON)
        made = nlctl.input_output_response(
            follower(), TIMES, r, {"plant.x[0]": 1.0}, method=method, audit="every run"
        )
        late = TIMES > 0.5
        np.testing.assert_allclose(of_plant(made)[0, late], r[late], rtol=0, atol=1e-6)
        slope = (np.diff(POLYGON) / np.diff(CORNERS))[
            np.clip(np.searchsorted(CORNERS, TIMES, side="right") - 1, 0, CORNERS.size - 2)
        ]
        np.testing.assert_allclose(made.outputs[1, late], 0.5 - slope[late], rtol=0, atol=1e-6)
        assert made.statistics.events == 1

    def test_what_is_too_fast_is_left_and_caught_up_with(self):
        """A height of 1 rises at 3/2 at most, and r at 23/15 from t = 4 to 5.5."""
        r = np.interp(TIMES, [0, 4, 5.5, 10], [0, 0, 2.3, 2.3])
        made = nlctl.input_output_response(
            follower(relay=nlctl.IdealRelay()), TIMES, r, {"plant.x[0]": 0.0}
        )
        exact = np.clip(1.5 * (TIMES - 4), 0, 2.3)
        np.testing.assert_allclose(of_plant(made)[0], exact, rtol=0, atol=1e-6)

    @pytest.mark.parted
    @pytest.mark.slow
    @pytest.mark.parametrize("seed", range(6))
    def test_a_hysteresis_converges_to_it(self, seed):
        """With random corners, at random times, beside a delayed signal that the plant sees."""
        rng = np.random.default_rng(seed)
        times = np.cumsum(np.append(0.0, rng.uniform(0.1, 0.5, 12)))
        r = np.cumsum(rng.normal(size=times.size)) * 0.4
        line = nlctl.block(
            nlctl.TransportDelay(inputs=("u",), outputs=("late",), delay=0.3), "line"
        )
        body = plant(
            lambda t, x, u, p: 0.5 - u[0] + 0.4 * u[2], lambda t, x, u, p: x[0] - np.sin(u[1]), 1,
            ("v", "r", "late"),
        )  # fmt: skip
        paths = []
        for relay in (nlctl.IdealRelay(height=2.0), nlctl.Relay(on=1e-4, off=-1e-4, height=2.0)):
            loop = nlctl.interconnect(
                [nlctl.block(relay, "relay"), body, line], inputs=["r"], outputs=["u"]
            )
            made = nlctl.input_output_response(
                loop, times[:6], r[:6], {"plant.x[0]": 0.5}, rtol=1e-7, atol=1e-9
            )
            paths.append(of_plant(made))
        np.testing.assert_allclose(paths[0], paths[1], rtol=0, atol=1e-3)

    def test_members_are_single_runs_in_any_company(self):
        """Of any number of threads, from a pickle, resumed at a corner of the input."""
        loop = nlctl.compile(follower())
        again = pickle.loads(pickle.dumps(loop))
        r, starts = np.interp(TIMES, CORNERS, POLYGON), {"plant.x[0]": np.linspace(-1, 1, 11)}
        made = [
            nlctl.ensemble_response(one, TIMES, r, starts, keep=["u", "v"], threads=threads)
            for one, threads in ((loop, 1), (loop, 2), (again, 1))
        ]
        for other in made[1:]:
            for signal in ("u", "v"):
                np.testing.assert_array_equal(other.signals[signal], made[0].signals[signal])
        whole = run(loop.system, [1.0], inputs=r)
        first = run(loop.system, [1.0], TIMES[:61], inputs=r[:61])
        rest = nlctl.input_output_response(loop, TIMES[60:], r[60:], first.states[:, -1])
        np.testing.assert_allclose(rest.states, whole.states[:, 60:], rtol=0, atol=1e-9)

    def test_it_has_no_linearization_by_them_alone(self):
        """v has a share of r' in it, which is no input of a state-space system."""
        with pytest.raises(CompileError, match="by its inputs: an ideal relay slides as their rat"):
            nlctl.linearize(follower(), 0, 0)
        inside = ct.ss(-1, 1, 1, 0, inputs=["w"], outputs=["r"], name="lag")
        assert nlctl.linearize(follower(inside, inputs=("w",)), 0, 0).B.shape == (3, 1)


def test_a_delayed_input_is_refused():
    """Its rate is not known; behind a lag it is taken."""
    delay = nlctl.block(nlctl.TransportDelay(inputs=("w",), outputs=("r",), delay=0.1), "delay")
    with pytest.raises(CompileError, match="depends on a delayed signal at the same instant"):
        nlctl.compile(follower(delay, inputs=("w",)))
    delay = nlctl.block(nlctl.TransportDelay(inputs=("w",), outputs=("l",), delay=0.1), "delay")
    lag = ct.ss(-1, 1, 1, 0, inputs=["l"], outputs=["r"], name="lag")
    made = nlctl.input_output_response(follower(delay, lag, inputs=("w",)), TIMES, 1.0, 0)
    late = np.maximum(TIMES - 0.1, 0)
    np.testing.assert_allclose(of_plant(made)[0], 1 - np.exp(-late), rtol=0, atol=1e-6)


FAULTS = {
    "a bias of what it sees": nlctl.Fault("relay.u", "bias", 0.3, at=1.7),
    "a drift of what it sees": nlctl.Fault("relay.u", "drift", 0.2, at=1.7),
    "noise": nlctl.Fault("relay.u", "noise", 0.1, at=1.7),
    "less effect, enough": nlctl.Fault("relay.v", "gain", 0.5, at=1.7),
    "less effect, too little": nlctl.Fault("relay.v", "gain", 0.2, at=1.7),
    "a stuck output": nlctl.Fault("relay.v", "stuck", 0.4, at=1.7),
    "a dropout": nlctl.Fault("relay.v", "dropout", at=1.7, until=2.3),
    "a condition": nlctl.Fault("relay.v", "bias", 0.3, when="u < 0.2"),
}


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS.values(), ids=FAULTS)
def test_faults_of_its_signals_are_those_of_a_narrow_hysteresis(fault):
    """To its width, alone."""
    times, paths = np.linspace(0, 3, 31), []
    for relay in (nlctl.IdealRelay(height=2.0), nlctl.Relay(on=1e-3, off=-1e-3, height=2.0)):
        system = loop(sliding_mode, lambda t, x, u, p: x[0] + x[1], 2, relay=relay)
        paths.append(of_plant(run(nlctl.with_faults(system, fault), [1.0, 0.0], times)))
    np.testing.assert_allclose(paths[0], paths[1], rtol=0, atol=3e-3)


def test_python_control_does_not_run_it_wrongly():
    """No engine of its own may switch where nobody looks."""
    system = loop(lambda t, x, u, p: 0.5 - u[0], first)
    for asked in (
        lambda: nlctl.input_output_response(system, TIMES, 0, 0, engine="python-control"),
        lambda: ct.input_output_response(system, TIMES, 0),
        lambda: ct.linearize(system, [0.0, 0.0], []),
    ):
        with pytest.raises(
            nlctl.errors.UsageError, match=r"'relay' is an ideal relay.*nlctl\.Relay"
        ):
            asked()


def test_a_relay_that_is_sampled_or_stands_twice_is_refused():
    relay = nlctl.block(nlctl.IdealRelay(), "relay")
    with pytest.raises(nlctl.errors.ParameterError, match="has a memory, 'mode'"):
        nlctl.sampled(relay, 0.1, method="euler")
    ends = {"inplist": ["relay.u"], "outlist": ["relay.v"], "check_unused": False}
    inner = ct.interconnect([relay], name="inner", **ends)
    twice = ct.interconnect([relay, inner], name="outer", **ends)
    with pytest.raises(nlctl.errors.DiagramError, match="stands in 'outer' twice"):
        nlctl.compile(twice)


def test_a_delayed_signal_may_reach_the_rate():
    """x' = w(t - 1) - v with w = sin(t) / 2, and 0 before: v = sin(t - 1) / 2 from t = 1 on."""
    wave = ct.nlsys(None, lambda t, x, u, p: 0.5 * np.sin(t), inputs=0, outputs=["w"], name="wave")
    delay = nlctl.TransportDelay(inputs=("w",), outputs=("late",), delay=1.0)
    follows = plant(lambda t, x, u, p: u[1] - u[0], first, 1, ("v", "late"))
    blocks = {"wave": wave, "delay": delay, "relay": nlctl.IdealRelay(), "plant": follows}
    made = run(nlctl.interconnect(blocks, outputs=["u", "v"]), [0.0])
    exact = np.where(TIMES > 1, 0.5 * np.sin(TIMES - 1), 0.0)
    np.testing.assert_allclose(made.outputs[0], 0, atol=1e-7)
    np.testing.assert_allclose(made.outputs[1], exact, rtol=0, atol=1e-6)


def looped(law):
    """x' = 1/2 - v + w / 10 with w solved for in a loop: w = law(w, u, v)."""
    static = ct.nlsys(None, law, inputs=["w", "u", "v"], outputs=["w"], name="static")
    middle = plant(lambda t, x, u, p: 0.5 - u[0] + 0.1 * u[1], first, 1, ("v", "w"))
    blocks = {"relay": nlctl.IdealRelay(), "plant": middle, "static": static}
    return nlctl.compile(
        nlctl.interconnect(blocks, outputs=["u", "v", "w"]), algebraic_loops="solve"
    )


def test_an_algebraic_loop_beside_it_is_solved_and_one_through_it_refused():
    """w = tanh(w + x + 1) / 2; on x = 0 v = 1/2 + w / 10."""
    made = run(looped(lambda t, x, u, p: 0.5 * np.tanh(u[0] + u[1] + 1)), [1.0])
    u, v, w = made.outputs[:, -1]
    assert abs(u) < 1e-8
    assert w == pytest.approx(0.5 * np.tanh(w + u + 1), abs=1e-12)
    assert v == pytest.approx(0.5 + 0.1 * w, abs=1e-7)
    with pytest.raises(CompileError, match="in an algebraic loop"):
        looped(lambda t, x, u, p: 0.5 * np.tanh(u[0] + u[2] + 1))


def test_where_both_sides_lead_away_it_goes_on():
    """x' = 1/4 + sign(x): up from above 0, down from below."""
    system = loop(lambda t, x, u, p: 0.25 + u[0], first)
    for start in (1e-3, -1e-3):
        x = of_plant(run(system, [start], [0.0, 1.0]))[0, -1]
        assert x == pytest.approx(start + 0.25 + np.sign(start), abs=1e-9)


def test_nan_travels():
    """Through every equation: an undefined rate or input is no side, and no sliding."""
    spec, p = nlctl.IdealRelay(), nlctl.params.equation_arguments(nlctl.IdealRelay())
    for i in range(3):
        u = np.where(np.arange(3) == i, np.nan, [0.0, 0.2, -1.0])
        assert np.isnan(spec.commit(0.0, (1.0,), u, p)).all()
        assert np.isnan(spec.output(0.0, (0.0,), u, p)).all()
    assert np.isnan(spec.output(0.0, (np.nan,), (0.0, 0.2, -1.0), p)).all()


@nlctl.record
class Wrong(nlctl.IdealRelay):
    """An ideal relay that does not keep its input where it is."""

    @staticmethod
    @nlctl.equation
    def output(t, x, u, p):
        return (np.where(x[0] == 0, 0.1 - u[1] / u[2], p.height * x[0]),)


def test_the_audit_sees_an_output_that_does_not_hold():
    """Against python-control's own rates."""
    system = loop(lambda t, x, u, p: 0.5 - u[0], first, relay=Wrong())
    with pytest.raises(AuditError, match=r"relay 'relay' slides with an output of 0\.6"):
        run(system, [0.0], [0.0, 1e-7])


def test_the_linearization_where_it_slides_is_that_of_the_sliding_motion():
    """Of x'' = -v with u = c x + x': eigenvalues -c, the relay's rate, and 0 of its mode."""
    system = loop(
        lambda t, x, u, p: np.array([x[1], -u[0]]), lambda t, x, u, p: 2 * x[0] + x[1], 2,
        relay=nlctl.IdealRelay(rate=5.0), more=nlctl.FilteredStep(order=0),
    )  # fmt: skip
    found = nlctl.compile(system).linearize(np.zeros(system.nstates)).A
    assert {-2.0, -5.0, 0.0} <= set(np.linalg.eigvals(found).round(9).real)


def test_members_of_an_ensemble_slide_as_they_do_alone():
    """x' = 1/2 - v from 1 for nine heights: those above 1/2 come to rest."""
    compiled = nlctl.compile(loop(lambda t, x, u, p: 0.5 - u[0], first))
    heights, start = np.linspace(0.2, 2.0, 10), {"plant.x[0]": 1.0}

    def inputs(values):
        made = nlctl.ensemble_response(
            compiled, TIMES, 0, start, params={"relay.height": values}, keep=["u"]
        )
        return made.signals["u"]

    u = inputs(heights)
    exact = 1 + np.multiply.outer(0.5 - heights, TIMES)
    exact = np.where(heights[:, None] > 0.5, np.maximum(exact, 0), exact)
    np.testing.assert_allclose(u, exact, rtol=0, atol=1e-6)
    for k in (0, 9):
        np.testing.assert_array_equal(u[k], inputs(heights[k : k + 1])[0])
