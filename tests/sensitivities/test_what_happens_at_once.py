"""Two things at one instant, ticks of clocks among them: by what there are derivatives."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import block, integral

import nlctl


def sampled(law, params, inputs=("x",), dt=0.5):
    rule = ct.nlsys(
        None, law, inputs=list(inputs), outputs=["u"], params=params, dt=dt, name="law"
    )  # fmt: skip
    return nlctl.sampled(rule)


def moving(rate, inputs, params=None):
    return ct.nlsys(
        rate, lambda t, x, u, p: [x[0]], inputs=list(inputs), outputs=["x"], states=["x"],
        params=params or {}, name="plant",
    )  # fmt: skip


def step(name, at, out="d"):
    return nlctl.block(nlctl.Step(t_step=at, height=2.0), name, outputs=[out])


def test_two_steps():
    """x' = a + b, both from t = 1 on: by one height it is t - 1, by one time there is none."""
    parts = {"one": step("one", 1.0, "a"), "two": step("two", 1.0, "b")}
    plant = moving(lambda t, x, u, p: [u[0] + u[1]], "ab")
    loop = nlctl.interconnect(parts | {"plant": plant}, outputs=["x"])
    made = nlctl.sensitivity_response(
        loop, [0, 0.5, 3], with_respect_to=["one.height", "one.t_step"]
    )
    assert made["x", "one.height"] == pytest.approx([0, 0, 2])
    assert np.array_equal(np.isnan(made["x", "one.t_step"]), [False, False, True])
    (lack,) = made.missing
    assert (lack.with_respect_to, lack.time) == (("one.t_step",), pytest.approx(1.0))


def edge_that_is_sampled(at):
    """x' is what was sampled last of a step."""
    law = sampled(lambda t, x, u, p: [u[0]], {}, ["d"])
    return {"dist": step("dist", at), "law": law, "plant": moving(lambda t, x, u, p: [u[0]], "u")}


def edge_in_the_flow(at):
    """x' = d + what was sampled last of x."""
    law = sampled(lambda t, x, u, p: [u[0]], {})
    return {"dist": step("dist", at), "law": law, "plant": moving(lambda t, x, u, p: sum(u), "du")}


def edge_behind_a_delay(at):
    """As before, 0.2 s later."""
    late = nlctl.TransportDelay(inputs=("e",), outputs=("d",), delay=0.25)
    dist = step("dist", at - 0.25, "e")
    return edge_in_the_flow(at) | {"dist": dist, "late": nlctl.block(late, "late")}


@pytest.mark.parametrize("parts", [edge_that_is_sampled, edge_in_the_flow, edge_behind_a_delay])
def test_step_at_a_tick(parts):
    """A step of 2 at a tick of a clock has no derivative by its time, but one by its height."""
    by = ["dist.t_step", "dist.height"]
    made, other = (
        nlctl.sensitivity_response(
            nlctl.interconnect(parts(at), outputs=["x"]), [0, 0.4, 0.9], with_respect_to=by
        ) for at in (0.5, 0.75)
    )  # fmt: skip
    (lack,) = made.missing
    assert (lack.with_respect_to, lack.time) == (("dist.t_step",), pytest.approx(0.5))
    assert made["x", "dist.height"] == pytest.approx([0, 0, 0.4])
    # between two ticks there is one
    flows = parts is not edge_that_is_sampled
    assert not other.missing
    assert other["x", "dist.t_step"] == pytest.approx([0, 0, -2.0 * flows])


def test_samples_that_meet_a_kink():
    """t = 0.5, 1, ... sampled and limited to 1: by the limit there is none from t = 1 on."""
    ramp = nlctl.block(nlctl.sources.Ramp(slope=1.0), "ramp", outputs=["r"])
    law = sampled(lambda t, x, u, p: [np.minimum(u[0], p["most"])], {"most": 1.0}, ["r"])
    plant = moving(lambda t, x, u, p: [p["k"] * u[0]], "u", {"k": 1.0})
    loop = nlctl.interconnect({"ramp": ramp, "law": law, "plant": plant}, outputs=["x"])
    t = [0, 0.9, 1.4]
    made = nlctl.sensitivity_response(loop, t, with_respect_to=["law.most", "plant.k"])
    (lack,) = made.missing
    assert (lack.with_respect_to, lack.time) == (("law.most",), 1.0)
    assert "sampled is right at a kink" in lack.why
    assert made["x", "plant.k"] == pytest.approx([0, 0.2, 0.65])
    near = nlctl.sensitivity_response(loop, t, params={"law.most": 0.9}, with_respect_to="law.most")
    assert near["x", "law.most"] == pytest.approx([0, 0, 0.4])


@nlctl.record
class Emptied:
    """Fills at rate 1, and is emptied to a where t has gone on by T."""

    T: float = nlctl.param(0.5, unit="s", meaning="period")
    a: float = nlctl.param(0.1, unit="1", meaning="level behind")

    inputs, outputs, states, feedthrough = (), ("h",), ("h",), False

    @nlctl.equation
    def update(t, x, u, p):
        return (1.0 + 0 * x[0],)

    @nlctl.equation
    def output(t, x, u, p):
        return (x[0],)

    @nlctl.equation
    def guard(t, x, u, p):
        return (p.T - t,)

    @nlctl.equation
    def reset(t, x, u, p):
        return (p.a + 0 * x[0],)


