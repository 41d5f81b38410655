"""Regions of attraction and barriers: closed forms, published levels, and trajectories."""

from fractions import Fraction

import control as ct
import numpy as np
import pytest
from flint import Ordering, fmpq, fmpq_mpoly_ctx
from scipy.integrate import solve_ivp
from scipy.linalg import solve_continuous_lyapunov

import nlctl
from nlctl.analysis.intervals.machine import only_balls
from nlctl.analysis.lyapunov import Box, barrier, prove_decrease, region_of_attraction
from nlctl.analysis.lyapunov.attraction.region import reach_of_level
from nlctl.analysis.lyapunov.attraction.squares import PositiveCondition, positive_where
from nlctl.errors import ParameterError

KHALIL = [[1.5, -0.5], [-0.5, 1.0]]


def van_der_pol(x):
    """In reversed time: Khalil, Nonlinear Systems, Example 8.9."""
    return -x[1], x[0] + (x[0] ** 2 - 1) * x[1]


def cube(x):
    """Each coordinate goes to 0 from between -1 and 1."""
    return tuple(-one + one**3 for one in x)


def square_box(n, reach):
    return Box.of(**{f"x{i + 1}": (-reach, reach) for i in range(n)})


def pendulum_rates(x):
    """No polynomials."""
    return x[1], -np.sin(x[0])


def rates_of(function):
    return lambda t, x: np.array(function(tuple(x)))


def test_khalils_example_has_its_level():
    """2.25 in the book, read off a plot; 2.30448 is where V' first vanishes."""
    found = region_of_attraction(van_der_pol, square_box(2, 3.0), P=KHALIL)
    assert found.status == "proved"
    assert abs(found.level - 2.30448) < 1e-3
    assert found.level < found.above <= found.level * 1.0002
    x = np.array([found.refuted[name] for name in found.names])
    assert found.value(x) <= found.above
    assert 2 * x @ np.array(KHALIL) @ np.array(van_der_pol(x)) >= -1e-8


def test_a_parameter_that_is_written_as_1_may_be_a_half():
    """x' = x^3 - a x with a = 1 / 2 goes to 0 from between -sqrt(a) and sqrt(a)."""
    diagram = ct.nlsys(lambda t, x, u, p: [x[0] ** 3 - p["a"] * x[0]], None, states=["x"],
                       inputs=0, params={"a": 1}, name="cubic")  # fmt: skip
    for system in (diagram, nlctl.compile(diagram)):
        found = region_of_attraction(system, Box.of(x=(-2, 2)), P=[[1.0]], params={"cubic.a": 0.5})
        assert 0.4999 <= found.level <= 0.5


@pytest.mark.parametrize("n", [1, 2, 3])
def test_a_level_has_its_closed_form(n):
    """V = |x|^2 of x_i' = -x_i + x_i^3 falls up to |x| = 1, where one coordinate is 1."""
    found = region_of_attraction(cube, square_box(n, 2.0), P=np.eye(n), tol=1e-5)
    assert 1 - 2e-5 <= found.level <= 1.0
    assert found.refuted is not None


def test_a_linear_system_is_bounded_by_the_box_alone():
    """The largest ellipsoid in a box touches its nearest face: b^2 / (P^-1)_ii."""
    A = np.array([[-1.0, 2.0], [0.0, -3.0]])
    P = solve_continuous_lyapunov(A.T, -np.eye(2))
    P = 0.5 * (P + P.T)
    box = Box.of(a=(-1, 2), b=(-3, 3))
    found = region_of_attraction(lambda x: tuple(A @ np.array(x)), box, P=P)
    fits = min(np.array([1.0, 9.0]) / np.diag(np.linalg.inv(found.P)))
    assert fits * (1 - 2e-6) <= found.level <= fits
    assert "box" in found.reason


