"""Algebraic loops solved inside a program, by Newton's method.

The emitted source repeats the blocks of a loop until the guessed ("torn") signals are what the
blocks make of them:

    loop0 = new_loop(1)
    while searching(loop0):
        y0 = ...                    # reads loop0.guess[0] where it takes the torn signal
        loop0.found[0] = y0[0]
        improve(loop0)

One pass tries one guess: the present one, or one that differs in one signal, for a column of the
Jacobian matrix by a forward difference.  A step that does not bring the two closer together is
halved.  The search begins at 0, then at 1 and -1; of several solutions the one is found that it
reaches first.  Where it ends without a solution the guess is NaN, and `failed` says so.

All this is compiled into every such program, hence loops instead of slices, see `_work`.
"""

from __future__ import annotations

from collections import namedtuple

import numpy as np
from numba.extending import register_jitable

BASE, TRIAL, LAST, DONE = -1, -2, -3, -4  # phases; from 0 on: the column that is being measured
STARTS = (0.0, 1.0, -1.0)
STEPS = 60  # trials from one start, halvings included
SMALL_STEP = 1e-9  # relative; the next one, of about its square, would not be seen
ROUNDING = 4 * 2.0**-52
DIFFERENCE = 2.0**-25
SINGULAR = 1e-7  # relative to the largest entry: what forward differences cannot tell from 0

Search = namedtuple("Search", "guess found base answer norm increment jacobian phase count")
"""A search under way.

``guess`` and ``found`` (n,) are for the program; ``base`` is the best guess so far, ``answer``
what the blocks made of it, ``norm[0]`` the largest difference of the two and ``increment[0]`` the
difference that a column is measured with; ``phase[0]`` is what the next pass is for, ``count``
the trials from this start and the starts so far.
"""


@register_jitable
def new_loop(n):
    """Begin the search for `n` signals."""
    return Search(
        np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n), np.full(1, np.inf), np.zeros(1),
        np.zeros((n, n)), np.full(1, BASE), np.zeros(2, np.int64),
    )  # fmt: skip


@register_jitable
def searching(search):
    """Whether one more pass is needed."""
    return search.phase[0] != DONE


@register_jitable
def failed(search):
    """Whether the search has ended without a solution."""
    for value in search.guess:  # noqa: SIM110 (no generators in machine code)
        if np.isnan(value):
            return True
    return False


@register_jitable
def improve(search):
    """Take in what the blocks made of the guess, and make the next one."""
    phase = search.phase[0]
    if phase == LAST:
        search.phase[0] = DONE
    elif phase >= 0:
        _measured(search, phase)
    else:
        _judged(search)


@register_jitable
def _judged(search):
    """Take the guess as the new base if it is better than the last, otherwise halve the step."""
    norm = 0.0
    for i in range(search.guess.size):
        norm = _larger(search.found[i] - search.guess[i], norm)
    search.count[0] += 1
    if search.phase[0] == TRIAL and norm <= ROUNDING * _largest(search.found):
        search.phase[0] = DONE
    elif norm < search.norm[0]:  # NaN is not; the first norm is infinite
        for i in range(search.guess.size):
            search.base[i], search.answer[i] = search.guess[i], search.found[i]
        search.norm[0] = norm
        _perturbed(search, 0)
    elif search.phase[0] == BASE or search.count[0] > STEPS:
        _start_again(search)
    else:
        for i in range(search.guess.size):
            search.guess[i] = 0.5 * (search.guess[i] + search.base[i])


@register_jitable
def _larger(value, largest):
    """Return the larger magnitude; NaN stays NaN."""
    return abs(value) if abs(value) > largest or np.isnan(value) else largest


@register_jitable
def _largest(values):
    largest = 0.0
    for value in values:
        largest = _larger(value, largest)
    return largest


@register_jitable
def _perturbed(search, column):
    """Guess the base with one signal changed."""
    for i in range(search.guess.size):
        search.guess[i] = search.base[i]
    scale = max(abs(search.base[column]), abs(search.answer[column]))
    search.guess[column] += DIFFERENCE * (scale if scale > 0.0 else 1.0)
    search.increment[0] = search.guess[column] - search.base[column]  # what rounding left of it
    search.phase[0] = column


@register_jitable
def _measured(search, column):
    """Take in a column of the Jacobian matrix; after the last one, make Newton's step."""
    n = search.base.size
    for i in range(n):
        change = search.found[i] - search.answer[i]
        search.jacobian[i, column] = change / search.increment[0]
    search.jacobian[column, column] -= 1.0
    if column + 1 < n:
        _perturbed(search, column + 1)
        return
    step = np.zeros(n)
    for i in range(n):
        step[i] = search.base[i] - search.answer[i]
    if not _solve(search.jacobian, step):
        _start_again(search)
        return
    for i in range(n):
        search.guess[i] = search.base[i] + step[i]
    short = _largest(step) <= SMALL_STEP * _largest(search.guess)
    search.phase[0] = LAST if short else TRIAL


@register_jitable
def _start_again(search):
    """Begin at another guess; after the last one give up with NaN."""
    search.count[0] = 0
    search.count[1] += 1
    search.norm[0] = np.inf
    if search.count[1] < len(STARTS):
        search.phase[0] = BASE
    else:
        search.phase[0] = LAST
    for i in range(search.guess.size):
        search.guess[i] = STARTS[search.count[1]] if search.phase[0] == BASE else np.nan


@register_jitable
def _solve(matrix, b):
    """Replace `b` by the solution of ``matrix @ x = b``; return whether there is one.

    Gaussian elimination with partial pivoting.
    """
    n = b.size
    largest = 1.0
    for i in range(n):
        for j in range(n):
            largest = _larger(matrix[i, j], largest)
    for i in range(n):
        pivot = i
        for k in range(i + 1, n):
            if abs(matrix[k, i]) > abs(matrix[pivot, i]) or np.isnan(matrix[k, i]):
                pivot = k
        if not abs(matrix[pivot, i]) > SINGULAR * largest:  # NaN as well
            return False
        for j in range(n):
            matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
        b[i], b[pivot] = b[pivot], b[i]
        for k in range(i + 1, n):
            factor = matrix[k, i] / matrix[i, i]
            for j in range(n):
                matrix[k, j] -= factor * matrix[i, j]
            b[k] -= factor * b[i]
    for i in range(n - 1, -1, -1):
        known = 0.0
        for j in range(i + 1, n):
            known += matrix[i, j] * b[j]
        b[i] = (b[i] - known) / matrix[i, i]
    return True
