"""Blocks that do not declare their signals take their numbers from a run, as in python-control."""

import control as ct
import numpy as np
import pytest

import nlctl

TIMES = np.linspace(0, 1, 50)


@pytest.mark.parametrize(
    "inputs",
    [[0, 1], (0.0, np.ones(50)), [np.zeros(50), 1], np.vstack([np.zeros(50), np.ones(50)])],
)
def test_a_list_has_an_entry_for_each_input(inputs):
    """x' = u - x from 0: the second state is 1 - exp(-t)."""
    block = ct.nlsys(lambda t, x, u, params: -x + u, lambda t, x, u, params: x[:1], name="s")
    response = nlctl.input_output_response(block, TIMES, inputs, [0, 0], rtol=1e-9, atol=1e-11)
    expected = [np.zeros(50), 1 - np.exp(-TIMES)]
    np.testing.assert_allclose(response.states, expected, atol=1e-7)
    assert response.inputs.shape == (2, 50)


def test_as_many_numbers_as_times_are_the_samples_of_one_input():
    block = ct.nlsys(lambda t, x, u, params: -x + u, None, name="s")
    response = nlctl.input_output_response(block, [0.0, 1.0], [1.0, 1.0], [0.0])
    np.testing.assert_array_equal(response.inputs, [1.0, 1.0])
