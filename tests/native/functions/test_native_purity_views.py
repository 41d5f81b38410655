"""Rows and other views share the memory of an array, numbers of it do not."""

import copy
import itertools

import control as ct
import numpy as np
import pytest
import scipy.linalg

import nlctl
from nlctl.errors import CompileError

GAINS = np.array([[1.0, 2.0], [3.0, 4.0]])
HALVES = {"first": slice(0, 2), "second": slice(2, 4)}
LINKS = np.rec.array([(1.0, 0.5), (2.0, 0.25)], dtype=[("mass", float), ("length", float)])
ORDER = np.array([1, 0])
X0 = [1.0, 2.0, 3.0, 4.0]


def loop_over_rows(t, x, u, p):
    for row in x.reshape(2, 2):
        row *= 1.1
    return -x


def rows_taken_apart(t, x, u, p):
    _a, b = x.reshape(2, 2)
    b *= 1.1
    return -x


def row_of_reshaped(t, x, u, p):
    r = np.reshape(x, (2, 2))[0]
    r += 0.01
    return -x


def row_by_keywords(t, x, u, p):
    r = np.ravel(a=x)
    r += 0.01
    return -x


def row_by_shape_of_variables(t, x, u, p):
    shape = (2, 2)
    r = x.reshape(shape)[0]
    r += 0.01
    return -x


def parts_of_split(t, x, u, p):
    _a, b = np.split(x, 2)
    b *= 1.1
    return -x


def rows_of_split_matrix(t, x, u, p):
    for half in np.vsplit(x.reshape(2, 2), 2):
        half[0] += 0.1
    return -x


def rows_of_unstack(t, x, u, p):
    first, _second = np.unstack(x.reshape(2, 2))
    first += 1.0
    return -x


def row_of_atleast(t, x, u, p):
    r = np.atleast_2d(x)[0]
    r += 0.01
    return -x


def one_of_several_atleast(t, x, u, p):
    _t, r = np.atleast_1d(t, x)
    r[0] = 0.01
    return -x


def row_by_new_axis(t, x, u, p):
    r = x[None, :][0]
    r += 0.01
    return -x


def row_by_expand_dims(t, x, u, p):
    r = np.expand_dims(x, 0)[0]
    r += 0.01
    return -x


def column_of_transposed(t, x, u, p):
    r = x.reshape(2, 2).T[0]
    r += 0.01
    return -x


def column_by_swapaxes(t, x, u, p):
    r = np.swapaxes(x.reshape(2, 2), 0, 1)[0]
    r += 0.01
    return -x


def element_of_a_row(t, x, u, p):
    _a, b = x.reshape(2, 2)
    b[0] = 1.1
    return -x


def row_by_index(t, x, u, p):
    X = x.reshape(2, 2)
    X[0] += 1
    return -x


def element_of_row_by_index(t, x, u, p):
    X = x.reshape(2, 2)
    X[0][1] = 2.5
    return -x


def row_by_variable(t, x, u, p):
    X = x.reshape(2, 2)
    for i in range(2):
        r = X[i]
        r *= 1.1
    return -x


def row_in_a_list(t, x, u, p):
    parts = list(x.reshape(2, 2))
    r = parts[0]
    r -= 0.1
    return -x


def row_in_a_comprehension(t, x, u, p):
    parts = [v for v in x.reshape(2, 2)]  # noqa: C416
    parts[0] -= 0.1
    return -x


def row_of_an_iterator(t, x, u, p):
    r = next(iter(x.reshape(2, 2)))
    r -= 0.1
    return -x


def row_of_zip(t, x, u, p):
    for r, v in zip(x.reshape(2, 2), u, strict=False):
        r += v + 1.0
    return -x


def row_of_enumerate(t, x, u, p):
    for i, r in enumerate(x.reshape(2, 2)):
        r += i + 1.0
    return -x


def row_of_pairs(t, x, u, p):
    for a, b in itertools.pairwise(x.reshape(2, 2)):
        a += b
    return -x


def no_axis_left(t, x, u, p):
    a = x[0, ...]
    a += 1.0
    return -x


def part_by_name(t, x, u, p):
    for name in HALVES:
        part = x[HALVES[name]]
        part *= 1.1
    return -x


def part_by_chosen_slice(t, x, u, p):
    s = HALVES["first"] if u[0] > 1 else HALVES["second"]
    part = x[s]
    part += 1.0
    return -x


def squeezed_diagonal(t, x, u, p):
    d = np.einsum("ii->i", x.reshape(2, 2))
    d += 1.0
    return -x


def real_part_of_rows(t, x, u, p):
    r = np.real_if_close(np.real(x.reshape(1, 4)))[0]
    r += 1.0
    return -x