def test_reset_at_a_tick():
    """What is sampled of h at T is there before the reset, or not, as T moves; a moves nothing."""
    law = sampled(lambda t, x, u, p: [u[0]], {}, ["h"])
    plant = moving(lambda t, x, u, p: [u[0]], "u")
    loop = nlctl.interconnect({"tank": Emptied(), "law": law, "plant": plant}, outputs=["x", "h"])
    by = ["tank.T", "tank.a"]
    made = nlctl.sensitivity_response(loop, [0, 0.9], with_respect_to=by)
    (lack,) = made.missing
    assert (lack.with_respect_to, lack.time) == (("tank.T",), pytest.approx(0.5))
    assert made["h", "tank.a"] == pytest.approx([0, 1])
    near = nlctl.sensitivity_response(loop, [0, 0.9], params={"tank.T": 0.6}, with_respect_to=by)
    assert near["h", "tank.T"] == pytest.approx([0, -1])


LEVELS = {
    "another threshold": lambda t, x, p: np.where(x > np.where(t > p["p"], 3.0, p["q"]), 1.0, 0.0),
    "another number": lambda t, x, p: np.where(
        x + np.where(t > p["p"], -3.0, 0) > p["q"], 1.0, 0.0
    ),
    "rounded": lambda t, x, p: np.floor(x + 1 - p["q"] - np.where(t > p["p"], 1.0, 0.0)),
}


@pytest.mark.parametrize("law", LEVELS)
def test_what_is_compared_jumps(law):
    """z' = 1 from x = t = q to p, where x is compared with another number: z = p - q."""
    plant = block(
        lambda t, x, u, p: [1.0, LEVELS[law](t, x[0], p)], {"p": 0.8, "q": 0.5}, ("x", "z")
    )
    by = ["plant.p", "plant.q", "plant.x(0)"]
    made = nlctl.sensitivity_response(plant, [0, 0.7, 1.2], of=["z"], with_respect_to=by)
    assert not made.missing
    assert made.values[0] == pytest.approx([0, 0.2, 0.3])
    for name, expected in zip(by, ([0, 0, 1], [0, -1, -1], [0, 1, 1]), strict=True):
        assert made["z", name] == pytest.approx(expected, abs=1e-7)


@pytest.mark.parted
@pytest.mark.parametrize("rtol", 10.0 ** np.arange(-6, -12, -0.5))
def test_memories_that_switch_right_at_their_level(rtol):
    """Relays of A cos 3 t switch and switch back at times that are symmetric: nothing by A."""
    wave = ct.nlsys(
        lambda t, x, u, p: [x[1], -9 * x[0]], lambda t, x, u, p: [p["A"] * x[0]], inputs=0,
        outputs=["u"], states=["c", "s"], params={"A": 1.05}, name="wave",
    )  # fmt: skip
    relays = nlctl.actuators.Preisach(v0=1.0)
    parts = {"wave": wave, "relays": relays, "integral": integral()}
    made = nlctl.sensitivity_response(
        nlctl.interconnect(parts, outputs=["y"]), [0, 1, 2], 0, {"wave.c": 1.0}, rtol=rtol,
        atol=rtol / 100, with_respect_to="wave.A",
    )  # fmt: skip
    assert made["y", "wave.A"][-1] == pytest.approx(0, abs=1e-4)
    off = [np.arccos(beta / 1.05) for beta in relays.beta if beta > 1.05 * np.cos(3)]
    by_times = sum(0.2 / (3 * 1.05 * np.tan(angle)) for angle in off)
    assert made["y", "wave.A"][1] == pytest.approx(by_times, abs=1e-4)


@nlctl.record
class Highest:
    """The highest input so far; from T on that since, or d above the input there."""

    T: float = nlctl.param(0.6, unit="s", meaning="time of the reset")
    d: float = nlctl.param(0.1, unit="1", meaning="above the input")

    inputs, outputs, states, memory = ("u",), ("m",), ("m",), ("m",)
    initial = {"m": -5.0}

    @nlctl.equation
    def update(t, x, u, p):
        return (1000 * (np.maximum(x[0], u[0]) - x[0]),)

    @nlctl.equation
    def output(t, x, u, p):
        return (np.maximum(x[0], u[0]),)

    @nlctl.equation
    def commit(t, x, u, p):
        return (np.maximum(x[0], u[0]),)

    @nlctl.equation
    def guard(t, x, u, p):
        return (p.T - t,)

    @nlctl.equation
    def reset(t, x, u, p):
        return (u[0] + p.d,)


@pytest.mark.parametrize("d", [0.1, -0.1])
def test_memory_that_is_reset(d):
    """u = A (1 - t) is highest at 0; behind T it is A (1 - T) + d, or A (1 - T) if d < 0."""
    fall = ct.nlsys(
        lambda t, x, u, p: [-1.0], lambda t, x, u, p: [p["A"] * x[0]], inputs=0, outputs=["u"],
        states=["x"], params={"A": 2.0}, name="fall",
    )  # fmt: skip
    loop = nlctl.interconnect({"fall": fall, "highest": Highest()}, outputs=["m"])
    by = ["fall.A", "highest.T", "highest.d"]
    made = nlctl.sensitivity_response(
        loop, [0, 0.5, 0.9], 0, {"fall.x": 1.0}, with_respect_to=by, params={"highest.d": d}
    )
    assert not made.missing
    assert made.values[0] == pytest.approx([2, 2, 0.8 + max(d, 0)])
    for name, expected in zip(by, ([1, 1, 0.4], [0, 0, -2], [0, 0, float(d > 0)]), strict=True):
        assert made["m", name] == pytest.approx(expected, abs=1e-8)