def test_trajectories_from_the_edge_of_a_region_go_to_the_equilibrium():
    """Of a diagram with a parameter that is overridden."""
    pendulum = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], -np.sin(x[0]) - p["damping"] * x[1]]),
        None, states=["angle", "rate"], inputs=0, params={"damping": 5.0}, name="pendulum",
    )  # fmt: skip
    found = region_of_attraction(
        pendulum, Box.of(angle=(-3.1, 3.1), rate=(-4, 4)), params={"damping": 0.5}
    )
    assert found.names == ("pendulum.angle", "pendulum.rate")
    assert found.status == "proved"
    root = np.linalg.inv(np.linalg.cholesky(found.P / found.level)).T
    for angle in np.linspace(0, 2 * np.pi, 12, endpoint=False):
        start = root @ [np.cos(angle), np.sin(angle)]
        assert abs(found.value(start) - found.level) < 1e-9 * found.level
        run = solve_ivp(
            lambda t, x: [x[1], -np.sin(x[0]) - 0.5 * x[1]], (0, 60), start, rtol=1e-8, atol=1e-10
        )
        values = [found.value(x) for x in run.y.T]
        assert np.all(np.diff(values) < 1e-6)
        assert np.linalg.norm(run.y[:, -1]) < 1e-4


def test_a_program_finds_a_larger_set_than_the_linear_part():
    """Of a pendulum with little damping: the area of the proved ellipse grows."""
    rates = lambda x: (x[1], -np.sin(x[0]) - 0.3 * x[1])  # noqa: E731
    box = Box.of(angle=(-3.1, 3.1), rate=(-4, 4))
    A = np.array([[0.0, 1.0], [-1.0, -0.3]])
    first = solve_continuous_lyapunov(A.T, -np.eye(2))
    area = lambda r: r.level / np.sqrt(np.linalg.det(r.P))  # noqa: E731
    linear = region_of_attraction(rates, box, P=0.5 * (first + first.T))
    assert area(region_of_attraction(rates, box)) >= 1.2 * area(linear)


def test_an_equilibrium_elsewhere():
    """x' = x (1 - x) goes to 1 from above 0: V = (x - 1)^2 falls up to 1."""
    found = region_of_attraction(lambda x: (x[0] * (1 - x[0]),), Box.of(x=(-1, 4)), at=[1.0])
    assert abs(np.sqrt(found.level / found.P[0, 0]) - 1.0) < 1e-4


def drakes(x):
    """x' = (U1 U2 - 1) grad (U1 U2): a region of V = |x|^2 that ends at 0.05."""
    a, b = x
    u1, u2 = (a + 2 * b) ** 2 + (3 * a + 4 * b) ** 2, (2 * b - a) ** 2 + (4 * b - 3 * a) ** 2
    d1 = 2 * (a + 2 * b) + 6 * (3 * a + 4 * b), 4 * (a + 2 * b) + 8 * (3 * a + 4 * b)
    d2 = -2 * (2 * b - a) - 6 * (4 * b - 3 * a), 4 * (2 * b - a) + 8 * (4 * b - 3 * a)
    w = u1 * u2 - 1
    return w * (d1[0] * u2 + u1 * d2[0]), w * (d1[1] * u2 + u1 * d2[1])


@pytest.mark.parametrize(("level", "status"), [(0.0499, "proved"), (0.0501, "refuted")])
def test_a_level_that_sums_of_squares_have_got_wrong(level, status):
    """0.05 is the truth, 0.067 to 0.070 was reported; and balls confirm the point that refutes."""
    found = prove_decrease(
        lambda x: x[0] ** 2 + x[1] ** 2, drakes, square_box(2, 0.3), level=level, floor=1e-3
    )
    assert found.status == status
    assert found.arithmetic == "floats"
    if status == "refuted":
        x = np.array([found.where[name] for name in ("x1", "x2")])
        assert 1e-3 <= x @ x <= level
        assert 2 * x @ np.array(drakes(x)) > -1e-9


def test_balls_alone_give_the_same_verdict():
    """On fewer boxes a second."""
    claim = {"V": lambda x: x[0] ** 2 + x[1] ** 2, "rhs": cube, "box": square_box(2, 1.2)}
    found = prove_decrease(**claim, level=0.9, floor=0.1)
    with only_balls():
        reference = prove_decrease(**claim, level=0.9, floor=0.1)
    assert (found.status, reference.status) == ("proved", "proved")
    assert (found.arithmetic, reference.arithmetic) == ("floats", "balls")


UNREADABLE = {
    "time": lambda t, x, u, p: np.array([-x[0] + np.sin(t)]),
    "unstable": lambda t, x, u, p: np.array([x[0]]),
    "equilibrium": lambda t, x, u, p: np.array([1.0 - x[0]]),
    "jump": lambda t, x, u, p: np.array([-np.sign(x[0])]),
}