def same_in_columns(t, x, u, p):
    r = np.asfortranarray(x)
    r += 1.0
    return -x


def without_zeros(t, x, u, p):
    r = np.trim_zeros(x)
    r += 1.0
    return -x


def strided(t, x, u, p):
    r = np.lib.stride_tricks.as_strided(x, (2,), (8,))
    r += 1.0
    return -x


def array_of_memory(t, x, u, p):
    r = np.ndarray((2,), float, x)
    r += 1.0
    return -x


def row_by_index_of_a_tuple(t, x, u, p):
    place = [None, slice(None)]
    r = x[tuple(place)][0]
    r *= 2.0
    return -x


def place_or_new_axis(t, x, u, p):
    place = None if u[0] < 9 else 0
    r = x[place][0]
    r *= 2.0
    return -x


def parts_in_array_of_objects(t, x, u, p):
    parts = np.empty(2, dtype=object)
    parts[0], parts[1] = x[:2], x[2:]
    parts[0] *= 2.0
    return -x


def row_helper(r):
    r *= 1.01
    return r.sum()


def row_for_a_helper(t, x, u, p):
    return -x * sum(row_helper(r) for r in x.reshape(2, 2))


def row_of_a_parameter(t, x, u, p):
    r = p["v"].reshape(2, 2)[1]
    r *= 1.02
    return -p["v"][3] * x


def row_of_a_captured_array(t, x, u, p):
    r = GAINS.ravel().reshape(2, 2)[0]
    r *= 1.01
    return -GAINS[0, 0] * x


def record_of_a_captured_array(t, x, u, p):
    link = LINKS[0]
    link["mass"] *= 1.01
    return -LINKS["mass"][0] * x


def solved_over_what_was_given(t, x, u, p):
    lower = np.array([[2.0, 0, 0, 0], [1, 2, 0, 0], [0, 1, 2, 0], [0, 0, 1, 2]])
    return -scipy.linalg.solve_triangular(lower, x, lower=True, overwrite_b=True)


WRITING = [
    loop_over_rows, rows_taken_apart, row_of_reshaped, row_by_keywords, row_by_shape_of_variables,
    parts_of_split, rows_of_split_matrix, rows_of_unstack, row_of_atleast,
    one_of_several_atleast, row_by_new_axis, row_by_expand_dims, column_of_transposed,
    column_by_swapaxes, element_of_a_row, row_by_index, element_of_row_by_index, row_by_variable,
    row_in_a_list, row_in_a_comprehension, row_of_an_iterator, row_of_zip, row_of_enumerate,
    row_of_pairs, no_axis_left, part_by_name, part_by_chosen_slice, squeezed_diagonal,
    real_part_of_rows, same_in_columns, without_zeros, strided, array_of_memory,
    row_by_index_of_a_tuple, place_or_new_axis, parts_in_array_of_objects, row_for_a_helper,
    row_of_a_parameter, row_of_a_captured_array, record_of_a_captured_array,
    solved_over_what_was_given,
]  # fmt: skip


def number_of_an_array(t, x, u, p):
    a = x[0]
    a += 1.0
    return -a * x


def number_of_a_matrix(t, x, u, p):
    X = x.reshape(2, 2)
    a, b = X[0, 1], X[1][0]
    a += 1.0
    b *= 2.0
    return -a * b * x


def number_by_shape_in_a_tuple(t, x, u, p):
    X = np.reshape(x, (2, 2))
    a = X[0, 1]
    a *= 2.0
    return -a * x


def numbers_taken_apart(t, x, u, p):
    (a, b), (c, d) = x.reshape(2, 2)
    a += b
    c *= d
    return [-a, -b, -c, -d]


def numbers_of_rows(t, x, u, p):
    total = 0.0
    for row in x.reshape(2, 2):
        for v in row:
            v *= 2.0
            total += v
    return -x + total


def numbers_of_zip(t, x, u, p):
    total = 0.0
    for row, v in zip(x.reshape(2, 2), x[:2], strict=True):
        v += row[0]
        s = row[1]
        s -= v
        total += s * v
    return -x + total


def numbers_of_enumerate(t, x, u, p):
    total = 0.0
    for i, row in enumerate(x.reshape(2, 2)):
        s = row[1]
        s *= i + 1
        total += s
    return -x + total


def numbers_by_variable_places(t, x, u, p):
    X, total = x.reshape(2, 2), 0.0
    for i in range(X.shape[0]):
        for j in range(i, X.shape[1]):
            v = X[i, j]
            v += i
            total += v * X[j][i]
    return -x + total


def numbers_of_a_list_of_rows(t, x, u, p):
    rows = list(x.reshape(2, 2))
    a = rows[0][1]
    a += 1.0
    parts = [x[:2], x[2:]]
    b = parts[1][0]
    b -= a
    return -a * b * x


