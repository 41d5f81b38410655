"""A compiled diagram in other processes, and in several threads at once."""

import copy
import multiprocessing
import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import control as ct
import numpy as np
import pytest

import nlctl

TIMES = np.linspace(0, 1, 11)


def third_party_loop():
    """Lambdas, a closure over an array and over a function, and a linear block."""
    weights = np.array([0.3, -1.2])

    def bend(v):
        return np.tanh(v) - 0.1 * v

    plant = ct.nlsys(
        lambda t, x, u, params: [x[1], weights @ x + params["b"] * bend(u[0])],
        lambda t, x, u, params: x[0],
        inputs="u", outputs="y", states=2, name="plant", params={"b": 2.0},
    )  # fmt: skip
    control = ct.tf([1.0, 2.0], [0.1, 1.0], inputs="e", outputs="u", name="control")
    error = ct.summing_junction(["r", "-y"], "e", name="error")
    return ct.interconnect([plant, control, error], inputs="r", outputs=["y", "u"], name="loop")


def run(compiled, initial, params):
    """What a worker does."""
    response = nlctl.input_output_response(compiled, TIMES, 1.0, initial, params=params)
    return np.vstack([response.outputs, response.states])


CASES = {
    "example 1": (nlctl.paper.example_1, {"plant.x1": 0.7}, {"actuator.b_r": 0.6}),
    "example 2": (nlctl.paper.example_2, None, None),
    "third-party": (third_party_loop, [0.1, 0.2, 0.3], {"b": 3.0}),
}


@pytest.mark.ci
def test_a_spawned_process_computes_the_same_bits():
    """Paper examples and other people's closures, by pickle, in fresh interpreters."""
    compiled = {name: nlctl.compile(make()) for name, (make, _, _) in CASES.items()}
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        futures = {
            name: pool.submit(run, compiled[name], initial, params)
            for name, (_, initial, params) in CASES.items()
        }
        for name, (_, initial, params) in CASES.items():
            here = run(compiled[name], initial, params)
            np.testing.assert_array_equal(futures[name].result(timeout=120), here)


@pytest.mark.parted
@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda c: pickle.loads(pickle.dumps(c))])
@pytest.mark.parametrize("name", CASES)
def test_a_copy_is_complete_and_independent(name, duplicate):
    """Source, labels, initial state and parameters; assigning one leaves the other alone."""
    original = nlctl.compile(CASES[name][0]())
    found = duplicate(original)
    assert found.source == original.source
    assert repr(found) == repr(original)
    assert found.system.output_labels == original.system.output_labels
    np.testing.assert_array_equal(
        nlctl.initial_state(found.system), nlctl.initial_state(original.system)
    )
    before = original.parameter_vector()
    np.testing.assert_array_equal(found.parameter_vector(), before)
    found.parameter_vector(CASES[name][2])
    np.testing.assert_array_equal(original.parameter_vector(), before)


def test_an_error_in_a_copy_still_names_the_parameter():
    """Qualified names are checked in a worker as they are at home."""
    found = pickle.loads(pickle.dumps(nlctl.compile(nlctl.paper.example_1())))
    with pytest.raises(ValueError, match=r"unknown parameter 'actuator\.b_q'.*b_r"):
        found.parameter_vector({"actuator.b_q": 1.0})


def test_threads_resolve_parameters_without_disturbing_each_other():
    """python-control keeps overrides in the blocks; every thread still gets its own."""
    compiled = nlctl.compile(third_party_loop())
    expected = {b: compiled.parameter_vector({"b": b}) for b in np.arange(40.0)}
    with ThreadPoolExecutor(8) as pool:
        for _ in range(5):
            found = pool.map(lambda b: compiled.parameter_vector({"b": b}), expected)
            for b, p in zip(expected, found, strict=True):
                np.testing.assert_array_equal(p, expected[b])
