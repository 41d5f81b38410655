"""Other people's functions as they stand: objects, methods, imports, and NumPy that numba lacks."""

import functools

import control as ct
import numpy as np
import pytest
from plain_plan import compare

from nlctl.errors import CompileError, ParameterError, UsageError
from nlctl.native.compiled import compile as compile_diagram
from nlctl.native.machine.fingerprint import function_key
from nlctl.native.purity.objects import frozen


class Tank:
    """Somebody's model, with numbers and matrices as attributes."""

    def __init__(self, rate):
        self.rate = rate
        self.matrix = np.array([[0, 1], [-2, -3]])  # integers

    def update(self, t, x, u, params):
        a, b = x
        return [b, -self.rate * a + params["b"] * u[0]]

    def __call__(self, t, x, u, params):
        return self.matrix @ x - self.rate * x


TANK = Tank(0.7)


def through_a_global(t, x, u, params):
    return TANK.matrix @ x * TANK.rate


class Plant:
    tank = TANK


PLANT = Plant()


def through_two_objects(t, x, u, params):
    return PLANT.tank.rate * x + PLANT.tank.matrix.shape[0]


def gained(k, t, x, u, params):
    return k * x + params["b"]


def importing(t, x, u, params):
    import math
    from math import sin as sine

    return [sine(x[0]), math.exp(-x[1]) * params["b"]]


def recursive(t, x, u, params):
    return [power(x[0], 3), x[1]]


def power(v, n):
    return 1.0 if n == 0 else v * power(v, n - 1)


def clipped(t, x, u, params):
    """np.clip of numbers and arrays, open on one side; abs of an array; products of integers."""
    whole = np.array([[1, 2], [3, 4]])
    return (
        np.clip(x, -0.5, 0.5) + np.clip(u[0], -1, 1) + np.clip(x[0], None, 0.2)
        + np.clip(x[1], 0, None) + abs(x) + np.dot(whole, x) + (whole @ whole)[0] + np.array(x)
    )  # fmt: skip


def closing_over(matrix):
    system = ct.ss(matrix, [[0.0], [1.0]], [[1.0, 0.0]], [[0.0]])
    return lambda t, x, u, params: system.A @ x + system.B @ u


FUNCTIONS = {
    "method": TANK.update,
    "object": TANK,
    "global object": through_a_global,
    "partial": functools.partial(gained, 2.0),
    "imports": importing,
    "nested objects": through_two_objects,
    "numpy": clipped,
    "closure": closing_over(np.array([[0.0, 1.0], [-1.0, -0.4]])),
}


def system(update):
    return ct.nlsys(update, None, inputs=["u"], states=2, name="b", params={"b": 1.5})


@pytest.mark.parametrize("native", [False, True])
@pytest.mark.parametrize("kind", FUNCTIONS)
def test_functions_compile_as_they_stand(kind, native):
    """Each agrees with python-control at random points."""
    compare(system(FUNCTIONS[kind]), native=native)


@pytest.mark.parametrize("native", [False, True])
def test_a_linear_system_as_a_nonlinear_one(native):
    """ct.nlsys(ct.ss(...)) closes over the linear system."""
    compare(ct.nlsys(ct.rss(3, 2, 2)), native=native)


def test_what_an_object_holds_is_fixed_when_compiled():
    """A change afterwards needs a new compilation."""
    tank = Tank(1.0)
    compiled = compile_diagram(system(tank.update))
    tank.rate = 5.0
    with pytest.raises(UsageError, match=r"'rate' was 1.0 when 'b' was compiled and is 5.0 now"):
        compiled.dynamics(0, [2.0, 3.0], [0.0])
    np.testing.assert_allclose(
        compile_diagram(system(tank.update)).dynamics(0, [2.0, 3.0], [0.0]), [3.0, -10.0]
    )


def test_the_cache_tells_objects_apart():
    """Two systems whose functions differ in a large array deep inside an object alone."""
    found = []
    for last in (1.0, 2.0):
        tank = Tank(1.0)
        tank.matrix = np.zeros((2, 2000))
        tank.matrix[:, 1000] = last  # where a printed array shows dots

        closed = tank.matrix

        def by_closure(t, x, u, params):
            return x * closed[0, 1000]  # noqa: B023

        def by_object(t, x, u, params):
            return x * tank.matrix[0, 1000]  # noqa: B023

        found.append(
            [compile_diagram(system(f)).dynamics(0, [1.0, 1.0], [0.0])[0]
             for f in (by_closure, by_object)]
        )  # fmt: skip
    assert found == [[1.0, 1.0], [2.0, 2.0]]


def test_a_function_that_calls_itself_is_written_out():
    """As far as it goes."""
    compare(system(recursive), native=True)


def halved(v):
    return v if v < 1.0 else halved(0.5 * v)


@pytest.mark.weekly
def test_a_function_that_calls_itself_until_its_value_is_small_is_called_in_python():
    """numba has no recursion across functions."""
    block = system(lambda t, x, u, params: [halved(x[0]), x[1]])
    compare(block)
    compare(block, native=True)


def test_functions_without_objects_stay_as_they_are():
    """The very same function: nothing is copied without need."""
    assert frozen(recursive) is recursive
    assert frozen(clipped) is clipped


def test_the_cache_tells_modules_apart():
    """What is on disk refers to a function's module, which may be gone when another one asks."""
    keys = set()
    for module in ("first", "second"):

        def update(t, x, u, params):
            return x

        update.__module__ = module
        keys.add(function_key("", {"update": update}))
    assert len(keys) == 2


def test_sizes_that_machine_code_would_read_beyond_are_refused():
    """A diagram that was told another number of states, and vectors of another length."""
    block = system(lambda t, x, u, params: x)
    with pytest.raises(CompileError, match="made with states=0, but its blocks have 2"):
        compile_diagram(ct.InterconnectedSystem([block], inputs=0, outputs=0, states=0))
    with pytest.raises(ParameterError, match="x needs 2 values, got 1"):
        compile_diagram(block).dynamics(0, [1.0], [0.0])