@pytest.mark.parametrize("what", UNREADABLE)
def test_what_has_no_region_is_refused(what):
    """With a reason: nothing is approximated."""
    system = ct.nlsys(UNREADABLE[what], None, states=["x"], inputs=0, name="one")
    with pytest.raises(ParameterError, match=what.replace("unstable", "stable")):
        region_of_attraction(system, Box.of(x=(-1, 1)))


def oscillator(x):
    return x[1], -x[0] - x[1]


def test_a_barrier_keeps_trajectories_below_zero():
    """From the starts B never rises above 0, and what is unsafe has B > 0."""
    box, start = square_box(2, 3.0), Box.of(x1=(0.9, 1.1), x2=(-0.1, 0.1))
    unsafe = Box.of(x1=(-3.0, -0.95), x2=(-3.0, 3.0))
    found = barrier(oscillator, box, start=start, unsafe=unsafe)
    assert found.status == "proved"
    rng = np.random.default_rng(0)
    for x in rng.uniform(start.low, start.high, (20, 2)):
        run = solve_ivp(rates_of(oscillator), (0, 20), x, rtol=1e-8)
        assert max(found.value(state) for state in run.y.T) < 1e-9
    for x in rng.uniform(unsafe.low, unsafe.high, (200, 2)):
        assert found.value(x) > 0


def test_a_barrier_of_a_diagram():
    """A feedback loop of two blocks."""
    plant = ct.nlsys(
        lambda t, x, u, p: np.array([x[1], -np.sin(x[0]) + u[0]]), lambda t, x, u, p: x,
        states=["angle", "rate"], inputs=["torque"], outputs=["angle", "rate"], name="plant",
    )  # fmt: skip
    law = ct.nlsys(
        None, lambda t, x, u, p: np.array([-2.0 * u[0] - u[1]]), inputs=["angle", "rate"],
        outputs=["torque"], name="law",
    )  # fmt: skip
    loop = ct.interconnect([plant, law], inputs=[], outputs=["angle"], name="loop")
    box = Box.of(**{"plant_angle": (-2, 2), "plant_rate": (-3, 3)})
    start = Box.of(**{"plant_angle": (-0.3, 0.3), "plant_rate": (-0.3, 0.3)})
    far = Box.of(**{"plant_angle": (1.2, 2), "plant_rate": (-3, 3)})
    assert barrier(loop, box, start=start, unsafe=far).status == "proved"
    assert nlctl.compile(loop).system.nstates == 2


def test_what_is_met_has_no_barrier():
    """A circle from (1, 0) comes to (-1, 0): nothing is proved, and that is said."""
    start, unsafe = (Box.of(x1=(a, b), x2=(-0.1, 0.1)) for a, b in ((0.9, 1.1), (-1.1, -0.9)))
    found = barrier(lambda x: (x[1], -x[0]), square_box(2, 3.0), start=start, unsafe=unsafe)
    assert found.status == "undecided"
    assert str(found).startswith("undecided: ")


EVERYWHERE = Box.of(x1=(-np.inf, np.inf), x2=(-np.inf, np.inf))


def saddles(x):
    """Prajna and Jadbabaie (2004): saddles at +- sqrt(3) around a focus at 0."""
    return x[1], -x[0] + x[0] ** 3 / 3 - x[1]


def disc(middle, square):
    """What is not negative within a circle."""
    return lambda x: square - (x[0] - middle[0]) ** 2 - (x[1] - middle[1]) ** 2


@pytest.mark.parametrize(
    ("start", "unsafe"),
    [
        (disc((1.5, 0.0), 0.25), disc((-1.0, -1.0), 0.16)),
        (Box.of(x1=(1.0, 2.0), x2=(-0.5, 0.5)), Box.of(x1=(-1.4, -0.6), x2=(-1.4, -0.6))),
    ],
    ids=["discs", "boxes"],
)
def test_prajnas_example_is_safe(start, unsafe):
    """For all time, from both sides of a saddle, by a polynomial of degree four in all of space."""
    found = barrier(saddles, EVERYWHERE, start=start, unsafe=unsafe, degree=4)
    assert (found.status, found.arithmetic) == ("proved", "rational numbers")
    assert found.claim == "safe as long as solutions exist"  # beyond the saddles they escape
    rng = np.random.default_rng(0)
    for angle in rng.uniform(0, 2 * np.pi, 12):
        x = 1.5 + 0.5 * np.cos(angle), 0.5 * np.sin(angle)
        far = lambda t, y: 10.0 - np.abs(y).max()  # noqa: E731
        far.terminal = True
        run = solve_ivp(rates_of(saddles), (0, 10), x, rtol=1e-8, events=far)
        assert max(found.value(state) for state in run.y.T) < 1e-9
        assert found.value((-1 + 0.4 * np.cos(angle), -1 + 0.4 * np.sin(angle))) > 0


