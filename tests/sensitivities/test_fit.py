"""Parameters from data: exact data, noise, what data do not tell, bad input."""

import control as ct
import numpy as np
import pytest
from closed_form_runs import Ball, block

import nlctl

T = np.linspace(0, 4, 41)


def decay():
    return block(lambda t, x, u, p: [-p["a"] * x[0]], {"a": 1.0})


def test_exact_data():
    """2 exp(-0.7 t): both numbers, to what runs are exact to."""
    found = nlctl.fit(decay(), T, {"x": 2 * np.exp(-0.7 * T)}, {"plant.a": 1.0, "plant.x(0)": 1.0})
    assert found.success
    assert abs(found["plant.a"] - 0.7) < 1e-7
    assert abs(found["plant.x(0)"] - 2) < 1e-7
    assert found.unidentifiable == ()


@pytest.mark.weekly
def test_intervals_cover():
    """Of 300 fits to noisy data 95 % intervals hold the truth in 270 to 297 (3.9 sigma)."""
    rng, compiled = np.random.default_rng(5), nlctl.compile(decay())
    exact, inside = 2 * np.exp(-0.7 * T), np.zeros(2, dtype=int)
    for _ in range(300):
        found = nlctl.fit(
            compiled, T, {"x": exact + 0.05 * rng.normal(size=T.size)},
            {"plant.a": 1.0, "plant.x(0)": 1.0},
        )  # fmt: skip
        low, high = found.intervals().T
        inside += (low <= [0.7, 2.0]) & (high >= [0.7, 2.0])
        assert 0.03 < found.noise < 0.08
    assert np.all((inside >= 270) & (inside <= 297)), inside


def test_linear_regression():
    """x' = a + b t: standard errors are those of linear least squares."""
    plant = block(lambda t, x, u, p: [p["a"] + p["b"] * t], {"a": 0.0, "b": 0.0})
    rng = np.random.default_rng(3)
    y = 1.5 * T - 0.2 * T**2 + 0.1 * rng.normal(size=T.size)
    found = nlctl.fit(plant, T, {"x": y}, {"plant.a": 0.5, "plant.b": 0.5})
    columns = np.stack([T, T**2 / 2], axis=1)
    best, (square,), _, _ = np.linalg.lstsq(columns, y, rcond=None)
    covariance = np.linalg.inv(columns.T @ columns) * square / (T.size - 2)
    assert np.allclose(found.values, best, rtol=1e-7)
    assert np.allclose(found.covariance, covariance, rtol=1e-6)


def actuated(actuator):
    """A source behind an actuator, and a lag."""
    source = ct.nlsys(
        None, lambda t, x, u, p: [2 * np.sin(1.3 * t) + 0.5 * np.sin(3.1 * t)], inputs=0,
        outputs=["u"], name="source",
    )  # fmt: skip
    plant = ct.nlsys(
        lambda t, x, u, p: [u[0] - p["a"] * x[0]], lambda t, x, u, p: x, inputs=["v"],
        outputs=["y"], states=["y"], params={"a": 1.0}, name="plant",
    )  # fmt: skip
    return nlctl.interconnect(
        {"source": source, "actuator": actuator, "plant": plant}, outputs=["y"]
    )


@pytest.mark.parted
@pytest.mark.parametrize(
    ("actuator", "truth"),
    [
        (nlctl.Backlash(m_r=1.0, m_l=1.0), {"actuator.c_r": 0.4, "actuator.c_l": -0.3}),
        (nlctl.DeadZone(), {"actuator.b_r": 0.6, "actuator.b_l": -0.4}),
        (nlctl.Relay(), {"actuator.on": 0.7, "actuator.off": -0.5, "actuator.height": 1.2}),
    ],
    ids=["backlash", "dead zone", "relay"],
)
def test_actuators(actuator, truth):
    """The ends of a gap, a zone and a relay, behind a lag, from noisy data."""
    loop, rng, t = (
        nlctl.compile(actuated(actuator)),
        np.random.default_rng(1),
        np.linspace(0, 12, 241),
    )
    truth = truth | {"plant.a": 1.3}
    y = nlctl.input_output_response(loop, t, params=truth, squeeze=True).outputs
    p = {name: 0.8 * value for name, value in truth.items()}
    found = nlctl.fit(loop, t, {"y": y + 0.01 * rng.normal(size=t.size)}, p)
    assert np.all(np.abs(found.values - list(truth.values())) < 4.5 * found.errors)
    assert np.all(found.errors < 0.05)


def test_bouncing_ball():
    """Gravity and restitution of a ball from its heights, with a gap in the data."""
    ball, t = nlctl.block(Ball(), "ball"), np.linspace(0, 1.6, 81)
    run = nlctl.input_output_response(ball, t, params={"ball.g": 9.7, "ball.e": 0.75})
    h = run.outputs[0].copy()
    h[20:30] = np.nan
    found = nlctl.fit(ball, t, {"h": h}, {"ball.g": 9.81, "ball.e": (0.8, 0.1, 1.0)})
    assert abs(found["ball.g"] - 9.7) < 1e-5
    assert abs(found["ball.e"] - 0.75) < 1e-5
    assert np.isnan(found.residuals["h"][20:30]).all()
    assert list(found.to_pandas().columns) == ["value", "error", "low", "high"]


