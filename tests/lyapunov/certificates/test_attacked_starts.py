"""From every start of the set, whatever the input does within its bound, the bounds hold.

Runs begin at corners of the set of starts and between, with a bounded input that is made to harm:
constant, square waves near the loop's own frequencies, chirps, steps.
"""

import numpy as np
import pytest
from mrac_loops import e_modification, first_order, projection, sigma, wing_rock
from planted_loops import SLIDING, wired

import nlctl
from nlctl.analysis.lyapunov import certify
from nlctl.errors import UsageError

TIMES, ROUND = np.linspace(0, 20, 2001), 1 + 1e-6
COMMAND = nlctl.SumOfSines(order=0, amplitudes=0.5, frequencies=0.7, phases=0.0)
ROLL = {
    "plant.x1": (-0.2, 0.2), "plant.x2": (-0.2, 0.2), "model.xm1": (-0.1, 0.1),
    "model.xm2": (0.0, 0.1), "weights.W_hat": (-0.1, 0.1),
}  # fmt: skip
FIRST = {"plant.x1": (-0.5, 0.5), "model.xm1": (-0.3, 0.4), "weights.W_hat": (-0.5, 1.0)}
# by kind of proof: the loop, bound of its input w, set of starts
KINDS = {
    "known sign": (
        lambda: wired(inputs={"w": ["plant.v"]}),
        0.2,
        {"plant.x1": (-0.4, 0.5), "plant.x2": (-0.3, 0.3), "weights.W_hat": (-0.1, 0.1),
         "robust.delta_hat": (0.0, 0.5)},
    ),
    "sliding mode": (
        lambda: wired(inputs={"w": ["plant.v"]}, of=SLIDING),
        0.2,
        {"plant.x1": (-0.1, 0.1), "plant.x2": (0.5, 0.9)},
    ),
    "sigma": (lambda: wing_rock(sigma(0.1, nodes=6), inputs=["w"]), 0.2, ROLL),
    "e": (lambda: wing_rock(e_modification(0.5, nodes=6), inputs=["w"]), 0.2, ROLL),
    "projection": (lambda: wing_rock(projection(2.0, nodes=6), inputs=["w"]), 0.2, ROLL),
    "sigma of order 1": (
        lambda: first_order(sigma(), inputs=["w"], b=1.0, reference=COMMAND), 0.4, FIRST,
    ),
    "projection of order 1": (
        lambda: first_order(projection(), inputs=["w"], b=1.0, reference=COMMAND), 0.4, FIRST,
    ),
}  # fmt: skip