@pytest.mark.parametrize(
    ("unsafe", "degree"),
    [(disc((0.0, 0.0), 0.01), 4), (disc((1.2, 0.0), 0.16), 4), (disc((-1.0, -1.0), 0.16), 1)],
    ids=["met", "overlapping", "degree"],
)
def test_what_has_no_barrier_in_space_is_undecided(unsafe, degree):
    """The focus is met, starts are unsafe, a line does not separate."""
    start = disc((1.5, 0.0), 0.25)
    found = barrier(saddles, EVERYWHERE, start=start, unsafe=unsafe, degree=degree)
    assert found.status == "undecided"


def test_sets_by_functions_in_a_box():
    """The same of a disc as of the box around it."""
    found = barrier(
        oscillator, square_box(2, 3.0), start=disc((1.0, 0.0), 0.02), unsafe=lambda x: -0.95 - x[0]
    )
    assert found.status == "proved"


@pytest.mark.parametrize("c", [-0.5, 0.0, 0.01, 0.5])
def test_sums_of_squares_prove_what_is_positive_alone(c):
    """x^4 - 2 x^2 + 1 + c is (x^2 - 1)^2 + c; Motzkin's form is positive and no sum of squares."""
    ring = fmpq_mpoly_ctx.get(("x", "y"), Ordering.lex)
    x, y = ring.gen(0), ring.gen(1)
    ways = {
        "square": x**4 - 2 * x**2 + 1 + fmpq(*c.as_integer_ratio()),
        "Motzkin": x**4 * y**2 + x**2 * y**4 - 3 * x**2 * y**2 + 1 + fmpq(*c.as_integer_ratio()),
    }
    for name, p in ways.items():
        found, _ = positive_where([PositiveCondition(parts=[p])], 1)
        assert (found is not None and found[0] > 0) == (name == "square" and c > 0)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"system": pendulum_rates}, "polynomials"),
        ({"box": Box.of(x1=(-np.inf, np.inf), x2=(-1, 1))}, "all finite or all infinite"),
        ({"start": lambda x: (x[0], x[1])}, "one number"),
    ],
)
def test_barriers_in_space_name_what_is_wrong(change, message):
    given = {"system": saddles, "box": EVERYWHERE, "start": disc((1.5, 0.0), 0.25)} | change
    with pytest.raises(ParameterError, match=message):
        barrier(given.pop("system"), given.pop("box"), **given)


def damped(t, x, u, p):
    """x'' + (2 - n) x' + x = 0: calm for n = 1, unstable from n = 3 on."""
    pushed = 0.0 * x[0]
    for _ in range(p["n"]):
        pushed = pushed + x[1]
    return [x[1], -x[0] - 2.0 * x[1] + pushed]


def test_integers_that_are_given_steer_what_is_proved():
    """Of a diagram that is compiled once: with n = 1 it is proved, with n = 4 it is false."""
    diagram = ct.nlsys(damped, None, inputs=0, states=2, name="s", params={"n": 1})
    loop = nlctl.compile(diagram)
    box, start = Box.of(x1=(-3, 3), x2=(-3, 3)), Box.of(x1=(0.9, 1.1), x2=(-0.1, 0.1))
    far = {"start": start, "unsafe": Box.of(x1=(-3, -0.95), x2=(-3, 3))}
    for n, status in ((1, "proved"), (4, "undecided"), (1, "proved")):
        assert barrier(loop, box, params={"n": n}, **far).status == status
    run = nlctl.input_output_response(loop, np.linspace(0, 4, 41), 0, [1.0, 0.0], params={"n": 4})
    assert run.states.min() < -0.95