def test_what_data_do_not_tell():
    """Of a b only the product is identifiable; of c nothing; of d all."""
    plant = block(
        lambda t, x, u, p: [p["a"] * p["b"] + 0 * p["c"] - p["d"] * x[0]],
        {"a": 1.0, "b": 2.0, "c": 1.0, "d": 1.0},
    )  # fmt: skip
    y = 3 * (1 - np.exp(-1.2 * T)) / 1.2
    found = nlctl.fit(
        plant, T, {"x": y + 1e-3 * np.cos(40 * T)},
        {"plant.a": 1.0, "plant.b": 2.0, "plant.c": 1.0, "plant.d": 1.0},
    )  # fmt: skip
    assert found.unidentifiable == ("plant.a", "plant.b", "plant.c")
    assert np.isinf(found.errors[:3]).all()
    assert abs(found["plant.d"] - 1.2) < 1e-2
    assert found.errors[3] < 1e-2
    assert "not identifiable from these data: plant.a, plant.b, plant.c" in repr(found)


@pytest.mark.parametrize("start", [0.0, (0.0, -2.0, 2.0)])
@pytest.mark.parametrize("truth", [1.2, -1.2])
def test_start_at_a_kink(start, truth):
    """x' = p - |x| from 0 has no derivative at p = 0: the search leaves it, and says how."""
    plant = block(lambda t, x, u, p: [p["p"] - abs(x[0])], {"p": 0.0})
    data = truth * (1 - np.exp(-T) if truth > 0 else np.expm1(T))
    found = nlctl.fit(plant, T, {"x": data}, {"plant.p": start})
    assert abs(found["plant.p"] - truth) < 1e-6
    (note,) = found.notes
    assert "differences of runs took the place of derivatives: the run stays on a kink" in note
    assert note in repr(found)


def test_search_that_is_given_up():
    """One run is too few, and the text says that it has not converged."""
    found = nlctl.fit(
        decay(), T, {"x": np.exp(-T)}, {"plant.a": 3.0}, 0.0, [1.0], max_evaluations=1
    )
    assert not found.success
    assert "has not converged" in repr(found)


@pytest.mark.parametrize(
    ("data", "parameters", "more", "match"),
    [
        ({"x": T[1:]}, {"plant.a": 1.0}, {}, "need shape"),
        ({"x": T + np.inf}, {"plant.a": 1.0}, {}, "infinite"),
        ({}, {"plant.a": 1.0}, {}, "at least one signal"),
        ({"x": T}, {}, {}, "at least one parameter"),
        ({"x": T}, "plant.a", {}, "at least one parameter, .*got 'plant.a'"),
        ({"x": T}, {"plant.a": 1.0}, {"max_evaluations": 0}, "max_evaluations"),
        ({"x": T}, {"plant.a": 1.0}, {"U": 1.0, "inputs": 1.0}, "'inputs' is given twice"),
        ({"x": T}, {"plant.a": (1.0, 2.0, 3.0)}, {}, "within its bounds"),
        ({"x": T}, {"plant.a": "one"}, {}, "number to start from"),
        ({"x": T}, {"plant.a": 1.0}, {"sigma": {"y": 1.0}}, "no standard deviation for 'x'"),
        ({"x": 0 * T * np.nan}, {"plant.a": 1.0}, {}, "as many data as parameters"),
    ],
)
def test_bad_input(data, parameters, more, match):
    """One sentence each."""
    with pytest.raises(nlctl.errors.ParameterError, match=match):
        nlctl.fit(decay(), T, data, parameters, **more)


def test_short_names():
    """T, U and X0 are times, inputs and initial states, as in python-control: a is 2."""
    x = 1.5 * np.exp(-2 * T)
    found = nlctl.fit(decay(), data={"x": x}, parameters={"plant.a": 1.0}, T=T, U=0.0, X0=[1.5])
    assert abs(found["plant.a"] - 2) < 1e-7
    made = nlctl.sensitivity_response(decay(), T=T, U=0.0, X0=1.5, with_respect_to="plant.a")
    same = nlctl.sensitivity_response(decay(), T, 0.0, {"plant.x": 1.5}, with_respect_to="plant.a")
    assert np.array_equal(made.derivatives, same.derivatives)
    with pytest.raises(nlctl.errors.UnknownKeywordError, match="'u' of sensitivity_response"):
        nlctl.sensitivity_response(decay(), T, u=1.0, with_respect_to="plant.a")


def test_at_a_bound():
    """a = 2 is not within (0, 1): the search ends at 1, and the text says so."""
    found = nlctl.fit(decay(), T, {"x": np.exp(-2 * T)}, {"plant.a": (0.5, 0.0, 1.0)}, 0.0, 1.0)
    assert found.at_bounds == ("plant.a",)
    assert "at a bound" in repr(found)