def attack(rng, bound):
    """A signal with |w| <= bound that is likely to harm."""
    t, kind = TIMES, rng.integers(5)
    if kind == 0:
        return np.full(t.size, bound * rng.choice([-1, 1]))
    if kind == 1:
        return bound * np.sign(np.sin(rng.uniform(0.1, 8) * t + rng.uniform(0, 6)))
    if kind == 2:
        return bound * np.sin(rng.uniform(0.01, 0.5) * t**2)
    if kind == 3:
        return np.where(t < rng.uniform(0, 15), -bound, bound) * rng.choice([-1, 1])
    return np.repeat(bound * rng.choice([-1, 0, 1], t.size // 40 + 1), 40)[: t.size]


def members(found, count, rng):
    """Initial states by name: half of them at corners of the set, the others between."""
    low, high = np.array(found.starts.low), np.array(found.starts.high)
    share = rng.uniform(size=(count, low.size))
    share[::2] = share[::2] > 0.5
    return {
        name: low[i] + share[:, i] * (high[i] - low[i])
        for i, name in enumerate(found.starts.names)
        if name not in found.starts.kept
    }


def told(found):
    """The bounds that a certificate tells of outputs, by name."""
    name = "r" if hasattr(found, "C_0") else "e"
    return {name: found.C_0 if name == "r" else found.e, "u": found.u_max}


def check(kind, signals, starts):
    """Run a kind of loop with so many inputs, and from so many starts with each."""
    make, bound, box = KINDS[kind]
    loop, rng = make(), np.random.default_rng(sum(map(ord, kind)))
    found = certify(loop, inputs={"w": bound}, starts=box)
    assert found.status == "proved", found.missing
    compiled, count = nlctl.compile(loop), 0
    for _ in range(signals):
        many = nlctl.ensemble_response(
            compiled, TIMES, attack(rng, bound), members(found, starts, rng),
            keep=list(told(found)), rtol=1e-7, audit=False,
        )  # fmt: skip
        assert set(many.table["status"]) == {"OK"}
        for name, largest in told(found).items():
            assert np.abs(many.signals[name]).max() <= largest * ROUND
        count += starts
    assert count == signals * starts
    return found


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_runs_from_the_set_keep_the_bounds(kind):
    """And the sentence names the set; a larger one has larger bounds, or none."""
    found = check(kind, 2, 16)
    assert "for all t" in found.claim
    assert f"from {found.starts}" in found.claim
    assert found.claim.index("for all t") < found.claim.index(" from ")
    make, bound, box = KINDS[kind]
    wider = certify(
        make(), inputs={"w": bound}, starts={k: (a - 0.05, b + 0.05) for k, (a, b) in box.items()}
    )
    assert told(wider)["u"] >= told(found)["u"]


@pytest.mark.weekly
@pytest.mark.parametrize("kind", KINDS)
def test_thousands_of_runs_keep_the_bounds(kind):
    """5,000 a kind."""
    check(kind, 50, 100)


PROOF_USES = {  # states besides the plant's that each proof depends on
    "known sign": ("weights.W_hat[0]", "robust.delta_hat"),
    "sigma": ("model.xm1", "model.xm2", "weights.W_hat[0]"),
    "e": ("model.xm1", "weights.W_hat[1]"),
    "projection": ("model.xm2", "weights.W_hat[2]"),
}


@pytest.mark.parted
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "state"), [(kind, state) for kind, states in PROOF_USES.items() for state in states]
)
def test_every_state_that_a_proof_uses_is_in_the_set(kind, state):
    """Far away it is another claim: a larger bound, or none, or a refusal."""
    make, bound, box = KINDS[kind]
    near = certify(make(), inputs={"w": bound}, starts=box)
    assert state in near.starts.names
    try:
        far = certify(make(), inputs={"w": bound}, starts={**box, state: (50.0, 50.0)})
    except UsageError as error:
        refusal = str(error)
        assert state.partition("[")[0] in refusal
        return
    assert far.starts[state] == (50.0, 50.0)
    assert far.status == "undecided" or told(far)["u"] > told(near)["u"]


@pytest.mark.parametrize("remedy", [sigma, e_modification, lambda: projection(0.5, 50.0)])
def test_a_start_where_error_and_weights_are_0_is_not_any_start(remedy):
    """E(0) = 0 and W_hat(0) = 0, but x and xm far away: V(0) is 0, and the loop diverges.

    The regressor does not span the cubic, so that the box is small.
    """
    plant = nlctl.PureFeedback(order=1, f=nlctl.equation(lambda x, v: 0.3 * x[0] ** 3 + v))
    small = nlctl.SumOfSines(order=0, amplitudes=0.1, frequencies=1.0, phases=0.0)
    loop = first_order(remedy(), plant=plant, b=1.0, reference=small)
    own = certify(loop)
    assert own.status == "proved"
    assert "all states 0" in own.claim
    far = certify(loop, starts={"plant.x1": 3.0, "model.xm1": 3.0})
    assert far.V_0 == own.V_0 == 0.0
    assert far.status == "undecided"
    assert far.claim == f"no bound is proved from {far.starts}, and none is refuted; undecided"
    assert far.missing in far.verdict
    level = certify(loop, starts={"V": 1e-6})
    assert "V(0) <= 1e-06" in level.claim
    assert "model.xm1(0) = 0" in level.claim
