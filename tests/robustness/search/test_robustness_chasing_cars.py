"""The search for the worst case on ARCH-COMP's chasing cars, written from their equations.

Five cars run towards minus infinity; a driver has the pedals of the first, each other one keeps
its distance from the car ahead (Hu, Lygeros, Sastry: Towards a theory of stochastic hybrid systems,
HSCC 2000).  Requirements CC1 to CC5 and the equations are those of the falsification category of
ARCH-COMP 2020; ZlsCheck, whose Euler step of 0.01 s is taken here, falsified CC1, CC2, CC3 and CC5
in 50 of 50 attempts of at most 300 runs and CC4 in 32
(github.com/ismailbennani/zlscheck_arch20_counterexamples).
"""

import control as ct
import numpy as np
import pandas as pd
import pytest

import nlctl
from nlctl.analysis.robustness.search.worst_case import worst_case
from nlctl.analysis.robustness.stl.formula import always, eventually, in_band
from nlctl.analysis.robustness.stl.spec import Requirement, Spec, margins
from nlctl.analysis.robustness.uncertainty.space import Space, Uncertain

DT = 0.01
T = DT * np.arange(10001)
PIECES = 20  # pedals are constant for 5 s
KEEPING, CHASING, BRAKING = 0.0, 1.0, 2.0


def leader(t, x, u, params):
    y, v = x
    throttle, brake = u
    return [y + DT * v, v + DT * (-throttle - brake * v)]


def follower(t, x, u, params):
    y, v, mode = x
    gap = y - u[0]
    if mode == KEEPING:
        y = y + DT * v
        mode = CHASING if gap >= 15 else BRAKING if gap <= 5 else KEEPING
    elif mode == CHASING:
        y, v = y - DT * v, v + DT
        mode = KEEPING if gap <= 10 else CHASING
    else:
        y, v = y - DT * v, v - DT * v
        mode = CHASING if gap >= 20 else BRAKING
    return [y, v, mode]


def place(t, x, u, params):
    return [x[0]]


@pytest.fixture(scope="module")
def cars():
    first = ct.nlsys(
        leader, place, inputs=["throttle", "brake"], outputs=["y1"], states=2, dt=DT, name="car1"
    )
    others = [
        ct.nlsys(
            follower, place, inputs=[f"y{i - 1}"], outputs=[f"y{i}"], states=3, dt=DT,
            name=f"car{i}",
        )
        for i in range(2, 6)
    ]  # fmt: skip
    outputs = [f"y{i}" for i in range(1, 6)]
    pedals = ["throttle", "brake"]
    return nlctl.compile(ct.interconnect([first, *others], inputs=pedals, outputs=outputs))


def driven(cars, throttle, brake):
    """Places of the cars, shape (5, 10001), for pedals that are constant for 5 s each."""
    pedals = np.repeat([throttle, brake], 500, axis=1)
    start = [0, 0, 10, 0, 0, 20, 0, 0, 30, 0, 0, 40, 0, 0]
    u = np.column_stack([pedals, pedals[:, -1]])
    return np.asarray(nlctl.input_output_response(cars, T, u, start).outputs)


SPACE = Space(
    quantities=tuple(
        Uncertain(name=f"{pedal}[{i}]", bounds=(0.0, 1.0))
        for pedal in ("throttle", "brake")
        for i in range(PIECES)
    )
)
FORMULAS = {
    "CC1": always(in_band("gap5", upper=40), 0, 100),
    "CC2": always(eventually(in_band("gap5", lower=15), 0, 30), 0, 70),
    "CC3": always(
        always(in_band("gap2", upper=20), 0, 20) | eventually(in_band("gap5", lower=40), 0, 20),
        0, 80,
    ),
    "CC5": always(
        eventually(
            ~always(in_band("gap2", lower=9), 0, 5) | always(in_band("gap5", lower=9), 5, 20), 0, 8
        ),
        0, 72,
    ),
}  # fmt: skip


def test_the_first_seconds_are_those_that_were_published(cars):
    """ZlsCheck's counterexample 07ef11 of CC1, whose time is one step ahead."""
    y = driven(cars, np.full(PIECES, 0.82072), np.full(PIECES, 0.0813549))
    published = [-0.00294899, -0.38786, -1.53386, -2.89551]
    np.testing.assert_allclose(y[0, [9, 99, 199, 276]], published, rtol=1e-5)
    np.testing.assert_array_equal(y[1:, 276], [10, 20, 30, 40])


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("key", FORMULAS)
def test_the_search_falsifies_what_was_falsified(cars, key):
    """Within the 300 runs that the competition allows, like every attempt of ZlsCheck."""
    spec = Spec(requirements=(Requirement(key=key, formula=FORMULAS[key], until=100),))

    def evaluated(table):
        found = []
        for row in table.to_numpy():
            y = driven(cars, row[:PIECES], row[PIECES:])
            found.append(margins(spec, T, {"gap2": y[1] - y[0], "gap5": y[4] - y[3]})["spec"])
        return pd.DataFrame({"spec": found}, index=table.index)

    runs = 0
    for batch in (40, 260):  # a small search is often enough
        found = worst_case(evaluated, SPACE, batch, entropy=1, target=0.0)
        runs += found.design.size
        if found.is_violated:
            break
    assert found.is_violated
    assert runs <= 300
    if key == "CC1":
        row = found.design.table.iloc[found.number].to_numpy()
        y = driven(cars, row[:PIECES], row[PIECES:])
        assert np.max(y[4] - y[3]) == pytest.approx(40 * (1 - found.margin), abs=0.1)