def test_a_set_that_is_proved_is_not_larger_in_words():
    """A level is rounded down, and what is not proved beyond it up; the box's own is no refuted."""
    found = region_of_attraction(van_der_pol, square_box(2, 3.0), P=KHALIL)
    first, _, rest = str(found).removeprefix("V <= ").partition(" proved on ")
    assert 0 <= found.level - float(first) <= 1e-5
    assert float(rest.partition("; ")[2].partition(" is not")[0]) >= found.above
    assert f"V <= {first} everything" in found.claim
    whole = region_of_attraction(cube, square_box(1, 1.0), P=[[1.0]])
    assert whole.level == whole.above
    assert "more is not: the box: take a larger one" in str(whole)


@pytest.mark.parametrize("seed", [4, 16, 35])
def test_an_ellipsoid_reaches_no_less_far_than_it_is_said(seed):
    """(P^-1)_ii exactly; that of floats is 1e-5 less for such P."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.standard_normal((2, 2)))[0]
    P = Q @ np.diag([1.0, 1e-12]) @ Q.T
    P = 0.5 * (P + P.T)
    (a, b), (_, c) = [[Fraction(float(v)) for v in row] for row in P]
    for reach, square in zip(reach_of_level(P, 0.3), (c, a), strict=True):
        assert Fraction(float(reach)) ** 2 >= Fraction(0.3) * square / (a * c - b * b)


@pytest.mark.parametrize("P", [[[0.5, 1.5], [1.5, 4.5]], [[1.0, np.nan], [np.nan, 1.0]]])
def test_a_matrix_that_floats_take_for_definite_is_refused(P):
    """The first has the determinant 0 and, in floats, no eigenvalue that is not above it."""
    with pytest.raises(ParameterError, match="positive definite"):
        region_of_attraction(lambda x: (-x[0], -x[1]), square_box(2, 1.0), P=P)


@pytest.mark.weekly
def test_a_point_on_the_way_is_named_as_what_is_missing():
    """No barrier is between a start and a point that it comes to."""
    start, unsafe = Box.of(x1=(2, 2), x2=(0, 0)), Box.of(x1=(1, 1), x2=(0, 0))
    found = barrier(lambda x: (-x[0], -x[1]), square_box(2, 3.0), start=start, unsafe=unsafe)
    assert str(found) == "undecided: not proved: B' < 0 where B = 0"


def spiral(rate):
    """V = x1^2 + x2^2 has V' = 2 rate V."""
    return lambda x: (x[1] + rate * x[0], -x[0] + rate * x[1])


@pytest.mark.parametrize("rate", [-1e-10, 1e-6, 0.0])
def test_what_falls_slowly_is_not_refuted(rate):
    """A margin of 1e-9 is asked for; where there is less of it V' < 0 is true, and undecided."""
    given = {"box": square_box(2, 1.0), "level": 0.9, "floor": 0.1}
    found = prove_decrease(lambda x: x[0] ** 2 + x[1] ** 2, spiral(rate), **given)
    assert found.status == ("undecided" if rate < 0 else "refuted")
    x = np.array([found.where[name] for name in ("x1", "x2")])
    assert abs(found.value - 2 * rate * x @ x) <= 1e-9 * abs(rate)


def test_a_refuted_level_has_a_point_where_v_does_not_fall():
    """x' = a (x^3 - x) rises from 1 on, however slowly; V' > -1e-9 is no counterexample."""
    for a in (1.0, 1e-3, 1e-6):
        found = region_of_attraction(lambda x, a=a: (a * (x[0] ** 3 - x[0]),), square_box(1, 1.5),
                                     P=[[1.0]])  # fmt: skip
        assert found.level <= 1.0
        if found.refuted is not None:
            assert abs(found.refuted["x1"]) >= 1.0
            assert "V' >= 0 at a point" in found.reason
        else:
            assert "V' >= 0" not in found.reason


@pytest.mark.parted
@pytest.mark.parametrize("lost", [
    lambda x: np.sqrt(np.abs(x[0]) - 0.05), lambda x: 0.01 * x[0] / (x[0] - 0.1) ** 2,
])  # fmt: skip
def test_nothing_is_safe_that_comes_to_where_rates_have_no_value(lost):
    """From 0.3 to 0.05, or to a pole at 0.1, which is within any set around the equilibrium."""
    sets = {"start": Box.of(x1=(0.2, 0.4)), "unsafe": Box.of(x1=(0.6, 1))}
    assert barrier(lambda x: (-x[0],), square_box(1, 1.0), **sets).claim == "safe for all time"
    found = barrier(lambda x: (-x[0] - lost(x),), square_box(1, 1.0), **sets)
    assert found.status == "undecided"