def test_bounds_of_a_block():
    """A lag declares T > 0: from T = 5 the search comes to 0.02 and never asks for less than 0."""
    lag = nlctl.block(nlctl.Lag(T=5.0), "lag")
    t = np.linspace(0, 0.1, 21)
    found = nlctl.fit(lag, t, {"v": 1 - np.exp(-t / 0.02)}, {"lag.T": 5.0}, 1.0)
    assert abs(found["lag.T"] - 0.02) < 1e-8
    with pytest.raises(nlctl.errors.ParameterError, match="within its bounds"):
        nlctl.fit(lag, t, {"v": t}, {"lag.T": -1.0}, 1.0)


@pytest.mark.parted
@pytest.mark.parametrize(
    ("example", "truth"),
    [
        (nlctl.paper.example_1, {"b_r": 0.6, "b_l": -0.25, "slope_r": 1.1, "slope_l": 0.9}),
        (nlctl.paper.example_2, {"c_r": 0.4, "c_l": -0.7, "m_r": 1.3, "m_l": 1.1}),
    ],
    ids=["dead zone", "backlash"],
)
def test_actuators_of_the_paper(example, truth):
    """All four parameters of the actuator from noisy u and y of the closed loop, within 4 sigma."""
    loop, rng, t = nlctl.compile(example()), np.random.default_rng(4), np.linspace(0, 20, 401)
    truth = {f"actuator.{name}": value for name, value in truth.items()}
    run = nlctl.input_output_response(loop, t, params=truth, rtol=1e-9, atol=1e-11)
    sigma, labels = {"u": 0.05, "y": 0.005}, list(loop.system.output_labels)
    data = {
        name: run.outputs[labels.index(name)] + size * rng.normal(size=t.size)
        for name, size in sigma.items()
    }
    published = {name: nlctl.parameters(loop.system)["value"][name] for name in truth}
    found = nlctl.fit(loop, t, data, published, sigma=sigma)
    assert found.success
    assert found.unidentifiable == ()
    assert np.all(np.abs(found.values - list(truth.values())) < 4 * found.errors)
    assert np.all(found.errors < 0.05)
    assert abs(found.noise - 1) < 0.1


def shaken_mass():
    """The benchmark of Noël and Schoukens: 2 kg on a spring, a damper and a Bouc-Wen force.

    The force on it is a multisine of 30 lines from 5 to 150 Hz with an RMS of 50 N.
    """
    lines, rng = np.linspace(5, 150, 30), np.random.default_rng(2)
    phases, size = rng.uniform(0, 2 * np.pi, lines.size), 50 * np.sqrt(2 / lines.size)

    def shaker(t, x, u, params):
        return size * np.sum(np.sin(2 * np.pi * lines * t + phases))

    def rates(t, x, u, p):
        return [x[1], (u[0] - u[1] - p["c"] * x[1] - p["k"] * x[0]) / 2.0]

    source = ct.nlsys(None, shaker, inputs=0, outputs=["push"], name="shaker")
    mass = ct.nlsys(
        rates, lambda t, x, u, p: x, inputs=["push", "force"], outputs=["y", "velocity"],
        states=["y", "velocity"], params={"c": 10.0, "k": 5e4}, name="mass",
    )  # fmt: skip
    spring = nlctl.actuators.BoucWen()
    return nlctl.interconnect({"shaker": source, "mass": mass, "spring": spring}, outputs=["y"])


@pytest.mark.weekly
def test_bouc_wen_benchmark():
    """At 750 Hz with noise of 8e-3 mm: as much is left as was added, and five parameters are found.

    Of beta, gamma and delta only the products beta gamma and beta delta are seen.  It is in motion
    at the start: from rest z leaves 0 at a rate of 0, where nothing is known of derivatives.
    """
    loop, rng, t = nlctl.compile(shaken_mass()), np.random.default_rng(6), np.arange(1500) / 750
    moving = {"mass.velocity": 0.01, "spring.z": 1.0}
    exact = nlctl.input_output_response(
        loop, t, 0, moving, rtol=1e-9, atol=1e-12, squeeze=True
    ).outputs
    noise = 8e-6
    assert np.std(exact) > 30 * noise
    truth = {"mass.c": 10.0, "mass.k": 5e4, "spring.alpha": 5e4}
    truth |= {"spring.gamma": 0.8, "spring.delta": -1.1}
    data = {"y": exact + noise * rng.normal(size=t.size)}
    start = {name: 0.8 * value for name, value in truth.items()}
    found = nlctl.fit(loop, t, data, start, 0, moving, sigma=noise, atol=1e-12)
    assert found.success
    assert found.unidentifiable == ()
    assert abs(found.noise - 1) < 0.05
    assert np.sqrt(np.mean((found.response.values[0] - exact) ** 2)) < 0.1 * noise
    assert np.all(np.abs(found.values - list(truth.values())) < 4 * found.errors)
    both = nlctl.fit(
        loop, t, data, truth | {"spring.beta": 1e3}, 0, moving, sigma=noise, atol=1e-12
    )
    assert set(both.unidentifiable) == {"spring.beta", "spring.gamma", "spring.delta"}
