"""Linear equations of more than six rows: one operation, with derivative, in every reader."""

import math

import control as ct
import numpy as np
import pytest
from examples import crossed
from exported import evaluated
from plain_plan import interpreted

import nlctl
from nlctl.errors import ParameterError
from nlctl.export import c_files, export_equations
from nlctl.expressions.arrays import leaf_vector
from nlctl.expressions.dependence import affine
from nlctl.expressions.derivatives import tangents
from nlctl.expressions.evaluate import evaluate_expressions
from nlctl.expressions.graph import Graph, needed
from nlctl.expressions.jacobian_source import jacobian_function
from nlctl.expressions.trace import trace
from nlctl.native.enclosures.boxes import enclosed, expressions_of

ROWS = (7, 8, 9, 13, 20)


def dense(n, seed=0):
    """Rates with a dense matrix that depends on the state, and whose rows must be exchanged."""
    rng = np.random.default_rng(100 * n + seed)
    first, second = rng.normal(size=(2, n, n))
    np.fill_diagonal(first, 0.0)

    def update(t, x, u, params):
        matrix = first + params["k"] * np.outer(np.cos(x), x) + second * u[0]
        return np.linalg.solve(matrix, np.sin(x) - u[0]) - x

    return ct.nlsys(update, None, inputs="u", outputs=n, states=n, name="dense", params={"k": 0.3})


def chain(n):
    """Masses that hang one below the other, as links of an arm: the mass matrix moves."""
    below = n - np.maximum.outer(np.arange(n), np.arange(n)).astype(float)
    driven = np.eye(n)[0]

    def update(t, x, u, params):
        q, v = x[:n], x[n:]
        apart = q[:, None] - q[None, :]
        mass = below * np.cos(apart) + params["inertia"] * np.eye(n)
        rest = (below * np.sin(apart)) @ v**2 + 9.81 * np.diag(below) * np.sin(q) + 0.2 * v
        return np.concatenate([v, np.linalg.solve(mass, u[0] * driven - rest)])

    return ct.nlsys(update, None, inputs="u", outputs=2 * n, states=2 * n, name="chain",
                    params={"inertia": 0.5})  # fmt: skip


def of_inverse(n):
    """Rates with an inverse and a determinant."""
    rng = np.random.default_rng(n)
    first = rng.normal(size=(n, n))

    def update(t, x, u, params):
        matrix = first + np.outer(x, np.cos(x)) + u[0]
        gain = np.linalg.inv(matrix)
        return gain @ x - x + np.tanh(np.linalg.det(matrix)) * gain[0]

    return ct.nlsys(update, None, inputs="u", outputs=n, states=n, name="inverse")


def assembled(n):
    """A band that is written element by element."""

    def update(t, x, u, params):
        matrix = 3.0 * np.eye(n)
        for i in range(n - 1):
            matrix[i, i + 1] = np.sin(x[i])
            matrix[i + 1, i] -= x[i + 1] * u[0]
        matrix[0] += 0.1
        matrix[:, -1] = x
        return np.linalg.solve(matrix, x)

    return ct.nlsys(update, None, inputs="u", outputs=n, states=n, name="band")


SYSTEMS = {"dense": dense, "inverse": of_inverse, "band": assembled}


def points(system, count=3):
    rng = np.random.default_rng(1)
    return [(0.0, rng.normal(size=system.nstates), rng.normal(size=1)) for _ in range(count)]


@pytest.mark.parametrize(("n", "kind"), crossed([*ROWS], [*SYSTEMS]))
def test_rates_are_those_of_numpy(kind, n):
    """Also where rows are exchanged: the diagonal may be 0."""
    system = SYSTEMS[kind](n)
    compiled = nlctl.compile(system)
    assert "Jacobian     exact\n" in str(compiled)
    for point in points(system):
        wanted = system.dynamics(*point)
        np.testing.assert_allclose(
            compiled.dynamics(*point), wanted, rtol=1e-11, atol=1e-11 * np.abs(wanted).max()
        )