def numbers_of_split(t, x, u, p):
    a, b = np.split(x, 2)
    s = a[0]
    s += b[1]
    return -s * x


def numbers_of_unstack(t, x, u, p):
    first, *others = np.unstack(x)
    first += others[0]
    return -first * x


def numbers_of_transposed(t, x, u, p):
    s = x.reshape(2, 2).T[0][1]
    s += 1.0
    return -s * x


def numbers_of_ravel(t, x, u, p):
    total = 0.0
    for v in x.reshape(2, 2).T.ravel():
        v += 1.0
        total += v
    return -x * total


def numbers_of_atleast(t, x, u, p):
    s = np.atleast_2d(x)[0, 1]
    s += 1.0
    return -s * x


def measures(t, x, u, p):
    X = x.reshape(2, 2)
    n, m = X.shape
    k = x.size
    n -= 1
    k //= m
    return -(n + k) * x


def copy_of_a_row(t, x, u, p):
    r = x.reshape(2, 2)[0].copy()
    r *= 2.0
    X = copy.copy(x.reshape(2, 2))
    X[1] += 1.0
    s = X[0]
    s += r
    return X.ravel()


def chosen_rows_are_copies(t, x, u, p):
    X = x.reshape(2, 2)[[1, 0]]
    X[0] *= 2.0
    Y = x.reshape(2, 2)[ORDER]
    Y += X
    return -Y.ravel()


def product_of_rows(t, x, u, p):
    X = 1.0 * x.reshape(2, 2)
    for row in X:
        row /= 1.0 + row @ row
    return -X.ravel()


def diagonal_of_numbers(t, x, u, p):
    D = np.diag(x)
    D = D + 0.0
    D[0, 0] += 1.0
    return -D @ x


def rows_of_a_list(t, x, u, p):
    X = np.array([x[:2], x[2:]])
    r = X[0]
    r += 1.0
    return -X.ravel()


def numbers_of_a_parameter(t, x, u, p):
    W = p["w"]
    a, b = W[0, 1], W.T[0][1]
    a += 1.0
    b *= 2.0
    for row in W:
        for v in row:
            v += 1.0
            a += v
    return -a * b * x


def numbers_of_records(t, x, u, p):
    m = LINKS["mass"][1]
    m += 1.0
    return -m * x


def row_is_bound_again(t, x, u, p):
    total = np.zeros(2)
    for row in x.reshape(2, 2):
        row = 1.1 * row
        row += 1.0
        total += row
    return -x * total[0]


LEGAL = [
    number_of_an_array, number_of_a_matrix, number_by_shape_in_a_tuple, numbers_taken_apart,
    numbers_of_rows, numbers_of_zip, numbers_of_enumerate, numbers_by_variable_places,
    numbers_of_a_list_of_rows, numbers_of_split, numbers_of_unstack, numbers_of_transposed,
    numbers_of_ravel,
    numbers_of_atleast, measures, copy_of_a_row, chosen_rows_are_copies, product_of_rows,
    diagonal_of_numbers, rows_of_a_list, numbers_of_a_parameter, numbers_of_records,
    row_is_bound_again,
]  # fmt: skip


def block(update):
    params = {"v": np.array(X0), "w": GAINS.copy()}
    return ct.nlsys(update, None, inputs=1, outputs=4, states=4, name="s", params=params)


@pytest.mark.parametrize("update", WRITING, ids=lambda f: f.__name__)
def test_what_writes_through_a_view_changes_what_it_was_given_and_is_refused(update):
    x, values = np.array(X0), {"v": np.array(X0), "w": GAINS.copy()}
    before = [x.copy(), values["v"].copy(), GAINS.copy(), LINKS.copy()]
    update(0.0, x, np.array([1.0]), values)
    after = [x, values["v"], GAINS.copy(), LINKS.copy()]
    GAINS[:], LINKS[:] = before[2:]
    assert not all(map(np.array_equal, before, after))
    with pytest.raises(CompileError, match=r"did not make|changes an element") as refusal:
        nlctl.compile(block(update))
    assert "test_native_purity_views.py, line" in str(refusal.value)


@pytest.mark.parametrize("update", LEGAL, ids=lambda f: f.__name__)
def test_numbers_of_views_and_copies_are_of_the_call(update):
    system = block(update)
    compiled = nlctl.compile(system)
    assert not compiled.equations.calls
    times = np.linspace(0.0, 0.05, 6)
    run = nlctl.input_output_response(compiled, times, 0 * times, X0)
    how = {"rtol": 1e-10, "atol": 1e-12}
    plain = ct.input_output_response(system, times, 0 * times, X0, solve_ivp_kwargs=how)
    np.testing.assert_allclose(run.y, plain.y, rtol=1e-6, atol=1e-8)