def test_accelerations_of_a_chain_are_those_of_python_control():
    """Well conditioned, to the last digits; no condition is located in it."""
    system = chain(8)
    compiled = nlctl.compile(system)
    for point in points(system, 20):
        wanted = system.dynamics(*point)
        np.testing.assert_allclose(compiled.dynamics(*point), wanted, rtol=1e-12, atol=1e-11)
    assert "conditions" not in str(compiled)


def richardson(function, x):
    """Return the Jacobian matrix by central differences, extrapolated to a step of 0."""

    def differences(h):
        return np.stack(
            [(function(x + h * e) - function(x - h * e)) / (2 * h) for e in np.eye(x.size)], axis=1
        )

    return (4 * differences(5e-4) - differences(1e-3)) / 3


@pytest.mark.parametrize("system", [chain(8), dense(7), dense(13), of_inverse(7), of_inverse(9)],
                         ids=lambda s: f"{s.name}{s.nstates}")  # fmt: skip
def test_a_linearization_is_that_of_differences(system):
    x, u = 0.3 * np.cos(np.arange(system.nstates)), np.array([0.2])
    found = nlctl.compile(system).linearize(x, u)
    for matrix, wanted in (
        (found.A, richardson(lambda v: system.dynamics(0.0, v, u), x)),
        (found.B, richardson(lambda v: system.dynamics(0.0, x, v), u)),
    ):
        np.testing.assert_allclose(matrix, wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


@pytest.fixture(scope="module")
def run_of_chain():
    """A run of the chain that SciPy has integrated with python-control's own functions."""
    system, times = chain(8), np.linspace(0.0, 0.3, 4)
    start = np.concatenate([0.4 * np.cos(np.arange(8.0)), np.zeros(8)])
    wanted = ct.input_output_response(
        system, times, np.sin(times), start,
        solve_ivp_method="DOP853", solve_ivp_kwargs={"rtol": 1e-10, "atol": 1e-12},
    )  # fmt: skip
    return system, times, start, wanted.states


@pytest.mark.parametrize("method", ["tsit5", "rodas5p", "taylor"])
def test_every_method_runs_it(method, run_of_chain):
    system, times, start, wanted = run_of_chain
    found = nlctl.input_output_response(
        nlctl.compile(system), times, np.sin(times), start, method=method, rtol=1e-9, atol=1e-11
    )
    np.testing.assert_allclose(found.states, wanted, rtol=1e-6, atol=1e-7)


def test_members_of_an_ensemble_have_pivots_of_their_own():
    """Rows are exchanged member by member."""
    system, times = dense(7), np.linspace(0.0, 0.2, 3)
    compiled, k = nlctl.compile(system), np.linspace(-1.0, 1.0, 11)
    start = {f"x[{i}]": 0.1 * i for i in range(7)}
    every = nlctl.ensemble_response(
        compiled, times, 0.3, initial_state=start, params={"k": k}, keep=["y[0]"]
    )
    for i, one in enumerate(k):
        alone = nlctl.input_output_response(compiled, times, 0.3, start, params={"k": one})
        np.testing.assert_allclose(every.signals["y[0]"][i], alone.outputs[0], rtol=1e-9)


def test_sensitivities_of_a_run_are_those_of_differences():
    system, times = chain(8), np.linspace(0.0, 0.3, 3)
    compiled, start = nlctl.compile(system), {"x[0]": 0.4, "x[3]": -0.2}
    made = nlctl.sensitivity_response(
        system, times, 1.0, start, of=["y[0]"], with_respect_to=["chain.inertia", "chain.x[3](0)"]
    )
    assert made.success

    def end(inertia, angle):
        found = nlctl.input_output_response(
            compiled, times, 1.0, {**start, "x[3]": angle}, params={"inertia": inertia},
            rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        return found.outputs[0]

    jacobian = [
        richardson(lambda v: end(v[0], -0.2), np.array([0.5]))[:, 0],
        richardson(lambda v: end(0.5, v[0]), np.array([-0.2]))[:, 0],
    ]
    for name, wanted in zip(("chain.inertia", "chain.x[3](0)"), jacobian, strict=True):
        np.testing.assert_allclose(made["y[0]", name], wanted, rtol=1e-6, atol=1e-9)


def test_plain_python_carries_out_the_same_plan():
    """Without machine code the plan's own levels and places serve."""
    for system in (dense(7), of_inverse(9)):
        compiled = nlctl.compile(system)
        rhs, _ = interpreted(compiled)
        n, dx = system.nstates, np.zeros(system.nstates)
        for t, x, u in points(system):
            rhs(t, x, u, compiled.parameter_vector(), dx, np.zeros(1), np.zeros(n))
            np.testing.assert_allclose(dx, compiled.dynamics(t, x, u), rtol=1e-10, atol=1e-10)


def of_parameters(t, x, u, params):
    """A matrix of parameters alone: its factors are computed once for a run."""
    matrix = params["k"] * np.eye(8) + np.ones((8, 8))
    return np.linalg.solve(matrix, u[0] - x)


def test_factors_of_parameters_are_computed_in_advance():
    system = ct.nlsys(of_parameters, None, inputs="u", outputs=8, states=8, name="p",
                      params={"k": 2.0})  # fmt: skip
    compiled, point = nlctl.compile(system), (0.0, np.arange(8.0), np.array([3.0]))
    text = compiled.lowered.text
    assert "lu." in text.partition("@rhs(")[0].partition("@prepare(")[2]
    for k in (0.5, 7.0):  # Sherman and Morrison: ((v - sum(v) / (k + 8)) / k
        v = 3.0 - point[1]
        wanted = (v - v.sum() / (k + 8.0)) / k
        np.testing.assert_allclose(compiled.dynamics(*point, {"k": k}), wanted, rtol=1e-13)


def test_what_is_singular_is_an_error_in_python_and_not_a_number_in_machine_code():
    """The last row is 0 unless the input is not."""

    def update(t, x, u, params):
        matrix = first + np.outer(u[0] * unit, x)
        return np.linalg.solve(matrix, x) + 0.0 * np.linalg.det(matrix)

    first, unit = np.triu(np.ones((7, 7))), np.eye(7)[6]
    first[6] = 0.0
    system = ct.nlsys(update, None, inputs="u", outputs=7, states=7, name="s")
    compiled, x = nlctl.compile(system), np.arange(1.0, 8.0)
    np.testing.assert_allclose(
        compiled.dynamics(0.0, x, [1.0]), system.dynamics(0.0, x, [1.0]), rtol=1e-13
    )
    with pytest.raises(np.linalg.LinAlgError):
        system.dynamics(0.0, x, [0.0])
    assert np.isnan(compiled.dynamics(0.0, x, [0.0])).all()


@pytest.mark.parametrize("row", [0, 3, 8])
def test_nan_travels(row):
    system = dense(9)
    x = np.ones(9)
    x[row] = np.nan
    assert np.isnan(nlctl.compile(system).dynamics(0.0, x, [1.0])).all()
    assert np.isnan(system.dynamics(0.0, x, [1.0])).all()


def test_a_determinant_of_zero_is_zero():
    """NumPy raises no error for it."""

    def update(t, x, u, params):
        return np.linalg.det(np.outer(x, x + 1.0) + u[0] * np.diag(np.arange(7.0))) - x

    system = ct.nlsys(update, None, inputs="u", outputs=7, states=7, name="s")
    x = np.array([2.0, 1.0, 4.0, 8.0, 2.0, 1.0, 0.5])
    found = nlctl.compile(system).dynamics(0.0, x, [0.0])
    np.testing.assert_allclose(found, -x, atol=1e-12)
    np.testing.assert_allclose(nlctl.compile(system).dynamics(0.0, x, [1.0]),
                               system.dynamics(0.0, x, [1.0]), rtol=1e-11)  # fmt: skip


def of_six_angles(x):
    """A function of a box with a solution of seven equations, and another with a determinant."""
    angles = np.array([0.3, x[0], x[1], 0.1, x[0] * x[1], -0.2, 0.5])
    matrix = np.cos(angles[:, None] - angles[None, :]) + 6.0 * np.eye(7)
    solution = np.linalg.solve(matrix, np.sin(angles))
    return solution[0], solution[6], np.linalg.det(matrix)


@pytest.mark.weekly
def test_enclosures_hold_every_sample():
    """Elimination is written out for them; where a box is small its pivots are certain."""
    _, exprs = expressions_of(of_six_angles, 2)
    code, rng = enclosed(exprs, 2), np.random.default_rng(0)
    middle = rng.uniform(-1.0, 1.0, (20, 2))
    low, high = middle - 1e-3, middle + 1e-3
    below, above = code.values(low, high)
    assert np.all(above - below < 0.1 * (1.0 + np.abs(above)))
    for share in rng.uniform(size=(10, 20, 2)):
        value = np.array([of_six_angles(x) for x in low + share * (high - low)])
        assert np.all((below <= value + 1e-9) & (value <= above + 1e-9 * np.abs(value)))


def test_a_formula_has_the_matrix():
    """x' = (k I + 1 1')^-1 (u - x), component by component."""

    system = ct.nlsys(of_parameters, None, inputs="u", outputs=8, states=8, name="p",
                      params={"k": 2.0})  # fmt: skip
    (block,) = nlctl.typeset(system)
    assert block.equations[7].startswith(r"\dot{x}_{8} = s_{1,8}")
    (where,) = block.where
    assert where.startswith(r"s_{1,i} = \left(\begin{pmatrix} k + 1 & 0 k + 1")
    assert where.endswith(r"\end{pmatrix}\right)_{i}, \quad i = 1, \dots, 8")
    assert where.count("&") == 8 * 7
    assert where.count("k + 1") == 64
    assert r"\end{pmatrix}^{-1} \begin{pmatrix} u - x_{1} \\ u - x_{2}" in where
    (block,) = nlctl.typeset(of_inverse(9))
    whole = next(line for line in block.where if line.endswith(r"\dots, 81"))
    assert r" = \operatorname{vec}\left(\left(\begin{pmatrix}" in whole
    assert r"\end{pmatrix}\right)^{T}\right)_{i}, \quad i = 1, \dots, 81" in whole
    assert any(r"\det \begin{pmatrix}" in line for line in (*block.where, *block.equations))


def test_a_determinant_has_no_taylor_coefficients():
    with pytest.raises(ParameterError, match="coefficients of the determinant of 7 rows"):
        nlctl.input_output_response(of_inverse(7), [0.0, 0.1], 0.0, np.ones(7), method="taylor")


@pytest.mark.ci
@pytest.mark.parametrize("system", [chain(8), dense(7), of_inverse(9)], ids=lambda s: s.name)
def test_c_computes_the_same(tmp_path, system):
    """The routine that is written as machine code is written as C."""
    equations = export_equations(system, name="exported")
    given = points(system)
    for (t, x, u), (dx, _) in zip(given, evaluated(tmp_path, equations, given), strict=True):
        wanted = system.dynamics(t, x, u)
        np.testing.assert_allclose(dx, wanted, rtol=1e-10, atol=1e-10 * np.abs(wanted).max())
    n = 8 if system.name == "chain" else system.nstates
    source = c_files(equations)["exported.c"]
    assert f"1 LU factorisation of {n} x {n}" in source.replace("\n", " ")


def in_a_loop(t, x, u, params):
    """An output that depends on the input of the same block."""
    matrix = np.eye(7) * 3.0 + np.outer(np.cos(x), np.ones(7)) * np.cos(u[0])
    return np.linalg.solve(matrix, np.ones(7))[:1]


def test_algebraic_loops_are_solved_through_it():
    """y = e1' A(y)^-1 1: python-control finds no value of it, the equation says which it is."""
    block = ct.nlsys(lambda t, x, u, params: -x, in_a_loop, inputs="v", outputs="y", states=7,
                     name="b")  # fmt: skip
    loop = nlctl.interconnect(
        [block], connections=[["b.v", "b.y"]], inputs=[], inplist=[], outlist=["b.y"], outputs=["y"]
    )
    x = 0.2 * np.arange(7.0)
    (y,) = nlctl.compile(loop, algebraic_loops="solve").output(0.0, x)
    np.testing.assert_allclose(in_a_loop(0.0, x, [y], {}), [y], rtol=1e-10)


def of_seven(x, k):
    matrix = np.diag(3.0 + np.cos(x)) + k * np.outer(x, x)
    return np.linalg.solve(matrix, np.sin(x)) * np.linalg.det(matrix)


def test_a_jacobian_as_a_function_of_numpy():
    """As the extended Kalman filter has it."""
    x, k = 0.3 * np.arange(7.0), np.array([0.2])
    found = jacobian_function(of_seven, 7, 1)(x, k)
    wanted = richardson(lambda v: of_seven(v, k), x)
    np.testing.assert_allclose(found, wanted, rtol=1e-7, atol=1e-7 * np.abs(wanted).max())


@pytest.mark.parametrize("right", [np.ones(7), np.eye(7), np.ones((2, 7, 3))])
def test_many_systems_at_once_are_one_after_the_other(right):
    """Right-hand sides are one vector or matrix for all, or one for each."""

    def update(t, x, u, params):
        matrices = np.stack([np.eye(7) + x[0], np.eye(7) - x[1] ** 2])
        solution = np.linalg.solve(matrices, right)
        return solution.reshape(2, 7, -1).sum(axis=2)[1] + np.linalg.det(matrices)[0]

    x = 0.1 + 0.1 * np.arange(7.0)
    system = ct.nlsys(update, None, inputs="u", outputs=7, states=7, name="many")
    found = nlctl.compile(system).dynamics(0.0, x, [0.0])
    np.testing.assert_allclose(found, update(0.0, x, [0.0], {}), rtol=1e-12)


@pytest.mark.parametrize("x", [2.75, -2.75, 0.0, np.inf, -np.inf, np.nan])
def test_modf_is_that_of_python(x):
    """math.modf, with both signs and at infinity; both parts of NaN are NaN."""

    def update(t, x, u, params):
        rest, whole = math.modf(x[0])
        return np.array([rest, whole])

    system = ct.nlsys(update, None, inputs="u", outputs=2, states=2, name="parts")
    compiled = nlctl.compile(system)
    assert "Jacobian     exact" in str(compiled)
    np.testing.assert_array_equal(compiled.dynamics(0.0, [x, 0.0], [0.0]), math.modf(x))


@pytest.mark.parametrize("n", [7, 20, 40])
def test_a_constant_matrix_is_factorised_in_advance(n):
    """What a step computes is the substitution, which is affine in the right-hand side."""
    matrix = np.random.default_rng(n).normal(size=(n, n))
    system = ct.nlsys(lambda t, x, u, params: np.linalg.solve(matrix, x - u[0]), None, inputs="u",
                      outputs=n, states=n, name="constant")  # fmt: skip
    compiled = nlctl.compile(system)
    found = compiled.linearize(np.ones(n), [0.5])
    wanted = np.linalg.inv(matrix)
    bound = 1e-14 * np.linalg.cond(matrix)
    np.testing.assert_allclose(found.A, wanted, atol=bound * np.abs(wanted).max())
    parts = [e for e, _ in compiled.equations.pieces("dx")]
    u = next(e for e in needed(parts) if e.op == "leaf" and e.data[0] == "u")
    assert all(affine(e, u) for e in parts)


def test_second_derivatives_follow():
    """Of a solution and a determinant: derivatives of derivatives, as differences of these."""
    graph = Graph({"x": 2})
    x, wanted = leaf_vector(graph, "x", 0, (2,)), of_six_angles
    results = [e for e, _ in trace(graph, lambda v: np.array(wanted(v)), lambda: (x,)).pieces()]
    along = lambda exprs, k: tangents(graph, exprs, lambda e: graph.const(float(e.data[1] == k)))  # noqa: E731
    second = along(along(results, 0), 1)

    def first(v):
        return np.array(evaluate_expressions(along(results, 0), {"x": v[:, None]}))[:, 0]

    at = np.array([0.3, -0.4])
    found = np.array(evaluate_expressions(second, {"x": at[:, None]}))[:, 0]
    np.testing.assert_allclose(found, richardson(first, at)[:, 1], rtol=1e-7)
